//! glibc's allocator, told to give freed memory back to the system.

/// Limits the number of heaps of glibc's allocator, maps large pieces on their own, and gives back what is free at a heap's end. By
/// default glibc keeps up to eight heaps a core: a service that holds 100 MB grows to four times that, and fills 1 GiB of address space
/// with the reserves of its heaps.
///
/// Does nothing with another C library, or if the environment already sets `MALLOC_ARENA_MAX`. Call this before the program starts
/// threads: heaps that exist already stay.
#[cfg_attr(not(all(target_os = "linux", target_env = "gnu")), expect(unused_variables))]
pub fn limit_heaps(heaps: usize) {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    if std::env::var_os("MALLOC_ARENA_MAX").is_none() {
        let heaps = libc::c_int::try_from(heaps).unwrap_or(libc::c_int::MAX);
        let settings =
            [(libc::M_ARENA_MAX, heaps), (libc::M_MMAP_THRESHOLD, 131_072), (libc::M_TRIM_THRESHOLD, 131_072)];
        for (parameter, value) in settings {
            // SAFETY: mallopt(3) takes any two integers; it only changes parameters of the allocator, under its own lock.
            let accepted = unsafe { libc::mallopt(parameter, value) };
            debug_assert_eq!(accepted, 1, "glibc knows these parameters");
        }
    }
}
