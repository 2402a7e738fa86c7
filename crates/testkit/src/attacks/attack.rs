//! `Attack`: what a client does, over and over.

use super::material::AttackMaterial;
use crate::soak::client::{HttpClient, get, read};
use std::collections::BTreeMap;
use std::io::{BufReader, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// As many connections as the service answers in full at the same time.
const HELD: usize = 512;

/// What clients do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Attack {
    /// Nothing: only the prober asks.
    Nothing,
    /// Ask for an export along a zigzag round the earth.
    Zigzag,
    /// Ask for an export along 20 MB of small objects.
    Objects,
    /// As many objects as the service reads.
    ObjectsWithin,
    /// Hold 512 connections with a form that does not arrive.
    SlowBodies,
    /// Hold 512 connections with a head that does not end.
    SlowHeads,
    /// Hold 512 connections, and take no answer.
    DeafReaders,
    /// Send a PNG whose colour profile inflates to 680 MB.
    Profile,
    /// Ask for a tile whose imagery inflates.
    HostileTile,
    /// Ask for a fix over that tile.
    HostileFix,
    /// Ask for fixes anywhere on the map at a wrong scale, and for hints.
    HintedFixes,
    /// Ask for fixes at so coarse a scale that the frame shows several times the map.
    CoarseFixes,
}

impl Attack {
    /// All attacks, and before them none.
    pub const ALL: [Self; 12] = [
        Self::Nothing,
        Self::Zigzag,
        Self::Objects,
        Self::ObjectsWithin,
        Self::SlowBodies,
        Self::SlowHeads,
        Self::DeafReaders,
        Self::Profile,
        Self::HostileTile,
        Self::HostileFix,
        Self::HintedFixes,
        Self::CoarseFixes,
    ];

    /// The name in the table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Zigzag => "zigzag route of 600 positions",
            Self::Objects => "JSON of 20 MB",
            Self::ObjectsWithin => "JSON of 11.9 MB",
            Self::SlowBodies => "512 slow bodies",
            Self::SlowHeads => "512 slow heads",
            Self::DeafReaders => "512 readers that do not read",
            Self::Profile => "PNG that inflates to 680 MB",
            Self::HostileTile => "tile that inflates to 680 MB",
            Self::HostileFix => "fix over that tile",
            Self::HintedFixes => "wide fixes with hints",
            Self::CoarseFixes => "fixes at far too coarse a scale",
        }
    }

    /// Attacks as client number `client` of `clients` until `end`. Returns the answers by status; 0 counts broken connections.
    pub fn run(
        self,
        address: &str,
        material: &AttackMaterial,
        (client, clients): (usize, usize),
        end: Instant,
    ) -> BTreeMap<u16, usize> {
        let share = HELD / clients + usize::from(client < HELD % clients);
        match self {
            Self::Nothing => {
                std::thread::sleep(end.saturating_duration_since(Instant::now()));
                BTreeMap::new()
            }
            Self::Zigzag => ask(address, &material.zigzag, end),
            Self::Objects => ask(address, &material.objects, end),
            Self::ObjectsWithin => ask(address, &material.objects_within, end),
            Self::SlowBodies => hold(address, SLOW_BODY.as_bytes(), b"x", share, end),
            Self::SlowHeads => hold(address, b"GET /healthz HTTP/1.1\r\nhost: localhost\r\n", b"x: y\r\n", share, end),
            Self::DeafReaders => hold(address, &get("/openapi.json").repeat(100), b"", share, end),
            Self::Profile => ask(address, &material.profile, end),
            Self::HostileTile => ask(address, &material.hostile_tile, end),
            Self::HostileFix => ask(address, &material.hostile_fix, end),
            Self::HintedFixes => ask(address, &material.hinted_fix, end),
            Self::CoarseFixes => ask(address, &material.coarse_fix, end),
        }
    }
}

const SLOW_BODY: &str = "POST /v1/fixes HTTP/1.1\r\nhost: localhost\r\ncontent-type: multipart/form-data; boundary=b\r\n\
    content-length: 900000\r\n\r\n--b\r\ncontent-disposition: form-data; name=\"image\"\r\n\r\n";

/// Sends a request again and again, each on a connection of its own.
fn ask(address: &str, request: &[u8], end: Instant) -> BTreeMap<u16, usize> {
    let mut answers = BTreeMap::new();
    while Instant::now() < end {
        let status = ask_once(address, request, end).unwrap_or(0);
        *answers.entry(status).or_default() += 1;
        if matches!(status, 0 | 503) {
            // As a client that tries again soon. Without this, clients that are refused would take all of the processor.
            std::thread::sleep(Duration::from_millis(20));
        }
    }
    answers
}

fn ask_once(address: &str, request: &[u8], end: Instant) -> std::io::Result<u16> {
    let mut stream = HttpClient::new(address).connect()?;
    // At the end nobody waits for the answer any more.
    let left = end.saturating_duration_since(Instant::now()).max(Duration::from_millis(100));
    stream.set_read_timeout(Some(left))?;
    stream.set_write_timeout(Some(left))?;
    // A service that refuses early may close before it has read everything.
    let sent = stream.write_all(request);
    let (reply, _) = read(&mut BufReader::new(stream)).or_else(|error| sent.and(Err(error)))?;
    Ok(reply.status)
}

/// Holds connections on which `begun` was sent, and sends `more` on each every second. Those that were closed are opened again.
fn hold(address: &str, begun: &[u8], more: &[u8], connections: usize, end: Instant) -> BTreeMap<u16, usize> {
    let mut held: Vec<TcpStream> = Vec::new();
    let mut opened = 0;
    while Instant::now() < end {
        held.retain_mut(|stream| more.is_empty() || stream.write_all(more).is_ok());
        while held.len() < connections {
            let Ok(mut stream) = HttpClient::new(address).connect() else { break };
            if stream.set_write_timeout(Some(Duration::from_millis(50))).is_ok() {
                // The socket's buffers need not hold all of it.
                let _ = stream.write_all(begun);
                held.push(stream);
                opened += 1;
            }
        }
        std::thread::sleep(Duration::from_secs(1).min(end.saturating_duration_since(Instant::now())));
    }
    BTreeMap::from([(0, opened)])
}
