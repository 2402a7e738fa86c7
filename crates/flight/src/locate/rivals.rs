//! `Rivals`: the places of the searched region that a frame fits almost as well, and the test of a place against them.
//!
//! On ground that repeats itself (orchards, rows of houses, parcels) the windows of a view alias together, so their agreement
//! proves a lattice and not a place. Each rival is brought to its best sub-pixel phase and compared with the place by the same pixels of
//! the frame (`registration::paired_comparison`).

use super::area::SearchArea;
use super::camera_pose::CameraPose;
use super::coarse_peaks::CoarsePeaks;
use super::coarse_search::{BLOCK_PX, surface_of};
use super::error::LocateError;
use super::hypotheses::Hypothesis;
use super::map::Map;
use super::near_maxima::{NEAR_PX, OWN_PEAK_PX, RIVAL_SHARE, local_maxima, maximum_around, near_maxima};
use super::observation::Observation;
use super::parts::Part;
use super::prepare::PreparedFrame;
use super::rival_votes::RivalVotes;
use super::search_context::SearchContext;
use nalgebra::{Matrix2, Vector2};
use overfly_core::geodesy::{BodyFrame, Enu, EnuCovariance, wrap_turn_rad};
use overfly_core::registration::a_contrario::{calibrated_alias_probability, log10_alias_probability};
use overfly_core::registration::paired_comparison::{PairedDifference, PlacedProducts, Placement};
use overfly_core::registration::self_similarity::self_similarity;
use overfly_core::tile::{WorldPixel, gsd_at};
use overfly_store::StoreError;

/// A place is accepted where it fits better than every rival by at least this many standard errors. Of 287 false fixes on ground
/// that repeats itself the highest reached 2.9, of 419 right fixes on other ground the lowest 4.1.
pub const LEAST_T_SCORE: f64 = 4.0;
/// A place is no fix where it is that of a rival with more than this probability: many rivals, or few blocks. The one false fix of
/// 17,000 searches over ground that repeats itself stated 0.0075, the most doubtful right fix of the demo's flight 0.0057.
pub const MOST_ALIAS_PROBABILITY: f64 = 0.006;
/// Where the windows tell a place from chance and a rival not, the place need be better by no more standard errors than this.
const LEAST_T_SCORE_OVER_CHANCE: f64 = 3.0;
/// Rivals taken from the correlation surface under the place's own heading and scale.
const SURFACE_RIVALS: usize = 12;
/// Places under different headings or scales are one place within this distance, pixels: where heading or scale is slightly wrong, the
/// peak lies beside its place.
const OWN_PEAK_TURNED_PX: f64 = 5.0;
/// A maximum is the highest within this many pixels.
const MAXIMUM_RADIUS_PX: usize = 3;
/// A rival that knows less than this share of the ground compared at the place is not compared.
const LEAST_OVERLAP: f64 = 0.3;
/// Places correlated at most, pixels; beyond, a coarser level is taken. A lattice too fine for that level repeats within the square
/// that is compared around the place on every finer level.
const MAX_PLACES: f64 = 2e5;
/// The rest of the area is not compared where the place has at least this z-score...
const CLEAR_Z_SCORE: f64 = 8.0;
/// ... and the second peak of the coarse search is at most this share of the first.
const CLEAR_SECOND_SHARE: f64 = 0.55;
/// Renderings that bring a rival to its best sub-pixel phase.
const PHASE_ROUNDS: usize = 3;
/// A copy of the ground has about the T of the place: a rival whose best phase stays below this share needs no exact phase.
const EQUAL_SHARE: f64 = 0.6;
/// The parabola through whole pixels may miss the height of a maximum by this factor: a lattice of 4 px seen half a pixel off on both
/// axes, where it gives 0.88 of each.
const MAX_PHASE_GAIN: f64 = 1.3;
/// A frame whose structure correlates by this much with itself displaced may repeat itself, and its rivals may also lie beyond the
/// searched area. 16 of 199 comparisons over NAIP do (at most 0.28), 10 of 22 over Brighton (at most 0.40), 43 of 45 over the demo's
/// fields (at most 0.58); of false fixes beside a lattice that the map does not show the lowest had 0.30. The bound decides nothing but
/// how far is compared.
const LEAST_SELF_SIMILARITY: f64 = 0.24;
/// Headings (radians) and scales (ratios) within this of each other give the same maximum.
const SAME_HEADING_RAD: f64 = 0.03;

/// The result of a comparison with all rivals.
#[derive(Debug, Clone, Copy, Default)]
pub struct RivalReport {
    /// Rivals compared.
    pub count: usize,
    /// Number of layers that may be searched. The probability of an alias counts all of them.
    pub layers: usize,
    /// The rival that the place beats by the fewest standard errors, of those beyond the place's own 95 % ellipse.
    pub strongest: Option<Rival>,
    /// What the rivals within that ellipse add to the covariance of the place, pixels of its level squared: the mixture of both places.
    pub near_px2: Matrix2<f64>,
}

/// A rival of a place.
#[derive(Debug, Clone, Copy)]
pub struct Rival {
    /// Its pose.
    pub pose: CameraPose,
    /// How much better the frame fits the place than the rival.
    pub difference: PairedDifference,
}

impl RivalReport {
    /// The probability by which a place is decided on: that chance makes it better than the strongest rival by so much, for each rival
    /// compared; 0 where there is none.
    pub fn alias_probability(&self) -> f64 {
        let Some(Rival { difference, .. }) = self.strongest else { return 0.0 };
        10f64.powf(log10_alias_probability(difference.t_score(), difference.blocks, self.count * self.layers))
    }

    /// The probability that the place is wrong because the frame lies at a rival, as trials over repeating ground show it; 0 where there
    /// is no rival. It counts all layers that may be searched.
    pub fn calibrated_probability(&self) -> f64 {
        let Some(Rival { difference, .. }) = self.strongest else { return 0.0 };
        let one_layer = calibrated_alias_probability(difference.t_score(), difference.blocks);
        (self.layers as f64 * one_layer).min(1.0)
    }

    /// The report with one more rival.
    fn with(self, rival: Rival) -> Self {
        let is_stronger = self.strongest.is_none_or(|s| rival.difference.t_score() < s.difference.t_score());
        let strongest = if is_stronger { Some(rival) } else { self.strongest };
        Self { strongest, count: self.count + 1, ..self }
    }

    /// The rival that makes the place ambiguous, if there is one.
    pub fn ambiguity(&self) -> Option<&Rival> {
        let is_likely = self.alias_probability() > MOST_ALIAS_PROBABILITY;
        self.strongest.as_ref().filter(|rival| is_likely || rival.difference.t_score() < LEAST_T_SCORE)
    }
}

/// Compares places with their rivals.
pub struct RivalSearch<'a> {
    /// The request and the store.
    pub context: &'a SearchContext<'a>,
    /// The map of the layer.
    pub map: &'a Map<'a>,
    /// The frame and the area.
    pub prepared: &'a PreparedFrame<'a>,
}

/// A pose at its best phase, and the observation there.
struct SettledPlace {
    pose: CameraPose,
    statistic: f64,
    observation: Observation,
    /// The pose under which the frame was observed, and the map's pixel under the view's corner.
    observed: (CameraPose, [usize; 2]),
}

impl SettledPlace {
    /// The products of view and map, for a comparison with another place.
    fn products(&self) -> PlacedProducts {
        let (pose, corner_px) = self.observed;
        PlacedProducts::new(&Placement {
            view: &self.observation.view_structure,
            nadir_px: self.observation.view.grid.nadir_px,
            heading_rad: pose.heading_rad,
            scale: pose.height_ratio,
            map: &self.observation.map_structure,
            corner_px,
        })
    }
}

impl RivalSearch<'_> {
    /// Compares a place with the maxima of the correlation surface under its own heading and scale, over the whole searched area, and
    /// with the peaks of the coarse search under theirs, until one makes it ambiguous. A rival within the 95 % ellipse of `own`, the
    /// covariance of the place, is no other place: leaning houses and relief make such maxima. It widens the covariance.
    ///
    /// # Errors
    /// [`LocateError::Store`] where a tile cannot be read; [`LocateError::Cancelled`].
    pub fn compare(
        &self,
        place: &CameraPose,
        own: EnuCovariance,
        near: &[[f64; 2]],
        z_score: f64,
        coarse: &CoarsePeaks,
    ) -> Result<RivalReport, LocateError> {
        let mut report = RivalReport { layers: self.context.layers, ..RivalReport::default() };
        let candidates = self.candidates(place, near, z_score, coarse)?;
        if candidates.is_empty() {
            return Ok(report);
        }
        let Some(found) = self.settled(place, 1, 0.0)? else { return Ok(report) };
        let products = found.products();
        let mut votes = RivalVotes::new(self.map, self.prepared, found.pose);
        for (pose, radius_px) in candidates {
            self.context.cancellation.check()?;
            let Some(rival) = self.settled(&pose, radius_px, EQUAL_SHARE * found.statistic)? else { continue };
            if is_same_place(&rival.pose, &found.pose) || rival.statistic < RIVAL_SHARE * found.statistic {
                continue;
            }
            let Some(difference) = products.compare(&rival.products()) else { continue };
            if difference.overlap < LEAST_OVERLAP {
                continue;
            }
            let difference = if difference.t_score() < LEAST_T_SCORE {
                self.clearest_difference(&found.pose, &rival.pose, difference)?
            } else {
                difference
            };
            let [offset_px, offset_m] = self.offsets(&found.pose, &rival.pose);
            if own.contains_95(Enu { east_m: offset_m.x, north_m: offset_m.y }) {
                let share = calibrated_alias_probability(difference.t_score(), difference.blocks);
                report.near_px2 += offset_px * offset_px.transpose() * share;
                continue;
            }
            let with_rival = report.with(Rival { pose: rival.pose, difference });
            if with_rival.ambiguity().is_none() {
                report = with_rival;
                continue;
            }
            // Votes are costly, so they are held only where they may save the place.
            let has_votes = self.context.parts.has(Part::RivalVotes);
            if has_votes && difference.t_score() >= LEAST_T_SCORE_OVER_CHANCE && votes.are_chance(&rival.pose)? {
                continue;
            }
            return Ok(with_rival);
        }
        Ok(report)
    }

    /// Where a rival sees the ground under the image's centre, from where the place sees it: pixels of the map, and metres to the east and
    /// north.
    fn offsets(&self, place: &CameraPose, rival: &CameraPose) -> [Vector2<f64>; 2] {
        let gsd = gsd_at(self.prepared.centre, place.zoom);
        let m_per_px = Vector2::new(gsd.east_m_per_px, -gsd.north_m_per_px);
        let centre_px = |pose: &CameraPose| {
            let camera = self.prepared.frame.camera().at_height_ratio(pose.height_ratio);
            let centre = camera.image_centre_in_body().unwrap_or_default();
            let centre = BodyFrame::from_heading_rad(pose.heading_rad).enu_from_body(centre);
            Vector2::new(pose.nadir.x_px, pose.nadir.y_px)
                + Vector2::new(centre.east_m, centre.north_m).component_div(&m_per_px)
        };
        let offset_px = centre_px(rival) - centre_px(place);
        [offset_px, offset_px.component_mul(&m_per_px)]
    }

    /// The poses to compare, each with the radius within which its maximum lies, pixels of the finest level.
    fn candidates(
        &self,
        place: &CameraPose,
        near: &[[f64; 2]],
        z_score: f64,
        coarse: &CoarsePeaks,
    ) -> Result<Vec<(CameraPose, usize)>, LocateError> {
        let mut candidates = Vec::new();
        let radius_px = |zoom: u8| 1 + (1usize << (place.zoom - zoom)) * usize::from(zoom < place.zoom);
        candidates.extend(near.iter().map(|&offset| (shifted(place, offset), 1)));
        for zoom in self.prepared.levels.coarse + 1..place.zoom {
            let pose = place.at_zoom(zoom);
            let observation = Observation::new(self.map, &self.prepared.frame, &pose, NEAR_PX as usize + 1)?;
            let offsets = observation.map(|o| near_maxima(&o)).unwrap_or_default();
            let around = offsets.into_iter().map(|offset| shifted(&pose, offset).at_zoom(place.zoom));
            candidates.extend(around.map(|pose| (pose, 1 + radius_px(zoom))));
        }
        let is_self_similar = self.self_similarity(place)? >= LEAST_SELF_SIMILARITY;
        if is_clear(z_score, coarse) && !is_self_similar {
            return Ok(candidates);
        }
        if let Some(area) = self.area_to_correlate(place, is_self_similar) {
            let rivals = self.surface_maxima(place, &area)?;
            candidates.extend(rivals.into_iter().map(|pose| (pose.at_zoom(place.zoom), radius_px(area.zoom()))));
        }
        for peak in &coarse.peaks {
            let (pose, radius_px) = (peak.pose.at_zoom(place.zoom), radius_px(peak.pose.zoom.min(place.zoom)));
            if !candidates.iter().any(|(known, _)| is_one_candidate(known, &pose, radius_px)) {
                candidates.push((pose, radius_px));
            }
        }
        Ok(candidates)
    }

    /// How much the frame looks like itself displaced, at the coarse level.
    fn self_similarity(&self, place: &CameraPose) -> Result<f64, StoreError> {
        let pose = place.at_zoom(self.prepared.levels.coarse);
        let observation = Observation::new(self.map, &self.prepared.frame, &pose, 0)?;
        Ok(observation.map_or(0.0, |o| self_similarity(&o.view_structure, OWN_PEAK_PX)))
    }

    /// The area to correlate, at the finest level on which it is not too large: the searched one, of a frame that repeats itself with the
    /// places around from which it reaches into that. Where even the searched one is too large at the coarse level, the surroundings
    /// of the place.
    fn area_to_correlate(&self, place: &CameraPose, is_self_similar: bool) -> Option<SearchArea> {
        let (layer, coarse) = (self.context.layer, self.prepared.levels.coarse);
        let reach_px = |zoom: u8| self.prepared.reach_px * 2f64.powi(i32::from(zoom) - i32::from(coarse));
        let searched = |by: f64| {
            (coarse..=place.zoom).rev().find_map(|zoom| {
                let area = SearchArea::new(&self.prepared.position, layer, zoom)?.grown(by * reach_px(zoom));
                area.cut_to_layer(layer, reach_px(zoom)).filter(|area| area.places() <= MAX_PLACES)
            })
        };
        let grown = if is_self_similar { searched(1.0) } else { None };
        grown.or_else(|| searched(0.0)).or_else(|| {
            let half_px = 0.5 * MAX_PLACES.sqrt() - 2.0;
            SearchArea::around_pixel(coarse, place.at_zoom(coarse).nadir, half_px).cut_to_layer(layer, reach_px(coarse))
        })
    }

    /// The highest maxima of T under the heading and scale of a place over an area, apart from its own peak.
    fn surface_maxima(&self, place: &CameraPose, area: &SearchArea) -> Result<Vec<CameraPose>, LocateError> {
        let own = place.at_zoom(area.zoom());
        let hypothesis = Hypothesis { heading_rad: place.heading_rad, height_ratio: place.height_ratio };
        let mut maxima: Vec<(f32, CameraPose)> = Vec::new();
        let mut highest = 0f32;
        for block in &area.blocks(BLOCK_PX) {
            self.context.cancellation.check()?;
            let surface = surface_of(self.map, &self.prepared.frame, area, block, hypothesis)?;
            let Some(values) = surface else { continue };
            for ([x, y], value) in local_maxima(&values, block.width_px, MAXIMUM_RADIUS_PX) {
                let at = [block.left + x as i64, block.top + y as i64];
                let nadir = WorldPixel { x_px: at[0] as f64, y_px: at[1] as f64 };
                let is_own = distance_px(nadir, own.nadir) < OWN_PEAK_PX;
                if is_own {
                    highest = highest.max(value);
                } else if area.contains_pixel(at[0], at[1]) {
                    maxima.push((value, CameraPose { nadir, ..own }));
                }
            }
        }
        maxima.retain(|(value, _)| *value >= RIVAL_SHARE as f32 * highest);
        maxima.sort_by(|a, b| b.0.total_cmp(&a.0));
        maxima.truncate(SURFACE_RIVALS);
        Ok(maxima.into_iter().map(|(_, pose)| pose).collect())
    }

    /// The difference of a place from a rival on the level that tells them apart best. Fine texture that repeats (furrows, rows of
    /// trees) can hide at the finest level what the outlines of fields tell at a coarser one.
    fn clearest_difference(
        &self,
        place: &CameraPose,
        rival: &CameraPose,
        finest: PairedDifference,
    ) -> Result<PairedDifference, StoreError> {
        let mut clearest = finest;
        for zoom in self.prepared.levels.coarse..place.zoom {
            let Some(place) = self.settled(&place.at_zoom(zoom), 1, 0.0)? else { continue };
            let Some(rival) = self.settled(&rival.at_zoom(zoom), 1, 0.0)? else { continue };
            let difference = place.products().compare(&rival.products());
            clearest = difference.filter(|d| d.t_score() > clearest.t_score()).unwrap_or(clearest);
        }
        Ok(clearest)
    }

    /// Brings a pose to the highest T within `radius_px`, first on whole pixels, then on fractions, each phase rendered anew. A place
    /// that no phase brings to `least` stays on whole pixels.
    fn settled(&self, pose: &CameraPose, radius_px: usize, least: f64) -> Result<Option<SettledPlace>, StoreError> {
        let mut pose = *pose;
        let mut best: Option<SettledPlace> = None;
        for round in 0..PHASE_ROUNDS {
            let reach = if round == 0 { radius_px } else { 1 };
            let Some(observation) = Observation::new(self.map, &self.prepared.frame, &pose, reach + 1)? else { break };
            let Some((offset, at)) = maximum_around(&observation, reach) else { break };
            let whole = offset.map(|d| d as f64);
            let vertex = [whole[0] + at.vertex[0], whole[1] + at.vertex[1]];
            let (start, end) = (pose, shifted(&pose, vertex));
            if best.as_ref().is_none_or(|b| at.value > b.statistic) {
                let corner = offset.map(|d| (d + reach as isize + 1) as usize);
                let (pose, statistic, observed) = (shifted(&start, whole), at.value, (start, corner));
                best = Some(SettledPlace { pose, statistic, observation, observed });
            }
            if MAX_PHASE_GAIN * at.vertex_value < least {
                break;
            }
            pose = end;
        }
        Ok(best)
    }
}

/// Whether a place stands so clear of all others in the coarse search that only its surroundings can hold a rival.
fn is_clear(z_score: f64, coarse: &CoarsePeaks) -> bool {
    let statistic = |i: usize| coarse.peaks.get(i).map_or(0.0, |p| p.statistic);
    z_score >= CLEAR_Z_SCORE && statistic(1) <= CLEAR_SECOND_SHARE * statistic(0)
}

fn shifted(pose: &CameraPose, [dx, dy]: [f64; 2]) -> CameraPose {
    CameraPose { nadir: WorldPixel { x_px: pose.nadir.x_px + dx, y_px: pose.nadir.y_px + dy }, ..*pose }
}

fn distance_px(a: WorldPixel, b: WorldPixel) -> f64 {
    (a.x_px - b.x_px).hypot(a.y_px - b.y_px)
}

/// Whether the maximum within `radius_px` of a pose is that of another pose under almost the same heading and scale.
fn is_one_candidate(known: &CameraPose, pose: &CameraPose, radius_px: usize) -> bool {
    distance_px(known.nadir, pose.nadir) <= radius_px as f64
        && wrap_turn_rad(known.heading_rad - pose.heading_rad).abs() < SAME_HEADING_RAD
        && (known.height_ratio / pose.height_ratio).ln().abs() < SAME_HEADING_RAD
}

/// Whether two poses of one level are one place: near each other, under almost the same heading.
fn is_same_place(a: &CameraPose, b: &CameraPose) -> bool {
    let is_one_view = a.heading_rad == b.heading_rad && a.height_ratio == b.height_ratio;
    let own_peak_px = if is_one_view { OWN_PEAK_PX } else { OWN_PEAK_TURNED_PX };
    distance_px(a.nadir, b.nadir) < own_peak_px && wrap_turn_rad(a.heading_rad - b.heading_rad).abs() < 0.3
}

#[cfg(test)]
mod tests {
    use super::super::coarse_peaks::CoarsePeak;
    use super::*;

    fn peaks(statistics: &[f64]) -> CoarsePeaks {
        let pose = Hypothesis::STATED.pose(WorldPixel::default(), 12);
        let peaks = statistics.iter().map(|&statistic| CoarsePeak { pose, statistic }).collect();
        CoarsePeaks { peaks, ..CoarsePeaks::default() }
    }

    #[test]
    fn only_a_high_peak_without_a_second_is_clear() {
        assert!(is_clear(9.0, &peaks(&[100.0, 50.0])));
        assert!(is_clear(9.0, &peaks(&[100.0])));
        assert!(!is_clear(7.9, &peaks(&[100.0, 50.0])));
        assert!(!is_clear(20.0, &peaks(&[100.0, 60.0])));
    }

    #[test]
    fn a_half_turn_at_one_place_is_another_place() {
        let upright = peaks(&[1.0]).peaks[0].pose;
        let turned = CameraPose { heading_rad: std::f64::consts::PI, ..upright };
        assert!(!is_same_place(&upright, &turned) && is_same_place(&upright, &shifted(&upright, [2.0, 2.0])));
        // A lattice of four pixels, and a peak that a slightly wrong heading displaces.
        let beside = shifted(&upright, [4.0, 0.0]);
        assert!(!is_same_place(&upright, &beside));
        assert!(is_same_place(&upright, &CameraPose { heading_rad: 0.02, ..beside }));
    }
}
