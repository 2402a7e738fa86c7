//! `Groups`: which layers are joined by pairs (union-find).

/// Sets of layers, joined pair by pair.
pub struct Groups {
    /// For each layer another of its group, or itself.
    towards: Vec<usize>,
}

impl Groups {
    /// Every layer alone.
    pub fn new(layers: usize) -> Self {
        Self { towards: (0..layers).collect() }
    }

    /// The layer that stands for the group of one: the first of the store.
    pub fn first_of(&self, mut layer: usize) -> usize {
        while self.towards[layer] != layer {
            layer = self.towards[layer];
        }
        layer
    }

    /// Whether two layers belong to one group.
    pub fn is_joined(&self, a: usize, b: usize) -> bool {
        self.first_of(a) == self.first_of(b)
    }

    /// Makes one group of two.
    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.first_of(a), self.first_of(b));
        self.towards[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joined_pairs_are_one_group() {
        let mut groups = Groups::new(6);
        for (a, b) in [(4, 5), (2, 4), (0, 1)] {
            groups.join(a, b);
        }
        assert_eq!((0..6).map(|layer| groups.first_of(layer)).collect::<Vec<_>>(), [0, 0, 2, 3, 2, 2]);
        assert!(groups.is_joined(2, 5) && !groups.is_joined(1, 2));
    }
}
