//! `ImageClock`: the times of the images, and which of them cannot be right.

/// A pause of more of the usual intervals than this may be an error of the clock.
const PAUSE_INTERVALS: f64 = 5.0;
/// A longer pause is an error of the clock, seconds.
const MAX_PAUSE_S: f64 = 3600.0;
/// After this many wrong times in a row that follow each other, the clock has been set.
const SET_AFTER: u32 = 3;
/// The interval that is assumed until two images have shown it, seconds.
const ASSUMED_INTERVAL_S: f64 = 10.0;

/// The clock of a flight's images. Times that it returns never go back.
#[derive(Debug, Clone)]
pub struct ImageClock {
    /// The time of the last image.
    last_s: f64,
    /// Time between the last two images.
    interval_s: Option<f64>,
    /// What is added to a stated time, because the clock has been set.
    offset_s: f64,
    /// The wrong times since the last image: how many, and the last of them as stated.
    wrong: Option<(u32, f64)>,
}

/// What the time of an image is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ImageTime {
    /// It follows the last image.
    Follows {
        /// The time, seconds.
        time_s: f64,
        /// Seconds since the last image.
        elapsed_s: f64,
        /// Whether the pause is so long that the time may yet turn out to be wrong.
        is_pause: bool,
    },
    /// It does not follow the last image.
    Wrong {
        /// The longest time that can have passed since the last image if the images keep their interval, seconds.
        elapsed_s: f64,
    },
}

impl ImageClock {
    /// Starts with the time of the first image. A time that is not finite counts as 0.
    pub fn new(first_s: f64) -> Self {
        let last_s = if first_s.is_finite() { first_s } else { 0.0 };
        Self { last_s, interval_s: None, offset_s: 0.0, wrong: None }
    }

    /// The time of the last image, seconds.
    pub fn last_s(&self) -> f64 {
        self.last_s
    }

    /// Time between the last two images, seconds.
    pub fn interval_s(&self) -> Option<f64> {
        self.interval_s
    }

    /// Takes the stated time of the next image.
    pub fn take(&mut self, stated_s: f64) -> ImageTime {
        let (count, before_s) = self.wrong.unwrap_or((0, f64::NAN));
        let interval_s = self.interval_s.unwrap_or(ASSUMED_INTERVAL_S);
        let elapsed_s = stated_s + self.offset_s - self.last_s;
        if elapsed_s > 0.0 && elapsed_s <= MAX_PAUSE_S {
            let is_pause = elapsed_s > PAUSE_INTERVALS * interval_s;
            return self.follow(elapsed_s, if count == 0 { elapsed_s } else { interval_s }, is_pause);
        }
        let step_s = stated_s - before_s;
        let is_sequel = step_s > 0.0 && step_s <= PAUSE_INTERVALS * interval_s;
        let count = if is_sequel { count + 1 } else { 1 };
        let elapsed_s = f64::from(count) * interval_s;
        if count > SET_AFTER {
            self.offset_s = self.last_s + elapsed_s - stated_s;
            return self.follow(elapsed_s, interval_s, false);
        }
        self.wrong = Some((count, stated_s));
        ImageTime::Wrong { elapsed_s }
    }

    fn follow(&mut self, elapsed_s: f64, interval_s: f64, is_pause: bool) -> ImageTime {
        self.last_s += elapsed_s;
        self.interval_s = Some(interval_s);
        self.wrong = None;
        ImageTime::Follows { time_s: self.last_s, elapsed_s, is_pause }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clock() -> ImageClock {
        let mut clock = ImageClock::new(10.0);
        assert_eq!(clock.take(14.0), ImageTime::Follows { time_s: 14.0, elapsed_s: 4.0, is_pause: false });
        clock
    }

    #[test]
    fn a_wrong_time_does_not_move_the_clock() {
        for wrong_s in [14.0, 3.0, -5e9, 1e300, f64::NAN, f64::INFINITY] {
            let mut clock = clock();
            assert_eq!(clock.take(wrong_s), ImageTime::Wrong { elapsed_s: 4.0 }, "{wrong_s}");
            assert_eq!(clock.take(22.0), ImageTime::Follows { time_s: 22.0, elapsed_s: 8.0, is_pause: false });
            assert_eq!(clock.interval_s(), Some(4.0));
        }
    }

    #[test]
    fn a_pause_is_named() {
        assert_eq!(clock().take(94.0), ImageTime::Follows { time_s: 94.0, elapsed_s: 80.0, is_pause: true });
    }

    #[test]
    fn a_clock_that_was_set_is_followed_after_three_images() {
        let mut clock = clock();
        for (i, stated_s) in [1.0, 5.0, 9.0].into_iter().enumerate() {
            assert_eq!(clock.take(stated_s), ImageTime::Wrong { elapsed_s: 4.0 * (i + 1) as f64 });
        }
        assert_eq!(clock.take(13.0), ImageTime::Follows { time_s: 30.0, elapsed_s: 16.0, is_pause: false });
        assert_eq!(clock.take(17.0), ImageTime::Follows { time_s: 34.0, elapsed_s: 4.0, is_pause: false });
    }
}
