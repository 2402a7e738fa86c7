//! `Explanation`: the trace of one registration as pictures: frame, view and map, coarse surface, windows, footprint.
//!
//! Draws what [`locate_traced`](overfly_flight::locate::locate_traced) returns. Reads only the map's colours from the store, and
//! writes no file.

mod drawing;
mod map_picture;
mod page;
mod palette;
mod picture;
mod surface;

use map_picture::MapPicture;
use overfly_core::pixels::Colour;
use overfly_flight::locate::{Answer, FixRequest, Trace};
use overfly_store::{Reader, StoreError};

/// A file of an explanation: its name and its bytes.
pub type PictureFile = (&'static str, Vec<u8>);

/// One registration, ready to be drawn.
pub struct Explanation<'a> {
    frame: &'a Colour,
    answer: &'a Answer,
    trace: &'a Trace,
    /// The map in colour under the traced windows; `None` where the registration ended before its search.
    map: Option<MapPicture>,
}

impl<'a> Explanation<'a> {
    /// Returns the explanation of a frame, its request, the answer and the trace.
    ///
    /// # Errors
    /// Where the store has no such layer or a tile cannot be read.
    pub fn new(
        store: &Reader,
        frame: &'a Colour,
        request: &FixRequest,
        answer: &'a Answer,
        trace: &'a Trace,
    ) -> Result<Self, StoreError> {
        let layer = store.layer(&request.layer)?;
        let window = trace.windows.as_ref().map(|traced| traced.observation.window);
        let map = window.map(|window| MapPicture::read(store, layer, window)).transpose()?;
        Ok(Self { frame, answer, trace, map })
    }

    /// The pictures, and last the page that shows them, `index.html`.
    pub fn pages(&self) -> Vec<PictureFile> {
        let mut files = vec![("frame.jpg", picture::jpeg(&picture::shrunk(self.frame)))];
        if let (Some(traced), Some(map)) = (&self.trace.windows, &self.map) {
            let observation = &traced.observation;
            files.extend([
                ("view.jpg", picture::jpeg(&palette::gray(&observation.view.gray))),
                ("view-doubled.jpg", picture::jpeg(&palette::channel(&observation.view_structure, 0))),
                ("view-quadrupled.jpg", picture::jpeg(&palette::channel(&observation.view_structure, 1))),
                ("map.jpg", picture::jpeg(&map.colour)),
                ("map-doubled.jpg", picture::jpeg(&palette::channel(&observation.map_structure, 0))),
                ("map-quadrupled.jpg", picture::jpeg(&palette::channel(&observation.map_structure, 1))),
            ]);
            if let Some(surface) = &self.trace.surface {
                files.push(("surface.svg", surface::svg(surface, &self.trace.peaks).into_bytes()));
            }
            files.push(("windows.svg", drawing::windows(traced, map).into_bytes()));
            if let Answer::Fix(fix) = self.answer
                && let Some(svg) = drawing::footprint(fix, traced, map)
            {
                files.push(("footprint.svg", svg.into_bytes()));
            }
        }
        let names: Vec<&str> = files.iter().map(|(name, _)| *name).collect();
        files.push(("index.html", page::html(self.answer, self.trace, &names).into_bytes()));
        files
    }
}
