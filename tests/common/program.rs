//! The compiled program, started as a user starts it.

use std::process::{Command, Output};

pub(crate) fn asperity() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_asperity"));
    // Tests leave nothing in the user's cache.
    command.env("XDG_CACHE_HOME", concat!(env!("CARGO_TARGET_TMPDIR"), "/cache"));
    command
}

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The single line of JSON on standard output, for any exit status.
pub(crate) fn json_line(output: &Output) -> serde_json::Value {
    let text = std::str::from_utf8(&output.stdout).expect("UTF-8 on stdout");
    assert_eq!(text.matches('\n').count(), 1, "not one line on stdout: {text:?}; stderr: {}", stderr(output));
    serde_json::from_str(text).expect("JSON on stdout")
}
