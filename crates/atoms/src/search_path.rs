//! Programs in the search path.

use std::path::{Path, PathBuf};

/// Path of `lmp` or `lammps` in the search path.
pub fn find_lammps() -> Option<PathBuf> {
    ["lmp", "lammps"].into_iter().find_map(|name| search_path(Path::new(name)))
}

/// Path of an executable file in the search path. `name` has no separators.
pub fn search_path(name: &Path) -> Option<PathBuf> {
    if name.as_os_str().as_encoded_bytes().contains(&b'/') {
        return None;
    }
    use std::os::unix::fs::PermissionsExt;
    let runs = |p: &PathBuf| std::fs::metadata(p).is_ok_and(|m| m.is_file() && m.permissions().mode() & 0o111 != 0);
    std::env::split_paths(&std::env::var_os("PATH")?).map(|folder| folder.join(name)).find(runs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bare_names_only_are_looked_for() {
        assert!(search_path(Path::new("sh")).is_some_and(|p| p.is_absolute()));
        assert_eq!(search_path(Path::new("../bin/sh")), None);
        assert_eq!(search_path(Path::new("sh/")), None);
        assert_eq!(search_path(Path::new("no-such-program")), None);
    }
}
