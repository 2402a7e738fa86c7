//! `Calibration`: measured times and drifts of registrations on one machine, and the model constants for a camera.

use super::error::{not_negative, positive};
use super::{CouplingError, DriftLaw, RelativeCost, seconds_per_image};
use serde::{Deserialize, Serialize};

/// The measured constants of one machine. Times are seconds. Drifts are pixels, so that they apply at every height.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// The images on which the times were measured.
    pub images: CalibratedImages,
    /// Time of a relative registration of those images (42 to 45).
    pub relative: RelativeCost,
    /// Drift of a relative registration as a function of its matched descriptors.
    pub drift: PixelDriftLaw,
    /// Time of a search as a function of its tiles.
    pub search: SearchCost,
}

/// The images of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibratedImages {
    /// Edge of the square images, pixels. `load_s` grows with the pixels of an image, `estimate_s` with the compared pixels.
    pub edge_px: f64,
    /// Largest edge (square root of the area) at which images are compared, pixels. Larger images are reduced by a whole
    /// factor.
    pub most_compared_edge_px: f64,
    /// N: descriptors per image in a relative registration.
    pub descriptor_count: f64,
    /// n: matched descriptors that agree (inliers).
    pub matched_count: f64,
}

/// The drift law D_U = sqrt(floor^2 + pair^2 / n), in pixels of the compared images.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PixelDriftLaw {
    /// Drift of a registration by a single pair, pixels.
    pub pair_drift_px: f64,
    /// Drift that no number of pairs averages out, pixels.
    pub floor_px: f64,
}

/// The search time t_exe = constant + K1 tiles, in tiles of the store.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchCost {
    /// K1 per searched base tile of the store, seconds.
    pub seconds_per_store_tile: f64,
    /// The part of the time that does not depend on the number of tiles, seconds.
    pub search_constant_s: f64,
    /// Edge of a tile, pixels of the map.
    pub tile_px: f64,
}

impl Calibration {
    /// Default constants, measured on an idle core of a Xeon server with the demo's imagery.
    pub const PROJECT: Self = Self {
        images: CalibratedImages {
            edge_px: 512.0,
            most_compared_edge_px: 720.0,
            descriptor_count: 595.0,
            matched_count: 79.0,
        },
        relative: RelativeCost {
            seconds_per_descriptor: 1.6e-6,
            load_s: 6.1e-3,
            pair_comparison_s: 3.5e-9,
            threshold_s_per_descriptor: 1.0e-6,
            estimate_s: 1.9e-3,
        },
        drift: PixelDriftLaw { pair_drift_px: 0.084, floor_px: 0.0033 },
        search: SearchCost { seconds_per_store_tile: 4.5e-4, search_constant_s: 0.011, tile_px: 512.0 },
    };

    /// Checks that all values lie in the models' domain.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`] with the first field that does not.
    pub fn check(&self) -> Result<(), CouplingError> {
        positive("edge_px", self.images.edge_px)?;
        positive("most_compared_edge_px", self.images.most_compared_edge_px)?;
        positive("descriptor_count", self.images.descriptor_count)?;
        positive("pair_drift_px", self.drift.pair_drift_px.max(self.drift.floor_px))?;
        self.drift.in_metres(1.0)?.unit_drift_m(self.images.matched_count)?;
        positive("seconds_per_store_tile", self.search.seconds_per_store_tile)?;
        not_negative("search_constant_s", self.search.search_constant_s)?;
        positive("tile_px", self.search.tile_px)?;
        self.relative.total_s(self.images.descriptor_count)?;
        Ok(())
    }

    /// The whole factor, at least 1, by which images of `width_px` by `height_px` are reduced before they are compared.
    pub fn shrinking(&self, width_px: f64, height_px: f64) -> f64 {
        ((width_px * height_px).sqrt() / self.images.most_compared_edge_px).ceil().max(1.0)
    }

    /// The constants of relative registration for images of `width_px` by `height_px`. The loading time is proportional to the
    /// image's pixels and the estimation time to the compared pixels; the times per descriptor do not change.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    pub fn relative_cost(&self, width_px: f64, height_px: f64) -> Result<RelativeCost, CouplingError> {
        let pixels = positive("width_px", width_px)? * positive("height_px", height_px)?;
        let ratio = pixels / positive("edge_px", self.images.edge_px)?.powi(2);
        let compared = ratio / self.shrinking(width_px, height_px).powi(2);
        let base = self.relative;
        Ok(RelativeCost { load_s: base.load_s * ratio, estimate_s: base.estimate_s * compared, ..base })
    }

    /// t0 of (9), seconds: the time of a relative registration of images of `width_px` by `height_px` with this calibration's
    /// number of descriptors.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    ///
    /// # References
    /// Equation 45.
    pub fn relative_s(&self, width_px: f64, height_px: f64) -> Result<f64, CouplingError> {
        self.relative_cost(width_px, height_px)?.total_s(self.images.descriptor_count)
    }

    /// D_U, metres, for images of `width_px` by `height_px` at `gsd_m_per_px` with `matched_count` matches.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    ///
    /// # Example
    /// Images of twice the largest compared edge are compared at half their size: a pixel of drift is two of their pixels.
    /// ```
    /// let c = overfly_core::coupling::Calibration::PROJECT;
    /// let [small, large] = [720.0, 1440.0].map(|edge| c.unit_drift_m(edge, edge, 0.5, 100.0).unwrap());
    /// assert!((large / small - 2.0).abs() < 1e-12);
    /// ```
    pub fn unit_drift_m(
        &self,
        width_px: f64,
        height_px: f64,
        gsd_m_per_px: f64,
        matched_count: f64,
    ) -> Result<f64, CouplingError> {
        let compared_m = positive("gsd_m_per_px", gsd_m_per_px)? * self.shrinking(width_px, height_px);
        self.drift.in_metres(compared_m)?.unit_drift_m(matched_count)
    }

    /// K1 of (4), seconds per image of `across_m` by `along_m`, for a map of `map_gsd_m_per_px`.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    pub fn seconds_per_image(&self, map_gsd_m_per_px: f64, across_m: f64, along_m: f64) -> Result<f64, CouplingError> {
        let tile_m = positive("tile_px", self.search.tile_px)? * positive("map_gsd_m_per_px", map_gsd_m_per_px)?;
        seconds_per_image(self.search.seconds_per_store_tile, tile_m, across_m, along_m)
    }
}

impl PixelDriftLaw {
    /// D_U, pixels, with `matched_count` matches: sqrt(floor^2 + pair^2 / n).
    ///
    /// # Example
    /// ```
    /// let law = overfly_core::coupling::PixelDriftLaw { pair_drift_px: 4.0, floor_px: 0.3 };
    /// assert!((law.drift_px(100.0) - 0.5).abs() < 1e-12);
    /// ```
    pub fn drift_px(&self, matched_count: f64) -> f64 {
        self.floor_px.hypot(self.pair_drift_px / matched_count.sqrt())
    }

    /// The law in metres on the ground, for pixels of `m_per_px`.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`].
    pub fn in_metres(&self, m_per_px: f64) -> Result<DriftLaw, CouplingError> {
        let m_per_px = positive("m_per_px", m_per_px)?;
        Ok(DriftLaw {
            pair_drift_m: not_negative("pair_drift_px", self.pair_drift_px)? * m_per_px,
            floor_m: not_negative("floor_px", self.floor_px)? * m_per_px,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_projects_constants_are_in_domain_and_a_missing_match_is_named() {
        assert_eq!(Calibration::PROJECT.check(), Ok(()));
        let mut none = Calibration::PROJECT;
        none.images.matched_count = 0.0;
        let Err(CouplingError::OutOfDomain { name, .. }) = none.check() else { panic!("accepted no match") };
        assert_eq!(name, "matched_count");
        let mut still = Calibration::PROJECT;
        still.search.seconds_per_store_tile = f64::NAN;
        assert!(still.check().is_err());
    }

    #[test]
    fn a_search_of_an_image_costs_as_many_tiles_as_it_covers() {
        // 1024 x 512 m of a map of 0.5 m/px, whose tiles are 256 m wide, are eight tiles.
        let k1_s = Calibration::PROJECT.seconds_per_image(0.5, 1024.0, 512.0).unwrap();
        assert!((k1_s / Calibration::PROJECT.search.seconds_per_store_tile - 8.0).abs() < 1e-9);
    }

    #[test]
    fn an_image_of_four_times_the_pixels_loads_four_times_as_long_and_is_compared_at_half_its_size() {
        let c = Calibration::PROJECT;
        let cost = c.relative_cost(1024.0, 1024.0).unwrap();
        assert!((cost.load_s / c.relative.load_s - 4.0).abs() < 1e-12 && c.shrinking(1024.0, 1024.0) == 2.0);
        assert!((cost.estimate_s / c.relative.estimate_s - 1.0).abs() < 1e-12);
    }
}
