//! `overfly info`: shows what is in a store.

use crate::cli::cross_check::CrossCheckInfo;
use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::mission_text::mission_text;
use crate::cli::output::{Output, one_line};
use overfly_store::package::Manifest;
use overfly_store::{Layer, PLACES_SINCE, Reader, Source, StoreError, Terrain, hex};
use serde::Serialize;
use std::path::PathBuf;

/// Arguments.
#[derive(clap::Args)]
pub struct Args {
    /// The store.
    file: PathBuf,
    /// Compare the layers with each other: locate up to 40 patches of each on up to 6 others, and say how far they lie apart and what error
    /// that speaks for. Takes seconds to minutes
    #[arg(long)]
    cross_check: bool,
}

#[derive(Serialize)]
struct Info<'a> {
    file: &'a std::path::Path,
    digest: &'a str,
    format_version: u32,
    descriptor_contract: &'a str,
    tiles: u64,
    bytes: u64,
    layers: Vec<LayerInfo<'a>>,
    /// What the manifest of an exported store states; it is not verified here.
    exported: Option<ExportInfo>,
    /// The comparison of its layers, where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    cross_check: Option<CrossCheckInfo>,
}

#[derive(Serialize)]
struct ExportInfo {
    name: Option<String>,
    serial: Option<u64>,
    cut_from: String,
    corridor_m: f64,
    valid_until: Option<String>,
    signed_by: Option<String>,
    dropped: Vec<String>,
}

impl ExportInfo {
    fn from_manifest(manifest: Manifest) -> Self {
        Self {
            name: manifest.name,
            serial: manifest.serial,
            cut_from: manifest.cut_from,
            corridor_m: manifest.route.corridor_m,
            valid_until: manifest.valid_until,
            signed_by: manifest.signed_by,
            dropped: manifest.dropped.into_iter().map(|d| d.what).collect(),
        }
    }

    fn describe(&self) -> String {
        let or = |value: &Option<String>, none: &str| value.clone().unwrap_or(none.into());
        let mut text = format!(
            "exported from {}, corridor {} m\n  {}valid until {}, signed by {} (not verified; use `overfly verify --key`)\n",
            self.cut_from,
            self.corridor_m,
            mission_text(self.name.as_deref(), self.serial, None),
            or(&self.valid_until, "any day"),
            or(&self.signed_by, "nobody")
        );
        self.dropped.iter().for_each(|what| text.push_str(&format!("  without {what}\n")));
        text
    }
}

#[derive(Serialize)]
struct LayerInfo<'a> {
    #[serde(flatten)]
    layer: &'a Layer,
    /// A text for people, if there is one; no digest proves it.
    description: Option<String>,
    sources: Vec<SourceInfo>,
    /// Ground of which the base level has pixels: `null` while the layer is unfinished.
    imaged_km2: Option<f64>,
}

#[derive(Serialize)]
struct SourceInfo {
    path: PathBuf,
    content_hash: String,
    acquired: Option<String>,
    crs_epsg: Option<u32>,
    stretch: Option<(f64, f64)>,
    /// `null` where nothing states it.
    horizontal_error_m: Option<f64>,
    gsd_m_per_px: f64,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let reader = Reader::open(&args.file).map_err(Failure::of_crew)?;
    let layers = reader
        .layers()
        .iter()
        .map(|layer| {
            let sources = reader.sources(layer)?.into_iter().map(source_info).collect();
            let imaged = layer.complete.then(|| reader.imaged_area_m2(layer)).transpose()?;
            let description = reader.description(layer)?;
            Ok(LayerInfo { layer, description, sources, imaged_km2: imaged.map(|m2| m2 / 1e6) })
        })
        .collect::<Result<Vec<_>, StoreError>>()?;
    let info = Info {
        file: &args.file,
        digest: reader.digest(),
        format_version: reader.format_version(),
        descriptor_contract: reader.descriptor_contract(),
        tiles: reader.layers().iter().map(|l| l.tiles).sum(),
        bytes: reader.bytes(),
        layers,
        exported: reader.manifest().and_then(|text| Manifest::from_text(text).ok()).map(ExportInfo::from_manifest),
        cross_check: args.cross_check.then(|| CrossCheckInfo::new(&reader, output)).transpose()?,
    };
    output.say(&info, || describe(&info));
    Ok(Exit::Done)
}

fn source_info(source: Source) -> SourceInfo {
    SourceInfo {
        content_hash: hex(&source.content_hash),
        path: source.path,
        acquired: source.acquired,
        crs_epsg: source.crs_epsg,
        stretch: source.stretch,
        horizontal_error_m: source.horizontal_error_m,
        gsd_m_per_px: source.gsd_m_per_px,
    }
}

fn heights_error(terrain: &Terrain) -> String {
    let error_m = terrain.error_m();
    match terrain.vertical_error_m {
        Some(_) => format!("one standard deviation {error_m} m,"),
        None => format!("error unknown (fixes count with {error_m} m),"),
    }
}

/// What a store of an older format lacks, and how it gets it.
fn older_format(info: &Info<'_>) -> String {
    let remedy = if info.exported.is_some() { "export it again" } else { "any `overfly build` into it migrates it" };
    format!(
        "an older format: it lacks hashes that bind each tile to its place, outlines of valid pixels, licences and serials, and takes an error of 0 for unknown; {remedy}"
    )
}

fn describe(info: &Info<'_>) -> String {
    let mut text = format!(
        "{}: {:.1} MB, {} tiles, format {}, descriptors {}\ndigest {}\n",
        info.file.display(),
        info.bytes as f64 / 1e6,
        info.tiles,
        info.format_version,
        info.descriptor_contract,
        info.digest,
    );
    if info.format_version < PLACES_SINCE {
        text.push_str(&format!("{}\n", older_format(info)));
    }
    text.push_str(&info.exported.as_ref().map(ExportInfo::describe).unwrap_or_default());
    for LayerInfo { layer, description, sources, imaged_km2 } in &info.layers {
        let [west, south, east, north] = <[f64; 4]>::from(layer.bounds_deg);
        if !layer.complete {
            text.push_str(&format!(
                "\nlayer {}: unfinished; run the same `overfly build` again to finish it\n",
                layer.name
            ));
            continue;
        }
        text.push_str(&format!(
            "\nlayer {}: zoom {} to {}, {} base tiles, {} in all\n  west {west:.5} south {south:.5} east {east:.5} north {north:.5}\n",
            layer.name, layer.min_zoom, layer.base_zoom, layer.base_tiles, layer.tiles,
        ));
        let what = match &layer.terrain {
            Some(terrain) => format!("heights above {}, {}", terrain.vertical_datum.word(), heights_error(terrain)),
            None => "pixels".into(),
        };
        text.push_str(&format!("  {what} of {:.3} km2 of ground\n", imaged_km2.unwrap_or(0.0)));
        let (licence, attribution) = (&layer.terms.licence, &layer.terms.attribution);
        for (what, stated) in [("description", description), ("licence", licence), ("attribution", attribution)] {
            text.push_str(
                &stated.as_ref().map(|stated| format!("  {what}: {}\n", one_line(stated))).unwrap_or_default(),
            );
        }
        text.push_str("  acquired    gsd_m_per_px  error_m  source\n");
        for source in sources {
            text.push_str(&format!(
                "  {:<10}  {:>12.3}  {:>7}  {} ({})\n",
                source.acquired.as_deref().map_or("unknown", |a| a.get(..10).unwrap_or(a)),
                source.gsd_m_per_px,
                source.horizontal_error_m.map_or_else(|| "unknown".into(), |error_m| format!("{error_m:.2}")),
                source.path.display(),
                &source.content_hash[..8],
            ));
        }
    }
    text.push_str(&info.cross_check.as_ref().map(CrossCheckInfo::describe).unwrap_or_default());
    text.truncate(text.trim_end().len());
    text
}
