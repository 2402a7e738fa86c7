//! `resect`: the camera of a frame from where its windows lie on the map, by least squares over exact projections.
//!
//! Beside position, heading and height it frees the camera's tilt, and what a sensor or a lens may add that nobody stated: aspect,
//! shear, radial distortion. Each has a prior, so that few windows do not turn noise into a lens; and each widens the covariance of
//! what is asked for. A slope of the ground acts as a tilt does.
//!
//! # References
//! Photogrammetric space resection with self-calibration (Luhmann et al., Close-Range Photogrammetry, 4.2.3 and 4.4).

use crate::camera::{Camera, CameraDeviation, DeviatedCamera};
use crate::geodesy::{BodyFrame, BodyOffset};
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

/// Parameters: east and north of the image's centre, turn, logarithm of the height, pitch, roll, aspect, shear, radial distortion.
const PARAMETERS: usize = 9;
/// Index of the tilt among the parameters: pitch, then roll.
const TILT: usize = 4;

type Parameters = SVector<f64, PARAMETERS>;
type ParameterMatrix = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// A point of the frame and where it lies on the map.
#[derive(Debug, Clone, Copy)]
pub struct Correspondence {
    /// Position in the frame, pixels.
    pub frame_px: [f64; 2],
    /// Place on the map, pixels right of and below a common origin.
    pub map_px: Vector2<f64>,
    /// Inverse covariance of `map_px` up to a common factor, per px^2.
    pub information: Matrix2<f64>,
    /// How far the ground there rises above that under the image's centre, metres; 0 where no relief is known.
    pub rise_m: f64,
}

/// Where the search for the camera begins, and what is known of it.
#[derive(Debug, Clone)]
pub struct ResectionStart<'a> {
    /// The stated camera.
    pub camera: &'a Camera,
    /// Map pixels right and down per metre east and north.
    pub px_from_enu: Matrix2<f64>,
    /// Place of the image's centre on the map, pixels from the common origin.
    pub image_centre_px: Vector2<f64>,
    /// Heading, radians clockwise from north.
    pub heading_rad: f64,
    /// True height over the stated height.
    pub height_ratio: f64,
    /// The correspondences that agree so far.
    pub inliers: &'a [usize],
    /// Prior standard deviations of the rest.
    pub priors: DeviationSigmas,
    /// Correspondences were searched this far around their expected place, px.
    pub radius_px: f64,
    /// Largest residual of a sharply placed correspondence, px; it only counts them.
    pub tolerance_px: f64,
}

/// Prior standard deviations of a camera's deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviationSigmas {
    /// Of pitch and of roll, radians.
    pub tilt_rad: f64,
    /// Of the aspect.
    pub aspect: f64,
    /// Of the shear.
    pub shear: f64,
    /// Of the radial distortion.
    pub radial: f64,
}

/// A camera found by resection.
#[derive(Debug, Clone)]
pub struct Resection {
    /// Place of the image's centre on the map, pixels from the common origin.
    pub image_centre_px: Vector2<f64>,
    /// Covariance of that place, px^2.
    pub image_centre_covariance_px2: Matrix2<f64>,
    /// Heading, radians clockwise from north.
    pub heading_rad: f64,
    /// Variance of the heading, rad^2.
    pub heading_variance_rad2: f64,
    /// How the camera differs from the stated one.
    pub deviation: CameraDeviation,
    /// Variance of the logarithm of the height.
    pub log_height_variance: f64,
    /// Covariance of pitch and roll, rad^2.
    pub tilt_covariance_rad2: Matrix2<f64>,
    /// Number of correspondences that agree: the sum of their probabilities to be right.
    pub agreeing: f64,
    /// Number of correspondences whose residual is at most the tolerance.
    pub within_tolerance: usize,
    /// Root mean square residual per axis of right ones, px.
    pub rms_px: f64,
}

/// Most rounds of least squares.
const ROUNDS: usize = 40;
/// Fewer agreeing correspondences determine no camera.
const MIN_INLIERS: usize = 4;
/// Prior standard deviations of turn, radians, and of the logarithm of the height, about the start.
const TURN_SIGMA_RAD: f64 = 0.07;
const LOG_HEIGHT_SIGMA: f64 = 0.06;
/// The rounds end where no parameter moves by more than this many of its standard deviations, and no probability by more than this.
const CONVERGED: f64 = 1e-3;
/// Bounds on the share of right and of wrong correspondences.
const LEAST_SHARE: f64 = 0.02;
/// Bounds on the scatter per axis of right correspondences, px.
const LEAST_SCATTER_PX: f64 = 0.1;
const MOST_SCATTER_PX: f64 = 3.0;
/// Steps of the numerical derivatives.
const STEP: f64 = 1e-5;

/// Finds the camera whose projections agree best with the correspondences; `None` where too few agree or it sees the horizon.
pub fn resect(correspondences: &[Correspondence], start: &ResectionStart<'_>) -> Option<Resection> {
    Resecting::new(correspondences, start)?.run()
}

/// A resection under way.
struct Resecting<'a> {
    correspondences: &'a [Correspondence],
    start: &'a ResectionStart<'a>,
    /// The stated camera's ray of each correspondence.
    rays: Vec<[f64; 2]>,
    centre_ray: [f64; 2],
    /// Mean square of the rays' radii.
    mean_square: f64,
}

/// The camera of some parameters.
struct Projection {
    deviation: CameraDeviation,
    camera: DeviatedCamera,
    /// The ground point under the image's centre, from the nadir.
    centre: BodyOffset,
    axes: BodyFrame,
    centre_px: Vector2<f64>,
}

/// The normal equations of one round.
struct Normal {
    /// Of the data alone, for a unit variance of 1.
    data: ParameterMatrix,
    right: Parameters,
}

impl<'a> Resecting<'a> {
    fn new(correspondences: &'a [Correspondence], start: &'a ResectionStart<'a>) -> Option<Self> {
        let rays: Vec<_> = correspondences.iter().map(|c| start.camera.ray_from_frame(c.frame_px)).collect();
        let (w, h) = start.camera.frame_size_px();
        let centre_ray = start.camera.ray_from_frame([f64::from(w) / 2.0, f64::from(h) / 2.0]);
        let mean_square = rays.iter().map(|[x, y]| x * x + y * y).sum::<f64>() / rays.len().max(1) as f64;
        (start.inliers.len() >= MIN_INLIERS).then_some(Self { correspondences, start, rays, centre_ray, mean_square })
    }

    /// Expectation maximisation: the correspondences are a mixture of right ones, normally distributed about their predictions, and
    /// wrong ones, anywhere in the searched square.
    fn run(&self) -> Option<Resection> {
        let mut at = Parameters::zeros();
        (at[0], at[1]) = (self.start.image_centre_px.x, self.start.image_centre_px.y);
        let mut weights = vec![0.0; self.correspondences.len()];
        self.start.inliers.iter().for_each(|&i| weights[i] = 1.0);
        let mut unit_variance = self.unit_variance(&at, &weights, 4.0)?;
        let (mut cofactor, mut variance_px2) = (ParameterMatrix::identity(), 1.0);
        for _ in 0..ROUNDS {
            let Normal { data, right } = self.normal(&at, &weights)?;
            cofactor = (data / unit_variance + self.prior_information()).try_inverse()?;
            let step = cofactor * (right / unit_variance - self.prior_information() * self.off_prior(&at));
            at += step;
            let determined = (cofactor * data / unit_variance).trace();
            variance_px2 = self.variance_px2(&at, &weights, determined)?;
            let renewed = self.weights(&at, variance_px2, &weights);
            if renewed.iter().sum::<f64>() < MIN_INLIERS as f64 {
                return None;
            }
            let changed = weights.iter().zip(&renewed).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            weights = renewed;
            unit_variance = self.unit_variance(&at, &weights, determined)?;
            let largest = (0..PARAMETERS).map(|i| step[i].abs() / cofactor[(i, i)].sqrt()).fold(0.0, f64::max);
            if changed < CONVERGED && largest < CONVERGED {
                break;
            }
        }
        Some(Resection {
            image_centre_px: Vector2::new(at[0], at[1]),
            image_centre_covariance_px2: cofactor.fixed_view::<2, 2>(0, 0).into_owned(),
            heading_rad: self.start.heading_rad + at[2],
            heading_variance_rad2: cofactor[(2, 2)],
            deviation: self.deviation(&at),
            log_height_variance: cofactor[(3, 3)],
            tilt_covariance_rad2: cofactor.fixed_view::<2, 2>(TILT, TILT).into_owned(),
            agreeing: weights.iter().sum(),
            within_tolerance: self.within_tolerance(&at),
            rms_px: variance_px2.sqrt(),
        })
    }

    fn deviation(&self, at: &Parameters) -> CameraDeviation {
        CameraDeviation {
            log_height: self.start.height_ratio.ln() + at[3],
            pitch_rad: at[TILT],
            roll_rad: at[TILT + 1],
            aspect: at[6],
            shear: at[7],
            radial: at[8],
        }
    }

    /// The parameters less their prior means; the position has no prior.
    fn off_prior(&self, at: &Parameters) -> Parameters {
        let mut off = *at;
        (off[0], off[1]) = (0.0, 0.0);
        off
    }

    fn prior_information(&self) -> ParameterMatrix {
        let DeviationSigmas { tilt_rad, aspect, shear, radial } = self.start.priors;
        let sigmas = [TURN_SIGMA_RAD, LOG_HEIGHT_SIGMA, tilt_rad, tilt_rad, aspect, shear, radial];
        let mut information = Parameters::zeros();
        sigmas.iter().enumerate().for_each(|(i, sigma)| information[i + 2] = sigma.powi(-2));
        ParameterMatrix::from_diagonal(&information)
    }

    /// The camera of some parameters; `None` where its centre looks above the horizon.
    fn projection(&self, at: &Parameters) -> Option<Projection> {
        let deviation = self.deviation(at);
        let camera = self.start.camera.deviated(&deviation);
        Some(Projection {
            deviation,
            camera,
            centre: camera.body_from_ray(deviation.ray(self.centre_ray, self.mean_square), 0.0)?,
            axes: BodyFrame::from_heading_rad(self.start.heading_rad + at[2]),
            centre_px: Vector2::new(at[0], at[1]),
        })
    }

    /// The residual of a correspondence, map px; `None` above the horizon.
    fn residual(&self, index: usize, by: &Projection) -> Option<Vector2<f64>> {
        let ray = by.deviation.ray(self.rays[index], self.mean_square);
        let point = by.camera.body_from_ray(ray, self.correspondences[index].rise_m)?;
        let offset = by.axes.enu_from_body(point - by.centre);
        let predicted = by.centre_px + self.start.px_from_enu * Vector2::new(offset.east_m, offset.north_m);
        Some(self.correspondences[index].map_px - predicted)
    }

    fn within_tolerance(&self, at: &Parameters) -> usize {
        let Some(by) = self.projection(at) else { return 0 };
        let is_within = |&i: &usize| self.residual(i, &by).is_some_and(|r| r.norm() <= self.start.tolerance_px);
        (0..self.correspondences.len()).filter(is_within).count()
    }

    /// The probability of each correspondence to be a right one, where right ones have a variance per axis of `variance_px2`.
    fn weights(&self, at: &Parameters, variance_px2: f64, before: &[f64]) -> Vec<f64> {
        let share = (before.iter().sum::<f64>() / before.len() as f64).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE);
        let wrong = (1.0 - share) / (2.0 * self.start.radius_px).powi(2);
        let right = |residual: Vector2<f64>| {
            share * (-residual.norm_squared() / (2.0 * variance_px2)).exp() / (std::f64::consts::TAU * variance_px2)
        };
        let Some(by) = self.projection(at) else { return vec![0.0; before.len()] };
        let weight = |i| self.residual(i, &by).map_or(0.0, |r| right(r) / (right(r) + wrong));
        (0..before.len()).map(weight).collect()
    }

    /// The variance per axis of right correspondences, px^2, where `determined` parameters were fitted.
    fn variance_px2(&self, at: &Parameters, weights: &[f64], determined: f64) -> Option<f64> {
        let (mut sum, by) = (0.0, self.projection(at)?);
        for (i, weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
            sum += weight * self.residual(i, &by)?.norm_squared();
        }
        let freedom = (2.0 * weights.iter().sum::<f64>() - determined).max(1.0);
        Some((sum / freedom).clamp(LEAST_SCATTER_PX.powi(2), MOST_SCATTER_PX.powi(2)))
    }

    fn normal(&self, at: &Parameters, weights: &[f64]) -> Option<Normal> {
        let mut normal = Normal { data: ParameterMatrix::zeros(), right: Parameters::zeros() };
        let by = self.projection(at)?;
        let moved = (0..PARAMETERS).map(|parameter| {
            let mut moved = *at;
            moved[parameter] += STEP;
            self.projection(&moved)
        });
        let moved = moved.collect::<Option<Vec<Projection>>>()?;
        for (i, weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
            let residual = self.residual(i, &by)?;
            let mut design = SMatrix::<f64, 2, PARAMETERS>::zeros();
            for (parameter, moved) in moved.iter().enumerate() {
                let slope = (residual - self.residual(i, moved)?) / STEP;
                design.set_column(parameter, &slope);
            }
            let information = self.correspondences[i].information * *weight;
            normal.data += design.transpose() * information * design;
            normal.right += design.transpose() * information * residual;
        }
        Some(normal)
    }

    /// The variance of an observation of information 1, where `determined` parameters were fitted.
    fn unit_variance(&self, at: &Parameters, weights: &[f64], determined: f64) -> Option<f64> {
        let (mut sum, by) = (0.0, self.projection(at)?);
        for (i, weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
            let residual = self.residual(i, &by)?;
            sum += weight * residual.dot(&(self.correspondences[i].information * residual));
        }
        let freedom = (2.0 * weights.iter().sum::<f64>() - determined).max(1.0);
        Some((sum / freedom).max(f64::MIN_POSITIVE.sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Attitude, Height, Intrinsics, View};

    const PX_PER_M: f64 = 0.2;

    fn camera() -> Camera {
        let view = View::Posed {
            intrinsics: Intrinsics::centred(256, 192, 400.0),
            height: Height::AboveGround(2200.0),
            attitude: Attitude::exact(0.0, 0.0),
        };
        Camera::new(&view, 256, 192).unwrap()
    }

    /// Windows of a frame taken by a camera of this deviation with its image's centre at (7, -3), with some noise.
    fn seen(deviation: &CameraDeviation, noise_px: f64) -> Vec<Correspondence> {
        let (camera, mut state) = (camera(), 1u32);
        let mut unit = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1u32 << 23) - 1.0
        };
        let ground = |pixel| {
            let ray = deviation.ray(camera.ray_from_frame(pixel), 0.04);
            camera.deviated(deviation).body_from_ray(ray, 0.0).unwrap()
        };
        let centre = ground([128.0, 96.0]);
        let mut all = Vec::new();
        for y in 0..4 {
            for x in 0..6 {
                let frame_px = [24.0 + 40.0 * f64::from(x), 24.0 + 40.0 * f64::from(y)];
                let offset = ground(frame_px) - centre;
                let map_px = Vector2::new(7.0 + offset.right_m * PX_PER_M, -3.0 - offset.ahead_m * PX_PER_M);
                let noise = Vector2::new(unit(), unit()) * noise_px;
                all.push(Correspondence {
                    frame_px,
                    map_px: map_px + noise,
                    information: Matrix2::identity() * 0.1,
                    rise_m: 0.0,
                });
            }
        }
        all
    }

    fn resected(correspondences: &[Correspondence], tilt_deg: f64) -> Resection {
        let camera = camera();
        let middle: Vec<usize> = [8, 9, 14, 15].into();
        let start = ResectionStart {
            camera: &camera,
            px_from_enu: Matrix2::new(PX_PER_M, 0.0, 0.0, -PX_PER_M),
            image_centre_px: Vector2::new(6.6, -3.3),
            heading_rad: 0.0,
            height_ratio: 1.0,
            inliers: &middle,
            priors: DeviationSigmas { tilt_rad: tilt_deg.to_radians(), aspect: 0.02, shear: 0.02, radial: 0.1 },
            radius_px: 8.0,
            tolerance_px: 1.25,
        };
        resect(correspondences, &start).unwrap()
    }

    #[test]
    fn finds_tilt_aspect_shear_and_lens_beside_the_place() {
        for (pitch_deg, roll_deg, aspect, shear, radial) in [
            (0.0, 0.0, 0.0, 0.0, 0.0),
            (8.0, -5.0, 0.0, 0.0, 0.0),
            (1.0, 0.0, 0.04, -0.02, 0.0),
            (0.0, 2.0, 0.0, 0.0, -0.15),
        ] {
            let (pitch_rad, roll_rad) = (f64::to_radians(pitch_deg), f64::to_radians(roll_deg));
            let deviation =
                CameraDeviation { pitch_rad, roll_rad, aspect, shear, radial, ..CameraDeviation::default() };
            let found = resected(&seen(&deviation, 0.05), 10.0);
            assert!(found.agreeing > 22.0, "{} {deviation:?}", found.agreeing);
            let off = found.image_centre_px - Vector2::new(7.0, -3.0);
            let covariance = found.image_centre_covariance_px2;
            assert!(
                off.dot(&(covariance.try_inverse().unwrap() * off)) < 14.0 && off.norm() < 0.2,
                "{off} {deviation:?}"
            );
            let d = found.deviation;
            assert!((d.pitch_rad - pitch_rad).to_degrees().abs() < 0.5, "{d:?}");
            assert!((d.roll_rad - roll_rad).to_degrees().abs() < 0.5, "{d:?}");
            assert!((d.aspect - aspect).abs() < 0.01 && (d.shear - shear).abs() < 0.01, "{d:?}");
            assert!((d.radial - radial).abs() < 0.05, "{d:?}");
        }
    }

    /// Rays of a camera that looks aside onto ground that rises to one side: with its rises known the slope is no tilt.
    #[test]
    fn a_slope_whose_rises_are_known_is_no_tilt() {
        let camera = camera();
        let level = camera.deviated(&CameraDeviation::default());
        let rise_m = |x: f64| 0.09 * x;
        let onto_slope = |pixel: [f64; 2]| {
            let ray = camera.ray_from_frame(pixel);
            let mut point = level.body_from_ray(ray, 0.0).unwrap();
            for _ in 0..30 {
                point = level.body_from_ray(ray, rise_m(point.right_m)).unwrap();
            }
            point
        };
        let (mut all, centre) = (Vec::new(), onto_slope([128.0, 96.0]));
        for (i, frame_px) in (0..24).map(|i| (i, [24.0 + 40.0 * f64::from(i % 6), 24.0 + 40.0 * f64::from(i / 6)])) {
            let point = onto_slope(frame_px);
            let offset = point - centre;
            let map_px = Vector2::new(7.0 + offset.right_m * PX_PER_M, -3.0 - offset.ahead_m * PX_PER_M);
            let noise_px = Vector2::new(f64::from(i * 7 % 5) - 2.0, f64::from(i * 3 % 5) - 2.0) * 0.02;
            let information = Matrix2::identity() * 0.1;
            let rise_m = rise_m(point.right_m) - rise_m(centre.right_m);
            all.push(Correspondence { frame_px, map_px: map_px + noise_px, information, rise_m });
        }
        let laid = resected(&all, 20.0);
        let tilt_deg = |found: &Resection| found.deviation.roll_rad.hypot(found.deviation.pitch_rad).to_degrees();
        assert!(tilt_deg(&laid) < 0.3, "{laid:?}");
        assert!((laid.image_centre_px - Vector2::new(7.0, -3.0)).norm() < 0.05, "{laid:?}");
        all.iter_mut().for_each(|correspondence| correspondence.rise_m = 0.0);
        assert!(tilt_deg(&resected(&all, 20.0)) > 2.0, "on a plane the slope looks like a tilt");
    }

    #[test]
    fn wrong_correspondences_move_little_and_scattered_ones_widen_the_covariance() {
        let mut some_wrong = seen(&CameraDeviation::default(), 0.05);
        for (k, i) in [0usize, 5, 11, 17, 20, 23].into_iter().enumerate() {
            some_wrong[i].map_px += Vector2::new(5.0 - k as f64, -4.0 + k as f64);
        }
        let found = resected(&some_wrong, 5.0);
        assert!((found.image_centre_px - Vector2::new(7.0, -3.0)).norm() < 0.2 && found.agreeing < 19.0, "{found:?}");
        // Windows that scatter by two pixels are not as good as the few of them that agree within one.
        let scattered = resected(&seen(&CameraDeviation::default(), 3.5), 5.0);
        let sigma_px = (scattered.image_centre_covariance_px2.trace() / 2.0).sqrt();
        assert!(scattered.rms_px > 1.2 && sigma_px > 0.3, "{scattered:?}");
    }

    #[test]
    fn what_may_be_tilted_is_known_less_exactly() {
        let level = seen(&CameraDeviation::default(), 0.3);
        let (sure, unsure) = (resected(&level, 0.01), resected(&level, 10.0));
        let trace = |r: &Resection| r.image_centre_covariance_px2.trace();
        assert!(trace(&unsure) > 1.02 * trace(&sure));
        assert!(unsure.tilt_covariance_rad2.trace() > 100.0 * sure.tilt_covariance_rad2.trace());
    }
}
