//! What to say where a position lies outside a layer.

use overfly_core::geodesy::GeodeticBounds;
use overfly_store::Layer;

/// Where the layer lies, and whether the position lies in it with latitude and longitude swapped.
pub fn outside_note(layer: &Layer, latitude_deg: f64, longitude_deg: f64) -> String {
    let b = layer.bounds_deg;
    let extent = format!(
        "layer {} spans latitude {:.4} to {:.4}, longitude {:.4} to {:.4}",
        layer.name, b.south_deg, b.north_deg, b.west_deg, b.east_deg
    );
    if holds(b, longitude_deg, latitude_deg) {
        format!("{extent}: {latitude_deg} and {longitude_deg} lie in it if latitude and longitude are swapped")
    } else {
        extent
    }
}

fn holds(b: GeodeticBounds, latitude_deg: f64, longitude_deg: f64) -> bool {
    let east_of_west = (longitude_deg - b.west_deg).rem_euclid(360.0);
    (b.south_deg..=b.north_deg).contains(&latitude_deg) && east_of_west <= b.unwrapped_east_deg() - b.west_deg
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tells_swapped_positions_from_others() {
        let layer = |bounds: [f64; 4]| Layer {
            name: "ortho".into(),
            base_zoom: 14,
            min_zoom: 13,
            base_tiles: 1,
            tiles: 2,
            bounds_deg: bounds.into(),
            acquired: None,
            complete: true,
            digest: None,
            terms: Default::default(),
            terrain: None,
        };
        let austria = layer([15.59, 48.48, 15.63, 48.50]);
        assert!(outside_note(&austria, 15.61, 48.49).contains("swapped"));
        assert_eq!(
            outside_note(&austria, 47.0, 8.0),
            "layer ortho spans latitude 48.4800 to 48.5000, longitude 15.5900 to 15.6300"
        );
        let fiji = layer([179.0, -18.0, -179.0, -16.0]);
        assert!(outside_note(&fiji, -179.5, -17.0).contains("swapped"));
    }
}
