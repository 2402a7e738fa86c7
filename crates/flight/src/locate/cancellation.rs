//! `CancellationToken`: how a caller ends a registration whose answer nobody waits for any more.

use super::error::LocateError;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag that is shared between a caller and its work. Clones share the flag.
#[derive(Debug, Clone, Default)]
pub struct CancellationToken(Arc<AtomicBool>);

impl CancellationToken {
    /// Returns a token that is not cancelled.
    pub fn new() -> Self {
        Self::default()
    }

    /// Cancels the work. The work ends at its next check, within about a second.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether the work is cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Returns an error once the work is cancelled.
    ///
    /// # Errors
    /// [`LocateError::Cancelled`].
    pub fn check(&self) -> Result<(), LocateError> {
        if self.is_cancelled() { Err(LocateError::Cancelled) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clones_share_the_flag() {
        let token = CancellationToken::new();
        let worker = token.clone();
        assert!(worker.check().is_ok());
        token.cancel();
        assert!(matches!(worker.check(), Err(LocateError::Cancelled)));
    }
}
