//! A frame whose file was damaged is refused, or what can still be read of it gives no false fix; harmless changes lose no frame.

use overfly_flight::frame::decode_frame;
use overfly_flight::locate::Parts;
use overfly_lab::trial::{DamageScore, DamageTrial, FileChange, FixTrial, FrameFormat, RecordedFlight, TruthPoint};
use overfly_testkit::drawn::{drawn_store, project};
use std::process::Command;

/// Three ground pixels of the sample's maps.
const RIGHT_M: f64 = 3.0;

fn trial(formats: &[FrameFormat], changes: &[FileChange], trials: usize) -> DamageScore {
    let flight = RecordedFlight::read(&project("tiles/flight")).unwrap();
    let fixes = FixTrial {
        layer: "ortho".into(),
        prior_error_m: 300.0,
        seed: 13,
        heading_sigma_deg: Some(3.0),
        height_sigma_ratio: 0.03,
        unknown_position: false,
        truth: TruthPoint::Nadir,
        parts: Parts::ALL,
        threads: 1,
    };
    let trial = DamageTrial { fixes, formats: formats.to_vec(), changes: changes.to_vec(), trials, threads: 2 };
    DamageScore::from_outcomes(&trial.run(drawn_store(), &flight, |_| {}).unwrap(), RIGHT_M)
}

#[test]
fn no_damage_gives_a_false_fix() {
    let score = trial(&FrameFormat::ALL, &FileChange::ALL, 10);
    assert_eq!((score.wrong, score.harmless_lost), (0, 0), "{score:#?}");
}

/// Several flipped bits may displace a part of a JPEG by a block. The fix then says by its ellipse how far off it may be.
#[test]
fn no_damage_gives_a_fix_that_is_falsely_sure_and_nothing_harmless_is_lost() {
    let score = trial(&FrameFormat::ALL, &FileChange::ALL, 400);
    assert_eq!((score.outside, score.harmless_lost), (0, 0), "{score:#?}");
    assert!(score.wrong <= 1, "{score:#?}");
    assert_eq!((score.trials, score.harmless), (2320, 480));
    // Of 1 to 4096 bytes: what stays unseen is small, but for formats without checksums not nothing.
    assert!(score.refused as f64 > 0.86 * score.trials as f64, "{} of {}", score.refused, score.trials);
}

/// A file that ends early is found in every format, and any damage where a format has checksums.
#[test]
fn cut_files_and_all_damaged_png_files_are_refused() {
    let damages: Vec<FileChange> = FileChange::ALL.into_iter().filter(|change| !change.is_harmless()).collect();
    for (formats, changes) in [(&FrameFormat::ALL[..], &[FileChange::Cut][..]), (&[FrameFormat::Png], &damages)] {
        let score = trial(formats, changes, 80);
        assert_eq!(score.refused + score.unchanged, score.trials, "{score:#?}");
    }
}

/// A JPEG has no checksum: a byte or two may turn into other valid codes. A lost page may not.
#[test]
fn a_jpeg_with_a_page_of_zeros_is_refused() {
    let mut passed = Vec::new();
    for frame in 0..40 {
        let path = project(&format!("tiles/flight/frames/{frame:03}.jpg"));
        let sound = std::fs::read(&path).unwrap();
        for part in 1..10 {
            let mut bytes = sound.clone();
            let start = bytes.len() * part / 10;
            bytes[start..start + 512].fill(0);
            if decode_frame(&bytes, "zeroed.jpg").is_ok() {
                passed.push((frame, part));
            }
        }
    }
    assert!(passed.is_empty(), "{passed:?}");
}

#[test]
fn the_command_line_names_the_file_and_the_code_word() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = std::fs::read(project("tiles/flight/frames/019.jpg")).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle..middle + 512].fill(0);
    let damaged = folder.path().join("damaged.jpg");
    std::fs::write(&damaged, bytes).unwrap();
    let sound = project("tiles/flight/frames/020.jpg");
    let run = Command::new(env!("CARGO_BIN_EXE_overfly"))
        .arg("motion")
        .args([&damaged, &sound])
        .args(["--gsd-m-per-px", "1.25"])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(2), "{said}");
    assert!(said.contains("error[image_damaged]") && said.contains("damaged.jpg"), "{said}");
}
