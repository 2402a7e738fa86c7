//! 95 % ellipses of covariances, as plots and maps draw them.

/// Half axis of a 95 % ellipse per standard deviation: the square root of the 95 % quantile of chi-square with two degrees of freedom.
pub const HALF_AXIS_95: f64 = 2.447_746_8;

/// The half axes of the 95 % ellipse of a covariance in east and north, m^2: the longer first, metres.
pub fn half_axes_95_m(covariance_m2: &[[f64; 2]; 2]) -> [f64; 2] {
    let [[ee, en], [_, nn]] = *covariance_m2;
    let (middle, spread) = ((ee + nn) / 2.0, ((ee - nn) / 2.0).hypot(en));
    [middle + spread, middle - spread].map(|v| v.max(0.0).sqrt() * HALF_AXIS_95)
}

/// The direction of the long axis of a covariance in east and north, in an image whose y axis points down: degrees clockwise from east.
pub fn long_axis_deg(covariance_m2: &[[f64; 2]; 2]) -> f64 {
    let [[ee, en], [_, nn]] = *covariance_m2;
    -(0.5 * (2.0 * en).atan2(ee - nn)).to_degrees()
}

/// Points on the 95 % ellipse of a covariance in east and north, m^2: metres east and north of its centre.
pub fn ellipse_95_m(covariance_m2: &[[f64; 2]; 2]) -> impl Iterator<Item = (f64, f64)> + use<> {
    let [long, short] = half_axes_95_m(covariance_m2);
    let (sin, cos) = (-long_axis_deg(covariance_m2)).to_radians().sin_cos();
    (0..=48).map(move |i| {
        let (s, c) = (f64::from(i) / 48.0 * std::f64::consts::TAU).sin_cos();
        (long * c * cos - short * s * sin, long * c * sin + short * s * cos)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_has_the_distance_of_the_95_percent_quantile() {
        // The inverse of [[5, 2], [2, 2]] is [[2, -2], [-2, 5]] / 6.
        for (e, n) in ellipse_95_m(&[[5.0, 2.0], [2.0, 2.0]]) {
            let squared = (2.0 * e * e - 4.0 * e * n + 5.0 * n * n) / 6.0;
            assert!((squared - 5.9915).abs() < 1e-3, "{squared}");
        }
    }
}
