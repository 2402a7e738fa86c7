//! UTM zone 33 north (EPSG:32633) by Krueger's series, written here a second time on purpose: what the generator says
//! of a place is not what the program under test computes.

use overfly_core::geodesy::{FLATTENING, Geodetic, SEMI_MAJOR_M};

const CENTRAL_MERIDIAN_DEG: f64 = 15.0;
const SCALE: f64 = 0.9996;
const FALSE_EASTING_M: f64 = 500_000.0;
/// The `.prj` beside each orthophoto.
pub const PRJ: &str = r#"PROJCS["WGS 84 / UTM zone 33N",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563,AUTHORITY["EPSG","7030"]],AUTHORITY["EPSG","6326"]],PRIMEM["Greenwich",0,AUTHORITY["EPSG","8901"]],UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AUTHORITY["EPSG","4326"]],PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",0],PARAMETER["central_meridian",15],PARAMETER["scale_factor",0.9996],PARAMETER["false_easting",500000],PARAMETER["false_northing",0],UNIT["metre",1,AUTHORITY["EPSG","9001"]],AXIS["Easting",EAST],AXIS["Northing",NORTH],AUTHORITY["EPSG","32633"]]
"#;

/// Easting and northing, metres, of a point. Good to a nanometre within the zone.
///
/// # References
/// C. F. F. Karney, Transverse Mercator with an accuracy of a few nanometers, J. Geodesy 85 (2011), equations 7 to 12
/// and 35 to fourth order.
pub fn grid_from_geodetic(point: Geodetic) -> [f64; 2] {
    let n = FLATTENING / (2.0 - FLATTENING);
    let (n2, n3, n4) = (n * n, n * n * n, n * n * n * n);
    let rectifying_m = SEMI_MAJOR_M / (1.0 + n) * (1.0 + n2 / 4.0 + n4 / 64.0);
    let alpha = [
        n / 2.0 - 2.0 / 3.0 * n2 + 5.0 / 16.0 * n3 + 41.0 / 180.0 * n4,
        13.0 / 48.0 * n2 - 3.0 / 5.0 * n3 + 557.0 / 1440.0 * n4,
        61.0 / 240.0 * n3 - 103.0 / 140.0 * n4,
        49_561.0 / 161_280.0 * n4,
    ];
    let eccentricity = 2.0 * n.sqrt() / (1.0 + n);
    let sin_lat = point.latitude_rad().sin();
    let conformal = (sin_lat.atanh() - eccentricity * (eccentricity * sin_lat).atanh()).sinh();
    let (sin_lon, cos_lon) = (point.longitude_rad() - CENTRAL_MERIDIAN_DEG.to_radians()).sin_cos();
    let xi = conformal.atan2(cos_lon);
    let eta = (sin_lon / conformal.hypot(cos_lon)).asinh();
    let (mut north, mut east) = (xi, eta);
    for (j, a) in alpha.iter().enumerate() {
        let k = 2.0 * (j + 1) as f64;
        north += a * (k * xi).sin() * (k * eta).cosh();
        east += a * (k * xi).cos() * (k * eta).sinh();
    }
    [FALSE_EASTING_M + SCALE * rectifying_m * east, SCALE * rectifying_m * north]
}

/// The point at an easting and northing, by Newton steps on [`grid_from_geodetic`] until it hits within a nanometre.
pub fn geodetic_from_grid(grid: [f64; 2]) -> Geodetic {
    let at = |lat: f64, lon: f64| Geodetic::from_radians(lat, lon).expect("the scene lies in the zone");
    let mut lat = grid[1] / (SCALE * 6_367_449.0);
    let mut lon = CENTRAL_MERIDIAN_DEG.to_radians() + (grid[0] - FALSE_EASTING_M) / (SEMI_MAJOR_M * lat.cos());
    for _ in 0..20 {
        let here = grid_from_geodetic(at(lat, lon));
        let miss = [grid[0] - here[0], grid[1] - here[1]];
        if miss[0].hypot(miss[1]) < 1e-9 {
            break;
        }
        const STEP_RAD: f64 = 1e-6;
        let by_lat = grid_from_geodetic(at(lat + STEP_RAD, lon)).map(|v| v / STEP_RAD);
        let by_lon = grid_from_geodetic(at(lat, lon + STEP_RAD)).map(|v| v / STEP_RAD);
        let j = nalgebra::Matrix2::new(
            by_lat[0] - here[0] / STEP_RAD,
            by_lon[0] - here[0] / STEP_RAD,
            by_lat[1] - here[1] / STEP_RAD,
            by_lon[1] - here[1] / STEP_RAD,
        );
        let step = j.lu().solve(&nalgebra::Vector2::new(miss[0], miss[1])).expect("the projection is regular here");
        (lat, lon) = (lat + step.x, lon + step.y);
    }
    at(lat, lon)
}
