//! glibc's allocator, told to give freed memory back to the system.

/// Limits glibc's allocator to two heaps, maps large pieces on their own, and gives back what is free at a heap's end. By default
/// glibc keeps up to eight heaps a core, and a service that holds 100 MB grows to four times that.
///
/// Does nothing with another C library, or if the environment already sets `MALLOC_ARENA_MAX`. Call this before the program starts
/// threads: heaps that exist already stay.
pub fn limit_heaps() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    if std::env::var_os("MALLOC_ARENA_MAX").is_none() {
        let settings = [(libc::M_ARENA_MAX, 2), (libc::M_MMAP_THRESHOLD, 131_072), (libc::M_TRIM_THRESHOLD, 131_072)];
        for (parameter, value) in settings {
            // SAFETY: mallopt(3) takes any two integers; it only changes parameters of the allocator, under its own lock.
            let accepted = unsafe { libc::mallopt(parameter, value) };
            debug_assert_eq!(accepted, 1, "glibc knows these parameters");
        }
    }
}
