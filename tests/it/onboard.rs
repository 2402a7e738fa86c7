//! Onboard: from a read-only folder, as an unprivileged user, everything is answered and nothing is left behind.

use overfly::geodesy::{Geodetic, geodesic_between};
use overfly::tile::TileId;
use std::collections::BTreeMap;
use std::fs::{self, Permissions};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A running `overfly serve`, killed when dropped.
struct Serving {
    child: Child,
    address: String,
}

impl Serving {
    fn start(mut command: Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim().strip_prefix("listening on http://").unwrap_or_else(|| panic!("{line:?}")).to_owned();
        Self { child, address }
    }

    /// Sends a request; returns status and body.
    fn ask(&self, method: &str, path: &str, content_type: &str, body: &[u8]) -> (u16, Vec<u8>) {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let head = format!(
            "{method} {path} HTTP/1.1\r\nhost: {}\r\nconnection: close\r\ncontent-type: {content_type}\r\ncontent-length: {}\r\n\r\n",
            self.address,
            body.len()
        );
        stream.write_all(head.as_bytes()).unwrap();
        stream.write_all(body).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let split = answer.windows(4).position(|w| w == b"\r\n\r\n").unwrap();
        let head = String::from_utf8(answer[..split].to_vec()).unwrap();
        (head.split(' ').nth(1).unwrap().parse().unwrap(), answer[split + 4..].to_vec())
    }

    fn get(&self, path: &str) -> (u16, Vec<u8>) {
        self.ask("GET", path, "text/plain", b"")
    }

    /// SIGTERM, then how it ended.
    fn stop(mut self) -> (Option<i32>, Duration) {
        let start = Instant::now();
        let told = Command::new("kill").args(["-TERM", &self.child.id().to_string()]).status().unwrap();
        assert!(told.success());
        (self.child.wait().unwrap().code(), start.elapsed())
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Names and bytes of a folder.
fn content(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).map(|p| (p.clone(), fs::read(p).unwrap())).collect()
}

fn is_root() -> bool {
    String::from_utf8(Command::new("id").arg("-u").output().unwrap().stdout).unwrap().trim() == "0"
}

/// The program, run by nobody where the tests are run by root (whom permission bits do not bind); `None` where that
/// cannot be arranged.
fn unprivileged(folder: &Path) -> Option<Command> {
    let program = folder.join("overfly");
    fs::copy(env!("CARGO_BIN_EXE_overfly"), &program).unwrap();
    fs::set_permissions(&program, Permissions::from_mode(0o755)).unwrap();
    if !is_root() {
        return Some(Command::new(program));
    }
    let mut command = Command::new("setpriv");
    command.args(["--reuid=65534", "--regid=65534", "--clear-groups", "--"]);
    let works = Command::new("setpriv")
        .args(["--reuid=65534", "--regid=65534", "--clear-groups", "--", "true"])
        .status()
        .is_ok_and(|s| s.success());
    command.arg(program);
    works.then_some(command)
}

/// The project's own tiles and flight, kept in git.
fn tiles() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tiles")
}

/// A frame of the flight: its file, the prior displaced by some 60 m, the truth.
struct Frame {
    image: Vec<u8>,
    request: serde_json::Value,
    truth: Geodetic,
}

fn frame(index: usize) -> Frame {
    let flight = tiles().join("flight");
    let mut rows = csv::Reader::from_path(flight.join("flight.csv")).unwrap();
    let row: BTreeMap<String, String> = rows.deserialize().nth(index).unwrap().unwrap();
    let number = |name: &str| row[name].parse::<f64>().unwrap();
    let camera: toml::Value = toml::from_str(&fs::read_to_string(flight.join("camera.toml")).unwrap()).unwrap();
    let truth = Geodetic::from_degrees(number("true_latitude_deg"), number("true_longitude_deg")).unwrap();
    let request = serde_json::json!({
        "latitude_deg": truth.latitude_deg() + 0.0004,
        "longitude_deg": truth.longitude_deg() - 0.0006,
        "sigma_m": 60.0,
        "heading_deg": number("heading_deg"),
        "height_m": number("height_agl_m"),
        "pitch_deg": number("pitch_deg"),
        "roll_deg": number("roll_deg"),
        "camera": serde_json::to_value(camera).unwrap(),
        "time_s": number("time_s"),
    });
    Frame { image: fs::read(flight.join(&row["image"])).unwrap(), request, truth }
}

fn form(frame: &Frame) -> Vec<u8> {
    let mut body = b"--b\r\ncontent-disposition: form-data; name=\"image\"\r\n\r\n".to_vec();
    body.extend_from_slice(&frame.image);
    body.extend_from_slice(b"\r\n--b\r\ncontent-disposition: form-data; name=\"request\"\r\n\r\n");
    body.extend(frame.request.to_string().into_bytes());
    body.extend_from_slice(b"\r\n--b--\r\n");
    body
}

#[test]
fn answers_from_a_read_only_folder_and_leaves_it_as_it_was() {
    let outer = tempfile::tempdir().unwrap();
    fs::set_permissions(outer.path(), Permissions::from_mode(0o755)).unwrap();
    let Some(mut command) = unprivileged(outer.path()) else {
        eprintln!("SKIPPED answers_from_a_read_only_folder_and_leaves_it_as_it_was: run by root, and setpriv is absent");
        return;
    };
    let folder = outer.path().join("aircraft");
    fs::create_dir(&folder).unwrap();
    let db = folder.join("map.gpkg");
    let built = Command::new(env!("CARGO_BIN_EXE_overfly"))
        .arg("build")
        .arg("--db")
        .arg(&db)
        .arg(tiles().join("epoch_1"))
        .output()
        .unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    fs::set_permissions(&db, Permissions::from_mode(0o444)).unwrap();
    fs::set_permissions(&folder, Permissions::from_mode(0o555)).unwrap();
    let before = content(&folder);
    assert_eq!(before.keys().collect::<Vec<_>>(), [&db]);

    command.arg("serve").arg("--db").arg(&db).args(["--onboard", "--listen", "127.0.0.1:0"]).current_dir(&folder);
    let serving = Serving::start(command);
    let mut fixes = 0;
    for index in 0..3 {
        let frame = frame(index);
        let (latitude, longitude) = (frame.truth.latitude_deg(), frame.truth.longitude_deg());
        let (status, body) = serving.get(&format!(
            "/v1/candidates?latitude_deg={latitude}&longitude_deg={longitude}&heading_deg=10&across_m=400&along_m=300&inaccuracy_m=10&drift_m=100"
        ));
        let json: serde_json::Value = serde_json::from_slice(&body).unwrap();
        assert_eq!(status, 200, "{json}");
        let (status, tile) = serving.get(&format!("/v1/tiles/{}", json["tiles"][0]["id"].as_str().unwrap()));
        assert_eq!((status, image::load_from_memory(&tile).is_ok()), (200, true));
        let (status, body) = serving.ask("POST", "/v1/fixes", "multipart/form-data; boundary=b", &form(&frame));
        let json: serde_json::Value = serde_json::from_slice(&body).unwrap();
        assert_eq!((status, json["time_s"].clone()), (200, frame.request["time_s"].clone()), "{json}");
        if json["status"] == "fix" {
            let found = |name: &str| json[name].as_f64().unwrap();
            let at = Geodetic::from_degrees(found("latitude_deg"), found("longitude_deg")).unwrap();
            let error_m = geodesic_between(at, frame.truth).distance_m;
            // Ten pixels of the source: what matters here is that a fix comes, accuracy is measured elsewhere.
            assert!(error_m < 10.0, "frame {index}: {error_m} m");
            fixes += 1;
        }
        assert_eq!(content(&folder), before, "while it runs");
    }
    assert!(fixes > 0, "not one fix");
    assert_eq!(serving.get("/readyz").0, 200);
    assert_eq!(serving.ask("POST", "/v1/builds", "application/json", b"{}").0, 404);
    let (code, elapsed) = serving.stop();
    assert_eq!(code, Some(0));
    assert!(elapsed < Duration::from_secs(5), "{elapsed:?}");
    assert_eq!(content(&folder), before, "after it has ended");
    fs::set_permissions(&folder, Permissions::from_mode(0o755)).unwrap();
}

#[test]
fn a_store_beside_an_unfinished_change_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let db = folder.path().join("map.gpkg");
    super::store::store_of(&db, "ortho", &[TileId::new(3, 1, 1).unwrap()], 5);
    fs::write(folder.path().join("map.gpkg-wal"), b"something").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_overfly"))
        .args(["serve", "--onboard", "--listen", "127.0.0.1:0", "--db"])
        .arg(&db)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("side_file"),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn a_unix_socket_is_served_and_removed() {
    let folder = tempfile::tempdir().unwrap();
    let (db, socket) = (folder.path().join("map.gpkg"), folder.path().join("o.sock"));
    super::store::store_of(&db, "ortho", &[TileId::new(3, 1, 1).unwrap()], 5);
    let mut child = Command::new(env!("CARGO_BIN_EXE_overfly"))
        .args(["serve", "--db"])
        .arg(&db)
        .arg("--listen")
        .arg(format!("unix:{}", socket.display()))
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let mut stream = std::os::unix::net::UnixStream::connect(&socket).unwrap();
    stream.write_all(b"GET /healthz HTTP/1.1\r\nhost: x\r\nconnection: close\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 200") && answer.ends_with("ok\n"), "{answer}");
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(!socket.exists());
}
