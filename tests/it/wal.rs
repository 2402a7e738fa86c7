//! A store that another program left in WAL mode is read as any other, and no `-wal` or `-shm` file is left beside it.

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::http::Request;
use overfly::server::{Limits, Service, ServiceState, StoreRefusal, router};
use overfly_core::tile::TileId;
use overfly_store::{LayerState, Reader, verify};
use rusqlite::Connection;
use std::path::{Path, PathBuf};
use std::process::Command;
use tower::ServiceExt;

fn tile() -> TileId {
    TileId::new(9, 270, 170).unwrap()
}

/// A store of one tile, in WAL mode as another program leaves it.
fn store_in_wal(folder: &Path, name: &str, seed: u8) -> PathBuf {
    let path = folder.join(name);
    super::store::store_of(&path, "ortho", &[tile()], seed);
    into_wal(&path);
    path
}

fn into_wal(path: &Path) {
    let connection = Connection::open(path).unwrap();
    let mode: String = connection.query_row("PRAGMA journal_mode = WAL", [], |row| row.get(0)).unwrap();
    assert_eq!(mode, "wal");
}

fn is_in_wal(path: &Path) -> bool {
    std::fs::read(path).unwrap()[18..20] == [2, 2]
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn reading_leaves_nothing_beside_a_store_in_wal_mode() {
    let folder = tempfile::tempdir().unwrap();
    let db = store_in_wal(folder.path(), "map.gpkg", 1);
    let bytes = std::fs::read(&db).unwrap();
    let centre = tile().centre();
    let place = [centre.latitude_deg().to_string(), centre.longitude_deg().to_string()];
    let question =
        ["--heading-deg", "0", "--across-m", "300", "--along-m", "200", "--inaccuracy-m", "30", "--drift-m", "9"];
    let db_words = ["--db", db.to_str().unwrap(), "--latitude-deg", &place[0], "--longitude-deg", &place[1]];
    for words in [
        vec!["info", db.to_str().unwrap()],
        vec!["verify", "--every-tile", db.to_str().unwrap()],
        [&["candidates"][..], &db_words, &question].concat(),
    ] {
        let done = Command::new(env!("CARGO_BIN_EXE_overfly")).args(&words).output().unwrap();
        assert!(done.status.success(), "{words:?}: {}", String::from_utf8_lossy(&done.stderr));
        assert_eq!(names(folder.path()), ["map.gpkg"], "{words:?}");
    }
    let reader = Reader::open(&db).unwrap();
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| assert!(reader.tile(reader.layer("ortho").unwrap(), tile()).unwrap().is_some()));
        }
    });
    reader.check_unchanged().unwrap();
    reader.check_readable().unwrap();
    reader.prove().unwrap();
    assert!(LayerState::read(&db, "ortho").unwrap().complete && verify(&db, &|_, _| ()).unwrap().ok);
    drop(reader);
    assert_eq!(names(folder.path()), ["map.gpkg"]);
    assert!(std::fs::read(&db).unwrap() == bytes && is_in_wal(&db));
}

#[test]
fn changes_that_are_still_in_the_log_are_refused_with_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let db = store_in_wal(folder.path(), "map.gpkg", 1);
    let other = Connection::open(&db).unwrap();
    other.pragma_update(None, "user_version", 10_300).unwrap();
    let before = names(folder.path());
    assert!(before.contains(&"map.gpkg-wal".to_owned()), "{before:?}");
    let said = || {
        let done = Command::new(env!("CARGO_BIN_EXE_overfly")).arg("info").arg(&db).output().unwrap();
        (done.status.code(), String::from_utf8_lossy(&done.stderr).into_owned())
    };
    let (exit, text) = said();
    assert_eq!(exit, Some(2), "{text}");
    for words in ["map.gpkg", "side_file", "in WAL mode", "-wal", "close the program", "sqlite3 FILE .tables"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert_eq!(names(folder.path()), before);
    drop(other);
    assert_eq!(said().0, Some(0));
    assert_eq!(names(folder.path()), ["map.gpkg"]);
}

#[test]
fn a_build_ends_the_wal_mode() {
    let folder = tempfile::tempdir().unwrap();
    let db = store_in_wal(folder.path(), "map.gpkg", 1);
    super::store::store_of(&db, "other", &[tile()], 2);
    assert!(!is_in_wal(&db));
    assert_eq!(names(folder.path()), ["map.gpkg"]);
    assert_eq!(Reader::open(&db).unwrap().layers().len(), 2);
}

fn digest(app: &Router) -> String {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let response = app.clone().oneshot(Request::get("/v1/store").body(Body::empty()).unwrap()).await.unwrap();
        let body = to_bytes(response.into_body(), 1 << 20).await.unwrap();
        let json: serde_json::Value = serde_json::from_slice(&body).unwrap();
        json["digest"].as_str().unwrap_or_else(|| panic!("{json}")).to_owned()
    })
}

#[test]
fn a_service_leaves_nothing_beside_a_store_that_comes_into_wal_mode() {
    let (folder, elsewhere) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let db = folder.path().join("map.gpkg");
    super::store::store_of(&db, "ortho", &[tile()], 1);
    let again = db.clone();
    let reopen = move || match Reader::open_proved(&again) {
        Ok(store) => Ok((store, Vec::new())),
        Err(error) => Err(StoreRefusal { code: error.code(), reason: error.to_string() }),
    };
    let state = ServiceState::new(Reader::open_proved(&db).unwrap(), Service::Preflight, Limits::default());
    let app = router(state.with_reopening(reopen));
    let first = digest(&app);
    into_wal(&db);
    assert_eq!(digest(&app), first);
    assert_eq!(names(folder.path()), ["map.gpkg"], "in place");
    std::fs::rename(store_in_wal(elsewhere.path(), "new.gpkg", 2), &db).unwrap();
    let second = digest(&app);
    assert_ne!(second, first);
    assert_eq!(names(folder.path()), ["map.gpkg"], "replaced");
    drop(app);
    assert_eq!(names(folder.path()), ["map.gpkg"], "at the end");
    assert!(is_in_wal(&db));
}
