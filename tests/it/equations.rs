//! `docs/equations.md` keeps its word: every equation of the paper is there, and what it names exists.

use std::path::{Path, PathBuf};

/// One row of a table of equations.
struct Row {
    number: String,
    code: Vec<String>,
    tests: Vec<String>,
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
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

/// The words between backticks.
fn quoted(text: &str) -> Vec<String> {
    text.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// Rows of the tables headed by "no.".
fn rows(document: &str) -> Vec<Row> {
    let (mut rows, mut inside) = (Vec::new(), false);
    for line in document.lines() {
        let cells: Vec<_> = line.trim().trim_matches('|').split('|').map(str::trim).collect();
        match cells.as_slice() {
            ["no.", ..] => inside = true,
            _ if !line.starts_with('|') => inside = false,
            [number, _, code, tests] if inside && !number.starts_with("---") => {
                rows.push(Row { number: number.to_string(), code: quoted(code), tests: quoted(tests) });
            }
            _ => assert!(!inside || cells[0].starts_with("---"), "a row of another width: {line}"),
        }
    }
    rows
}

/// The folders of sources: of the program and of every library.
fn source_folders() -> Vec<PathBuf> {
    let crates = std::fs::read_dir(root().join("crates")).unwrap();
    let libraries = crates.map(|entry| entry.unwrap().path().join("src"));
    std::iter::once(root().join("src")).chain(libraries).collect()
}

/// The text of a module: all files below `src/NAME/` of the program or of a library, or a library's `tests/NAME.rs`.
fn module_text(path: &str) -> Option<String> {
    let name = path.split("::").next()?;
    let folder = source_folders().into_iter().map(|folder| folder.join(name)).find(|folder| folder.is_dir());
    let Some(folder) = folder else {
        let tests = source_folders().into_iter().map(|folder| folder.with_file_name("tests").join(name));
        return tests.filter_map(|file| std::fs::read_to_string(file.with_extension("rs")).ok()).next();
    };
    let mut files = Vec::new();
    rust_files(&folder, &mut files);
    Some(files.iter().map(|file| std::fs::read_to_string(file).unwrap()).collect())
}

/// Whether `text` has `before`, `name`, and no more letters of a name.
fn has_word(text: &str, before: &str, name: &str) -> bool {
    let wanted = format!("{before} {name}");
    text.match_indices(&wanted).any(|(at, _)| {
        let after = text[at + wanted.len()..].chars().next();
        !after.is_some_and(|c| c.is_alphanumeric() || c == '_')
    })
}

/// Whether each capitalised or last part of `module::Type::name` is defined in the module, in public.
fn code_exists(path: &str) -> bool {
    let Some(text) = module_text(path) else { return false };
    let parts: Vec<_> = path.split("::").skip(1).collect();
    let last = parts.len().saturating_sub(1);
    !parts.is_empty()
        && parts.iter().enumerate().all(|(k, part)| {
            let is_module = k < last && part.chars().all(|c| c.is_lowercase() || c == '_');
            is_module
                || ["fn", "struct", "enum", "const"].iter().any(|kind| has_word(&text, &format!("pub {kind}"), part))
        })
}

/// Whether `module::name` is a test of that module.
fn test_exists(path: &str) -> bool {
    let (Some(text), Some((_, name))) = (module_text(path), path.split_once("::")) else { return false };
    let lines: Vec<_> = text.lines().map(str::trim).collect();
    lines.windows(2).any(|two| two[0] == "#[test]" && has_word(two[1], "fn", name))
}

fn document() -> String {
    std::fs::read_to_string(root().join("docs/equations.md")).unwrap()
}

#[test]
fn every_equation_from_1_to_45_has_a_row() {
    let rows = rows(&document());
    for number in 1..=45 {
        let label = format!("({number})");
        let count = rows.iter().filter(|row| row.number.split_whitespace().next() == Some(label.as_str())).count();
        // Two equations of the paper bear number 39.
        assert_eq!(count, if number == 39 { 2 } else { 1 }, "rows of {label}");
    }
}

#[test]
fn every_function_and_test_that_a_row_names_exists() {
    let mut broken = Vec::new();
    for row in rows(&document()) {
        if row.code.is_empty() || row.tests.is_empty() {
            broken.push(format!("{} names no code or no test", row.number));
        }
        broken.extend(row.code.iter().filter(|path| !code_exists(path)).map(|p| format!("{}: no {p}", row.number)));
        broken
            .extend(row.tests.iter().filter(|path| !test_exists(path)).map(|p| format!("{}: no test {p}", row.number)));
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn every_path_in_the_prose_exists() {
    let document = document();
    let prose: String = document.lines().filter(|line| !line.starts_with('|')).collect::<Vec<_>>().join("\n");
    let paths: Vec<_> =
        quoted(&prose).into_iter().filter(|word| module_text(word).is_some() && word.contains("::")).collect();
    assert!(paths.len() > 20, "found only {} paths", paths.len());
    let broken: Vec<_> =
        paths.iter().filter(|path| !(code_exists(path) || test_exists(path) || module_exists(path))).collect();
    assert!(broken.is_empty(), "{broken:#?}");
}

/// Whether `outer::inner` is a folder or file of sources.
fn module_exists(path: &str) -> bool {
    let mut places = source_folders().into_iter().map(|folder| folder.join(path.replace("::", "/")));
    places.any(|place| place.is_dir() || place.with_extension("rs").is_file())
}

#[test]
fn the_checks_see_what_is_missing() {
    assert!(code_exists("coupling::Sequential::max_speed_mps") && code_exists("registration::Similarity::through"));
    for absent in
        ["coupling::Sequential::max_speed", "coupling::Absent::max_speed_mps", "nowhere::turn_point", "coupling"]
    {
        assert!(!code_exists(absent), "{absent}");
    }
    assert!(test_exists("coupling::n_max_is_the_root_that_bisection_finds"));
    assert!(test_exists("spherical_earth::refuses_a_step_over_the_pole"));
    // A function that is no test, and a test of another module.
    assert!(!test_exists("coupling::turn_point") && !test_exists("geodesy::n_max_is_the_root_that_bisection_finds"));
    let table = "| no. | a | b | c |\n|---|---|---|---|\n| (3) | x | `f` `g` | `t` |\n\n| (4) | x | `f` | `t` |\n";
    let found = rows(table);
    assert_eq!((found.len(), found[0].number.as_str(), found[0].code.len()), (1, "(3)", 2));
}
