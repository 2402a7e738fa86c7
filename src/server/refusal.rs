//! `Refusal`: why a request is not admitted.

/// Why a request is not admitted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum Refusal {
    #[error(
        "the service does not answer to the host {found:?}: use its address or localhost, or let its operator allow the name"
    )]
    Host { found: String },
    #[error("pages of the origin {found:?} may not use the service, unless its operator allows the origin")]
    Origin { found: String },
    #[error("the service needs its token, and the request has none: send the header `Authorization: Bearer TOKEN`")]
    NoToken,
    #[error("the header Authorization does not begin with `Bearer `: send `Authorization: Bearer TOKEN`")]
    NotBearer,
    #[error(
        "what the request sends is not the token of this service: check it, and that the service was not given another one"
    )]
    WrongToken,
}

impl Refusal {
    pub(super) fn code(&self) -> &'static str {
        match self {
            Self::Host { .. } => "host_not_allowed",
            Self::Origin { .. } => "cross_origin",
            Self::NoToken | Self::NotBearer | Self::WrongToken => "token_required",
        }
    }
}
