//! `ExecutionTimes`: how long registrations take, stated in advance so that a replay is the same on every machine.

/// A model of execution times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExecutionTimes {
    /// t0: time of one relative registration, seconds.
    pub relative_s: f64,
    /// Constant part of the time of an absolute registration, seconds.
    pub fixed_s: f64,
    /// K1: time of an absolute registration for each tile searched, seconds.
    pub seconds_per_tile: f64,
}

impl ExecutionTimes {
    /// t_exe: time of an absolute registration over a number of tiles, seconds.
    ///
    /// # References
    /// Equation 4, with a constant term added.
    pub fn absolute_s(&self, tiles: usize) -> f64 {
        self.fixed_s + self.seconds_per_tile * tiles as f64
    }
}

impl Default for ExecutionTimes {
    /// Times on one core of a 2 GHz server.
    fn default() -> Self {
        Self { relative_s: 0.03, fixed_s: 0.05, seconds_per_tile: 0.001 }
    }
}
