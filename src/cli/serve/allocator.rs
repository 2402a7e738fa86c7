//! Memory that threads have freed goes back to the system.

use std::os::unix::process::CommandExt;
use std::process::Command;

/// What glibc is told: two heaps for all threads instead of eight a core, large pieces on their own, and what is free at a
/// heap's end given back. By its defaults a service that holds 100 MB grows to four times that.
const SETTINGS: [(&str, &str); 3] =
    [("MALLOC_ARENA_MAX", "2"), ("MALLOC_MMAP_THRESHOLD_", "131072"), ("MALLOC_TRIM_THRESHOLD_", "131072")];

/// Starts this program again in its own place (the same process) with the allocator told to be sparing: it reads its settings
/// before the program runs. Does nothing where the environment already says something of it, or where that fails.
pub fn spare() {
    if !cfg!(all(target_os = "linux", target_env = "gnu")) || std::env::var_os(SETTINGS[0].0).is_some() {
        return;
    }
    let mut arguments = std::env::args_os();
    let name = arguments.next();
    if let Ok(program) = std::env::current_exe() {
        let mut again = Command::new(program);
        if let Some(name) = name {
            again.arg0(name);
        }
        // Returns only where it failed: then more memory is taken, and that is all.
        let _ = again.args(arguments).envs(SETTINGS).exec();
    }
}
