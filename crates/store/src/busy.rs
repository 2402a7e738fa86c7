//! Waiting for the transaction of another program, and who is told of it.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::thread::sleep;
use std::time::Duration;

/// The longest wait for a transaction of another program.
const LONGEST: Duration = Duration::from_secs(20);
/// The time between two attempts.
const STEP: Duration = Duration::from_millis(10);

/// What is told how long this thread has waited; it may end the waiting.
type OnWait = Box<dyn FnMut(Duration) -> ControlFlow<()>>;

thread_local! {
    // A busy handler of SQLite is a plain function.
    static ON_WAIT: RefCell<Option<OnWait>> = const { RefCell::new(None) };
}

/// Runs work that writes to a store on this thread. While another program's transaction is in the way, `on_wait` is told every few
/// milliseconds for how long; where it breaks off, the work ends with [`crate::StoreError::Busy`], as after the longest wait.
pub fn while_waiting<T>(on_wait: impl FnMut(Duration) -> ControlFlow<()> + 'static, work: impl FnOnce() -> T) -> T {
    struct Reset;
    impl Drop for Reset {
        fn drop(&mut self) {
            ON_WAIT.set(None);
        }
    }
    ON_WAIT.set(Some(Box::new(on_wait)));
    let _reset = Reset;
    work()
}

/// The busy handler of connections that write: waits, and says whether to try again.
pub fn wait(attempts: i32) -> bool {
    let waited = STEP * attempts.unsigned_abs();
    let goes_on = ON_WAIT.with_borrow_mut(|told| told.as_mut().is_none_or(|told| told(waited).is_continue()));
    let goes_on = goes_on && waited < LONGEST;
    if goes_on {
        sleep(STEP);
    }
    goes_on
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_is_told_and_ends_when_asked_to() {
        assert!(wait(0) && !wait(2000), "nobody is told");
        let going_on = while_waiting(
            |waited| {
                if waited < Duration::from_millis(30) { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
            },
            || [0, 2, 3].map(wait),
        );
        assert_eq!(going_on, [true, true, false]);
        assert!(wait(3), "nobody is told any more");
    }
}
