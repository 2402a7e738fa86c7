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
    serde_json::from_slice(text).map_err(|e| FormError::NotJson { name, reason: plain(&e.to_string()) })
}

/// The words of the parser, with the types of JSON instead of those of this program.
fn plain(reason: &str) -> String {
    let plain_word = |word: &str| match word {
        "f64" | "f32" => Some("a number"),
        "u8" | "u16" | "u32" | "u64" | "usize" | "i64" | "i32" => Some("a whole number"),
        _ => None,
    };
    let Some((before, expected)) = reason.split_once("expected ") else { return reason.to_owned() };
    let (word, rest) = expected.split_once(' ').map_or((expected, String::new()), |(w, rest)| (w, format!(" {rest}")));
    if let Some(plain) = plain_word(word) {
        return format!("{before}expected {plain}{rest}");
    }
    // `struct Document at line 1 column 2`
    let at = rest.find(" at line").map_or("", |at| &rest[at..]);
    match word {
        "struct" | "map" => format!("{before}expected an object{at}"),
        _ => reason.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_word_of_the_program_is_in_an_answer() {
        #[derive(Debug, serde::Deserialize)]
        #[allow(dead_code)]
        struct Inner {
            x: f64,
        }
        #[derive(Debug, serde::Deserialize)]
        #[allow(dead_code)]
        struct Outer {
            a: f64,
            b: Option<u8>,
            inner: Option<Inner>,
        }
        let said = |text: &str| object::<Outer>("body", text.as_bytes()).unwrap_err().to_string();
        for (text, part) in [
            (r#"{"a": "x"}"#, r#"the body is not the expected JSON: invalid type: string "x", expected a number at"#),
            (r#"{"a": 1, "b": 300}"#, "invalid value: integer `300`, expected a whole number at line 1"),
            (r#"{"a": 1, "inner": 5}"#, "invalid type: integer `5`, expected an object at line 1"),
            ("{}", "missing field `a`"),
            ("[]", "expected an object"),
        ] {
            assert!(said(text).contains(part), "{}", said(text));
        }
    }
}
