//! `Explanation`: one registration as pictures: what was seen, what of it was compared, where it stood out, what agreed.
//!
//! Everything is computed again from the answer's pose by the steps that `locate` itself takes; nothing is kept from the
//! search. Reads the store, writes no file.

mod drawing;
mod ground;
mod palette;
mod surface;

use ground::Ground;
use overfly_core::camera::{Camera, GroundGrid, GroundView, render};
use overfly_core::feature::Structure;
use overfly_core::geodesy::Geodetic;
use overfly_core::pixels::{Colour, Gray};
use overfly_core::registration::window_fit::{WindowFit, WindowFitOptions, fit_windows};
use overfly_core::registration::windows::{WindowMatch, WindowOptions, match_windows};
use overfly_core::tile::{Gsd, WorldPixel, gsd_at};
use overfly_flight::locate::{Answer, Fix, FixRequest, LocateError, PositionPrior};
use overfly_store::{Layer, Reader};
use surface::Peaked;

/// A frame's edge, square root of its area, has at least this many pixels in the coarse search.
const COARSE_EDGE_PX: f64 = 46.0;
/// And at most this many where it is measured.
const FINEST_EDGE_PX: f64 = 400.0;
/// Map shown around the view, pixels.
const MARGIN_PX: usize = 24;
/// Search radius and tolerance of the windows, pixels.
const RADIUS_PX: usize = 8;
const TOLERANCE_PX: f64 = 1.25;

/// One registration, ready to be drawn.
pub struct Explanation<'a> {
    frame: &'a Colour,
    answer: &'a Answer,
    pose: Pose,
    camera: Camera,
    gsd: Gsd,
    view: GroundView,
    view_structure: Structure,
    ground: Ground,
    /// Edge of the windows, pixels.
    window_px: usize,
    windows: Vec<WindowMatch>,
    fit: Option<WindowFit>,
    surface: Option<Peaked>,
}

/// Where the frame is taken to be: as found, or without a fix as stated.
#[derive(Clone, Copy)]
struct Pose {
    nadir: WorldPixel,
    heading_rad: f64,
}

/// A file of an explanation: its name and its bytes.
pub type Page = (&'static str, Vec<u8>);

impl<'a> Explanation<'a> {
    /// Of a frame, the question asked about it, and the answer. Without a fix the frame is shown under the stated heading
    /// (or north up) in the middle of the region searched.
    ///
    /// # Errors
    /// Where the question or the store is at fault.
    pub fn of(
        store: &Reader,
        frame: &'a Colour,
        request: &FixRequest,
        answer: &'a Answer,
    ) -> Result<Self, LocateError> {
        let layer = store.layer(&request.layer)?;
        let gray = frame.to_gray();
        let stated = Camera::new(&request.view, gray.width_px() as u32, gray.height_px() as u32)?;
        let (camera, place, heading_rad) = match answer {
            Answer::Fix(fix) => {
                let camera = stated.at_height_ratio(fix.gsd_m_per_px / stated.gsd_m_per_px());
                (camera, position(fix), fix.heading_deg.to_radians())
            }
            Answer::NoFix(_) => {
                let heading_rad = request.heading.map_or(0.0, |h| h.heading_rad);
                (stated, middle(&request.position, layer), heading_rad)
            }
        };
        let beyond = LocateError::Parameter {
            name: "latitude_deg",
            value: place.latitude_deg(),
            expected: "must lie within the tile matrix",
        };
        let zoom = finest(&camera, layer, place);
        let Ok(nadir) = WorldPixel::from_geodetic(place, zoom) else { return Err(beyond) };
        let pose = Pose { nadir, heading_rad };
        let gsd = gsd_at(place, zoom);
        let Some(view) = seen(&gray, &camera, &pose, gsd) else { return Err(beyond) };
        let view_structure = Structure::new(&view.gray, &view.mask);
        let corner = [nadir.x_px - view.grid.nadir_px[0], nadir.y_px - view.grid.nadir_px[1]]
            .map(|v| v.round() as i64 - MARGIN_PX as i64);
        let size = [view.grid.width_px, view.grid.height_px].map(|n| n + 2 * MARGIN_PX);
        let ground = Ground::of(store, layer, zoom, corner, size)?;
        let window_px = window_size(&camera, gsd);
        let (windows, fit) = agreement(&view, &view_structure, &ground, window_px);
        let surface = Peaked::of(store, layer, &gray, &camera, request, place, heading_rad)?;
        Ok(Self { frame, answer, pose, camera, gsd, view, view_structure, ground, window_px, windows, fit, surface })
    }

    /// The pictures and the page that shows them, `index.html`.
    pub fn pages(&self) -> Vec<Page> {
        drawing::pages(self)
    }

    /// The fix, where there is one.
    fn found(&self) -> Option<&Fix> {
        match self.answer {
            Answer::Fix(fix) => Some(fix),
            Answer::NoFix(_) => None,
        }
    }
}

fn position(fix: &Fix) -> Geodetic {
    Geodetic::from_degrees(fix.latitude_deg, fix.longitude_deg).expect("a fix is a position")
}

fn middle(prior: &PositionPrior, layer: &Layer) -> Geodetic {
    match *prior {
        PositionPrior::Gaussian { centre, .. } | PositionPrior::Square { centre, .. } => centre,
        PositionPrior::WholeLayer => layer.bounds_deg.middle().expect("a layer lies on the globe"),
    }
}

fn edge_m(camera: &Camera) -> f64 {
    let (w, h) = camera.frame_size_px();
    (f64::from(w) * f64::from(h)).sqrt() * camera.gsd_m_per_px()
}

/// The finest level that is not much sharper than the frame and not larger than measuring needs.
fn finest(camera: &Camera, layer: &Layer, place: Geodetic) -> u8 {
    let gsd = |zoom: u8| gsd_at(place, zoom).mean_m_per_px();
    let fits = |&z: &u8| {
        gsd(z) * std::f64::consts::SQRT_2 >= camera.gsd_m_per_px() && edge_m(camera) / gsd(z) <= FINEST_EDGE_PX
    };
    (layer.min_zoom..=layer.base_zoom).rev().find(fits).unwrap_or(layer.min_zoom)
}

/// The coarsest level on which the frame still has structure to show.
fn coarsest(camera: &Camera, layer: &Layer, place: Geodetic) -> u8 {
    let shows = |&z: &u8| edge_m(camera) / gsd_at(place, z).mean_m_per_px() >= COARSE_EDGE_PX;
    (layer.min_zoom..=layer.base_zoom).find(shows).unwrap_or(layer.base_zoom)
}

/// The frame from above at a level; `None` where it sees the horizon. Its grid is the level's own.
fn seen(gray: &Gray, camera: &Camera, pose: &Pose, gsd: Gsd) -> Option<GroundView> {
    let ratio = (camera.gsd_m_per_px() / gsd.mean_m_per_px()).min(1.0);
    let side = |n: usize| ((n as f64 * ratio).round() as usize).clamp(1, n);
    let small = gray.shrunk(side(gray.width_px()), side(gray.height_px()));
    let camera = camera.resized(small.width_px(), small.height_px());
    let mut grid = GroundGrid::around(&camera, pose.heading_rad, [gsd.east_m_per_px, gsd.north_m_per_px], 1.0)?;
    grid.nadir_px[0] += pose.nadir.x_px - pose.nadir.x_px.floor();
    grid.nadir_px[1] += pose.nadir.y_px - pose.nadir.y_px.floor();
    Some(render(&small, &camera, pose.heading_rad, &grid))
}

/// A sixth of the frame's edge, a multiple of 8 from 16 to 48 px.
fn window_size(camera: &Camera, gsd: Gsd) -> usize {
    let edge_px = edge_m(camera) / gsd.mean_m_per_px();
    ((edge_px / 6.0 / 8.0).round() as usize * 8).clamp(16, 48)
}

/// Where each window lies by itself, and the similarity that most agree on.
fn agreement(
    view: &GroundView,
    structure: &Structure,
    ground: &Ground,
    size_px: usize,
) -> (Vec<WindowMatch>, Option<WindowFit>) {
    let layout = WindowOptions { size_px, stride_px: size_px, radius_px: RADIUS_PX, step_px: 1 };
    let windows = match_windows(structure, &ground.structure, [MARGIN_PX as isize; 2], &layout);
    let options = WindowFitOptions { tolerance_px: TOLERANCE_PX, max_growth: 0.12, max_turn_rad: 0.14 };
    let fit = fit_windows(&windows, view.grid.nadir_px, &options);
    (windows, fit)
}
