//! `GeodeticBounds`: an extent in degrees that may cross the antimeridian.

use super::{GeodesyError, Geodetic};
use serde::Serialize;

/// An extent in degrees, from west to east. West above east means that the extent crosses the antimeridian (RFC 7946,
/// section 5.2).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GeodeticBounds {
    /// Western edge, degrees.
    #[serde(rename = "west")]
    pub west_deg: f64,
    /// Southern edge, degrees.
    #[serde(rename = "south")]
    pub south_deg: f64,
    /// Eastern edge, degrees.
    #[serde(rename = "east")]
    pub east_deg: f64,
    /// Northern edge, degrees.
    #[serde(rename = "north")]
    pub north_deg: f64,
}

impl GeodeticBounds {
    /// Whether the extent crosses the antimeridian.
    pub fn crosses_antimeridian(self) -> bool {
        self.east_deg < self.west_deg
    }

    /// The eastern edge, degrees, counted on past 180 where the extent crosses the antimeridian: never below the western
    /// edge.
    pub fn unwrapped_east_deg(self) -> f64 {
        if self.crosses_antimeridian() { self.east_deg + 360.0 } else { self.east_deg }
    }

    /// The point midway between the edges, in degrees.
    ///
    /// # Errors
    /// Where an edge is not a latitude or longitude.
    ///
    /// # Example
    /// ```
    /// use overfly_core::geodesy::GeodeticBounds;
    /// let fiji = GeodeticBounds { west_deg: 177.0, south_deg: -19.0, east_deg: -179.0, north_deg: -16.0 };
    /// assert!((fiji.middle().unwrap().longitude_deg() - 179.0).abs() < 1e-12);
    /// ```
    pub fn middle(self) -> Result<Geodetic, GeodesyError> {
        let Self { west_deg, south_deg, north_deg, .. } = self;
        Geodetic::from_degrees((south_deg + north_deg) / 2.0, (west_deg + self.unwrapped_east_deg()) / 2.0)
    }

    /// The north-western corner.
    ///
    /// # Errors
    /// Where an edge is not a latitude or longitude; so for every corner.
    pub fn north_west(self) -> Result<Geodetic, GeodesyError> {
        Geodetic::from_degrees(self.north_deg, self.west_deg)
    }

    /// The north-eastern corner.
    ///
    /// # Errors
    /// As [`GeodeticBounds::north_west`].
    pub fn north_east(self) -> Result<Geodetic, GeodesyError> {
        Geodetic::from_degrees(self.north_deg, self.east_deg)
    }

    /// The south-western corner.
    ///
    /// # Errors
    /// As [`GeodeticBounds::north_west`].
    pub fn south_west(self) -> Result<Geodetic, GeodesyError> {
        Geodetic::from_degrees(self.south_deg, self.west_deg)
    }

    /// The south-eastern corner.
    ///
    /// # Errors
    /// As [`GeodeticBounds::north_west`].
    pub fn south_east(self) -> Result<Geodetic, GeodesyError> {
        Geodetic::from_degrees(self.south_deg, self.east_deg)
    }
}

/// Takes west, south, east, north.
impl From<[f64; 4]> for GeodeticBounds {
    fn from([west_deg, south_deg, east_deg, north_deg]: [f64; 4]) -> Self {
        Self { west_deg, south_deg, east_deg, north_deg }
    }
}

/// Gives west, south, east, north.
impl From<GeodeticBounds> for [f64; 4] {
    fn from(bounds: GeodeticBounds) -> Self {
        [bounds.west_deg, bounds.south_deg, bounds.east_deg, bounds.north_deg]
    }
}

/// Serializes [`GeodeticBounds`] as the array [west, south, east, north], for `#[serde(with = "bounds_as_array")]`.
pub mod bounds_as_array {
    use super::GeodeticBounds;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    /// Writes the array.
    ///
    /// # Errors
    /// The serializer's own.
    pub fn serialize<S: Serializer>(bounds: &GeodeticBounds, serializer: S) -> Result<S::Ok, S::Error> {
        <[f64; 4]>::from(*bounds).serialize(serializer)
    }

    /// Reads the array.
    ///
    /// # Errors
    /// The deserializer's own.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<GeodeticBounds, D::Error> {
        <[f64; 4]>::deserialize(deserializer).map(GeodeticBounds::from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_an_extent_across_the_antimeridian_lies_in_it() {
        for (west_deg, east_deg, middle_deg) in [(170.0, -160.0, -175.0), (160.0, -170.0, 175.0), (-10.0, 30.0, 10.0)] {
            let bounds = GeodeticBounds { west_deg, south_deg: 10.0, east_deg, north_deg: 20.0 };
            let middle = bounds.middle().unwrap();
            assert!((middle.longitude_deg() - middle_deg).abs() < 1e-12, "{middle:?}");
            assert!((middle.latitude_deg() - 15.0).abs() < 1e-12);
            assert_eq!(bounds.crosses_antimeridian(), west_deg > 0.0);
        }
    }

    #[test]
    fn corners_join_their_two_edges() {
        let bounds = GeodeticBounds::from([-20.0, -10.0, 30.0, 40.0]);
        let corners = [bounds.north_west(), bounds.north_east(), bounds.south_west(), bounds.south_east()];
        let degrees = corners.map(|c| c.map(|p| [p.latitude_deg().round(), p.longitude_deg().round()]).unwrap());
        assert_eq!(degrees, [[40.0, -20.0], [40.0, 30.0], [-10.0, -20.0], [-10.0, 30.0]]);
        assert!(GeodeticBounds { north_deg: 91.0, ..bounds }.north_west().is_err());
    }

    #[test]
    fn is_written_by_name_or_as_an_array() {
        #[derive(Serialize, serde::Deserialize)]
        struct Layer {
            #[serde(with = "bounds_as_array")]
            bounds: GeodeticBounds,
        }
        let bounds = GeodeticBounds::from([1.0, 2.0, 3.0, 4.0]);
        assert_eq!(toml::to_string(&bounds).unwrap(), "west = 1.0\nsouth = 2.0\neast = 3.0\nnorth = 4.0\n");
        let text = toml::to_string(&Layer { bounds }).unwrap();
        assert_eq!(text, "bounds = [1.0, 2.0, 3.0, 4.0]\n");
        assert_eq!(toml::from_str::<Layer>(&text).unwrap().bounds, bounds);
    }
}
