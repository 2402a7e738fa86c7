//! What some tests need that a clean machine may not have: real imagery and other people's tools. Such a test is
//! `#[ignore = "needs THING"]` and named `needs_THING_...`; `.ci/run` runs those whose things are present and lists the others.

use super::sources::{root, rust_files};
use std::path::PathBuf;

/// Things that tests may need, as `.ci/run` knows them.
const THINGS: &[&str] = &[
    "brighton",
    "chia",
    "curl",
    "gdal",
    "naip",
    "namespaces",
    "openapi_generator",
    "openapi_python_client",
    "openssl",
    "schemathesis",
    "strace",
];

/// A file or folder of the real imagery, which lies beside the repository.
pub fn real_data(path: &str) -> PathBuf {
    let path = root().join("../shared/data").join(path);
    assert!(path.exists(), "{} is absent", path.display());
    path
}

#[test]
fn every_ignored_test_names_what_it_needs_and_ci_knows_it() {
    let ci = std::fs::read_to_string(root().join(".ci/run")).unwrap();
    // Put together, so that this line is not taken for an attribute.
    let attribute = ["#[", "ignore"].concat();
    let mut found = 0;
    for file in ["tests", "crates", "src"].iter().flat_map(|f| rust_files(&root().join(f))) {
        let text = std::fs::read_to_string(&file).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        for (at, line) in lines.iter().enumerate().filter(|(_, l)| l.trim_start().starts_with(&attribute)) {
            let place = format!("{}:{}", file.display(), at + 1);
            let reason =
                line.trim().strip_prefix(&format!("{attribute} = \"needs ")).and_then(|r| r.strip_suffix("\"]"));
            let reason = reason.unwrap_or_else(|| panic!("{place}: write {attribute} = \"needs THING\"]"));
            assert!(reason.split(" and ").all(|thing| THINGS.contains(&thing)), "{place}: {reason} is not in THINGS");
            let name = format!("fn needs_{}_", reason.replace(' ', "_"));
            let function = lines[at + 1..].iter().find(|l| l.contains("fn "));
            assert!(function.is_some_and(|f| f.contains(&name)), "{place}: the test is not called {name}...");
            let thing = reason.replace(' ', "_");
            assert!(ci.split_whitespace().any(|word| word == thing), ".ci/run does not know {thing}");
            found += 1;
        }
        for (at, line) in lines.iter().enumerate() {
            let is_silent = line.to_lowercase().contains(concat!("skip", "ped")) && line.contains("eprintln!");
            assert!(!is_silent, "{}:{}: a test must not leave silently", file.display(), at + 1);
        }
    }
    assert!(found > 10, "{found} ignored tests");
}
