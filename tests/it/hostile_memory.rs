//! Small images that inflate: a service of 128 MB that may not have more address space refuses them, and goes on answering.

use overfly_core::tile::{TileId, gsd_at};
use overfly_testkit::drawn::project;
use overfly_testkit::inflating::{black_png, chunk, hostile_layer, png, zeros};
use overfly_testkit::soak::client::{ServedStore, post};
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// What the bombs inflate to.
const INFLATED_MB: usize = 680;
/// Address space of the service, KiB: its threads reserve some of it, a bomb does not fit.
const SPACE_KIB: usize = 640 << 10;
/// The service is given 128 MB besides the program itself; images pass through memory in more than one form.
const MOST_RESIDENT_KB: u64 = 250_000;

/// A WebP that states 64 x 64 pixels and codes 16,383 x 16,383.
fn webp() -> Vec<u8> {
    let coded = [&[0x10, 0, 0, 0x9d, 0x01, 0x2a, 0xff, 0x3f, 0xff, 0x3f][..], &[0; 400]].concat();
    let canvas = b"WEBPVP8X\x0a\0\0\0\0\0\0\0\x3f\0\0\x3f\0\0VP8 ";
    let body = [&canvas[..], &(coded.len() as u32).to_le_bytes(), &coded].concat();
    [&b"RIFF"[..], &(body.len() as u32).to_le_bytes(), &body].concat()
}

/// A JPEG whose header states 65,535 x 65,535 pixels.
fn jpeg() -> Vec<u8> {
    let mut bytes = std::fs::read(project("tiles/flight/frames/019.jpg")).unwrap();
    let frame = bytes.windows(2).position(|w| matches!(w, [0xff, 0xc0 | 0xc2])).unwrap();
    bytes[frame + 5..frame + 9].fill(0xff);
    bytes
}

/// Images that are refused, or whose inflating part is not looked at.
fn bombs(zeros: &[u8]) -> Vec<(&'static str, Vec<u8>)> {
    let with = |name: &[u8; 4], head: &[u8]| black_png(300, &chunk(name, &[head, zeros].concat()));
    vec![
        ("a colour profile", with(b"iCCP", b"x\0\0")),
        ("a compressed text", with(b"zTXt", b"x\0\0")),
        ("an international text", with(b"iTXt", b"x\0\x01\0\0\0")),
        ("pixels beyond the last", png(300, b"", zeros)),
        ("a PNG of 100,000 x 100,000", png(100_000, b"", zeros)),
        ("a WebP", webp()),
        ("a JPEG", jpeg()),
        ("a TIFF", [&b"II*\0\x08\0\0\0"[..], &vec![0xff; 100_000]].concat()),
    ]
}

/// `overfly serve --onboard --memory 128MB` with a limit of its address space.
fn served(db: &Path, log: &Path) -> ServedStore {
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit -v {SPACE_KIB}; exec \"$0\" \"$@\""), env!("CARGO_BIN_EXE_overfly")]);
    command.args(["serve", "--onboard", "--memory", "128MB", "--listen", "127.0.0.1:0", "--db"]).arg(db);
    ServedStore::start_command(command, log).unwrap()
}

#[test]
fn images_that_inflate_are_refused_and_the_service_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let zeros = zeros(INFLATED_MB);
    assert!(zeros.len() < 700_000, "{} bytes", zeros.len());
    let tile = TileId::new(17, 71_000, 45_000).unwrap();
    let db = folder.path().join("s.gpkg");
    hostile_layer(&db, "ortho", tile, &zeros);
    let mut service = served(&db, &folder.path().join("log"));
    let centre = tile.centre();
    let request = serde_json::json!({
        "latitude_deg": centre.latitude_deg(), "longitude_deg": centre.longitude_deg(), "sigma_m": 20.0,
        "heading_deg": 0.0, "gsd_m_per_px": gsd_at(centre, 17).mean_m_per_px(),
    });
    let request = request.to_string().into_bytes();
    let frame = std::fs::read(project("tiles/flight/frames/019.jpg")).unwrap();
    let stop = AtomicBool::new(false);
    let asked = std::thread::scope(|scope| {
        let (service, stop) = (&service, &stop);
        let watch = scope.spawn(move || {
            let (mut client, mut asked) = (service.client(), 0);
            while !stop.load(Ordering::Relaxed) {
                let reply = client.get("/healthz").unwrap_or_else(|e| panic!("the service ended: {e}"));
                assert_eq!(reply.status, 200);
                asked += 1;
                std::thread::sleep(Duration::from_millis(20));
            }
            asked
        });
        let outcome = std::panic::catch_unwind(|| {
            let mut client = service.client();
            for (name, image) in bombs(&zeros) {
                for sent in [
                    post("/v1/fixes", &[("image", &image), ("request", &request)]),
                    post("/v1/motions", &[("image_a", &image), ("image_b", &frame)]),
                ] {
                    let reply = client.send(&sent).unwrap_or_else(|e| panic!("{name}: {e}"));
                    assert!(reply.status < 500, "{name}: {} {}", reply.status, String::from_utf8_lossy(&reply.body));
                    let most_kb = service.memory_kb("VmHWM");
                    assert!(most_kb < MOST_RESIDENT_KB, "{name}: {most_kb} kB");
                }
            }
            // The frame is sound. The tile that it is compared with is black, and its profile is left out.
            let reply = client.send(&post("/v1/fixes", &[("image", &frame), ("request", &request)])).unwrap();
            let text = String::from_utf8_lossy(&reply.body).into_owned();
            assert!(reply.status == 200 && text.contains("\"tiles_searched\":1"), "{} {text}", reply.status);
        });
        stop.store(true, Ordering::Relaxed);
        let asked = watch.join().unwrap();
        outcome.map(|()| asked).unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    });
    assert!(asked > 1, "{asked}");
    let most_kb = service.memory_kb("VmHWM");
    assert!(most_kb < MOST_RESIDENT_KB, "{most_kb} kB");
    assert!(service.lives());
}
