//! Turns failures of SQLite and the system into `StoreError`s.

use super::disk_space::free_bytes;
use super::error::StoreError;
use std::path::{Path, PathBuf};

/// The error number of a failing device on Linux, the BSDs and macOS.
const EIO: i32 = 5;

impl StoreError {
    /// Makes the error for a failure of SQLite with the file at `path`.
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
            Some(Code::DiskFull) => Self::disk_full(path),
            Some(Code::SystemIoFailure) => Self::DiskError { path, reason },
            // The store itself is open by then (otherwise see `unopened`), and a folder without write permission gives `ReadOnly`.
            Some(Code::CannotOpen) => Self::NoJournal { path, reason },
            Some(Code::ReadOnly | Code::PermissionDenied) => Self::Denied { path, reason },
            Some(Code::DatabaseBusy | Code::DatabaseLocked) => Self::Busy { path },
            _ if is_content_error(&source) => Self::Damaged { path, reason },
            _ => Self::Sqlite { path, source },
        }
    }

    fn disk_full(path: PathBuf) -> Self {
        let free = free_bytes(&path);
        Self::DiskFull { path, needed: None, free }
    }

    /// The error with the bytes that the work needed, if the disk was full.
    pub fn needing(self, bytes: u64) -> Self {
        match self {
            Self::DiskFull { path, needed: None, free } => Self::DiskFull { path, needed: Some(bytes), free },
            other => other,
        }
    }

    /// Makes the error for a failure of SQLite to open the file at `path`.
    pub(crate) fn unopened(path: &Path, source: rusqlite::Error) -> Self {
        match source.sqlite_error_code() {
            Some(rusqlite::ErrorCode::CannotOpen) => {
                // SQLite does not tell the reason.
                Self::Denied { path: path.into(), reason: format!("{source}; or the disk fails") }
            }
            _ => Self::sqlite(path, source),
        }
    }

    /// Makes the error for a failure with a file that this run has written itself. Only the disk can have damaged it.
    pub(crate) fn own_file(path: &Path, source: rusqlite::Error) -> Self {
        match Self::sqlite(path, source) {
            Self::Damaged { path, reason } => Self::DiskError { path, reason },
            Self::NotAStore { path, found } => Self::DiskError { path, reason: found },
            other => other,
        }
    }

    /// Makes the error for a failure of the file system with `path`: a missing file, a full disk.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        use std::io::ErrorKind;
        let path = path.to_path_buf();
        match source.kind() {
            ErrorKind::NotFound => Self::Missing { path },
            ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
                Self::Denied { path, reason: source.to_string() }
            }
            ErrorKind::StorageFull => Self::disk_full(path),
            ErrorKind::UnexpectedEof => Self::DiskError { path, reason: "it ends too early".into() },
            _ if source.raw_os_error() == Some(EIO) => Self::DiskError { path, reason: source.to_string() },
            _ => Self::Io { path, source },
        }
    }
}

/// Whether the content of the file is at fault: a missing table or column, or a value of the wrong type.
fn is_content_error(error: &rusqlite::Error) -> bool {
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
    fn a_missing_table_or_a_wrong_value_is_damage() {
        let connection = rusqlite::Connection::open_in_memory().unwrap();
        for sql in ["SELECT count(*) FROM overfly_store", "SELECT -3", "SELECT 'x'"] {
            let failure = connection.query_row(sql, [], |row| row.get::<_, u32>(0)).unwrap_err();
            let error = StoreError::sqlite(Path::new("a.gpkg"), failure);
            assert_eq!(error.code(), "damaged_store", "{sql}: {error}");
            assert!(error.is_unusable_input());
        }
    }
}
