//! `Forecast`: the models' results for one aircraft in three coupling modes, and the mode to use.

use super::aircraft::Aircraft;
use super::error::PlanError;
use overfly_core::coupling::{
    Calibration, Combined, CouplingError, CouplingParameters, FixedPoints, Mode, Parallel, Sequential,
    mission_within_risk_s, scan_limit_s,
};
use serde::Serialize;
use std::f64::consts::FRAC_PI_2;

/// The probability of a failure in a mission of [`SequentialForecast::mission_within_risk_s`].
const RISK: f64 = 0.05;

/// The models' results for one aircraft. In JSON an infinite number is `null`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Forecast {
    /// The models' parameters: a, b, I, D_U, K1, t0, v, R_min.
    pub parameters: CouplingParameters,
    /// Ground sample distance of the frames, m/px.
    pub gsd_m_per_px: f64,
    /// t_lim: the time after which two images share no ground, seconds.
    pub scan_limit_s: f64,
    /// Equations 1 to 16.
    pub sequential: SequentialForecast,
    /// Equations 17 to 22.
    pub parallel: ParallelForecast,
    /// Equations 23 to 31, with the areas corrected.
    pub combined: CombinedForecast,
    /// Which mode to use.
    pub advice: Advice,
}

/// The sequential mode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SequentialForecast {
    /// Why the mode does not work; absent where it does.
    pub fails: Option<String>,
    /// v_max (7), m/s.
    pub max_speed_mps: f64,
    /// n_max (8); absent above v_max.
    pub max_relative_count: Option<f64>,
    /// n_opt (13), a whole number of at most n_max; absent above v_max.
    pub best_relative_count: Option<u64>,
    /// n_opt as printed in the paper, sqrt(a b) / (2 D_U).
    pub optimal_relative_count_paper: f64,
    /// t_exe at n_opt (4), seconds.
    pub execution_s: Option<f64>,
    /// 𝒩 at n_opt (3).
    pub nominal_count: Option<f64>,
    /// t_cycle at n_opt (9), seconds.
    pub cycle_s: Option<f64>,
    /// p at n_opt (5).
    pub failure_probability: Option<f64>,
    /// T0_max (16) in its exact form: the mission in which one failure is expected, seconds.
    pub max_mission_s: Option<f64>,
    /// T0_max as printed in the paper (for I far below a and b), seconds.
    pub max_mission_paper_s: f64,
    /// The mission at n_opt in which a failure has a probability of 5 %, seconds.
    pub mission_within_risk_s: Option<f64>,
}

/// The parallel mode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParallelForecast {
    /// Why the mode does not work; absent where it does.
    pub fails: Option<String>,
    /// t1 (21), seconds.
    pub stable_s: Option<f64>,
    /// t2 (22): the longest time without a fix from which searches settle, seconds.
    pub unstable_s: Option<f64>,
    /// The search time at which the sequence settles from `without_fix_s`, seconds.
    pub settles_at_s: Option<f64>,
    /// 𝒩 there (17).
    pub nominal_count: Option<f64>,
    /// The largest drift at which searches settle, metres.
    pub max_unit_drift_m: f64,
    /// b / t0: the speed at which relative registrations lose their overlap, m/s.
    pub max_speed_mps: f64,
}

/// The combined mode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CombinedForecast {
    /// Why the mode does not work; absent where it does.
    pub fails: Option<String>,
    /// The search time at which searches settle, seconds.
    pub stable_s: Option<f64>,
    /// The longest time without a fix from which searches settle, seconds. It is not guaranteed where the aircraft can turn by
    /// more than a quarter of a turn in that time, because the area is not a bound there.
    pub unstable_s: Option<f64>,
    /// The search time at which the sequence settles from `without_fix_s`, seconds.
    pub settles_at_s: Option<f64>,
    /// 𝒩 there; absent beyond a quarter of a turn.
    pub nominal_count: Option<f64>,
    /// The angle by which the aircraft can turn during a search there, radians.
    pub turned_rad: Option<f64>,
    /// The duration of a quarter of a turn, seconds. No bound is claimed for a longer time without a fix.
    pub quarter_turn_s: f64,
    /// The largest speed at which searches settle, m/s.
    pub max_speed_mps: f64,
    /// That speed as printed in the paper, b / K1, m/s.
    pub max_speed_paper_mps: f64,
}

/// Which mode to use.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Advice {
    /// The mode to use; `None` where no mode works.
    pub mode: Option<Mode>,
    /// Why.
    pub why: String,
}

impl Forecast {
    /// Makes the forecast for an aircraft with a calibration, over a map of `map_gsd_m_per_px` (by default the one that the
    /// aircraft's file states).
    ///
    /// # Errors
    /// [`PlanError::Coupling`] where a parameter is outside the models' domain.
    pub fn new(
        aircraft: &Aircraft,
        calibration: &Calibration,
        map_gsd_m_per_px: Option<f64>,
    ) -> Result<Self, PlanError> {
        let parameters = aircraft.parameters(calibration, map_gsd_m_per_px)?;
        let limit_s = scan_limit_s(parameters.along_m, parameters.speed_mps)?;
        let blind = (parameters.relative_s >= limit_s).then(|| {
            format!(
                "a relative registration takes {:.3} s, in which the image is left ({limit_s:.3} s)",
                parameters.relative_s
            )
        });
        let mut sequential = forecast_sequential(parameters)?;
        let mut parallel = forecast_parallel(parameters, aircraft.without_fix_s)?;
        let combined = forecast_combined(parameters, aircraft.without_fix_s)?;
        if !aircraft.parallel_registrations {
            parallel.fails.get_or_insert_with(|| "parallel_registrations = false".into());
        }
        if let Some(blind) = blind {
            sequential.fails.get_or_insert_with(|| blind.clone());
            parallel.fails.get_or_insert(blind);
        }
        let advice = advise(&sequential, &parallel, &combined);
        let gsd_m_per_px = aircraft.frame_gsd_m_per_px()?;
        Ok(Self { parameters, gsd_m_per_px, scan_limit_s: limit_s, sequential, parallel, combined, advice })
    }
}

fn forecast_sequential(parameters: CouplingParameters) -> Result<SequentialForecast, CouplingError> {
    let model = Sequential::new(parameters)?;
    let mut found = SequentialForecast {
        fails: None,
        max_speed_mps: model.max_speed_mps(),
        max_relative_count: None,
        best_relative_count: None,
        optimal_relative_count_paper: model.optimal_relative_count_paper(),
        execution_s: None,
        nominal_count: None,
        cycle_s: None,
        failure_probability: None,
        max_mission_s: None,
        max_mission_paper_s: model.max_mission_paper_s(),
        mission_within_risk_s: None,
    };
    let most = match model.max_relative_count() {
        Ok(most) => most,
        Err(error) => {
            found.fails = Some(error.to_string());
            return Ok(found);
        }
    };
    found.max_relative_count = Some(most);
    let best = model.best_whole_relative_count()?;
    found.best_relative_count = Some(best);
    found.max_mission_s = Some(model.max_mission_s()?);
    if best < 1 {
        found.fails = Some(format!("n_max is {most:.2}: not one relative registration fits between two absolute ones"));
    }
    // Without drift n has no limit, and nothing at n_opt is finite.
    if most.is_finite() {
        let n = best as f64;
        let (p, cycle_s) = (model.failure_probability(n)?, model.cycle_s(n)?);
        found.execution_s = Some(model.execution_s(n)?);
        found.nominal_count = Some(model.nominal_count(n)?);
        (found.cycle_s, found.failure_probability) = (Some(cycle_s), Some(p));
        found.mission_within_risk_s = (p < 1.0).then(|| mission_within_risk_s(p, cycle_s, RISK)).transpose()?;
    }
    Ok(found)
}

fn forecast_parallel(parameters: CouplingParameters, start_s: f64) -> Result<ParallelForecast, CouplingError> {
    let model = Parallel::new(parameters)?;
    let sequence = model.sequence()?;
    let points = sequence.fixed_points();
    let settled = sequence.limit_s(start_s);
    Ok(ParallelForecast {
        fails: settled.as_ref().err().map(ToString::to_string),
        stable_s: points.map(|p: FixedPoints| p.stable_s),
        unstable_s: points.map(|p| p.unstable_s),
        settles_at_s: settled.as_ref().ok().copied(),
        nominal_count: settled.ok().map(|t| model.nominal_count(t)).transpose()?,
        max_unit_drift_m: model.max_unit_drift_m(),
        max_speed_mps: model.max_speed_mps(),
    })
}

fn forecast_combined(parameters: CouplingParameters, start_s: f64) -> Result<CombinedForecast, CouplingError> {
    let model = Combined::new(parameters)?;
    let sequence = model.sequence()?;
    let points = sequence.fixed_points();
    let settled = sequence.limit_s(start_s);
    let settles_at_s = settled.as_ref().ok().copied();
    let turned_rad = settles_at_s.map(|t| model.turned_rad(t)).transpose()?;
    let start_rad = model.turned_rad(start_s)?;
    let beyond = |turned: f64| turned > FRAC_PI_2;
    let fails = match &settled {
        Err(error) => Some(error.to_string()),
        Ok(_) if beyond(start_rad) || turned_rad.is_some_and(beyond) => {
            Some("more than a quarter of a turn is flown during a search: no bound of the area is claimed".into())
        }
        Ok(_) => None,
    };
    let bounded = settles_at_s.filter(|_| turned_rad.is_some_and(|t| !beyond(t)));
    Ok(CombinedForecast {
        fails,
        stable_s: points.map(|p| p.stable_s),
        unstable_s: points.map(|p| p.unstable_s),
        settles_at_s,
        nominal_count: bounded.map(|t| model.nominal_count(t)).transpose()?,
        turned_rad,
        quarter_turn_s: FRAC_PI_2 * parameters.min_turn_radius_m / parameters.speed_mps,
        max_speed_mps: model.max_speed_mps(),
        max_speed_paper_mps: model.max_speed_paper_mps(),
    })
}

/// Advises the working mode whose absolute registration takes the least time where it settles. That mode searches the least
/// ground, so a false or a missing fix is the least likely. The first of equal modes is taken.
pub(super) fn advise(s: &SequentialForecast, p: &ParallelForecast, c: &CombinedForecast) -> Advice {
    let modes = [
        (Mode::Parallel, &p.fails, p.settles_at_s, p.nominal_count),
        (Mode::Sequential, &s.fails, s.execution_s.or(s.max_relative_count.map(|_| f64::INFINITY)), s.nominal_count),
        (Mode::Combined, &c.fails, c.settles_at_s, c.nominal_count),
    ];
    let works = modes.iter().filter(|(_, fails, time, _)| fails.is_none() && time.is_some());
    let best = works.min_by(|a, b| a.2.unwrap_or(f64::INFINITY).total_cmp(&b.2.unwrap_or(f64::INFINITY)));
    let told: Vec<String> = modes
        .iter()
        .map(|(mode, fails, time, nominal)| match (fails, time, nominal) {
            (Some(why), ..) => format!("{}: no, {why}", mode.word()),
            (None, Some(t), Some(n)) => format!("{}: {t:.3} s a search, of {n:.2} images' worth of map", mode.word()),
            _ => format!("{}: works without limit of n", mode.word()),
        })
        .collect();
    let mode = best.map(|b| b.0);
    let first = mode.map_or("no mode works".into(), |m| format!("{} searches the least ground", m.word()));
    Advice { mode, why: format!("{first}; {}", told.join("; ")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn aircraft(more: &str) -> Aircraft {
        let text = format!("min_turn_radius_m = 400\nwidth_px = 512\nheight_px = 512\ngsd_m_per_px = 1.19\n{more}");
        toml::from_str(&text).unwrap()
    }

    #[test]
    fn agrees_with_simulated_searches() {
        let a = aircraft("speed_mps = 27.8\nunit_drift_m = 1\n");
        let found = Forecast::new(&a, &Calibration::PROJECT, None).unwrap();
        // Successive searches by the area alone: the parallel mode's 𝒩 from the drift during the previous search.
        let p = found.parameters;
        let mut t = 0.0;
        for _ in 0..1000 {
            let edge = p.inaccuracy_m + 2.0 * p.unit_drift_m * t / p.relative_s;
            t = p.search_constant_s
                + p.seconds_per_tile * (p.across_m + edge) * (p.along_m + edge) / (p.across_m * p.along_m);
        }
        assert!((found.parallel.settles_at_s.unwrap() - t).abs() < 1e-9);
        // A drift of 1 m every 0.011 s widens the search faster than a flight at 27.8 m/s; a twentieth of it does not.
        assert_eq!(found.advice.mode, Some(Mode::Combined));
        let steady = aircraft("speed_mps = 27.8\nunit_drift_m = 0.05\n");
        let advice = Forecast::new(&steady, &Calibration::PROJECT, None).unwrap().advice;
        assert_eq!(advice.mode, Some(Mode::Parallel));
        // At v_max a search without drift takes as long as the flight over one image.
        let area = (p.across_m + p.inaccuracy_m) * (p.along_m + p.inaccuracy_m) / (p.across_m * p.along_m);
        let search_s = p.search_constant_s + p.seconds_per_tile * area;
        assert!((found.sequential.max_speed_mps - p.along_m / search_s).abs() < 1e-6);
    }

    #[test]
    fn a_mode_that_cannot_work_is_not_advised() {
        let one_core = aircraft("speed_mps = 27.8\nparallel_registrations = false\n");
        let found = Forecast::new(&one_core, &Calibration::PROJECT, None).unwrap();
        assert!(found.parallel.fails.is_some() && found.advice.mode != Some(Mode::Parallel), "{:?}", found.advice);
        let hopeless = aircraft("speed_mps = 1e6\n");
        let found = Forecast::new(&hopeless, &Calibration::PROJECT, None).unwrap();
        assert_eq!(found.advice.mode, None);
        assert!(found.sequential.fails.is_some() && found.parallel.fails.is_some() && found.combined.fails.is_some());
        // With turns on the spot within a search the area is not a bound, and the mode is not claimed to work.
        let mut nimble = aircraft("speed_mps = 27.8\nwithout_fix_s = 60\n");
        nimble.min_turn_radius_m = 1.0;
        let found = Forecast::new(&nimble, &Calibration::PROJECT, None).unwrap();
        assert!(found.combined.fails.is_some(), "{:?}", found.combined);
    }

    #[test]
    fn without_drift_nothing_limits_n() {
        let still = aircraft("speed_mps = 27.8\nunit_drift_m = 0\n");
        let found = Forecast::new(&still, &Calibration::PROJECT, None).unwrap();
        assert_eq!(found.sequential.max_relative_count, Some(f64::INFINITY));
        assert!(found.advice.mode.is_some() && found.sequential.fails.is_none());
    }
}
