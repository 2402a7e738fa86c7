//! Clients that take more than their share: connections that are held, bodies that are small or large and ask for much.

use overfly_testkit::drawn::drawn_store;
use overfly_testkit::soak::client::{HttpReply, ServedStore, get, post, read};
use serde_json::json;
use std::io::{BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// As many connections as the service answers in full at the same time.
const HELD: usize = 512;

/// A service over the drawn landscape, on the ground or onboard.
pub fn served(folder: &Path, is_onboard: bool) -> ServedStore {
    let program = Path::new(env!("CARGO_BIN_EXE_overfly"));
    let log = folder.join("log");
    if is_onboard {
        let sound = folder.join("sound.gpkg");
        let wanted = crate::export::request(crate::export::route([15.6053, 48.4911], [15.6253, 48.4911]), 3_000.0);
        crate::export::export_to(drawn_store(), &wanted, &sound);
        return ServedStore::start(program, &sound, &["--memory", "128MB"].map(str::to_owned), &log).unwrap();
    }
    let mut command = Command::new(program);
    command.arg("serve").arg("--db").arg(drawn_store().path()).args(["--listen", "127.0.0.1:0"]);
    ServedStore::start_command(command, &log).unwrap()
}

/// What a client sends before it does nothing more.
#[derive(Debug, Clone, Copy)]
enum Held {
    Head,
    Body(&'static str),
    Reader,
}

impl Held {
    fn open(self, service: &ServedStore) -> TcpStream {
        let mut stream = service.client().connect().unwrap();
        stream.set_write_timeout(Some(Duration::from_millis(50))).unwrap();
        let begun = match self {
            Self::Head => b"GET /healthz HTTP/1.1\r\nhost: localhost\r\n".to_vec(),
            Self::Body(path) => {
                let kind =
                    if path.ends_with("exports") { "application/json" } else { "multipart/form-data; boundary=b" };
                let head = format!(
                    "POST {path} HTTP/1.1\r\nhost: localhost\r\ncontent-type: {kind}\r\ncontent-length: 900000\r\n\r\n"
                );
                [head.as_bytes(), b"{"].concat()
            }
            // More answers than the socket's buffers hold.
            Self::Reader => get("/openapi.json").repeat(100),
        };
        // The service may have answered and closed, or takes no more.
        let _ = stream.write_all(&begun);
        stream
    }
}

fn asked(service: &ServedStore, path: &str) -> (HttpReply, Duration) {
    let start = Instant::now();
    let mut stream = service.client().connect().unwrap();
    stream.write_all(&get(path)).unwrap();
    let (reply, _) = read(&mut BufReader::new(stream)).unwrap();
    (reply, start.elapsed())
}

#[test]
fn held_connections_delay_neither_health_nor_candidates() {
    let question = "/v1/candidates?latitude_deg=48.4911&longitude_deg=15.6153&heading_deg=0&across_m=300&along_m=200&inaccuracy_m=30&drift_m=100";
    for is_onboard in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let service = served(folder.path(), is_onboard);
        for held in [Held::Head, Held::Body("/v1/fixes"), Held::Body("/v1/exports"), Held::Reader] {
            let streams: Vec<TcpStream> = (0..HELD).map(|_| held.open(&service)).collect();
            for path in ["/healthz", "/readyz", question].repeat(3) {
                let (reply, elapsed) = asked(&service, path);
                assert_eq!(reply.status, 200, "{held:?} {path}: {}", String::from_utf8_lossy(&reply.body));
                // A connection that is waited for takes 15 s and more.
                assert!(elapsed < Duration::from_secs(5), "{held:?} {path}: {elapsed:?}");
            }
            drop(streams);
        }
        assert!(service.memory_kb("VmHWM") < 400_000, "{} kB", service.memory_kb("VmHWM"));
    }
}

/// Posts a JSON text for an export, and asks until that has ended.
fn export_asked(service: &ServedStore, body: &str) -> HttpReply {
    let head = format!(
        "POST /v1/exports HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n",
        body.len()
    );
    let mut reply = service.client().send(&[head.as_bytes(), body.as_bytes()].concat()).unwrap();
    while reply.status == 202 {
        let progress: serde_json::Value = serde_json::from_slice(&reply.body).unwrap();
        std::thread::sleep(Duration::from_millis(20));
        reply = service.client().get(&format!("/v1/exports/{}", progress["id"].as_str().unwrap())).unwrap();
    }
    reply
}

#[test]
fn no_request_for_an_export_takes_much_more_memory_than_it_has_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let service = served(folder.path(), false);
    let asking = |route: &str| format!(r#"{{"corridor_m":1000,"route":{route}}}"#);
    let list = |member: &str, count: usize| format!("[{}]", vec![member; count].join(","));
    let zigzag: Vec<[f64; 2]> = (0..600).map(|i| [f64::from(i % 2) * 179.0, f64::from(i) * 0.01]).collect();
    let line = |coordinates: &str| format!(r#"{{"type":"LineString","coordinates":{coordinates}}}"#);
    let here = "[15.61,48.49]";
    for (name, body, status, code) in [
        ("a tree of objects", asking(&list(r#"{"":0}"#, 1_400_000)), 400, "parameter_out_of_range"),
        (
            "features",
            asking(&format!(r#"{{"type":"FeatureCollection","features":{}}}"#, list("{}", 3_000_000))),
            400,
            "parameter_out_of_range",
        ),
        ("empty lists", asking(&line(&list("[]", 3_000_000))), 400, "parameter_out_of_range"),
        ("a place repeated", asking(&line(&list(here, 800_000))), 400, "parameter_out_of_range"),
        ("nested lists", asking(&line(&"[".repeat(5_000_000))), 400, "request_not_valid"),
        ("too large", asking(&line(&list(here, 1_000_000))), 413, "body_too_large"),
        ("a zigzag round the earth", asking(&line(&json!(zigzag).to_string())), 422, "route_too_long"),
    ] {
        let reply = export_asked(&service, &body);
        assert_eq!(
            (reply.status, reply.code()),
            (status, code.into()),
            "{name}: {}",
            String::from_utf8_lossy(&reply.body)
        );
        let most_kb = service.memory_kb("VmHWM");
        assert!(most_kb < 400_000, "{name}: {most_kb} kB");
        assert_eq!(asked(&service, "/healthz").0.status, 200);
    }
}

/// A client that sends a form byte by byte, until it is answered.
fn dribble(mut stream: TcpStream) -> u16 {
    let head = "POST /v1/fixes HTTP/1.1\r\nhost: localhost\r\ncontent-type: multipart/form-data; boundary=b\r\ncontent-length: 900000\r\n\r\n--b\r\ncontent-disposition: form-data; name=\"image\"\r\n\r\n";
    stream.write_all(head.as_bytes()).unwrap();
    stream.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
    let mut answer = [0; 12];
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(120) {
        // The service may have answered and closed.
        let _ = stream.write_all(b"x");
        match stream.read(&mut answer) {
            Ok(12) => return String::from_utf8_lossy(&answer[9..]).parse().unwrap(),
            Ok(_) => return 0,
            Err(_) => {}
        }
    }
    panic!("a slow body is read for ever");
}

#[test]
fn a_hundred_slow_bodies_stop_nobody_and_are_cut_off() {
    for is_onboard in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let service = served(folder.path(), is_onboard);
        let slow: Vec<_> = (0..100)
            .map(|_| {
                let stream = service.client().connect().unwrap();
                std::thread::spawn(move || dribble(stream))
            })
            .collect();
        let frame = std::fs::read(overfly_testkit::drawn::project("tiles/flight/frames/019.jpg")).unwrap();
        let motion = post("/v1/motions", &[("image_a", &frame), ("image_b", &frame)]);
        let start = Instant::now();
        let mut client = service.client();
        for _ in 0..3 {
            let reply = client.send(&motion).unwrap();
            assert_eq!(reply.status, 200, "{}", String::from_utf8_lossy(&reply.body));
        }
        let elapsed = start.elapsed();
        let answers: Vec<u16> = slow.into_iter().map(|client| client.join().unwrap()).collect();
        // Some clients write before they read the answer, and are told that the connection is reset.
        assert!(answers.iter().all(|status| [0, 408].contains(status)), "{answers:?}");
        assert!(answers.contains(&408), "{answers:?}");
        assert!(elapsed < Duration::from_secs(60), "{elapsed:?}");
    }
}
