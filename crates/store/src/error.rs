//! `StoreError`: why a store cannot be opened, read or written.

use super::disk_space::space_text;
use super::file_header::part_text;
use super::remedy::StoreRemedy;
use overfly_core::tile::TileId;
use std::path::PathBuf;

/// Why a store cannot be opened, read or written. The text states the fact; [`StoreError::remedy`] says what helps.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file does not exist.
    #[error("{path}: no such file", path = path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// The file is not a store.
    #[error("{path}: not an overfly store: {found}", path = path.display())]
    NotAStore {
        /// The file.
        path: PathBuf,
        /// What the file is instead.
        found: String,
    },
    /// A build was started and not finished.
    #[error("{path}: unfinished build of layer {layer}", path = path.display())]
    Unfinished {
        /// The store.
        path: PathBuf,
        /// The layer, or several separated by commas.
        layer: String,
    },
    /// The store has no layer.
    #[error("{path}: the store has no layer", path = path.display())]
    NoLayers {
        /// The store.
        path: PathBuf,
    },
    /// A newer program wrote the store.
    #[error("{path}: store format {found} is newer than format {known} of this program", path = path.display())]
    NewerFormat {
        /// The store.
        path: PathBuf,
        /// Its format version.
        found: u32,
        /// The newest version that this program knows.
        known: u32,
    },
    /// An older program wrote the store, and it is not migrated.
    #[error("{path}: store format {found} is older than format {known} of this program", path = path.display())]
    OlderFormat {
        /// The store.
        path: PathBuf,
        /// Its format version.
        found: u32,
        /// The version of this program.
        known: u32,
    },
    /// The tiles are described in another way than this program describes frames.
    #[error("{path}: its descriptors follow the contract {found}, this program follows {expected}", path = path.display())]
    OtherContract {
        /// The store.
        path: PathBuf,
        /// The contract of the store.
        found: String,
        /// The contract of this program.
        expected: String,
    },
    /// A store that is opened immutable has a non-empty journal or write-ahead log.
    #[error("{side}: the store has a non-empty journal, so its last change is unfinished", side = side.display())]
    SideFile {
        /// The side file.
        side: PathBuf,
    },
    /// Another program has changed the store and left its last changes in a write-ahead log.
    #[error(
        "{path}: another program changed the store in WAL mode, and its last changes are still in the -wal file beside it",
        path = path.display()
    )]
    LeftInWal {
        /// The store.
        path: PathBuf,
    },
    /// An interrupted write cannot be rolled back here.
    #[error("{path}: an interrupted build left a journal that cannot be rolled back here", path = path.display())]
    HotJournal {
        /// The store.
        path: PathBuf,
    },
    /// The store has no layer of that name.
    #[error("{path}: no layer {name:?}; the layers are {known}", path = path.display())]
    NoLayer {
        /// The store.
        path: PathBuf,
        /// The requested name.
        name: String,
        /// The names of its layers.
        known: String,
    },
    /// A layer of heights, where imagery is needed.
    #[error("{path}: layer {name} holds heights, not imagery", path = path.display())]
    Heights {
        /// The store.
        path: PathBuf,
        /// The layer.
        name: String,
    },
    /// A name that is not allowed for a layer.
    #[error(
        "invalid layer name {name:?}: a name has 1 to 40 of the characters a-z 0-9 _ -, starts with a letter or digit, does not start with overfly_, gpkg_, rtree_ or sqlite_, and is neither footprints nor any, which stands for all layers"
    )]
    LayerName {
        /// The given name.
        name: String,
    },
    /// A layer, or a table of another program, has the new name already.
    #[error("{path}: a layer or table {name:?} exists already", path = path.display())]
    LayerExists {
        /// The store.
        path: PathBuf,
        /// The new name.
        name: String,
    },
    /// The file or its folder cannot be read or written.
    #[error("{path}: no permission ({reason})", path = path.display())]
    Denied {
        /// The file.
        path: PathBuf,
        /// The message of the system.
        reason: String,
    },
    /// The folder of the file does not exist.
    #[error("{path}: its folder does not exist", path = path.display())]
    NoFolder {
        /// The file.
        path: PathBuf,
    },
    /// The disk is full.
    #[error("{path}: the disk is full{space}; the previous content is unchanged", path = path.display(), space = space_text(*needed, *free))]
    DiskFull {
        /// The file.
        path: PathBuf,
        /// Bytes that the work needs, if that is known.
        needed: Option<u64>,
        /// Bytes that are free, if the system says so.
        free: Option<u64>,
    },
    /// The disk cannot be read or written.
    #[error("{path}: the disk fails or is full ({reason}); nothing incomplete is kept", path = path.display())]
    DiskError {
        /// The file.
        path: PathBuf,
        /// The message of the system or SQLite.
        reason: String,
    },
    /// The journal, which a write needs, cannot be created or opened.
    #[error("{path}: its journal cannot be created or opened ({reason}); the store is unchanged", path = path.display())]
    NoJournal {
        /// The store.
        path: PathBuf,
        /// The message of SQLite.
        reason: String,
    },
    /// Another program has locked the file.
    #[error("{path}: another program is writing to it", path = path.display())]
    Busy {
        /// The file.
        path: PathBuf,
    },
    /// Another build took over the layer.
    #[error("{path}: another build of layer {layer} has started in the meantime", path = path.display())]
    Superseded {
        /// The store.
        path: PathBuf,
        /// The layer.
        layer: String,
    },
    /// An exported store is never written again.
    #[error("{path}: an exported store cannot be written: it is sealed by its digest", path = path.display())]
    Sealed {
        /// The store.
        path: PathBuf,
    },
    /// The file has changed since it was opened.
    #[error("{path}: replaced, rewritten or removed since it was opened", path = path.display())]
    Changed {
        /// The store.
        path: PathBuf,
    },
    /// The file is shorter than its header states.
    #[error("{path}: {part}: copying was cut off; copy it again", path = path.display(), part = part_text(*found, *stated))]
    CutOff {
        /// The file.
        path: PathBuf,
        /// Its length, bytes.
        found: u64,
        /// The length that its header states, bytes; `None` where not even the header is there.
        stated: Option<u64>,
    },
    /// The file contradicts itself.
    #[error("{path}: damaged: {reason}", path = path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        reason: String,
    },
    /// The file brings along what no store has, or what a store has with another definition.
    #[error("{path}: {what} is none of a store's: another program put it there", path = path.display())]
    ForeignSchema {
        /// The store.
        path: PathBuf,
        /// Kind and name of the object.
        what: String,
    },
    /// The bytes of a tile are damaged.
    #[error("{path}: tile {tile} of layer {layer} is damaged: {reason}", path = path.display())]
    DamagedTile {
        /// The store.
        path: PathBuf,
        /// The layer.
        layer: String,
        /// The tile.
        tile: TileId,
        /// What is wrong.
        reason: String,
    },
    /// The image encoder failed.
    #[error("tile {tile} cannot be encoded: {reason}")]
    Encode {
        /// The tile.
        tile: TileId,
        /// The message of the encoder.
        reason: String,
    },
    /// The target exists and is something else than what is written.
    #[error("{path}: {found} exists there and is not overwritten", path = path.display())]
    InTheWay {
        /// The target.
        path: PathBuf,
        /// What exists there.
        found: String,
    },
    /// The target is one of the inputs.
    #[error("{path}: the output would replace one of its inputs", path = path.display())]
    SameFile {
        /// The target.
        path: PathBuf,
    },
    /// Another process is writing the same target.
    #[error("{path}: another run of overfly is writing this file", path = path.display())]
    Occupied {
        /// The target.
        path: PathBuf,
    },
    /// The system failed in another way.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The message of the system.
        source: std::io::Error,
    },
    /// SQLite failed in another way.
    #[error("{path}: {source}", path = path.display())]
    Sqlite {
        /// The file.
        path: PathBuf,
        /// The message of SQLite.
        source: rusqlite::Error,
    },
}

impl StoreError {
    /// Returns a stable code word for scripts.
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
            Self::LeftInWal { .. } => "side_file",
            Self::HotJournal { .. } => "unfinished_build",
            Self::NoLayer { .. } | Self::Heights { .. } => "no_such_layer",
            Self::LayerName { .. } => "layer_name",
            Self::LayerExists { .. } => "layer_exists",
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
            Self::CutOff { .. } => "cut_off",
            Self::Damaged { .. } | Self::DamagedTile { .. } => "damaged_store",
            Self::ForeignSchema { .. } => "foreign_schema",
            Self::Encode { .. } => "tile_encoding",
            Self::Io { .. } => "io",
            Self::Sqlite { .. } => "sqlite",
        }
    }

    /// Whether the named file is at fault (exit code 2), and not the work on it.
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
            | Self::LeftInWal { .. }
            | Self::HotJournal { .. }
            | Self::NoLayer { .. }
            | Self::Heights { .. }
            | Self::LayerName { .. }
            | Self::LayerExists { .. }
            | Self::Denied { .. }
            | Self::NoFolder { .. }
            | Self::InTheWay { .. }
            | Self::SameFile { .. }
            | Self::Sealed { .. }
            | Self::CutOff { .. }
            | Self::Damaged { .. }
            | Self::ForeignSchema { .. }
            | Self::DamagedTile { .. } => true,
        }
    }

    /// Returns what helps against this error, if anything is known to.
    pub fn remedy(&self) -> Option<StoreRemedy> {
        Some(match self {
            Self::Missing { .. } | Self::NotAStore { .. } | Self::NoLayers { .. } => StoreRemedy::Build,
            Self::Unfinished { .. } => StoreRemedy::ResumeBuild,
            Self::NewerFormat { .. } => StoreRemedy::UpdateProgram,
            Self::OlderFormat { .. } => StoreRemedy::Migrate,
            Self::OtherContract { .. } => StoreRemedy::Rebuild,
            Self::SideFile { .. } => StoreRemedy::ResumeBuildAndCopy,
            Self::LeftInWal { .. } => StoreRemedy::EndWalMode,
            Self::HotJournal { .. } => StoreRemedy::ResumeBuildOrGrantAccess,
            Self::Denied { .. } => StoreRemedy::GrantAccess,
            Self::NoFolder { .. } => StoreRemedy::CreateFolder,
            Self::DiskFull { .. } => StoreRemedy::FreeSpace,
            Self::DiskError { .. } => StoreRemedy::CheckDisk,
            Self::NoJournal { .. } => StoreRemedy::CheckDiskAndOpenFiles,
            Self::Busy { .. } | Self::Superseded { .. } | Self::Occupied { .. } => StoreRemedy::Wait,
            Self::Sealed { .. } => StoreRemedy::BuildOriginalAndExport,
            Self::Changed { .. } => StoreRemedy::Reopen,
            Self::Damaged { .. } | Self::ForeignSchema { .. } => StoreRemedy::RestoreOrRebuild,
            Self::DamagedTile { .. } => StoreRemedy::VerifyAndRestore,
            Self::LayerExists { .. } => StoreRemedy::ChooseOtherName,
            Self::InTheWay { .. } => StoreRemedy::RenameOrRemove,
            Self::SameFile { .. } => StoreRemedy::ChooseOtherPath,
            Self::NoLayer { .. }
            | Self::Heights { .. }
            | Self::LayerName { .. }
            | Self::CutOff { .. }
            | Self::Encode { .. }
            | Self::Io { .. }
            | Self::Sqlite { .. } => return None,
        })
    }
}
