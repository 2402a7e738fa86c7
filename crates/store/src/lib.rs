//! The store: one GeoPackage. `Reader` asks, `Writer` (used by `build`) writes.
//!
//! What stands in which table and blob: `migrations/README.md`. All SQL of the program stands there and here.

mod cells;
mod connection;
mod content;
mod damage;
mod declaration;
mod digest;
mod draft;
mod error;
mod extract;
mod finish;
mod footprint;
mod geometry;
mod geopackage;
mod ground;
mod imagery;
mod keep;
mod layer;
mod level;
mod manifest;
mod migration;
mod outlet;
pub mod package;
mod reader;
mod shelf;
mod source;
mod stamp;
mod stored_tile;
mod verify;
mod window;
mod witness;
mod writer;

pub use connection::{APPLICATION_ID, USER_VERSION, settle};
pub use content::{Child, TileContent, cells_blob};
pub use damage::Damage;
pub use declaration::Declaration;
pub use digest::{content_hash, hash_source, hex};
pub use draft::Draft;
pub use error::StoreError;
pub use extract::{Extract, LayerHead, LayerPart};
pub use footprint::Footprint;
pub use imagery::{EncodedTile, JPEG_QUALITY, decode, encode, media_type};
pub use keep::Keep;
pub use layer::{Layer, check_name};
pub use level::LevelDigests;
pub use migration::FORMAT_VERSION;
pub use outlet::{Kind, Outlet, PATCH_MAGIC, size_of};
pub use reader::Reader;
pub use source::Source;
pub use stored_tile::{StoredTile, TileSizes};
pub use verify::{BadTile, Verification, verify};
pub use writer::{BuiltTile, Writer, remove_layer};

use overfly_core::feature::keypoint::CONTRACT;
use rusqlite::Connection;
use std::path::Path;

/// The contract of a store, refused where it is not this program's.
fn require_contract(connection: &Connection, path: &Path) -> Result<String, StoreError> {
    let found: String = connection
        .query_row("SELECT descriptor_contract FROM overfly_store WHERE id = 1", [], |row| row.get(0))
        .map_err(|e| match e {
            rusqlite::Error::QueryReturnedNoRows => {
                StoreError::Damaged { path: path.into(), reason: "it states no descriptor contract".into() }
            }
            other => StoreError::sqlite(path, other),
        })?;
    if found == CONTRACT {
        return Ok(found);
    }
    Err(StoreError::OtherContract { path: path.into(), found, expected: CONTRACT.into() })
}
