//! The README's walk works command by command.

use std::path::Path;
use std::process::Command;

/// The README's `sh` blocks, in order.
fn blocks(readme: &str) -> Vec<&str> {
    readme.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next()).collect()
}

fn has(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok()
}

/// A port that is free now.
fn free_port() -> u16 {
    std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

#[cfg(unix)]
#[test]
fn every_command_of_the_readme_works() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let (preflight, onboard) = (free_port().to_string(), free_port().to_string());
    let folder = tempfile::tempdir().unwrap();
    for name in ["tiles", "docs"] {
        std::os::unix::fs::symlink(root.join(name), folder.path().join(name)).unwrap();
    }
    let program = assert_cmd::cargo::cargo_bin("overfly");
    let path = format!("{}:{}", program.parent().unwrap().display(), std::env::var("PATH").unwrap_or_default());
    let with_curl = has("curl");
    if !with_curl {
        eprintln!("SKIPPED: the README's commands with curl, which is not here");
    }
    let blocks = blocks(&readme);
    assert!(blocks.len() >= 7, "the README has {} blocks of commands", blocks.len());
    for block in blocks.into_iter().filter(|b| with_curl || !b.contains("curl")) {
        // A service that fails to answer must fail the walk, and end with it.
        let script = format!("set -euo pipefail\ntrap 'kill $(jobs -p) 2>/dev/null || true' EXIT\n{block}")
            .replace("8787", &preflight)
            .replace("8788", &onboard)
            .replace("curl -s ", "curl -sS --fail-with-body ");
        let done =
            Command::new("bash").args(["-c", &script]).current_dir(folder.path()).env("PATH", &path).output().unwrap();
        let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        assert!(done.status.success(), "{block}\n-> {}\n{}\n{}", done.status, said(&done.stdout), said(&done.stderr));
    }
    // So that the folder can be removed again.
    let _ = Command::new("chmod").args(["-R", "u+w", "aircraft"]).current_dir(folder.path()).status();
    if !with_curl {
        return;
    }
    let left: Vec<_> =
        std::fs::read_dir(folder.path().join("aircraft")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["walk.gpkg"], "onboard left something behind");
}
