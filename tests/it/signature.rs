//! Keys, signatures and ages: who did not sign, altered or outlived a store is refused, each by its own code word.

use crate::export::{drawn_request, export_to};
use overfly_ingest::export::ExportRequest;
use overfly_store::Reader;
use overfly_store::package::{
    PackageVerification, PublicKey, SEAL_LEN, SecretKey, VerifyOptions, open_onboard, verify_package,
};
use overfly_testkit::drawn::drawn_store;
use overfly_testkit::injury::a_day;
use std::os::unix::fs::{FileExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

struct Keys {
    secret: PathBuf,
    public: PathBuf,
}

impl Keys {
    fn new(folder: &Path, name: &str) -> Self {
        let secret = folder.join(name);
        let (public, _) = overfly_store::package::generate(&secret).unwrap();
        Self { secret, public }
    }
}

fn signed(folder: &Path, keys: &Keys, valid_until: Option<&str>) -> PathBuf {
    let out = folder.join("flight.gpkg");
    let request = ExportRequest {
        key: Some(SecretKey::read(&keys.secret).unwrap()),
        serial: Some(1),
        valid_until: valid_until.map(|d| d.parse().unwrap()),
        ..drawn_request()
    };
    export_to(drawn_store(), &request, &out);
    out
}

fn overfly(args: &[&str], files: &[&Path]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_overfly")).args(args).args(files).output().unwrap()
}

fn verified(path: &Path, key: Option<&Path>) -> PackageVerification {
    let key = key.map(|k| PublicKey::read(k).unwrap());
    verify_package(path, &VerifyOptions { key: key.as_ref(), today: a_day(), every_tile: false }, &|_, _| ()).unwrap()
}

/// Exit code and code word of `serve --onboard`, which must not start.
fn refusal(path: &Path, more: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_overfly"));
    command.args(["serve", "--json", "--onboard", "--listen", "127.0.0.1:0", "--db"]).arg(path).args(more);
    let mut child = command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::null()).spawn().unwrap();
    let mut line = String::new();
    let read = std::io::BufRead::read_line(&mut std::io::BufReader::new(child.stdout.take().unwrap()), &mut line);
    read.unwrap();
    if line.contains("listening") {
        child.kill().unwrap();
    }
    let json: serde_json::Value = serde_json::from_str(&line).unwrap();
    (child.wait().unwrap().code(), json["error"].as_str().unwrap_or("it starts").to_owned())
}

#[test]
fn an_export_signed_later_is_the_one_signed_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let keys = Keys::new(folder.path(), "ground.key");
    let at_once = signed(folder.path(), &keys, Some("2099-12-31"));
    let unsigned = folder.path().join("unsigned.gpkg");
    let request =
        ExportRequest { valid_until: Some("2099-12-31".parse().unwrap()), serial: Some(1), ..drawn_request() };
    export_to(drawn_store(), &request, &unsigned);
    let later = folder.path().join("later.gpkg");
    let done = overfly(&["sign", "--key"], &[&keys.secret, &unsigned, Path::new("--out"), &later]);
    assert!(done.status.success(), "{done:?}");
    assert!(std::fs::read(&later).unwrap() == std::fs::read(&at_once).unwrap());
    let again = overfly(&["sign", "--key"], &[&keys.secret, &later, Path::new("--out"), &unsigned]);
    assert!(String::from_utf8_lossy(&again.stderr).contains("already_signed"), "{again:?}");
    let expired = folder.path().join("expired.gpkg");
    let request =
        ExportRequest { valid_until: Some("2020-01-01".parse().unwrap()), serial: Some(1), ..drawn_request() };
    export_to(drawn_store(), &request, &expired);
    let refused = overfly(&["sign", "--key"], &[&keys.secret, &expired, Path::new("--out"), &folder.path().join("o")]);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("expired_store"), "{refused:?}");
    let unnumbered = folder.path().join("unnumbered.gpkg");
    export_to(drawn_store(), &ExportRequest { serial: None, ..drawn_request() }, &unnumbered);
    let refused =
        overfly(&["sign", "--key"], &[&keys.secret, &unnumbered, Path::new("--out"), &folder.path().join("o")]);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("no_serial"), "{refused:?}");
}

#[test]
fn a_person_reads_the_verdict_first() {
    let folder = tempfile::tempdir().unwrap();
    let keys = Keys::new(folder.path(), "ground.key");
    let path = signed(folder.path(), &keys, Some("2099-12-31"));
    let text = |output: &Output| String::from_utf8_lossy(&output.stdout).into_owned();
    let unchecked = text(&overfly(&["verify"], &[&path]));
    let fingerprint = PublicKey::read(&keys.public).unwrap().fingerprint();
    assert!(
        unchecked.starts_with("GOOD: ") && unchecked.lines().next().unwrap().contains("NOT checked"),
        "{unchecked}"
    );
    for part in [
        "from 48.4961 15.6053 to 48.4961 15.6120",
        "until 2099-12-31, ",
        "days left",
        "ortho, of unknown date",
        &fingerprint,
    ] {
        assert!(unchecked.contains(part), "{part}: {unchecked}");
    }
    let checked = text(&overfly(&["verify"], &[&path, Path::new("--key"), &keys.public]));
    assert!(checked.starts_with("GOOD: ") && !checked.contains("NOT checked"), "{checked}");
    assert!(checked.contains(&format!("{fingerprint}, checked with ")), "{checked}");
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() / 3]).unwrap();
    let half = overfly(&["verify"], &[&path]);
    assert_eq!(half.status.code(), Some(3));
    let megabytes = |bytes: usize| format!("{:.1}", bytes as f64 / 1e6);
    let expected = format!("{} of {} MB: copying was cut off", megabytes(whole.len() / 3), megabytes(whole.len()));
    assert!(text(&half).starts_with("NOT GOOD") && text(&half).contains(&expected), "{}", text(&half));
}

#[test]
fn keys_are_never_overwritten_and_the_secret_is_its_owners() {
    let folder = tempfile::tempdir().unwrap();
    let key = folder.path().join("ground.key");
    let made = overfly(&["keygen", "--json", "--out"], &[&key]);
    assert!(made.status.success());
    assert_eq!(std::fs::metadata(&key).unwrap().permissions().mode() & 0o777, 0o600);
    let before = std::fs::read(&key).unwrap();
    let again = overfly(&["keygen", "--out"], &[&key]);
    assert_eq!(again.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&again.stderr).contains("key_exists"));
    std::fs::remove_file(&key).unwrap();
    // The public one alone is in the way as well, and the secret one is not written then.
    assert_eq!(overfly(&["keygen", "--out"], &[&key]).status.code(), Some(2));
    assert!(!key.exists() && !before.is_empty());
}

#[test]
fn a_signed_store_is_good_by_its_key_and_by_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let (ours, theirs) = (Keys::new(folder.path(), "ours"), Keys::new(folder.path(), "theirs"));
    let store = signed(folder.path(), &ours, Some("2099-12-31"));
    let good = verified(&store, Some(&ours.public));
    assert!(good.store.ok && good.sealed && !good.tile_by_tile, "{good:?}");
    assert_eq!(good.valid_until.as_deref(), Some("2099-12-31"));
    assert!(verified(&store, None).store.ok);
    assert_eq!(verified(&store, Some(&theirs.public)).code, Some("wrong_key"));
    let told = overfly(&["verify", "--key"], &[&theirs.public, &store]);
    assert_eq!(told.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&told.stdout).contains("[wrong_key]"));
    // The secret key in place of the public one, and a file that is none.
    assert_eq!(overfly(&["verify", "--key"], &[&ours.secret, &store]).status.code(), Some(2));
    assert_eq!(overfly(&["verify", "--key"], &[&store, &store]).status.code(), Some(2));
    let key = |path: &Path| path.to_str().unwrap().to_owned();
    assert_eq!(refusal(&store, &["--require-signature", &key(&theirs.public)]), (Some(2), "wrong_key".into()));
    assert_eq!(refusal(&store, &["--require-signature", &key(&ours.public)]).1, "it starts");
    let plain = folder.path().join("plain.gpkg");
    export_to(drawn_store(), &drawn_request(), &plain);
    assert_eq!(verified(&plain, Some(&ours.public)).code, Some("unsigned_store"));
    for unsigned in [plain.as_path(), drawn_store().path()] {
        let (exit, code) = refusal(unsigned, &["--require-signature", &key(&ours.public)]);
        assert_eq!((exit, code.as_str()), (Some(2), "unsigned_store"));
    }
}

/// The bytes of a store, and where its seal stands in them.
fn sealed_bytes(store: &Path) -> (Vec<u8>, std::ops::Range<usize>) {
    let bytes = std::fs::read(store).unwrap();
    let page = usize::from(u16::from_be_bytes([bytes[16], bytes[17]]));
    (bytes, page - SEAL_LEN..page)
}

#[test]
fn the_seal_holds_the_documented_digests() {
    let folder = tempfile::tempdir().unwrap();
    let keys = Keys::new(folder.path(), "ground.key");
    let store = signed(folder.path(), &keys, None);
    let (bytes, place) = sealed_bytes(&store);
    let seal = &bytes[place.clone()];
    // As documented: the file with its seal as zeros, and the manifest, by BLAKE3.
    let mut zeroed = bytes.clone();
    zeroed[place].fill(0);
    assert_eq!(seal[48..80], *blake3::hash(&zeroed).as_bytes());
    let manifest = Reader::open(&store).unwrap().manifest().unwrap().to_owned();
    assert_eq!(seal[16..48], *blake3::hash(manifest.as_bytes()).as_bytes());
}

#[test]
#[ignore = "needs openssl"]
fn needs_openssl_openssl_verifies_the_signature_over_the_documented_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let keys = Keys::new(folder.path(), "ground.key");
    let store = signed(folder.path(), &keys, None);
    let (bytes, place) = sealed_bytes(&store);
    let seal = &bytes[place];
    let (message, signature) = (folder.path().join("message"), folder.path().join("signature"));
    std::fs::write(&signature, &seal[80..]).unwrap();
    let openssl = |message_bytes: &[u8]| {
        std::fs::write(&message, message_bytes).unwrap();
        let mut command = Command::new("openssl");
        command.args(["pkeyutl", "-verify", "-pubin", "-inkey"]).arg(&keys.public).arg("-rawin").arg("-in");
        command.arg(&message).arg("-sigfile").arg(&signature).output().unwrap().status.success()
    };
    assert!(openssl(&seal[..80]));
    let mut other = seal[..80].to_vec();
    other[50] ^= 1;
    assert!(!openssl(&other));
    // OpenSSL reads the secret key, and its public half is ours.
    let out = Command::new("openssl").args(["pkey", "-pubout", "-in"]).arg(&keys.secret).output().unwrap();
    assert_eq!(out.stdout, std::fs::read(&keys.public).unwrap(), "{}", String::from_utf8_lossy(&out.stderr));
    // And one that OpenSSL made signs.
    let theirs = folder.path().join("theirs.pem");
    let made =
        Command::new("openssl").args(["genpkey", "-algorithm", "ed25519", "-out"]).arg(&theirs).output().unwrap();
    assert!(made.status.success());
    let key = SecretKey::read(&theirs).unwrap();
    assert!(key.public().verifies(b"message", &key.sign(b"message")));
}

#[test]
fn an_altered_manifest_is_refused_by_its_own_word() {
    let folder = tempfile::tempdir().unwrap();
    let keys = Keys::new(folder.path(), "ground.key");
    let store = signed(folder.path(), &keys, Some("2020-01-01"));
    let connection = rusqlite::Connection::open(&store).unwrap();
    let changed = connection
        .execute("UPDATE overfly_manifest SET manifest = replace(manifest, '2020-01-01', '2099-01-01')", [])
        .unwrap();
    assert_eq!(changed, 1);
    drop(connection);
    assert_eq!(verified(&store, Some(&keys.public)).code, Some("altered_manifest"));
    assert_eq!(refusal(&store, &[]), (Some(2), "altered_manifest".into()));
    let public = keys.public.to_str().unwrap();
    assert_eq!(refusal(&store, &["--require-signature", public]).1, "altered_manifest");
}

#[test]
fn an_altered_seal_is_refused_and_a_signature_cannot_be_taken_off() {
    let folder = tempfile::tempdir().unwrap();
    let keys = Keys::new(folder.path(), "ground.key");
    let store = signed(folder.path(), &keys, None);
    let file = std::fs::File::options().read(true).write(true).open(&store).unwrap();
    let mut seal = [0; SEAL_LEN];
    let at = 16_384 - SEAL_LEN as u64;
    file.read_exact_at(&mut seal, at).unwrap();
    let altered = |range: std::ops::Range<usize>, value: Option<u8>| {
        let mut other = seal;
        other[range].iter_mut().for_each(|b| *b = value.unwrap_or(*b ^ 1));
        file.write_all_at(&other, at).unwrap();
        let verified = verified(&store, None);
        let onboard = open_onboard(&store, None, &[], a_day()).map(|_| ()).map_err(|e| e.code());
        file.write_all_at(&seal, at).unwrap();
        assert!(!verified.store.ok);
        (verified.code.unwrap(), onboard)
    };
    assert_eq!(altered(80..144, None), ("altered_seal", Err("altered_seal")));
    assert_eq!(altered(80..144, Some(0)), ("altered_seal", Err("altered_seal")), "taken off");
    assert_eq!(altered(0..16, None), ("altered_seal", Err("altered_seal")), "no seal, and a manifest");
    assert_eq!(altered(16..17, None), ("altered_manifest", Err("altered_manifest")));
    assert_eq!(altered(48..80, None), ("altered_seal", Err("altered_seal")), "the file's digest is what is signed");
    assert!(verified(&store, Some(&keys.public)).store.ok, "and restored");
}

#[test]
fn an_expired_or_stale_store_is_refused_and_a_warning_is_never_silent() {
    let folder = tempfile::tempdir().unwrap();
    let keys = Keys::new(folder.path(), "ground.key");
    let store = signed(folder.path(), &keys, Some("2020-01-01"));
    let found = verified(&store, Some(&keys.public));
    assert_eq!((found.code, found.store.ok), (Some("expired_store"), false));
    assert_eq!(overfly(&["verify"], &[&store]).status.code(), Some(3));
    assert_eq!(refusal(&store, &[]), (Some(2), "expired_store".into()));
    let day = |text: &str| text.parse().unwrap();
    assert!(open_onboard(&store, None, &[], day("2020-01-01")).is_ok(), "its last day");
    assert_eq!(open_onboard(&store, None, &[], day("2020-01-02")).unwrap_err().code(), "expired_store");
    // The drawn tiles bear no date: older than any.
    let plain = folder.path().join("plain.gpkg");
    export_to(drawn_store(), &drawn_request(), &plain);
    assert_eq!(refusal(&plain, &["--stale-after-days", "ortho:9999=refuse"]), (Some(2), "stale_layer".into()));
    let warned = open_onboard(&plain, None, &["730=warn".parse().unwrap()], a_day()).unwrap();
    assert!(warned.findings[0].message.contains("unknown date"), "{:?}", warned.findings);
}

#[test]
fn a_sealed_file_that_another_program_opened_is_told_as_that_by_all() {
    let folder = tempfile::tempdir().unwrap();
    let keys = Keys::new(folder.path(), "ground.key");
    for (pragma, mode) in [("PRAGMA journal_mode = WAL", "WAL mode"), ("PRAGMA user_version = 10300", "for writing")] {
        let store = signed(folder.path(), &keys, None);
        let connection = rusqlite::Connection::open(&store).unwrap();
        connection.query_row(pragma, [], |_| Ok(())).or_else(|_| connection.execute_batch(pragma)).unwrap();
        // A program that only looks begins a transaction all the same.
        connection.execute_batch("BEGIN IMMEDIATE; CREATE TABLE t (x); DROP TABLE t; COMMIT").unwrap();
        drop(connection);
        let found = verified(&store, None);
        assert_eq!(found.code, Some("opened_for_writing"), "{found:?}");
        assert!(found.store.problems[0].contains(mode), "{}", found.store.problems[0]);
        assert_eq!(refusal(&store, &[]), (Some(2), "opened_for_writing".into()));
        let sides = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
        let left: Vec<_> = sides.filter(|name| name.to_string_lossy().contains(".gpkg-")).collect();
        assert!(left.is_empty(), "reading left {left:?}");
        std::fs::remove_file(&store).unwrap();
    }
}

#[test]
fn a_lower_serial_is_neither_applied_nor_flown_unless_that_is_meant() {
    let folder = tempfile::tempdir().unwrap();
    let keys = Keys::new(folder.path(), "ground.key");
    let exported = |name: &str, serial: Option<u64>, corridor_m: f64| {
        let out = folder.path().join(name);
        let key = Some(SecretKey::read(&keys.secret).unwrap());
        export_to(drawn_store(), &ExportRequest { key, serial, corridor_m, ..drawn_request() }, &out);
        out
    };
    let (new, old) = (exported("new.gpkg", Some(8), 500.0), exported("old.gpkg", Some(7), 600.0));
    let unnumbered = exported("unnumbered.gpkg", None, 550.0);
    let apply = |to: &Path, more: &[&str]| {
        let patch = folder.path().join("back.patch");
        let made = overfly(&["diff", "--out", patch.to_str().unwrap()], &[&new, to]);
        assert!(made.status.success(), "{made:?}");
        let out = folder.path().join("out.gpkg");
        let _ = std::fs::remove_file(&out);
        let applied = overfly(&[&["apply", "--json", "--out", out.to_str().unwrap()], more].concat(), &[&new, &patch]);
        String::from_utf8(applied.stdout).unwrap()
    };
    assert!(apply(&old, &[]).contains("older_serial"));
    assert!(apply(&unnumbered, &[]).contains("older_serial"));
    assert!(!apply(&old, &["--allow-older"]).contains("error"));
    assert_eq!(refusal(&old, &["--least-serial", "8"]), (Some(2), "older_serial".into()));
    assert_eq!(refusal(&new, &["--least-serial", "8"]).1, "it starts");
    assert_eq!(refusal(&old, &["--least-serial", "8", "--allow-older"]).1, "it starts");
    let unsigned = overfly(&["export", "--sign", keys.secret.to_str().unwrap(), "--corridor-m", "5"], &[]);
    assert!(String::from_utf8(unsigned.stderr).unwrap().contains("--serial"));
}
