//! Devices, pipes and links where a file is expected are refused at once: nothing is read for ever, and nothing is written through.

use overfly_testkit::drawn::{drawn_store, project};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Runs the program, which must end by itself.
fn run(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_overfly"));
    let mut child = command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > Duration::from_secs(120) {
            child.kill().unwrap();
            panic!("{arguments:?} does not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

fn refused(arguments: &[&str], word: &str) {
    let output = run(arguments);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && message.contains(word), "{arguments:?}: {message}");
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

#[test]
fn no_input_is_a_device_or_a_pipe() {
    let folder = tempfile::tempdir().unwrap();
    let fifo = folder.path().join("fifo");
    pipe(&fifo);
    let (db, out) = (text(drawn_store().path()), folder.path().join("out.gpkg"));
    let frame = project("tiles/flight/frames/019.jpg");
    let frame = text(&frame);
    let regular = "not a regular file";
    for special in ["/dev/zero", text(&fifo)] {
        refused(&["fix", "--db", db, "--image", frame, "--height-m", "500", "--camera", special], regular);
        refused(&["fix", "--db", db, "--image", special, "--gsd-m-per-px", "1"], regular);
        refused(&["motion", frame, special, "--gsd-m-per-px", "1"], regular);
        refused(&["info", special], regular);
        refused(&["serve", "--db", special], regular);
        refused(&["serve", "--db", special, "--onboard"], regular);
        refused(&["serve", "--db", db, "--token-file", special], regular);
        refused(&["serve", "--db", db, "--onboard", "--require-signature", special], "not_a_key");
        let export = ["export", "--db", db, "--corridor-m", "300", "--out", text(&out), "--route"];
        refused(&[&export[..], &[special]].concat(), regular);
        let route = folder.path().join("route.geojson");
        std::fs::write(&route, r#"{"type":"LineString","coordinates":[[15.6053,48.4961],[15.6120,48.4961]]}"#).unwrap();
        let with = |flag: &'static str| [&export[..], &[text(&route), flag, special]].concat();
        let signed = [&with("--sign")[..], &["--serial", "1"]].concat();
        refused(&signed, "not_a_key");
        refused(&with("--aircraft"), regular);
        refused(&["build", "--db", text(&out), special], regular);
        refused(&["simulate", special], regular);
        assert!(!out.exists());
    }
}

#[test]
fn no_output_goes_through_a_link_or_into_a_device() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("mine"), "mine").unwrap();
    std::os::unix::fs::symlink(at("mine"), at("link")).unwrap();
    pipe(&at("fifo"));
    let db = text(drawn_store().path());
    let route = at("route.geojson");
    std::fs::write(&route, r#"{"type":"LineString","coordinates":[[15.6053,48.4961],[15.6120,48.4961]]}"#).unwrap();
    for special in [at("link"), at("fifo"), "/dev/full".into()] {
        let arguments = ["export", "--db", db, "--corridor-m", "300", "--route", text(&route), "--out", text(&special)];
        refused(&arguments, "in_the_way");
        let photos = project("tiles/epoch_1");
        refused(&["build", "--db", text(&special), text(&photos)], "error[");
    }
    assert_eq!(std::fs::read_to_string(at("mine")).unwrap(), "mine");
}
