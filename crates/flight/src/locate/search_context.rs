//! `SearchContext`: what every stage of one registration reads.

use super::cancellation::CancellationToken;
use super::ground_heights::GroundHeights;
use super::parts::Parts;
use super::request::FixRequest;
use super::stated_height::StatedHeight;
use overfly_store::{Layer, Reader};

/// The inputs of one registration besides the frame.
#[derive(Clone, Copy)]
pub struct SearchContext<'a> {
    /// The store to search.
    pub store: &'a Reader,
    /// The layer to search.
    pub layer: &'a Layer,
    /// The terrain of the store, where frames are laid on it.
    pub ground: Option<GroundHeights<'a>>,
    /// Number of layers that may be searched for this request, this one included. The number of false alarms counts all of them.
    pub layers: usize,
    /// The request, its height above the ground around the searched region.
    pub request: &'a FixRequest,
    /// The height as stated, and what it means at a place.
    pub height: &'a StatedHeight,
    /// Threads that the search may use; their number does not change the answer.
    pub threads: usize,
    /// The parts of the method that are used.
    pub parts: Parts,
    /// Ends the search early.
    pub cancellation: &'a CancellationToken,
}
