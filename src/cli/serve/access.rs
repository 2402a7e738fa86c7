//! The flags of `overfly serve` that say who may use the service.

use crate::cli::failure::Failure;
use crate::server::{Access, AccessError, AccessOptions, Listen, Token, TokenError};
use std::path::PathBuf;

/// Who may use the service.
#[derive(Debug, clap::Args)]
pub struct AccessArgs {
    /// Serve only callers that send the token in FILE (`Authorization: Bearer TOKEN`): one line of 16 to 1024 letters, digits and
    /// -._~+/=, as `openssl rand -hex 32` prints. The map page asks for it once. /healthz and /readyz need no token.
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// Serve without a token whoever reaches the address. Without this flag, an address that is neither loopback nor a Unix socket
    /// needs --token-file.
    #[arg(long, conflicts_with = "token_file")]
    insecure: bool,
    /// Answer requests for this host name too, as a reverse proxy passes it on; may be repeated. On loopback without a token, only
    /// localhost and the address itself are answered (against DNS rebinding).
    #[arg(long, value_name = "NAME")]
    allowed_host: Vec<String>,
    /// Let pages of this origin use the service (CORS), such as https://maps.example.org; may be repeated. All other origins are
    /// refused what changes anything.
    #[arg(long, value_name = "ORIGIN")]
    allow_origin: Vec<String>,
}

impl AccessArgs {
    /// The access to a service on `listen`.
    ///
    /// # Errors
    /// If the token cannot be read, a value is not valid, or the service would be open to others.
    pub fn access(&self, listen: &Listen) -> Result<Access, Failure> {
        let token = self.token_file.as_deref().map(|path| {
            Token::read(path).map_err(|error| match error {
                TokenError::Unreadable { .. } => Failure::unusable(error.code(), error),
                TokenError::NotAToken => {
                    Failure::unusable(error.code(), anyhow::anyhow!("{}: {error}", path.display()))
                }
            })
        });
        let options = AccessOptions {
            token: token.transpose()?,
            is_insecure: self.insecure,
            allowed_hosts: self.allowed_host.clone(),
            allowed_origins: self.allow_origin.clone(),
        };
        Access::new(listen, options).map_err(|error| {
            let remedy = matches!(error, AccessError::Unprotected { .. })
                .then_some("protect it with `--token-file FILE`, or state `--insecure`");
            Failure::unusable(error.code(), error).with_remedy(remedy)
        })
    }
}
