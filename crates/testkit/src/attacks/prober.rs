//! `Prober`: asks a service for its health over and over, and measures how long the answers take.

use crate::soak::client::{HttpClient, get, read};
use std::io::{BufReader, Write};
use std::time::{Duration, Instant};

/// Time between two questions.
const PERIOD: Duration = Duration::from_millis(50);
/// A question that is not answered within this time counts as so long.
const MOST: Duration = Duration::from_secs(20);

/// How long the answers took, milliseconds, in order.
#[derive(Debug, Clone, Default)]
pub struct ProbeTimes {
    sorted_ms: Vec<f64>,
    /// Questions without the answer 200.
    pub failed: usize,
}

impl ProbeTimes {
    /// Asks until `end`, each time on a new connection, as a supervisor does.
    pub fn measure(address: &str, end: Instant) -> Self {
        let mut times = Self::default();
        while Instant::now() < end {
            let start = Instant::now();
            times.failed += usize::from(!asked(address).is_ok_and(|status| status == 200));
            let elapsed = start.elapsed();
            times.sorted_ms.push(elapsed.as_secs_f64() * 1e3);
            std::thread::sleep(PERIOD.saturating_sub(elapsed));
        }
        times.sorted_ms.sort_by(f64::total_cmp);
        times
    }

    /// The longest, milliseconds.
    pub fn worst_ms(&self) -> f64 {
        self.sorted_ms.last().copied().unwrap_or(f64::NAN)
    }

    /// The time that a share of the answers does not exceed, milliseconds.
    pub fn quantile_ms(&self, share: f64) -> f64 {
        let at = (self.sorted_ms.len() as f64 * share).ceil() as usize;
        self.sorted_ms.get(at.saturating_sub(1)).copied().unwrap_or(f64::NAN)
    }

    /// The number of questions.
    pub fn count(&self) -> usize {
        self.sorted_ms.len()
    }
}

fn asked(address: &str) -> std::io::Result<u16> {
    let mut stream = HttpClient::new(address).connect()?;
    stream.set_read_timeout(Some(MOST))?;
    stream.write_all(&get("/healthz"))?;
    Ok(read(&mut BufReader::new(stream))?.0.status)
}
