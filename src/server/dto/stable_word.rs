//! `stable_word`: the word for a value of an enum, as answers have it.

use serde::Serialize;

/// Returns the word that `value`, a variant without fields, has in JSON.
pub fn stable_word(value: &impl Serialize) -> String {
    let word = serde_json::to_value(value).ok();
    word.as_ref().and_then(|word| word.as_str()).unwrap_or_default().to_owned()
}
