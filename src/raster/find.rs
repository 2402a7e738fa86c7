//! Which files of a list of files and folders are orthophotos, and what a source's content hashes to.

use super::RasterError;
use super::side_files::side_files;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Extensions that a folder is searched for.
const EXTENSIONS: &[&str] = &["tif", "tiff", "gtiff", "png", "jpg", "jpeg"];
/// And those that GDAL adds.
const GDAL_EXTENSIONS: &[&str] = &["jp2", "j2k", "vrt", "ecw", "img", "sid", "nitf", "ntf"];

/// The orthophotos among files and folders: files as they are named, folders with everything below them by extension
/// (hidden files left out), each once, sorted by path.
///
/// # Errors
/// [`RasterError::Io`] for what cannot be read, [`RasterError::NothingFound`] for a folder without any.
pub fn find_sources(paths: &[PathBuf]) -> Result<Vec<PathBuf>, RasterError> {
    let mut found = Vec::new();
    for path in paths {
        let kind = std::fs::metadata(path).map_err(|e| RasterError::io(path, e))?;
        if !kind.is_dir() {
            found.push(path.clone());
            continue;
        }
        let before = found.len();
        // A link that leads back up ends the walk there; it holds nothing new.
        let visible = |e: &walkdir::DirEntry| e.depth() == 0 || !e.file_name().as_encoded_bytes().starts_with(b".");
        for entry in walkdir::WalkDir::new(path).follow_links(true).into_iter().filter_entry(visible) {
            match entry {
                Ok(entry) if entry.file_type().is_file() && is_candidate(entry.path()) => found.push(entry.into_path()),
                Ok(_) => {}
                Err(e) if e.loop_ancestor().is_some() => {}
                Err(e) => {
                    let at = e.path().unwrap_or(path).to_path_buf();
                    return Err(RasterError::Io { path: at, source: e.into() });
                }
            }
        }
        if found.len() == before {
            return Err(RasterError::NothingFound { path: path.clone(), looked_for: searched().join(", ") });
        }
    }
    found.sort();
    found.dedup();
    Ok(found)
}

fn searched() -> Vec<&'static str> {
    let more = if cfg!(feature = "gdal") { GDAL_EXTENSIONS } else { &[] };
    EXTENSIONS.iter().chain(more).copied().collect()
}

fn is_candidate(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    extension.is_some_and(|e| searched().contains(&e.as_str()))
}

/// BLAKE3 of a source's file and of the files beside it that place or mask it. The file's name does not enter.
///
/// # Errors
/// [`RasterError::Io`].
pub fn content_hash(path: &Path) -> Result<[u8; 32], RasterError> {
    let mut whole = blake3::Hasher::new();
    whole.update(&file_hash(path)?);
    for beside in side_files(path) {
        whole.update(&file_hash(&beside)?);
    }
    Ok(*whole.finalize().as_bytes())
}

fn file_hash(path: &Path) -> Result<[u8; 32], RasterError> {
    let io = |e| RasterError::io(path, e);
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(File::open(path).map_err(io)?).map_err(io)?;
    Ok(*hasher.finalize().as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walks_folders_in_order_and_leaves_side_files_out() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        std::fs::create_dir_all(root.join("b/.cache")).unwrap();
        for name in [
            "z.TIF",
            "b/a.png",
            "b/a.pgw",
            "b/a.prj",
            "b/.cache/x.tif",
            "a.jpg",
            "readme.txt",
            "a.tif.ovr",
            "a.tif.msk",
        ] {
            std::fs::write(root.join(name), b"x").unwrap();
        }
        let found = find_sources(&[root.to_path_buf(), root.join("a.jpg")]).unwrap();
        assert_eq!(found, [root.join("a.jpg"), root.join("b/a.png"), root.join("z.TIF")]);
        assert_eq!(find_sources(&[root.join("none.tif")]).unwrap_err().code(), "source_io");
        std::fs::create_dir(root.join("empty")).unwrap();
        assert_eq!(find_sources(&[root.join("empty")]).unwrap_err().code(), "source_nothing_found");
    }

    #[test]
    fn the_hash_follows_content_and_side_files_but_not_the_name() {
        let folder = tempfile::tempdir().unwrap();
        let (a, b) = (folder.path().join("a.png"), folder.path().join("b.png"));
        std::fs::write(&a, b"pixels").unwrap();
        std::fs::write(&b, b"pixels").unwrap();
        let plain = content_hash(&a).unwrap();
        assert_eq!(plain, content_hash(&b).unwrap());
        std::fs::write(folder.path().join("a.pgw"), b"1 0 0 -1 0 0").unwrap();
        assert_ne!(plain, content_hash(&a).unwrap());
    }
}
