//! `Navigator`: takes image after image and returns a position for each.

use super::error::NavigateError;
use super::filter::{Gate, NavigationFilter};
use super::flight_image::FlightImage;
use super::keyframes::Keyframes;
use super::measurements::FixMeasurement;
use super::options::NavigateOptions;
use super::position::{Position, PositionSource};
use super::search_widening::SearchWidening;
use super::time_update::TimeUpdate;
use super::velocity::Velocity;
use crate::locate::{Answer, Fix, LocateError, locate};
use overfly_core::camera::CameraError;
use overfly_core::coupling::Mode;
use overfly_core::geodesy::Geodetic;
use overfly_store::Reader;

/// A fix outside the gate starts an alternative filter only where it is at least this sure.
const SURE_LOG10_FALSE_ALARMS: f64 = -9.0;
/// Images not farther apart than this many of the last interval are consecutive.
const CONSECUTIVE_INTERVALS: f64 = 1.5;
/// One standard deviation of an alternative filter's position before its first fix updates it, metres.
const ALTERNATIVE_SIGMA_M: f64 = 1e4;

/// A flight under way.
///
/// # Example
/// ```no_run
/// use overfly_core::{camera::{Attitude, Intrinsics}, geodesy::Geodetic};
/// use overfly_flight::frame::read_frame;
/// use overfly_flight::navigate::{FlightImage, NavigateOptions, Navigator, SensorReading};
///
/// let store = overfly_store::Reader::open(std::path::Path::new("map.gpkg"))?;
/// let options = NavigateOptions::default();
/// let image = |name: &str, time_s: f64| -> Result<FlightImage, Box<dyn std::error::Error>> {
///     Ok(FlightImage {
///         gray: read_frame(std::path::Path::new(name))?.into(),
///         time_s,
///         reading: SensorReading { heading_rad: 1.2, height_m: 500.0 },
///         intrinsics: Intrinsics::centred(640, 480, 700.0),
///         attitude: Attitude::UNSTATED,
///     })
/// };
/// let start = Geodetic::from_degrees(48.4915, 15.616)?;
/// let (mut navigator, first) = Navigator::start(&store, &options, start, image("000.jpg", 0.0)?)?;
/// let second = navigator.process_image(image("001.jpg", 2.0)?)?;
/// println!("{:?}, then {:?}", first.position, second.position);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Navigator<'a> {
    store: &'a Reader,
    options: &'a NavigateOptions,
    /// The filter at the last image.
    filter: NavigationFilter,
    keyframes: Keyframes,
    velocity: Velocity,
    last_time_s: f64,
    /// The time of the last image with an accepted fix, and the filter there after the update.
    last_fix: Option<(f64, NavigationFilter)>,
    widening: SearchWidening,
    /// An absolute registration whose result is not due yet.
    pending: Option<PendingRegistration>,
    /// A filter that starts at a fix outside the gate; it replaces `filter` if the next fix confirms it.
    alternative: Option<NavigationFilter>,
    /// Images since the last absolute registration began.
    images_since_absolute: usize,
    /// When a registration that the mode waits for ends.
    busy_until_s: f64,
}

/// An absolute registration that began at an image: a delayed measurement.
struct PendingRegistration {
    done_s: f64,
    answer: Answer,
    image: FlightImage,
    /// The filter and the alternative filter at that image.
    filter: NavigationFilter,
    alternative: Option<NavigationFilter>,
    /// The time updates since that image.
    updates: Vec<TimeUpdate>,
}

/// The outcome of an absolute registration.
struct Searched {
    tiles: usize,
    nominal_count: f64,
    fix: Option<Fix>,
}

impl<'a> Navigator<'a> {
    /// Starts a flight at its first image from a stated position, and returns the position there.
    ///
    /// # Errors
    /// [`NavigateError`] where the store cannot be searched or the camera is invalid.
    pub fn start(
        store: &'a Reader,
        options: &'a NavigateOptions,
        start: Geodetic,
        first: FlightImage,
    ) -> Result<(Self, Position), NavigateError> {
        let filter = NavigationFilter::new(start, options.start_sigma_m, first.reading, &options.sensors);
        let mut navigator = Self {
            store,
            options,
            keyframes: Keyframes::new(first.clone(), filter.clone()),
            filter,
            velocity: Velocity::new(options),
            last_time_s: first.time_s,
            last_fix: None,
            widening: SearchWidening::default(),
            pending: None,
            alternative: None,
            images_since_absolute: usize::MAX - 1,
            busy_until_s: f64::NEG_INFINITY,
        };
        let position = navigator.register(&first, 0, first.time_s)?;
        Ok((navigator, position))
    }

    /// Takes the next image and returns the best position that is known when the image's own registrations are done.
    ///
    /// # Errors
    /// [`NavigateError::OutOfOrder`] where the image is not newer than the last; else as [`Navigator::start`].
    pub fn process_image(&mut self, image: FlightImage) -> Result<Position, NavigateError> {
        let elapsed_s = image.time_s - self.last_time_s;
        if elapsed_s.is_nan() || elapsed_s <= 0.0 {
            return Err(NavigateError::OutOfOrder { time_s: image.time_s, last_s: self.last_time_s });
        }
        self.finish_pending(image.time_s)?;
        let relative_count = usize::from(self.uses_odometry(&image));
        let (update, from) = self.time_update(&image, elapsed_s)?;
        let is_registered = matches!(update, TimeUpdate::Odometry { .. });
        // A step from an earlier image than the last does not measure the velocity since the last.
        let before = (is_registered && from.is_none()).then(|| self.filter.clone());
        self.predict(&update, from)?;
        if let Some(before) = before {
            self.velocity = self.velocity.measured(&before, &self.filter, elapsed_s);
        }
        self.last_time_s = image.time_s;
        self.keyframes.add(image.clone(), self.filter.clone(), is_registered);
        self.images_since_absolute = self.images_since_absolute.saturating_add(1);
        self.register(&image, relative_count, image.time_s)
    }

    /// Whether this image is registered against a keyframe.
    fn uses_odometry(&self, image: &FlightImage) -> bool {
        self.options.mode != Mode::Combined && image.time_s >= self.busy_until_s
    }

    /// The time update to this image, and the filter that it begins at, where this is not the filter at the last image.
    fn time_update(
        &mut self,
        image: &FlightImage,
        elapsed_s: f64,
    ) -> Result<(TimeUpdate, Option<NavigationFilter>), NavigateError> {
        let reading = image.reading;
        if self.uses_odometry(image)
            && let Some((step, from)) = self.keyframes.step_to(image, &self.options.sensors)?
        {
            return Ok((TimeUpdate::Odometry { step, reading }, from));
        }
        let radius_m = self.options.min_turn_radius_m;
        let (displacement, sigma_m) = self.velocity.dead_reckon(&self.filter, reading, elapsed_s, radius_m);
        Ok((TimeUpdate::DeadReckoning { displacement, sigma_m, reading }, None))
    }

    /// Applies a time update to every filter. `from`: the filter that the update begins at, where this is not the last one.
    fn predict(&mut self, update: &TimeUpdate, from: Option<NavigationFilter>) -> Result<(), NavigateError> {
        let sensors = &self.options.sensors;
        if let Some(pending) = &mut self.pending {
            pending.updates.push(update.clone());
        }
        if let Some(alternative) = &mut self.alternative {
            update.apply(alternative, sensors)?;
        }
        if let Some(from) = from {
            // The pending registration began at an image that this update skips.
            self.pending = None;
            self.alternative = None;
            self.filter = from;
        }
        Ok(update.apply(&mut self.filter, sensors)?)
    }

    /// Begins an absolute registration where one is due, and waits for its result where the mode does.
    fn register(&mut self, image: &FlightImage, relative_count: usize, now_s: f64) -> Result<Position, NavigateError> {
        let mut searched = None;
        if self.pending.is_none() && now_s >= self.busy_until_s && self.is_absolute_due() {
            searched = self.begin_absolute(image, now_s)?;
            let done_s = self.pending.as_ref().map_or(now_s, |p| p.done_s);
            if self.waits(done_s, image) {
                self.busy_until_s = done_s;
                self.finish_pending(done_s)?;
            }
        }
        let fix_time_s = self.last_fix.as_ref().map(|(time_s, _)| *time_s);
        let (tiles_searched, nominal_count) = searched.as_ref().map_or((0, 0.0), |s| (s.tiles, s.nominal_count));
        let is_absolute = fix_time_s == Some(image.time_s);
        Ok(Position {
            time_s: image.time_s,
            source: if is_absolute { PositionSource::Absolute } else { PositionSource::Propagated },
            position: self.filter.position(),
            heading_rad: self.filter.heading().radians(),
            heading_sigma_rad: self.filter.heading_sigma_rad(),
            covariance: self.filter.position_covariance(),
            height_scale: self.filter.height_scale(),
            height_scale_sigma_ratio: self.filter.height_scale_sigma_ratio(),
            fix_age_s: fix_time_s.map(|s| image.time_s - s),
            tiles_searched,
            nominal_count,
            relative_count,
            absolute_count: usize::from(searched.is_some()),
            fix: searched.and_then(|s| s.fix),
        })
    }

    fn is_absolute_due(&self) -> bool {
        match self.options.mode {
            Mode::RelativeOnly => false,
            Mode::Sequential => self.images_since_absolute >= self.options.relative_count || self.is_in_doubt(),
            Mode::Parallel | Mode::Combined | Mode::Auto => true,
        }
    }

    /// Whether the sequential mode searches at once: there is no fix yet, the last search failed, or its fix was outside the
    /// gate.
    fn is_in_doubt(&self) -> bool {
        self.alternative.is_some() || self.widening != SearchWidening::default() || self.last_fix.is_none()
    }

    /// Whether the mode waits for the result of an absolute registration.
    fn waits(&self, done_s: f64, image: &FlightImage) -> bool {
        match self.options.mode {
            Mode::Sequential | Mode::Combined => true,
            Mode::Parallel | Mode::RelativeOnly => false,
            // Where the result is due before the next image, if images keep their interval.
            Mode::Auto => {
                let relative_s = self.options.execution_times.relative_s;
                self.keyframes.interval_s().is_some_and(|s| done_s + relative_s < image.time_s + s)
            }
        }
    }

    fn begin_absolute(&mut self, image: &FlightImage, now_s: f64) -> Result<Option<Searched>, NavigateError> {
        let at = self.alternative.as_ref().unwrap_or(&self.filter);
        let widening = if self.alternative.is_some() { SearchWidening::default() } else { self.widening };
        let request = widening.request(&self.options.layer, image, at);
        let answer = match locate(self.store, &image.gray, &request, self.options.threads) {
            // A region too large to search and a camera tilted too far give no fix; the flight goes on.
            Err(
                LocateError::TooWide { .. }
                | LocateError::MemoryLimit { .. }
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
        self.pending = Some(PendingRegistration {
            done_s: now_s + self.options.execution_times.absolute_s(tiles),
            answer,
            image: image.clone(),
            filter: self.filter.clone(),
            alternative: self.alternative.clone(),
            updates: Vec::new(),
        });
        self.images_since_absolute = 0;
        Ok(Some(Searched { tiles, nominal_count, fix }))
    }

    /// Uses the result of the pending registration, where it is due by `now_s`.
    fn finish_pending(&mut self, now_s: f64) -> Result<(), NavigateError> {
        let Some(pending) = self.pending.take_if(|p| p.done_s <= now_s) else { return Ok(()) };
        match &pending.answer {
            Answer::NoFix(no_fix) => {
                if self.alternative.take().is_none() {
                    self.widening.record_failure(no_fix.reason);
                }
            }
            Answer::Fix(fix) => self.update_fix(fix, &pending)?,
        }
        Ok(())
    }

    /// Updates the first filter whose gate the fix passes, as it was at the image of the fix, and applies the time updates
    /// since. A fix that passes no gate, but is sure, starts an alternative filter, which the next fix may confirm.
    fn update_fix(&mut self, fix: &Fix, pending: &PendingRegistration) -> Result<(), NavigateError> {
        let measurement = measurement(fix, &pending.image)?;
        self.alternative = None;
        for filter in pending.alternative.iter().chain([&pending.filter]) {
            let mut updated = filter.clone();
            if updated.update_fix(&measurement, Gate::ONE_IN_A_MILLION)?.is_accepted {
                self.widening.reset();
                self.velocity = self.velocity_from_fixes(&updated, pending.image.time_s);
                self.last_fix = Some((pending.image.time_s, updated.clone()));
                self.apply_updates(&mut updated, pending)?;
                self.keyframes.set_filter(&updated);
                self.filter = updated;
                return Ok(());
            }
        }
        if fix.log10_false_alarms.is_some_and(|l| l <= SURE_LOG10_FALSE_ALARMS) {
            let (reading, sensors) = (pending.image.reading, &self.options.sensors);
            let mut alternative = NavigationFilter::new(measurement.position, ALTERNATIVE_SIGMA_M, reading, sensors);
            alternative.update_fix(&measurement, Gate::OPEN)?;
            self.apply_updates(&mut alternative, pending)?;
            self.alternative = Some(alternative);
        }
        Ok(())
    }

    fn apply_updates(&self, filter: &mut NavigationFilter, pending: &PendingRegistration) -> Result<(), NavigateError> {
        pending.updates.iter().try_for_each(|update| update.apply(filter, &self.options.sensors))?;
        Ok(())
    }

    /// In the combined mode, the velocity between the last two fixes, where their images are consecutive: between others the
    /// aircraft may have turned. In other modes odometry measures the velocity.
    fn velocity_from_fixes(&self, updated: &NavigationFilter, time_s: f64) -> Velocity {
        let is_consecutive =
            |from_s: f64| self.keyframes.interval_s().is_some_and(|s| time_s - from_s < CONSECUTIVE_INTERVALS * s);
        match &self.last_fix {
            Some((from_s, from)) if self.options.mode == Mode::Combined && is_consecutive(*from_s) => {
                self.velocity.measured(from, updated, time_s - from_s)
            }
            _ => self.velocity,
        }
    }
}

/// The fix as the filter takes it. The fix's ground sample distance is a height through the image's own camera.
fn measurement(fix: &Fix, image: &FlightImage) -> Result<FixMeasurement, NavigateError> {
    let gsd_per_height = image.camera(1.0)?.gsd_m_per_px();
    Ok(FixMeasurement {
        position: fix.position,
        covariance: fix.covariance,
        heading: fix.heading,
        heading_sigma_rad: fix.heading_sigma_rad,
        log_height: (fix.gsd_m_per_px / gsd_per_height).ln(),
        log_height_sigma: fix.scale_sigma_ratio,
    })
}
