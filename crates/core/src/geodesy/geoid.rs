//! The geoid: the height of a vertical datum's zero surface above the WGS84 ellipsoid, from tables in the program.
//!
//! A [`Layer`] is a uniform bicubic B-spline over latitude and longitude, so the surface and its first two derivatives
//! are continuous. Layers add up. `docs/geoid/make_geoid.py` fits them and prints the errors stated here. Regional
//! geoids and the change of the geoid in time are not covered.

use super::Geodetic;

/// What a height is measured from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VerticalDatum {
    /// The WGS84 ellipsoid itself: what a satellite receiver computes.
    Ellipsoid,
    /// The geoid of the Earth Gravitational Model 1996 (EPSG:5773), as in SRTM and most receivers' mean sea level.
    Egm96,
    /// The geoid of the Earth Gravitational Model 2008 (EPSG:3855), as in the Copernicus elevation model.
    Egm2008,
}

impl VerticalDatum {
    /// The name in files and on the command line.
    pub fn word(self) -> &'static str {
        match self {
            Self::Ellipsoid => "ellipsoid",
            Self::Egm96 => "egm96",
            Self::Egm2008 => "egm2008",
        }
    }

    /// The datum of a name as [`VerticalDatum::word`] spells it; none for any other text.
    pub fn parse(word: &str) -> Option<Self> {
        [Self::Ellipsoid, Self::Egm96, Self::Egm2008].into_iter().find(|datum| datum.word() == word)
    }

    /// Height of the datum's zero surface above the WGS84 ellipsoid, metres: an ellipsoidal height is the height above
    /// the datum plus this. In the tide-free system.
    ///
    /// Defined everywhere, and smooth across the antimeridian and over the poles. At a pole itself the value depends on
    /// the stated longitude by up to 0.2 m, from the rounding of the coefficients.
    ///
    /// # Example
    /// At the South Pole, by the test output of NGA's program for EGM2008: -30.150 m.
    /// ```
    /// use overfly_core::geodesy::{Geodetic, VerticalDatum};
    /// let pole = Geodetic::from_degrees(-90.0, 0.0).unwrap();
    /// assert!((VerticalDatum::Egm2008.undulation_m(pole) + 30.150).abs() < 0.2);
    /// ```
    ///
    /// # References
    /// N. K. Pavlis et al., The development and evaluation of the Earth Gravitational Model 2008, J. Geophys. Res. 117,
    /// B04406 (2012). F. G. Lemoine et al., The development of the joint NASA GSFC and NIMA geopotential model EGM96,
    /// NASA/TP-1998-206861. The numbers are NGA's grids (public domain), EGM2008 thinned to 15 minutes of arc as the
    /// crate swiftnav-sys 0.10.0 holds it, EGM96 at 15 minutes as PROJ distributes it.
    pub fn undulation_m(self, at: Geodetic) -> f64 {
        self.layers().iter().map(|layer| layer.height_m(at)).sum()
    }

    /// Standard deviation of [`VerticalDatum::undulation_m`] against the full model, metres: the root mean square over
    /// the globe, weighted by area. The model's own error against the true geoid comes on top: some 0.1 m for EGM2008 and
    /// 0.5 m for EGM96 in most places.
    ///
    /// Measured at all points of the source grids of 15 minutes of arc. The largest errors lie where the geoid is
    /// steepest: islands, trenches and the edges of the high mountains. What was chosen is marked with a star.
    ///
    /// | table | spacing, degrees | bytes | rms, m | max, m |
    /// |---|---|---|---|---|
    /// | EGM2008 | 1 | 81,540 | 0.376 | 8.0 |
    /// | EGM2008 | 0.75 | 123,000 | 0.250 | 5.1 |
    /// | EGM2008 * | 0.5 | 276,300 | 0.138 | 2.5 |
    /// | EGM96 less EGM2008 | 3 | 7,320 | 0.344 | 12.3 |
    /// | EGM96 less EGM2008 | 2 | 16,380 | 0.257 | 8.5 |
    /// | EGM96 less EGM2008 * | 1.5 | 29,040 | 0.210 | 6.8 |
    /// | EGM96 less EGM2008 | 1 | 65,160 | 0.171 | 5.8 |
    ///
    /// Between the points of the source EGM2008 varies by another 0.05 m (rms). At 200 random places of GeographicLib's
    /// test data the rms is 0.13 m for EGM2008 and 0.23 m for EGM96.
    pub fn undulation_error_m(self) -> f64 {
        match self {
            Self::Ellipsoid => 0.0,
            Self::Egm96 => 0.21,
            Self::Egm2008 => 0.14,
        }
    }

    /// The layers whose sum is the datum's zero surface.
    fn layers(self) -> &'static [Layer] {
        match self {
            Self::Ellipsoid => &[],
            Self::Egm96 => &LAYERS,
            Self::Egm2008 => &LAYERS[..2],
        }
    }
}

/// EGM2008 in two layers, so that one byte a coefficient is enough, and what EGM96 adds to them.
static LAYERS: [Layer; 3] = [
    Layer::new(include_bytes!("geoid/egm2008_2deg.bin"), 180, 1.0),
    Layer::new(include_bytes!("geoid/egm2008_30min.bin"), 720, 0.2),
    Layer::new(include_bytes!("geoid/egm96_90min.bin"), 240, 0.2),
];

/// A surface over the whole globe: the coefficients of a bicubic B-spline with a knot at every grid point.
struct Layer {
    /// One byte each, two's complement, in `unit_m`. Rows from the South Pole to the North Pole, both included; in each
    /// row `columns` from longitude -180 degrees to the east.
    coefficients: &'static [u8],
    columns: usize,
    unit_m: f64,
}

impl Layer {
    /// Checks, when the program is compiled, that the table has `columns / 2 + 1` rows.
    const fn new(coefficients: &'static [u8], columns: usize, unit_m: f64) -> Self {
        assert!(columns.is_multiple_of(2) && coefficients.len() == columns * (columns / 2 + 1));
        Self { coefficients, columns, unit_m }
    }

    /// Height of the surface, metres.
    fn height_m(&self, at: Geodetic) -> f64 {
        let knots_per_degree = self.columns as f64 / 360.0;
        let (row, row_weights) = knots((at.latitude_deg() + 90.0) * knots_per_degree);
        let (column, column_weights) = knots((at.longitude_deg() + 180.0) * knots_per_degree);
        let mut sum = 0.0;
        for (row, row_weight) in (row..).zip(row_weights) {
            for (column, column_weight) in (column..).zip(column_weights) {
                sum += row_weight * column_weight * f64::from(self.coefficient(row, column));
            }
        }
        sum * self.unit_m
    }

    /// The coefficient at any row and column: columns wrap, and rows past a pole go on along the opposite meridian.
    fn coefficient(&self, row: isize, column: isize) -> i8 {
        let columns = self.columns as isize;
        let last_row = columns / 2;
        let (row, column) = match row {
            _ if row < 0 => (-row, column + columns / 2),
            _ if row > last_row => (2 * last_row - row, column + columns / 2),
            _ => (row, column),
        };
        self.coefficients[(row * columns + column.rem_euclid(columns)) as usize].cast_signed()
    }
}

/// The first of the four knots whose cubic B-splines reach `position`, in knots, and the four values there.
fn knots(position: f64) -> (isize, [f64; 4]) {
    let cell = position.floor();
    let t = position - cell;
    let u = 1.0 - t;
    let weights =
        [u * u * u / 6.0, 2.0 / 3.0 - t * t * (2.0 - t) / 2.0, 2.0 / 3.0 - u * u * (2.0 - u) / 2.0, t * t * t / 6.0];
    (cell as isize - 1, weights)
}

#[cfg(test)]
mod tests {
    use super::VerticalDatum::{Egm96, Egm2008, Ellipsoid};
    use super::*;
    use proptest::prelude::*;

    fn undulation_m(datum: VerticalDatum, latitude_deg: f64, longitude_deg: f64) -> f64 {
        datum.undulation_m(Geodetic::from_degrees(latitude_deg, longitude_deg).unwrap())
    }

    /// Root mean square and maximum of the errors against `geoid/reference.txt`, whose column of heights is given.
    fn errors_m(datum: VerticalDatum, column: usize) -> (f64, f64) {
        let lines = include_str!("geoid/reference.txt").lines().filter(|line| !line.starts_with('#'));
        let errors: Vec<f64> = lines
            .map(|line| {
                let row: Vec<f64> = line.split(' ').map(|field| field.parse().unwrap()).collect();
                undulation_m(datum, row[0], row[1]) - row[column]
            })
            .collect();
        assert_eq!(errors.len(), 200);
        let mean_square = errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64;
        (mean_square.sqrt(), errors.iter().fold(0.0, |max: f64, error| max.max(error.abs())))
    }

    #[test]
    fn agrees_with_200_places_of_geographiclib() {
        // The rms of 200 errors is itself known to 5 %; twice that is allowed over the stated one.
        for (datum, column, max_m) in [(Egm2008, 3, 1.0), (Egm96, 2, 2.0)] {
            let (rms_m, largest_m) = errors_m(datum, column);
            assert!(rms_m < 1.1 * datum.undulation_error_m(), "{datum:?}: rms {rms_m} m");
            assert!(largest_m < max_m, "{datum:?}: {largest_m} m");
        }
        // The reference tells the two models apart: they differ by 0.5 m.
        assert!(errors_m(Egm2008, 2).0 > 0.4 && errors_m(Egm96, 3).0 > 0.4);
    }

    #[test]
    fn agrees_with_published_places() {
        // EGM2008: test output of NGA's interpolation program for the grid of 2.5 minutes (first five), and GeographicLib's
        // GeoidEval on the grid of 1 minute, as gpsd 3.22 tabulates it every 5 degrees in gpsd/geoid.c (in centimetres).
        let egm2008 = [
            ("California", 37.0, 241.0, -26.151),
            ("California, west of Greenwich", 37.0, -119.0, -26.151),
            ("North Pole", 90.0, 0.0, 14.899),
            ("South Pole", -90.0, 359.983_333, -30.150),
            ("South Pole", -90.0, 0.0, -30.150),
            ("equator at the antimeridian, from the west", 0.0, 180.0, 21.28),
            ("equator at the antimeridian, from the east", 0.0, -180.0, 21.28),
            ("Bering Sea at the antimeridian", 65.0, 180.0, 4.19),
            ("Antarctica at the antimeridian", -75.0, 180.0, -61.55),
            ("Arctic Ocean", 85.0, 0.0, 26.28),
            ("Antarctic plateau", -85.0, 0.0, -14.65),
            ("Himalaya", 30.0, 85.0, -28.00),
            ("Himalaya", 30.0, 80.0, -36.87),
            ("Karakoram", 35.0, 80.0, -28.60),
            ("Indian Ocean low", 5.0, 80.0, -105.68),
            ("Indian Ocean low", 0.0, 80.0, -102.59),
            ("New Guinea", -5.0, 145.0, 70.24),
            ("Bismarck Sea", -5.0, 150.0, 81.61),
            ("Iceland", 65.0, -20.0, 67.09),
            ("Greece", 40.0, 20.0, 33.95),
            ("Gulf of Guinea", 0.0, 0.0, 17.23),
            ("Altiplano", -20.0, -65.0, 41.89),
        ];
        // EGM96: the sample values of NGA's readme to its grid of 15 minutes.
        let egm96 = [
            ("Illinois", 38.628_155, 269.779_155, -31.628),
            ("Mato Grosso", -14.621_217, 305.021_114, -2.969),
            ("Mongolia", 46.874_319, 102.448_729, -43.575),
            ("central Australia", -23.617_446, 133.874_712, 15.871),
            ("Spain", 38.625_473, 359.999_5, 50.066),
            ("Gulf of Guinea", -0.466_744, 0.002_3, 17.329),
        ];
        for (datum, places) in [(Egm2008, &egm2008[..]), (Egm96, &egm96[..])] {
            for (name, latitude_deg, longitude_deg, expected_m) in places {
                let error_m = undulation_m(datum, *latitude_deg, *longitude_deg) - expected_m;
                // Far more than the rms, because mountains and islands are among the places; far less than the geoid.
                assert!(error_m.abs() < 0.9, "{datum:?} {name}: {error_m} m");
            }
        }
    }

    proptest! {
        #[test]
        fn has_no_kink_at_the_edge_of_a_cell(lat in -178..178i32, lon in -360..=360i32, a in 0.0..1.0f64) {
            // A kink of k metres a degree leaves k * STEP here, a smooth surface at most 300 m a square degree * STEP^2.
            const STEP: f64 = 1e-4;
            let lat_deg = f64::from(lat) / 2.0;
            let lon_deg = f64::from(lon) / 2.0;
            for datum in [Egm96, Egm2008] {
                let along = |t: f64| undulation_m(datum, lat_deg + a / 2.0, lon_deg + t);
                prop_assert!((along(-STEP) - 2.0 * along(0.0) + along(STEP)).abs() < 1e-5);
                let up = |t: f64| undulation_m(datum, lat_deg + t, lon_deg + a / 2.0);
                prop_assert!((up(-STEP) - 2.0 * up(0.0) + up(STEP)).abs() < 1e-5);
            }
        }

        #[test]
        fn goes_on_over_the_poles(lon in -180.0..180.0f64, south in any::<bool>()) {
            const STEP: f64 = 1e-4;
            let pole_deg = if south { -90.0f64 } else { 90.0 };
            for datum in [Egm96, Egm2008] {
                let here = undulation_m(datum, pole_deg * (1.0 - STEP / 90.0), lon);
                let opposite = undulation_m(datum, pole_deg * (1.0 - STEP / 90.0), lon + 180.0);
                let pole = undulation_m(datum, pole_deg, lon);
                prop_assert!((here - 2.0 * pole + opposite).abs() < 1e-5);
                prop_assert!((pole - undulation_m(datum, pole_deg, 0.0)).abs() < 0.2);
            }
        }

        #[test]
        fn is_within_the_known_range_everywhere(lat in -90.0..=90.0f64, lon in -360.0..=360.0f64) {
            prop_assert_eq!(undulation_m(Ellipsoid, lat, lon), 0.0);
            for datum in [Egm96, Egm2008] {
                prop_assert!((-109.0..88.0).contains(&undulation_m(datum, lat, lon)));
            }
        }
    }

    #[test]
    fn is_one_at_the_antimeridian() {
        for lat in -90..=90 {
            let east = undulation_m(Egm2008, f64::from(lat), 180.0 - 1e-9);
            let west = undulation_m(Egm2008, f64::from(lat), -180.0 + 1e-9);
            assert!((east - west).abs() < 1e-6);
        }
    }

    #[test]
    fn words_are_read_back() {
        for datum in [Ellipsoid, Egm96, Egm2008] {
            assert_eq!(VerticalDatum::parse(datum.word()), Some(datum));
        }
        assert_eq!(VerticalDatum::parse("EGM2008"), None);
    }
}
