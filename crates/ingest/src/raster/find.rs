//! Finding orthophotos among files and folders, and hashing a source's content.

use super::error::RasterError;
use super::side_files::side_files;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Extensions of the files that a folder is searched for.
const EXTENSIONS: &[&str] = &["tif", "tiff", "gtiff", "png", "jpg", "jpeg"];
/// Extensions that the feature `gdal` adds.
const GDAL_EXTENSIONS: &[&str] = &["jp2", "j2k", "vrt", "ecw", "img", "sid", "nitf", "ntf"];

/// Orthophotos found among files and folders.
#[derive(Debug, Default)]
pub struct FoundSources {
    /// Orthophotos, each once, sorted by path.
    pub files: Vec<PathBuf>,
    /// Entries below a folder that cannot be read: closed folders, and dangling links named like orthophotos.
    pub unreadable: Vec<(PathBuf, RasterError)>,
}

/// Returns the orthophotos among files and folders. A file is taken whatever its name; a folder is searched recursively by
/// extension, without hidden files.
///
/// # Errors
/// [`RasterError::Io`] for a path that cannot be read, [`RasterError::NoRegularFile`] for pipes and devices (reading
/// one may never end), [`RasterError::NothingFound`] for a folder without an orthophoto.
pub fn find_sources(paths: &[PathBuf]) -> Result<FoundSources, RasterError> {
    let mut found = FoundSources::default();
    for path in paths {
        let kind = std::fs::metadata(path).map_err(|e| RasterError::io(path, e))?;
        if kind.is_file() {
            found.files.push(path.clone());
            continue;
        }
        if !kind.is_dir() {
            return Err(RasterError::NoRegularFile { path: path.clone() });
        }
        let before = found.files.len() + found.unreadable.len();
        // A link to a parent folder ends the walk there: it holds nothing new.
        let visible = |e: &walkdir::DirEntry| e.depth() == 0 || !e.file_name().as_encoded_bytes().starts_with(b".");
        for entry in walkdir::WalkDir::new(path).follow_links(true).into_iter().filter_entry(visible) {
            match entry {
                Ok(entry) if entry.file_type().is_file() && is_candidate(entry.path()) => {
                    found.files.push(entry.into_path());
                }
                Ok(_) => {}
                Err(e) if e.loop_ancestor().is_some() => {}
                Err(e) => found.unreadable.extend(unreadable_entry(path, e)),
            }
        }
        if found.files.len() + found.unreadable.len() == before {
            return Err(RasterError::NothingFound { path: path.clone(), looked_for: searched_extensions().join(", ") });
        }
    }
    found.files.sort();
    found.files.dedup();
    Ok(found)
}

/// Returns an entry that cannot be read with its error, unless it is a dangling link that is not named like an orthophoto.
fn unreadable_entry(folder: &Path, error: walkdir::Error) -> Option<(PathBuf, RasterError)> {
    let at = error.path().unwrap_or(folder).to_path_buf();
    let is_link = std::fs::symlink_metadata(&at).is_ok_and(|kind| kind.is_symlink());
    let source = error.into_io_error().unwrap_or_else(|| std::io::Error::other("the entry cannot be read"));
    (!is_link || is_candidate(&at)).then(|| (at.clone(), RasterError::io(&at, source)))
}

fn searched_extensions() -> Vec<&'static str> {
    let more = if cfg!(feature = "gdal") { GDAL_EXTENSIONS } else { &[] };
    EXTENSIONS.iter().chain(more).copied().collect()
}

fn is_candidate(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    extension.is_some_and(|e| searched_extensions().contains(&e.as_str()))
}

/// Returns the BLAKE3 hash of a source's file and of the files beside it that place or mask it. The names of the files do
/// not count.
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
    let file = File::open(path).map_err(io)?;
    let len = file.metadata().map_err(io)?.len();
    hasher.update_reader(file).map_err(io)?;
    if hasher.count() < len {
        // The read ended too early. A hash of fewer bytes would be that of another source.
        return Err(io(std::io::ErrorKind::UnexpectedEof.into()));
    }
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
        assert_eq!(found.files, [root.join("a.jpg"), root.join("b/a.png"), root.join("z.TIF")]);
        assert_eq!(find_sources(&[root.join("none.tif")]).unwrap_err().code(), "source_io");
        std::fs::create_dir(root.join("empty")).unwrap();
        assert_eq!(find_sources(&[root.join("empty")]).unwrap_err().code(), "source_nothing_found");
    }

    #[cfg(unix)]
    #[test]
    fn a_dangling_link_is_reported_and_the_rest_is_found() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        std::fs::write(root.join("a.tif"), b"x").unwrap();
        symlink("self.tif", root.join("self.tif")).unwrap();
        symlink("nowhere.tif", root.join("dangling.tif")).unwrap();
        symlink("nowhere", root.join("latest")).unwrap();
        symlink(".", root.join("up")).unwrap();
        let found = find_sources(&[root.to_path_buf()]).unwrap();
        assert_eq!(found.files, [root.join("a.tif")]);
        let mut named: Vec<_> = found.unreadable.iter().map(|(path, _)| path.clone()).collect();
        named.sort();
        assert_eq!(named, [root.join("dangling.tif"), root.join("self.tif")]);
    }

    #[cfg(unix)]
    #[test]
    fn refuses_a_device() {
        let error = find_sources(&["/dev/zero".into()]).unwrap_err();
        assert_eq!(error.code(), "source_no_regular_file");
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
