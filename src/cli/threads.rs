//! The default number of threads.

use std::num::NonZeroUsize;

/// The number of threads that the machine runs at once; 1 if the system does not say.
pub fn default_threads() -> NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}
