//! `Crs`: a horizontal coordinate reference system.

use super::definition::{Definition, Method};
use super::epsg::{self, BuiltIn};
use super::error::CrsError;
use overfly_core::geodesy::{Geodetic, MercatorPoint, WORLD_M};
use proj4rs::Proj;
use proj4rs::transform::transform;

/// A horizontal coordinate reference system. `Send + Sync`; a projection costs about a microsecond.
#[derive(Clone)]
pub struct Crs {
    name: String,
    epsg: Option<u32>,
    error_m: f64,
    kind: CrsKind,
}

#[derive(Clone)]
enum CrsKind {
    /// Longitude and latitude in degrees, on a datum that is taken as WGS84.
    Degrees,
    /// Web Mercator, the projection of the tile matrix itself.
    WebMercator,
    /// Longitude and latitude in degrees on a shifted datum.
    ShiftedDegrees { here: Box<Proj>, wgs84: Box<Proj> },
    /// Plane coordinates in the CRS's unit.
    Projected { here: Box<Proj>, wgs84: Box<Proj> },
}

impl std::fmt::Debug for Crs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Crs").field("name", &self.name).field("error_m", &self.error_m).finish_non_exhaustive()
    }
}

impl Crs {
    /// Returns the CRS of an EPSG code.
    ///
    /// # Errors
    /// [`CrsError::UnknownCode`] for a code that is not a horizontal CRS of the table; [`CrsError::Refused`] for one
    /// that is known and cannot be projected correctly (NAD27 needs a grid, Krovak is 10 m off, ...).
    ///
    /// # Example
    /// PROJ 9.5.1 gives the same easting and northing (a row of `tests/reference/projections.csv`).
    /// ```
    /// use overfly_core::geodesy::Geodetic;
    /// use overfly_ingest::crs::Crs;
    ///
    /// let utm = Crs::from_epsg(32614)?;
    /// let point = Geodetic::from_degrees(48.1618323, -98.8988223)?;
    /// let (x, y) = utm.projected_from_geodetic(point)?;
    /// assert!((x - 507_523.766).abs() < 1e-3 && (y - 5_334_292.416).abs() < 1e-3);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn from_epsg(code: u32) -> Result<Self, CrsError> {
        let entry = epsg::look_up(code)?;
        let kind = match entry.built_in {
            Some(BuiltIn::Degrees) => CrsKind::Degrees,
            Some(BuiltIn::WebMercator) => CrsKind::WebMercator,
            None => Self::kind_from_proj_string(&entry.proj_string, &entry.name)?,
        };
        Ok(Self { name: format!("EPSG:{code} ({})", entry.name), epsg: Some(code), error_m: entry.error_m, kind })
    }

    /// Returns the CRS that its own parameters define.
    ///
    /// # Errors
    /// [`CrsError::Parameter`] for a parameter outside the method's domain, [`CrsError::Refused`] for a datum whose
    /// shift to WGS84 is not known.
    pub fn from_definition(definition: &Definition) -> Result<Self, CrsError> {
        let name = definition.name();
        let error_m = definition.datum.error_m(&name)?;
        let kind = match definition.method {
            Method::Geographic if definition.datum.is_null() => CrsKind::Degrees,
            _ => Self::kind_from_proj_string(&definition.proj_string()?, &name)?,
        };
        Ok(Self { name, epsg: None, error_m, kind })
    }

    fn kind_from_proj_string(text: &str, name: &str) -> Result<CrsKind, CrsError> {
        let unusable = |e: proj4rs::errors::Error| CrsError::Parameter { name: name.into(), reason: e.to_string() };
        let here = Box::new(Proj::from_proj_string(text).map_err(unusable)?);
        let wgs84 = Box::new(Proj::from_proj_string("+proj=longlat +datum=WGS84 +no_defs").map_err(unusable)?);
        Ok(if here.is_latlong() { CrsKind::ShiftedDegrees { here, wgs84 } } else { CrsKind::Projected { here, wgs84 } })
    }

    /// The name for people: "EPSG:26914 (NAD83 / UTM zone 14N)", "user-defined Transverse Mercator (GRS80)".
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The EPSG code, where the CRS was made from one.
    pub fn epsg(&self) -> Option<u32> {
        self.epsg
    }

    /// The standard deviation per axis that the datum shift adds, metres; 0 for WGS84 itself.
    pub fn error_m(&self) -> f64 {
        self.error_m
    }

    /// Metres in one unit of the plane coordinates; `None` for degrees.
    pub fn unit_m(&self) -> Option<f64> {
        match &self.kind {
            CrsKind::Degrees | CrsKind::ShiftedDegrees { .. } => None,
            CrsKind::WebMercator => Some(1.0),
            CrsKind::Projected { here, .. } => Some(here.to_meter()),
        }
    }

    /// Whether x and y are longitude and latitude in degrees.
    pub fn is_geographic(&self) -> bool {
        matches!(self.kind, CrsKind::Degrees | CrsKind::ShiftedDegrees { .. })
    }

    /// The period of x, after which a position repeats: 360 for degrees, the world's width for Web Mercator.
    pub fn period(&self) -> Option<f64> {
        match self.kind {
            CrsKind::Degrees | CrsKind::ShiftedDegrees { .. } => Some(360.0),
            CrsKind::WebMercator => Some(WORLD_M),
            CrsKind::Projected { .. } => None,
        }
    }

    /// Returns the WGS84 position of x, y: easting and northing in the CRS's unit, or longitude and latitude in degrees.
    ///
    /// # Errors
    /// [`CrsError::Outside`] where the projection has no such point, or a coordinate is not finite.
    pub fn geodetic_from_projected(&self, x: f64, y: f64) -> Result<Geodetic, CrsError> {
        let outside = || CrsError::Outside { name: self.name.clone(), x, y };
        if !(x.is_finite() && y.is_finite()) {
            return Err(outside());
        }
        let degrees = |x: f64, y: f64| Geodetic::from_degrees(y, (x + 180.0).rem_euclid(360.0) - 180.0);
        match &self.kind {
            CrsKind::Degrees => degrees(x, y).map_err(|_| outside()),
            CrsKind::WebMercator => MercatorPoint { x_m: x, y_m: y }.to_geodetic().map_err(|_| outside()),
            CrsKind::ShiftedDegrees { here, wgs84 } => {
                let start = degrees(x, y).map_err(|_| outside())?;
                let mut point = (start.longitude_rad(), start.latitude_rad(), 0.0);
                transform(here, wgs84, &mut point).map_err(|_| outside())?;
                Geodetic::from_radians(point.1, point.0).map_err(|_| outside())
            }
            CrsKind::Projected { here, wgs84 } => {
                let mut point = (x, y, 0.0);
                transform(here, wgs84, &mut point).map_err(|_| outside())?;
                Geodetic::from_radians(point.1, point.0).map_err(|_| outside())
            }
        }
    }

    /// Returns x, y of a WGS84 position: easting and northing in the CRS's unit, or longitude and latitude in degrees.
    ///
    /// # Errors
    /// [`CrsError::Outside`] where the position cannot be projected.
    pub fn projected_from_geodetic(&self, point: Geodetic) -> Result<(f64, f64), CrsError> {
        let outside =
            || CrsError::Outside { name: self.name.clone(), x: point.longitude_deg(), y: point.latitude_deg() };
        let (here, wgs84) = match &self.kind {
            CrsKind::Degrees => return Ok((point.longitude_deg(), point.latitude_deg())),
            CrsKind::WebMercator => {
                let m = MercatorPoint::from_geodetic(point).map_err(|_| outside())?;
                return Ok((m.x_m, m.y_m));
            }
            CrsKind::ShiftedDegrees { here, wgs84 } | CrsKind::Projected { here, wgs84 } => (here, wgs84),
        };
        let mut projected = (point.longitude_rad(), point.latitude_rad(), 0.0);
        transform(wgs84, here, &mut projected).map_err(|_| outside())?;
        let (x, y) = match self.kind {
            CrsKind::ShiftedDegrees { .. } => (projected.0.to_degrees(), projected.1.to_degrees()),
            _ => (projected.0, projected.1),
        };
        if x.is_finite() && y.is_finite() { Ok((x, y)) } else { Err(outside()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crs::datum::{DatumShift, Ellipsoid};

    /// EPSG:32614 by its parameters.
    fn utm_14() -> Definition {
        Definition {
            method: Method::TransverseMercator { scale: 0.9996 },
            origin_latitude_deg: 0.0,
            origin_longitude_deg: -99.0,
            false_easting: 500_000.0,
            false_northing: 0.0,
            unit_m: 1.0,
            ellipsoid: Ellipsoid::WGS84,
            datum: DatumShift::Null { error_m: 0.0 },
        }
    }

    #[test]
    fn utm_by_its_parameters_is_utm_by_its_code() {
        let point = Geodetic::from_degrees(47.02, -99.15).unwrap();
        let (x, y) = Crs::from_definition(&utm_14()).unwrap().projected_from_geodetic(point).unwrap();
        let (u, v) = Crs::from_epsg(32614).unwrap().projected_from_geodetic(point).unwrap();
        assert!((x - u).abs() < 1e-6 && (y - v).abs() < 1e-6);
    }

    #[test]
    fn feet_are_feet() {
        let foot_m = 1200.0 / 3937.0;
        let feet = Definition { unit_m: foot_m, false_easting: 500_000.0 / foot_m, ..utm_14() };
        let point = Geodetic::from_degrees(47.02, -99.15).unwrap();
        let (x, y) = Crs::from_definition(&feet).unwrap().projected_from_geodetic(point).unwrap();
        let (u, v) = Crs::from_epsg(32614).unwrap().projected_from_geodetic(point).unwrap();
        assert!((x * foot_m - u).abs() < 1e-6 && (y * foot_m - v).abs() < 1e-6);
    }

    #[test]
    fn refuses_parameters_that_make_no_projection() {
        for broken in [
            Definition { origin_latitude_deg: f64::NAN, ..utm_14() },
            Definition { unit_m: 0.0, ..utm_14() },
            Definition { method: Method::TransverseMercator { scale: -1.0 }, ..utm_14() },
            Definition { method: Method::Albers { parallel_1_deg: 20.0, parallel_2_deg: -20.0 }, ..utm_14() },
            Definition { method: Method::PolarStereographic { scale: 1.0 }, ..utm_14() },
            Definition { ellipsoid: Ellipsoid { semi_major_m: 1.0, inverse_flattening: 298.0 }, ..utm_14() },
        ] {
            assert_eq!(Crs::from_definition(&broken).unwrap_err().code(), "crs_parameter", "{broken:?}");
        }
    }
}
