//! The free space of a disk, and how an error states it.

use std::path::Path;

/// Returns the bytes that this user may still write beside `path`: `None` if the system does not say.
pub fn free_bytes(path: &Path) -> Option<u64> {
    let folder = path.ancestors().skip(1).find(|folder| folder.is_dir()).unwrap_or(Path::new("."));
    let disk = rustix::fs::statvfs(folder).ok()?;
    Some(disk.f_bavail.saturating_mul(disk.f_frsize))
}

/// States what is needed and what is free, as far as that is known.
pub(super) fn space_text(needed: Option<u64>, free: Option<u64>) -> String {
    let megabytes = |bytes: u64| match bytes {
        1..50_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        _ => format!("{:.1} MB", bytes as f64 / 1e6),
    };
    match (needed, free) {
        (Some(needed), Some(free)) => format!(": {} are needed, {} are free", megabytes(needed), megabytes(free)),
        (Some(needed), None) => format!(": {} are needed", megabytes(needed)),
        (None, Some(free)) => format!(": {} are free", megabytes(free)),
        (None, None) => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_what_is_known() {
        assert_eq!(space_text(Some(19_400_000), Some(3_200_000)), ": 19.4 MB are needed, 3.2 MB are free");
        assert_eq!(space_text(None, Some(0)), ": 0.0 MB are free");
        assert_eq!(space_text(Some(4096), Some(900)), ": 4.1 kB are needed, 0.9 kB are free");
        let folder = tempfile::tempdir().unwrap();
        assert!(free_bytes(&folder.path().join("no/such/file")).is_some());
        assert!(free_bytes(Path::new("file")).is_some());
    }
}
