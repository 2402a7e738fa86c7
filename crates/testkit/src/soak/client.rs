//! A plain HTTP client with one kept connection, and the service that it asks.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// A complete answer.
pub struct HttpReply {
    pub status: u16,
    pub retry_after: bool,
    pub body: Vec<u8>,
}

impl HttpReply {
    /// The error code of a problem document; empty if there is none.
    pub fn code(&self) -> String {
        let json: serde_json::Value = serde_json::from_slice(&self.body).unwrap_or_default();
        json["code"].as_str().unwrap_or("").to_owned()
    }
}

/// One client.
pub struct HttpClient {
    address: String,
    stream: Option<BufReader<TcpStream>>,
}

impl HttpClient {
    pub fn new(address: &str) -> Self {
        Self { address: address.to_owned(), stream: None }
    }

    /// Opens a connection that this client does not keep.
    pub fn connect(&self) -> std::io::Result<TcpStream> {
        let stream = TcpStream::connect(&self.address)?;
        stream.set_read_timeout(Some(Duration::from_secs(90)))?;
        stream.set_nodelay(true)?;
        Ok(stream)
    }

    /// Sends a complete request and reads its answer. Tries again if the kept connection had been closed.
    pub fn send(&mut self, request: &[u8]) -> std::io::Result<HttpReply> {
        let was_kept = self.stream.is_some();
        match self.try_send(request) {
            Err(_) if was_kept => self.try_send(request),
            other => other,
        }
    }

    fn try_send(&mut self, request: &[u8]) -> std::io::Result<HttpReply> {
        let mut stream = match self.stream.take() {
            Some(stream) => stream,
            None => BufReader::new(self.connect()?),
        };
        // A service that refuses early may close before it has read everything; its answer tells why.
        let sent = stream.get_mut().write_all(request);
        let (reply, keep) = read(&mut stream).or_else(|e| sent.and(Err(e)))?;
        if keep {
            self.stream = Some(stream);
        }
        Ok(reply)
    }

    pub fn get(&mut self, path: &str) -> std::io::Result<HttpReply> {
        self.send(&get(path))
    }
}

/// Reads one answer, and whether the connection can be used again.
pub fn read(stream: &mut BufReader<TcpStream>) -> std::io::Result<(HttpReply, bool)> {
    let broken = |what: &str| std::io::Error::other(format!("no HTTP answer: {what}"));
    let mut line = String::new();
    stream.read_line(&mut line)?;
    let status = line.split(' ').nth(1).and_then(|s| s.parse().ok()).ok_or_else(|| broken(&line))?;
    let (mut length, mut keep, mut retry_after) = (0, true, false);
    loop {
        line.clear();
        stream.read_line(&mut line)?;
        let (name, value) = line.trim().split_once(':').unwrap_or(("", ""));
        match (name.to_ascii_lowercase().as_str(), value.trim()) {
            ("", _) => break,
            ("content-length", n) => length = n.parse().map_err(|_| broken(n))?,
            ("connection", "close") => keep = false,
            ("retry-after", _) => retry_after = true,
            _ => {}
        }
    }
    let mut body = vec![0; length];
    stream.read_exact(&mut body)?;
    Ok((HttpReply { status, retry_after, body }, keep))
}

pub fn get(path: &str) -> Vec<u8> {
    format!("GET {path} HTTP/1.1\r\nhost: localhost\r\n\r\n").into_bytes()
}

/// A multipart form request from the names and bytes of its parts.
pub fn post(path: &str, parts: &[(&str, &[u8])]) -> Vec<u8> {
    let mut body = Vec::new();
    for (name, bytes) in parts {
        body.extend(format!("--b\r\ncontent-disposition: form-data; name=\"{name}\"\r\n\r\n").into_bytes());
        body.extend_from_slice(bytes);
        body.extend_from_slice(b"\r\n");
    }
    body.extend_from_slice(b"--b--\r\n");
    let mut request = format!(
        "POST {path} HTTP/1.1\r\nhost: localhost\r\ncontent-type: multipart/form-data; boundary=b\r\ncontent-length: {}\r\n\r\n",
        body.len()
    )
    .into_bytes();
    request.extend(body);
    request
}

/// A running `overfly serve --onboard`, killed when dropped.
pub struct ServedStore {
    child: Child,
    pub address: String,
}

impl ServedStore {
    /// Starts `program` over a store, with further arguments; its log goes to `log`.
    pub fn start(program: &Path, db: &Path, arguments: &[String], log: &Path) -> Result<Self, String> {
        let mut command = Command::new(program);
        command.arg("serve").arg("--db").arg(db).args(["--onboard", "--listen", "127.0.0.1:0"]).args(arguments);
        Self::start_command(command, log)
    }

    pub fn start_command(mut command: Command, log: &Path) -> Result<Self, String> {
        let errors = std::fs::File::create(log).map_err(|e| e.to_string())?;
        let mut child = command.stdout(Stdio::piped()).stderr(errors).spawn().map_err(|e| e.to_string())?;
        let mut line = String::new();
        let out = child.stdout.take().ok_or("no output")?;
        BufReader::new(out).read_line(&mut line).map_err(|e| e.to_string())?;
        let address = line.trim().strip_prefix("listening on http://").map(str::to_owned);
        match address {
            Some(address) => Ok(Self { child, address }),
            None => {
                let _ = child.kill();
                let _ = child.wait();
                Err(std::fs::read_to_string(log).unwrap_or_default())
            }
        }
    }

    pub fn client(&self) -> HttpClient {
        HttpClient::new(&self.address)
    }

    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Whether the process still runs.
    pub fn lives(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }

    /// A field of the process's `/proc` status in kilobytes: `VmRSS` now, `VmHWM` at most so far.
    pub fn memory_kb(&self, field: &str) -> u64 {
        let text = std::fs::read_to_string(format!("/proc/{}/status", self.pid())).unwrap_or_default();
        let line = text.lines().find(|l| l.starts_with(field)).unwrap_or("");
        line.split_whitespace().nth(1).and_then(|n| n.parse().ok()).unwrap_or(0)
    }
}

impl Drop for ServedStore {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
