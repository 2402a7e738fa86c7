//! `FormError`: why a form is refused.

/// Why a form is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum FormError {
    #[error("expected a multipart/form-data body: {reason}")]
    NotMultipart { reason: String },
    #[error("the body is larger than {limit_bytes} bytes")]
    TooLarge { limit_bytes: usize },
    #[error("the body did not arrive within {limit_s} s")]
    TooSlow { limit_s: f64 },
    #[error("the body arrives too slowly: less than {bytes} bytes in {window_s} s")]
    Stalled { bytes: usize, window_s: f64 },
    #[error("the body is incomplete or not well formed: {reason}")]
    Broken { reason: String },
    #[error("part {name} is missing")]
    Missing { name: &'static str },
    #[error("part {name} is given twice")]
    Repeated { name: &'static str },
    #[error("this form has no part {name:?}; it takes {expected}")]
    Unknown { name: String, expected: String },
    #[error("{} is not the expected JSON: {reason}", json_text(name))]
    NotJson { name: &'static str, reason: String },
}

/// Where a request states JSON: a part of a form, or the whole body.
fn json_text(name: &str) -> String {
    if name == "body" { "the body".into() } else { format!("part {name}") }
}

impl FormError {
    pub(super) fn code(&self) -> &'static str {
        match self {
            Self::NotMultipart { .. } => "not_multipart",
            Self::TooLarge { .. } => "body_too_large",
            Self::TooSlow { .. } | Self::Stalled { .. } => "body_too_slow",
            Self::Broken { .. } => "body_broken",
            Self::Missing { .. } => "part_missing",
            Self::Repeated { .. } => "part_repeated",
            Self::Unknown { .. } => "part_unknown",
            Self::NotJson { .. } => "request_not_valid",
        }
    }

    pub(super) fn part(&self) -> Option<&str> {
        match self {
            Self::Missing { name } | Self::Repeated { name } | Self::NotJson { name, .. } => Some(name),
            Self::Unknown { name, .. } => Some(name),
            Self::NotMultipart { .. }
            | Self::TooLarge { .. }
            | Self::TooSlow { .. }
            | Self::Stalled { .. }
            | Self::Broken { .. } => None,
        }
    }
}
