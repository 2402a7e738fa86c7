//! What to say where an export takes the place of a newer one.

use std::path::Path;

/// The note that the file at `out` is, or was, an export of the serial `before`, and that the one that replaces it has a lower one.
pub fn newer_note(out: &Path, before: Option<u64>, serial: Option<u64>) -> Option<String> {
    let before = before.filter(|before| serial.is_none_or(|serial| serial < *before))?;
    let now = serial.map_or("has no serial".into(), |serial| format!("has serial {serial}"));
    Some(format!(
        "{} is replaced, an export of serial {before}; the new one {now}, and no aircraft takes it after {before}",
        out.display()
    ))
}
