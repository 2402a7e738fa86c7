//! Positions, directions and frames on the WGS84 ellipsoid.
//!
//! Angles are radians; degrees only appear in constructors, accessors and fields named `*_deg`. No I/O. A coordinate
//! reference system other than WGS84 and Web Mercator is the ingest side's concern.

mod body;
mod bounds;
mod covariance;
mod enu;
mod error;
mod geodesic;
mod geodetic;
mod geoid;
mod heading;
mod mercator;
mod wgs84;
mod world;

pub use body::{BodyFrame, BodyOffset};
pub use bounds::{GeodeticBounds, bounds_as_array};
pub use covariance::{CHI_SQUARE_95, CHI_SQUARE_999, CHI_SQUARE_9999, EnuCovariance, ErrorEllipse};
pub use enu::{Enu, LocalFrame};
pub use error::GeodesyError;
pub use geodesic::{Geodesic, destination, geodesic_between};
pub use geodetic::Geodetic;
pub use geoid::VerticalDatum;
pub use heading::{Heading, wrap_turn_rad};
pub use mercator::{GroundScale, MercatorPoint, degrees_from_mercator, ground_scale};
pub use wgs84::{ECCENTRICITY_SQUARED, FLATTENING, SEMI_MAJOR_M, SEMI_MINOR_M, meridian_radius_m, normal_radius_m};
pub use world::{MAX_LATITUDE_DEG, WORLD_M};
