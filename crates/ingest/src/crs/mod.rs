//! `Crs`: a coordinate reference system, and positions through it to WGS84 and back.
//!
//! Projections are `proj4rs`'s; parameters come from an EPSG code or a [`Definition`]. What cannot be projected
//! truthfully is refused by name. No I/O: who reads a CRS out of a file lives in `raster`.

mod datum;
mod definition;
mod epsg;
mod error;

pub use datum::{DatumShift, Ellipsoid};
pub use definition::{Definition, Method};
pub use error::CrsError;

use overfly_core::geodesy::{Geodetic, MercatorPoint, WORLD_M};
use proj4rs::Proj;
use proj4rs::transform::transform;

/// A horizontal coordinate reference system. `Send + Sync`; a projection costs about a microsecond.
#[derive(Clone)]
pub struct Crs {
    name: String,
    epsg: Option<u32>,
    error_m: f64,
    kind: Kind,
}

#[derive(Clone)]
enum Kind {
    /// Longitude and latitude in degrees, on a datum taken as WGS84.
    Degrees,
    /// Web Mercator, exactly the tile matrix's own.
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
    /// The CRS of an EPSG code.
    ///
    /// # Errors
    /// [`CrsError::UnknownCode`] for a code that is not a horizontal CRS of the table; [`CrsError::Refused`] for one
    /// that is known and cannot be projected truthfully (NAD27 needs a grid, Krovak is 10 m off, ...).
    ///
    /// # Example
    /// PROJ 9: `echo 47 -99 | cs2cs EPSG:4326 EPSG:32614` says 500000.00 5205164.11.
    /// ```
    /// use crate::crs::Crs;
    /// use overfly_core::geodesy::Geodetic;
    /// let utm = Crs::from_epsg(32614).unwrap();
    /// let (x, y) = utm.projected_from_geodetic(Geodetic::from_degrees(47.0, -99.0).unwrap()).unwrap();
    /// assert!((x - 500_000.0).abs() < 1e-3 && (y - 5_205_164.11).abs() < 0.01, "{x} {y}");
    /// ```
    pub fn from_epsg(code: u32) -> Result<Self, CrsError> {
        let entry = epsg::look_up(code)?;
        let kind = match entry.plain {
            Some(epsg::Plain::Degrees) => Kind::Degrees,
            Some(epsg::Plain::WebMercator) => Kind::WebMercator,
            None => Self::kind_from_proj_string(&entry.proj_string, &entry.name)?,
        };
        Ok(Self { name: format!("EPSG:{code} ({})", entry.name), epsg: Some(code), error_m: entry.error_m, kind })
    }

    /// The CRS of parameters that no code names.
    ///
    /// # Errors
    /// [`CrsError::Parameter`] for a parameter that makes no such projection, [`CrsError::Refused`] for a datum whose
    /// shift to WGS84 is not known.
    pub fn from_definition(definition: &Definition) -> Result<Self, CrsError> {
        let name = definition.name();
        let error_m = definition.datum.error_m(&name)?;
        let kind = match definition.method {
            Method::Geographic if definition.datum.is_null() => Kind::Degrees,
            _ => Self::kind_from_proj_string(&definition.proj_string()?, &name)?,
        };
        Ok(Self { name, epsg: None, error_m, kind })
    }

    fn kind_from_proj_string(text: &str, name: &str) -> Result<Kind, CrsError> {
        let unusable = |e: proj4rs::errors::Error| CrsError::Parameter { name: name.into(), reason: e.to_string() };
        let here = Box::new(Proj::from_proj_string(text).map_err(unusable)?);
        let wgs84 = Box::new(Proj::from_proj_string("+proj=longlat +datum=WGS84 +no_defs").map_err(unusable)?);
        Ok(if here.is_latlong() { Kind::ShiftedDegrees { here, wgs84 } } else { Kind::Projected { here, wgs84 } })
    }

    /// For people: "EPSG:26914 (NAD83 / UTM zone 14N)", "user-defined Transverse Mercator (GRS80)".
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its EPSG code, where it was made from one.
    pub fn epsg(&self) -> Option<u32> {
        self.epsg
    }

    /// One standard deviation per axis that its datum's shift adds, metres; 0 for WGS84 itself.
    pub fn error_m(&self) -> f64 {
        self.error_m
    }

    /// Metres in one unit of its plane coordinates; `None` for degrees.
    pub fn unit_m(&self) -> Option<f64> {
        match &self.kind {
            Kind::Degrees | Kind::ShiftedDegrees { .. } => None,
            Kind::WebMercator => Some(1.0),
            Kind::Projected { here, .. } => Some(here.to_meter()),
        }
    }

    /// Whether x and y are longitude and latitude in degrees.
    pub fn is_geographic(&self) -> bool {
        matches!(self.kind, Kind::Degrees | Kind::ShiftedDegrees { .. })
    }

    /// What may be added to x without changing the place: 360 for degrees, the world's width for Web Mercator.
    pub fn period(&self) -> Option<f64> {
        match self.kind {
            Kind::Degrees | Kind::ShiftedDegrees { .. } => Some(360.0),
            Kind::WebMercator => Some(WORLD_M),
            Kind::Projected { .. } => None,
        }
    }

    /// The point at x, y: easting and northing in the CRS's own unit, or longitude and latitude in degrees.
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
            Kind::Degrees => degrees(x, y).map_err(|_| outside()),
            Kind::WebMercator => MercatorPoint { x_m: x, y_m: y }.to_geodetic().map_err(|_| outside()),
            Kind::ShiftedDegrees { here, wgs84 } => {
                let start = degrees(x, y).map_err(|_| outside())?;
                let mut point = (start.longitude_rad(), start.latitude_rad(), 0.0);
                transform(here, wgs84, &mut point).map_err(|_| outside())?;
                Geodetic::from_radians(point.1, point.0).map_err(|_| outside())
            }
            Kind::Projected { here, wgs84 } => {
                let mut point = (x, y, 0.0);
                transform(here, wgs84, &mut point).map_err(|_| outside())?;
                Geodetic::from_radians(point.1, point.0).map_err(|_| outside())
            }
        }
    }

    /// x, y of a point: easting and northing in the CRS's own unit, or longitude and latitude in degrees.
    ///
    /// # Errors
    /// [`CrsError::Outside`] where the point cannot be projected.
    pub fn projected_from_geodetic(&self, point: Geodetic) -> Result<(f64, f64), CrsError> {
        let outside =
            || CrsError::Outside { name: self.name.clone(), x: point.longitude_deg(), y: point.latitude_deg() };
        let (here, wgs84) = match &self.kind {
            Kind::Degrees => return Ok((point.longitude_deg(), point.latitude_deg())),
            Kind::WebMercator => {
                let m = MercatorPoint::from_geodetic(point).map_err(|_| outside())?;
                return Ok((m.x_m, m.y_m));
            }
            Kind::ShiftedDegrees { here, wgs84 } | Kind::Projected { here, wgs84 } => (here, wgs84),
        };
        let mut projected = (point.longitude_rad(), point.latitude_rad(), 0.0);
        transform(wgs84, here, &mut projected).map_err(|_| outside())?;
        let (x, y) = match self.kind {
            Kind::ShiftedDegrees { .. } => (projected.0.to_degrees(), projected.1.to_degrees()),
            _ => (projected.0, projected.1),
        };
        if x.is_finite() && y.is_finite() { Ok((x, y)) } else { Err(outside()) }
    }
}
