//! Freshness: whether a store is still valid, and whether its imagery is newer than a policy demands.

use super::date::{acquisition_day, days_between};
use super::{Manifest, PackageError};
use crate::Layer;
use jiff::civil::Date;
use std::path::Path;
use std::str::FromStr;

/// What to do with a layer that is older than a number of days.
///
/// # Example
/// ```
/// use overfly_store::package::StalePolicy;
///
/// let policy: StalePolicy = "y2012:3650=refuse".parse()?;
/// assert_eq!(policy, StalePolicy { layer: Some("y2012".into()), days: 3650, refuse: true });
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StalePolicy {
    /// The layer: every layer if `None`.
    pub layer: Option<String>,
    /// A layer is stale if it is older than this many days.
    pub days: u32,
    /// Whether a stale layer is an error, or only a finding.
    pub refuse: bool,
}

impl FromStr for StalePolicy {
    type Err = String;

    /// Parses `[LAYER:]DAYS=warn` or `[LAYER:]DAYS=refuse`.
    fn from_str(text: &str) -> Result<Self, String> {
        let refuse = || format!("{text:?}: write DAYS=warn, DAYS=refuse or LAYER:DAYS=refuse");
        let (what, action) = text.split_once('=').ok_or_else(refuse)?;
        let (layer, days) = what.split_once(':').map_or((None, what), |(layer, days)| (Some(layer), days));
        let days = Some(days).filter(|d| d.bytes().all(|b| b.is_ascii_digit())).and_then(|d| d.parse().ok());
        let refuses = match action {
            "warn" => false,
            "refuse" => true,
            _ => return Err(refuse()),
        };
        let layer = layer.map(str::to_owned);
        Ok(Self { layer, days: days.ok_or_else(refuse)?, refuse: refuses })
    }
}

/// A warning about the age of a store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// A stable code word.
    pub code: &'static str,
    /// The warning as text.
    pub message: String,
}

/// Days by which imagery that is built may be newer than the clock's day (UTC): in the east of the earth a day begins earlier.
const MOST_DAYS_AHEAD: i64 = 1;

/// Whether imagery of that day cannot exist yet anywhere: the day or the clock is wrong.
pub fn is_future(day: Date, today: Date) -> bool {
    days_between(today, day) > MOST_DAYS_AHEAD
}

/// Checks that no layer holds imagery newer than the clock's day: a clock that stands before it is no clock.
///
/// # Errors
/// [`PackageError::Clock`].
pub fn require_past_imagery<'a>(
    path: &Path,
    layers: impl IntoIterator<Item = &'a Layer>,
    today: Date,
) -> Result<(), PackageError> {
    let dates = layers.into_iter().filter_map(|layer| layer.acquired.as_ref());
    match dates.filter_map(|(_, last)| acquisition_day(last)).max().filter(|&newest| newest > today) {
        Some(newest) => Err(PackageError::Clock { path: path.into(), today, newest }),
        None => Ok(()),
    }
}

/// Checks the last day of a store, and the age of its layers. The age of a layer is the age of its oldest source. A layer of unknown
/// date is stale by any policy. If any date is checked, a clock behind the newest imagery is an error: it cannot be right.
///
/// # Errors
/// [`PackageError::Expired`], [`PackageError::Stale`], [`PackageError::Clock`].
pub fn check_freshness(
    path: &Path,
    layers: &[Layer],
    manifest: Option<&Manifest>,
    policies: &[StalePolicy],
    today: Date,
) -> Result<Vec<Finding>, PackageError> {
    let valid_until = manifest.and_then(Manifest::valid_until);
    if valid_until.is_some() || !policies.is_empty() {
        require_past_imagery(path, layers, today)?;
    }
    if let Some(valid_until) = valid_until.filter(|&until| until < today) {
        return Err(PackageError::Expired { path: path.into(), valid_until, today });
    }
    let mut findings = Vec::new();
    for layer in layers.iter().filter(|l| l.complete) {
        for policy in policies.iter().filter(|p| p.layer.as_ref().is_none_or(|name| *name == layer.name)) {
            let Some(message) = stale(layer, policy, today) else { continue };
            if policy.refuse {
                return Err(PackageError::Stale { path: path.into(), what: message });
            }
            findings.push(Finding { code: "stale_layer", message });
        }
    }
    Ok(findings)
}

/// Returns why a layer is stale by a policy, if it is.
fn stale(layer: &Layer, policy: &StalePolicy, today: Date) -> Option<String> {
    let (name, most) = (&layer.name, policy.days);
    let Some(oldest) = layer.acquired.as_ref().and_then(|(first, _)| acquisition_day(first)) else {
        return Some(format!("layer {name} has an unknown date, and at most {most} days are allowed"));
    };
    let days = days_between(oldest, today);
    let message = format!("layer {name} holds imagery of {oldest}, {days} days old, and at most {most} are allowed");
    (days > i64::from(most)).then_some(message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::package::parse_date;

    fn layer(name: &str, acquired: Option<(&str, &str)>) -> Layer {
        Layer {
            name: name.into(),
            base_zoom: 14,
            min_zoom: 13,
            base_tiles: 1,
            tiles: 2,
            bounds_deg: [0.0; 4].into(),
            acquired: acquired.map(|(a, b)| (a.into(), b.into())),
            complete: true,
            digest: None,
            terms: Default::default(),
            terrain: None,
        }
    }

    fn judge(layers: &[Layer], policies: &[&str], today: &str) -> Result<Vec<Finding>, &'static str> {
        let policies: Vec<StalePolicy> = policies.iter().map(|p| p.parse().unwrap()).collect();
        check_freshness(Path::new("a.gpkg"), layers, None, &policies, parse_date(today).unwrap()).map_err(|e| e.code())
    }

    #[test]
    fn warns_or_refuses_by_the_oldest_source_and_by_layer() {
        let layers = [layer("a", Some(("2018-07-16", "2020-08-31"))), layer("b", None)];
        assert_eq!(judge(&layers, &[], "2019-01-01"), Ok(vec![]));
        let all = judge(&layers, &["1000=warn"], "2026-11-22").unwrap();
        assert_eq!(all.len(), 2);
        assert!(all[0].message.contains("3051 days") && all[1].message.contains("unknown date"), "{all:?}");
        assert_eq!(judge(&layers, &["a:3051=refuse"], "2026-11-22"), Ok(vec![]));
        assert_eq!(judge(&layers, &["a:3050=refuse"], "2026-11-22"), Err("stale_layer"));
        assert_eq!(judge(&layers, &["9999=refuse"], "2026-11-22"), Err("stale_layer"), "unknown date");
        assert_eq!(judge(&layers, &["a:3050=warn", "b:1=refuse"], "2026-11-22"), Err("stale_layer"));
        assert_eq!(judge(&layers, &["9999=warn"], "2020-08-30"), Err("clock_implausible"));
    }

    #[test]
    fn parses_policies() {
        let read = |text: &str| text.parse::<StalePolicy>();
        assert_eq!(read("730=warn"), Ok(StalePolicy { layer: None, days: 730, refuse: false }));
        assert_eq!(read("y2012:0=refuse"), Ok(StalePolicy { layer: Some("y2012".into()), days: 0, refuse: true }));
        for wrong in ["", "730", "=warn", "-1=warn", "730=", "730=stop", "a:=warn", "99999999999=warn"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
