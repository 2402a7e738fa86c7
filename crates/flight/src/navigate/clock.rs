//! `Clock`: how long registrations take, so that a replay runs alike everywhere.

/// Execution times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    /// t0: of one relative registration, seconds.
    pub relative_s: f64,
    /// Of an absolute registration, whatever it searches, seconds.
    pub fixed_s: f64,
    /// K1: of it for each tile that it searches, seconds.
    pub seconds_per_tile: f64,
}

impl Clock {
    /// t_exe: of an absolute registration over so many tiles, seconds.
    ///
    /// # References
    /// Equation 4, with the constant term that a real search has.
    pub fn execution_s(&self, tiles: usize) -> f64 {
        self.fixed_s + self.seconds_per_tile * tiles as f64
    }
}

impl Default for Clock {
    /// One core of a 2 GHz server: `overfly evaluate cost` and `evaluate motions` print their like.
    fn default() -> Self {
        Self { relative_s: 0.03, fixed_s: 0.05, seconds_per_tile: 0.001 }
    }
}
