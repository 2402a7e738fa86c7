//! The store: one GeoPackage file with tiles, their descriptors and hashes.
//!
//! [`Reader`] reads a store, [`Writer`] builds a layer of one, and [`package`] exports, signs, verifies and patches stores.
//! `migrations/README.md` documents every table and blob. All SQL of the workspace is in `migrations/` and in this crate.

mod atomic_file;
mod bounded_file;
mod cache_limits;
mod cells;
mod connection;
mod content;
mod contract;
mod damage;
mod declaration;
mod digest;
mod error;
mod extract;
mod failure;
mod file_stamp;
mod finish;
mod footprint;
mod footprint_proof;
mod footprint_queries;
mod geometry;
mod geopackage;
mod ground;
mod ground_cache;
mod imagery;
mod layer;
mod layer_state;
mod level;
mod manifest;
mod migration;
mod output_file;
pub mod package;
mod reader;
mod remedy;
mod source;
mod stored_tile;
mod tile_cache;
mod tile_rows;
mod verify;
mod window;
mod writer;

pub use atomic_file::{AtomicFile, FileKind, PATCH_MAGIC, file_len};
pub use bounded_file::{read_bounded, read_bounded_text, read_small_text, require_regular};
pub use cache_limits::CacheLimits;
pub use connection::{APPLICATION_ID, USER_VERSION, clear_journal};
pub use content::{Child, TileContent, cells_blob};
pub use damage::Damage;
pub use declaration::Declaration;
pub use digest::{content_hash, hash_source, hex};
pub use error::StoreError;
pub use extract::{Extract, LayerHead, LayerPart};
pub use footprint::Footprint;
pub use imagery::{EncodedTile, JPEG_QUALITY, decode, encode, media_type};
pub use layer::{Layer, check_name};
pub use layer_state::LayerState;
pub use level::LevelDigests;
pub use migration::{FORMAT_VERSION, OLDEST_READABLE};
pub use output_file::{require_output, write_output};
pub use reader::Reader;
pub use remedy::StoreRemedy;
pub use source::Source;
pub use stored_tile::{StoredTile, TileSizes};
pub use verify::{BadTile, Verification, verify};
pub use writer::{BuiltTile, Writer, remove_layer};
