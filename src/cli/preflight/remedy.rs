//! Spells the remedies of the ingest side as commands and flags.

use overfly_ingest::Remedy;
use overfly_ingest::build::Rejected;

/// Adds its remedy to the message of a rejected source: to the first that needs it, since many sources often need the same.
pub fn explain_rejected(rejected: &mut [Rejected]) {
    let mut told = Vec::new();
    for one in rejected {
        let Some(remedy) = one.remedy.take().filter(|remedy| !told.contains(remedy)) else { continue };
        one.message = format!("{}; {}", one.message, spell(&remedy));
        told.push(remedy);
    }
}

/// Spells a remedy of the ingest side.
pub fn spell(remedy: &Remedy) -> String {
    match remedy {
        Remedy::StateCrs => "pass it with --crs EPSG".into(),
        Remedy::StateCrsOrReproject => {
            "pass the right one with --crs EPSG, or reproject the file with gdalwarp -t_srs EPSG:4326".into()
        }
        Remedy::StateHorizontalCrs => "pass the horizontal one with --crs EPSG".into(),
        Remedy::Reproject => "reproject the file with gdalwarp -t_srs EPSG:4326".into(),
        Remedy::CheckCrs => "check the CRS, and pass the right one with --crs EPSG".into(),
        Remedy::WriteGeoreference => {
            "write one with gdal_translate -a_srs EPSG:n -a_ullr ulx uly lrx lry, or add a world file".into()
        }
        Remedy::ReplaceGeotransform => "set it with gdal_edit.py -a_ullr".into(),
        Remedy::CheckGeoreference => "check its georeference".into(),
        Remedy::Rectify => "rectify it with gdalwarp".into(),
        Remedy::ConvertToCog => "convert it with gdal_translate -of COG, which is read by blocks".into(),
        Remedy::ConvertToCogOrUseGdal => {
            "convert it with gdal_translate -of COG, or build overfly with --features gdal".into()
        }
        Remedy::ConvertToRgb => "convert it with gdal_translate -of COG -expand rgb (or -ot Byte -scale)".into(),
        Remedy::CopyToFile => "copy its content to a file first".into(),
        Remedy::FetchAgain => "fetch it again, or check it with gdalinfo -checksum".into(),
        Remedy::StateStretch => {
            "pass the values shown as black and white with --stretch LO,HI (gdalinfo -stats shows their range)".into()
        }
        Remedy::StateTerrainDatum | Remedy::OneTerrainDatum | Remedy::NameHeightsAgain | Remedy::HeightsInMetres => {
            spell_terrain(remedy).into()
        }
        Remedy::CheckValidPixels => "check its mask, nodata value and pixel size with gdalinfo".into(),
        Remedy::NameSources => "name files or folders of orthophotos".into(),
        Remedy::FinerZoom => "if they are smaller than a pixel there, pass a finer --zoom".into(),
        Remedy::FewerTiles => "check its georeference, pass --zoom, or build it into a layer of its own".into(),
        Remedy::RestoreSource { path } => format!(
            "put it back, remove it from the layer with --remove-source {}, or build the layer from other sources with --replace-layer",
            path.display()
        ),
        Remedy::StateDatesInBuild => "state them with `overfly build SOURCE --date D`, source by source".into(),
        Remedy::CheckDate => "check the date, or set the clock".into(),
        Remedy::StateDate => "state the right one with --date, or set the clock".into(),
        Remedy::StateLastDay => "give the last day of the flight with --valid-until, or set the clock".into(),
        Remedy::ListSources => "`overfly info --json` lists its sources".into(),
        Remedy::RemoveLayer => {
            "a layer has at least one source; `overfly layer remove` removes whole layers, and asks first".into()
        }
        Remedy::ResumeBuild => "run the same build again to resume it".into(),
        Remedy::MergeBuiltStores => "merge the stores that were built, and export from the result".into(),
        Remedy::RebuildAtZoom { layer, zoom } => {
            format!("rebuild one of them with `--zoom {zoom} --layer {layer}`, or under another name")
        }
        Remedy::RebuildAsDeclared => "rebuild it there as it is in the others".into(),
        Remedy::ChooseCovering => {
            "let the newest cover (--on-conflict newest) or the store that is named first (--on-conflict first)".into()
        }
        Remedy::CheckPath => "check the name".into(),
        Remedy::UseRouteFormat => "a route is lines of GeoJSON, GPX or KML, in WGS84 degrees".into(),
        Remedy::CheckRoute => "check that it is the right route, and that its positions are longitude first".into(),
        Remedy::ReduceExport => "narrow the corridor, shorten the route, or name fewer layers".into(),
    }
}

/// Spells a remedy for heights.
fn spell_terrain(remedy: &Remedy) -> &'static str {
    match remedy {
        Remedy::StateTerrainDatum => {
            "state it with --terrain-datum egm96|egm2008|ellipsoid (Copernicus: egm2008, SRTM: egm96)"
        }
        Remedy::OneTerrainDatum => {
            "convert the heights with gdalwarp -s_srs and -t_srs, or build the terrain anew with --replace-terrain"
        }
        Remedy::NameHeightsAgain => "name them beside the new ones, or build the terrain anew with --replace-terrain",
        _ => "convert them with gdal_calc.py or gdalwarp",
    }
}
