//! Attacks `overfly serve` with 100 clients at a time, under a limit of its address space, and measures how long `/healthz` takes
//! meanwhile, beside that of a service that nobody attacks.
//!
//! ```sh
//! cargo build --release && cargo run --release -p overfly-testkit --example attacks -- --seconds 20
//! ```

use clap::Parser;
use overfly_testkit::attacks::attack::Attack;
use overfly_testkit::attacks::material::AttackMaterial;
use overfly_testkit::attacks::run::{AttackResult, run};
use overfly_testkit::soak::client::ServedStore;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::Duration;

/// The longest that `/healthz` may take, milliseconds, besides what it takes where nobody attacks.
const MOST_MS: f64 = 100.0;

/// Attacks the service.
#[derive(Parser)]
struct Args {
    /// How long each attack lasts, seconds.
    #[arg(long, default_value_t = 20.0)]
    seconds: f64,
    /// Clients at the same time.
    #[arg(long, default_value_t = 100)]
    clients: usize,
    /// Address space of the service, MiB (RLIMIT_AS).
    #[arg(long, default_value_t = 1024)]
    space_mib: u64,
    /// The service's `--memory`, MB.
    #[arg(long, default_value_t = 128)]
    memory_mb: u64,
    /// Most memory that the service may hold onboard, MB.
    #[arg(long, default_value_t = 200)]
    most_onboard_mb: u64,
    /// Most memory that the service may hold on the ground, MB: there `--memory` limits its indexes alone.
    #[arg(long, default_value_t = 400)]
    most_ground_mb: u64,
    /// Only attacks whose name contains this.
    #[arg(long, default_value = "")]
    only: String,
    /// The program; beside this one's folder by default.
    #[arg(long)]
    program: Option<std::path::PathBuf>,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let beside = || std::env::current_exe().expect("this program's place").with_file_name("../overfly");
    let program = args.program.clone().unwrap_or_else(beside);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let material = AttackMaterial::make(folder.path());
    let mut failures = Vec::new();
    for is_onboard in [true, false] {
        let start =
            |name: &str, mib: u64| serve(&program, &material.store, is_onboard, &args, &folder.path().join(name), mib);
        let mut attacked = start("log", args.space_mib);
        let idle = start("idle", args.space_mib);
        let (place, most_mb) =
            if is_onboard { ("onboard", args.most_onboard_mb) } else { ("on the ground", args.most_ground_mb) };
        println!(
            "{place}, --memory {}MB, {} MiB of address space, {} clients, {} s each; memory held at most {most_mb} MB",
            args.memory_mb, args.space_mib, args.clients, args.seconds
        );
        println!(
            "{:<30} {:>7} {:>9} {:>8} {:>9} {:>8} {:>6} {:>7}  answers",
            "attack", "asked", "worst ms", "99 % ms", "idle: ms", "99 % ms", "MB", "restart"
        );
        for attack in Attack::ALL.into_iter().filter(|a| a.name().contains(&args.only)) {
            let time = Duration::from_secs_f64(args.seconds);
            let result = run(attack, &material, &mut attacked, &idle, args.clients, time);
            print_row(attack, &result);
            failures
                .extend(wrong(&result, most_mb).into_iter().map(|what| format!("{place}, {}: {what}", attack.name())));
            if !result.lives {
                let log = std::fs::read_to_string(folder.path().join("log")).unwrap_or_default();
                log.lines().rev().take(3).for_each(|line| println!("  {line}"));
                attacked = start("log", args.space_mib);
            }
        }
        println!("most address space: {} MiB\n", attacked.memory_kb("VmPeak") >> 10);
    }
    failures.iter().for_each(|failure| println!("{failure}"));
    if failures.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// What is wrong with a result.
fn wrong(result: &AttackResult, most_mb: u64) -> Vec<String> {
    let mut all = Vec::new();
    if !result.lives {
        all.push("the service ended".to_owned());
    }
    if result.health.failed > 0 {
        all.push(format!("{} questions for its health failed", result.health.failed));
    }
    if result.health.worst_ms() > MOST_MS + result.noise.worst_ms() {
        all.push(format!(
            "/healthz took {:.0} ms, {:.0} ms on an idle service",
            result.health.worst_ms(),
            result.noise.worst_ms()
        ));
    }
    if result.resident_kb > most_mb * 1000 {
        all.push(format!("{} MB held", result.resident_kb / 1000));
    }
    all
}

/// Starts the service with a limit of its address space.
fn serve(program: &Path, db: &Path, is_onboard: bool, args: &Args, log: &Path, space_mib: u64) -> ServedStore {
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit -v {}; exec \"$0\" \"$@\"", space_mib << 10)]).arg(program);
    command.args(["serve", "--listen", "127.0.0.1:0", "--memory", &format!("{}MB", args.memory_mb), "--db"]).arg(db);
    if is_onboard {
        command.arg("--onboard");
    }
    ServedStore::start_command(command, log).expect("the service starts")
}

fn print_row(attack: Attack, result: &AttackResult) {
    let AttackResult { health, noise, resident_kb, answers, lives } = result;
    let answers: Vec<String> = answers.iter().map(|(status, count)| format!("{status}: {count}")).collect();
    println!(
        "{:<30} {:>7} {:>9.1} {:>8.1} {:>9.1} {:>8.1} {:>6.1} {:>7}  {}",
        attack.name(),
        health.count(),
        health.worst_ms(),
        health.quantile_ms(0.99),
        noise.worst_ms(),
        noise.quantile_ms(0.99),
        *resident_kb as f64 / 1e3,
        u8::from(!lives),
        answers.join(", ")
    );
}
