//! `CancellationToken`: how a caller ends a registration whose answer nobody waits for any more.

use super::error::LocateError;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A flag that is shared between a caller and its work. Clones share the flag.
#[derive(Debug, Clone, Default)]
pub struct CancellationToken(Arc<Node>);

#[derive(Debug, Default)]
struct Node {
    is_cancelled: AtomicBool,
    /// From then on the work counts as cancelled.
    deadline: Option<Instant>,
    parent: Option<CancellationToken>,
}

impl CancellationToken {
    /// Returns a token that is not cancelled.
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns a token for a part of the work: cancelled by itself, and with this one.
    pub fn child(&self) -> Self {
        Self(Arc::new(Node { parent: Some(self.clone()), ..Node::default() }))
    }

    /// As [`CancellationToken::child`], and cancelled once `limit` has passed.
    pub fn child_within(&self, limit: Duration) -> Self {
        let deadline = Instant::now().checked_add(limit);
        Self(Arc::new(Node { deadline, parent: Some(self.clone()), ..Node::default() }))
    }

    /// Cancels the work. The work ends at its next check, within about a second.
    pub fn cancel(&self) {
        self.0.is_cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether the work is cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.0.is_cancelled.load(Ordering::Relaxed)
            || self.0.deadline.is_some_and(|deadline| Instant::now() >= deadline)
            || self.0.parent.as_ref().is_some_and(Self::is_cancelled)
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

    #[test]
    fn a_part_ends_with_the_whole_and_the_whole_goes_on_without_it() {
        let whole = CancellationToken::new();
        let (part, other) = (whole.child(), whole.child());
        part.cancel();
        assert!(part.is_cancelled() && !whole.is_cancelled() && !other.is_cancelled());
        whole.cancel();
        assert!(other.is_cancelled());
    }

    #[test]
    fn a_limit_of_time_cancels_the_part_alone() {
        let whole = CancellationToken::new();
        assert!(whole.child_within(Duration::ZERO).is_cancelled());
        assert!(!whole.child_within(Duration::from_secs(3600)).is_cancelled() && !whole.is_cancelled());
        assert!(!whole.child_within(Duration::MAX).is_cancelled(), "no clock reaches it");
    }
}
