//! The operations that write a store, a row each: what stands there before, the command, and what an undisturbed run makes.

use super::bench::Bench;
use crate::drawn::{CRS, orthophoto};
use overfly::store::Reader;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Where every operation writes.
pub const TARGET: &str = "target.gpkg";

/// An operation.
pub struct Operation {
    pub name: &'static str,
    /// What stands in the work folder before, by name; [`TARGET`] among it where the operation changes a store.
    pub before: BTreeMap<&'static str, PathBuf>,
    /// The command line; `{}` is the work folder.
    pub arguments: Vec<OsString>,
    /// Whether an interrupted run may leave an unfinished layer, which the next run goes on with.
    pub resumes: bool,
    /// Whether the same command gives the same bytes, and not only the same digest.
    pub same_bytes: bool,
}

/// What operations work on.
struct Material {
    sources: [PathBuf; 2],
    stores: BTreeMap<&'static str, PathBuf>,
    routes: [PathBuf; 2],
}

/// The operations; what they need is made in `folder`.
pub fn operations(bench: &Bench, folder: &Path) -> Vec<Operation> {
    let material = Material::make(bench, folder);
    let mut all = builds(&material);
    all.extend(exports(&material));
    all
}

fn builds(material: &Material) -> Vec<Operation> {
    let [a, b] = &material.sources;
    let row = |name, store: Option<&str>, words: &[&str], sources: &[&PathBuf]| Operation {
        name,
        before: store.map(|s| (TARGET, material.stores[s].clone())).into_iter().collect(),
        arguments: build_words("{}/target.gpkg", words, sources),
        resumes: true,
        same_bytes: false,
    };
    vec![
        row("build, a new store", None, &[], &[a, b]),
        row("build, a second layer", Some("of a"), &["--layer", "second"], &[b]),
        row("build, a layer that answers", Some("of a"), &[], &[b]),
        row("build, most of it dropped", Some("of both, fine"), &["--replace-layer"], &[a]),
    ]
}

fn exports(material: &Material) -> Vec<Operation> {
    let row = |name, old: Option<&str>| Operation {
        name,
        before: [("from.gpkg", "of both")]
            .into_iter()
            .chain(old.map(|o| (TARGET, o)))
            .map(|(name, store)| (name, material.stores[store].clone()))
            .collect(),
        arguments: export_words("{}/from.gpkg", &material.routes[1], "{}/target.gpkg"),
        resumes: false,
        same_bytes: true,
    };
    vec![row("export, nothing there", None), row("export, over an older one", Some("exported"))]
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
    fn make(bench: &Bench, folder: &Path) -> Self {
        let sources = [
            orthophoto(folder, "a.png", (900, 800), (0, 0), 1, false),
            orthophoto(folder, "b.png", (1100, 900), (500, 100), 2, true),
        ];
        let [a, b] = &sources;
        let mut stores = BTreeMap::new();
        for (name, words, sources) in
            [("of a", &[][..], &[a][..]), ("of both", &[], &[a, b]), ("of both, fine", &["--zoom", "19"], &[a, b])]
        {
            let path = folder.join(format!("{name}.gpkg"));
            bench.succeed(&build_words(path.to_str().unwrap(), words, sources));
            stores.insert(name, path);
        }
        let [west, south, east, north] = Reader::open(&stores["of both"]).unwrap().layers()[0].bounds_deg;
        let (from, to) = ([west + 0.4 * (east - west), (south + north) / 2.0], west + 0.6 * (east - west));
        let routes = [from[0], to].map(|end| {
            let line = serde_json::json!({"type": "LineString", "coordinates": [from, [end + 0.0001, from[1]]]});
            let path = folder.join(format!("{end}.geojson"));
            std::fs::write(&path, line.to_string()).unwrap();
            path
        });
        let exported = folder.join("exported.gpkg");
        let text = |path: &Path| path.to_str().unwrap().to_owned();
        bench.succeed(&export_words(&text(&stores["of both"]), &routes[0], &text(&exported)));
        stores.insert("exported", exported);
        Self { sources, stores, routes }
    }
}
