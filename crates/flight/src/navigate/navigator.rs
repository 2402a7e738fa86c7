//! `Navigator`: image after image, one position each.

use super::anchor::Anchors;
use super::position::{Position, Source};
use super::search::Patience;
use super::velocity::Velocity;
use super::{Estimate, Image, Move, NavigateError, NavigateOptions};
use crate::locate::{Answer, Fix, LocateError, locate};
use overfly_core::camera::CameraError;
use overfly_core::coupling::Mode;
use overfly_core::geodesy::Geodetic;
use overfly_store::Reader;

/// An innovation beyond this is no accident: chi-square of two degrees, once in a million.
const GATE: f64 = 27.6;
/// A fix that contradicts the estimate must be at least this sure to be looked into.
const SURE_LOG10_FALSE_ALARMS: f64 = -9.0;

/// A flight under way.
pub struct Navigator<'a> {
    store: &'a Reader,
    options: &'a NavigateOptions,
    /// At the last image.
    estimate: Estimate,
    anchors: Anchors,
    velocity: Velocity,
    last_time_s: f64,
    /// The image that the last fix was made of: its time, and what was known there with the fix.
    fixed: Option<(f64, Estimate)>,
    patience: Patience,
    /// An absolute registration whose result is not there yet.
    running: Option<Running>,
    /// Where a fix says that the aircraft is, against all that was estimated; one more must agree.
    suspect: Option<Estimate>,
    /// Images since the last absolute registration began.
    since_absolute: usize,
    /// When a registration that is waited for ends.
    busy_until_s: f64,
}

/// An absolute registration that began at an image.
struct Running {
    done_s: f64,
    answer: Answer,
    /// As estimated at that image, and where a fix before it says that it was taken instead; and what was moved since.
    began: Estimate,
    suspect: Option<Estimate>,
    image: Image,
    moved: Vec<Move>,
}

/// What an absolute registration came to.
struct Searched {
    tiles: usize,
    nominal_count: f64,
    fix: Option<Fix>,
}

impl<'a> Navigator<'a> {
    /// At the first image, from a start position.
    ///
    /// # Errors
    /// Where the store cannot be searched or the camera is none.
    pub fn start(
        store: &'a Reader,
        options: &'a NavigateOptions,
        start: Geodetic,
        first: Image,
    ) -> Result<(Self, Position), NavigateError> {
        let estimate = Estimate::start(start, options.start_sigma_m, first.sensed, &options.sensors);
        let mut navigator = Self {
            store,
            options,
            anchors: Anchors::new(first.clone(), estimate.clone()),
            estimate,
            velocity: Velocity::stated(options),
            last_time_s: first.time_s,
            fixed: None,
            patience: Patience::default(),
            running: None,
            suspect: None,
            since_absolute: usize::MAX - 1,
            busy_until_s: f64::NEG_INFINITY,
        };
        let position = navigator.register(&first, 0, first.time_s)?;
        Ok((navigator, position))
    }

    /// Takes the next image; its position is the best that is known when its own registrations are done.
    ///
    /// # Errors
    /// As [`Navigator::start`]; images out of order.
    pub fn take(&mut self, image: Image) -> Result<Position, NavigateError> {
        let elapsed_s = image.time_s - self.last_time_s;
        if elapsed_s.is_nan() || elapsed_s <= 0.0 {
            return Err(NavigateError::OutOfOrder { time_s: image.time_s, last_s: self.last_time_s });
        }
        self.deliver(image.time_s)?;
        let relative = usize::from(self.moves_by_registration(&image));
        let (moved, from) = self.next_move(&image, elapsed_s)?;
        let is_linked = matches!(moved, Move::Registered { .. });
        // A step from an earlier image than the last says nothing of the time since the last.
        let before = (is_linked && from.is_none()).then(|| self.estimate.clone());
        self.carry(&moved, from)?;
        if let Some(before) = before {
            self.velocity = self.velocity.seen(&before, &self.estimate, elapsed_s);
        }
        self.last_time_s = image.time_s;
        self.anchors.add(image.clone(), self.estimate.clone(), is_linked);
        self.since_absolute = self.since_absolute.saturating_add(1);
        self.register(&image, relative, image.time_s)
    }

    /// Whether this image is compared with one before it.
    fn moves_by_registration(&self, image: &Image) -> bool {
        self.options.mode != Mode::Combined && image.time_s >= self.busy_until_s
    }

    /// From where, and how, the aircraft came to this image.
    fn next_move(&mut self, image: &Image, elapsed_s: f64) -> Result<(Move, Option<Estimate>), NavigateError> {
        if self.moves_by_registration(image)
            && let Some((step, from)) = self.anchors.step_to(image, &self.options.sensors)?
        {
            return Ok((Move::Registered { step, sensed: image.sensed }, from));
        }
        let radius_m = self.options.min_turn_radius_m;
        let (by, sigma_m) = self.velocity.lead(&self.estimate, image.sensed, elapsed_s, radius_m);
        Ok((Move::Led { by, sigma_m, sensed: image.sensed }, None))
    }

    /// Applies a move to all that is carried along. `from`: the estimate that it begins at, where that is not the last one.
    fn carry(&mut self, moved: &Move, from: Option<Estimate>) -> Result<(), NavigateError> {
        let sensors = &self.options.sensors;
        if let Some(running) = &mut self.running {
            running.moved.push(moved.clone());
        }
        if let Some(suspect) = &mut self.suspect {
            moved.apply(suspect, sensors)?;
        }
        if let Some(from) = from {
            // What runs beside began at an image that this move leaves out.
            self.running = None;
            self.suspect = None;
            self.estimate = from;
        }
        Ok(moved.apply(&mut self.estimate, sensors)?)
    }

    /// Begins an absolute registration if it is time for one, and waits for it where the mode does.
    fn register(&mut self, image: &Image, relative_count: usize, now_s: f64) -> Result<Position, NavigateError> {
        let mut searched = None;
        if self.running.is_none() && now_s >= self.busy_until_s && self.is_due() {
            searched = self.begin(image, now_s)?;
            let done_s = self.running.as_ref().map_or(now_s, |r| r.done_s);
            if self.waits(done_s, image) {
                self.busy_until_s = done_s;
                self.deliver(done_s)?;
            }
        }
        let fixed_s = self.fixed.as_ref().map(|(time_s, _)| *time_s);
        let (tiles_searched, nominal_count) = searched.as_ref().map_or((0, 0.0), |s| (s.tiles, s.nominal_count));
        Ok(Position {
            time_s: image.time_s,
            source: if fixed_s == Some(image.time_s) { Source::Absolute } else { Source::Propagated },
            position: self.estimate.position(),
            heading_rad: self.estimate.heading_rad(),
            heading_sigma_rad: self.estimate.heading_sigma_rad(),
            covariance_m2: self.estimate.position_covariance_m2(),
            height_scale: self.estimate.height_scale(),
            height_scale_sigma_ratio: self.estimate.height_scale_sigma_ratio(),
            fix_age_s: fixed_s.map(|s| image.time_s - s),
            tiles_searched,
            nominal_count,
            relative_count,
            absolute_count: usize::from(searched.is_some()),
            fix: searched.and_then(|s| s.fix),
        })
    }

    fn is_due(&self) -> bool {
        match self.options.mode {
            Mode::RelativeOnly => false,
            Mode::Sequential => self.since_absolute >= self.options.relative_count || self.is_in_doubt(),
            Mode::Parallel | Mode::Combined | Mode::Auto => true,
        }
    }

    /// Where the sequential mode must not wait for its turn: nothing found last time, or something that contradicts.
    fn is_in_doubt(&self) -> bool {
        self.suspect.is_some() || self.patience != Patience::default() || self.fixed.is_none()
    }

    /// Whether the result of an absolute registration is waited for.
    fn waits(&self, done_s: f64, image: &Image) -> bool {
        match self.options.mode {
            Mode::Sequential | Mode::Combined => true,
            Mode::Parallel | Mode::RelativeOnly => false,
            // It is there before the next image is due, if images come as they came.
            Mode::Auto => {
                self.anchors.interval_s().is_some_and(|s| done_s + self.options.clock.relative_s < image.time_s + s)
            }
        }
    }

    fn begin(&mut self, image: &Image, now_s: f64) -> Result<Option<Searched>, NavigateError> {
        let at = self.suspect.as_ref().unwrap_or(&self.estimate);
        let patience = if self.suspect.is_some() { Patience::default() } else { self.patience };
        let request = patience.request(&self.options.layer, image, at);
        let answer = match locate(self.store, &image.gray, &request, self.options.threads) {
            // A region grown beyond all searching and a camera that looks aside are no fix, and no end of a flight.
            Err(
                LocateError::TooWide { .. }
                | LocateError::NoRoom { .. }
                | LocateError::Camera(CameraError::TooFarOffNadir { .. }),
            ) => {
                return Ok(None);
            }
            answer => answer?,
        };
        let (tiles, nominal_count, fix) = match &answer {
            Answer::Fix(f) => (f.tiles_searched, f.nominal_count, Some(f.clone())),
            Answer::NoFix(n) => (n.tiles_searched, n.nominal_count, None),
        };
        let done_s = now_s + self.options.clock.execution_s(tiles);
        let (began, suspect, image) = (self.estimate.clone(), self.suspect.clone(), image.clone());
        self.running = Some(Running { done_s, answer, began, suspect, image, moved: Vec::new() });
        self.since_absolute = 0;
        Ok(Some(Searched { tiles, nominal_count, fix }))
    }

    /// Takes in the result of the running registration, if it is there by `now_s`.
    fn deliver(&mut self, now_s: f64) -> Result<(), NavigateError> {
        let Some(running) = self.running.take_if(|r| r.done_s <= now_s) else { return Ok(()) };
        match &running.answer {
            Answer::NoFix(no_fix) => {
                if self.suspect.take().is_none() {
                    self.patience.failed(no_fix.reason);
                }
            }
            Answer::Fix(fix) => self.weigh(fix, &running)?,
        }
        Ok(())
    }

    /// A fix that agrees with the estimate corrects it; one that does not is kept until another agrees with it.
    fn weigh(&mut self, fix: &Fix, running: &Running) -> Result<(), NavigateError> {
        let agrees = |at: &Estimate| at.innovation(fix).is_some_and(|square| square <= GATE);
        self.suspect = None;
        // Both as they were at the image that the fix was made of.
        let confirmed = running.suspect.iter().chain([&running.began]).find(|at| agrees(at));
        if let Some(mut corrected) = confirmed.cloned() {
            self.patience.succeeded();
            self.correct(&mut corrected, fix, running)?;
            self.velocity = self.fixed_velocity(&corrected, running.image.time_s);
            self.fixed = Some((running.image.time_s, corrected.clone()));
            self.replay(&mut corrected, running)?;
            self.anchors.corrected(&corrected);
            self.estimate = corrected;
        } else if fix.log10_false_alarms.is_some_and(|l| l <= SURE_LOG10_FALSE_ALARMS) {
            let at = Geodetic::from_degrees(fix.latitude_deg, fix.longitude_deg)?;
            let mut other = Estimate::start(at, FRESH_SIGMA_M, running.image.sensed, &self.options.sensors);
            self.correct(&mut other, fix, running)?;
            self.replay(&mut other, running)?;
            self.suspect = Some(other);
        }
        Ok(())
    }

    fn correct(&self, at: &mut Estimate, fix: &Fix, running: &Running) -> Result<(), NavigateError> {
        // What the answer calls a pixel's size is a height, through the image's own camera.
        let per_height = running.image.camera(1.0)?.gsd_m_per_px();
        Ok(at.correct(fix, (fix.gsd_m_per_px / per_height).ln())?)
    }

    fn replay(&self, at: &mut Estimate, running: &Running) -> Result<(), NavigateError> {
        running.moved.iter().try_for_each(|moved| moved.apply(at, &self.options.sensors))?;
        Ok(())
    }

    /// In the combined mode velocity is known from fixes alone: of images in a row, for between others it may have turned.
    fn fixed_velocity(&self, corrected: &Estimate, time_s: f64) -> Velocity {
        let in_a_row = |from_s: f64| self.anchors.interval_s().is_some_and(|s| time_s - from_s < IN_A_ROW * s);
        match &self.fixed {
            Some((from_s, from)) if self.options.mode == Mode::Combined && in_a_row(*from_s) => {
                self.velocity.seen(from, corrected, time_s - from_s)
            }
            _ => self.velocity,
        }
    }
}

/// Images not farther apart than this many of the last interval lie in a row.
const IN_A_ROW: f64 = 1.5;
/// Of a place that only a fix knows of, before it is corrected by that fix.
const FRESH_SIGMA_M: f64 = 1e4;
