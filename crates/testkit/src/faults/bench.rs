//! `FaultBench`: runs an operation under a fault and checks the result. The target is absent, old or new, and valid;
//! no side files are left; the same command, run again without a fault, gives the undisturbed result.

use super::operation::{TARGET, WriteOperation};
use super::shim::{FaultKind, InjectedFault, Shim, ShimReport};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The target after a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum TargetState {
    Absent,
    Old,
    /// The old store, or an empty one, with a layer that is marked unfinished.
    Unfinished,
    New,
}

/// A work folder in which operations run under faults.
pub struct FaultBench {
    overfly: PathBuf,
    shim: Shim,
    work: PathBuf,
}

/// The result of an undisturbed run.
pub struct Undisturbed {
    old_digest: Option<String>,
    digest: String,
    names: Vec<OsString>,
    bytes: Option<Vec<u8>>,
    /// Calls of each kind.
    pub counts: Vec<u64>,
}

/// The output of `overfly verify` for a store.
struct VerifyResult {
    good: bool,
    json: serde_json::Value,
}

impl FaultBench {
    /// Makes a bench in `folder`. `Err`: the reason why no fault can be injected into `overfly`.
    pub fn new(overfly: &Path, folder: &Path) -> Result<Self, String> {
        let work = folder.join("work");
        std::fs::create_dir(&work).expect("the rig reads and writes its own files");
        Ok(Self { overfly: overfly.into(), shim: Shim::compile(folder, overfly)?, work })
    }

    /// The program with arguments; `{}` in them stands for the work folder.
    pub fn command(&self, arguments: &[OsString]) -> Command {
        let mut command = Command::new(&self.overfly);
        command.args(["--json", "--quiet"]);
        let work = self.work.to_str().expect("the path is UTF-8");
        command.args(arguments.iter().map(|a| a.to_str().expect("the path is UTF-8").replace("{}", work)));
        command
    }

    /// Runs a command that must succeed.
    pub fn succeed(&self, arguments: &[OsString]) {
        let output = self.command(arguments).output().expect("the program runs");
        assert!(output.status.success(), "{arguments:?}: {}", text(&output));
    }

    /// Runs a command under a fault; returns its output and the report of the shim.
    pub fn disturb(&self, arguments: &[OsString], fault: InjectedFault) -> (Output, ShimReport) {
        let output = self.armed(arguments, fault).output().expect("the program runs");
        (output, self.report())
    }

    /// A command with a fault injected.
    pub fn armed(&self, arguments: &[OsString], fault: InjectedFault) -> Command {
        let mut command = self.command(arguments);
        self.shim.arm(&mut command, &self.work, fault);
        command
    }

    /// The shim's report of the last command with a fault.
    pub fn report(&self) -> ShimReport {
        self.shim.report()
    }

    /// Empties the work folder and copies files into it.
    pub fn lay_out(&self, before: &BTreeMap<&'static str, PathBuf>) {
        for name in self.names() {
            std::fs::remove_file(self.work.join(name)).expect("the rig reads and writes its own files");
        }
        for (name, file) in before {
            std::fs::copy(file, self.work.join(name)).expect("the rig reads and writes its own files");
        }
    }

    /// Runs an operation without a fault.
    pub fn undisturbed(&self, operation: &WriteOperation) -> Undisturbed {
        let digest = |verdict: &VerifyResult| {
            assert!(verdict.good, "{}", verdict.json);
            verdict.digest()
        };
        self.lay_out(&operation.before);
        let old_digest = operation.before.contains_key(TARGET).then(|| digest(&self.verify(operation)));
        let (output, report) = self.disturb(&operation.arguments, InjectedFault { kind: FaultKind::Kill, at: 0 });
        assert!(output.status.success(), "{}", text(&output));
        let (digest, names) = (digest(&self.verify(operation)), self.names());
        assert_ne!(Some(&digest), old_digest.as_ref(), "old and new can be told apart");
        let bytes =
            operation.same_bytes.then(|| std::fs::read(self.target()).expect("the rig reads and writes its own files"));
        Undisturbed { old_digest, digest, names, bytes, counts: report.counts }
    }

    /// Runs an operation under a fault. Returns the state of the target, and whether the fault was met.
    ///
    /// # Errors
    /// What is wrong with the program.
    pub fn endure(
        &self,
        operation: &WriteOperation,
        expected: &Undisturbed,
        fault: InjectedFault,
    ) -> Result<(TargetState, bool), String> {
        self.lay_out(&operation.before);
        let (output, ShimReport { fired, .. }) = self.disturb(&operation.arguments, fault);
        let wrong = |what: String| {
            let met = fired.as_deref().unwrap_or("no call");
            format!("{}, {:?} at {} ({met}): {what}\n  {}", operation.name, fault.kind, fault.at, text(&output))
        };
        let succeeded = output.status.success();
        self.judge_exit(operation, fault, fired.as_deref(), &output).map_err(&wrong)?;
        if !succeeded && !fault.kind.kills() && !operation.resumes {
            self.judge_litter(operation, expected, fault).map_err(&wrong)?;
        }
        let end = self.judge_target(operation, expected).map_err(&wrong)?;
        if succeeded && end != TargetState::New {
            return Err(wrong(format!("it says that all went well, and the target is {end:?}")));
        }
        self.judge_inputs(operation).map_err(&wrong)?;
        let again = self.command(&operation.arguments).output().expect("the program runs");
        let is_kept = operation.makes_map && end == TargetState::New && text(&again).contains("in_the_way");
        if !again.status.success() && !is_kept {
            return Err(wrong(format!("the same command once more fails: {}", text(&again))));
        }
        self.judge_end(operation, expected)
            .map_err(|what| wrong(format!("after {end:?} and the same command once more: {what}")))?;
        Ok((end, fired.is_some()))
    }

    /// The process was killed by the fault and by nothing else, or it ended with an exit code; a failure has a
    /// helpful message.
    fn judge_exit(
        &self,
        operation: &WriteOperation,
        fault: InjectedFault,
        fired: Option<&str>,
        output: &Output,
    ) -> Result<(), String> {
        let said = text(output);
        if said.contains("panicked") {
            return Err("it panics".into());
        }
        match (output.status.signal(), output.status.code(), fired) {
            (Some(9), _, Some(_)) if fault.kind.kills() => Ok(()),
            (_, Some(0), _) => Ok(()),
            (_, Some(code @ 1..=3), Some(call)) if !fault.kind.kills() && fault.kind != FaultKind::Short => {
                self.judge_words(operation, fault.kind, call, code, &said)
            }
            _ => Err(format!("{}", output.status)),
        }
    }

    /// A failure names the file, has an error code that fits the fault, and an exit code that fits the error code.
    fn judge_words(
        &self,
        operation: &WriteOperation,
        kind: FaultKind,
        call: &str,
        exit: i32,
        said: &str,
    ) -> Result<(), String> {
        let names = |word: &str| said.contains(&format!("error[{word}]"));
        let (opens, reads) = (call.starts_with("open"), call.starts_with("pread") || call.starts_with("read"));
        let fits = match kind {
            // SQLite says only that a sync or a rollback failed.
            FaultKind::Full | FaultKind::FullOnce if operation.resumes && names("disk_error") => {
                exit == 1 && said.contains("is full")
            }
            FaultKind::Full | FaultKind::FullOnce => names("disk_full") && exit == 1,
            _ => names("disk_error") && exit == 1,
        };
        // SQLite takes unreadable data for damage, and does not say why a file cannot be opened.
        let of_read = reads
            && exit == 2
            && ["damaged_store", "not_a_store", "altered_patch", "not_a_patch"].iter().any(|w| names(w));
        let of_open =
            opens && said.contains("disk") && (names("no_journal") && exit == 1 || names("permission_denied"));
        if !said.contains(self.work.to_str().expect("the path is UTF-8")) {
            return Err("it does not name the file".into());
        }
        if fits || of_open || of_read { Ok(()) } else { Err(format!("exit code {exit} with these words")) }
    }

    /// A failed run leaves no files, if it could remove them.
    fn judge_litter(
        &self,
        operation: &WriteOperation,
        expected: &Undisturbed,
        fault: InjectedFault,
    ) -> Result<(), String> {
        let before: Vec<OsString> = operation.before.keys().map(Into::into).collect();
        let names = self.names();
        if fault.kind == FaultKind::Bad || names == before || names == expected.names {
            return Ok(());
        }
        Err(format!("it leaves {names:?}"))
    }

    fn judge_target(&self, operation: &WriteOperation, expected: &Undisturbed) -> Result<TargetState, String> {
        if !self.target().exists() {
            let was = operation.before.contains_key(TARGET);
            return if was { Err("the old target is gone".into()) } else { Ok(TargetState::Absent) };
        }
        let verdict = self.verify(operation);
        let digest = verdict.digest();
        if verdict.good {
            return match () {
                () if digest == expected.digest => self.judge_bytes(expected).map(|()| TargetState::New),
                () if Some(&digest) == expected.old_digest.as_ref() => Ok(TargetState::Old),
                () => Err(format!("the target is neither old nor new: {}", verdict.json)),
            };
        }
        let kept = match &expected.old_digest {
            Some(old) => digest == *old && verdict.only_unfinished(),
            None => verdict.says_empty_or_unfinished(),
        };
        if operation.resumes && kept {
            return Ok(TargetState::Unfinished);
        }
        Err(format!("the target is not valid: {}", verdict.json))
    }

    /// The inputs of an operation are unchanged.
    fn judge_inputs(&self, operation: &WriteOperation) -> Result<(), String> {
        for (name, file) in operation.before.iter().filter(|(name, _)| **name != TARGET) {
            if std::fs::read(self.work.join(name)).expect("the rig reads and writes its own files")
                != std::fs::read(file).expect("the rig reads and writes its own files")
            {
                return Err(format!("{name} was changed"));
            }
        }
        Ok(())
    }

    /// The result is that of an undisturbed run.
    fn judge_end(&self, operation: &WriteOperation, expected: &Undisturbed) -> Result<(), String> {
        let verdict = self.verify(operation);
        if !verdict.good || verdict.digest() != expected.digest {
            return Err(format!("another result: {}", verdict.json));
        }
        self.judge_bytes(expected)?;
        let names = self.names();
        if names == expected.names { Ok(()) } else { Err(format!("left are {names:?}")) }
    }

    fn judge_bytes(&self, expected: &Undisturbed) -> Result<(), String> {
        let other = expected.bytes.as_ref().is_some_and(|bytes| {
            std::fs::read(self.target()).expect("the rig reads and writes its own files") != *bytes
        });
        if other { Err("the target has other bytes".into()) } else { Ok(()) }
    }

    /// The output of a new `overfly verify` process for the target; for a patch, which has no such command, the
    /// digest of its bytes.
    fn verify(&self, operation: &WriteOperation) -> VerifyResult {
        if operation.makes_patch {
            let digest = blake3::hash(&std::fs::read(self.target()).expect("the rig reads and writes its own files"))
                .to_hex()
                .to_string();
            return VerifyResult { good: true, json: serde_json::json!({"digest": digest}) };
        }
        let output = self
            .command(&["verify".into(), "--every-tile".into(), self.target().into()])
            .output()
            .expect("the program runs");
        let lines = String::from_utf8_lossy(&output.stdout).into_owned();
        let json = lines.lines().last().and_then(|line| serde_json::from_str(line).ok()).unwrap_or_default();
        VerifyResult { good: output.status.success(), json }
    }

    /// The files of the work folder, by name.
    pub fn content(&self) -> BTreeMap<OsString, Vec<u8>> {
        self.names()
            .into_iter()
            .map(|name| {
                (name.clone(), std::fs::read(self.work.join(name)).expect("the rig reads and writes its own files"))
            })
            .collect()
    }

    fn target(&self) -> PathBuf {
        self.work.join(TARGET)
    }

    fn names(&self) -> Vec<OsString> {
        let mut names: Vec<_> = std::fs::read_dir(&self.work)
            .expect("the rig reads and writes its own files")
            .map(|e| e.expect("the rig reads and writes its own files").file_name())
            .collect();
        names.sort();
        names
    }
}

impl VerifyResult {
    fn digest(&self) -> String {
        self.json["digest"].as_str().unwrap_or_default().to_owned()
    }

    /// Whether unfinished layers are the only problem.
    fn only_unfinished(&self) -> bool {
        let problems = self.json["problems"].as_array().cloned().unwrap_or_default();
        let unfinished = |p: &serde_json::Value| p.as_str().is_some_and(|p| p.contains("unfinished build"));
        !problems.is_empty()
            && problems.iter().all(unfinished)
            && self.json["bad_tiles"].as_array().is_some_and(Vec::is_empty)
    }

    fn says_empty_or_unfinished(&self) -> bool {
        matches!(self.json["error"].as_str(), Some("unfinished_build" | "empty_store"))
    }
}

/// The output of a program.
pub fn text(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stderr), String::from_utf8_lossy(&output.stdout))
}
