//! `Navigator`: takes image after image and returns a position for each.

use super::error::NavigateError;
use super::filter::NavigationFilter;
use super::flight_image::FlightImage;
use super::flight_limits::Manoeuvre;
use super::hypotheses::{CameraDoubt, Hypotheses, ImageUpdate};
use super::image_clock::{ImageClock, ImageTime};
use super::image_history::{ImageHistory, ImageUse};
use super::keyframes::{KeyframeStep, Keyframes};
use super::options::NavigateOptions;
use super::pending_registration::{PendingRegistration, Searched};
use super::position::{Position, PositionSource};
use super::search_widening::SearchWidening;
use super::stuck_sensors::StuckSensors;
use super::time_update::TimeUpdate;
use super::velocity::Velocity;
use crate::locate::Answer;
use overfly_core::coupling::Mode;
use overfly_core::geodesy::Geodetic;
use overfly_store::Reader;

/// Images not farther apart than this many of the last interval are consecutive.
const CONSECUTIVE_INTERVALS: f64 = 1.5;

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
#[derive(Clone)]
pub struct Navigator<'a> {
    store: &'a Reader,
    options: &'a NavigateOptions,
    clock: ImageClock,
    images: ImageHistory,
    stuck_sensors: StuckSensors,
    hypotheses: Hypotheses,
    keyframes: Keyframes,
    velocity: Velocity,
    /// That at the last accepted fix.
    unaided_velocity: Velocity,
    /// The time of the last image with an accepted fix, and the filter there after the update.
    last_fix: Option<(f64, NavigationFilter)>,
    /// One standard deviation per axis of the nadir by the last image's attitude, as a ratio of the height. The filters estimate the
    /// point that the stated attitude puts straight below; its error is common to all images, so no number of fixes reduces it.
    tilt_sigma_ratio: f64,
    widening: SearchWidening,
    /// An absolute registration whose result is not due yet.
    pending: Option<PendingRegistration>,
    /// Images since the last absolute registration began.
    images_since_absolute: usize,
    /// When a registration that the mode waits for ends.
    busy_until_s: f64,
    /// The flight before a pause: the image after it may turn out to have a wrong time.
    before_pause: Option<Box<Self>>,
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
        mut first: FlightImage,
    ) -> Result<(Self, Position), NavigateError> {
        let clock = ImageClock::new(first.time_s);
        first.time_s = clock.last_s();
        first.reading = first.reading.plausible();
        let tilt_sigma_ratio = first.tilt_sigma_ratio();
        let tilt_m = tilt_sigma_ratio * if first.reading.height_m.is_finite() { first.reading.height_m } else { 0.0 };
        let start_sigma_m = options.start_sigma_m.hypot(tilt_m);
        let filter = NavigationFilter::new(start, start_sigma_m, first.reading, &options.sensors);
        let mut navigator = Self {
            store,
            options,
            clock,
            images: ImageHistory::new(first.gray.clone()),
            stuck_sensors: StuckSensors::new(first.reading),
            keyframes: Keyframes::new(first.clone(), filter.clone()),
            hypotheses: Hypotheses::new(filter),
            velocity: Velocity::new(options),
            unaided_velocity: Velocity::new(options),
            last_fix: None,
            tilt_sigma_ratio,
            widening: SearchWidening::default(),
            pending: None,
            images_since_absolute: usize::MAX - 1,
            busy_until_s: f64::NEG_INFINITY,
            before_pause: None,
        };
        let image_use = if first.camera(1.0).is_ok() { ImageUse::All } else { ImageUse::Nothing };
        let position = navigator.register(&first, 0, image_use)?;
        Ok((navigator, position))
    }

    /// Takes the next image and returns the best position that is known when the image's own registrations are done. An image
    /// whose time is wrong moves nothing, and its position says so ([`PositionSource::Lost`]). An image that shows old ground,
    /// and readings that cannot be, are no measurements: dead reckoning goes on without them.
    ///
    /// # Errors
    /// As [`Navigator::start`].
    pub fn process_image(&mut self, mut image: FlightImage) -> Result<Position, NavigateError> {
        let stated_s = image.time_s;
        let (time_s, elapsed_s) = match self.take_time(stated_s) {
            ImageTime::Follows { time_s, elapsed_s, .. } => (time_s, elapsed_s),
            ImageTime::Wrong { elapsed_s } => return Ok(self.position_at_wrong_time(stated_s, elapsed_s)),
        };
        image.time_s = time_s;
        image.reading = self.stuck_sensors.checked(image.reading.plausible());
        self.tilt_sigma_ratio = image.tilt_sigma_ratio();
        self.finish_pending(time_s)?;
        let least_motion_m = self.velocity.least_distance_m(elapsed_s);
        let usable = self.images.add(&image, self.hypotheses.filter().height_m(), least_motion_m);
        if let Some(filled) = self.images.mask().filled(&image.gray) {
            image.gray = filled.into();
        }
        let relative_count = usize::from(self.uses_odometry(&image) && usable == ImageUse::All);
        let stated = image.reading;
        let (image_use, is_registered) = self.predict(&mut image, elapsed_s, usable)?;
        match image_use {
            ImageUse::Nothing => self.keyframes.skip(),
            // The next turn by the compass begins at the reading, whether it was believed or not.
            _ => self.keyframes.add(
                FlightImage { reading: stated, ..image.clone() },
                self.hypotheses.filter().clone(),
                is_registered,
                elapsed_s,
            ),
        }
        self.images_since_absolute = self.images_since_absolute.saturating_add(1);
        let position = self.register(&image, relative_count, image_use)?;
        Ok(Position { time_s: stated_s, ..position })
    }

    /// Takes the time of an image. A time before the last pause shows that the time after the pause was wrong: the flight goes on
    /// as it was before.
    fn take_time(&mut self, stated_s: f64) -> ImageTime {
        if let Some(before) = self.before_pause.take() {
            let (mut clock, mut as_it_was) = (self.clock.clone(), before.clock.clone());
            if !matches!(clock.take(stated_s), ImageTime::Follows { .. })
                && matches!(as_it_was.take(stated_s), ImageTime::Follows { .. })
            {
                *self = *before;
            }
        }
        let mut clock = self.clock.clone();
        let time = clock.take(stated_s);
        if matches!(time, ImageTime::Follows { is_pause: true, .. }) {
            self.before_pause = Some(Box::new(self.clone()));
        }
        self.clock = clock;
        time
    }

    /// The answer for an image whose time is wrong: the last position, and every place that the aircraft can have reached
    /// since.
    fn position_at_wrong_time(&self, stated_s: f64, elapsed_s: f64) -> Position {
        let reach_m = self.velocity.speed_mps() * elapsed_s;
        self.position(stated_s, PositionSource::Lost).widened(reach_m)
    }

    /// Whether this image is registered against a keyframe.
    fn uses_odometry(&self, image: &FlightImage) -> bool {
        self.options.mode != Mode::Combined && image.time_s >= self.busy_until_s
    }

    /// Carries the filters to this image, by odometry where there is some. Takes the readings that contradict out of the image.
    /// Returns what the image is good for, and whether it was registered.
    fn predict(
        &mut self,
        image: &mut FlightImage,
        elapsed_s: f64,
        usable: ImageUse,
    ) -> Result<(ImageUse, bool), NavigateError> {
        let (options, sensors) = (self.options, &self.options.sensors);
        let filter = self.hypotheses.filter();
        let most = Manoeuvre::largest(options, self.velocity.speed_mps(), filter.height_m(), elapsed_s);
        let of_unaided = self.hypotheses.unaided().gated(image.reading, sensors, most);
        let read = filter.gated(image.reading, sensors, most);
        let is_refused = image.reading.heading_rad.is_finite() && !read.heading_rad.is_finite();
        let doubt = if is_refused { CameraDoubt::Heading } else { CameraDoubt::None };
        let step = if usable == ImageUse::All && self.uses_odometry(image) {
            self.keyframes.step_to(image, elapsed_s, self.velocity, options)?
        } else {
            KeyframeStep::None
        };
        image.reading = read;
        let turn_rad = read.heading_rad - filter.compass_offset_rad() - filter.heading().radians();
        let sway_m = image.sway_sigma_ratio(elapsed_s, turn_rad) * filter.height_m();
        let reckon = |velocity: &mut Velocity, from: &NavigationFilter, reading| {
            velocity.dead_reckon(from, reading, elapsed_s, options).widened(sway_m)
        };
        let unaided = reckon(&mut self.unaided_velocity, self.hypotheses.unaided(), of_unaided);
        match step {
            // While fixes contradict the filter, only the last image is compared.
            KeyframeStep::Motion { step, from, reading, is_doubtful }
                if from.is_none() || !self.hypotheses.is_contradicted() =>
            {
                let reading = read.without(reading);
                image.reading = reading;
                let aided = TimeUpdate::Odometry { step, reading };
                let is_from_last = from.is_none();
                let before = self.hypotheses.filter().clone();
                let from = from.map(|filter| *filter);
                self.apply(
                    ImageUpdate { aided, unaided, doubt: if is_doubtful { CameraDoubt::Turn } else { doubt } },
                    from,
                )?;
                // A step from an earlier image than the last does not measure the velocity since the last.
                if is_from_last && !self.hypotheses.is_contradicted() {
                    self.velocity = self.velocity.measured(&before, self.hypotheses.filter(), elapsed_s);
                }
                Ok((ImageUse::All, true))
            }
            KeyframeStep::Unflyable { off_m } => {
                let aided = reckon(&mut self.velocity, self.hypotheses.filter(), read).widened(off_m);
                self.apply(ImageUpdate { aided, unaided, doubt: CameraDoubt::Motion }, None)?;
                Ok((ImageUse::Comparison, false))
            }
            KeyframeStep::Motion { .. } | KeyframeStep::None => {
                let aided = reckon(&mut self.velocity, self.hypotheses.filter(), read);
                self.apply(ImageUpdate { aided, unaided, doubt }, None)?;
                Ok((usable, false))
            }
        }
    }

    /// Applies a time update to every filter. `from`: the filter that it begins at, where this is not the last one.
    fn apply(&mut self, update: ImageUpdate, from: Option<NavigationFilter>) -> Result<(), NavigateError> {
        if let Some(from) = from {
            // The pending registration began at an image that this update skips.
            self.pending = None;
            self.hypotheses.go_back_to(from);
        }
        self.hypotheses.predict(&update, &self.options.sensors)?;
        if let Some(pending) = &mut self.pending {
            pending.updates.push(update);
        }
        Ok(())
    }

    /// Begins an absolute registration where one is due, and waits for its result where the mode does.
    fn register(
        &mut self,
        image: &FlightImage,
        relative_count: usize,
        image_use: ImageUse,
    ) -> Result<Position, NavigateError> {
        let now_s = image.time_s;
        let mut searched = None;
        let is_free = self.pending.is_none() && now_s >= self.busy_until_s;
        if is_free && image_use == ImageUse::All && self.is_absolute_due() {
            searched = self.begin_absolute(image)?;
            let done_s = self.pending.as_ref().map_or(now_s, |p| p.done_s);
            if self.waits(done_s, image) {
                self.busy_until_s = done_s;
                self.finish_pending(done_s)?;
            }
        }
        let is_fixed = self.last_fix.as_ref().is_some_and(|(time_s, _)| *time_s == now_s);
        let source = match (self.hypotheses.is_lost() || image_use == ImageUse::Comparison, is_fixed) {
            (true, _) => PositionSource::Lost,
            (false, true) => PositionSource::Absolute,
            (false, false) => PositionSource::Propagated,
        };
        let (tiles_searched, nominal_count) = searched.as_ref().map_or((0, 0.0), |s| (s.tiles, s.nominal_count));
        Ok(Position {
            tiles_searched,
            nominal_count,
            relative_count,
            absolute_count: usize::from(searched.is_some()),
            fix: searched.and_then(|s| s.fix),
            ..self.position(now_s, source)
        })
    }

    /// The position by the filters, without the registrations of an image.
    fn position(&self, time_s: f64, source: PositionSource) -> Position {
        let fix_age_s = self.last_fix.as_ref().map(|(fix_s, _)| self.clock.last_s() - fix_s);
        Position::of_filters(&self.hypotheses, self.tilt_sigma_ratio, time_s, source, fix_age_s)
    }

    fn is_absolute_due(&self) -> bool {
        match self.options.mode {
            Mode::RelativeOnly => false,
            // At once without a fix, after a failed search, and in doubt.
            Mode::Sequential => {
                let is_in_doubt = self.hypotheses.is_lost() || self.widening != SearchWidening::default();
                self.images_since_absolute >= self.options.relative_count || is_in_doubt || self.last_fix.is_none()
            }
            Mode::Parallel | Mode::Combined | Mode::Auto => true,
        }
    }

    /// Whether the mode waits for the result of an absolute registration.
    fn waits(&self, done_s: f64, image: &FlightImage) -> bool {
        match self.options.mode {
            Mode::Sequential | Mode::Combined => true,
            Mode::Parallel | Mode::RelativeOnly => false,
            // Where the result is due before the next image, if images keep their interval.
            Mode::Auto => {
                let relative_s = self.options.execution_times.relative_s;
                self.clock.interval_s().is_some_and(|s| done_s + relative_s < image.time_s + s)
            }
        }
    }

    fn begin_absolute(&mut self, image: &FlightImage) -> Result<Option<Searched>, NavigateError> {
        let widening = if self.hypotheses.is_contradicted() { SearchWidening::default() } else { self.widening };
        let request = widening.request(&self.options.layer, image, self.hypotheses.searched());
        let begun = PendingRegistration::begin(self.store, self.options, image, &request, self.hypotheses.clone())?;
        let Some(pending) = begun else { return Ok(None) };
        self.images_since_absolute = 0;
        Ok(Some(self.pending.insert(pending).searched()))
    }

    /// Updates the filters with the result of the pending registration, where it is due by `now_s`, as they were at its image, and applies
    /// the time updates since.
    fn finish_pending(&mut self, now_s: f64) -> Result<(), NavigateError> {
        let Some(pending) = self.pending.take_if(|p| p.done_s <= now_s) else { return Ok(()) };
        match &pending.answer {
            Answer::Fix(fix) => {
                let (hypotheses, is_accepted) = pending.updated(fix, &self.options.sensors)?;
                self.use_updated(hypotheses, is_accepted, &pending)
            }
            Answer::NoFix(no_fix) => {
                let (hypotheses, is_decided) = pending.tracked(&self.options.sensors)?;
                if is_decided {
                    return self.use_updated(hypotheses, true, &pending);
                }
                self.hypotheses.keep_track(&hypotheses, &pending.updates, &self.options.sensors)?;
                if !self.hypotheses.drop_alternative() {
                    self.widening.record_failure(no_fix.reason);
                }
                Ok(())
            }
        }
    }

    /// Goes on with filters that were updated at the image of a registration.
    fn use_updated(
        &mut self,
        mut hypotheses: Hypotheses,
        is_accepted: bool,
        pending: &PendingRegistration,
    ) -> Result<(), NavigateError> {
        let sensors = &self.options.sensors;
        if is_accepted {
            self.widening.reset();
            self.velocity = self.velocity_from_fixes(hypotheses.filter(), pending.image.time_s);
            self.unaided_velocity = self.velocity;
            self.last_fix = Some((pending.image.time_s, hypotheses.filter().clone()));
        }
        pending.updates.iter().try_for_each(|update| hypotheses.predict(update, sensors))?;
        if is_accepted || hypotheses.is_contradicted() {
            self.keyframes.set_filter(hypotheses.filter());
        }
        self.hypotheses = hypotheses;
        Ok(())
    }

    /// In the combined mode, the velocity between the last two fixes, where their images are consecutive: between others the
    /// aircraft may have turned. In other modes odometry measures the velocity.
    fn velocity_from_fixes(&self, updated: &NavigationFilter, time_s: f64) -> Velocity {
        let is_consecutive =
            |from_s: f64| self.clock.interval_s().is_some_and(|s| time_s - from_s < CONSECUTIVE_INTERVALS * s);
        match &self.last_fix {
            Some((from_s, from)) if self.options.mode == Mode::Combined && is_consecutive(*from_s) => {
                self.velocity.measured(from, updated, time_s - from_s)
            }
            _ => self.velocity,
        }
    }
}
