//! `overfly serve`: the HTTP service.

mod allocator;

use super::verify::today;
use super::{Exit, Failure, Output};
use crate::server::{Environment, Limits, Listen, Service, ServiceState, Supervisor, serve};
use anyhow::Context;
use overfly_store::Reader;
use overfly_store::package::{PublicKey, StalePolicy, open_onboard};
use std::io::IsTerminal;
use std::path::PathBuf;

const HELP: &str = "\
GET / is a map page, GET /openapi.json describes every route. Stops on ctrl-c or SIGTERM. OVERFLY_LOG sets what is
logged on standard error (error, warn, info, debug; info by default).

Examples:
  overfly serve --db map.gpkg
  overfly serve --db map.gpkg --onboard --listen unix:/run/overfly.sock
  overfly serve --db flight.gpkg --onboard --require-signature ground.key.pub --stale-after-days 730=warn

Onboard, an exported store's seal, manifest and signature and every footprint are proved before the service starts, a store past
its last day is refused, and each tile's hash is proved when it is read: a damaged one is neither served nor matched, and
/healthz says so. Age is judged at the start alone: nothing is taken away in flight. systemd is told of readiness, life and
the end (Type=notify, WatchdogSec); docs/onboard.md has a unit.";

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The store.
    #[arg(long, value_name = "FILE")]
    db: PathBuf,
    /// HOST:PORT (port 0: a free one) or unix:/path/to/socket.
    #[arg(long, default_value = "127.0.0.1:8787", value_name = "ADDRESS")]
    listen: String,
    /// As on the aircraft: the store is opened immutable and read-only, no route writes.
    #[arg(long)]
    onboard: bool,
    /// Serve only a store that is signed by this public key (see `overfly keygen`, `overfly export --sign`).
    #[arg(long, value_name = "PUB", requires = "onboard")]
    require_signature: Option<PathBuf>,
    /// What to do with a layer whose oldest imagery is older than so many days: `730=warn`, `730=refuse`, or of one layer
    /// `y2012:3650=refuse`. May be given again. Unknown dates are older than any.
    #[arg(long, value_name = "[LAYER:]DAYS=ACTION", requires = "onboard")]
    stale_after_days: Vec<StalePolicy>,
    /// Memory, as 128MB or 1GB; a plain number is megabytes. On the ground for indexes, 256MB by default. Onboard for all that
    /// the service holds besides itself (some 40 MB), 512MB by default: frames are taken up to about a 23rd of it in pixels.
    #[arg(long, value_name = "SIZE", value_parser = super::number::memory_bytes)]
    memory: Option<u64>,
}

/// Serves until SIGTERM or ctrl-c.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    if args.onboard {
        allocator::spare();
    }
    let listen: Listen = args.listen.parse().map_err(|e: crate::server::ListenError| Failure::unusable(e.code(), e))?;
    let key = args.require_signature.as_deref().map(PublicKey::read).transpose()?;
    log();
    log_panics();
    let limits = limits(args);
    let (service, store, warnings) = if args.onboard {
        let opened = open_onboard(&args.db, key.as_ref(), &args.stale_after_days, today())?;
        let warnings: Vec<String> = opened.findings.into_iter().map(|f| f.message).collect();
        warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
        (Service::Onboard, opened.store.with_cache_limits(limits.keep)?, warnings)
    } else {
        (Service::Preflight, Reader::open(&args.db)?, Vec::new())
    };
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .context("cannot start the threads of the service")
        .map_err(|e| Failure::failed("threads", e))?;
    let state = ServiceState::new(store, service, limits).with_warnings(warnings);
    let outcome = runtime.block_on(async {
        let stop = stop_signal().map_err(|e| Failure::failed("signals", e))?;
        let started = |at: &Listen| {
            output.say(&serde_json::json!({"listening": at.to_string(), "service": service}), || {
                format!("listening on {at}")
            });
        };
        serve(&listen, state, supervisor(), started, stop).await.map_err(|e| Failure::failed(e.code(), e))
    });
    // A registration still at work would hold the exit; its answer has nobody to go to.
    runtime.shutdown_background();
    outcome.map(|()| Exit::Done)
}

/// Onboard the whole service keeps within what is allowed, on the ground its indexes do.
fn limits(args: &Args) -> Limits {
    match args.memory {
        bytes if args.onboard => Limits::within(bytes.unwrap_or(512_000_000)),
        bytes => Limits { index_bytes: bytes.unwrap_or(256_000_000), ..Limits::default() },
    }
}

/// Who started the service, as systemd states it.
fn supervisor() -> Supervisor {
    let text = |name| std::env::var(name).ok();
    let environment = Environment {
        notify_socket: std::env::var_os("NOTIFY_SOCKET"),
        watchdog_usec: text("WATCHDOG_USEC"),
        watchdog_pid: text("WATCHDOG_PID"),
    };
    Supervisor::of(&environment, std::process::id())
}

/// A panic is a line of the log, with its place; what it broke off answers 500.
fn log_panics() {
    std::panic::set_hook(Box::new(|panic| tracing::error!("a panic: {panic}")));
}

fn log() {
    let filter = tracing_subscriber::EnvFilter::try_from_env("OVERFLY_LOG").unwrap_or_else(|_| "info".into());
    // A second subscriber is refused, which only tests in one process can notice.
    let colours = std::io::stderr().is_terminal();
    let _ =
        tracing_subscriber::fmt().with_env_filter(filter).with_ansi(colours).with_writer(std::io::stderr).try_init();
}

/// Ready once the process is told to stop; the handlers stand when this returns.
fn stop_signal() -> std::io::Result<impl Future<Output = ()> + Send + 'static> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    Ok(async move {
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
    })
}
