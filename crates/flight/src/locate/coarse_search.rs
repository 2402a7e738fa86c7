//! The coarse search: the frame under every hypothesis of heading and scale, correlated over every place of an area.

use super::area::SearchArea;
use super::cancellation::CancellationToken;
use super::coarse_peaks::{CoarsePeaks, SurfaceSums};
use super::error::LocateError;
use super::frame_pyramid::{FramePyramid, structure_of};
use super::hypotheses::Hypothesis;
use super::map::Map;
use super::pixel_window::PixelWindow;
use super::surface_maximum::SurfaceMaximum;
use overfly_core::registration::coarse::{CoarseMap, Fourier, PlacedView, Reach, Surface};
use overfly_core::tile::{Gsd, WorldPixel};
use overfly_store::StoreError;

/// Edge of one correlated block of places, pixels: bounds memory, and the ground sample distance hardly changes within a block.
pub const BLOCK_PX: i64 = 512;
/// Surfaces held at once for each thread, a megabyte each: a full turn under an uncertain height has thousands of hypotheses.
const SURFACES_PER_THREAD: usize = 8;
/// Pixels of the views held at once, five bytes each. Views of usual frames are 100 to 200 px wide, some hundred of them at once.
const HELD_VIEW_PIXELS: f64 = 1e7;
/// Neighbouring hypotheses that share one denominator of T: their views differ by a few pixels at the rim.
const SHARED_DENOMINATOR: usize = 4;

/// Searches `area` at its zoom, which must be a level of the pyramid `frame`. The cancellation token is checked before each
/// few views.
///
/// # Errors
/// [`LocateError::Store`] where a tile cannot be read; [`LocateError::Cancelled`].
pub fn search(
    map: &Map<'_>,
    frame: &FramePyramid<'_>,
    area: &SearchArea,
    hypotheses: &[Hypothesis],
    threads: usize,
    cancellation: &CancellationToken,
) -> Result<CoarsePeaks, LocateError> {
    let mut sums = SurfaceSums::default();
    let search = BlockSearch { map, frame, area, hypotheses, threads, cancellation };
    for block in area.blocks(BLOCK_PX) {
        search.run(&block, &mut sums)?;
    }
    Ok(CoarsePeaks::from_sums(sums))
}

/// The inputs that the searches of all blocks share.
struct BlockSearch<'a> {
    map: &'a Map<'a>,
    frame: &'a FramePyramid<'a>,
    area: &'a SearchArea,
    hypotheses: &'a [Hypothesis],
    threads: usize,
    cancellation: &'a CancellationToken,
}

impl BlockSearch<'_> {
    fn run(&self, block: &PixelWindow, sums: &mut SurfaceSums) -> Result<(), LocateError> {
        let gsd = self.area.gsd_of(block);
        let mut maximum = SurfaceMaximum::new(block, self.area);
        let mut compared: Vec<Hypothesis> = Vec::new();
        let together = SURFACES_PER_THREAD * self.threads.max(1);
        for batch in self.hypotheses.chunks(self.batch_len(gsd)) {
            self.cancellation.check()?;
            let Some(correlation) = BlockCorrelation::new(self.map, self.frame, block, gsd, batch)? else { continue };
            let BlockCorrelation { map, templates } = correlation;
            for (chunk, views) in templates.views.chunks(together).enumerate() {
                self.cancellation.check()?;
                for (within, surface) in correlate_all(&map, views, self.threads).iter().enumerate() {
                    if let Some(surface) = surface {
                        maximum.add(surface, compared.len() + chunk * together + within, sums);
                    }
                }
            }
            compared.extend(templates.hypotheses);
        }
        sums.peaks.extend(maximum.peaks(&compared));
        Ok(())
    }

    /// Number of hypotheses whose views are held at once, a multiple of [`SHARED_DENOMINATOR`].
    fn batch_len(&self, gsd: Gsd) -> usize {
        let corners = self.frame.camera().footprint_in_body().unwrap_or_default();
        let reach_m = corners.iter().map(|corner| corner.length_m()).fold(0.0, f64::max);
        let growth = self.hypotheses.iter().map(|hypothesis| hypothesis.height_ratio).fold(1.0, f64::max);
        let side_px = (2.0 * growth * reach_m / gsd.mean_m_per_px()).max(1.0);
        let views = (HELD_VIEW_PIXELS / (side_px * side_px)) as usize;
        (views / SHARED_DENOMINATOR).max(1) * SHARED_DENOMINATOR
    }
}

/// The views of the frame under some hypotheses at one level.
struct Templates {
    hypotheses: Vec<Hypothesis>,
    views: Vec<PlacedView>,
}

/// The map under a block, transformed for correlation, and the templates to correlate with it.
struct BlockCorrelation {
    map: CoarseMap,
    templates: Templates,
}

impl BlockCorrelation {
    /// `None` where the frame or the map under the block holds no structure.
    fn new(
        map: &Map<'_>,
        frame: &FramePyramid<'_>,
        block: &PixelWindow,
        gsd: Gsd,
        hypotheses: &[Hypothesis],
    ) -> Result<Option<Self>, StoreError> {
        let templates = templates(frame, block.zoom, gsd, hypotheses);
        if templates.views.is_empty() {
            return Ok(None);
        }
        let reach = Reach::from_views(&templates.views);
        let structure = map.window(&PixelWindow {
            zoom: block.zoom,
            left: block.left - reach.left,
            top: block.top - reach.top,
            width_px: block.width_px + reach.width_px() - 1,
            height_px: block.height_px + reach.height_px() - 1,
        })?;
        Ok((structure.total_energy() > 0.0).then(|| Self { map: CoarseMap::new(&structure, reach), templates }))
    }
}

/// T at every place of a block under one hypothesis, row by row; 0 where too little is compared. `None` where the frame or the
/// map under the block holds no structure.
///
/// # Errors
/// Where a tile cannot be read.
pub fn surface_of(
    map: &Map<'_>,
    frame: &FramePyramid<'_>,
    area: &SearchArea,
    block: &PixelWindow,
    hypothesis: Hypothesis,
) -> Result<Option<Vec<f32>>, StoreError> {
    let correlation = BlockCorrelation::new(map, frame, block, area.gsd_of(block), &[hypothesis])?;
    Ok(correlation.and_then(|c| correlate_all(&c.map, &c.templates.views, 1).pop()?).map(|surface| surface.values))
}

fn templates(frame: &FramePyramid<'_>, zoom: u8, gsd: Gsd, hypotheses: &[Hypothesis]) -> Templates {
    let mut templates = Templates { hypotheses: Vec::new(), views: Vec::new() };
    for &hypothesis in hypotheses {
        let view = frame.view(&hypothesis.pose(WorldPixel::default(), zoom), gsd, [0.0; 2]);
        let Some(view) = view else { continue };
        let nadir_px = [view.grid.nadir_px[0].round() as i64, view.grid.nadir_px[1].round() as i64];
        let structure = structure_of(&view);
        if structure.total_energy() > 0.0 {
            templates.hypotheses.push(hypothesis);
            templates.views.push(PlacedView { structure, nadir_px });
        }
    }
    templates
}

/// One surface for each view, in order, independent of the number of threads.
fn correlate_all(map: &CoarseMap, views: &[PlacedView], threads: usize) -> Vec<Option<Surface>> {
    let share = views.len().div_ceil(SHARED_DENOMINATOR).div_ceil(threads.max(1)).max(1) * SHARED_DENOMINATOR;
    let work = |views: &[PlacedView]| {
        let mut fourier = map.fourier();
        views
            .chunks(SHARED_DENOMINATOR)
            .flat_map(|neighbours| correlate_neighbours(map, &mut fourier, neighbours))
            .collect::<Vec<_>>()
    };
    if threads <= 1 {
        return work(views);
    }
    std::thread::scope(|scope| {
        let handles: Vec<_> = views.chunks(share).map(|chunk| scope.spawn(move || work(chunk))).collect();
        handles.into_iter().flat_map(|h| h.join().expect("correlation does not panic")).collect()
    })
}

/// The surfaces of views that share one denominator.
fn correlate_neighbours(map: &CoarseMap, fourier: &mut Fourier, neighbours: &[PlacedView]) -> Vec<Option<Surface>> {
    let Some(normalisation) = map.normalisation(fourier, &neighbours[neighbours.len() / 2]) else {
        return neighbours.iter().map(|_| None).collect();
    };
    let mut surfaces = Vec::with_capacity(neighbours.len());
    for pair in neighbours.chunks(2) {
        let [first, second] = map.correlate(fourier, [&pair[0], &pair[pair.len() - 1]], &normalisation);
        surfaces.push(Some(first));
        if pair.len() == 2 {
            surfaces.push(Some(second));
        }
    }
    surfaces
}
