//! The only unsafe code, and the only questions put to the operating system.

/// Largest resident set of this process so far, bytes (`VmHWM`); 0 where the kernel does not tell.
pub fn peak_rss_bytes() -> u64 {
    status_kib("VmHWM:") * 1024
}

/// Memory that can be taken without swapping, bytes (`MemAvailable`); `u64::MAX` where the kernel does not tell.
pub fn available_memory_bytes() -> u64 {
    std::fs::read_to_string("/proc/meminfo")
        .ok()
        .and_then(|t| kib_after(&t, "MemAvailable:"))
        .map_or(u64::MAX, |k| k * 1024)
}

fn status_kib(key: &str) -> u64 {
    std::fs::read_to_string("/proc/self/status").ok().and_then(|t| kib_after(&t, key)).unwrap_or(0)
}

fn kib_after(text: &str, key: &str) -> Option<u64> {
    text.lines().find_map(|l| l.strip_prefix(key))?.split_whitespace().next()?.parse().ok()
}
