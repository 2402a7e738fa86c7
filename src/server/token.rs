//! `Token`: the secret that callers of a protected service know.

use overfly_store::read_small_text;
use std::path::{Path, PathBuf};
use subtle::ConstantTimeEq;

/// Shortest and longest token, characters.
const LENGTHS: std::ops::RangeInclusive<usize> = 16..=1024;
/// Separates the hash in cookies from other uses of the token.
const COOKIE_CONTEXT: &str = "overfly 2026-11-29 session cookie";

/// A bearer token (RFC 6750). Only its hashes are held.
#[derive(Clone, PartialEq, Eq)]
pub struct Token {
    hash: blake3::Hash,
    /// What the session cookie contains: it does not disclose the token.
    cookie: blake3::Hash,
}

/// Why there is no token.
#[derive(Debug, thiserror::Error)]
pub enum TokenError {
    /// The file cannot be read.
    #[error("{}: {cause}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// The text is not a token.
    #[error("not a token: expected one line of {} to {} letters, digits and -._~+/=", LENGTHS.start(), LENGTHS.end())]
    NotAToken,
}

impl TokenError {
    /// A stable word for scripts.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unreadable { .. } => "unreadable",
            Self::NotAToken => "not_a_token",
        }
    }
}

impl Token {
    /// The token in a text, without surrounding white space.
    ///
    /// # Errors
    /// [`TokenError::NotAToken`].
    pub fn parse(text: &str) -> Result<Self, TokenError> {
        let text = text.trim();
        let is_plain = text.bytes().all(|b| b.is_ascii_alphanumeric() || b"-._~+/=".contains(&b));
        if !is_plain || !LENGTHS.contains(&text.len()) {
            return Err(TokenError::NotAToken);
        }
        let cookie = blake3::derive_key(COOKIE_CONTEXT, text.as_bytes()).into();
        Ok(Self { hash: blake3::hash(text.as_bytes()), cookie })
    }

    /// Reads the token that a file holds.
    ///
    /// # Errors
    /// [`TokenError`].
    pub fn read(path: &Path) -> Result<Self, TokenError> {
        let text = read_small_text(path).map_err(|cause| TokenError::Unreadable { path: path.into(), cause })?;
        Self::parse(&text)
    }

    /// Whether `given` is the token. The time taken depends only on the length of `given`.
    pub(super) fn matches(&self, given: &[u8]) -> bool {
        blake3::hash(given).as_slice().ct_eq(self.hash.as_slice()).into()
    }

    /// The content of the session cookie.
    pub(super) fn cookie(&self) -> String {
        self.cookie.to_hex().to_string()
    }

    /// Whether `given` is the content of the session cookie.
    pub(super) fn matches_cookie(&self, given: &[u8]) -> bool {
        self.cookie.to_hex().as_bytes().ct_eq(given).into()
    }
}

impl std::fmt::Debug for Token {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Token").finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_token_itself_matches() {
        let token = Token::parse("0123456789abcdef\n").unwrap();
        assert!(token.matches(b"0123456789abcdef") && token.matches_cookie(token.cookie().as_bytes()));
        for other in ["", "0123456789abcde", "0123456789abcdef0", "0123456789ABCDEF", &token.cookie()] {
            assert!(!token.matches(other.as_bytes()), "{other}");
        }
        assert!(!token.matches_cookie(b"0123456789abcdef") && !token.matches_cookie(b""));
        assert!(!format!("{token:?}").contains("0123"));
    }

    #[test]
    fn short_and_odd_tokens_are_refused() {
        for text in ["", "short", "0123456789abcdef 0123456789abcdef", "0123456789abcdef\u{e9}", &"x".repeat(1025)] {
            assert_eq!(Token::parse(text).unwrap_err().code(), "not_a_token", "{text}");
        }
    }
}
