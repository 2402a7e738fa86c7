//! Opens the SQLite file: for reading, for immutable reading, for writing.

use super::busy::wait;
use super::error::StoreError;
use super::geometry::register_functions;
use super::side_files::{refuse_side_files, side_files};
use super::whole_file::require_whole;
use super::{manifest, migration, schema};
use rusqlite::{Connection, ErrorCode, OpenFlags};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// `GPKG` in the header (OGC 12-128r18, requirement 2).
pub const APPLICATION_ID: i32 = 0x4750_4B47;
/// GeoPackage 1.3.
pub const USER_VERSION: i32 = 10300;
/// Large pages keep the overflow chains short: a tile has tens of kilobytes.
const PAGE_SIZE: u32 = 16384;
/// How long a reader waits for a transaction of another program; see [`wait`] for writers.
const BUSY_TIMEOUT: Duration = Duration::from_secs(20);

/// How a store is opened for reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// With locks: another program may write to the file.
    Shared,
    /// Without locks or side files: no program writes to the file.
    Immutable,
}

/// A store that is open for reading.
pub struct OpenedStore {
    /// A connection that cannot write.
    pub connection: Connection,
    /// The format version of the store.
    pub version: u32,
    /// How it was opened, and how to open further connections.
    pub access: Access,
}

/// Opens a connection that cannot write. A store that another program left in WAL mode is opened immutable: SQLite would create
/// `-wal` and `-shm` files beside it, and leave them there.
///
/// # Errors
/// Where the file does not exist, is not a store, has a format that this program cannot read, or (immutable) has a non-empty side
/// file; [`StoreError::CutOff`] for half a copy; [`StoreError::LeftInWal`] where the last changes of another program are still in a `-wal`
/// file.
pub fn open_read(path: &Path, access: Access) -> Result<OpenedStore, StoreError> {
    open_readable(path, access).map_err(|error| cut_off_or(path, error))
}

/// The error that a file is half a copy, if that explains the error. Only a file that is no use anyway is looked at: closing it drops the
/// locks of other connections.
fn cut_off_or(path: &Path, error: StoreError) -> StoreError {
    match error {
        StoreError::NotAStore { .. } | StoreError::Damaged { .. } | StoreError::DiskError { .. } => {
            require_whole(path).err().unwrap_or(error)
        }
        other => other,
    }
}

fn open_readable(path: &Path, access: Access) -> Result<OpenedStore, StoreError> {
    check_file(path)?;
    let access = match access {
        Access::Shared if is_in_wal_mode(path)? => {
            refuse_side_files(path).map_err(|_| StoreError::LeftInWal { path: path.into() })?;
            Access::Immutable
        }
        other => other,
    };
    let connection = match access {
        Access::Shared => open_shared(path)?,
        Access::Immutable => {
            refuse_side_files(path)?;
            let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_NO_MUTEX;
            Connection::open_with_flags(immutable_uri(path), flags).map_err(|e| StoreError::unopened(path, e))?
        }
    };
    prepare_read(&connection).map_err(|e| StoreError::sqlite(path, e))?;
    let version = store_version(&connection, path)?;
    migration::require_readable(version, path)?;
    schema::require_own(&connection, version, path)?;
    Ok(OpenedStore { connection, version, access })
}

/// Whether a file is in WAL mode, or has a non-empty `-wal` file: SQLite reads neither without locks. This probe takes no lock and
/// creates no file. It is a connection of SQLite's, since closing a file of our own would drop the locks that other connections of
/// this process hold on it. What else is wrong with the file is found when it is opened.
///
/// # Errors
/// Where the disk fails.
pub(super) fn is_in_wal_mode(path: &Path) -> Result<bool, StoreError> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let Ok(connection) = Connection::open_with_flags(file_uri(path) + "?nolock=1", flags) else { return Ok(false) };
    match connection.query_row("SELECT count(*) FROM sqlite_schema", [], |_| Ok(())) {
        Err(error) if error.sqlite_error_code() == Some(ErrorCode::CannotOpen) => Ok(true),
        Err(error) if error.sqlite_error_code() == Some(ErrorCode::SystemIoFailure) => {
            Err(StoreError::sqlite(path, error))
        }
        _ => Ok(false),
    }
}

/// Opens one more connection to a file that is known to be a store. Its page cache holds `pages_bytes`.
///
/// # Errors
/// Where SQLite cannot open it.
pub fn reopen_read(path: &Path, access: Access, pages_bytes: u64) -> Result<Connection, StoreError> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let opened = match access {
        Access::Shared => Connection::open_with_flags(path, flags),
        Access::Immutable => Connection::open_with_flags(immutable_uri(path), flags | OpenFlags::SQLITE_OPEN_URI),
    };
    let connection = opened.map_err(|e| StoreError::unopened(path, e))?;
    let fail = |e| StoreError::sqlite(path, e);
    prepare_read(&connection).map_err(fail)?;
    limit_pages(&connection, pages_bytes).map_err(fail)?;
    Ok(connection)
}

/// Limits the page cache of a connection.
pub fn limit_pages(connection: &Connection, bytes: u64) -> rusqlite::Result<()> {
    // A negative value is in KiB, whatever the page size.
    connection.pragma_update(None, "cache_size", -i64::try_from(bytes / 1024).unwrap_or(i64::MAX))
}

fn prepare_read(connection: &Connection) -> rusqlite::Result<()> {
    connection.busy_timeout(BUSY_TIMEOUT)?;
    connection.set_prepared_statement_cache_capacity(64);
    connection.execute_batch("PRAGMA query_only = 1; PRAGMA trusted_schema = 0; PRAGMA cell_size_check = 1")
}

/// Opens read-only. If a killed build left a hot journal, lets SQLite roll it back first.
fn open_shared(path: &Path) -> Result<Connection, StoreError> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    match open_and_probe(path, flags) {
        Err(StoreError::HotJournal { .. }) => {
            open_and_probe(path, OpenFlags::SQLITE_OPEN_READ_WRITE).map_err(|error| match error {
                StoreError::DiskFull { .. } | StoreError::DiskError { .. } => error,
                _ => StoreError::HotJournal { path: path.into() },
            })?;
            open_and_probe(path, flags)
        }
        other => other,
    }
}

/// Opens the file and reads its schema. SQLite rolls back a hot journal now, if it may write.
fn open_and_probe(path: &Path, flags: OpenFlags) -> Result<Connection, StoreError> {
    let connection = Connection::open_with_flags(path, flags).map_err(|e| StoreError::unopened(path, e))?;
    let probe = || {
        connection.busy_timeout(BUSY_TIMEOUT)?;
        connection.query_row("SELECT count(*) FROM sqlite_schema", [], |_| Ok(()))
    };
    probe().map_err(|e| StoreError::sqlite(path, e))?;
    Ok(connection)
}

/// Opens a connection that writes to an existing store. Migrates an older store to this program's format.
///
/// # Errors
/// As [`open_read`], where the file cannot be written, and [`StoreError::Sealed`] for an exported store.
pub fn open_write(path: &Path) -> Result<Connection, StoreError> {
    open_writable(path).map_err(|error| cut_off_or(path, error))
}

fn open_writable(path: &Path) -> Result<Connection, StoreError> {
    check_file(path)?;
    let fail = |e| StoreError::sqlite(path, e);
    let opened = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_WRITE);
    let connection = opened.map_err(|e| StoreError::unopened(path, e))?;
    prepare_write(&connection).map_err(fail)?;
    let version = store_version(&connection, path)?;
    if version >= manifest::SINCE && manifest::read(&connection).map_err(fail)?.is_some() {
        return Err(StoreError::Sealed { path: path.into() });
    }
    if version <= migration::FORMAT_VERSION {
        schema::require_own(&connection, version, path)?;
    }
    if version < migration::FORMAT_VERSION {
        // A migration rewrites every footprint: the pages of a large store must not all wait in memory.
        connection.pragma_update(None, "cache_spill", 1).map_err(fail)?;
        let transaction = connection.unchecked_transaction().map_err(fail)?;
        migration::migrate(&transaction, version, migration::FORMAT_VERSION).map_err(fail)?;
        transaction.commit().map_err(fail)?;
        connection.pragma_update(None, "cache_spill", 0).map_err(fail)?;
    } else {
        migration::require_readable(version, path)?;
    }
    Ok(connection)
}

/// Migrates a built store of an older format to this program's. Does nothing where there is no store, or it has this format.
///
/// # Errors
/// Where the file is not a store or cannot be written.
pub fn migrate(path: &Path) -> Result<(), StoreError> {
    match open_read(path, Access::Shared) {
        Ok(OpenedStore { version: migration::FORMAT_VERSION, .. }) | Err(StoreError::Missing { .. }) => Ok(()),
        Ok(_) | Err(StoreError::OlderFormat { .. }) => open_write(path).map(|_| ()),
        Err(other) => Err(other),
    }
}

/// Removes a journal that a killed build left beside an intact store. SQLite ignores a journal with nothing to roll back, and so
/// would leave it there.
///
/// # Errors
/// Where the file cannot be written.
pub fn clear_journal(path: &Path) -> Result<(), StoreError> {
    if side_files(path).iter().all(|side| !side.exists()) {
        return Ok(());
    }
    // Any transaction that writes takes over the journal and removes it.
    open_write(path)?.pragma_update(None, "user_version", USER_VERSION).map_err(|e| StoreError::sqlite(path, e))
}

/// Creates an empty store at `path` with an atomic rename, and opens it for writing.
///
/// # Errors
/// Where the folder does not exist or cannot be written, or the disk is full.
pub fn create(path: &Path, contract: &str) -> Result<Connection, StoreError> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
    if folder.is_some_and(|f| !f.is_dir()) {
        return Err(StoreError::NoFolder { path: path.into() });
    }
    let mut name = path.as_os_str().to_os_string();
    name.push(".overfly-build");
    let draft = PathBuf::from(name);
    // SQLite does not tell why it cannot create a file.
    std::fs::File::create(&draft).map_err(|e| StoreError::io(path, e))?;
    let outcome = create_draft(&draft, contract, migration::FORMAT_VERSION)
        .map_err(|e| StoreError::own_file(path, e))
        .and_then(|()| std::fs::rename(&draft, path).map_err(|e| StoreError::io(path, e)));
    if outcome.is_err() {
        // The draft is of no use; the first failure is the one to report.
        let _ = std::fs::remove_file(&draft);
    }
    outcome?;
    open_write(path)
}

/// Creates an empty store of a format version at `draft`, which it replaces.
pub(super) fn create_draft(draft: &Path, contract: &str, version: u32) -> rusqlite::Result<()> {
    // A killed build may have left a draft. Its absence is no failure.
    let _ = std::fs::remove_file(draft);
    let connection = Connection::open(draft)?;
    connection.pragma_update(None, "page_size", PAGE_SIZE)?;
    prepare_write(&connection)?;
    // Without a journal file, which a kill could leave behind.
    connection.query_row("PRAGMA journal_mode = MEMORY", [], |_| Ok(()))?;
    connection.pragma_update(None, "application_id", APPLICATION_ID)?;
    connection.pragma_update(None, "user_version", USER_VERSION)?;
    let transaction = connection.unchecked_transaction()?;
    migration::migrate(&transaction, 0, version)?;
    transaction.execute("INSERT INTO overfly_store (id, descriptor_contract) VALUES (1, ?1)", [contract])?;
    transaction.commit()?;
    connection.close().map_err(|(_, error)| error)
}

fn prepare_write(connection: &Connection) -> rusqlite::Result<()> {
    connection.busy_handler(Some(wait))?;
    connection.set_prepared_statement_cache_capacity(64);
    register_functions(connection)?;
    // Without cache spill the file is locked only while a transaction commits.
    connection.execute_batch(
        "PRAGMA journal_mode = DELETE; PRAGMA synchronous = NORMAL; PRAGMA cache_spill = 0; PRAGMA trusted_schema = 0;
         PRAGMA foreign_keys = 0; PRAGMA temp_store = MEMORY",
    )
}

/// Rejects what is plainly not a store. Opens no file: closing one would drop the locks that other SQLite connections of this
/// process hold on it.
fn check_file(path: &Path) -> Result<(), StoreError> {
    let not = |found: &str| StoreError::NotAStore { path: path.into(), found: found.into() };
    let metadata = std::fs::metadata(path).map_err(|e| StoreError::io(path, e))?;
    if metadata.is_dir() {
        return Err(not("a folder"));
    }
    if !metadata.is_file() {
        return Err(not("not a regular file"));
    }
    if metadata.len() == 0 {
        return Err(not("an empty file"));
    }
    Ok(())
}

/// Returns the format version of an opened file.
///
/// # Errors
/// [`StoreError::NotAStore`].
fn store_version(connection: &Connection, path: &Path) -> Result<u32, StoreError> {
    let not = |found: &str| StoreError::NotAStore { path: path.into(), found: found.into() };
    let application: i32 =
        connection.query_row("PRAGMA application_id", [], |row| row.get(0)).map_err(|e| StoreError::sqlite(path, e))?;
    match migration::version_of(connection, path)? {
        Some(0) => Err(not("an empty database")),
        Some(version) if application == APPLICATION_ID => Ok(version),
        _ if application == APPLICATION_ID => Err(not("a GeoPackage of another program")),
        _ => Err(not("an SQLite file, but not a GeoPackage")),
    }
}

fn immutable_uri(path: &Path) -> String {
    file_uri(path) + "?immutable=1"
}

/// Formats a path as an SQLite URI, to which parameters can be appended.
pub(super) fn file_uri(path: &Path) -> String {
    let mut uri = String::from(if path.is_absolute() { "file://" } else { "file:" });
    for &byte in path.as_os_str().as_bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'_' | b'-' => uri.push(char::from(byte)),
            _ => uri.push_str(&format!("%{byte:02X}")),
        }
    }
    uri
}
