//! `PublicAddress`: the address under which a caller reaches the service, perhaps through a proxy.

use axum::http::HeaderMap;
use axum::http::header::{FORWARDED, HOST};

/// Scheme and host of the caller's request, as the proxy or the caller states them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PublicAddress<'a> {
    /// Whether the caller uses HTTPS.
    pub is_https: bool,
    /// Host, with the port if it is not the scheme's own; `None` if unknown or not plain.
    pub host: Option<&'a str>,
}

impl<'a> PublicAddress<'a> {
    /// The address that `Forwarded` (RFC 7239), `X-Forwarded-Proto` and `X-Forwarded-Host`, or `Host` state. Of several proxies
    /// the first counts, which the caller asked. A caller can state anything here: the address must not grant anything.
    pub fn from_headers(headers: &'a HeaderMap) -> Self {
        let first = |name: &str| {
            let value = headers.get(name)?.to_str().ok()?;
            value.split(',').next().map(str::trim).filter(|v| !v.is_empty())
        };
        let forwarded = first(FORWARDED.as_str()).unwrap_or_default();
        let parameter = |wanted: &str| {
            let (_, value) = forwarded
                .split(';')
                .filter_map(|pair| pair.split_once('='))
                .find(|(name, _)| name.trim().eq_ignore_ascii_case(wanted))?;
            Some(value.trim().trim_matches('"'))
        };
        let proto = parameter("proto").or_else(|| first("x-forwarded-proto"));
        let host = parameter("host").or_else(|| first("x-forwarded-host")).or_else(|| first(HOST.as_str()));
        Self {
            is_https: proto.is_some_and(|proto| proto.eq_ignore_ascii_case("https")),
            host: host.filter(|host| !host.is_empty() && host.bytes().all(is_plain)),
        }
    }

    /// The beginning of addresses at this service; empty if the host is unknown, so that addresses are relative.
    pub fn origin(&self) -> String {
        let scheme = if self.is_https { "https" } else { "http" };
        self.host.map_or(String::new(), |host| format!("{scheme}://{host}"))
    }
}

fn is_plain(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || b".-:[]".contains(&byte)
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::{HeaderName, HeaderValue};

    #[test]
    fn a_proxy_states_the_address_that_the_caller_asked() {
        for (given, origin) in [
            (&[("host", "a:1")][..], "http://a:1"),
            (&[("host", "a:1"), ("x-forwarded-proto", "https")], "https://a:1"),
            (
                &[("host", "a:1"), ("x-forwarded-proto", "https, http"), ("x-forwarded-host", "maps.org, b")],
                "https://maps.org",
            ),
            (
                &[("host", "a:1"), ("forwarded", "for=10.0.0.1;Proto=https;host=\"maps.org:8443\", for=b")],
                "https://maps.org:8443",
            ),
            (&[("host", "a:1"), ("forwarded", "proto=https"), ("x-forwarded-host", "b")], "https://b"),
            (&[("host", "a\"><script>")], ""),
            (&[("host", "a"), ("x-forwarded-host", "b/c?d")], ""),
            (&[], ""),
        ] {
            let header = |(name, value): &(&'static str, &'static str)| {
                (HeaderName::from_static(name), HeaderValue::from_static(value))
            };
            let headers: HeaderMap = given.iter().map(header).collect();
            assert_eq!(PublicAddress::from_headers(&headers).origin(), origin, "{given:?}");
        }
    }
}
