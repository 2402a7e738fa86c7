//! `Access`: who may use the service: a token, the hosts that it answers to, and the origins of other pages.

use super::address::Listen;
use super::token::Token;
use axum::http::uri::Authority;
use axum::http::{HeaderValue, Uri};

/// Who may use the service. By default everyone who can reach it, under any host, except pages of other origins.
#[derive(Debug, Clone, Default)]
pub struct Access {
    pub(super) token: Option<Token>,
    /// The names that the header `Host` may have, in lower case; `None`: any.
    pub(super) hosts: Option<Vec<String>>,
    /// Pages of these origins may use the service.
    pub(super) origins: Vec<HeaderValue>,
}

/// What the operator states about access.
#[derive(Debug, Clone, Default)]
pub struct AccessOptions {
    /// The token that callers must know.
    pub token: Option<Token>,
    /// Serve without a token whoever reaches the address.
    pub is_insecure: bool,
    /// Names that the header `Host` may have, besides those of the listener.
    pub allowed_hosts: Vec<String>,
    /// Origins whose pages may use the service, such as `https://maps.example.org`.
    pub allowed_origins: Vec<String>,
}

/// Why the service must not start with the given access.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AccessError {
    /// Others than programs on this machine reach the address, and there is no token.
    #[error("{at} is neither a loopback address nor a Unix socket: everyone who reaches it could use the service")]
    Unprotected {
        /// The address.
        at: String,
    },
    /// Not the name of a host.
    #[error("{name:?} is not the name of a host: expected a name or an IP address, without a port")]
    Host {
        /// What was given.
        name: String,
    },
    /// Not an origin.
    #[error("{text:?} is not an origin: expected SCHEME://HOST[:PORT], such as https://maps.example.org")]
    Origin {
        /// What was given.
        text: String,
    },
}

impl AccessError {
    /// A stable word for scripts.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unprotected { .. } => "unprotected",
            Self::Host { .. } => "host",
            Self::Origin { .. } => "origin",
        }
    }
}

impl Access {
    /// The access to a service that listens on `listen`. The header `Host` is checked where a page in a browser on this machine
    /// could reach the service by DNS rebinding (a loopback address, no token), and wherever hosts are stated.
    ///
    /// # Errors
    /// [`AccessError`].
    pub fn new(listen: &Listen, options: AccessOptions) -> Result<Self, AccessError> {
        let AccessOptions { token, is_insecure, allowed_hosts, allowed_origins } = options;
        if !listen.is_local() && token.is_none() && !is_insecure {
            return Err(AccessError::Unprotected { at: listen.to_string() });
        }
        let mut hosts = allowed_hosts.iter().map(|name| host(name)).collect::<Result<Vec<_>, _>>()?;
        let is_checked = match listen {
            Listen::Tcp(_) => !hosts.is_empty() || (listen.is_local() && token.is_none()),
            Listen::Unix(_) => !hosts.is_empty(),
        };
        hosts.extend(["localhost", "127.0.0.1", "[::1]"].map(str::to_owned));
        if let Listen::Tcp(address) = listen {
            hosts.push(match address.ip() {
                std::net::IpAddr::V4(ip) => ip.to_string(),
                std::net::IpAddr::V6(ip) => format!("[{ip}]"),
            });
        }
        let origins = allowed_origins.iter().map(|text| origin(text)).collect::<Result<Vec<_>, _>>()?;
        Ok(Self { token, hosts: is_checked.then_some(hosts), origins })
    }
}

fn host(name: &str) -> Result<String, AccessError> {
    let is_host = name.parse::<Authority>().is_ok_and(|authority| authority.host() == name);
    if is_host { Ok(name.to_ascii_lowercase()) } else { Err(AccessError::Host { name: name.to_owned() }) }
}

fn origin(text: &str) -> Result<HeaderValue, AccessError> {
    let wrong = || AccessError::Origin { text: text.to_owned() };
    let uri: Uri = text.parse().map_err(|_| wrong())?;
    let (scheme, authority) = uri.scheme_str().zip(uri.authority()).ok_or_else(wrong)?;
    let canonical = format!("{scheme}://{authority}").to_ascii_lowercase();
    // A path, a query or a user's name would never equal what browsers send.
    if !text.eq_ignore_ascii_case(&canonical) || authority.as_str().contains('@') {
        return Err(wrong());
    }
    HeaderValue::from_str(&canonical).map_err(|_| wrong())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn access(listen: &str, options: AccessOptions) -> Result<Access, AccessError> {
        Access::new(&listen.parse().unwrap(), options)
    }

    #[test]
    fn what_others_reach_needs_a_token_or_a_word() {
        for at in ["127.0.0.1:1", "127.8.0.1:1", "[::1]:1", "[::ffff:127.0.0.1]:1", "unix:/o.sock"] {
            assert!(access(at, AccessOptions::default()).is_ok(), "{at}");
        }
        for at in ["0.0.0.0:1", "[::]:1", "192.168.0.1:1"] {
            assert_eq!(access(at, AccessOptions::default()).unwrap_err().code(), "unprotected", "{at}");
            assert!(access(at, AccessOptions { is_insecure: true, ..Default::default() }).is_ok());
            let token = Token::parse("0123456789abcdef").ok();
            assert!(access(at, AccessOptions { token, ..Default::default() }).is_ok());
        }
    }

    #[test]
    fn hosts_are_checked_on_loopback_without_a_token() {
        let hosts = |at: &str, options| access(at, options).unwrap().hosts;
        let plain = hosts("127.0.0.2:1", AccessOptions::default()).unwrap();
        assert_eq!(plain, ["localhost", "127.0.0.1", "[::1]", "127.0.0.2"]);
        let token = Token::parse("0123456789abcdef").ok();
        assert_eq!(hosts("127.0.0.1:1", AccessOptions { token, ..Default::default() }), None);
        assert_eq!(hosts("unix:/o.sock", AccessOptions::default()), None);
        let named = || AccessOptions { is_insecure: true, allowed_hosts: vec!["Map.lan".into()], ..Default::default() };
        assert!(hosts("0.0.0.0:1", named()).unwrap().contains(&"map.lan".to_owned()));
    }

    #[test]
    fn hosts_and_origins_are_read_strictly() {
        for name in ["", "a:80", "http://a", "a b", "u@a"] {
            let options = AccessOptions { allowed_hosts: vec![name.into()], ..Default::default() };
            assert_eq!(access("127.0.0.1:1", options).unwrap_err().code(), "host", "{name:?}");
        }
        let origins = |text: &str| {
            let options = AccessOptions { allowed_origins: vec![text.into()], ..Default::default() };
            access("127.0.0.1:1", options).map(|access| access.origins)
        };
        assert_eq!(origins("https://Maps.org:8443").unwrap(), ["https://maps.org:8443"]);
        for text in ["", "*", "null", "maps.org", "https://maps.org/", "https://maps.org/a", "https://u@maps.org"] {
            assert_eq!(origins(text).unwrap_err().code(), "origin", "{text:?}");
        }
    }
}
