//! The onboard service under bad reads: each answer is the usual one or an error; the service goes on and reports its
//! health.

use super::bench::FaultBench;
use super::reading::ReadTally;
use super::shim::{FaultKind, InjectedFault};
use super::tally::spread;
use overfly_store::Reader;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::Duration;

/// The requests, and the answers of a sound store.
pub struct ServiceReads {
    store: PathBuf,
    questions: Vec<RawRequest>,
    sound: Vec<RawAnswer>,
    counts: Vec<u64>,
}

/// An HTTP request without its host.
struct RawRequest {
    line: String,
    body: Vec<u8>,
}

#[derive(Debug, Clone, PartialEq)]
struct RawAnswer {
    status: u16,
    body: Vec<u8>,
}

struct RunningService {
    child: Child,
    address: String,
}

impl Drop for RunningService {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl ServiceReads {
    /// Asks a sound copy of `store` for tiles, candidates and the place of `frame`.
    pub fn new(bench: &FaultBench, store: &Path, frame: &Path) -> Self {
        let mut serving =
            Self { store: store.into(), questions: questions(store, frame), sound: Vec::new(), counts: Vec::new() };
        let (sound, counts) = serving.run(bench, InjectedFault { kind: FaultKind::Bad, at: 0 }).expect("it starts");
        assert!(sound.iter().all(|a| a.status == 200), "{sound:?}");
        (serving.sound, serving.counts) = (sound, counts);
        serving
    }

    /// Injects at most `most` bad reads of a kind, evenly spread.
    pub fn tally(&self, bench: &FaultBench, kind: FaultKind, most: u64, seed: u64) -> ReadTally {
        let points = kind.points(&self.counts);
        let mut tally = ReadTally { points, ..ReadTally::default() };
        for at in spread(points, most, seed) {
            match self.run(bench, InjectedFault { kind, at }) {
                Err(said) if said.contains("panicked") || !said.contains("target.gpkg") => tally.failures.push(said),
                Err(_) => tally.refused += 1,
                Ok((answers, _)) => match self.judge(&answers) {
                    Ok(0) => tally.answered += 1,
                    Ok(_) if kind != FaultKind::Short => tally.refused += 1,
                    Ok(refused) => tally.failures.push(format!("onboard, {kind:?} at {at}: {refused} refused")),
                    Err(wrong) => tally.failures.push(format!("onboard, {kind:?} at {at}: {wrong}")),
                },
            }
            tally.tried += 1;
        }
        tally
    }

    /// Counts refusals. `Err`: the first answer that is neither a refusal nor that of a sound store.
    fn judge(&self, answers: &[RawAnswer]) -> Result<usize, String> {
        let mut refusals = 0;
        for ((question, found), sound) in self.questions.iter().zip(answers).zip(&self.sound) {
            if found.status >= 500 || found.status == 200 && no_fix(&found.body) {
                refusals += 1;
            } else if found.status != sound.status || !same(&found.body, &sound.body) {
                let body = String::from_utf8_lossy(&found.body).chars().take(300).collect::<String>();
                return Err(format!("{} answers {} {body}", question.line, found.status));
            }
        }
        let health = answers.last().expect("health is asked last");
        if health.status == 200 { Ok(refusals) } else { Err("it does not say how it is".into()) }
    }

    /// Starts the service, sends all requests, and stops it. Returns the answers, and the calls of each kind. `Err`:
    /// the output if it did not start.
    fn run(&self, bench: &FaultBench, fault: InjectedFault) -> Result<(Vec<RawAnswer>, Vec<u64>), String> {
        bench.lay_out(&[("target.gpkg", self.store.clone())].into());
        let words = ["serve", "--onboard", "--listen", "127.0.0.1:0", "--db", "{}/target.gpkg"].map(Into::into);
        let mut command = bench.armed(&words, fault);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program runs");
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("the pipe is open"))
            .read_line(&mut line)
            .expect("the program writes text");
        let json: serde_json::Value = serde_json::from_str(&line).unwrap_or_default();
        let mut errors = child.stderr.take().expect("the pipe is open");
        // Read in a thread, so that the service never waits for it.
        let said = std::thread::spawn(move || {
            let mut said = String::new();
            errors.read_to_string(&mut said).expect("the program writes text");
            said
        });
        let Some(address) = json["listening"].as_str().and_then(|a| a.strip_prefix("http://")) else {
            child.wait().expect("the program runs");
            return Err(line + &said.join().expect("the thread does not panic"));
        };
        let mut running = RunningService { child, address: address.to_owned() };
        let answers: Vec<RawAnswer> = self.questions.iter().map(|q| running.ask(q)).collect();
        let told = std::process::Command::new("kill")
            .args(["-TERM", &running.child.id().to_string()])
            .status()
            .expect("the program runs");
        assert!(told.success() && running.child.wait().expect("the program runs").success());
        let said = said.join().expect("the thread does not panic");
        if said.contains("panicked") {
            return Err(said);
        }
        Ok((answers, bench.report().counts))
    }
}

impl RunningService {
    fn ask(&self, question: &RawRequest) -> RawAnswer {
        let mut stream = TcpStream::connect(&self.address).expect("the service listens");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("the service answers");
        let (line, len) = (&question.line, question.body.len());
        let head = format!(
            "{line} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\ncontent-type: multipart/form-data; boundary=b\r\n\
             content-length: {len}\r\n\r\n"
        );
        stream.write_all(head.as_bytes()).expect("the service answers");
        stream.write_all(&question.body).expect("the service answers");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("the service answers");
        let split = answer.windows(4).position(|w| w == b"\r\n\r\n").expect("an answer has a head");
        let status = String::from_utf8_lossy(&answer[9..12]).parse().expect("the status is a number");
        RawAnswer { status, body: answer[split + 4..].to_vec() }
    }
}

fn questions(store: &Path, frame: &Path) -> Vec<RawRequest> {
    let get = |path: String| RawRequest { line: format!("GET {path}"), body: Vec::new() };
    let reader = Reader::open(store).expect("the sound store opens");
    let layer = &reader.layers()[0];
    let tiles = reader.footprints(layer, layer.base_zoom).expect("the sound store reads");
    let mut all: Vec<_> =
        tiles.iter().step_by(5).map(|f| get(format!("/v1/tiles/{}/{}", layer.name, f.tile))).collect();
    let around = "latitude_deg=48.4915&longitude_deg=15.6145&heading_deg=270&across_m=200&along_m=200";
    all.push(get(format!("/v1/candidates?{around}&inaccuracy_m=20&drift_m=100")));
    let prior = serde_json::json!({
        "latitude_deg": 48.4915, "longitude_deg": 15.616, "sigma_m": 150.0, "heading_deg": 271.6, "gsd_m_per_px": 1.25,
    });
    let mut body = b"--b\r\ncontent-disposition: form-data; name=\"image\"\r\n\r\n".to_vec();
    body.extend(std::fs::read(frame).expect("the rig reads and writes its own files"));
    body.extend_from_slice(b"\r\n--b\r\ncontent-disposition: form-data; name=\"request\"\r\n\r\n");
    body.extend(prior.to_string().into_bytes());
    body.extend_from_slice(b"\r\n--b--\r\n");
    all.push(RawRequest { line: "POST /v1/fixes".into(), body });
    all.push(get("/healthz".into()));
    all
}

fn json(body: &[u8]) -> serde_json::Value {
    serde_json::from_slice(body).unwrap_or_default()
}

fn no_fix(body: &[u8]) -> bool {
    json(body)["status"] == "no_fix"
}

/// Whether two answers are equal: byte for byte; a fix within 3 m, because a damaged tile is left out. The health may
/// say anything.
fn same(found: &[u8], sound: &[u8]) -> bool {
    let (a, b) = (json(found), json(sound));
    let off_deg = |key: &str| Some((a[key].as_f64()? - b[key].as_f64()?).abs());
    match (off_deg("latitude_deg"), off_deg("longitude_deg")) {
        (Some(north_deg), Some(east_deg)) if b["status"] == "fix" => north_deg < 2.7e-5 && east_deg < 4.0e-5,
        _ => found == sound || sound == b"ok\n",
    }
}
