//! `StoreRefusal`: why a store that took the place of the one served is refused.

/// Why a store is refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoreRefusal {
    /// A stable code word.
    pub code: &'static str,
    /// What is wrong, without the server's own paths.
    pub reason: String,
}
