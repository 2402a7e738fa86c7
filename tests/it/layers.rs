//! The rules of the workspace that the compiler does not keep: what core must not touch, where SQL stands, what each crate
//! may be built with, no circles, no long functions or files, no old names.

use super::imports::{Arrows, Graph, circles};
use super::sources::{SourceFile, functions, packages, root, rust_files, sources, words_and_strings};
use std::collections::BTreeSet;
use std::process::Command;

/// The libraries from the bottom up: each may depend only on those before it.
const ORDER: [&str; 7] = ["core", "store", "flight", "capi", "ingest", "lab", "testkit"];

/// Most lines of a function, from `fn` to its closing brace.
const MOST_FUNCTION_LINES: usize = 60;
/// Most lines of a file without its unit tests.
const MOST_FILE_LINES: usize = 400;

/// Words that core's code must not have: files, clocks, environment, printing, globals, unseeded randomness.
const IMPURE_WORDS: &[&str] = &[
    "fs",
    "net",
    "env",
    "process",
    "stdout",
    "stderr",
    "stdin",
    "Instant",
    "SystemTime",
    "println",
    "eprintln",
    "print",
    "eprint",
    "dbg",
    "tracing",
    "LazyLock",
    "LazyCell",
    "OnceLock",
    "OnceCell",
    "thread_local",
    "thread_rng",
    "from_os_rng",
    "from_entropy",
];

/// What a crate must be built without, by its package: none of these is in the tree of its normal dependencies.
const WITHOUT: &[(&str, &[&str])] = &[
    ("overfly-core", &["serde_json", "rusqlite", "overfly-store", "axum", "clap", "plotters", "utoipa"]),
    ("overfly-store", &["axum", "clap", "plotters", "utoipa"]),
    ("overfly-flight", &["axum", "clap", "plotters", "proj4rs", "tiff-reader", "utoipa"]),
    ("overfly-ingest", &["axum", "clap", "utoipa"]),
    ("overfly-lab", &["axum", "utoipa"]),
    ("overfly-capi", &["axum", "clap", "plotters", "proj4rs", "tiff-reader", "utoipa"]),
];

/// Types that were renamed to the field's words (left: the old name, right: the new one). `Keep` is looked for in code alone.
const OLD_TYPES: &[(&str, &str)] = &[
    ("Estimate", "NavigationFilter"),
    ("Judge", "Verifier"),
    ("Shelf", "an LRU cache"),
    ("Witness", "footprint proof"),
    ("Outlet", "atomic file"),
    ("Patience", "search widening"),
];

/// Words that were replaced, in code, comments and documents.
const OLD_WORDS: &[&str] = &["shedding", "strangers", "outlet", "patience", "shelf", "witness"];

/// Files whose functions and length are bounded: the program and the libraries, not the rigs and their kit.
fn is_bounded(source: &SourceFile) -> bool {
    source.package != "testkit"
}

/// Fails with a list, which goes to `target/offenders/` too.
fn none_of(offenders: &[String], rule: &str) {
    let folder = root().join("target/offenders");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join(rule), offenders.join("\n")).unwrap();
    assert!(offenders.is_empty(), "{rule}:\n{}", offenders.join("\n"));
}

#[test]
fn core_touches_no_file_clock_environment_or_global() {
    let mut offenders = Vec::new();
    for source in sources().iter().filter(|s| s.package == "core") {
        let (words, _) = words_and_strings(source);
        for pair in words.windows(2) {
            let [(word, line), (next, _)] = pair else { continue };
            if IMPURE_WORDS.contains(&word.as_str()) || word == "static" && next == "mut" {
                offenders.push(format!("{}:{line}: {word}", source.path));
            }
        }
    }
    none_of(&offenders, "core-is-pure");
}

#[test]
fn no_unsafe_code_outside_simd_and_the_c_interface() {
    let mut offenders = Vec::new();
    for source in sources() {
        let (words, _) = words_and_strings(&source);
        let may = source.package == "capi"
            || ["simd", "target_feature", "x86", "mallopt", "setenv", "set_var"]
                .iter()
                .any(|w| source.text.contains(w));
        if let Some((_, line)) = words.iter().find(|(w, _)| w == "unsafe").filter(|_| !may) {
            offenders.push(format!("{}:{line}: unsafe", source.path));
        }
    }
    none_of(&offenders, "unsafe-stays-in-kernels");
}

#[test]
fn sql_stands_in_store_and_migrations_only() {
    const SQL: &[&str] = &["SELECT ", "INSERT INTO", "UPDATE ", "DELETE FROM", "CREATE TABLE", "PRAGMA "];
    let mut offenders = Vec::new();
    for source in sources().iter().filter(|s| !matches!(s.package.as_str(), "store" | "testkit")) {
        let (words, strings) = words_and_strings(source);
        let sql = strings.iter().filter(|(text, _)| SQL.iter().any(|word| text.contains(word)));
        let sqlite = words.iter().filter(|(word, _)| word == "rusqlite");
        offenders.extend(sql.chain(sqlite).map(|(text, line)| format!("{}:{line}: {text}", source.path)));
    }
    none_of(&offenders, "sql-in-store-only");
}

#[test]
fn the_reader_has_no_statement_that_writes() {
    let all = sources();
    let store: Vec<&SourceFile> = all.iter().filter(|s| s.package == "store").collect();
    let is_reader = |s: &SourceFile| s.text.contains("impl Reader") || s.text.contains("impl<'a> Reader");
    let reader: Vec<&&SourceFile> = store.iter().filter(|s| is_reader(s)).collect();
    assert!(reader.len() >= 3, "found only {} files of the reader", reader.len());
    let mut offenders = Vec::new();
    for source in reader {
        let (_, strings) = words_and_strings(source);
        for (text, line) in strings {
            for word in ["INSERT", "UPDATE ", "DELETE", "CREATE", "DROP", "ALTER", "VACUUM"] {
                if text.contains(word) {
                    offenders.push(format!("{}:{line}: {word}", source.path));
                }
            }
        }
    }
    none_of(&offenders, "reader-does-not-write");
}

#[test]
fn only_ingest_and_the_program_reach_the_writer() {
    let mut offenders = Vec::new();
    for source in sources().iter().filter(|s| matches!(s.package.as_str(), "core" | "flight" | "capi" | "lab")) {
        let (words, _) = words_and_strings(source);
        // csv has a Writer too.
        if !words.iter().any(|(word, _)| word == "overfly_store") {
            continue;
        }
        let writes = words.iter().filter(|(w, _)| matches!(w.as_str(), "Writer" | "Extract" | "change_layer"));
        offenders.extend(writes.map(|(word, line)| format!("{}:{line}: {word}", source.path)));
    }
    none_of(&offenders, "writer-stays-on-the-ground");
}

#[test]
fn each_library_depends_only_on_those_below_it() {
    let mut offenders = Vec::new();
    for (name, folder) in packages().into_iter().filter(|(name, _)| name != "overfly") {
        let place = ORDER.iter().position(|o| *o == name);
        let Some(place) = place else { panic!("crates/{name} has no place in ORDER") };
        let manifest: toml::Table = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap().parse().unwrap();
        let dependencies = manifest["dependencies"].as_table().unwrap();
        for dependency in dependencies.keys().filter_map(|k| k.strip_prefix("overfly-")) {
            if !ORDER[..place].contains(&dependency) {
                offenders.push(format!("{name} depends on {dependency}"));
            }
        }
    }
    none_of(&offenders, "crates-point-downwards");
}

#[test]
fn each_library_is_built_without_what_it_must_not_have() {
    let mut offenders = Vec::new();
    for (package, without) in WITHOUT {
        let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
        let tree = Command::new(cargo)
            .args(["tree", "--offline", "-e", "normal", "--prefix", "none", "-p", package])
            .current_dir(root())
            .output()
            .unwrap();
        assert!(tree.status.success(), "{}", String::from_utf8_lossy(&tree.stderr));
        let text = String::from_utf8(tree.stdout).unwrap();
        let names: BTreeSet<&str> = text.lines().filter_map(|l| l.split(' ').next()).collect();
        assert!(names.contains(package), "{text}");
        offenders
            .extend(without.iter().filter(|w| names.contains(**w)).map(|w| format!("{package} is built with {w}")));
    }
    none_of(&offenders, "built-without");
}

/// Folders (or files) at the top of a package, and which uses which.
fn modules_of(arrows: &Arrows) -> BTreeSet<(String, String)> {
    let top = |path: &str| {
        let inside = path.split_once("src/").map_or(path, |(_, rest)| rest);
        let package = path.split("src/").next().unwrap_or_default();
        format!("{package}src/{}", inside.split('/').next().unwrap_or(inside).trim_end_matches(".rs"))
    };
    arrows.keys().map(|(a, b)| (top(a), top(b))).filter(|(a, b)| a != b).collect()
}

#[test]
fn no_file_is_in_a_circle_of_imports() {
    let all = sources();
    let mut offenders = Vec::new();
    for (package, _) in packages() {
        let arrows = Graph::new(all.iter().filter(|s| s.package == package)).arrows();
        assert!(arrows.len() > 3 || package == "capi", "{package} has {} arrows", arrows.len());
        for circle in circles(&arrows.keys().cloned().collect()) {
            offenders.push(format!("circle of {} files in {package}:", circle.len()));
            for ((from, to), items) in arrows.iter().filter(|((a, b), _)| circle.contains(a) && circle.contains(b)) {
                offenders.push(format!("  {from} -> {to}: {}", items.iter().cloned().collect::<Vec<_>>().join(", ")));
            }
        }
        for circle in circles(&modules_of(&arrows)) {
            offenders.push(format!("circle of modules in {package}: {circle:?}"));
            let inside =
                |path: &String| circle.iter().any(|c| path.starts_with(&format!("{c}/")) || *path == format!("{c}.rs"));
            for ((from, to), items) in arrows.iter().filter(|((a, b), _)| inside(a) && inside(b)) {
                let (a, b) = (circle.iter().find(|c| from.starts_with(*c)), circle.iter().find(|c| to.starts_with(*c)));
                if a != b {
                    offenders.push(format!("  {from} -> {to}: {items:?}"));
                }
            }
        }
    }
    none_of(&offenders, "circles");
}

#[test]
fn no_function_is_longer_than_sixty_lines() {
    let mut offenders = Vec::new();
    for source in sources().iter().filter(|s| is_bounded(s)) {
        for function in functions(source).into_iter().filter(|f| f.lines > MOST_FUNCTION_LINES) {
            offenders
                .push(format!("{}:{}: {} has {} lines", source.path, function.line, function.name, function.lines));
        }
    }
    none_of(&offenders, "long-functions");
}

#[test]
fn unit_tests_aside_no_file_is_longer_than_four_hundred_lines() {
    let long = sources().into_iter().filter(|s| is_bounded(s) && s.lines > MOST_FILE_LINES);
    none_of(&long.map(|s| format!("{}: {} lines", s.path, s.lines)).collect::<Vec<_>>(), "long-files");
}

#[test]
fn every_file_says_what_it_is_for_and_none_is_a_drawer() {
    let mut offenders = Vec::new();
    for folder in ["src", "crates", "tests", "examples", "benches"] {
        for file in rust_files(&root().join(folder)) {
            let text = std::fs::read_to_string(&file).unwrap();
            let name = file.file_stem().and_then(|n| n.to_str()).unwrap_or("");
            if !text.starts_with("//!") && name != "tests" {
                offenders.push(format!("{} does not open with //!", file.display()));
            }
            if ["utils", "util", "common", "helpers", "helper", "manager", "misc", "types"].contains(&name) {
                offenders.push(format!("{} is a drawer", file.display()));
            }
        }
    }
    none_of(&offenders, "files-say-what-they-are-for");
}

#[test]
fn unwrap_stays_in_tests() {
    let mut offenders = Vec::new();
    for source in sources().iter().filter(|s| s.package != "testkit") {
        let (words, _) = words_and_strings(source);
        // A constant's `unwrap` fails when the program is compiled.
        let is_constant = |line: usize| source.text.lines().nth(line - 1).is_some_and(|text| text.contains("const "));
        let unwraps = words.iter().filter(|(word, line)| word == "unwrap" && !is_constant(*line));
        offenders.extend(unwraps.map(|(_, line)| format!("{}:{line}", source.path)));
    }
    none_of(&offenders, "unwrap");
}

/// The words of a text, split where no letter, digit or underscore stands.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|w| !w.is_empty())
}

#[test]
fn the_old_names_are_gone_and_the_filter_is_found_by_its_name() {
    let mut offenders = Vec::new();
    let mut kalman = false;
    let mut files: Vec<_> = ["src", "crates"].iter().flat_map(|f| rust_files(&root().join(f))).collect();
    let documents = std::fs::read_dir(root().join("docs")).unwrap().map(|e| e.unwrap().path());
    files.extend(documents.filter(|p| p.extension().is_some_and(|e| e == "md")));
    files.extend(["README.md", "ARCHITECTURE.md"].map(|name| root().join(name)));
    for source in sources() {
        let keep = words_and_strings(&source).0.into_iter().filter(|(word, _)| word == "Keep");
        offenders.extend(keep.map(|(_, line)| format!("{}:{line}: Keep is now cache limits", source.path)));
    }
    for file in files {
        let name = file.strip_prefix(root()).unwrap().display().to_string();
        for (number, line) in std::fs::read_to_string(&file).unwrap().lines().enumerate() {
            for word in words(line) {
                let old_type = OLD_TYPES.iter().find(|(old, _)| *old == word);
                if let Some((old, new)) = old_type {
                    offenders.push(format!("{name}:{}: {old} is now {new}", number + 1));
                } else if OLD_WORDS.contains(&word) {
                    offenders.push(format!("{name}:{}: {word}", number + 1));
                }
                kalman |= word == "Kalman";
            }
        }
    }
    if !kalman {
        offenders.push("nothing says Kalman".into());
    }
    none_of(&offenders, "old-names");
}

#[test]
fn constructors_are_new_from_or_parse_and_not_of() {
    let mut offenders = Vec::new();
    for source in sources().iter() {
        for function in functions(source).into_iter().filter(|f| f.name == "of") {
            offenders.push(format!("{}:{}: fn of", source.path, function.line));
        }
    }
    none_of(&offenders, "constructors");
}
