//! `Remedy`: what a user can do about an error of this crate.
//!
//! The errors themselves state facts. A program turns a remedy into its own words: flags, commands or routes.

use std::path::PathBuf;

/// What a user can do about an error.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Remedy {
    /// State the EPSG code of the source's horizontal CRS.
    StateCrs,
    /// State the right CRS, or reproject the source to EPSG:4326.
    StateCrsOrReproject,
    /// State the EPSG code of the horizontal part of a compound or vertical system.
    StateHorizontalCrs,
    /// Reproject the source to EPSG:4326.
    Reproject,
    /// Check the CRS that the source states, and state another where it is wrong.
    CheckCrs,
    /// Write a CRS and a geotransform into the source.
    WriteGeoreference,
    /// Replace the source's geotransform.
    ReplaceGeotransform,
    /// Check the source's georeference.
    CheckGeoreference,
    /// Warp the source by its ground control points.
    Rectify,
    /// Convert the source to a Cloud Optimized GeoTIFF.
    ConvertToCog,
    /// Convert the source to a Cloud Optimized GeoTIFF, or read it with GDAL.
    ConvertToCogOrUseGdal,
    /// Convert the source to 8-bit RGB.
    ConvertToRgb,
    /// Copy the content of a pipe or device to a regular file.
    CopyToFile,
    /// Fetch the source again, or check it with GDAL.
    FetchAgain,
    /// State which sample values are shown as black and white.
    StateStretch,
    /// State the surface that the heights are above.
    StateTerrainDatum,
    /// Bring all heights to one surface, or build the terrain anew.
    OneTerrainDatum,
    /// Name the heights again beside the new ones, or build the terrain anew.
    NameHeightsAgain,
    /// Convert the heights to metres.
    HeightsInMetres,
    /// Check the source's mask, nodata value and pixel size.
    CheckValidPixels,
    /// Name files or folders of orthophotos.
    NameSources,
    /// Build at a finer zoom, where the sources fill no pixel at this one.
    FinerZoom,
    /// Check the source's georeference, build at a coarser zoom, or build the source into a layer of its own.
    FewerTiles,
    /// Put a source back where it was, take it out of the layer, or build the layer from other sources.
    RestoreSource {
        /// The source.
        path: PathBuf,
    },
    /// Build the sources again, each with its date.
    StateDatesInBuild,
    /// Check the acquisition date, or set the clock.
    CheckDate,
    /// State the acquisition date of a source whose metadata are wrong, or set the clock.
    StateDate,
    /// State the last day of the flight, or set the clock.
    StateLastDay,
    /// List the sources of the layer.
    ListSources,
    /// Remove the whole layer.
    RemoveLayer,
    /// Run the same build again; it resumes.
    ResumeBuild,
    /// Merge the stores that were built, and export from the result.
    MergeBuiltStores,
    /// Rebuild one of the layers at the zoom of the other, or under another name.
    RebuildAtZoom {
        /// The layer.
        layer: String,
        /// The zoom of the other store's layer.
        zoom: u8,
    },
    /// Rebuild the layer with the declaration that the other stores have.
    RebuildAsDeclared,
    /// Choose which store covers where tiles differ.
    ChooseCovering,
    /// Check the path.
    CheckPath,
    /// Give a route in a format that is read: lines of GeoJSON, GPX or KML, in WGS84 degrees.
    UseRouteFormat,
    /// Check that the route is the right one, and that its positions state the longitude first.
    CheckRoute,
    /// Narrow the corridor, shorten the route, or name fewer layers.
    ReduceExport,
}
