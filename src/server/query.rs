//! `Query`: a query string, read strictly: parameters are known, given once, and finite numbers where numbers are expected.

/// Why a query string is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum QueryError {
    #[error("this path has no parameter {name}; it takes {}", listed(known))]
    Unknown { name: String, known: &'static [&'static str] },
    #[error("{name} is given twice")]
    Repeated { name: &'static str },
    #[error("{name} = {found:?} is not a number")]
    NotANumber { name: &'static str, found: String },
    #[error("{name} = {found:?} is not a finite number")]
    NotFinite { name: &'static str, found: String },
    #[error("{name} = {found:?} is not a whole number of at least 0")]
    NotWhole { name: &'static str, found: String },
    #[error("{name} is empty")]
    Empty { name: &'static str },
}

fn listed(known: &[&str]) -> String {
    if known.is_empty() { "none".to_owned() } else { known.join(", ") }
}

impl QueryError {
    pub(super) fn code(&self) -> &'static str {
        match self {
            Self::Unknown { .. } => "parameter_unknown",
            Self::Repeated { .. } => "parameter_repeated",
            Self::NotANumber { .. } | Self::NotWhole { .. } => "parameter_not_a_number",
            Self::NotFinite { .. } => "parameter_not_finite",
            Self::Empty { .. } => "parameter_empty",
        }
    }

    pub(super) fn parameter(&self) -> &str {
        match self {
            Self::Unknown { name, .. } => name,
            Self::Repeated { name }
            | Self::NotANumber { name, .. }
            | Self::NotFinite { name, .. }
            | Self::NotWhole { name, .. }
            | Self::Empty { name } => name,
        }
    }
}

/// The parameters of a query string.
#[derive(Debug, Clone, Default)]
pub(super) struct Query {
    given: Vec<(&'static str, String)>,
}

impl Query {
    /// Reads a query string with the `known` parameters, each at most once.
    ///
    /// # Errors
    /// [`QueryError::Unknown`], [`QueryError::Repeated`].
    pub(super) fn read(raw: Option<&str>, known: &'static [&'static str]) -> Result<Self, QueryError> {
        let mut given: Vec<(&'static str, String)> = Vec::new();
        for (name, value) in form_urlencoded::parse(raw.unwrap_or_default().as_bytes()) {
            let Some(&name) = known.iter().find(|k| **k == name) else {
                // Long names are cut: they are not sent back whole.
                return Err(QueryError::Unknown { name: name.chars().take(64).collect(), known });
            };
            if given.iter().any(|(other, _)| *other == name) {
                return Err(QueryError::Repeated { name });
            }
            given.push((name, value.into_owned()));
        }
        Ok(Self { given })
    }

    /// The text of a parameter; `None` if it is not given.
    ///
    /// # Errors
    /// [`QueryError::Empty`].
    pub(super) fn text(&self, name: &'static str) -> Result<Option<String>, QueryError> {
        let Some((_, value)) = self.given.iter().find(|(given, _)| *given == name) else { return Ok(None) };
        if value.is_empty() { Err(QueryError::Empty { name }) } else { Ok(Some(value.clone())) }
    }

    /// The finite number of a parameter; `None` if it is not given.
    ///
    /// # Errors
    /// [`QueryError`]: empty, not a number, not finite.
    pub(super) fn number(&self, name: &'static str) -> Result<Option<f64>, QueryError> {
        let Some(text) = self.text(name)? else { return Ok(None) };
        let found = || text.chars().take(64).collect();
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            Ok(_) => Err(QueryError::NotFinite { name, found: found() }),
            Err(_) => Err(QueryError::NotANumber { name, found: found() }),
        }
    }

    /// The whole number of a parameter, at most that of a signed integer of 64 bits; `None` if it is not given.
    ///
    /// # Errors
    /// [`QueryError`]: empty, not a whole number.
    pub(super) fn whole(&self, name: &'static str) -> Result<Option<u64>, QueryError> {
        let Some(text) = self.text(name)? else { return Ok(None) };
        match text.parse::<i64>().ok().and_then(|value| u64::try_from(value).ok()) {
            Some(value) => Ok(Some(value)),
            None => Err(QueryError::NotWhole { name, found: text.chars().take(64).collect() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: &[&str] = &["a_m", "b_m", "layer"];

    fn number(raw: &str) -> Result<Option<f64>, &'static str> {
        Query::read(Some(raw), KNOWN).and_then(|q| q.number("a_m")).map_err(|e| e.code())
    }

    #[test]
    fn takes_each_parameter_once() {
        assert_eq!(number("a_m=1.5e2&b_m=2"), Ok(Some(150.0)));
        assert_eq!(number("b_m=2"), Ok(None));
        assert_eq!(number("a%5Fm=%31"), Ok(Some(1.0)));
        assert_eq!(number("a_m=1&a_m=1"), Err("parameter_repeated"));
        assert_eq!(number("a_m=1&A_M=1"), Err("parameter_unknown"));
    }

    #[test]
    fn refuses_what_is_not_a_finite_number() {
        for (raw, code) in [
            ("a_m=NaN", "parameter_not_finite"),
            ("a_m=-inf", "parameter_not_finite"),
            ("a_m=1e999", "parameter_not_finite"),
            ("a_m=", "parameter_empty"),
            ("a_m", "parameter_empty"),
            ("a_m=1,5", "parameter_not_a_number"),
            ("a_m=0x10", "parameter_not_a_number"),
            ("a_m=%ff", "parameter_not_a_number"),
        ] {
            assert_eq!(number(raw), Err(code), "{raw}");
        }
    }
}
