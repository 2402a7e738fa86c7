//! `Refusal`: why a frame gets no fix, and `EarlyEnd`: how a registration ends before its search.

use super::answer::Reason;
use super::error::LocateError;
use overfly_store::StoreError;

/// Why a frame gets no fix.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// The stable reason.
    pub reason: Reason,
    /// The figures behind the reason.
    pub detail: String,
}

impl Refusal {
    /// Returns a reason with its figures.
    pub fn new(reason: Reason, detail: impl Into<String>) -> Self {
        Self { reason, detail: detail.into() }
    }
}

/// Why a registration ends before its search begins.
#[derive(Debug)]
pub enum EarlyEnd {
    /// The answer is "no fix".
    NoFix(Refusal),
    /// The request cannot be answered.
    Error(LocateError),
}

impl From<Refusal> for EarlyEnd {
    fn from(refusal: Refusal) -> Self {
        Self::NoFix(refusal)
    }
}

impl From<LocateError> for EarlyEnd {
    fn from(error: LocateError) -> Self {
        Self::Error(error)
    }
}

impl From<StoreError> for EarlyEnd {
    fn from(error: StoreError) -> Self {
        Self::Error(error.into())
    }
}
