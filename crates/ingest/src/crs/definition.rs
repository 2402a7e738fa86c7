//! `Definition`: a CRS by its parameters, as GeoTIFF keys can state it.

use super::datum::{DatumShift, Ellipsoid};
use super::error::CrsError;
use std::fmt::Write;

/// A map projection and its own parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// No projection: coordinates are longitude and latitude in degrees.
    Geographic,
    /// Transverse Mercator (EPSG method 9807).
    TransverseMercator {
        /// Scale factor at the natural origin.
        scale: f64,
    },
    /// Lambert conformal conic, one standard parallel: the latitude of origin (EPSG method 9801).
    LambertConformal1 {
        /// Scale factor at the natural origin.
        scale: f64,
    },
    /// Lambert conformal conic, two standard parallels (EPSG method 9802).
    LambertConformal2 {
        /// First standard parallel, degrees.
        parallel_1_deg: f64,
        /// Second standard parallel, degrees.
        parallel_2_deg: f64,
    },
    /// Albers equal area (EPSG method 9822).
    Albers {
        /// First standard parallel, degrees.
        parallel_1_deg: f64,
        /// Second standard parallel, degrees.
        parallel_2_deg: f64,
    },
    /// Lambert azimuthal equal area (EPSG method 9820).
    LambertAzimuthalEqualArea,
    /// Mercator on the ellipsoid, variant A (EPSG method 9804); its origin lies on the equator.
    Mercator {
        /// Scale factor at the equator.
        scale: f64,
    },
    /// Polar stereographic, variant A (EPSG method 9810); its origin is a pole.
    PolarStereographic {
        /// Scale factor at the pole.
        scale: f64,
    },
}

/// A user-defined CRS.
#[derive(Debug, Clone, PartialEq)]
pub struct Definition {
    /// The projection.
    pub method: Method,
    /// Latitude of the origin, degrees.
    pub origin_latitude_deg: f64,
    /// Longitude of the origin (central meridian) from Greenwich, degrees.
    pub origin_longitude_deg: f64,
    /// Easting of the origin, in the CRS's unit.
    pub false_easting: f64,
    /// Northing of the origin, in the CRS's unit.
    pub false_northing: f64,
    /// Metres in one unit of the CRS: 1, 0.3048, 1200 / 3937, ...
    pub unit_m: f64,
    /// The ellipsoid.
    pub ellipsoid: Ellipsoid,
    /// The shift of its datum to WGS84.
    pub datum: DatumShift,
}

impl Definition {
    /// The name for people, such as "user-defined Transverse Mercator".
    pub fn name(&self) -> String {
        let method = match self.method {
            Method::Geographic => "geographic system",
            Method::TransverseMercator { .. } => "Transverse Mercator",
            Method::LambertConformal1 { .. } | Method::LambertConformal2 { .. } => "Lambert Conformal Conic",
            Method::Albers { .. } => "Albers Equal Area",
            Method::LambertAzimuthalEqualArea => "Lambert Azimuthal Equal Area",
            Method::Mercator { .. } => "Mercator",
            Method::PolarStereographic { .. } => "Polar Stereographic",
        };
        format!("user-defined {method}")
    }

    /// Returns the definition as a PROJ string.
    ///
    /// # Errors
    /// [`CrsError::Parameter`] where a parameter is not finite or outside its range.
    pub(super) fn proj_string(&self) -> Result<String, CrsError> {
        self.check()?;
        let (lat0, lon0) = (self.origin_latitude_deg, self.origin_longitude_deg);
        let mut text = match self.method {
            Method::Geographic => "+proj=longlat".to_string(),
            Method::TransverseMercator { scale } => format!("+proj=tmerc +lat_0={lat0} +lon_0={lon0} +k_0={scale}"),
            Method::LambertConformal1 { scale } => {
                format!("+proj=lcc +lat_1={lat0} +lat_0={lat0} +lon_0={lon0} +k_0={scale}")
            }
            Method::LambertConformal2 { parallel_1_deg, parallel_2_deg } => {
                format!("+proj=lcc +lat_1={parallel_1_deg} +lat_2={parallel_2_deg} +lat_0={lat0} +lon_0={lon0}")
            }
            Method::Albers { parallel_1_deg, parallel_2_deg } => {
                format!("+proj=aea +lat_1={parallel_1_deg} +lat_2={parallel_2_deg} +lat_0={lat0} +lon_0={lon0}")
            }
            Method::LambertAzimuthalEqualArea => format!("+proj=laea +lat_0={lat0} +lon_0={lon0}"),
            Method::Mercator { scale } => format!("+proj=merc +lon_0={lon0} +k_0={scale}"),
            Method::PolarStereographic { scale } => {
                format!("+proj=stere +lat_0={lat0} +lon_0={lon0} +k_0={scale}")
            }
        };
        let mut add = |words: std::fmt::Arguments<'_>| text.write_fmt(words).expect("a String takes any text");
        if self.method != Method::Geographic {
            let (x0_m, y0_m) = (self.false_easting * self.unit_m, self.false_northing * self.unit_m);
            add(format_args!(" +x_0={x0_m} +y_0={y0_m} +to_meter={}", self.unit_m));
        }
        add(format_args!(" +a={} +rf={}", self.ellipsoid.semi_major_m, self.ellipsoid.inverse_flattening));
        if let DatumShift::Helmert { to_wgs84: p, .. } = &self.datum {
            add(format_args!(" +towgs84={},{},{},{},{},{},{}", p[0], p[1], p[2], p[3], p[4], p[5], p[6]));
        }
        Ok(text)
    }

    fn check(&self) -> Result<(), CrsError> {
        let refuse = |reason: String| Err(CrsError::Parameter { name: self.name(), reason });
        let (scale, parallels) = match self.method {
            Method::Geographic | Method::LambertAzimuthalEqualArea => (1.0, [0.0; 2]),
            Method::TransverseMercator { scale }
            | Method::LambertConformal1 { scale }
            | Method::Mercator { scale }
            | Method::PolarStereographic { scale } => (scale, [0.0; 2]),
            Method::LambertConformal2 { parallel_1_deg, parallel_2_deg }
            | Method::Albers { parallel_1_deg, parallel_2_deg } => (1.0, [parallel_1_deg, parallel_2_deg]),
        };
        let [p1, p2] = parallels;
        for (what, value, limit) in [
            ("latitude of origin", self.origin_latitude_deg, 90.0),
            ("central meridian", self.origin_longitude_deg, 360.0),
            ("first standard parallel", p1, 90.0),
            ("second standard parallel", p2, 90.0),
            ("false easting", self.false_easting, 1e9),
            ("false northing", self.false_northing, 1e9),
        ] {
            if value.is_nan() || value.abs() > limit {
                return refuse(format!("its {what} is {value}, not a number within {limit} of zero"));
            }
        }
        if !(0.1..=10.0).contains(&scale) {
            return refuse(format!("its scale factor is {scale}, not in [0.1, 10]"));
        }
        if !(1e-3..=1e5).contains(&self.unit_m) {
            return refuse(format!("its unit is {} m", self.unit_m));
        }
        let Ellipsoid { semi_major_m, inverse_flattening } = self.ellipsoid;
        if !((6.3e6..=6.4e6).contains(&semi_major_m) && (200.0..=400.0).contains(&inverse_flattening)) {
            return refuse(format!(
                "its ellipsoid (a = {semi_major_m} m, 1/f = {inverse_flattening}) is not the earth's"
            ));
        }
        match self.method {
            Method::LambertConformal1 { .. } if self.origin_latitude_deg.abs() < 0.01 => {
                refuse("a cone needs a latitude of origin off the equator".into())
            }
            Method::LambertConformal2 { .. } | Method::Albers { .. } if (p1 + p2).abs() < 0.01 => {
                refuse(format!("the parallels {p1} and {p2} make no cone"))
            }
            Method::PolarStereographic { .. } if self.origin_latitude_deg.abs() != 90.0 => {
                refuse(format!("its origin lies at {} degrees, not at a pole", self.origin_latitude_deg))
            }
            Method::Mercator { .. } if self.origin_latitude_deg != 0.0 => {
                refuse(format!("its origin lies at {} degrees, not on the equator", self.origin_latitude_deg))
            }
            _ => Ok(()),
        }
    }
}
