//! `Interrupt`: Ctrl-C or SIGTERM during work that the same command continues later.

use crate::cli::stop_signal::stop_signal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;

/// The exit code of a program that SIGINT ends: 128 + 2.
const ENDED_BY_INTERRUPT: i32 = 130;

/// Whether the user wants the work to stop.
#[derive(Debug, Clone)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Watches for the signals from now on. The first asks the work to stop; the second ends the program at once.
    ///
    /// # Errors
    /// If the system does not install the handlers.
    pub fn watch() -> std::io::Result<Self> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let came = Arc::new(AtomicBool::new(false));
        let (installed, is_installed) = channel();
        let flag = came.clone();
        std::thread::spawn(move || {
            runtime.block_on(async {
                let first = stop_signal();
                let outcome = first.as_ref().map(|_| ()).map_err(|e| std::io::Error::from(e.kind()));
                let _ = installed.send(outcome);
                let Ok(first) = first else { return };
                first.await;
                flag.store(true, Ordering::Relaxed);
                eprintln!("stopping after the tiles in work; once more stops at once");
                if let Ok(second) = stop_signal() {
                    second.await;
                    std::process::exit(ENDED_BY_INTERRUPT);
                }
            });
        });
        is_installed.recv().unwrap_or(Ok(()))?;
        Ok(Self(came))
    }

    /// Whether a signal has come.
    pub fn came(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
