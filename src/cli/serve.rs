//! `overfly serve`: the HTTP service.

mod access;
mod allocator;
#[cfg(feature = "preflight")]
mod exports;
mod opening;

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::stop_signal::stop_signal;
use crate::cli::threads::default_threads;
use crate::server::{Limits, Listen, ListenError, Service, ServiceState, Supervisor, serve};
use crate::today::today;
use access::AccessArgs;
use anyhow::Context;
use opening::Opening;
use overfly_store::package::{PublicKey, StalePolicy};
use parking_lot::Mutex;
use std::io::{ErrorKind, IsTerminal};
use std::path::PathBuf;

const HELP: &str = "\
GET / is a map page; GET /openapi.json describes every route. The service stops on ctrl-c or SIGTERM. OVERFLY_LOG sets the log
level on standard error (error, warn, info, debug; info by default).

Examples:
  overfly serve --db map.gpkg
  overfly serve --db map.gpkg --onboard --listen unix:/run/overfly.sock
  overfly serve --db map.gpkg --listen 0.0.0.0:8787 --token-file token
  overfly serve --db flight.gpkg --onboard --require-signature ground.key.pub --stale-after-days 730=warn

With --onboard, the seal, manifest and signature of an exported store and all its footprints are verified before the service starts,
and a store past its last day is refused. Each tile's hash is verified when the tile is read; a damaged tile is neither served nor
matched, and /healthz reports it. The age of the imagery is checked only at the start, so nothing disappears in flight. A store that is
replaced (by a rename) or built anew is checked in the same way and then served; onboard, its serial must not be lower than that of
the store before. The service notifies systemd (Type=notify, WatchdogSec).

A Unix socket is open to its owner only. TLS is the work of a reverse proxy. docs/onboard.md has its settings and a unit file.";

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The store.
    #[arg(long, value_name = "FILE")]
    db: PathBuf,
    /// HOST:PORT (port 0 takes a free one) or unix:/path/to/socket.
    #[arg(long, default_value = "127.0.0.1:8787", value_name = "ADDRESS")]
    listen: String,
    /// Serve as on the aircraft: the store is opened immutable and read-only, and no route writes.
    #[arg(long)]
    onboard: bool,
    /// Serve the store only if this public key verifies its signature (see `overfly keygen`, `overfly export --sign`).
    #[arg(long, value_name = "PUB", requires = "onboard")]
    require_signature: Option<PathBuf>,
    /// What to do if the oldest imagery of a layer is older than DAYS: `730=warn` or `730=refuse`; for one layer,
    /// `y2012:3650=refuse`. May be repeated. Imagery without a date counts as oldest.
    #[arg(long, value_name = "[LAYER:]DAYS=ACTION", requires = "onboard")]
    stale_after_days: Vec<StalePolicy>,
    /// Refuse an exported store whose serial is lower (see `overfly export --serial`).
    #[arg(long, value_name = "N", requires = "onboard")]
    least_serial: Option<u64>,
    /// Fly a store of a lower serial than --least-serial nevertheless.
    #[arg(long, requires = "least_serial")]
    allow_older: bool,
    /// Memory limit, such as 128MB or 1GB; a plain number is megabytes. On the ground it limits the indexes (256MB by default).
    /// Onboard it limits all that the service holds besides the program itself (512MB by default; the program takes about 40 MB);
    /// the largest frame has about SIZE / 23 pixels.
    #[arg(long, value_name = "SIZE", value_parser = crate::cli::number::memory_bytes)]
    memory: Option<u64>,
    #[command(flatten)]
    access: AccessArgs,
    #[cfg(feature = "preflight")]
    #[command(flatten)]
    exports: exports::ExportArgs,
}

/// Serves until SIGTERM or ctrl-c.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    if !args.onboard && !cfg!(feature = "preflight") {
        let reason = "this program is built without the feature `preflight`: it serves only with --onboard";
        return Err(Failure::unusable("built_without_preflight", anyhow::anyhow!(reason)));
    }
    allocator::limit_heaps(if args.onboard { 2 } else { default_threads().get().max(2) });
    let listen: Listen = args.listen.parse().map_err(|e: ListenError| Failure::unusable(e.code(), e))?;
    let access = args.access.access(&listen)?;
    let key = args.require_signature.as_deref().map(PublicKey::read).transpose().map_err(Failure::of_crew)?;
    log();
    log_panics();
    let limits = limits(args);
    let opening = Opening {
        db: args.db.clone(),
        is_onboard: args.onboard,
        key,
        policies: args.stale_after_days.clone(),
        least_serial: Mutex::new(args.least_serial.filter(|_| !args.allow_older)),
        today: today(),
        keep: limits.keep,
    };
    let (store, warnings) = opening.open()?;
    let service = if args.onboard { Service::Onboard } else { Service::Preflight };
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .context("cannot start the threads of the service")
        .map_err(|e| Failure::failed("threads", e))?;
    let state = ServiceState::new(store, service, limits)
        .with_warnings(warnings)
        .with_access(access)
        .with_reopening(move || opening.reopen());
    let outcome = runtime.block_on(async {
        let stop = stop_signal().map_err(|e| Failure::failed("signals", e))?;
        let started = |at: &Listen| {
            output.say(&serde_json::json!({"listening": at.to_string(), "service": service}), || {
                format!("listening on {at}")
            });
        };
        serve(&listen, state, Supervisor::from_environment(), started, stop).await.map_err(|error| {
            let in_use = matches!(&error, ListenError::Bind { cause, .. } if cause.kind() == ErrorKind::AddrInUse);
            let remedy = in_use.then_some("stop the program that has it, or choose another port with --listen");
            Failure::failed(error.code(), error).with_remedy(remedy)
        })
    });
    // A registration that still runs would delay the exit, and nobody waits for its answer.
    runtime.shutdown_background();
    outcome.map(|()| Exit::Done)
}

/// The limits of the service: --memory sets them onboard for the whole service, on the ground for its indexes.
fn limits(args: &Args) -> Limits {
    match args.memory {
        bytes if args.onboard => Limits::within(bytes.unwrap_or(512_000_000)),
        bytes => Limits {
            index_bytes: bytes.unwrap_or(256_000_000),
            #[cfg(feature = "preflight")]
            exports: args.exports.limits(),
            ..Limits::default()
        },
    }
}

/// Logs every panic with its place in the source. The request that panicked answers 500.
fn log_panics() {
    std::panic::set_hook(Box::new(|panic| tracing::error!("a panic: {panic}")));
}

fn log() {
    let filter = tracing_subscriber::EnvFilter::try_from_env("OVERFLY_LOG").unwrap_or_else(|_| "info".into());
    // Fails only if a subscriber exists already, as in tests that share a process.
    let colours = std::io::stderr().is_terminal();
    let _ =
        tracing_subscriber::fmt().with_env_filter(filter).with_ansi(colours).with_writer(std::io::stderr).try_init();
}
