//! Freshness: how old a store's imagery may be, and whether it is still valid. A policy is stated, and what it finds is said.

use super::{Date, Manifest, PackageError};
use crate::Layer;
use std::path::Path;
use std::str::FromStr;

/// What to do with a layer older than so many days.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StalePolicy {
    /// Of which layer; of every one where none is named.
    pub layer: Option<String>,
    /// Older than this is stale.
    pub days: u32,
    /// Whether a stale layer is refused, or told of.
    pub refuse: bool,
}

impl FromStr for StalePolicy {
    type Err = String;

    /// `[LAYER:]DAYS=warn` or `[LAYER:]DAYS=refuse`.
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

/// Something of a store's age that is told of and not refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// A stable word.
    pub code: &'static str,
    /// For people.
    pub message: String,
}

/// Judges a store's age on a day. A layer's age is that of its oldest source; one whose sources are of unknown date is stale
/// by any policy. Where any date is to be judged, a clock behind the newest imagery is refused: it cannot be right.
///
/// # Errors
/// [`PackageError::Expired`], [`PackageError::Stale`], [`PackageError::Clock`].
pub fn freshness(
    path: &Path,
    layers: &[Layer],
    manifest: Option<&Manifest>,
    policies: &[StalePolicy],
    today: Date,
) -> Result<Vec<Finding>, PackageError> {
    let valid_until = manifest.and_then(Manifest::valid_until);
    let dates = layers.iter().filter_map(|l| l.acquired.as_ref());
    let newest = dates.filter_map(|(_, last)| Date::of_acquired(last)).max();
    let judged = valid_until.is_some() || !policies.is_empty();
    if let Some(newest) = newest.filter(|&n| judged && n > today) {
        return Err(PackageError::Clock { path: path.into(), today, newest });
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

/// What makes a layer stale by a policy, if anything.
fn stale(layer: &Layer, policy: &StalePolicy, today: Date) -> Option<String> {
    let (name, most) = (&layer.name, policy.days);
    let Some(oldest) = layer.acquired.as_ref().and_then(|(first, _)| Date::of_acquired(first)) else {
        return Some(format!("layer {name} is of unknown date, and at most {most} days are allowed"));
    };
    let days = today.days_since(oldest);
    let told = format!("layer {name} holds imagery of {oldest}, {days} days old, and at most {most} are allowed");
    (days > i64::from(most)).then_some(told)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(name: &str, acquired: Option<(&str, &str)>) -> Layer {
        Layer {
            name: name.into(),
            base_zoom: 14,
            min_zoom: 13,
            base_tiles: 1,
            tiles: 2,
            bounds_deg: [0.0; 4],
            acquired: acquired.map(|(a, b)| (a.into(), b.into())),
            complete: true,
            digest: None,
        }
    }

    fn judge(layers: &[Layer], policies: &[&str], today: &str) -> Result<Vec<Finding>, &'static str> {
        let policies: Vec<StalePolicy> = policies.iter().map(|p| p.parse().unwrap()).collect();
        freshness(Path::new("a.gpkg"), layers, None, &policies, today.parse().unwrap()).map_err(|e| e.code())
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
        assert_eq!(judge(&layers, &["9999=refuse"], "2026-11-22"), Err("stale_layer"), "of unknown date");
        assert_eq!(judge(&layers, &["a:3050=warn", "b:1=refuse"], "2026-11-22"), Err("stale_layer"));
        assert_eq!(judge(&layers, &["9999=warn"], "2020-08-30"), Err("clock_implausible"));
    }

    #[test]
    fn reads_policies_as_they_are_written() {
        let read = |text: &str| text.parse::<StalePolicy>();
        assert_eq!(read("730=warn"), Ok(StalePolicy { layer: None, days: 730, refuse: false }));
        assert_eq!(read("y2012:0=refuse"), Ok(StalePolicy { layer: Some("y2012".into()), days: 0, refuse: true }));
        for wrong in ["", "730", "=warn", "-1=warn", "730=", "730=stop", "a:=warn", "99999999999=warn"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
