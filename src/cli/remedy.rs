//! Spells the remedies of the store and of the search as commands and flags.

use overfly_flight::locate::LocateError;
use overfly_store::StoreRemedy;

/// What helps against an error of `locate`, if anything is known to.
pub fn locate_remedy(error: &LocateError) -> Option<&'static str> {
    match error {
        LocateError::Store(error) => error.remedy().map(spell_for_crew),
        LocateError::MemoryLimit { .. } => Some("`overfly serve --memory SIZE` allows more"),
        LocateError::Camera(_)
        | LocateError::Parameter { .. }
        | LocateError::Missing { .. }
        | LocateError::Conflict { .. }
        | LocateError::Cancelled
        | LocateError::TooWide { .. }
        | LocateError::TooManyTiles { .. } => None,
    }
}

/// Spells a remedy for those who load and fly the aircraft: they can copy files and ask the planner, and cannot build, export or sign.
pub fn spell_for_crew(remedy: StoreRemedy) -> &'static str {
    use StoreRemedy as R;
    match remedy {
        R::Build => "check the name, or copy the store again",
        R::ResumeBuild | R::ResumeBuildAndCopy | R::ResumeBuildOrGrantAccess => {
            "ask the planner to finish it, then copy only the store, without the -wal or -journal file beside it"
        }
        R::Rebuild | R::Migrate => {
            "ask the planner for a store that this overfly reads, or install the overfly that made it"
        }
        R::BuildOriginalAndExport | R::ExportAgain | R::ExportWithSerial => "ask the planner for a new one",
        R::RestoreOrRebuild | R::RestoreOrExportAgain | R::VerifyAndRestore => {
            "copy it again; if it still fails, ask the planner for a new one"
        }
        R::GenerateKey => "name the public key, KEY.pub, that the planner has sent",
        R::ExportSigned => "ask the planner for a signed one",
        R::CopyAgain => "copy it again; other programs may open a copy of it, but not this file",
        R::MakePatch | R::CopyPatchAgain => "copy the patch again; if it still fails, copy the new store as a whole",
        R::MakePatchFromThisStore => "ask the planner for a patch from this store, or copy the new store as a whole",
        R::UseNewerImageryOrPolicy => "ask the planner for newer imagery, or change `--stale-after-days`",
        R::SetClock => "set the clock; if it is right, ask the planner for a new one",
        R::UpdateProgram
        | R::EndWalMode
        | R::GrantAccess
        | R::CreateFolder
        | R::FreeSpace
        | R::StateOut
        | R::CheckDisk
        | R::CheckDiskAndOpenFiles
        | R::Wait
        | R::Reopen
        | R::RenameOrRemove
        | R::ChooseOtherName
        | R::ChooseOtherPath
        | R::CheckStoreAndKey
        | R::CopyStore
        | R::CopyNewestStore => spell(remedy),
    }
}

/// Spells a remedy of the store.
pub fn spell(remedy: StoreRemedy) -> &'static str {
    use StoreRemedy as R;
    match remedy {
        R::Build => "check the name, or make a store with `overfly build --db FILE SOURCE...`",
        R::ResumeBuild => "run the same `overfly build` again: it continues where it stopped",
        R::ResumeBuildAndCopy => {
            "run the same `overfly build` again where the store can be written, then copy the store"
        }
        R::ResumeBuildOrGrantAccess => "run the same `overfly build` again, or make file and folder writable",
        R::EndWalMode => {
            "close the program that has it open; if none has, `sqlite3 FILE .tables` brings the changes in"
        }
        R::Rebuild => "build the store again with this program",
        R::Migrate => "any `overfly build --db FILE` migrates it",
        R::UpdateProgram => "use a newer overfly",
        R::BuildOriginalAndExport => "change the store that it was exported from, and export that again",
        R::GrantAccess => "make file and folder accessible, or choose another path",
        R::CreateFolder => "create the folder, or choose another path",
        R::FreeSpace => "free space on the disk and run the same command again",
        R::CheckDisk => {
            "check the disk and its free space, then run the same command again, or use a copy on another disk"
        }
        R::CheckDiskAndOpenFiles => {
            "check the disk, its free space and the limit of open files, then run the same command again"
        }
        R::Wait => "wait until the other run has finished",
        R::Reopen => "run the command again, or restart the service",
        R::RestoreOrRebuild => "restore it from a copy, or build it again",
        R::RestoreOrExportAgain => "restore it from a copy, or export it again",
        R::VerifyAndRestore => "`overfly verify` lists all damaged tiles; restore the store from a copy",
        R::RenameOrRemove => "choose another name, or remove what exists there",
        R::ChooseOtherName => "choose another name",
        R::ChooseOtherPath => "choose another path",
        R::StateOut => "write the result to another file with --out FILE",
        R::GenerateKey => {
            "`overfly keygen --out KEY` makes KEY (PKCS#8 PEM, to sign) and KEY.pub (SPKI PEM, to verify), both Ed25519"
        }
        R::ExportSigned => "export it with `overfly export --serial N --sign KEY`",
        R::CheckStoreAndKey => "check that it is the right store and the right key",
        R::ExportAgain => "export it again, with the last day of the flight as --valid-until",
        R::ExportWithSerial => "export it again with --serial N",
        R::CopyAgain => "copy the original again, and let other programs open copies of it read-only",
        R::CopyNewestStore => "copy the newest store, or state --allow-older to go back on purpose",
        R::MakePatch => "`overfly diff OLD NEW --out PATCH` makes a patch",
        R::CopyPatchAgain => "copy the patch again, or make it again with `overfly diff`",
        R::MakePatchFromThisStore => "make a patch from this store with `overfly diff`",
        R::CopyStore => "the old store is unchanged: copy the new store as a whole",
        R::SetClock => "set the clock, or correct the date: `overfly layer describe --date D`",
        R::UseNewerImageryOrPolicy => "build it from newer imagery, or change `--stale-after-days`",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crew_is_never_told_to_build_export_or_sign() {
        use StoreRemedy as R;
        let all = [
            R::Build,
            R::ResumeBuild,
            R::ResumeBuildAndCopy,
            R::ResumeBuildOrGrantAccess,
            R::EndWalMode,
            R::Rebuild,
            R::Migrate,
            R::UpdateProgram,
            R::BuildOriginalAndExport,
            R::GrantAccess,
            R::CreateFolder,
            R::FreeSpace,
            R::CheckDisk,
            R::CheckDiskAndOpenFiles,
            R::Wait,
            R::Reopen,
            R::RestoreOrRebuild,
            R::RestoreOrExportAgain,
            R::VerifyAndRestore,
            R::RenameOrRemove,
            R::ChooseOtherName,
            R::ChooseOtherPath,
            R::GenerateKey,
            R::ExportSigned,
            R::CheckStoreAndKey,
            R::ExportAgain,
            R::ExportWithSerial,
            R::StateOut,
            R::MakePatch,
            R::CopyPatchAgain,
            R::MakePatchFromThisStore,
            R::CopyStore,
            R::SetClock,
            R::UseNewerImageryOrPolicy,
        ];
        for remedy in all {
            let said = spell_for_crew(remedy);
            for word in ["build", "overfly export", "overfly diff", "keygen", "--sign"] {
                assert!(!said.contains(word), "{remedy:?}: {said}");
            }
        }
    }
}
