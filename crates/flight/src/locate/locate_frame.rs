//! `locate`: one absolute registration, as a chain of values: prepared frame, coarse peaks, refined places, verdict, answer.

use super::answer::Answer;
use super::answering::{SearchSize, answer, no_fix};
use super::cancellation::CancellationToken;
use super::coarse_peaks::CoarsePeaks;
use super::epochs::{LayerAnswer, beside_newer, nearest, searched_layers};
use super::error::LocateError;
use super::ground_heights::GroundHeights;
use super::map::Map;
use super::parts::{Part, Parts};
use super::prepare::PreparedFrame;
use super::refine::{RefinedPeaks, refine_peaks};
use super::refusal::EarlyEnd;
use super::request::FixRequest;
use super::search_context::SearchContext;
use super::search_steps::SearchSteps;
use super::stated_height::StatedHeight;
use super::trace::Trace;
use super::tracked_place::TrackedPlace;
use super::verify::{Verdict, Verifier};
use super::weighed_place::WeighedPlace;
use overfly_core::camera::{Camera, View};
use overfly_core::pixels::Gray;
use overfly_store::Reader;

/// Locates a frame on a layer, or on all layers ([`overfly_store::ANY_LAYER`]), the newest first: a fix, or no fix and why. `threads` bounds the parallelism; it does not change the answer.
///
/// # Errors
/// [`LocateError`] where the request or the store cannot be used. "No fix" is an answer.
///
/// # Example
/// ```no_run
/// use overfly_core::camera::View;
/// use overfly_flight::frame::read_frame;
/// use overfly_flight::locate::{Answer, FixRequest, HeadingPrior, PositionPrior, locate};
///
/// let store = overfly_store::Reader::open(std::path::Path::new("map.gpkg"))?;
/// let frame = read_frame(std::path::Path::new("frame.jpg"))?;
/// let request = FixRequest {
///     layer: "ortho".into(),
///     position: PositionPrior::from_degrees(48.4915, 15.616, [200.0, 200.0], 0.0)?,
///     heading: Some(HeadingPrior::from_degrees(271.6, 3.0)?),
///     view: View::Nadir { gsd_m_per_px: 1.25 },
///     scale_sigma_ratio: 0.03,
///     time_s: None,
/// };
/// match locate(&store, &frame, &request, 2)? {
///     Answer::Fix(fix) => println!("{:?}", fix),
///     Answer::NoFix(no_fix) => println!("{:?}: {}", no_fix.reason, no_fix.detail),
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn locate(store: &Reader, frame: &Gray, request: &FixRequest, threads: usize) -> Result<Answer, LocateError> {
    locate_cancellable(store, frame, request, threads, &CancellationToken::new())
}

/// As [`locate`], until `cancellation` is cancelled. The token is checked between pieces of work of about a second.
///
/// # Errors
/// As [`locate`], and [`LocateError::Cancelled`].
pub fn locate_cancellable(
    store: &Reader,
    frame: &Gray,
    request: &FixRequest,
    threads: usize,
    cancellation: &CancellationToken,
) -> Result<Answer, LocateError> {
    located(store, frame, request, &Means { threads, parts: Parts::ALL, cancellation })
}

/// As [`locate`], with only some parts of the method: what an ablation compares.
///
/// # Errors
/// As [`locate`].
pub fn locate_by_parts(
    store: &Reader,
    frame: &Gray,
    request: &FixRequest,
    threads: usize,
    parts: Parts,
) -> Result<Answer, LocateError> {
    located(store, frame, request, &Means { threads, parts, cancellation: &CancellationToken::new() })
}

/// By what a search is made.
struct Means<'a> {
    threads: usize,
    parts: Parts,
    cancellation: &'a CancellationToken,
}

fn located(store: &Reader, frame: &Gray, request: &FixRequest, means: &Means<'_>) -> Result<Answer, LocateError> {
    request.check()?;
    let search = |context: &SearchContext<'_>| {
        let registration = register(context, frame)?;
        let places = registration.verified_places(context);
        Ok(LayerAnswer { answer: registration.answer, places, more: () })
    };
    Ok(over_layers(store, request, means, &search)?.0)
}

/// As [`locate`], with a trace of the search of the layer that the answer is from: levels, peaks, windows and decision. The trace
/// costs one more observation of the frame and one more correlation of the coarse search.
///
/// # Errors
/// As [`locate`].
pub fn locate_traced(
    store: &Reader,
    frame: &Gray,
    request: &FixRequest,
    threads: usize,
) -> Result<(Answer, Trace), LocateError> {
    request.check()?;
    let search = |context: &SearchContext<'_>| {
        let registration = register(context, frame)?;
        let trace = match &registration.search {
            Some((prepared, search)) => {
                Trace::new(context, prepared, &search.peaks, search.verdict.as_ref(), search.is_wide)?
            }
            None => Trace::default(),
        };
        let places = registration.verified_places(context);
        Ok(LayerAnswer { answer: registration.answer, places, more: trace })
    };
    over_layers(store, request, &Means { threads, parts: Parts::ALL, cancellation: &CancellationToken::new() }, &search)
}

/// Searches the layers of a request one after the other, until the answer of one stands. Each search counts the false alarms of all.
fn over_layers<T>(
    store: &Reader,
    request: &FixRequest,
    means: &Means<'_>,
    search: &dyn Fn(&SearchContext<'_>) -> Result<LayerAnswer<T>, LocateError>,
) -> Result<(Answer, T), LocateError> {
    let searched = searched_layers(store, &request.layer)?;
    let layers = searched.len();
    let (mut answers, mut newer) = (Vec::new(), Vec::new());
    for layer in searched {
        let Means { threads, parts, cancellation } = *means;
        cancellation.check()?;
        let is_posed = matches!(request.view, View::Posed { .. });
        let ground = GroundHeights::from_store(store).filter(|_| is_posed && parts.has(Part::Terrain));
        let (height, request) = StatedHeight::resolved(request, layer, ground.as_ref())?;
        let (request, height) = (&request, &height);
        let context = SearchContext { store, layer, ground, layers, request, height, threads, parts, cancellation };
        let LayerAnswer { answer, places, more } = search(&context)?;
        let answer = beside_newer(answer, places.first(), &newer);
        newer.extend(places);
        let stands = answer.stands();
        answers.push((answer, more));
        if stands {
            break;
        }
    }
    Ok(nearest(answers))
}

/// As [`locate`], with the evidence of the best place, be it a fix or not: what trials compare with the truth.
///
/// # Errors
/// As [`locate`].
pub fn locate_weighed(
    store: &Reader,
    frame: &Gray,
    request: &FixRequest,
    threads: usize,
) -> Result<(Answer, Option<WeighedPlace>), LocateError> {
    request.check()?;
    let search = |context: &SearchContext<'_>| {
        let registration = register(context, frame)?;
        let places = registration.verified_places(context);
        Ok(LayerAnswer { answer: registration.answer, more: places.first().cloned(), places })
    };
    over_layers(store, request, &Means { threads, parts: Parts::ALL, cancellation: &CancellationToken::new() }, &search)
}

/// As [`locate`], and without a fix the places that a track may decide on, best first.
///
/// # Errors
/// As [`locate`].
pub fn locate_places(
    store: &Reader,
    frame: &Gray,
    request: &FixRequest,
    threads: usize,
) -> Result<(Answer, Vec<TrackedPlace>), LocateError> {
    request.check()?;
    let search = |context: &SearchContext<'_>| {
        let registration = register(context, frame)?;
        let tracked = match &registration.search {
            Some((prepared, Search { verdict: Some(verdict), .. })) => {
                let camera = prepared.frame.camera();
                let size = SearchSize::new(context.request, context.layer, camera);
                let size = SearchSize { tiles_searched: prepared.tiles_searched, ..size };
                TrackedPlace::all(context, camera, size, verdict)?
            }
            _ => Vec::new(),
        };
        let places = registration.verified_places(context);
        Ok(LayerAnswer { answer: registration.answer, more: tracked, places })
    };
    over_layers(store, request, &Means { threads, parts: Parts::ALL, cancellation: &CancellationToken::new() }, &search)
}

/// An answer, and the values of the search that led to it.
struct Registration<'a> {
    answer: Answer,
    /// `None` where the registration ended before its search.
    search: Option<(PreparedFrame<'a>, Search)>,
}

impl Registration<'_> {
    fn verified_places(&self, context: &SearchContext<'_>) -> Vec<WeighedPlace> {
        let verdict = self.search.as_ref().and_then(|(_, search)| search.verdict.as_ref());
        verdict.map(|verdict| WeighedPlace::all(verdict, context)).unwrap_or_default()
    }
}

/// The values of a search.
struct Search {
    peaks: CoarsePeaks,
    /// `None` where there was no step to search.
    verdict: Option<Verdict>,
    /// Whether a wide search over cells was made.
    is_wide: bool,
}

fn register<'a>(context: &SearchContext<'a>, frame: &'a Gray) -> Result<Registration<'a>, LocateError> {
    let camera = Camera::new(&context.request.view, frame.width_px() as u32, frame.height_px() as u32)?;
    let size = SearchSize::new(context.request, context.layer, &camera);
    let prepared = match PreparedFrame::new(context, frame, camera) {
        Ok(prepared) => prepared,
        Err(EarlyEnd::Error(error)) => return Err(error),
        Err(EarlyEnd::NoFix(refusal)) => {
            return Ok(Registration { answer: no_fix(context, size, &refusal, None), search: None });
        }
    };
    let search = search(context, &prepared)?;
    let size = SearchSize { tiles_searched: prepared.tiles_searched, ..size };
    let answer = answer(context, prepared.frame.camera(), size, search.verdict.as_ref())?;
    Ok(Registration { answer, search: Some((prepared, search)) })
}

/// Searches step by step, the likeliest headings, scales and places first, until a fix is sure.
fn search<'a>(context: &SearchContext<'a>, prepared: &PreparedFrame<'a>) -> Result<Search, LocateError> {
    let steps = SearchSteps::plan(context, prepared)?;
    let map = Map::new(context);
    let verifier = Verifier { map: &map, prepared, context };
    let (mut peaks, mut known, mut verdict) = (CoarsePeaks::default(), RefinedPeaks::default(), None);
    for step in 0..steps.len() {
        peaks = steps.search(step, peaks, context, &map, prepared)?;
        let refined = refine_peaks(context, &map, prepared, &peaks, &mut known)?;
        if verdict.insert(verifier.verify(&peaks, refined)?).is_sure() {
            break;
        }
    }
    Ok(Search { peaks, verdict, is_wide: steps.is_wide() })
}
