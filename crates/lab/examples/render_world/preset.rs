//! `Preset`: the three worlds with their usual maps, cameras and days.

use crate::Args;
use anyhow::ensure;
use overfly_core::camera::Intrinsics;
use overfly_lab::scene::{
    Exposure, FlightPlan, LAKES_CELL_M, MOUNTAINS_CELL_M, MapWarp, OrthophotoPlan, SceneDate, Sun, TOWN_CELL_M,
    TrackPlan, TrueColumns, World, lakes, mountains, town,
};

/// Most cells of a world, and most pixels of a map.
const MOST_CELLS: f64 = 48e6;

/// A kind of world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum WorldKind {
    /// Blocks and houses, 100 to 120 m below a drone that tilts by 3 to 13 degrees.
    Town,
    /// Ridges, forest and valleys, 3 to 5 km below an aircraft, with several hundred metres of relief in a frame.
    Mountains,
    /// Farmland with lakes whose level differs between map and flight, 2.2 km below an aircraft that looks straight down.
    Lakes,
}

/// A lowest and a highest value.
#[derive(Debug, Clone, Copy)]
pub struct Range(pub [f64; 2]);

/// A world, its map and its flight.
pub struct Preset {
    kind: WorldKind,
    /// The seed of the world.
    pub seed: u64,
    size_m: f64,
    /// How much higher the water is on the flight's day, metres.
    water_rise_m: f64,
    /// The day of the map.
    pub map_date: SceneDate,
    /// The day of the flight.
    pub flight_date: SceneDate,
    /// How the map is made.
    pub map: OrthophotoPlan,
    /// How the flight is flown.
    pub flight: FlightPlan,
}

impl Preset {
    /// The usual values of a kind of world, but for those that the arguments state.
    pub fn new(args: &Args) -> anyhow::Result<Self> {
        let usual = match args.world {
            WorldKind::Town => town_preset(args),
            WorldKind::Mountains => mountains_preset(args),
            WorldKind::Lakes => lakes_preset(args),
        };
        let cells = (usual.size_m / usual.cell_m()).powi(2);
        ensure!(cells <= MOST_CELLS, "--size-m {} makes {:.0} million cells; at most 48", usual.size_m, cells / 1e6);
        let pixels = (usual.size_m / usual.map.gsd_m_per_px).powi(2);
        ensure!(pixels <= MOST_CELLS, "--map-gsd-m-per-px makes {:.0} million pixels of map; at most 48", pixels / 1e6);
        let reach_m = 2.0 * usual.flight.track.margin_m;
        ensure!(usual.size_m > reach_m, "--size-m must exceed {reach_m} m: twice the reach of a frame and its prior");
        Ok(usual)
    }

    fn cell_m(&self) -> f64 {
        match self.kind {
            WorldKind::Town => TOWN_CELL_M,
            WorldKind::Mountains => MOUNTAINS_CELL_M,
            WorldKind::Lakes => LAKES_CELL_M,
        }
    }

    /// The world on the map's day.
    pub fn map_world(&self) -> World {
        self.world(&self.map_date, 0.0)
    }

    /// The world on the flight's day.
    pub fn flight_world(&self) -> World {
        self.world(&self.flight_date, self.water_rise_m)
    }

    fn world(&self, date: &SceneDate, rise_m: f64) -> World {
        let size_m = [self.size_m; 2];
        match self.kind {
            WorldKind::Town => town(self.seed, size_m, date),
            WorldKind::Mountains => mountains(self.seed, size_m, date),
            WorldKind::Lakes => lakes(self.seed, size_m, date, rise_m, self.water_rise_m.max(0.25)),
        }
    }

    /// What is true of map and flight, as text.
    pub fn description(&self) -> String {
        format!(
            "kind {:?}\nseed {}\nsize_m {}\nwater_rise_m {}\nmap_date {:?}\nflight_date {:?}\nmap {:#?}\nflight {:#?}\n",
            self.kind,
            self.seed,
            self.size_m,
            self.water_rise_m,
            self.map_date,
            self.flight_date,
            self.map,
            self.flight
        )
    }
}

/// Two numbers with a comma between, the lower first.
pub fn parse_range(text: &str) -> Result<Range, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([low, high]) if low <= high => Ok(Range([*low, *high])),
        _ => Err("two numbers with a comma between, the lower first, as in 5,13".into()),
    }
}

fn pair(given: Option<Range>, usual: [f64; 2]) -> [f64; 2] {
    given.map_or(usual, |range| range.0)
}

fn sun(azimuth_deg: f64, elevation_deg: f64) -> Sun {
    Sun { azimuth_deg, elevation_deg }
}

/// From this angle off nadir on, the corner of a frame reaches much farther than the sum of what tilt and lens do alone.
const OBLIQUE_DEG: f64 = 20.0;
/// Rays that lean more may leave the world.
const MOST_LEAN_RAD: f64 = 1.3;

/// How far the nadir stays from the edge: the greatest height times what a ray of a corner leans, and the reach of a prior, metres. `usual`
/// is the greatest height, metres, and angle off nadir, degrees; `corner`: half the frame's diagonal over the focal length.
fn margin_m(args: &Args, usual: [f64; 2], corner: f64, prior_m: f64) -> f64 {
    let height_m = args.height_m.map_or(usual[0], |range| range.0[1]);
    let tilt_deg = args.tilt_deg.map_or(usual[1], |range| range.0[1]);
    // Two degrees of wobble.
    let lean_rad = (tilt_deg + 2.0).to_radians();
    let reach = if tilt_deg > OBLIQUE_DEG {
        (lean_rad + corner.atan()).min(MOST_LEAN_RAD).tan()
    } else {
        lean_rad.tan() + corner
    };
    height_m * reach + prior_m
}

fn map_warp(args: &Args, common_m: f64, local_m: f64, wavelength_m: f64) -> MapWarp {
    let (length_m, towards_rad) = match args.map_common_sigma_m {
        Some(sigma_m) => gaussian_shift(args.seed, sigma_m),
        None => (args.map_common_m.unwrap_or(common_m), args.seed as f64 * 2.4),
    };
    MapWarp {
        common_m: [length_m * towards_rad.cos(), length_m * towards_rad.sin()],
        local_m: args.map_local_m.unwrap_or(local_m),
        wavelength_m,
        seed: args.seed as u32,
    }
}

/// Length and direction of a shift drawn from a Gaussian with this standard deviation per axis: two additive recurrences, whose consecutive
/// values fill their intervals evenly, the first through the inverse of the Rayleigh distribution.
fn gaussian_shift(seed: u64, sigma_m: f64) -> (f64, f64) {
    let golden = (5f64.sqrt() - 1.0) / 2.0;
    let silver = 2f64.sqrt() - 1.0;
    let [radius, turn] = [golden, silver].map(|step| (0.5 + (seed % 1_000_000) as f64 * step).fract());
    (sigma_m * (-2.0 * (1.0 - radius).ln()).sqrt(), turn * std::f64::consts::TAU)
}

fn true_columns(args: &Args) -> TrueColumns {
    if args.nadir_truth { TrueColumns::Nadir } else { TrueColumns::Centre }
}

fn town_preset(args: &Args) -> Preset {
    let changed_share = args.changed_share.unwrap_or(0.5);
    let width_px = args.width_px.unwrap_or(1000);
    let mut intrinsics = Intrinsics::centred(width_px, width_px * 3 / 4, 0.84 * f64::from(width_px));
    intrinsics.distortion = [-0.018, 0.006, 0.0004, -0.0003, 0.0];
    Preset {
        kind: WorldKind::Town,
        seed: args.seed,
        size_m: args.size_m.unwrap_or(900.0),
        water_rise_m: 0.0,
        map_date: SceneDate { number: 1, changed_share, dryness: 0.15, sun: sun(142.0, 34.0) },
        flight_date: SceneDate { number: 2, changed_share, dryness: 0.6, sun: sun(236.0, 40.0) },
        map: OrthophotoPlan {
            gsd_m_per_px: args.map_gsd_m_per_px.unwrap_or(0.3),
            lean_deg: args.lean_deg.unwrap_or(20.0),
            sensor_azimuth_deg: 80.0,
            warp: map_warp(args, 5.0, 1.0, 130.0),
            exposure: Exposure::SURVEY,
            seed: args.seed,
        },
        flight: FlightPlan {
            track: TrackPlan {
                frames: args.frames,
                line_frames: 6,
                step_m: 30.0,
                speed_mps: 10.0,
                height_m: pair(args.height_m, [100.0, 120.0]),
                tilt_deg: pair(args.tilt_deg, [3.0, 13.0]),
                wobble_deg: 0.8,
                rate_deg_per_s: 5.0,
                is_continuous: args.continuous,
                margin_m: margin_m(args, [120.0, 13.0], 0.75, 80.0),
                seed: flight_seed(args),
            },
            intrinsics,
            exposure: Exposure::DRONE,
            shutter_s: 0.008,
            readout_s: 0.03,
            quality: 88,
            stated_attitude_sigma_deg: args.state_attitude.then_some(args.attitude_noise_deg),
            is_lens_stated: args.state_attitude,
            heading_sigma_deg: 2.0,
            height_sigma_ratio: 0.02,
            true_columns: true_columns(args),
        },
    }
}

/// An aerial camera in a mapping aircraft, developed softly.
const AERIAL: Exposure = Exposure {
    defocus_px: 0.6,
    motion_px: [0.0; 2],
    vignette: 0.1,
    gain: [1.02, 1.0, 0.98],
    gamma: 0.95,
    haze: 0.1,
    noise: 2.5,
    sharpening: 0.4,
};

fn flight_seed(args: &Args) -> u64 {
    args.seed.wrapping_mul(1_000_003).wrapping_add(args.flight_seed)
}

fn mountains_preset(args: &Args) -> Preset {
    let changed_share = args.changed_share.unwrap_or(0.5);
    let width_px = args.width_px.unwrap_or(400);
    Preset {
        kind: WorldKind::Mountains,
        seed: args.seed,
        size_m: args.size_m.unwrap_or(12_000.0),
        water_rise_m: 0.0,
        map_date: SceneDate { number: 1, changed_share, dryness: 0.1, sun: sun(152.0, 55.0) },
        flight_date: SceneDate { number: 2, changed_share, dryness: 0.6, sun: sun(205.0, 42.0) },
        map: OrthophotoPlan {
            gsd_m_per_px: args.map_gsd_m_per_px.unwrap_or(5.0),
            lean_deg: args.lean_deg.unwrap_or(9.0),
            sensor_azimuth_deg: 100.0,
            warp: map_warp(args, 5.0, 2.0, 700.0),
            exposure: Exposure { vignette: 0.0, haze: 0.14, ..AERIAL },
            seed: args.seed,
        },
        flight: FlightPlan {
            track: TrackPlan {
                frames: args.frames,
                line_frames: 8,
                step_m: 400.0,
                speed_mps: 70.0,
                height_m: pair(args.height_m, [3000.0, 5000.0]),
                tilt_deg: pair(args.tilt_deg, [0.0, 12.0]),
                wobble_deg: 0.6,
                rate_deg_per_s: 1.0,
                is_continuous: args.continuous,
                margin_m: margin_m(args, [5000.0, 12.0], 0.32, 500.0),
                seed: flight_seed(args),
            },
            intrinsics: Intrinsics::centred(width_px, width_px * 3 / 4, 2.0 * f64::from(width_px)),
            exposure: AERIAL,
            shutter_s: 0.004,
            readout_s: 0.0,
            quality: 90,
            stated_attitude_sigma_deg: args.state_attitude.then_some(args.attitude_noise_deg),
            is_lens_stated: true,
            heading_sigma_deg: 1.0,
            height_sigma_ratio: 0.01,
            true_columns: true_columns(args),
        },
    }
}

fn lakes_preset(args: &Args) -> Preset {
    let changed_share = args.changed_share.unwrap_or(0.5);
    let width_px = args.width_px.unwrap_or(256);
    Preset {
        kind: WorldKind::Lakes,
        seed: args.seed,
        size_m: args.size_m.unwrap_or(9000.0),
        water_rise_m: args.water_rise_m.unwrap_or(0.7),
        map_date: SceneDate { number: 1, changed_share, dryness: 0.2, sun: sun(145.0, 52.0) },
        flight_date: SceneDate { number: 2, changed_share, dryness: 0.5, sun: sun(190.0, 50.0) },
        map: OrthophotoPlan {
            gsd_m_per_px: args.map_gsd_m_per_px.unwrap_or(5.0),
            lean_deg: args.lean_deg.unwrap_or(0.0),
            sensor_azimuth_deg: 0.0,
            warp: map_warp(args, 2.0, 0.8, 900.0),
            exposure: Exposure { vignette: 0.0, haze: 0.06, ..AERIAL },
            seed: args.seed,
        },
        flight: FlightPlan {
            track: TrackPlan {
                frames: args.frames,
                line_frames: 16,
                step_m: 180.0,
                speed_mps: 45.0,
                height_m: pair(args.height_m, [2200.0, 2200.0]),
                tilt_deg: pair(args.tilt_deg, [0.0, 0.0]),
                wobble_deg: 0.0,
                rate_deg_per_s: 0.3,
                is_continuous: args.continuous,
                margin_m: margin_m(args, [2200.0, 0.0], 0.4, 500.0),
                seed: flight_seed(args),
            },
            intrinsics: Intrinsics::centred(width_px, width_px * 3 / 4, 1.5625 * f64::from(width_px)),
            exposure: AERIAL,
            shutter_s: 0.004,
            readout_s: 0.0,
            quality: 92,
            stated_attitude_sigma_deg: args.state_attitude.then_some(args.attitude_noise_deg),
            is_lens_stated: true,
            heading_sigma_deg: 1.0,
            height_sigma_ratio: 0.01,
            true_columns: true_columns(args),
        },
    }
}
