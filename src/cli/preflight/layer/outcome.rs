//! What a change of a layer did, or would do, in words.

use crate::cli::output::Output;
use overfly_store::LayerChanged;
use serde::Serialize;
use std::path::Path;

/// A change of a layer as a JSON line.
#[derive(Serialize)]
pub struct Outcome<'a> {
    db: &'a Path,
    /// The layer, under its name before the change.
    layer: &'a str,
    change: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    renamed_to: Option<&'a str>,
    /// Whether nothing was written.
    dry_run: bool,
    /// Tiles of the layer.
    tiles: u64,
    digest_changes: bool,
    digest_before: Option<String>,
    /// `null` where no layer is left, and in a dry run on a store of an older format.
    digest_after: Option<String>,
    #[serde(skip)]
    migrates_from: Option<u32>,
}

impl<'a> Outcome<'a> {
    /// Returns the outcome of a change of the layer.
    pub fn new(change: &'static str, db: &'a Path, layer: &'a str, dry_run: bool, changed: LayerChanged) -> Self {
        let LayerChanged { tiles, digest_before, digest_after, migrates_from } = changed;
        let digest_changes = migrates_from.is_some() || digest_before != digest_after;
        let renamed_to = None;
        Self {
            db,
            layer,
            change,
            renamed_to,
            dry_run,
            tiles,
            digest_changes,
            digest_before,
            digest_after,
            migrates_from,
        }
    }

    /// The outcome of a renaming.
    pub fn renamed_to(self, name: &'a str) -> Self {
        Self { renamed_to: Some(name), ..self }
    }

    /// Prints the outcome; `done` and `planned` say what was done, or what would be.
    pub fn say(&self, output: &Output, done: &str, planned: &str) {
        output.say(self, || {
            let Self { db, layer, tiles, .. } = self;
            let what = if self.dry_run { format!("{planned}; nothing was written") } else { done.to_owned() };
            format!("{}: layer {layer}, {tiles} tiles: {what}\n{}", db.display(), self.digest_text())
        });
    }

    fn digest_text(&self) -> String {
        let or_none = |digest: &Option<String>, none: &str| digest.clone().unwrap_or_else(|| none.into());
        let before = or_none(&self.digest_before, "none");
        if !self.digest_changes {
            return format!("digest {before}, unchanged: exports need not be made anew");
        }
        let after = match self.migrates_from {
            Some(version) if self.digest_after.is_none() => {
                format!("another one, also because the store has format {version} and is migrated")
            }
            None if self.digest_after.is_none() => {
                return format!(
                    "digest {before} -> none: no finished layer is left, and the store answers nothing until one is built"
                );
            }
            _ => or_none(&self.digest_after, "none"),
        };
        let changes = if self.dry_run { "would change" } else { "has changed" };
        format!(
            "digest {before} -> {after}\nThe digest {changes}: exports made from this store before keep the old one; make and sign them anew."
        )
    }
}
