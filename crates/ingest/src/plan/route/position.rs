//! A position of a route.

use overfly_core::geodesy::Geodetic;

/// Returns the position `index` of a line.
///
/// # Errors
/// What is wrong with it, and whether latitude and longitude seem to be exchanged.
pub fn position_at(index: usize, latitude_deg: f64, longitude_deg: f64) -> Result<Geodetic, String> {
    Geodetic::from_degrees(latitude_deg, longitude_deg).map_err(|error| {
        let exchanged = Geodetic::from_degrees(longitude_deg, latitude_deg).is_ok();
        let hint = if exchanged { "; in GeoJSON and KML a position is longitude first, then latitude" } else { "" };
        format!("position {index}: {error}{hint}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exchanged_position_is_told_from_another_wrong_one() {
        assert!(position_at(0, 47.0, -99.0).is_ok());
        assert!(position_at(3, -99.19, 47.01).unwrap_err().contains("longitude first"));
        assert!(!position_at(3, -99.19, 470.0).unwrap_err().contains("longitude first"));
    }
}
