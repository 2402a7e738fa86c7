//! `Listen`: the address of the service, and why it cannot listen there.

use std::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;

/// Where to listen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Listen {
    /// An IP address and port; port 0 takes a free one.
    Tcp(SocketAddr),
    /// A Unix socket.
    Unix(PathBuf),
}

impl Listen {
    /// Whether only programs on this machine reach the address: a Unix socket or a loopback address.
    pub fn is_local(&self) -> bool {
        match self {
            Self::Tcp(address) => address.ip().to_canonical().is_loopback(),
            Self::Unix(_) => true,
        }
    }
}

impl FromStr for Listen {
    type Err = ListenError;

    fn from_str(text: &str) -> Result<Self, ListenError> {
        match text.strip_prefix("unix:") {
            Some("") => Err(ListenError::Address { text: text.to_owned() }),
            Some(path) => Ok(Self::Unix(path.into())),
            None => {
                let text = text.strip_prefix("http://").unwrap_or(text).replace("localhost:", "127.0.0.1:");
                text.parse().map(Self::Tcp).map_err(|_| ListenError::Address { text })
            }
        }
    }
}

impl fmt::Display for Listen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp(address) => write!(f, "http://{address}"),
            Self::Unix(path) => write!(f, "unix:{}", path.display()),
        }
    }
}

/// Why the service cannot run.
#[derive(Debug, thiserror::Error)]
pub enum ListenError {
    /// Not an address.
    #[error("{text} is not an address: expected IP:PORT, such as 127.0.0.1:8787, or unix:/path/to/socket")]
    Address {
        /// What was given.
        text: String,
    },
    /// The service cannot listen on the address.
    #[error("cannot listen on {at}: {cause}")]
    Bind {
        /// Where.
        at: Listen,
        /// What the system says.
        cause: std::io::Error,
    },
    /// The path is in use, or is not a socket.
    #[error("{path}: is in use, or is not a socket: remove it or choose another path", path = path.display())]
    Occupied {
        /// The path.
        path: PathBuf,
    },
}

impl ListenError {
    /// A stable word for scripts.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Address { .. } => "address",
            Self::Bind { .. } => "cannot_listen",
            Self::Occupied { .. } => "socket_occupied",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_both_kinds_of_address() {
        assert_eq!("127.0.0.1:8787".parse::<Listen>().unwrap().to_string(), "http://127.0.0.1:8787");
        assert_eq!("localhost:1".parse::<Listen>().unwrap().to_string(), "http://127.0.0.1:1");
        assert_eq!("unix:/run/o.sock".parse::<Listen>().unwrap(), Listen::Unix("/run/o.sock".into()));
        for wrong in ["", "8787", "unix:", "example.org:80", "127.0.0.1:99999"] {
            assert_eq!(wrong.parse::<Listen>().unwrap_err().code(), "address", "{wrong}");
        }
    }
}
