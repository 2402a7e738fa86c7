//! `object`: a JSON text that must be an object.

use super::form_error::FormError;
use serde::de::DeserializeOwned;

/// Parses the object in `text`, the part `name` of a request.
///
/// # Errors
/// [`FormError::NotJson`]; for a list too, which Serde takes for a struct.
pub(super) fn object<T: DeserializeOwned>(name: &'static str, text: &[u8]) -> Result<T, FormError> {
    if text.iter().find(|b| !b.is_ascii_whitespace()) != Some(&b'{') {
        return Err(FormError::NotJson { name, reason: "expected an object".to_owned() });
    }
    serde_json::from_slice(text).map_err(|e| FormError::NotJson { name, reason: e.to_string() })
}
