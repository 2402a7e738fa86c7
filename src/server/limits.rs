//! `Limits`: limits on the size, time, number and memory of requests.

use super::error::ServerError;
use super::export_limits::ExportLimits;
use overfly_core::pixels::Gray;
use overfly_flight::frame::{FrameBounds, decode_frame_within};
use overfly_flight::locate::candidates::MAX_TILES;
use overfly_store::CacheLimits;
use std::time::Duration;

/// Limits on the size, time, number and memory of requests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Largest request body, bytes.
    pub body_bytes: usize,
    /// Longest wait for a request's body.
    pub body_time: Duration,
    /// In each such window of time, at least `body_window_bytes` of a request's body must arrive, or its end.
    pub body_window: Duration,
    /// See `body_window`, bytes.
    pub body_window_bytes: usize,
    /// Longest wait for an answer.
    pub answer_time: Duration,
    /// Longest search for hints that a request may ask for.
    pub hints_time: Duration,
    /// Longest edge of an uploaded image, pixels.
    pub image_edge_px: u32,
    /// Most pixels of an uploaded image.
    pub image_px: u64,
    /// Most uploads in memory at the same time.
    pub uploads: usize,
    /// Most bytes of uploads in memory at the same time.
    pub uploads_bytes: usize,
    /// Most registrations at the same time; each takes about 8 bytes per pixel of its images.
    pub registrations: usize,
    /// Most other requests that are answered at the same time.
    pub questions: usize,
    /// Threads for each registration.
    pub threads: usize,
    /// Memory for indexes of footprints, bytes; requests over other levels are answered from the file.
    pub index_bytes: u64,
    /// Most tiles of one answer.
    pub tiles: u64,
    /// Limits of the caches of the store's reader.
    pub keep: CacheLimits,
    /// Limits of the exports that are kept; on the ground only.
    pub exports: ExportLimits,
}

/// Bytes per pixel of a frame while it is decoded.
const PIXEL_BYTES: u64 = 8;
/// Bytes per tile of an answer while the answer is made: its row, its entry, its text.
const TILE_BYTES: u64 = 1_200;
/// With at least this much memory, two frames are registered at the same time.
const TWO_AT_ONCE_BYTES: u64 = 1 << 30;

impl Limits {
    /// The limits for a service that holds about `memory_bytes`, besides the program itself (about 40 MB) and 28 bytes for each tile
    /// of its store: 20 % for ground, 15 % for cells, 10 % for indexes, 5 % for pages of the file, 15 % for uploads, the rest for
    /// work. No limit is looser than the default.
    pub fn within(memory_bytes: u64) -> Self {
        let usual = Self::default();
        let percent = |n: u64| memory_bytes / 100 * n;
        let registrations = if memory_bytes < TWO_AT_ONCE_BYTES { 1 } else { usual.registrations };
        let work = percent(35);
        let uploads_bytes = percent(15) as usize;
        let connections = usual.keep.connections.min(6);
        Self {
            body_bytes: usual.body_bytes.min(uploads_bytes),
            uploads_bytes: usual.uploads_bytes.min(uploads_bytes),
            image_px: usual.image_px.min(work / PIXEL_BYTES / registrations as u64),
            registrations,
            questions: usual.questions.min(connections - 2),
            index_bytes: percent(10),
            tiles: MAX_TILES.min(work / 3 / TILE_BYTES),
            keep: CacheLimits {
                ground_bytes: usual.keep.ground_bytes.min(percent(20)),
                cells_bytes: usual.keep.cells_bytes.min(percent(15)),
                connections,
                pages_bytes: usual.keep.pages_bytes.min(percent(5) / connections as u64),
            },
            ..usual
        }
    }

    /// Decodes the camera frame in `bytes`, the form's part `part`.
    ///
    /// # Errors
    /// [`ServerError::Frame`]: not an image, or too large.
    pub(super) fn frame(&self, part: &'static str, bytes: &[u8]) -> Result<Gray, ServerError> {
        let bounds = FrameBounds { edge_px: self.image_edge_px, pixels: self.image_px };
        decode_frame_within(bytes, part, bounds).map_err(|error| ServerError::Frame { part, error })
    }
}

impl Default for Limits {
    fn default() -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Self {
            body_bytes: 48 << 20,
            body_time: Duration::from_secs(30),
            body_window: Duration::from_secs(5),
            body_window_bytes: 40 << 10,
            answer_time: Duration::from_secs(60),
            hints_time: Duration::from_secs(10),
            image_edge_px: 20_000,
            image_px: 64_000_000,
            uploads: 8,
            uploads_bytes: 3 * (48 << 20),
            registrations: 2,
            questions: 4 * cores,
            threads: cores,
            index_bytes: 256 << 20,
            tiles: MAX_TILES,
            keep: CacheLimits::default(),
            exports: ExportLimits::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All memory that may be held at the same time, bytes.
    fn sum(l: &Limits) -> u64 {
        let work = (l.image_px * PIXEL_BYTES * l.registrations as u64).max(3 * l.tiles * TILE_BYTES);
        let pages = l.keep.pages_bytes * l.keep.connections as u64;
        work + l.keep.ground_bytes + l.keep.cells_bytes + l.index_bytes + pages + l.uploads_bytes as u64
    }

    #[test]
    fn what_may_be_held_adds_up_to_what_is_allowed() {
        for megabytes in [64, 128, 200, 512, 1_000, 1_100, 4_000] {
            let (allowed, limits) = (megabytes * 1_000_000, Limits::within(megabytes * 1_000_000));
            assert!(sum(&limits) <= allowed, "{megabytes}: {}", sum(&limits));
            assert!(megabytes > 1_000 || sum(&limits) > allowed * 9 / 10, "{megabytes}: {}", sum(&limits));
            assert!(limits.questions > 0 && limits.questions < limits.keep.connections);
        }
    }

    #[test]
    fn none_is_looser_than_by_default() {
        let (much, usual) = (Limits::within(u64::MAX), Limits::default());
        assert_eq!((much.image_px, much.body_bytes, much.tiles), (usual.image_px, usual.body_bytes, usual.tiles));
        assert_eq!((much.keep.ground_bytes, much.keep.cells_bytes), (usual.keep.ground_bytes, usual.keep.cells_bytes));
    }
}
