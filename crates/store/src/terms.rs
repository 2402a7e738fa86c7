//! `Terms`: under what terms a layer's imagery may be used, and whom to name.

use serde::{Deserialize, Serialize};

/// Licence and attribution of a layer, as the user states them.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Terms {
    /// The licence: an SPDX identifier, a name or a URL.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub licence: Option<String>,
    /// Whom a map must name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attribution: Option<String>,
}

impl Terms {
    /// These terms, and those of `before` where these state none.
    pub fn or(&self, before: &Self) -> Self {
        let first = |a: &Option<String>, b: &Option<String>| a.clone().or_else(|| b.clone());
        Self {
            licence: first(&self.licence, &before.licence),
            attribution: first(&self.attribution, &before.attribution),
        }
    }

    /// Whether nothing is stated.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}
