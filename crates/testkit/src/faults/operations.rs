//! All operations that write a store, a row each, and their inputs.

use super::bench::FaultBench;
use super::operation::{TARGET, WriteOperation};
use crate::drawn::{CRS, orthophoto};
use crate::older_store::older_copy;
use overfly_store::{OLDEST_READABLE, Reader};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The inputs of the operations.
struct Material {
    sources: [PathBuf; 2],
    files: BTreeMap<&'static str, PathBuf>,
    routes: [PathBuf; 2],
}

/// The operations. Their inputs are made in `folder`.
pub fn operations(bench: &FaultBench, folder: &Path) -> Vec<WriteOperation> {
    let material = Material::make(bench, folder);
    let mut all = builds(&material);
    all.extend(renamed(&material));
    all
}

fn builds(material: &Material) -> Vec<WriteOperation> {
    let [a, b] = &material.sources;
    let row = |name, store: Option<&str>, words: &[&str], sources: &[&PathBuf]| WriteOperation {
        name,
        before: store.map(|s| (TARGET, material.files[s].clone())).into_iter().collect(),
        arguments: build_words("{}/target.gpkg", words, sources),
        resumes: true,
        makes_map: false,
        same_bytes: false,
        makes_patch: false,
    };
    vec![
        row("build, a new store", None, &[], &[a, b]),
        row("build, a second layer", Some("of a"), &["--layer", "second"], &[b]),
        row("build, a layer that answers", Some("of a"), &[], &[b]),
        row("build, most of it dropped", Some("of both, fine"), &["--replace-layer"], &[a]),
        row("build, of format 4", Some("of both, format 4"), &[], &[a, b]),
        row("build, of format 5", Some("of a, format 5"), &[], &[a]),
    ]
}

/// Operations that write their target beside its place and rename it.
fn renamed(material: &Material) -> Vec<WriteOperation> {
    let row = |name, before: &[(&'static str, &str)], arguments: Vec<OsString>| WriteOperation {
        name,
        before: before.iter().map(|(name, file)| (*name, material.files[file].clone())).collect(),
        arguments,
        resumes: false,
        makes_map: false,
        same_bytes: true,
        makes_patch: false,
    };
    let export = export_words("{}/from.gpkg", &material.routes[1], "{}/target.gpkg");
    let apply = words(&["apply", "{}/target.gpkg", "{}/patch"]);
    let apply_out = words(&["apply", "{}/from.gpkg", "{}/patch", "--out", "{}/target.gpkg"]);
    let diff = words(&["diff", "{}/from.gpkg", "{}/to.gpkg", "--out", "{}/target.gpkg"]);
    let merge = words(&["merge", "{}/a.gpkg", "{}/b.gpkg", "--out", "{}/target.gpkg"]);
    let both = [("a.gpkg", "of a"), ("b.gpkg", "of b")];
    vec![
        WriteOperation { makes_map: true, ..row("merge, nothing there", &both, merge) },
        row("export, nothing there", &[("from.gpkg", "of both")], export.clone()),
        row("export, over an older one", &[("from.gpkg", "of both"), (TARGET, "exported")], export),
        row("apply, to an exported store", &[("patch", "sealed patch"), (TARGET, "exported")], apply.clone()),
        row("apply, to a built store", &[("patch", "patch"), (TARGET, "of a")], apply),
        WriteOperation {
            makes_map: true,
            ..row("apply, to another place", &[("patch", "patch"), ("from.gpkg", "of a")], apply_out)
        },
        WriteOperation {
            makes_patch: true,
            ..row("diff, a patch", &[("from.gpkg", "of a"), ("to.gpkg", "of both")], diff)
        },
    ]
}

fn words(all: &[&str]) -> Vec<OsString> {
    all.iter().map(Into::into).collect()
}

fn build_words(db: &str, words: &[&str], sources: &[&PathBuf]) -> Vec<OsString> {
    let crs = CRS.to_string();
    let mut all: Vec<OsString> = ["build", "--threads", "2", "--crs", &crs, "--db", db].map(Into::into).into();
    all.extend(words.iter().map(Into::into));
    all.extend(sources.iter().map(|s| s.as_os_str().to_owned()));
    all
}

fn export_words(from: &str, route: &Path, out: &str) -> Vec<OsString> {
    let mut all: Vec<OsString> = ["export", "--corridor-m", "60", "--db", from, "--out", out].map(Into::into).into();
    all.extend(["--route".into(), route.as_os_str().to_owned()]);
    all
}

impl Material {
    fn make(bench: &FaultBench, folder: &Path) -> Self {
        let sources = [
            orthophoto(folder, "a.png", (900, 800), (0, 0), 1, false),
            orthophoto(folder, "b.png", (1100, 900), (500, 100), 2, true),
        ];
        let [a, b] = &sources;
        let mut files = BTreeMap::new();
        for (name, options, sources) in [
            ("of a", &[][..], &[a][..]),
            ("of b", &[], &[b]),
            ("of both", &[], &[a, b]),
            ("of both, fine", &["--zoom", "18"], &[a, b]),
        ] {
            let path = folder.join(format!("{name}.gpkg"));
            bench.succeed(&build_words(text(&path), options, sources));
            files.insert(name, path);
        }
        for (name, of, version) in
            [("of both, format 4", "of both", OLDEST_READABLE), ("of a, format 5", "of a", OLDEST_READABLE + 1)]
        {
            let path = folder.join(format!("{name}.gpkg"));
            older_copy(&files[of], &path, version);
            files.insert(name, path);
        }
        let routes = routes(folder, &files["of both"]);
        for (name, route) in [("exported", &routes[0]), ("exported later", &routes[1])] {
            let path = folder.join(format!("{name}.gpkg"));
            bench.succeed(&export_words(text(&files["of both"]), route, text(&path)));
            files.insert(name, path);
        }
        for (name, old, new) in [("patch", "of a", "of both"), ("sealed patch", "exported", "exported later")] {
            let path = folder.join(name);
            bench.succeed(&words(&["diff", text(&files[old]), text(&files[new]), "--out", text(&path)]));
            files.insert(name, path);
        }
        Self { sources, files, routes }
    }
}

/// A short route through the middle of a store, and a longer one.
fn routes(folder: &Path, store: &Path) -> [PathBuf; 2] {
    let [west, south, east, north] =
        <[f64; 4]>::from(Reader::open(store).expect("the sound store opens").layers()[0].bounds_deg);
    let (start, latitude) = (west + 0.4 * (east - west), (south + north) / 2.0);
    [0.0, 0.2].map(|share| {
        let end = start + share * (east - west) + 0.0001;
        let line = serde_json::json!({"type": "LineString", "coordinates": [[start, latitude], [end, latitude]]});
        let path = folder.join(format!("{share}.geojson"));
        std::fs::write(&path, line.to_string()).expect("the rig reads and writes its own files");
        path
    })
}

fn text(path: &Path) -> &str {
    path.to_str().expect("the path is UTF-8")
}
