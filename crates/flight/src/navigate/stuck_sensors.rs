//! `StuckSensors`: readings that do not change from image to image.

use super::measurements::SensorReading;

/// Images in a row with the very same reading, the first not counted, after which it is none. Every sensor has noise; one that reads
/// whole degrees may repeat a reading in level flight, and then loses little.
const MOST_REPETITIONS: u32 = 3;

/// Compass and altimeter, as far as the next reading is compared with the last.
#[derive(Debug, Clone)]
pub struct StuckSensors {
    last: SensorReading,
    /// Images in a row that repeat the reading of the compass, and of the altimeter.
    repetitions: [u32; 2],
}

impl StuckSensors {
    /// Starts with the first reading.
    pub fn new(first: SensorReading) -> Self {
        Self { last: first, repetitions: [0; 2] }
    }

    /// Takes the next reading, and returns it without the sensors that are stuck.
    pub fn checked(&mut self, reading: SensorReading) -> SensorReading {
        let last = std::mem::replace(&mut self.last, reading);
        let mut keep = |sensor: usize, value: f64, before: f64| {
            // Not a number equals nothing.
            self.repetitions[sensor] = if value == before { self.repetitions[sensor] + 1 } else { 0 };
            if self.repetitions[sensor] < MOST_REPETITIONS { value } else { f64::NAN }
        };
        SensorReading {
            heading_rad: keep(0, reading.heading_rad, last.heading_rad),
            height_m: keep(1, reading.height_m, last.height_m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_that_does_not_change_is_none_until_it_does() {
        let reading = |heading_rad, height_m| SensorReading { heading_rad, height_m };
        let mut sensors = StuckSensors::new(reading(1.0, 500.0));
        for i in 1..3 {
            let next = reading(1.0, 500.0 + f64::from(i));
            assert_eq!(sensors.checked(next), next);
        }
        for _ in 0..5 {
            let stuck = sensors.checked(reading(1.0, 510.0));
            assert!(stuck.heading_rad.is_nan());
        }
        let moved = sensors.checked(reading(1.1, 510.0));
        assert!(moved.heading_rad == 1.1 && moved.height_m.is_nan());
        assert!(sensors.checked(reading(f64::NAN, f64::NAN)).heading_rad.is_nan());
        assert_eq!(sensors.checked(reading(1.1, 511.0)), reading(1.1, 511.0));
    }
}
