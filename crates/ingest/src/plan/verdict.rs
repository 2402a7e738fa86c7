//! What a plan comes to: the mode to use with the route in hand, and one sentence about the route.

use super::forecast::{Advice, Forecast, advise};
use super::matchability::RouteForecast;

/// A map that shows less than this share of a route is probably that of another one.
const LITTLE_MAP: f64 = 0.5;

/// Most gaps that the sentence names.
const NAMED_GAPS: usize = 4;

impl Forecast {
    /// The forecast with the route in hand: a mode that does not hold through the route's longest gap does not work, and the advice
    /// is among the others.
    pub fn along(mut self, route: &RouteForecast) -> Self {
        let gap = &route.longest_gap;
        let place = format!("the gap from km {:.1} to {:.1}", gap.from_m / 1e3, gap.to_m / 1e3);
        if gap.execution_s >= self.scan_limit_s {
            let why = format!("the search after {place} takes {:.1} s, in which the image is left", gap.execution_s);
            self.sequential.fails.get_or_insert(why);
        }
        if !gap.parallel_holds {
            self.parallel.fails.get_or_insert(format!("its searches do not settle after {place}"));
        }
        if !gap.combined_holds {
            let why = "its searches do not settle, or more than a quarter of a turn can be flown, in";
            self.combined.fails.get_or_insert(format!("{why} {place}"));
        }
        self.advice = advise(&self.sequential, &self.parallel, &self.combined);
        if route.with_map == 0.0 {
            self.advice = Advice { mode: None, why: "the map does not show the route, so no mode has a fix".into() };
        }
        self
    }

    /// The plan in one sentence: where fixes are expected along the route, and the mode.
    pub fn verdict(&self, route: Option<&RouteForecast>) -> String {
        let mode = match self.advice.mode {
            Some(mode) => format!("fly in the {} mode", mode.word()),
            None => "no mode works".to_owned(),
        };
        let Some(route) = route else { return mode };
        if route.with_map == 0.0 {
            return "no fix anywhere: the map does not show the route; check that it is the right route, and that its positions are longitude first".into();
        }
        let gaps = route.gaps_m();
        let named: Vec<String> = gaps
            .iter()
            .take(NAMED_GAPS)
            .map(|[from, to]| format!("from km {:.1} to {:.1}", from / 1e3, to / 1e3))
            .collect();
        let more =
            if gaps.len() > NAMED_GAPS { format!(" and {} more gaps", gaps.len() - NAMED_GAPS) } else { String::new() };
        let none = if named.is_empty() { String::new() } else { format!(", none {}{more}", named.join(", ")) };
        let fixes = format!("fixes on {:.0} % of the route{none}", 100.0 * route.with_fix);
        if route.with_map >= LITTLE_MAP {
            return format!("{fixes}; {mode}");
        }
        let shown = 100.0 * route.with_map;
        format!("the map shows only {shown:.0} % of the route: check that both are the right ones; {fixes}; {mode}")
    }
}

impl RouteForecast {
    /// The stretches in which at least one image has no expected fix: from the fix before, or the start, to the fix after, or the end;
    /// metres from the start.
    pub fn gaps_m(&self) -> Vec<[f64; 2]> {
        let mut gaps: Vec<[f64; 2]> = Vec::new();
        let mut last_fix_m = 0.0;
        let mut open = false;
        for step in &self.steps {
            match (step.fix_expected, open) {
                (false, false) => gaps.push([last_fix_m, step.way_m]),
                (_, true) => gaps.last_mut().expect("a gap is open")[1] = step.way_m,
                (true, false) => {}
            }
            open = !step.fix_expected;
            if step.fix_expected {
                last_fix_m = step.way_m;
            }
        }
        gaps
    }
}

#[cfg(test)]
mod tests {
    use super::super::aircraft::Aircraft;
    use super::super::matchability::{Gap, RouteStep, Thresholds};
    use super::*;
    use overfly_core::coupling::{Calibration, Mode};

    fn forecast() -> Forecast {
        let text = "speed_mps = 27.8\nmin_turn_radius_m = 400\nwidth_px = 512\nheight_px = 512\ngsd_m_per_px = 1.19\n";
        let aircraft: Aircraft = toml::from_str(text).unwrap();
        Forecast::new(&aircraft, &Calibration::PROJECT, None).unwrap()
    }

    fn route(fixes: &[bool], parallel_holds: bool, combined_holds: bool) -> RouteForecast {
        let step = |(index, &fix_expected): (usize, &bool)| RouteStep {
            way_m: 500.0 * index as f64,
            latitude_deg: 48.0,
            longitude_deg: 15.0,
            heading_deg: 90.0,
            covered: 1.0,
            keypoints: 500.0,
            distinctiveness: 0.3,
            fix_expected,
            since_fix_m: 0.0,
            drift_m: 0.0,
            nominal_count: 1.0,
            execution_s: 0.1,
        };
        let steps: Vec<_> = fixes.iter().enumerate().map(step).collect();
        let with_fix = fixes.iter().filter(|f| **f).count() as f64 / fixes.len() as f64;
        let longest_gap = Gap {
            from_m: 500.0,
            to_m: 2000.0,
            duration_s: 50.0,
            relative_count: 100.0,
            drift_m: 10.0,
            nominal_count: 2.0,
            execution_s: 0.1,
            combined_nominal_count: None,
            parallel_holds,
            combined_holds,
        };
        RouteForecast {
            length_m: 500.0 * (fixes.len() - 1) as f64,
            step_m: 500.0,
            thresholds: Thresholds::default(),
            with_map: 1.0,
            with_fix,
            longest_gap,
            steps,
        }
    }

    #[test]
    fn the_mode_holds_through_the_longest_gap() {
        assert_eq!(forecast().advice.mode, Some(Mode::Parallel));
        let fixes = [true, true, false, false, true];
        assert_eq!(forecast().along(&route(&fixes, true, true)).advice.mode, Some(Mode::Parallel));
        let without = forecast().along(&route(&fixes, false, true));
        assert_ne!(without.advice.mode, Some(Mode::Parallel));
        assert!(without.parallel.fails.as_ref().unwrap().contains("km 0.5 to 2.0"), "{:?}", without.parallel.fails);
        let neither = forecast().along(&route(&fixes, false, false));
        assert_eq!(neither.advice.mode, Some(Mode::Sequential));
    }

    #[test]
    fn the_verdict_names_the_share_the_gaps_and_the_mode() {
        let fixes = [true, true, false, false, true, true, true, false];
        let verdict = forecast().verdict(Some(&route(&fixes, true, true)));
        assert_eq!(
            verdict,
            "fixes on 62 % of the route, none from km 0.5 to 2.0, from km 3.0 to 3.5; fly in the parallel mode"
        );
        assert_eq!(forecast().verdict(None), "fly in the parallel mode");
        let all = forecast().verdict(Some(&route(&[true, true], true, true)));
        assert_eq!(all, "fixes on 100 % of the route; fly in the parallel mode");
        let mut none = route(&[false, false], true, true);
        none.with_map = 0.0;
        assert!(forecast().verdict(Some(&none)).starts_with("no fix anywhere"));
        let outside = forecast().along(&none);
        assert!(outside.advice.mode.is_none() && outside.advice.why.contains("does not show the route"), "{outside:?}");
        let mut little = route(&[true, false, false, false], true, true);
        little.with_map = 0.25;
        let verdict = forecast().verdict(Some(&little));
        assert!(verdict.starts_with("the map shows only 25 % of the route: check"), "{verdict}");
    }
}
