//! Every command of the walk works, as it stands there.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The `sh` blocks of a document, in order. (`bash` blocks need a build or a network and are not run.)
fn blocks(document: &str) -> Vec<&str> {
    document.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next()).collect()
}

/// A port that is free now.
fn free_port() -> u16 {
    std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// The documents with commands, whose blocks are run one after the other in one folder.
fn documents() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    ["docs/walk.md", "README.md"].map(|name| root.join(name)).into_iter().filter(|path| path.exists()).collect()
}

/// Asks a server that the block has not started, or that it has ended before.
fn asks_without_a_server(block: &str) -> bool {
    let mut running = false;
    block.lines().any(|line| {
        running |= line.contains("overfly serve");
        running &= !line.starts_with("kill");
        line.contains("curl") && !running
    })
}

#[test]
fn each_block_starts_the_server_that_it_asks() {
    for document in documents() {
        let text = std::fs::read_to_string(&document).unwrap();
        let all = text.split("```sh\n").skip(1).chain(text.split("```bash\n").skip(1));
        for block in all.filter_map(|rest| rest.split("```").next()) {
            assert!(!asks_without_a_server(block), "{}: {block}", document.display());
        }
    }
    assert!(asks_without_a_server("overfly serve &\nkill %1\ncurl x") && asks_without_a_server("curl x"));
    assert!(!asks_without_a_server("overfly serve &\ncurl x\nkill %1"));
}

/// What git would say is new in the folder, under this repository's `.gitignore`.
fn left_over(folder: &Path) -> String {
    let git = |args: &[&str]| {
        let done = Command::new("git").args(args).current_dir(folder).output().unwrap();
        assert!(done.status.success(), "git {args:?}: {}", String::from_utf8_lossy(&done.stderr));
        String::from_utf8(done.stdout).unwrap()
    };
    git(&["init", "-q"]);
    git(&["status", "--porcelain"])
}

#[cfg(unix)]
#[test]
#[ignore = "needs curl"]
fn needs_curl_every_command_of_the_walk_works_and_leaves_the_tree_clean() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (preflight, onboard) = (free_port().to_string(), free_port().to_string());
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(root.join(".gitignore"), folder.path().join(".gitignore")).unwrap();
    for name in ["tiles", "docs"] {
        std::os::unix::fs::symlink(root.join(name), folder.path().join(name)).unwrap();
    }
    let program = assert_cmd::cargo::cargo_bin("overfly");
    let path = format!("{}:{}", program.parent().unwrap().display(), std::env::var("PATH").unwrap_or_default());
    let texts: Vec<String> = documents().iter().map(|d| std::fs::read_to_string(d).unwrap()).collect();
    let blocks: Vec<&str> = texts.iter().flat_map(|text| blocks(text)).collect();
    assert!(blocks.len() >= 7, "{} blocks of commands", blocks.len());
    for block in blocks {
        // A service that fails to answer must fail the walk, and end with it.
        let script = format!("set -euo pipefail\ntrap 'kill $(jobs -p) 2>/dev/null || true' EXIT\n{block}")
            .replace("8787", &preflight)
            .replace("8788", &onboard)
            .replace("curl -s ", "curl -sS --fail-with-body ")
            .replace("curl -si ", "curl -sSi --fail-with-body ");
        let done =
            Command::new("bash").args(["-c", &script]).current_dir(folder.path()).env("PATH", &path).output().unwrap();
        let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        assert!(done.status.success(), "{block}\n-> {}\n{}\n{}", done.status, said(&done.stdout), said(&done.stderr));
    }
    let left: Vec<_> =
        std::fs::read_dir(folder.path().join("aircraft")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["walk.gpkg"], "onboard left something behind");
    let new = left_over(folder.path());
    // So that the folder can be removed again.
    let _ = Command::new("chmod").args(["-R", "u+w", "aircraft"]).current_dir(folder.path()).status();
    let mut new: Vec<&str> = new.lines().collect();
    new.sort_unstable();
    assert_eq!(new, ["?? .gitignore", "?? docs", "?? tiles"], "the walk leaves files that git sees");
}
