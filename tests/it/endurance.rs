//! Onboard life: a soak in short, whoever watches the service, a clock that jumps, and that nothing is written anywhere.

use super::export::{export_to, request, route};
use overfly_core::camera::View;
use overfly_core::geodesy::LocalFrame;
use overfly_flight::frame::decode_frame;
use overfly_flight::locate::{Answer, FixRequest, HeadingPrior, LocateError, PositionPrior, locate};
use overfly_store::{CacheLimits, Reader};
use overfly_testkit::drawn::drawn_store;
use overfly_testkit::soak::client::{ServedStore, get};
use overfly_testkit::soak::fault::{FAULTS, endure};
use overfly_testkit::soak::question::{
    AnswerVerdict, ExpectedAnswer, QuestionCounts, QuestionKind, Questions, judge_answer,
};
use overfly_testkit::soak::{SoakPlan, soak};
use std::fs::{self, Permissions};
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixDatagram, UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

const POOL: QuestionCounts = QuestionCounts { tiles: 40, candidates: 60, fixes: 6 };

fn program() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_overfly"))
}

/// All of the drawn landscape as the aircraft takes it along.
fn exported(folder: &Path, valid_until: Option<&str>) -> PathBuf {
    let path = folder.join("sound.gpkg");
    let mut wanted = request(route([15.6053, 48.4911], [15.6253, 48.4911]), 3_000.0);
    wanted.valid_until = valid_until.map(|day| day.parse().unwrap());
    export_to(drawn_store(), &wanted, &path);
    path
}

fn memory() -> Vec<String> {
    ["--memory", "128MB"].map(str::to_owned).into()
}

#[test]
fn mixed_requests_with_faults_get_right_answers_or_refusals() {
    let folder = tempfile::tempdir().unwrap();
    let sound = exported(folder.path(), None);
    let questions = Questions::new(&sound, POOL, 1);
    let served = folder.path().join("served.gpkg");
    fs::copy(&sound, &served).unwrap();
    let log = folder.path().join("log");
    let mut serving = ServedStore::start(program(), &served, &memory(), &log).unwrap();
    let rotting = Some((served.as_path(), sound.as_path()));
    let plan = SoakPlan { requests: 1_500, connections: 4, seed: 5, rotting, spares_landscape: false };
    let soaked = soak(&mut serving, &questions, &plan);
    assert!(soaked.lives, "{}", fs::read_to_string(&log).unwrap());
    assert_eq!((soaked.tally.asked(), &soaked.tally.wrong[..]), (1_500, &[][..]));
    let count = |kind: &str| soaked.tally.counts[kind];
    assert!(count("Tile").damaged > 0 && count("Tile").right > 0 && count("Motion").found > 0);
    assert!(count("Fix").right + count("Fix").busy == count("Fix").asked);
    let last = soaked.readings.last().unwrap();
    assert_eq!(last.asked, 1_500);
    assert!(last.mean_resident_kb > 0 && last.mean_resident_kb <= last.most_resident_kb);
    assert!(last.resident_kb <= last.most_resident_kb && last.most_resident_kb < 200_000, "{last:?}");
    let health = String::from_utf8(serving.client().get("/healthz").unwrap().body).unwrap();
    assert!(health.starts_with("degraded\n"), "{health}");
    assert!(!fs::read_to_string(&log).unwrap().contains("panic"), "{}", fs::read_to_string(&log).unwrap());
}

#[test]
fn a_card_removed_replaced_cut_off_or_unreadable_is_refused_and_served_again_when_it_is_back() {
    let folder = tempfile::tempdir().unwrap();
    let sound = exported(folder.path(), None);
    let questions = Questions::new(&sound, POOL, 2);
    let served = folder.path().join("served.gpkg");
    let start = || ServedStore::start(program(), &served, &memory(), &folder.path().join("log"));
    for fault in FAULTS {
        fs::copy(&sound, &served).unwrap();
        let (asked, wrong) = endure(fault, &sound, &served, &questions, &start);
        assert!(asked > 90 && wrong.is_empty(), "{fault:?}: {wrong:#?}");
    }
}

#[test]
fn whoever_watches_is_told_that_it_is_ready_lives_and_stops() {
    let folder = tempfile::tempdir().unwrap();
    let sound = exported(folder.path(), None);
    let path = folder.path().join("notify");
    let socket = UnixDatagram::bind(&path).unwrap();
    socket.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    let heard = || {
        let mut bytes = [0; 1000];
        let n = socket.recv(&mut bytes).unwrap();
        String::from_utf8(bytes[..n].to_vec()).unwrap()
    };
    let mut command = Command::new(program());
    command.args(["serve", "--onboard", "--listen", "127.0.0.1:0", "--db"]).arg(&sound);
    command.env("NOTIFY_SOCKET", &path).env("WATCHDOG_USEC", "400000").env_remove("WATCHDOG_PID");
    let mut serving = ServedStore::start_command(command, &folder.path().join("log")).unwrap();
    assert_eq!([heard(), heard(), heard()], ["READY=1\nSTATUS=ready\n", "WATCHDOG=1\n", "STATUS=ready\n"]);
    assert_eq!(heard(), "WATCHDOG=1\n");
    fs::rename(&sound, folder.path().join("gone.gpkg")).unwrap();
    let mut next = heard();
    while next == "WATCHDOG=1\n" {
        next = heard();
    }
    assert!(next.starts_with("STATUS=not ready: "), "{next}");
    socket.set_read_timeout(Some(Duration::from_secs(1))).unwrap();
    assert!(socket.recv(&mut [0; 100]).is_err(), "silent while the store is gone");
    fs::rename(folder.path().join("gone.gpkg"), &sound).unwrap();
    socket.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    assert_eq!(heard(), "WATCHDOG=1\n");
    assert!(Command::new("kill").args(["-TERM", &serving.pid().to_string()]).status().unwrap().success());
    while next != "STOPPING=1\nSTATUS=stopping\n" {
        next = heard();
    }
    while serving.lives() {
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn what_may_be_held_changes_no_fix() {
    let store = drawn_store();
    let layer = store.layer("ortho").unwrap();
    let base = store.footprints(layer, layer.base_zoom).unwrap();
    let tile = base.iter().filter(|f| f.valid_fraction == 1.0).nth(6).unwrap().tile;
    let frame = decode_frame(&store.encoded_tile(layer, tile).unwrap().unwrap().bytes, "tile").unwrap();
    let known = FixRequest {
        layer: "ortho".into(),
        position: PositionPrior::Gaussian {
            centre: tile.centre(),
            sigma_east_m: 60.0,
            sigma_north_m: 60.0,
            correlation: 0.0,
        },
        heading: Some(HeadingPrior { heading_rad: 0.01, sigma_rad: 0.05 }),
        view: View::Nadir { gsd_m_per_px: tile.gsd().mean_m_per_px() },
        scale_sigma_ratio: 0.02,
        time_s: None,
    };
    let lost = FixRequest { position: PositionPrior::WholeLayer, heading: None, ..known.clone() };
    let answer = |store: &Reader, request: &FixRequest| locate(store, &frame, request, 2);
    let position = |answer: &Answer| match answer {
        Answer::Fix(fix) => fix.position,
        Answer::NoFix(no_fix) => panic!("{no_fix:?}"),
    };
    let sound = [answer(store, &known).unwrap(), answer(store, &lost).unwrap()];
    assert!(sound.iter().all(|answer| matches!(answer, Answer::Fix(_))), "{sound:?}");
    let keep = CacheLimits { ground_bytes: 0, cells_bytes: 1_000_000, connections: 1, pages_bytes: 65_536 };
    let little = Reader::open(store.path()).unwrap().with_cache_limits(keep).unwrap();
    assert_eq!([answer(&little, &known).unwrap(), answer(&little, &lost).unwrap()], sound);
    // Room for the cells of 20 tiles of 42: those around a place can be searched, those of the layer cannot.
    let less =
        Reader::open(store.path()).unwrap().with_cache_limits(CacheLimits { cells_bytes: 190_000, ..keep }).unwrap();
    assert_eq!(answer(&less, &known).unwrap(), sound[0]);
    assert!(matches!(answer(&less, &lost), Err(LocateError::MemoryLimit { .. })));
    let square = PositionPrior::Square { centre: tile.centre(), half_width_m: 300.0 };
    let near = FixRequest { position: square, heading: None, scale_sigma_ratio: 0.15, ..known };
    let [whole, around] = [store, &less].map(|store| position(&answer(store, &near).unwrap()));
    let apart_m = LocalFrame::at(whole).enu_from_geodetic(around).length_m();
    assert!(apart_m < 0.1, "{apart_m} m");
}

/// A library that adds the number in a file to the wall clock, seconds.
fn clock_shim(folder: &Path) -> PathBuf {
    let (source, library) = (folder.join("clock.c"), folder.join("clock.so"));
    fs::write(
        &source,
        r#"#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>
int clock_gettime(clockid_t clock, struct timespec *at) {
    long failed = syscall(SYS_clock_gettime, clock, at);
    FILE *file = clock == CLOCK_REALTIME ? fopen(getenv("CLOCK_OFFSET_FILE"), "r") : NULL;
    long long offset_s = 0;
    if (file) {
        if (fscanf(file, "%lld", &offset_s) == 1) at->tv_sec += offset_s;
        fclose(file);
    }
    return (int)failed;
}
"#,
    )
    .unwrap();
    let made = Command::new("cc").args(["-shared", "-fPIC", "-O1", "-o"]).args([&library, &source]).status();
    assert!(made.unwrap().success());
    library
}

#[test]
fn a_clock_that_jumps_takes_nothing_away_in_flight() {
    let folder = tempfile::tempdir().unwrap();
    let shim = clock_shim(folder.path());
    let sound = exported(folder.path(), Some("2031-06-30"));
    let questions = Questions::new(&sound, POOL, 3);
    let offset = folder.path().join("offset");
    let now_s = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_secs() as i64;
    let jump_to = |s: i64| fs::write(&offset, (s - now_s).to_string()).unwrap();
    let start = || {
        let mut command = Command::new(program());
        command.args(["serve", "--onboard", "--listen", "127.0.0.1:0", "--db"]).arg(&sound);
        command.env("LD_PRELOAD", &shim).env("CLOCK_OFFSET_FILE", &offset);
        ServedStore::start_command(command, &folder.path().join("log"))
    };
    let (day_s, last_day_s) = (86_400, 1_940_544_000 + 43_200); // noon of 2031-06-30
    jump_to(last_day_s + day_s);
    let refused = start().err().unwrap_or_default();
    assert!(refused.contains("expired"), "the day after, the start is refused: {refused:?}");
    jump_to(last_day_s);
    let serving = start().unwrap();
    let mut client = serving.client();
    // A day on, 60 years on, back to 1970, and where it was.
    for at_s in [last_day_s, last_day_s + day_s, last_day_s + 60 * 365 * day_s, 3, last_day_s] {
        jump_to(at_s);
        for kind in [QuestionKind::Tile, QuestionKind::Candidates, QuestionKind::Fix, QuestionKind::Catalogue] {
            for index in 0..4 {
                let question = questions.get(kind, index);
                let found = judge_answer(question, &client.send(&question.request).unwrap());
                assert!(matches!(found, AnswerVerdict::Right | AnswerVerdict::Found), "{at_s} s: {found:?}");
            }
        }
        assert_eq!(client.get("/readyz").unwrap().status, 200, "{at_s} s");
    }
}

/// Whether a traced call changes a file: what it was, but for opening to read and for what has its way without one.
fn writes(line: &str) -> bool {
    let opens = ["open(", "openat(", "openat2("].iter().any(|call| line.contains(call));
    let to_write = ["O_WRONLY", "O_RDWR", "O_CREAT", "O_TRUNC", "O_APPEND"].iter().any(|flag| line.contains(flag));
    let changes = [
        "creat(",
        "unlink(",
        "unlinkat(",
        "mkdir(",
        "mkdirat(",
        "rmdir(",
        "rename(",
        "renameat(",
        "renameat2(",
        "truncate(",
        "ftruncate(",
        "link(",
        "linkat(",
        "symlink(",
        "symlinkat(",
        "chmod(",
        "fchmod(",
        "fchmodat(",
        "utimensat(",
        "mknod(",
        "mknodat(",
        "fallocate(",
        "pwrite64(",
        "setxattr(",
    ];
    let call = line.split_whitespace().find(|word| word.contains('(')).unwrap_or("");
    (opens && to_write) || changes.iter().any(|name| call.starts_with(name))
}

#[test]
fn the_rule_for_writing_sees_what_it_should() {
    for line in [
        r#"7 openat(AT_FDCWD, "/a", O_RDWR|O_CLOEXEC) = 3"#,
        r#"7 unlink("/a") = 0"#,
        r#"7 ftruncate(3, 0) = 0"#,
        r#"7 open("/a", O_WRONLY|O_CREAT, 0644) = -1 EROFS"#,
    ] {
        assert!(writes(line), "{line}");
    }
    assert!(!writes(r#"7 openat(AT_FDCWD, "/creat(.gpkg", O_RDONLY|O_CLOEXEC) = 3"#));
}

#[test]
#[ignore = "needs strace"]
fn needs_strace_no_call_of_a_session_writes() {
    let folder = tempfile::tempdir().unwrap();
    let sound = exported(folder.path(), None);
    let questions = Questions::new(&sound, POOL, 4);
    let trace = folder.path().join("trace");
    let mut command = Command::new("strace");
    // `-D`: the child is the service itself, so that it is what is stopped in the end.
    command.args(["-D", "-f", "-q", "-s", "200", "-e", "trace=%file,%desc", "-e", "signal=none", "-o"]).arg(&trace);
    command.arg(program()).args(["serve", "--onboard", "--listen", "127.0.0.1:0", "--db"]).arg(&sound);
    let mut serving = ServedStore::start_command(command, &folder.path().join("log")).unwrap();
    let mut client = serving.client();
    for (kind, count) in [
        (QuestionKind::Tile, 40),
        (QuestionKind::Candidates, 40),
        (QuestionKind::Fix, 3),
        (QuestionKind::Motion, 2),
        (QuestionKind::Malformed, 12),
    ] {
        for index in 0..count {
            let question = questions.get(kind, index);
            let found = judge_answer(question, &client.send(&question.request).unwrap());
            assert!(!matches!(found, AnswerVerdict::Wrong(_)), "{found:?}");
        }
    }
    let pid = serving.pid();
    assert!(Command::new("kill").args(["-TERM", &pid.to_string()]).status().unwrap().success());
    while serving.lives() {
        std::thread::sleep(Duration::from_millis(20));
    }
    // The number stands in a column of five.
    let ended = format!("{pid:<5} +++ exited with 0 +++");
    let mut traced = String::new();
    // The tracer writes its last line a moment after.
    for _ in 0..1_500 {
        traced = fs::read_to_string(&trace).unwrap();
        if traced.contains(&ended) {
            break;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(traced.contains(&ended), "the trace does not reach its end");
    assert!(traced.contains("sound.gpkg") && traced.lines().count() > 500, "nothing was traced");
    let written: Vec<&str> = traced.lines().filter(|line| writes(line)).collect();
    assert!(written.is_empty(), "{written:#?}");
}

#[test]
#[ignore = "needs namespaces"]
fn needs_namespaces_runs_from_a_read_only_mount_as_nobody_without_a_network() {
    let folder = tempfile::tempdir().unwrap();
    fs::set_permissions(folder.path(), Permissions::from_mode(0o755)).unwrap();
    let (card, run) = (folder.path().join("card"), folder.path().join("run"));
    [&card, &run].iter().for_each(|f| fs::create_dir(f).unwrap());
    fs::set_permissions(&run, Permissions::from_mode(0o777)).unwrap();
    let db = exported(&card, None);
    fs::set_permissions(&db, Permissions::from_mode(0o644)).unwrap();
    fs::copy(program(), card.join("overfly")).unwrap();
    let mounted = "mount --bind \"$1\" \"$1\" && mount -o remount,bind,ro \"$1\" && ! touch \"$1/x\" 2>/dev/null";
    let isolated = |then: &str| {
        let mut command = Command::new("unshare");
        command.args(["--mount", "--net", "sh", "-c", &format!("{mounted} && {then}"), "sh"]).args([&card, &run]);
        command
    };
    let nobody = "exec setpriv --reuid=65534 --regid=65534 --clear-groups --";
    let serve = "\"$1/overfly\" serve --onboard --db \"$1/sound.gpkg\" --memory 128MB --listen \"unix:$2/o.sock\"";
    let mut child =
        isolated(&format!("{nobody} {serve}")).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    assert!(line.starts_with("listening on unix:"), "{line:?}");
    let ask = |path: &str| {
        let mut stream = UnixStream::connect(run.join("o.sock")).unwrap();
        let request = String::from_utf8(get(path))
            .unwrap()
            .replace("host: localhost\r\n", "host: localhost\r\nconnection: close\r\n");
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let head = answer.windows(4).position(|w| w == b"\r\n\r\n").unwrap();
        (String::from_utf8_lossy(&answer[9..12]).into_owned(), answer[head + 4..].to_vec())
    };
    assert_eq!(ask("/readyz").0, "200");
    let questions = Questions::new(&db, POOL, 6);
    for index in 0..20 {
        let question = questions.get(QuestionKind::Tile, index);
        let path = String::from_utf8_lossy(&question.request).split(' ').nth(1).unwrap().to_owned();
        let ExpectedAnswer::Bytes(hash) = question.expected else { panic!("a tile is its bytes") };
        assert_eq!(blake3::hash(&ask(&path).1), hash, "{path}");
    }
    assert!(Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(!run.join("o.sock").exists());
    let mut names: Vec<_> = fs::read_dir(&card).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["overfly", "sound.gpkg"]);
}
