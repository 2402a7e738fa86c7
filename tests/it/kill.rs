//! A build killed at any moment goes on where it stopped and ends as an undisturbed one. `OVERFLY_KILLS=30` kills more often.

use overfly_store::{Reader, verify};
use overfly_testkit::drawn::{CRS, orthophoto};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

fn command(db: &Path, sources: &[PathBuf]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_overfly"));
    command.args(["build", "--threads", "2", "--crs", &CRS.to_string(), "--db"]).arg(db).args(sources);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// Runs to the end; how long it took.
fn finish(db: &Path, sources: &[PathBuf]) -> Duration {
    let start = Instant::now();
    assert!(command(db, sources).status().unwrap().success());
    start.elapsed()
}

fn kill_after(db: &Path, sources: &[PathBuf], delay: Duration) {
    let mut child = command(db, sources).spawn().unwrap();
    std::thread::sleep(delay);
    // SIGKILL; a build that has ended by itself is as good.
    let _ = child.kill();
    child.wait().unwrap();
}

fn digest(db: &Path) -> String {
    Reader::open(db).unwrap().digest().to_owned()
}

#[test]
fn a_killed_build_ends_as_an_undisturbed_one() {
    let kills: u32 = std::env::var("OVERFLY_KILLS").ok().and_then(|v| v.parse().ok()).unwrap_or(8);
    let folder = tempfile::tempdir().unwrap();
    let old = [orthophoto(folder.path(), "old.png", (900, 800), (0, 0), 1, false)];
    let new = [orthophoto(folder.path(), "new.png", (1100, 900), (500, 100), 2, true)];
    let both = [old[0].clone(), new[0].clone()];
    let at = |name: &str| folder.path().join(name);
    let mut duration = finish(&at("both.gpkg"), &both).min(finish(&at("old.gpkg"), &old));
    let (expected, before) = (digest(&at("both.gpkg")), digest(&at("old.gpkg")));
    let mut midway = 0;
    for kill in 0..kills {
        let delay = duration.mul_f64((f64::from(kill) + 0.5) / f64::from(kills));
        // By turns: a store that never was finished, and one that answers meanwhile with its old content.
        let grows = kill % 2 == 1;
        let (db, sources) = (at(&format!("{kill}.gpkg")), if grows { &new[..] } else { &both[..] });
        if grows {
            std::fs::copy(at("old.gpkg"), &db).unwrap();
        }
        kill_after(&db, sources, delay);
        match Reader::open(&db) {
            Ok(reader) if reader.digest() == expected => {}
            Ok(reader) => {
                assert!(grows, "only a store that was finished before answers");
                assert_eq!(reader.digest(), before);
                midway += 1;
            }
            Err(error) => {
                assert!(!grows, "the old content answers meanwhile: {error}");
                // The last of these for the instant between the file's making and the build's declaration.
                assert!(["unfinished_build", "store_not_found", "empty_store"].contains(&error.code()), "{error}");
                midway += 1;
            }
        }
        let rest = finish(&db, sources);
        assert_eq!(digest(&db), expected, "killed after {delay:?}");
        assert!(verify(&db, &|_, _| ()).unwrap().ok);
        eprintln!("killed after {delay:?}: went on for {rest:?}, same digest");
        duration = duration.max(rest.min(duration * 2));
    }
    assert!(midway >= kills / 2, "only {midway} of {kills} kills fell into the build");
    let names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().path()).collect();
    assert!(names.iter().all(|p| p.extension().is_some_and(|e| e == "gpkg" || e == "png" || e == "pgw")), "{names:?}");
}

#[test]
fn a_build_killed_again_and_again_still_ends() {
    let folder = tempfile::tempdir().unwrap();
    let sources = [orthophoto(folder.path(), "a.png", (1000, 900), (0, 0), 1, true)];
    let whole = folder.path().join("whole.gpkg");
    let duration = finish(&whole, &sources);
    let db = folder.path().join("s.gpkg");
    for step in 1..=5 {
        kill_after(&db, &sources, duration.mul_f64(0.15 * f64::from(step)));
    }
    finish(&db, &sources);
    assert_eq!(digest(&db), digest(&whole));
}
