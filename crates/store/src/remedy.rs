//! `StoreRemedy`: what helps against an error of this crate.

/// What helps against an error. The library names the action; the program that uses it says how, with its own commands or routes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StoreRemedy {
    /// Build a store.
    Build,
    /// Run the same build again: it continues where it stopped.
    ResumeBuild,
    /// Run the same build again where the store can be written, then copy the store.
    ResumeBuildAndCopy,
    /// Run the same build again, or make file and folder writable.
    ResumeBuildOrGrantAccess,
    /// Close the program that has the store open, or end its WAL mode.
    EndWalMode,
    /// Build the store again with this program.
    Rebuild,
    /// Open the store for writing: any build migrates it.
    Migrate,
    /// Use a newer version of the program.
    UpdateProgram,
    /// Build into the store that this one was exported from, and export that.
    BuildOriginalAndExport,
    /// Make file and folder accessible, or choose another path.
    GrantAccess,
    /// Create the folder, or choose another path.
    CreateFolder,
    /// Free space on the disk, and run the same command again.
    FreeSpace,
    /// Check the disk and its free space, and run the same command again, or use a copy on another disk.
    CheckDisk,
    /// Check the disk, its free space and the limit of open files, and run the same command again.
    CheckDiskAndOpenFiles,
    /// Wait until the other program has finished.
    Wait,
    /// Open the store again.
    Reopen,
    /// Restore the store from a copy, or build it again.
    RestoreOrRebuild,
    /// Restore the store from a copy, or export it again.
    RestoreOrExportAgain,
    /// Verify the store to list every damaged tile, and restore it from a copy.
    VerifyAndRestore,
    /// Choose another name, or remove what exists there.
    RenameOrRemove,
    /// Choose another name.
    ChooseOtherName,
    /// Choose another path.
    ChooseOtherPath,
    /// Write the result to another file than the store.
    StateOut,
    /// Generate a pair of keys.
    GenerateKey,
    /// Export the store with a signature.
    ExportSigned,
    /// Check that this is the right store and the right key.
    CheckStoreAndKey,
    /// Copy the original again, and open copies with other programs read-only.
    CopyAgain,
    /// Copy the newest store, or state that an older one is meant.
    CopyNewestStore,
    /// Export the store again.
    ExportAgain,
    /// Export the store again, with a serial.
    ExportWithSerial,
    /// Make a patch from two stores.
    MakePatch,
    /// Copy the patch again, or make it again.
    CopyPatchAgain,
    /// Make a patch from this store.
    MakePatchFromThisStore,
    /// Copy the new store as a whole. The old store is unchanged.
    CopyStore,
    /// Set the clock, or correct the dates of the imagery.
    SetClock,
    /// Build the store from newer imagery, or change the policy on stale layers.
    UseNewerImageryOrPolicy,
}
