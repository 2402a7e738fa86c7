//! Onboard: from a read-only folder, as an unprivileged user, everything is answered and nothing is left behind.

use overfly_core::geodesy::{Geodetic, geodesic_between};
use overfly_core::tile::TileId;
use std::collections::BTreeMap;
use std::fs::{self, Permissions};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
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

/// The program, run by nobody where root, whom permission bits do not bind, runs the tests.
fn unprivileged(folder: &Path) -> Command {
    let program = folder.join("overfly");
    fs::copy(env!("CARGO_BIN_EXE_overfly"), &program).unwrap();
    fs::set_permissions(&program, Permissions::from_mode(0o755)).unwrap();
    let mut command = Command::new(program);
    if is_root() {
        command.uid(65534).gid(65534);
    }
    command
}

/// The project's own tiles and flight, kept in git.
fn tiles() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tiles")
}

/// What an aircraft straight above the middle of a tile would see: the tile's own middle.
fn frame(tile: &[u8]) -> Vec<u8> {
    let mut png = std::io::Cursor::new(Vec::new());
    let whole = image::load_from_memory(tile).unwrap();
    whole.crop_imm(96, 136, 320, 240).to_rgb8().write_to(&mut png, image::ImageFormat::Png).unwrap();
    png.into_inner()
}

fn form(image: &[u8], request: &serde_json::Value) -> Vec<u8> {
    let mut body = b"--b\r\ncontent-disposition: form-data; name=\"image\"\r\n\r\n".to_vec();
    body.extend_from_slice(image);
    body.extend_from_slice(b"\r\n--b\r\ncontent-disposition: form-data; name=\"request\"\r\n\r\n");
    body.extend(request.to_string().into_bytes());
    body.extend_from_slice(b"\r\n--b--\r\n");
    body
}

/// Asks for candidates about a place, takes the best tile, and has its middle located from a prior some 60 m off.
fn ask_everything(serving: &Serving, latitude_deg: f64, longitude_deg: f64) {
    let (status, body) = serving.get(&format!(
        "/v1/candidates?latitude_deg={latitude_deg}&longitude_deg={longitude_deg}&heading_deg=10&across_m=400&along_m=300&inaccuracy_m=10&drift_m=100"
    ));
    let json: serde_json::Value = serde_json::from_slice(&body).unwrap();
    assert_eq!(status, 200, "{json}");
    let best = &json["tiles"][0];
    let index = |name: &str| best[name].as_u64().unwrap() as u32;
    let centre = TileId::new(index("z") as u8, index("x"), index("y")).unwrap().centre();
    let (status, tile) = serving.get(&format!("/v1/tiles/{}", best["id"].as_str().unwrap()));
    assert_eq!(status, 200);
    let request = serde_json::json!({
        "latitude_deg": centre.latitude_deg() + 0.0004, "longitude_deg": centre.longitude_deg() - 0.0006,
        "sigma_m": 60.0, "heading_deg": 1.5, "gsd_m_per_px": best["gsd_m_per_px"], "time_s": 12.5,
    });
    let body = form(&frame(&tile), &request);
    let (status, body) = serving.ask("POST", "/v1/fixes", "multipart/form-data; boundary=b", &body);
    let json: serde_json::Value = serde_json::from_slice(&body).unwrap();
    assert_eq!((status, json["status"].as_str(), json["time_s"].as_f64()), (200, Some("fix"), Some(12.5)), "{json}");
    let found = |name: &str| json[name].as_f64().unwrap();
    let at = Geodetic::from_degrees(found("latitude_deg"), found("longitude_deg")).unwrap();
    // A pixel of the map is 0.8 m; accuracy is measured elsewhere.
    assert!(geodesic_between(at, centre).distance_m < 2.0, "{json}");
}

#[test]
fn answers_from_a_read_only_folder_and_leaves_it_as_it_was() {
    let outer = tempfile::tempdir().unwrap();
    fs::set_permissions(outer.path(), Permissions::from_mode(0o755)).unwrap();
    let mut command = unprivileged(outer.path());
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
    // Inside the project's own landscape.
    for (latitude_deg, longitude_deg) in [(48.4961, 15.6100), (48.4941, 15.6150), (48.4921, 15.6120)] {
        ask_everything(&serving, latitude_deg, longitude_deg);
        assert_eq!(content(&folder), before, "while it runs");
    }
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
    assert_eq!(fs::metadata(&socket).unwrap().permissions().mode() & 0o777, 0o600, "for its owner only");
    let mut stream = std::os::unix::net::UnixStream::connect(&socket).unwrap();
    stream.write_all(b"GET /healthz HTTP/1.1\r\nhost: x\r\nconnection: close\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 200") && answer.ends_with("ok\n"), "{answer}");
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(!socket.exists());
}

#[test]
fn a_damaged_tile_is_neither_served_nor_matched_and_health_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let db = folder.path().join("cut.gpkg");
    super::export::export_to(overfly_testkit::drawn::drawn_store(), &super::export::drawn_request(), &db);
    let reader = overfly_store::Reader::open(&db).unwrap();
    let layer = reader.layer("ortho").unwrap();
    let tiles = reader.footprints(layer, layer.base_zoom).unwrap();
    let (bad, good) = (tiles[0].tile, tiles[tiles.len() - 1].tile);
    // One bit in the middle of the tile's imagery, wherever in the file that stands.
    let image = reader.encoded_tile(layer, bad).unwrap().unwrap().bytes;
    let mut bytes = fs::read(&db).unwrap();
    let needle = &image[image.len() / 2..image.len() / 2 + 40];
    let at = bytes.windows(needle.len()).position(|w| w == needle).unwrap();
    bytes[at] ^= 8;
    fs::write(&db, bytes).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_overfly"));
    command.arg("serve").arg("--db").arg(&db).args(["--onboard", "--listen", "127.0.0.1:0"]).stderr(Stdio::null());
    let serving = Serving::start(command);
    let text = |path: &str| {
        let (status, body) = serving.get(path);
        (status, String::from_utf8_lossy(&body).into_owned())
    };
    assert_eq!(text("/healthz"), (200, "ok\n".into()));
    assert_eq!(serving.get(&format!("/v1/tiles/ortho/{good}")).0, 200);
    assert_eq!(text("/healthz"), (200, "ok\n".into()));
    let (status, body) = text(&format!("/v1/tiles/ortho/{bad}"));
    assert!(status == 500 && body.contains("damaged_store"), "{status} {body}");
    let (status, health) = text("/healthz");
    assert!(status == 200 && health.starts_with("degraded\n") && health.contains(&bad.to_string()), "{health}");
    let (_, store) = text("/v1/store");
    let store: serde_json::Value = serde_json::from_str(&store).unwrap();
    assert_eq!(
        (store["health"]["state"].as_str(), store["health"]["damaged_tiles"].as_u64()),
        (Some("degraded"), Some(1))
    );
    // The rest goes on.
    assert_eq!(serving.get(&format!("/v1/tiles/ortho/{good}")).0, 200);
    assert_eq!(serving.stop().0, Some(0));
    let checked = Command::new(env!("CARGO_BIN_EXE_overfly")).arg("verify").arg(&db).output().unwrap();
    let told = String::from_utf8_lossy(&checked.stdout).into_owned();
    assert!(checked.status.code() == Some(3) && told.contains(&format!("first wrong: tile {bad}")), "{told}");
}
