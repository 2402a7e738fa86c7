//! Spells the remedies of the store for the service: routes for callers, actions for operators.

use overfly_store::StoreRemedy;

/// What a caller or operator of the service can do; `None` for remedies that apply only to commands.
pub(super) fn spell(remedy: StoreRemedy) -> Option<&'static str> {
    use StoreRemedy as R;
    match remedy {
        R::Wait => Some("try again later"),
        R::Reopen => Some("the service must be started again"),
        R::ResumeBuild | R::ResumeBuildAndCopy | R::ResumeBuildOrGrantAccess => {
            Some("its build must be finished; GET /v1/layers lists the layers and whether they are complete")
        }
        R::RestoreOrRebuild | R::RestoreOrExportAgain | R::VerifyAndRestore => {
            Some("the store must be restored from a copy; GET /healthz lists the damage")
        }
        R::EndWalMode => Some("the program that has the store open must be closed"),
        R::GrantAccess => Some("the store's file must be made readable"),
        R::CheckDisk | R::CheckDiskAndOpenFiles => Some("the disk of the service must be checked"),
        R::FreeSpace => Some("the disk of the service needs free space"),
        R::Build
        | R::Rebuild
        | R::Migrate
        | R::UpdateProgram
        | R::BuildOriginalAndExport
        | R::CreateFolder
        | R::RenameOrRemove
        | R::ChooseOtherName
        | R::ChooseOtherPath
        | R::GenerateKey
        | R::ExportSigned
        | R::CheckStoreAndKey
        | R::ExportAgain
        | R::ExportWithSerial
        | R::StateOut
        | R::CopyAgain
        | R::CopyNewestStore
        | R::MakePatch
        | R::CopyPatchAgain
        | R::MakePatchFromThisStore
        | R::CopyStore
        | R::SetClock
        | R::UseNewerImageryOrPolicy => None,
    }
}
