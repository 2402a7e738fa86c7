//! The house's rules, kept by reading its own sources: which module may use which, what the pure ones must not touch,
//! where SQL stands, and what onboard cannot reach.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Each module and what it may use of its neighbours, bottom first. `server` and the binary's `cli` are on top.
const MAY_USE: &[(&str, &[&str])] = &[
    ("simd", &[]),
    ("geodesy", &[]),
    ("pixels", &["simd"]),
    ("tile", &["geodesy"]),
    ("raster", &["geodesy", "tile", "pixels"]),
    ("camera", &["geodesy", "pixels"]),
    ("feature", &["simd", "pixels"]),
    ("registration", &["simd", "geodesy", "pixels", "feature"]),
    ("coupling", &["geodesy"]),
    ("region", &["geodesy", "tile", "coupling"]),
    ("store", &["geodesy", "pixels", "tile", "feature"]),
    ("build", &["geodesy", "pixels", "tile", "raster", "feature", "store"]),
    ("locate", &["geodesy", "pixels", "tile", "camera", "feature", "registration", "coupling", "region", "store"]),
    ("explain", &["geodesy", "pixels", "tile", "camera", "feature", "registration", "store", "locate"]),
    ("navigate", &["geodesy", "pixels", "camera", "registration", "coupling", "store", "locate"]),
    ("plan", &["geodesy", "tile", "camera", "coupling", "region", "store"]),
    ("package", &["geodesy", "tile", "coupling", "region", "store", "plan"]),
    (
        "trial",
        &[
            "geodesy",
            "pixels",
            "tile",
            "raster",
            "camera",
            "feature",
            "registration",
            "coupling",
            "region",
            "store",
            "locate",
            "navigate",
        ],
    ),
    ("report", &["geodesy", "pixels", "tile", "camera", "coupling", "locate", "navigate", "plan", "trial"]),
    (
        "server",
        &[
            "geodesy",
            "pixels",
            "tile",
            "raster",
            "camera",
            "feature",
            "registration",
            "coupling",
            "region",
            "store",
            "build",
            "locate",
            "plan",
            "package",
        ],
    ),
];

/// Numbers and plain structs in, numbers and plain structs out.
const PURE: &[&str] = &["geodesy", "pixels", "tile", "camera", "feature", "registration", "coupling", "region"];

/// What a pure module must not name: files, clocks, environment, printing, globals, unseeded randomness.
const IMPURE: &[&str] = &[
    "std::fs",
    "std::net",
    "std::env",
    "std::process",
    "std::io::stdout",
    "std::io::stderr",
    "std::io::stdin",
    "Instant",
    "SystemTime",
    "println!",
    "eprintln!",
    "print!(",
    "dbg!",
    "tracing::",
    "static mut",
    "LazyLock",
    "OnceLock",
    "OnceCell",
    "thread_local!",
    "thread_rng",
    "rand::rng()",
    "from_os_rng",
    "from_entropy",
    "rusqlite",
];

/// One source file: its path under `src/`, and its code without comments, strings and unit tests.
struct Source {
    path: PathBuf,
    code: String,
    /// As `code`, with its strings.
    text: String,
}

impl Source {
    /// The module it belongs to: the first part of its path.
    fn module(&self) -> &str {
        self.path.iter().next().and_then(|p| p.to_str()).unwrap_or("").trim_end_matches(".rs")
    }
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// Every file under `src/` that is not a unit test.
fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    rust_files(&root, &mut files);
    files.sort();
    let mut sources = Vec::new();
    for file in files.into_iter().filter(|f| !f.ends_with("tests.rs")) {
        let whole = std::fs::read_to_string(&file).unwrap();
        let text = without_comments(whole.split("#[cfg(test)]").next().unwrap_or(""));
        let path = file.strip_prefix(&root).unwrap().to_path_buf();
        sources.push(Source { path, code: without_strings(&text), text });
    }
    assert!(sources.len() > 50, "found only {} sources", sources.len());
    sources
}

fn without_comments(text: &str) -> String {
    text.lines().map(|line| line.split_once("//").map_or(line, |(code, _)| code)).collect::<Vec<_>>().join("\n")
}

/// Drops what stands between quotes; a file's odd quote (a char literal) only hides the rest of its line.
fn without_strings(text: &str) -> String {
    text.lines().map(|line| line.split('"').step_by(2).collect::<Vec<_>>().join("\"\"")).collect::<Vec<_>>().join("\n")
}

/// The neighbours that a file names by `crate::`, in paths and in grouped imports.
fn neighbours(code: &str) -> Vec<String> {
    let mut names = Vec::new();
    for rest in code.split("crate::").skip(1) {
        let heads = match rest.strip_prefix('{') {
            Some(group) => top_level_items(group),
            None => vec![rest.to_owned()],
        };
        for head in heads {
            let name: String = head.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            names.extend((!name.is_empty()).then_some(name));
        }
    }
    names
}

/// The comma-separated items of a group up to its closing brace.
fn top_level_items(group: &str) -> Vec<String> {
    let (mut items, mut item, mut depth) = (Vec::new(), String::new(), 0);
    for c in group.chars() {
        match c {
            '}' if depth == 0 => break,
            ',' if depth == 0 => items.push(std::mem::take(&mut item)),
            _ => {
                depth += i32::from(c == '{') - i32::from(c == '}');
                item.push(c);
            }
        }
    }
    items.push(item);
    items
}

#[test]
fn modules_use_only_what_lies_below_them() {
    let may_use: BTreeMap<_, _> = MAY_USE.iter().copied().collect();
    let mut broken = Vec::new();
    for source in sources() {
        let module = source.module();
        if matches!(module, "cli" | "main" | "lib") {
            continue;
        }
        let Some(allowed) = may_use.get(module) else {
            panic!("src/{} belongs to no module that the rules know; add it to MAY_USE", source.path.display());
        };
        for name in neighbours(&source.code) {
            if name != module && !allowed.contains(&name.as_str()) {
                broken.push(format!("{} uses {name}", source.path.display()));
            }
        }
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn nothing_stands_above_what_it_is_used_by() {
    for (k, (module, uses)) in MAY_USE.iter().enumerate() {
        for used in *uses {
            let below = MAY_USE[..k].iter().any(|(name, _)| name == used);
            assert!(below, "{module} may use {used}, which does not stand below it");
        }
    }
}

#[test]
fn pure_modules_touch_no_file_clock_global_or_dice() {
    let mut broken = Vec::new();
    for source in sources().into_iter().filter(|s| PURE.contains(&s.module())) {
        broken.extend(
            IMPURE
                .iter()
                .filter(|word| source.code.contains(**word))
                .map(|word| format!("{} names {word}", source.path.display())),
        );
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn sql_stands_in_store_and_migrations_only() {
    const SQL: &[&str] = &["SELECT ", "INSERT INTO", "UPDATE ", "DELETE FROM", "CREATE TABLE", "PRAGMA ", "rusqlite"];
    let mut broken = Vec::new();
    for source in sources().into_iter().filter(|s| s.module() != "store") {
        broken.extend(
            SQL.iter()
                .filter(|word| source.text.contains(**word))
                .map(|word| format!("{} holds {word:?}", source.path.display())),
        );
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn only_build_and_cli_reach_the_writer() {
    for source in sources().into_iter().filter(|s| !matches!(s.module(), "store" | "build" | "cli")) {
        let names_writer = source.code.contains("store::Writer")
            || source.code.split_once("store::{").is_some_and(|(_, rest)| {
                top_level_items(rest).iter().any(|item| item.trim() == "Writer" || item.trim() == "remove_layer")
            });
        assert!(!names_writer, "{} reaches the store's Writer", source.path.display());
    }
    for source in sources().into_iter().filter(|s| !matches!(s.module(), "store" | "build" | "package")) {
        assert!(!source.code.contains("Extract"), "{} makes stores", source.path.display());
    }
}

#[test]
fn the_reader_has_no_statement_that_writes() {
    for file in [
        "store/reader.rs",
        "store/stored_tile.rs",
        "store/footprint_proof.rs",
        "store/footprint_queries.rs",
        "store/ground.rs",
    ] {
        let reader = sources().into_iter().find(|s| s.path == Path::new(file)).expect("one of the reader's files");
        for word in ["INSERT", "UPDATE ", "DELETE", "CREATE", "DROP", "ALTER", "VACUUM", "&mut self"] {
            assert!(!reader.text.contains(word), "{file} holds {word:?}");
        }
    }
}

#[test]
fn every_file_says_what_it_is_for_and_none_is_a_drawer() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for folder in ["src", "tests", "examples"] {
        rust_files(&root.join(folder), &mut files);
    }
    for file in files {
        let text = std::fs::read_to_string(&file).unwrap();
        let name = file.file_stem().and_then(|n| n.to_str()).unwrap_or("");
        assert!(text.starts_with("//!"), "{} does not open with //!", file.display());
        assert!(
            !["utils", "util", "common", "helpers", "helper", "manager", "misc"].contains(&name),
            "{} is a drawer",
            file.display()
        );
    }
}

#[test]
fn unit_tests_aside_no_file_is_longer_than_four_hundred_lines() {
    for source in sources() {
        let lines = source.text.lines().count();
        assert!(lines <= 400, "src/{} has {lines} lines", source.path.display());
    }
}

#[test]
fn unwrap_stays_in_tests() {
    let broken: Vec<_> = sources().into_iter().filter(|s| s.code.contains(".unwrap()")).map(|s| s.path).collect();
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn the_rules_themselves_see_what_they_forbid() {
    let code = "use overfly_store::{Reader, Writer};\nuse crate::{server, tile::{TileId, Gsd}, geodesy};\nfn f() { overfly_lab::trial::x() }";
    assert_eq!(neighbours(code), ["store", "server", "tile", "geodesy", "trial"]);
    assert!(!without_strings(&without_comments("let a = \"Instant\"; // SystemTime")).contains("Instant"));
}
