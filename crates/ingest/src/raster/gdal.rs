//! Formats that GDAL reads (JPEG 2000, VRT, ECW, LZMA in TIFF), behind the cargo feature `gdal`.

use super::affine::Affine;
use super::block::{BlockSource, PixelBlock, RasterLevel};
use super::error::RasterError;
use super::options::OpenOptions;
use crate::crs::Crs;
use gdal::Dataset;
use gdal::raster::{ColorInterpretation, GdalDataType, RasterBand};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Edge of the blocks that are read.
const BLOCK_PX: u64 = 512;

/// A dataset with one read at a time: GDAL's handles may move between threads, but not be shared.
pub(super) struct GdalSource {
    path: PathBuf,
    dataset: Mutex<Dataset>,
    levels: Vec<RasterLevel>,
    bands: GdalBands,
    stretch: Option<(f64, f64)>,
}

/// The bands that become colours, counted from 1.
enum GdalBands {
    Gray(usize),
    Rgb([usize; 3]),
    Palette(Vec<[u8; 3]>),
}

impl GdalSource {
    /// Opens a dataset and finds its bands.
    ///
    /// # Errors
    /// [`RasterError`] for a file that GDAL cannot open, and for more than 8 bits without a stretch.
    pub fn open(path: &Path, options: &OpenOptions) -> Result<Self, RasterError> {
        let failed = |e: gdal::errors::GdalError| failed(path, &e);
        let dataset = Dataset::open(path).map_err(failed)?;
        if dataset.raster_count() == 0 {
            return Err(RasterError::Format { path: path.into(), reason: "GDAL finds no image in it".into() });
        }
        let first = dataset.rasterband(1).map_err(failed)?;
        let stretch = match (options.stretch, first.band_type()) {
            (Some((low, high)), _) if !(low.is_finite() && high.is_finite() && low < high) => {
                return Err(RasterError::BadStretch { path: path.into(), low, high });
            }
            (None, kind) if kind != GdalDataType::UInt8 => {
                return Err(RasterError::NeedsStretch { path: path.into(), samples: kind.name() });
            }
            (stretch, _) => stretch,
        };
        let mut levels = vec![level(first.size())];
        for i in 0..first.overview_count().map_err(failed)?.max(0) as usize {
            levels.push(level(first.overview(i).map_err(failed)?.size()));
        }
        let bands = bands(&dataset).map_err(failed)?;
        Ok(Self { path: path.into(), dataset: Mutex::new(dataset), levels, bands, stretch })
    }

    /// GDAL's name of the format: "JP2OpenJPEG", "VRT", ...
    pub fn format_name(&self) -> String {
        self.dataset.lock().unwrap_or_else(PoisonError::into_inner).driver().short_name()
    }

    /// Returns the geotransform, and the CRS where GDAL knows its EPSG code.
    ///
    /// # Errors
    /// [`RasterError::Crs`] where that code is refused, [`RasterError::NoCrs`] for a CRS without a code.
    pub fn placement(&self, crs_is_given: bool) -> Result<(Option<Affine>, Option<Crs>), RasterError> {
        let dataset = self.dataset.lock().unwrap_or_else(PoisonError::into_inner);
        let affine = dataset.geo_transform().ok().map(|t| Affine {
            origin: [t[0], t[3]],
            column: [t[1], t[4]],
            row: [t[2], t[5]],
        });
        if crs_is_given {
            return Ok((affine, None));
        }
        let Ok(reference) = dataset.spatial_ref() else { return Ok((affine, None)) };
        match (reference.auth_name().as_deref(), reference.auth_code()) {
            (Some("EPSG"), Ok(code)) => {
                let crs = Crs::from_epsg(code as u32).map_err(|e| RasterError::crs(&self.path, e))?;
                Ok((affine, Some(crs)))
            }
            _ => {
                let detail = format!(" by an EPSG code (it is '{}')", reference.name().unwrap_or_default());
                Err(RasterError::NoCrs { path: self.path.clone(), detail })
            }
        }
    }

    fn read_window(
        &self,
        level: usize,
        x: u64,
        y: u64,
        width: usize,
        height: usize,
    ) -> gdal::errors::Result<PixelBlock> {
        let dataset = self.dataset.lock().unwrap_or_else(PoisonError::into_inner);
        let (window, size) = ((x as isize, y as isize), (width, height));
        let read = |band: &RasterBand<'_>| -> gdal::errors::Result<Vec<u8>> {
            let Some((low, high)) = self.stretch else {
                return Ok(band.read_as::<u8>(window, size, size, None)?.data().to_vec());
            };
            let values = band.read_as::<f64>(window, size, size, None)?;
            Ok(values.data().iter().map(|v| ((v - low) / (high - low) * 255.0 + 0.5) as u8).collect())
        };
        let numbers = match &self.bands {
            GdalBands::Rgb(numbers) => numbers.to_vec(),
            GdalBands::Gray(number) => vec![*number],
            GdalBands::Palette(_) => vec![1],
        };
        let mut planes = Vec::new();
        let mut validity = vec![0u8; width * height];
        for number in numbers {
            let band = dataset.rasterband(number)?;
            let band = if level == 0 { band } else { band.overview(level - 1)? };
            planes.push(read(&band)?);
            // GDAL's mask band combines no-data values, alpha and masks. A pixel is valid where any band is.
            let mask = band.open_mask_band()?.read_as::<u8>(window, size, size, None)?;
            validity.iter_mut().zip(mask.data()).for_each(|(v, m)| *v |= if *m >= 128 { 255 } else { 0 });
        }
        let mut data = Vec::with_capacity(width * height * 4);
        for (i, valid) in validity.iter().enumerate() {
            let colour = match &self.bands {
                GdalBands::Palette(colours) => colours.get(usize::from(planes[0][i])).copied().unwrap_or_default(),
                GdalBands::Gray(_) => [planes[0][i]; 3],
                GdalBands::Rgb(_) => [planes[0][i], planes[1][i], planes[2][i]],
            };
            data.extend(if *valid == 0 { [0; 4] } else { [colour[0], colour[1], colour[2], 255] });
        }
        Ok(PixelBlock { width_px: width, height_px: height, channels: 4, data })
    }
}

impl BlockSource for GdalSource {
    fn levels(&self) -> &[RasterLevel] {
        &self.levels
    }

    fn decodes_alone(&self) -> bool {
        true
    }

    fn read(&self, level: usize, column: u64, row: u64) -> Result<PixelBlock, RasterError> {
        let RasterLevel { width_px, height_px, .. } = self.levels[level];
        let (x, y) = (column * BLOCK_PX, row * BLOCK_PX);
        let (width, height) = (BLOCK_PX.min(width_px - x) as usize, BLOCK_PX.min(height_px - y) as usize);
        self.read_window(level, x, y, width, height).map_err(|e| RasterError::damaged(&self.path, e.to_string()))
    }
}

fn failed(path: &Path, error: &gdal::errors::GdalError) -> RasterError {
    RasterError::Format { path: path.into(), reason: error.to_string() }
}

fn level((width, height): (usize, usize)) -> RasterLevel {
    RasterLevel {
        width_px: width as u64,
        height_px: height as u64,
        block_width_px: BLOCK_PX,
        block_height_px: BLOCK_PX,
    }
}

/// Returns the bands by their colours, else the first three, else the first.
fn bands(dataset: &Dataset) -> gdal::errors::Result<GdalBands> {
    let mut rgb = [0; 3];
    for number in 1..=dataset.raster_count() {
        match dataset.rasterband(number)?.color_interpretation() {
            ColorInterpretation::RedBand => rgb[0] = number,
            ColorInterpretation::GreenBand => rgb[1] = number,
            ColorInterpretation::BlueBand => rgb[2] = number,
            _ => {}
        }
    }
    let first = dataset.rasterband(1)?;
    if let Some(table) = first.color_table() {
        let colours =
            (0..table.entry_count()).filter_map(|i| table.entry_as_rgb(i)).map(|c| [c.r, c.g, c.b].map(|v| v as u8));
        return Ok(GdalBands::Palette(colours.collect()));
    }
    Ok(match (rgb.contains(&0), dataset.raster_count()) {
        (false, _) => GdalBands::Rgb(rgb),
        (true, 3..) => GdalBands::Rgb([1, 2, 3]),
        _ => GdalBands::Gray(1),
    })
}
