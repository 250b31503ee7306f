//! Limits of memory besides that of the machine: control groups (v1 and v2) and the address space of the process.

use std::fs;
use std::path::{Path, PathBuf};

/// Where control groups are mounted.
const CGROUPS: &str = "/sys/fs/cgroup";

/// Bytes that this process, of which `resident_kib` are resident, can still take under its control groups, its limit of address space and the
/// memory of its job; `None` without such limits.
pub(super) fn limit(resident_kib: u64) -> Option<u64> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok().and_then(|text| cgroups(Path::new(CGROUPS), &text));
    let text = |file: &str| fs::read_to_string(format!("/proc/self/{file}")).unwrap_or_default();
    let job = std::env::var("SLURM_MEM_PER_NODE").ok().and_then(|mib| of_job(&mib, resident_kib));
    [groups, address_space(&text("limits"), &text("status")), job].into_iter().flatten().min()
}

/// What a job of Slurm leaves where no control group enforces its memory (MiB): that less the resident set of this process.
fn of_job(mib: &str, resident_kib: u64) -> Option<u64> {
    // Zero is the whole node.
    let limit = mib.parse::<u64>().ok().filter(|m| *m > 0)?.checked_mul(1 << 20)?;
    Some(limit.saturating_sub(1024 * resident_kib))
}

/// The least of all control groups from that of the process up to the root. `membership`: the text of `/proc/self/cgroup`.
fn cgroups(mount: &Path, membership: &str) -> Option<u64> {
    let mut smallest = None;
    for line in membership.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (parts.next(), parts.next()) else { continue };
        let v1 = controllers.split(',').any(|c| c == "memory");
        if !v1 && !controllers.is_empty() {
            continue;
        }
        let root = if v1 { mount.join("memory") } else { mount.to_path_buf() };
        // In a container the path may be that of the host; then only the root is there.
        let folders = Path::new(path.trim_start_matches('/')).ancestors().map(|p| root.join(p)).collect::<Vec<_>>();
        smallest = folders.into_iter().filter_map(|folder| remaining(&folder, v1)).chain(smallest).min();
    }
    smallest
}

/// Limit minus usage of one control group. Cached pages of files that are not in use can be taken back.
fn remaining(folder: &Path, v1: bool) -> Option<u64> {
    let names = if v1 { ["memory.limit_in_bytes", "memory.usage_in_bytes"] } else { ["memory.max", "memory.current"] };
    // "max" is no number: no limit.
    let [limit, usage] = names.map(|name| number(&folder.join(name)));
    let cached = fs::read_to_string(folder.join("memory.stat")).ok().and_then(|text| {
        let key = if v1 { "total_inactive_file " } else { "inactive_file " };
        text.lines().find_map(|line| line.strip_prefix(key)?.trim().parse::<u64>().ok())
    });
    Some(limit?.saturating_sub(usage?.saturating_sub(cached.unwrap_or(0))))
}

fn number(file: &PathBuf) -> Option<u64> {
    fs::read_to_string(file).ok()?.trim().parse().ok()
}

/// Soft limit of the address space minus its present size, from `/proc/self/limits` and `/proc/self/status`.
fn address_space(limits: &str, status: &str) -> Option<u64> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let limit: u64 = line.split_whitespace().next()?.parse().ok()?;
    let size = status.lines().find_map(|line| line.strip_prefix("VmSize:"))?;
    let kib: u64 = size.split_whitespace().next()?.parse().ok()?;
    Some(limit.saturating_sub(kib * 1024))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(root: &Path, files: &[(&str, &str)]) {
        for (name, text) in files {
            let path = root.join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("created");
            fs::write(path, text).expect("written");
        }
    }

    #[test]
    fn the_memory_of_a_job_counts() {
        assert_eq!(of_job("300", 1024), Some(299 << 20));
        assert_eq!([of_job("0", 1024), of_job("many", 1024)], [None, None]);
    }

    #[test]
    fn the_smallest_limit_of_nested_groups_applies() {
        let scratch = tempfile::tempdir().expect("scratch");
        let v2 = [
            ("a/memory.max", "1000\n"),
            ("a/memory.current", "700\n"),
            ("a/memory.stat", "anon 600\ninactive_file 100\n"),
            ("a/b/memory.max", "max\n"),
            ("a/b/memory.current", "700\n"),
        ];
        written(scratch.path(), &v2);
        assert_eq!(cgroups(scratch.path(), "0::/a/b\n"), Some(400));
        assert_eq!(cgroups(scratch.path(), "0::/elsewhere\n"), None);
        written(
            scratch.path(),
            &[("memory/c/memory.limit_in_bytes", "500"), ("memory/c/memory.usage_in_bytes", "450")],
        );
        assert_eq!(cgroups(scratch.path(), "5:cpu:/c\n4:memory,x:/c\n0::/a\n"), Some(50));
    }

    #[test]
    fn the_address_space_is_limited() {
        let status = "Name: x\nVmSize:\t    100 kB\n";
        let line =
            |limit: &str| format!("Limit   Soft Limit  Hard Limit Units\nMax address space  {limit} unlimited bytes\n");
        assert_eq!(address_space(&line("1124000"), status), Some(1_124_000 - 102_400));
        assert_eq!(address_space(&line("unlimited"), status), None);
    }
}
