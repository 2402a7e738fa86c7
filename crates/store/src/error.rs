//! `StoreError`: why a store cannot be opened, read or written, and what to do about it.

use overfly_core::tile::TileId;
use std::path::{Path, PathBuf};

/// What Linux, the BSDs and macOS call a device that fails.
const EIO: i32 = 5;

/// Why a store cannot be opened, read or written.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// No such file.
    #[error("{path}: there is no such file; make a store with `overfly build --db {path} SOURCE...`", path = path.display())]
    Missing {
        /// What was asked for.
        path: PathBuf,
    },
    /// A file that is something else.
    #[error("{path}: not an overfly store: {found}; make one with `overfly build --db FILE SOURCE...`", path = path.display())]
    NotAStore {
        /// The file.
        path: PathBuf,
        /// What it is instead.
        found: String,
    },
    /// A build was begun and not ended.
    #[error("{path}: unfinished build of layer {layer}: run the same `overfly build` again, it goes on where it stopped", path = path.display())]
    Unfinished {
        /// The store.
        path: PathBuf,
        /// The layer, or several.
        layer: String,
    },
    /// A layer that a build has put nothing into yet, or none at all.
    #[error("{path}: the store holds no layer; fill it with `overfly build --db {path} SOURCE...`", path = path.display())]
    NoLayers {
        /// The store.
        path: PathBuf,
    },
    /// Made by a newer program.
    #[error("{path}: store format {found} is newer than this program's, {known}: use a newer overfly", path = path.display())]
    NewerFormat {
        /// The store.
        path: PathBuf,
        /// Its version.
        found: u32,
        /// The newest this program knows.
        known: u32,
    },
    /// Made by an older program and not migrated.
    #[error("{path}: store format {found} is older than this program's, {known}: any `overfly build --db {path}` migrates it", path = path.display())]
    OlderFormat {
        /// The store.
        path: PathBuf,
        /// Its version.
        found: u32,
        /// This program's.
        known: u32,
    },
    /// Tiles described in another way than this program describes frames.
    #[error("{path}: its descriptors follow the contract {found}, this program's follow {expected}: build the store anew with this program", path = path.display())]
    OtherContract {
        /// The store.
        path: PathBuf,
        /// Its contract.
        found: String,
        /// This program's.
        expected: String,
    },
    /// A journal or log beside a store that is opened immutable.
    #[error("{side}: a non-empty side file stands beside the store, so its last change is unfinished: run the same `overfly build` again where it can be written, then copy the store", side = side.display())]
    SideFile {
        /// The side file.
        side: PathBuf,
    },
    /// An interrupted write that cannot be rolled back here.
    #[error("{path}: an interrupted build left a journal that cannot be rolled back here: run `overfly build` again, or make file and folder writable", path = path.display())]
    HotJournal {
        /// The store.
        path: PathBuf,
    },
    /// No layer of that name.
    #[error("{path}: no layer {name:?}; it has {known}", path = path.display())]
    NoLayer {
        /// The store.
        path: PathBuf,
        /// What was asked for.
        name: String,
        /// Those it has.
        known: String,
    },
    /// A name that cannot name a layer.
    #[error(
        "{name:?} cannot name a layer: use 1 to 40 of a-z 0-9 _ -, a letter or digit first, and none of overfly_..., gpkg_..., rtree_..., sqlite_..., footprints"
    )]
    LayerName {
        /// What was given.
        name: String,
    },
    /// The file or its folder may not be read or written.
    #[error("{path}: no permission ({reason}): make file and folder accessible, or choose another place", path = path.display())]
    Denied {
        /// The file.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// The folder that shall hold it is absent.
    #[error("{path}: its folder does not exist: make it first, or choose another place", path = path.display())]
    NoFolder {
        /// The file.
        path: PathBuf,
    },
    /// No room.
    #[error("{path}: the disk is full; what was there before is untouched: make room and run the same command again; a build goes on where it stopped", path = path.display())]
    DiskFull {
        /// The file.
        path: PathBuf,
    },
    /// The disk cannot be read or written.
    #[error("{path}: the disk fails or is full ({reason}); nothing half done is kept: check the disk and its room, then run the same command again, or use a copy on another disk", path = path.display())]
    DiskError {
        /// The file.
        path: PathBuf,
        /// What the system or SQLite says.
        reason: String,
    },
    /// A file beside it, which a write needs, cannot be made or opened.
    #[error("{path}: its journal cannot be made or opened ({reason}); what was there before is untouched: the disk is full or fails, or too many files are open; see to it and run the same command again", path = path.display())]
    NoJournal {
        /// The store.
        path: PathBuf,
        /// What SQLite says.
        reason: String,
    },
    /// Another program holds it.
    #[error("{path}: another program is writing to it: wait for it, then run again", path = path.display())]
    Busy {
        /// The file.
        path: PathBuf,
    },
    /// Another build took this layer over.
    #[error("{path}: another build of layer {layer} has begun meanwhile: let that one finish", path = path.display())]
    Superseded {
        /// The store.
        path: PathBuf,
        /// The layer.
        layer: String,
    },
    /// An exported store, which is never written again.
    #[error("{path}: an exported store, sealed by its digest: build into the store it was cut from, and export anew", path = path.display())]
    Sealed {
        /// The store.
        path: PathBuf,
    },
    /// The file is not what it was when it was opened.
    #[error("{path}: was replaced, rewritten or removed since it was opened: open it again (restart the service)", path = path.display())]
    Changed {
        /// The store.
        path: PathBuf,
    },
    /// The file contradicts itself.
    #[error("{path}: damaged: {reason}; restore it from a copy or build it anew", path = path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where and how.
        reason: String,
    },
    /// One tile's bytes are not what they should be.
    #[error("{path}: tile {tile} of layer {layer} is damaged: {reason}; `overfly verify` lists all such tiles, restore the store from a copy", path = path.display())]
    DamagedTile {
        /// The store.
        path: PathBuf,
        /// Which layer.
        layer: String,
        /// Which tile.
        tile: TileId,
        /// How.
        reason: String,
    },
    /// The image encoder refused.
    #[error("tile {tile} cannot be encoded: {reason}")]
    Encode {
        /// Which tile.
        tile: TileId,
        /// What the encoder says.
        reason: String,
    },
    /// What would be replaced is not what is written.
    #[error("{path}: {found} stands there, and is not overwritten: choose another name, or remove it", path = path.display())]
    InTheWay {
        /// The place.
        path: PathBuf,
        /// What.
        found: String,
    },
    /// The result would replace what it is made from.
    #[error("{path}: writing there would replace what the result is made from: choose another place", path = path.display())]
    SameFile {
        /// The place.
        path: PathBuf,
    },
    /// Another run writes to the same place.
    #[error("{path}: another run of overfly is writing this file: wait for it", path = path.display())]
    Occupied {
        /// The place.
        path: PathBuf,
    },
    /// The system failed.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// SQLite failed in a way that has no name here.
    #[error("{path}: {source}", path = path.display())]
    Sqlite {
        /// The file.
        path: PathBuf,
        /// What SQLite says.
        source: rusqlite::Error,
    },
}

impl StoreError {
    /// A stable code word.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Missing { .. } => "store_not_found",
            Self::NotAStore { .. } => "not_a_store",
            Self::Unfinished { .. } => "unfinished_build",
            Self::NoLayers { .. } => "empty_store",
            Self::NewerFormat { .. } => "newer_store",
            Self::OlderFormat { .. } => "older_store",
            Self::OtherContract { .. } => "other_contract",
            Self::SideFile { .. } => "side_file",
            Self::HotJournal { .. } => "unfinished_build",
            Self::NoLayer { .. } => "no_such_layer",
            Self::LayerName { .. } => "layer_name",
            Self::Denied { .. } => "permission_denied",
            Self::NoFolder { .. } => "no_such_folder",
            Self::DiskFull { .. } => "disk_full",
            Self::DiskError { .. } => "disk_error",
            Self::NoJournal { .. } => "no_journal",
            Self::Busy { .. } => "store_busy",
            Self::Superseded { .. } => "superseded",
            Self::Occupied { .. } => "export_under_way",
            Self::InTheWay { .. } => "in_the_way",
            Self::SameFile { .. } => "same_file",
            Self::Sealed { .. } => "sealed_store",
            Self::Changed { .. } => "store_changed",
            Self::Damaged { .. } | Self::DamagedTile { .. } => "damaged_store",
            Self::Encode { .. } => "tile_encoding",
            Self::Io { .. } => "io",
            Self::Sqlite { .. } => "sqlite",
        }
    }

    /// Whether the file that was named is at fault, and not the work on it: exit code 2.
    pub fn is_unusable_input(&self) -> bool {
        match self {
            Self::Changed { .. }
            | Self::DiskFull { .. }
            | Self::DiskError { .. }
            | Self::NoJournal { .. }
            | Self::Busy { .. }
            | Self::Superseded { .. }
            | Self::Occupied { .. }
            | Self::Encode { .. }
            | Self::Io { .. }
            | Self::Sqlite { .. } => false,
            Self::Missing { .. }
            | Self::NotAStore { .. }
            | Self::Unfinished { .. }
            | Self::NoLayers { .. }
            | Self::NewerFormat { .. }
            | Self::OlderFormat { .. }
            | Self::OtherContract { .. }
            | Self::SideFile { .. }
            | Self::HotJournal { .. }
            | Self::NoLayer { .. }
            | Self::LayerName { .. }
            | Self::Denied { .. }
            | Self::NoFolder { .. }
            | Self::InTheWay { .. }
            | Self::SameFile { .. }
            | Self::Sealed { .. }
            | Self::Damaged { .. }
            | Self::DamagedTile { .. } => true,
        }
    }

    /// Names what SQLite reports about the file at `path`.
    pub(crate) fn sqlite(path: &Path, source: rusqlite::Error) -> Self {
        use rusqlite::ErrorCode as Code;
        let path = path.to_path_buf();
        let reason = source.to_string();
        let extended = source.sqlite_error().map_or(0, |e| e.extended_code);
        if extended == rusqlite::ffi::SQLITE_READONLY_ROLLBACK {
            return Self::HotJournal { path };
        }
        match source.sqlite_error_code() {
            Some(Code::NotADatabase) => Self::NotAStore { path, found: "not an SQLite file".into() },
            Some(Code::DatabaseCorrupt) => Self::Damaged { path, reason },
            Some(Code::DiskFull) => Self::DiskFull { path },
            Some(Code::SystemIoFailure) => Self::DiskError { path, reason },
            // The store itself is open by then (else: `unopened`), and a folder that may not be written is `ReadOnly`.
            Some(Code::CannotOpen) => Self::NoJournal { path, reason },
            Some(Code::ReadOnly | Code::PermissionDenied) => Self::Denied { path, reason },
            Some(Code::DatabaseBusy | Code::DatabaseLocked) => Self::Busy { path },
            _ if is_of_the_content(&source) => Self::Damaged { path, reason },
            _ => Self::Sqlite { path, source },
        }
    }

    /// Names what SQLite reports where it opens the file at `path`.
    pub(crate) fn unopened(path: &Path, source: rusqlite::Error) -> Self {
        match source.sqlite_error_code() {
            Some(rusqlite::ErrorCode::CannotOpen) => {
                // SQLite does not say why.
                Self::Denied { path: path.into(), reason: format!("{source}; or the disk fails") }
            }
            _ => Self::sqlite(path, source),
        }
    }

    /// Names what SQLite reports about a file that this run has written itself: there, only the disk can do damage.
    pub(crate) fn of_own_file(path: &Path, source: rusqlite::Error) -> Self {
        match Self::sqlite(path, source) {
            Self::Damaged { path, reason } => Self::DiskError { path, reason },
            Self::NotAStore { path, found } => Self::DiskError { path, reason: found },
            other => other,
        }
    }

    /// Names what the file system reports about `path`.
    /// Names what the system reports about `path`: a missing folder, a full disk.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        use std::io::ErrorKind;
        let path = path.to_path_buf();
        match source.kind() {
            ErrorKind::NotFound => Self::Missing { path },
            ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
                Self::Denied { path, reason: source.to_string() }
            }
            ErrorKind::StorageFull => Self::DiskFull { path },
            ErrorKind::UnexpectedEof => Self::DiskError { path, reason: "it ends where it should not".into() },
            _ if source.raw_os_error() == Some(EIO) => Self::DiskError { path, reason: source.to_string() },
            _ => Self::Io { path, source },
        }
    }
}

/// Whether the file's own content is at fault: a table or column that is not there, a value of the wrong kind.
fn is_of_the_content(error: &rusqlite::Error) -> bool {
    use rusqlite::Error;
    let missing = |message: &str| ["no such table", "no such column"].iter().any(|m| message.starts_with(m));
    match error {
        Error::FromSqlConversionFailure(..) | Error::IntegralValueOutOfRange(..) | Error::InvalidColumnType(..) => true,
        Error::SqliteFailure(_, Some(message)) => missing(message),
        Error::SqlInputError { msg, .. } => missing(msg),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_or_value_that_is_not_as_it_should_be_is_damage() {
        let connection = rusqlite::Connection::open_in_memory().unwrap();
        for sql in ["SELECT count(*) FROM overfly_store", "SELECT -3", "SELECT 'x'"] {
            let failure = connection.query_row(sql, [], |row| row.get::<_, u32>(0)).unwrap_err();
            let error = StoreError::sqlite(Path::new("a.gpkg"), failure);
            assert_eq!(error.code(), "damaged_store", "{sql}: {error}");
            assert!(error.is_unusable_input());
        }
    }
}
