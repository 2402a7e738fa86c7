//! `SequenceFault`: what happens to a stretch of a recorded flight: the camera shows other images, a sensor or the clock lies.

use super::tape::{Drawing, TapeRow};
use overfly_core::camera::Attitude;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A kind of fault. Its place in the flight is drawn by a seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SequenceFault {
    /// Five equal images.
    FrozenShort,
    /// Ten equal images.
    Frozen,
    /// Ten images that are equal but for noise and brightness.
    FrozenNoisy,
    /// Half of each of six images is that of an earlier one.
    HalfFrozen,
    /// The last ten images are shown again.
    Replayed,
    /// The last ten images are shown again, with noise.
    ReplayedNoisy,
    /// Twelve images of another part of the flight.
    ReplayedElsewhere,
    /// The next ten images are shown in reverse order.
    Reversed,
    /// The last ten images are shown backwards, with noise.
    PlayedBackwards,
    /// Eight images change places two by two.
    Swapped,
    /// Three images are missing.
    Dropped,
    /// The compass is off by 180 degrees for 15 images.
    CompassReversed,
    /// The compass drifts by a degree an image, for 25 images.
    CompassDrift,
    /// The compass has a noise of 40 degrees for eight images.
    CompassNoise,
    /// The compass shows the same for 15 images.
    CompassStuck,
    /// The altimeter reads 1.3 times too high for 15 images.
    AltimeterHigh,
    /// The altimeter reads 0.7 times too low for 15 images.
    AltimeterLow,
    /// The altimeter shows the same for 20 images.
    AltimeterStuck,
    /// An interval is a tenth of what it was, so that the motion takes 450 m/s; all later times follow.
    TimeJump,
    /// The time of one image is 600 s late.
    TimeLate,
    /// The time of one image is 60 s early.
    TimeBack,
    /// Three images have the time of the image before.
    TimeRepeated,
    /// The clock is set back by 5,000 s.
    ClockSet,
    /// One height is 0.
    HeightZero,
    /// One height is negative.
    HeightNegative,
    /// One row has no number at all.
    NoNumbers,
    /// An overlay of text and lines in all images.
    Overlay,
    /// Dust on the lens in all images.
    Dust,
    /// A wing covers a corner of all images.
    Wing,
}

impl SequenceFault {
    /// All kinds.
    pub const ALL: [Self; 29] = [
        Self::FrozenShort,
        Self::Frozen,
        Self::FrozenNoisy,
        Self::HalfFrozen,
        Self::Replayed,
        Self::ReplayedNoisy,
        Self::ReplayedElsewhere,
        Self::Reversed,
        Self::PlayedBackwards,
        Self::Swapped,
        Self::Dropped,
        Self::CompassReversed,
        Self::CompassDrift,
        Self::CompassNoise,
        Self::CompassStuck,
        Self::AltimeterHigh,
        Self::AltimeterLow,
        Self::AltimeterStuck,
        Self::TimeJump,
        Self::TimeLate,
        Self::TimeBack,
        Self::TimeRepeated,
        Self::ClockSet,
        Self::HeightZero,
        Self::HeightNegative,
        Self::NoNumbers,
        Self::Overlay,
        Self::Dust,
        Self::Wing,
    ];

    /// The word on the command line and in tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::FrozenShort => "frozen-short",
            Self::Frozen => "frozen",
            Self::FrozenNoisy => "frozen-noisy",
            Self::HalfFrozen => "half-frozen",
            Self::Replayed => "replayed",
            Self::ReplayedNoisy => "replayed-noisy",
            Self::ReplayedElsewhere => "replayed-elsewhere",
            Self::Reversed => "reversed",
            Self::PlayedBackwards => "played-backwards",
            Self::Swapped => "swapped",
            Self::Dropped => "dropped",
            Self::CompassReversed => "compass-reversed",
            Self::CompassDrift => "compass-drift",
            Self::CompassNoise => "compass-noise",
            Self::CompassStuck => "compass-stuck",
            Self::AltimeterHigh => "altimeter-high",
            Self::AltimeterLow => "altimeter-low",
            Self::AltimeterStuck => "altimeter-stuck",
            Self::TimeJump => "time-jump",
            Self::TimeLate => "time-late",
            Self::TimeBack => "time-back",
            Self::TimeRepeated => "time-repeated",
            Self::ClockSet => "clock-set",
            Self::HeightZero => "height-zero",
            Self::HeightNegative => "height-negative",
            Self::NoNumbers => "no-numbers",
            Self::Overlay => "overlay",
            Self::Dust => "dust",
            Self::Wing => "wing",
        }
    }

    /// Images that the fault takes.
    fn length(self) -> usize {
        match self {
            Self::FrozenShort => 5,
            Self::HalfFrozen => 6,
            Self::ReplayedElsewhere => 12,
            Self::Swapped | Self::CompassNoise => 8,
            Self::Dropped | Self::TimeRepeated => 3,
            Self::CompassReversed | Self::CompassStuck | Self::AltimeterHigh | Self::AltimeterLow => 15,
            Self::CompassDrift => 25,
            Self::AltimeterStuck => 20,
            Self::TimeJump | Self::TimeLate | Self::TimeBack | Self::ClockSet => 1,
            Self::HeightZero | Self::HeightNegative | Self::NoNumbers => 1,
            _ => 10,
        }
    }

    /// Applies the fault to a flight. Equal seeds give equal faults.
    pub fn apply(self, tape: &mut Vec<TapeRow>, seed: u64) {
        let count = tape.len();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(1000 + self as u64);
        let length = self.length().min(count / 2);
        // Where the flight is long enough, some fixes come before and some images after.
        let earliest = length.clamp(6, 12).min(count / 4);
        let latest = count.saturating_sub(length + 5).max(earliest);
        let first = rng.random_range(earliest..=latest);
        let stretch = first..(first + length).min(count);
        match self {
            Self::Overlay | Self::Dust | Self::Wing => {
                let drawing = self.drawing(seed);
                tape.iter_mut().for_each(|row| row.drawing = drawing);
            }
            Self::Dropped => drop(tape.drain(stretch)),
            _ if self.is_of_camera() => self.show_others(tape, stretch, &mut rng),
            _ if self.is_of_sensors() => self.lie(tape, stretch, &mut rng),
            _ => self.set_times(tape, stretch),
        }
    }

    fn drawing(self, seed: u64) -> Option<Drawing> {
        match self {
            Self::Overlay => Some(Drawing::Overlay(seed)),
            Self::Dust => Some(Drawing::Dust(seed)),
            Self::Wing => Some(Drawing::Wing(seed)),
            _ => None,
        }
    }

    fn is_of_camera(self) -> bool {
        (self as u8) <= Self::Swapped as u8
    }

    fn is_of_sensors(self) -> bool {
        matches!(self, Self::HeightZero | Self::HeightNegative | Self::NoNumbers)
            || (Self::CompassReversed as u8..=Self::AltimeterStuck as u8).contains(&(self as u8))
    }

    /// The camera shows other images, of which the aircraft's sensors know nothing.
    fn show_others(self, tape: &mut [TapeRow], stretch: std::ops::Range<usize>, rng: &mut ChaCha8Rng) {
        let (first, last, count) = (stretch.start, stretch.end - 1, tape.len());
        let shown: Vec<usize> = tape.iter().map(|row| row.shown).collect();
        for i in stretch {
            let k = i - first;
            let row = &mut tape[i];
            match self {
                Self::FrozenShort | Self::Frozen | Self::FrozenNoisy => row.shown = shown[first - 1],
                Self::HalfFrozen => row.upper_half = Some(shown[first - 1]),
                Self::Replayed | Self::ReplayedNoisy => row.shown = shown[first - (last + 1 - first).min(first) + k],
                Self::PlayedBackwards => row.shown = shown[(first - 1).saturating_sub(k)],
                Self::ReplayedElsewhere => row.shown = shown[(i + count / 2) % count],
                Self::Reversed => row.shown = shown[last - k],
                Self::Swapped => row.shown = shown[if k.is_multiple_of(2) { (i + 1).min(count - 1) } else { i - 1 }],
                _ => {}
            }
            if matches!(self, Self::FrozenNoisy | Self::ReplayedNoisy | Self::PlayedBackwards) {
                row.noise = Some(rng.random());
            }
        }
    }

    fn lie(self, tape: &mut [TapeRow], stretch: std::ops::Range<usize>, rng: &mut ChaCha8Rng) {
        let (first, held) = (stretch.start, tape[stretch.start].clone());
        for i in stretch {
            let row = &mut tape[i];
            match self {
                Self::CompassReversed => row.stated.heading_rad += std::f64::consts::PI,
                Self::CompassDrift => row.stated.heading_rad += ((i - first + 1) as f64).to_radians(),
                Self::CompassNoise => row.stated.heading_rad += rng.random_range(-70f64..70.0).to_radians(),
                Self::CompassStuck => row.stated.heading_rad = held.stated.heading_rad,
                Self::AltimeterHigh => row.stated.height_agl_m *= 1.3,
                Self::AltimeterLow => row.stated.height_agl_m *= 0.7,
                Self::AltimeterStuck => row.stated.height_agl_m = held.stated.height_agl_m,
                Self::HeightZero => row.stated.height_agl_m = 0.0,
                Self::HeightNegative => row.stated.height_agl_m = -row.stated.height_agl_m,
                _ => {
                    let none = f64::NAN;
                    (row.stated.time_s, row.stated.heading_rad, row.stated.height_agl_m) = (none, none, none);
                    row.stated.attitude = Attitude::new(Some(none), Some(none), None);
                }
            }
        }
    }

    fn set_times(self, tape: &mut [TapeRow], stretch: std::ops::Range<usize>) {
        let first = stretch.start;
        let interval_s = tape[first].stated.time_s - tape[first - 1].stated.time_s;
        match self {
            Self::TimeJump => tape[first..].iter_mut().for_each(|row| row.stated.time_s -= 0.9 * interval_s),
            Self::TimeLate => tape[first].stated.time_s += 600.0,
            Self::TimeBack => tape[first].stated.time_s -= 60.0,
            Self::TimeRepeated => {
                let held_s = tape[first - 1].stated.time_s;
                tape[stretch].iter_mut().for_each(|row| row.stated.time_s = held_s);
            }
            _ => tape[first..].iter_mut().for_each(|row| row.stated.time_s -= 5000.0),
        }
    }
}

impl std::str::FromStr for SequenceFault {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let expected = || Self::ALL.map(Self::word).join(", ");
        Self::ALL.into_iter().find(|fault| fault.word() == word).ok_or_else(|| format!("one of {}", expected()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::recorded_flight::RecordedFrame;

    fn tape() -> Vec<TapeRow> {
        let frame = |i: usize| RecordedFrame {
            line: i as u64,
            image: i.to_string(),
            path: i.to_string().into(),
            time_s: 4.0 * i as f64,
            true_position: None,
            true_heading_rad: None,
            height_agl_m: 500.0 + i as f64,
            height_msl_m: None,
            camera: None,
            heading_rad: 1.0 + 0.01 * i as f64,
            attitude: Attitude::exact(0.0, 0.0),
        };
        let row = |i: usize| TapeRow::new(i, &frame(i));
        (0..48).map(row).collect()
    }

    #[test]
    fn every_kind_changes_the_flight_and_equal_seeds_alike() {
        for kind in SequenceFault::ALL {
            for seed in 0..20 {
                let [mut one, mut two] = [tape(), tape()];
                kind.apply(&mut one, seed);
                kind.apply(&mut two, seed);
                let told = |tape: &[TapeRow]| format!("{tape:?}");
                assert_eq!(told(&one), told(&two), "{kind:?}");
                assert_ne!(told(&one), told(&tape()), "{kind:?} {seed}");
                // The first images and the last are sound, but for what is drawn into all.
                if one[0].drawing.is_none() {
                    assert_eq!(told(&one[..6]), told(&tape()[..6]), "{kind:?}");
                    assert_eq!(one.last().unwrap().shown, 47, "{kind:?} {seed}");
                }
            }
        }
        let mut words: Vec<_> = SequenceFault::ALL.map(SequenceFault::word).into();
        words.dedup();
        assert_eq!(words.len(), SequenceFault::ALL.len());
    }
}
