//! Flags of commands in tests.

/// Flags of `solve` for a map, completed to a dimensionless problem with low points touching first where they leave that open. Tests of
/// these flags themselves start the program directly.
pub(crate) fn dimensionless<'a>(flags: &[&'a str]) -> Vec<&'a str> {
    let mut all = flags.to_vec();
    if flags.first() == Some(&"solve") && !flags.contains(&"--challenge") {
        for (flag, value) in [("--length", "1"), ("--modulus", "1"), ("--touching", "low-points")] {
            all.extend([flag, value].into_iter().filter(|_| !flags.contains(&flag)));
        }
    }
    all
}
