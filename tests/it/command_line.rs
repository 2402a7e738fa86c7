//! What the command line says to what it cannot do: a code word, the file, the exit code.

use std::path::Path;
use std::process::Command;

/// Exit code and standard error.
fn run(folder: &Path, words: &[&str]) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_overfly")).current_dir(folder).args(words).output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn every_refusal_has_its_code_word() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("text.gpkg"), "no store").unwrap();
    let cases: [(&[&str], &str, &str); 6] = [
        (&["build", "--db", "s.gpkg", "--threads", "0"], "usage", "--threads"),
        (&["no-such-command"], "usage", "no-such-command"),
        (&["info", "none.gpkg"], "store_not_found", "none.gpkg"),
        (&["info", "text.gpkg"], "not_a_store", "text.gpkg"),
        (&["build", "--db", "none.gpkg", "--remove-layer"], "store_not_found", "none.gpkg"),
        (&["build", "--db", "s.gpkg", "none.tif"], "nothing_usable", "none.tif"),
    ];
    for (words, code, named) in cases {
        let (exit, said) = run(folder.path(), words);
        assert_eq!(exit, Some(2), "{words:?}: {said}");
        assert!(said.starts_with(&format!("error[{code}]: ")) && said.contains(named), "{words:?}: {said}");
    }
    assert_eq!(run(folder.path(), &["--help"]).0, Some(0));
    assert!(!run(folder.path(), &[]).1.contains("error["));
}

#[cfg(unix)]
#[test]
fn a_link_to_nowhere_among_the_sources_does_not_stop_the_rest() {
    let folder = tempfile::tempdir().unwrap();
    let sources = folder.path().join("sources");
    std::fs::create_dir(&sources).unwrap();
    std::os::unix::fs::symlink("self.tif", sources.join("self.tif")).unwrap();
    let image = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/degrees.tif");
    std::fs::copy(image, sources.join("degrees.tif")).unwrap();
    let (exit, said) = run(folder.path(), &["build", "--db", "s.gpkg", "sources"]);
    assert_eq!(exit, Some(1), "{said}");
    assert!(said.contains("left out [source_io]") && said.contains("self.tif"), "{said}");
    assert_eq!(run(folder.path(), &["verify", "s.gpkg"]).0, Some(0));
}
