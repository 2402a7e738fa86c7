//! `Shim`: the compiled layer of `fault.c`, and the faults it can inject.

use std::path::{Path, PathBuf};
use std::process::Command;

const READ: u32 = 1;
const WRITE: u32 = 2;
const MAKE: u32 = 4;
const OPEN: u32 = 8;
const SYNC: u32 = 16;
const CUT: u32 = 32;
const RENAME: u32 = 64;
const UNLINK: u32 = 128;
const LOOK: u32 = 256;

const EIO: u32 = 5;
const ENOSPC: u32 = 28;

/// A kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FaultKind {
    /// SIGKILL before a call that changes something.
    Kill,
    /// SIGKILL in the middle of a write, half of which is done.
    Torn,
    /// SIGKILL; some or all of the unsynced data is lost.
    Power,
    /// The disk is full from here on.
    Full,
    /// The disk is full once.
    FullOnce,
    /// The disk fails from here on.
    Bad,
    /// The disk fails once.
    BadOnce,
    /// Half of the data is read or written, which is not an error.
    Short,
    /// A read finds the end of the file too early.
    End,
}

impl FaultKind {
    pub const KILLS: [Self; 3] = [Self::Kill, Self::Torn, Self::Power];
    pub const FULL: [Self; 2] = [Self::Full, Self::FullOnce];
    pub const IO: [Self; 4] = [Self::Bad, Self::BadOnce, Self::Short, Self::End];

    pub fn kills(self) -> bool {
        Self::KILLS.contains(&self)
    }

    fn calls(self) -> u32 {
        let changes = WRITE | MAKE | SYNC | CUT | RENAME | UNLINK;
        match self {
            Self::Kill | Self::Power => changes,
            Self::Torn => WRITE,
            Self::Full | Self::FullOnce => WRITE | MAKE | SYNC | RENAME,
            Self::Bad | Self::BadOnce => changes | READ | OPEN | LOOK,
            Self::Short => READ | WRITE,
            Self::End => READ,
        }
    }

    /// Number of calls that could meet the fault, from the calls of each kind.
    pub fn points(self, counts: &[u64]) -> u64 {
        (0..counts.len()).filter(|bit| self.calls() & (1 << bit) != 0).map(|bit| counts[bit]).sum()
    }

    fn does(self) -> &'static str {
        match self {
            Self::Kill => "kill",
            Self::Torn => "torn",
            Self::Power => "power",
            Self::Full | Self::FullOnce | Self::Bad | Self::BadOnce => "fail",
            Self::Short => "short",
            Self::End => "end",
        }
    }

    fn error_number(self) -> u32 {
        if Self::FULL.contains(&self) { ENOSPC } else { EIO }
    }

    fn stays(self) -> bool {
        matches!(self, Self::Full | Self::Bad)
    }
}

/// A fault and the number of the call that meets it, from 1. At 0 the fault never happens, and calls are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InjectedFault {
    pub kind: FaultKind,
    pub at: u64,
}

/// The report of the layer about a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ShimReport {
    /// The call that met the fault, and its file; `None` if the run ended before.
    pub fired: Option<String>,
    /// Calls of each kind, if the run was not killed.
    pub counts: Vec<u64>,
}

/// The compiled layer.
pub struct Shim {
    library: PathBuf,
    report: PathBuf,
}

impl Shim {
    /// Compiles the layer into `folder`. `Err`: the reason why `program` cannot run under it.
    pub fn compile(folder: &Path, program: &Path) -> Result<Self, String> {
        if !cfg!(target_os = "linux") {
            return Err("faults are injected by LD_PRELOAD, which only Linux has".into());
        }
        let source = folder.join("fault.c");
        std::fs::write(&source, include_str!("fault.c")).expect("the rig reads and writes its own files");
        let (library, report) = (folder.join("fault.so"), folder.join("report"));
        let compiler = std::env::var_os("CC").unwrap_or_else(|| "cc".into());
        let made = Command::new(compiler)
            .args(["-shared", "-fPIC", "-O1", "-o"])
            .args([&library, &source])
            .args(["-ldl", "-lpthread"])
            .status();
        assert!(made.expect("a C compiler is there").success(), "fault.c does not compile");
        let shim = Self { library, report };
        let mut command = Command::new(program);
        shim.arm(&mut command, folder, InjectedFault { kind: FaultKind::Kill, at: 0 });
        assert!(command.arg("--version").output().expect("the program runs").status.success());
        if shim.report.exists() { Ok(shim) } else { Err("it is a static binary: LD_PRELOAD does not reach it".into()) }
    }

    /// Injects `fault` into `command`, for files whose path begins with `under`.
    pub fn arm(&self, command: &mut Command, under: &Path, fault: InjectedFault) {
        // Removes the report of an earlier run.
        let _ = std::fs::remove_file(&self.report);
        command
            .env("LD_PRELOAD", &self.library)
            .env("OVERFLY_FAULT_UNDER", under)
            .env("OVERFLY_FAULT_REPORT", &self.report)
            .env("OVERFLY_FAULT_CALLS", fault.kind.calls().to_string())
            .env("OVERFLY_FAULT_AT", fault.at.to_string())
            .env("OVERFLY_FAULT_STAYS", if fault.kind.stays() { "1" } else { "0" })
            .env("OVERFLY_FAULT_DOES", fault.kind.does())
            .env("OVERFLY_FAULT_ERRNO", fault.kind.error_number().to_string());
    }

    /// The report of the last armed run.
    pub fn report(&self) -> ShimReport {
        let text = std::fs::read_to_string(&self.report).unwrap_or_default();
        let line = |word: &str| text.lines().find_map(|l| l.strip_prefix(word)).map(str::to_owned);
        let counts = line("count ").unwrap_or_default();
        ShimReport { fired: line("fired "), counts: counts.split(' ').filter_map(|n| n.parse().ok()).collect() }
    }
}
