//! `Preset`: the three worlds with their usual maps, cameras and days.

use crate::Args;
use anyhow::ensure;
use overfly_core::camera::Intrinsics;
use overfly_lab::scene::{
    Exposure, FlightPlan, MapWarp, OrthophotoPlan, SceneDate, Sun, TrackPlan, TrueColumns, World, town,
};

/// Most cells of a world.
const MOST_CELLS: f64 = 48e6;

/// A kind of world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum WorldKind {
    /// Blocks and houses, 100 to 120 m below a drone that tilts by 5 to 13 degrees.
    Town,
}

/// A world, its map and its flight.
pub struct Preset {
    kind: WorldKind,
    seed: u64,
    size_m: f64,
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
        };
        let cells = (usual.size_m / usual.cell_m()).powi(2);
        ensure!(cells <= MOST_CELLS, "--size-m {} makes {:.0} million cells; at most 48", usual.size_m, cells / 1e6);
        let reach_m = 2.0 * usual.flight.track.margin_m;
        ensure!(usual.size_m > reach_m, "--size-m must exceed {reach_m} m: twice the reach of a frame and its prior");
        Ok(usual)
    }

    fn cell_m(&self) -> f64 {
        match self.kind {
            WorldKind::Town => 0.15,
        }
    }

    /// The world on a day.
    pub fn world(&self, date: &SceneDate) -> World {
        let size_m = [self.size_m; 2];
        match self.kind {
            WorldKind::Town => town(self.seed, size_m, date),
        }
    }

    /// What is true of map and flight, as text.
    pub fn description(&self) -> String {
        format!(
            "kind {:?}\nseed {}\nsize_m {}\nmap_date {:?}\nflight_date {:?}\nmap {:#?}\nflight {:#?}\n",
            self.kind, self.seed, self.size_m, self.map_date, self.flight_date, self.map, self.flight
        )
    }
}

fn pair(given: &Option<Vec<f64>>, usual: [f64; 2]) -> [f64; 2] {
    given.as_ref().map_or(usual, |v| [v[0], v[1]])
}

fn map_warp(args: &Args, common_m: f64, local_m: f64, wavelength_m: f64) -> MapWarp {
    let common_m = args.map_common_m.unwrap_or(common_m);
    let towards_rad = args.seed as f64 * 2.4;
    MapWarp {
        common_m: [common_m * towards_rad.cos(), common_m * towards_rad.sin()],
        local_m: args.map_local_m.unwrap_or(local_m),
        wavelength_m,
        seed: args.seed as u32,
    }
}

fn true_columns(args: &Args) -> TrueColumns {
    if args.nadir_truth { TrueColumns::Nadir } else { TrueColumns::Centre }
}

fn town_preset(args: &Args) -> Preset {
    let changed_share = args.changed_share.unwrap_or(0.5);
    let sun = |azimuth_deg, elevation_deg| Sun { azimuth_deg, elevation_deg };
    let width_px = args.width_px.unwrap_or(1000);
    let mut intrinsics = Intrinsics::centred(width_px, width_px * 3 / 4, 0.84 * f64::from(width_px));
    intrinsics.distortion = [-0.018, 0.006, 0.0004, -0.0003, 0.0];
    let sensor = Exposure {
        defocus_px: 0.6,
        motion_px: [0.0; 2],
        vignette: 0.18,
        gain: [1.04, 1.0, 0.96],
        gamma: 0.92,
        haze: 0.03,
        noise: 3.2,
        sharpening: 0.9,
    };
    let survey = Exposure {
        defocus_px: 0.7,
        vignette: 0.0,
        gain: [0.98, 1.0, 1.02],
        gamma: 1.05,
        haze: 0.07,
        noise: 2.0,
        sharpening: 0.5,
        ..sensor
    };
    Preset {
        kind: WorldKind::Town,
        seed: args.seed,
        size_m: args.size_m.unwrap_or(900.0),
        map_date: SceneDate { number: 1, changed_share, dryness: 0.15, sun: sun(138.0, 52.0) },
        flight_date: SceneDate { number: 2, changed_share, dryness: 0.6, sun: sun(228.0, 38.0) },
        map: OrthophotoPlan {
            gsd_m_per_px: args.map_gsd_m_per_px.unwrap_or(0.3),
            lean_deg: args.lean_deg.unwrap_or(14.0),
            sensor_azimuth_deg: 80.0,
            warp: map_warp(args, 5.0, 1.0, 130.0),
            exposure: survey,
            seed: args.seed,
        },
        flight: FlightPlan {
            track: TrackPlan {
                frames: args.frames,
                step_m: 30.0,
                speed_mps: 10.0,
                height_m: pair(&args.height_m, [100.0, 120.0]),
                tilt_deg: pair(&args.tilt_deg, [5.0, 13.0]),
                wobble_deg: 0.8,
                rate_deg_per_s: 5.0,
                margin_m: 200.0,
                seed: args.seed.wrapping_mul(1_000_003) + args.flight_seed,
            },
            intrinsics,
            exposure: sensor,
            shutter_s: 0.008,
            readout_s: 0.03,
            quality: 88,
            is_tilt_stated: args.state_attitude,
            is_lens_stated: args.state_attitude,
            heading_sigma_deg: 2.0,
            height_sigma_ratio: 0.02,
            true_columns: true_columns(args),
        },
    }
}
