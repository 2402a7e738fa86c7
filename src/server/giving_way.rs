//! `GivingWay`: work that can be left out ends when a registration waits for its place.

use overfly_flight::locate::CancellationToken;
use parking_lot::Mutex;
use std::sync::Arc;

/// The registrations that wait for a place, and the work that ends for them.
#[derive(Debug, Clone, Default)]
pub(super) struct GivingWay(Arc<Mutex<Traffic>>);

#[derive(Debug, Default)]
struct Traffic {
    waiting: usize,
    optional: Vec<CancellationToken>,
}

/// A registration that waits, until dropped.
pub(super) struct Waiting(GivingWay);

/// Work that ends when a registration waits. Drop this when the work has ended.
pub(super) struct OptionalWork {
    way: GivingWay,
    token: CancellationToken,
}

impl GivingWay {
    /// Cancels all optional work, and all that begins before the result is dropped.
    pub(super) fn wait(&self) -> Waiting {
        let mut traffic = self.0.lock();
        traffic.waiting += 1;
        traffic.optional.drain(..).for_each(|token| token.cancel());
        Waiting(self.clone())
    }

    /// Begins optional work as a part of the work of `whole`.
    pub(super) fn begin_optional(&self, whole: &CancellationToken) -> OptionalWork {
        let token = whole.child();
        let mut traffic = self.0.lock();
        if traffic.waiting > 0 {
            token.cancel();
        } else {
            traffic.optional.push(token.clone());
        }
        drop(traffic);
        OptionalWork { way: self.clone(), token }
    }
}

impl OptionalWork {
    /// The token of the work.
    pub(super) fn token(&self) -> &CancellationToken {
        &self.token
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        self.0.0.lock().waiting -= 1;
    }
}

impl Drop for OptionalWork {
    fn drop(&mut self) {
        // Its token is taken off the list with all others that ended.
        self.token.cancel();
        self.way.0.lock().optional.retain(|token| !token.is_cancelled());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn optional_work_ends_while_a_registration_waits_and_begins_again_afterwards() {
        let (way, whole) = (GivingWay::default(), CancellationToken::new());
        let begun = way.begin_optional(&whole);
        assert!(!begun.token().is_cancelled());
        let waiting = way.wait();
        assert!(begun.token().is_cancelled() && !whole.is_cancelled());
        assert!(way.begin_optional(&whole).token().is_cancelled(), "somebody waits");
        drop(waiting);
        let (again, other) = (way.begin_optional(&whole), way.begin_optional(&whole));
        assert!(!again.token().is_cancelled());
        drop(other);
        assert_eq!(way.0.lock().optional.len(), 1);
        whole.cancel();
        assert!(again.token().is_cancelled(), "it is a part of the whole");
    }
}
