//! `Shelf`: what was worked out of tiles, kept while there is room.

use overfly_core::tile::TileId;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Results by layer (its index) and tile, `None` where there is nothing. Those used least recently go first.
#[derive(Debug)]
pub(super) struct Shelf<V> {
    most: usize,
    kept: Mutex<Kept<V>>,
}

type Key = (usize, TileId);

#[derive(Debug)]
struct Kept<V> {
    entries: HashMap<Key, Entry<V>>,
    clock: u64,
}

#[derive(Debug)]
struct Entry<V> {
    used: u64,
    value: Option<Arc<V>>,
}

impl<V> Shelf<V> {
    /// For at most `most` results; absences are counted as results.
    pub fn new(most: usize) -> Self {
        Self { most: most.max(1), kept: Mutex::new(Kept { entries: HashMap::new(), clock: 0 }) }
    }

    /// What is kept, or else what `make` gives. Two threads may make the same result; one of them is kept.
    pub fn get<E>(&self, key: Key, make: impl FnOnce() -> Result<Option<V>, E>) -> Result<Option<Arc<V>>, E> {
        if let Some(value) = self.lock().find(key) {
            return Ok(value);
        }
        let value = make()?.map(Arc::new);
        self.lock().keep(key, value.clone(), self.most);
        Ok(value)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Kept<V>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<V> Kept<V> {
    fn find(&mut self, key: Key) -> Option<Option<Arc<V>>> {
        self.clock += 1;
        let entry = self.entries.get_mut(&key)?;
        entry.used = self.clock;
        Some(entry.value.clone())
    }

    fn keep(&mut self, key: Key, value: Option<Arc<V>>, most: usize) {
        if self.entries.len() >= most && !self.entries.contains_key(&key) {
            let oldest = self.entries.iter().min_by_key(|(_, entry)| entry.used).map(|(key, _)| *key);
            oldest.map(|key| self.entries.remove(&key));
        }
        self.entries.insert(key, Entry { used: self.clock, value });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    #[test]
    fn keeps_what_was_used_last() {
        let shelf = Shelf::new(2);
        let tile = |column| (0, TileId::new(3, column, 0).unwrap());
        let get =
            |column: u32, value| shelf.get(tile(column), || Ok::<_, Infallible>(Some(value))).unwrap().map(|v| *v);
        assert_eq!([get(0, 10), get(1, 11), get(0, 99), get(2, 12)], [Some(10), Some(11), Some(10), Some(12)]);
        // 1 was used least recently.
        assert_eq!([get(0, 99), get(1, 77)], [Some(10), Some(77)]);
    }

    #[test]
    fn keeps_absence_but_no_failure() {
        let shelf: Shelf<u8> = Shelf::new(2);
        let key = (0, TileId::new(3, 0, 0).unwrap());
        assert_eq!(shelf.get(key, || Err("torn")), Err("torn"));
        assert_eq!(shelf.get(key, || Ok::<_, &str>(None)), Ok(None));
        assert_eq!(shelf.get(key, || Err("torn")), Ok(None));
    }
}
