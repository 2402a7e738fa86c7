//! Datums: the shift of a CRS's ellipsoid and frame to WGS84, and its accuracy.

use super::error::CrsError;
use crate::remedy::Remedy;

/// An ellipsoid of revolution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipsoid {
    /// Semi-major axis, metres.
    pub semi_major_m: f64,
    /// Inverse flattening; 0 for a sphere.
    pub inverse_flattening: f64,
}

impl Ellipsoid {
    /// WGS 84 (EPSG:7030).
    pub const WGS84: Self = Self { semi_major_m: 6_378_137.0, inverse_flattening: 298.257_223_563 };
    /// GRS 1980 (EPSG:7019); it differs from WGS 84 by 0.1 mm.
    pub const GRS80: Self = Self { semi_major_m: 6_378_137.0, inverse_flattening: 298.257_222_101 };

    /// Whether this is the ellipsoid of WGS84 or GRS80, within 1 mm at the poles.
    pub fn is_geocentric_modern(self) -> bool {
        (self.semi_major_m - 6_378_137.0).abs() < 1e-3 && (self.inverse_flattening - 298.257_223).abs() < 1e-5
    }
}

/// How coordinates on a datum are transformed to WGS84.
#[derive(Debug, Clone, PartialEq)]
pub enum DatumShift {
    /// Coordinates are taken as WGS84 unchanged.
    Null {
        /// The standard deviation per axis that this adds, metres.
        error_m: f64,
    },
    /// Three or seven Helmert parameters (position vector): metres, arc seconds, parts per million.
    Helmert {
        /// dx, dy, dz, rx, ry, rz, scale; the last four are 0 where only three are known.
        to_wgs84: [f64; 7],
        /// The standard deviation per axis of the shift, metres.
        error_m: f64,
    },
    /// The shift is not known.
    Unknown,
}

impl DatumShift {
    /// Returns the shift of a datum of which only the ellipsoid is known.
    pub fn from_ellipsoid(ellipsoid: Ellipsoid) -> Self {
        if ellipsoid.is_geocentric_modern() { Self::Null { error_m: OTHER_MODERN_ERROR_M } } else { Self::Unknown }
    }

    /// Returns the shift that a file states: dx, dy, dz in metres, rx, ry, rz in arc seconds, scale in parts per million.
    pub fn from_parameters(to_wgs84: [f64; 7]) -> Self {
        let error_m = if to_wgs84[3..].iter().any(|v| *v != 0.0) {
            STATED_SEVEN_PARAMETER_ERROR_M
        } else {
            STATED_THREE_PARAMETER_ERROR_M
        };
        Self::Helmert { to_wgs84, error_m }
    }

    /// Whether coordinates stay as they are.
    pub fn is_null(&self) -> bool {
        matches!(self, Self::Null { .. })
    }

    /// The standard deviation per axis of the shift, metres. `name` is the CRS that an error names.
    ///
    /// # Errors
    /// [`CrsError::Refused`] where the shift is not known.
    pub fn error_m(&self, name: &str) -> Result<f64, CrsError> {
        match self {
            Self::Null { error_m } | Self::Helmert { error_m, .. } => Ok(*error_m),
            Self::Unknown => Err(CrsError::Refused {
                name: name.into(),
                reason: "the shift of its datum to WGS 84 is not known".into(),
                remedy: Remedy::Reproject,
            }),
        }
    }
}

/// One row of [`DATUMS`].
pub(super) struct DatumRow {
    /// EPSG code of the datum (6xxx, as in GeoTIFF and WKT 1).
    pub code: u32,
    /// The standard deviation per axis of the shift to WGS84 that is available here, metres.
    pub error_m: f64,
}

/// The accuracy of the shifts used here: what EPSG states for the transformation named, or the known drift of the frame
/// where that is larger. An EPSG accuracy is taken as one standard deviation per axis, which errs on the side of caution.
#[rustfmt::skip]
pub(super) const DATUMS: &[DatumRow] = &[
    DatumRow { code: 6326, error_m: 0.0 }, // WGS 84 itself
    DatumRow { code: 6269, error_m: 1.0 }, // NAD83: null (EPSG:1188 says 4 m for all realisations); NAD83(2011) lies 1.0 to 1.6 m from ITRF2014 in the conterminous US (NGS, HTDP)
    DatumRow { code: 6152, error_m: 1.0 }, // NAD83(HARN): as NAD83
    DatumRow { code: 6140, error_m: 1.0 }, // NAD83(CSRS): as NAD83
    DatumRow { code: 6759, error_m: 1.0 }, // NAD83(NSRS2007): as NAD83
    DatumRow { code: 1116, error_m: 1.0 }, // NAD83(2011): as NAD83
    DatumRow { code: 6258, error_m: 1.0 }, // ETRS89: null, EPSG:1149, 1 m; drifts 2.5 cm a year since 1989
    DatumRow { code: 6171, error_m: 1.0 }, // RGF93: null, EPSG:1671, 1 m
    DatumRow { code: 6283, error_m: 3.0 }, // GDA94: null, EPSG:1150, 3 m; drifts 7 cm a year since 1994
    DatumRow { code: 1168, error_m: 3.0 }, // GDA2020: null, EPSG:8450, 3 m
    DatumRow { code: 6167, error_m: 1.0 }, // NZGD2000: null, EPSG:1565, 1 m
    DatumRow { code: 6277, error_m: 2.0 }, // OSGB36: Helmert, EPSG:1314, 2 m (the OSTN15 grid is not held here)
    DatumRow { code: 6314, error_m: 3.0 }, // DHDN: Helmert, EPSG:1777, 3 m (the BeTA2007 grid is not held here)
    DatumRow { code: 6150, error_m: 1.0 }, // CH1903+: three parameters, EPSG:1676, 1 m
    DatumRow { code: 6149, error_m: 2.0 }, // CH1903: three parameters; FINELTRA distortions of up to 1.5 m remain
    DatumRow { code: 6289, error_m: 1.0 }, // Amersfoort: Helmert, EPSG:4833, 1 m (the RDNAPTRANS grid is not held here)
    DatumRow { code: 6300, error_m: 1.0 }, // TM65, Geodetic Datum of 1965: Helmert, EPSG:1641, 1 m
    DatumRow { code: 6299, error_m: 1.0 }, // TM65: Helmert, EPSG:1641, 1 m
    DatumRow { code: 6313, error_m: 1.0 }, // Belge 1972: Helmert, EPSG:1609, 1 m
    DatumRow { code: 6272, error_m: 4.0 }, // NZGD49: Helmert, EPSG:1564, 4 m
    DatumRow { code: 6230, error_m: 10.0 }, // ED50: mean shift, EPSG:1133, 10 m
];

/// The error of a datum on GRS80 or WGS84 that [`DATUMS`] does not list: modern geocentric frames differ by plate motion
/// since their epoch, at most 7 cm a year over some 40 years.
pub(super) const OTHER_MODERN_ERROR_M: f64 = 3.0;
/// The error of seven parameters that a file states; EPSG states 1 to 10 m for such.
const STATED_SEVEN_PARAMETER_ERROR_M: f64 = 5.0;
/// The error of three parameters that a file states; EPSG states 5 to 44 m for such.
const STATED_THREE_PARAMETER_ERROR_M: f64 = 15.0;

/// The error of a datum by its EPSG code, metres; `None` for a datum that [`DATUMS`] does not list.
pub(super) fn datum_error_m(code: u32) -> Option<f64> {
    DATUMS.iter().find(|row| row.code == code).map(|row| row.error_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knows_the_modern_ellipsoids_from_the_old() {
        assert!(Ellipsoid::WGS84.is_geocentric_modern() && Ellipsoid::GRS80.is_geocentric_modern());
        let clarke_1866 = Ellipsoid { semi_major_m: 6_378_206.4, inverse_flattening: 294.978_698_2 };
        assert!(!clarke_1866.is_geocentric_modern());
    }

    #[test]
    fn refuses_an_unknown_datum_by_name() {
        let refusal = DatumShift::Unknown.error_m("Moon 2000").unwrap_err();
        assert_eq!(refusal.code(), "crs_refused");
        assert!(refusal.to_string().contains("Moon 2000"));
        assert_eq!(refusal.remedy(), Some(Remedy::Reproject));
    }
}
