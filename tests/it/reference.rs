//! Projections and geodesics against PROJ's and GeographicLib's numbers, kept as text with the script that made them.

use overfly_core::geodesy::{Geodetic, geodesic_between};
use overfly_ingest::crs::{Crs, DatumShift, Definition, Ellipsoid, Method};

const FOOT_M: f64 = 1200.0 / 3937.0;

/// The systems that `tests/reference/make.py` calls by a name.
fn user_defined(name: &str) -> Crs {
    let definition = match name {
        "tm" | "tm_us_feet" | "albers" | "laea" => on_grs80(name),
        _ => on_wgs84(name),
    };
    Crs::from_definition(&definition).unwrap()
}

fn transverse() -> Definition {
    Definition {
        method: Method::TransverseMercator { scale: 0.99995 },
        origin_latitude_deg: 47.0,
        origin_longitude_deg: -99.3,
        false_easting: 10_000.0,
        false_northing: 20_000.0,
        unit_m: 1.0,
        ellipsoid: Ellipsoid::GRS80,
        datum: DatumShift::Null { error_m: 1.0 },
    }
}

fn on_grs80(name: &str) -> Definition {
    let base = transverse();
    match name {
        "tm_us_feet" => Definition {
            method: Method::TransverseMercator { scale: 1.0 },
            unit_m: FOOT_M,
            false_easting: 10_000.0 / FOOT_M,
            false_northing: 20_000.0 / FOOT_M,
            ..base
        },
        "albers" => Definition {
            method: Method::Albers { parallel_1_deg: 29.5, parallel_2_deg: 45.5 },
            origin_latitude_deg: 37.5,
            origin_longitude_deg: -96.0,
            false_easting: 0.0,
            false_northing: 0.0,
            ..base
        },
        "laea" => Definition {
            method: Method::LambertAzimuthalEqualArea,
            origin_latitude_deg: 50.0,
            origin_longitude_deg: 10.0,
            false_easting: 1000.0,
            false_northing: 2000.0,
            ..base
        },
        _ => base,
    }
}

fn on_wgs84(name: &str) -> Definition {
    let ellipsoid = Ellipsoid::WGS84;
    let base = Definition { false_easting: 600_000.0, false_northing: 210_000.0, ellipsoid, ..transverse() };
    match name {
        "lcc_2sp" => {
            Definition { method: Method::LambertConformal2 { parallel_1_deg: 46.0, parallel_2_deg: 48.5 }, ..base }
        }
        "lcc_1sp" => Definition { method: Method::LambertConformal1 { scale: 0.9998 }, ..base },
        "mercator" => Definition {
            method: Method::Mercator { scale: 0.997 },
            origin_latitude_deg: 0.0,
            origin_longitude_deg: -30.0,
            false_easting: 3_900_000.0,
            false_northing: 900_000.0,
            ..base
        },
        "polar" => Definition {
            method: Method::PolarStereographic { scale: 0.994 },
            origin_latitude_deg: 90.0,
            origin_longitude_deg: -45.0,
            false_easting: 2_000_000.0,
            false_northing: 2_000_000.0,
            ..base
        },
        other => panic!("no such system: {other}"),
    }
}

fn rows(text: &str) -> impl Iterator<Item = Vec<&str>> {
    text.lines().filter(|l| !l.starts_with('#')).skip(1).map(|l| l.split(',').collect())
}

#[test]
fn projects_as_proj_does() {
    let mut systems = std::collections::BTreeSet::new();
    for row in rows(include_str!("../reference/projections.csv")) {
        let number = |i: usize| row[i].parse::<f64>().unwrap();
        let crs = row[0].parse().map_or_else(|_| user_defined(row[0]), |code| Crs::from_epsg(code).unwrap());
        let point = Geodetic::from_degrees(number(1), number(2)).unwrap();
        let (x, y) = crs.projected_from_geodetic(point).unwrap();
        let unit_m = crs.unit_m().unwrap_or(111_320.0);
        let miss_m = (x - number(3)).hypot(y - number(4)) * unit_m;
        // Both are series in double precision: micrometres. Shifted datums: PROJ reads Helmert parameters rounded to
        // three digits where the library keeps four, 5 mm; far below the metres that such a shift is stated to err by.
        let shifted = matches!(row[0], "27700" | "31467" | "2056" | "28992");
        let tolerance_m = if shifted { 0.006 } else { 1e-5 };
        assert!(miss_m < tolerance_m, "{row:?}: {x} {y}, {miss_m} m off");
        let back_m = geodesic_between(crs.geodetic_from_projected(x, y).unwrap(), point).distance_m;
        // A shifted datum's height above its own ellipsoid is dropped on the way back: up to 50 m x the shift's tilt.
        let tolerance_m = if shifted { 0.01 } else { 1e-5 };
        assert!(back_m < tolerance_m, "{row:?}: comes back {back_m} m off");
        systems.insert(row[0].to_string());
    }
    assert!(systems.len() >= 38, "{systems:?}");
}

#[test]
fn measures_as_geographiclib_does() {
    for row in rows(include_str!("../reference/geodesics.csv")) {
        let number = |i: usize| row[i].parse::<f64>().unwrap();
        let start = Geodetic::from_degrees(number(0), number(1)).unwrap();
        let end = Geodetic::from_degrees(number(2), number(3)).unwrap();
        let line = geodesic_between(start, end);
        // The algorithm is exact to 15 nm; degrees pass through radians and back, 1e-16 of a turn each.
        assert!((line.distance_m - number(4)).abs() < 1e-7, "{row:?}: {}", line.distance_m);
        let turn_deg = (line.azimuth_rad.to_degrees() - number(5)).rem_euclid(360.0);
        let across_m = turn_deg.min(360.0 - turn_deg).to_radians() * line.distance_m.min(1e6);
        assert!(across_m < 1e-4 || start.latitude_deg().abs() == 90.0, "{row:?}: {}", line.azimuth_rad.to_degrees());
    }
}
