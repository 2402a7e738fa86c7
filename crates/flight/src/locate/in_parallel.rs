//! `in_parallel`: independent pieces of work on several threads.

use std::sync::atomic::{AtomicUsize, Ordering};

/// The results of `work` for every item, in the items' order. A thread that is free takes the next item.
pub fn in_parallel<I: Sync, R: Send>(items: &[I], threads: usize, work: &(dyn Fn(&I) -> R + Sync)) -> Vec<R> {
    let threads = threads.min(items.len());
    if threads <= 1 {
        return items.iter().map(work).collect();
    }
    let next = AtomicUsize::new(0);
    let take = || {
        let index = next.fetch_add(1, Ordering::Relaxed);
        items.get(index).map(|item| (index, work(item)))
    };
    let mut done: Vec<(usize, R)> = std::thread::scope(|scope| {
        let handles: Vec<_> =
            (0..threads).map(|_| scope.spawn(|| std::iter::from_fn(take).collect::<Vec<_>>())).collect();
        handles.into_iter().flat_map(|h| h.join().expect("no work panics")).collect()
    });
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, result)| result).collect()
}
