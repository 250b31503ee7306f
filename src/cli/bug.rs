//! A panic is a bug of this program. It is reported in one line, with what a report needs.

use super::output;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit code of a bug (`EX_SOFTWARE` of sysexits.h).
pub const EXIT_CODE: u8 = 70;

/// Whether a thread panicked.
static FOUND: AtomicBool = AtomicBool::new(false);

/// The line that reports a bug.
fn line(message: &str, context: &str, command: &str) -> String {
    let version = env!("CARGO_PKG_VERSION");
    let message = message.replace('\n', " ");
    format!(
        "asperity: bug: {message} ({context}, version {version}, command: {command}); report it with this line and the scene"
    )
}

/// Prints the first panic of any thread. Later ones are consequences.
fn hook(info: &PanicHookInfo) {
    if FOUND.swap(true, Ordering::SeqCst) {
        return;
    }
    let payload = info.payload();
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    let message = text.unwrap_or("a panic without a message");
    let location = info.location().map_or("unknown place".to_string(), |l| format!("{}:{}", l.file(), l.line()));
    let command: Vec<String> = std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect();
    output::complain(&line(message, &location, &command.join(" ")));
}

/// Installs the report of panics, and runs the program. The result is its exit code, or [`EXIT_CODE`] after a panic of any
/// thread. Unwinding removes unfinished files and ends child processes.
pub fn guarded(program: impl FnOnce() -> ExitCode) -> ExitCode {
    std::panic::set_hook(Box::new(hook));
    code(program)
}

fn code(program: impl FnOnce() -> ExitCode) -> ExitCode {
    // Nothing of the program is used after a panic.
    let ended = catch_unwind(AssertUnwindSafe(program));
    match ended {
        Ok(code) if !FOUND.load(Ordering::SeqCst) => code,
        _ => ExitCode::from(EXIT_CODE),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_has_what_a_report_needs() {
        let text = line("index out of\nbounds", "src/a.rs:3", "asperity run a.toml");
        assert_eq!(text.lines().count(), 1);
        for part in
            ["bug: index out of bounds", "src/a.rs:3", env!("CARGO_PKG_VERSION"), "asperity run a.toml", "report it"]
        {
            assert!(text.contains(part), "{text}");
        }
    }

    /// Panics of the program's thread, and of threads that it waits for.
    #[test]
    fn a_panic_of_any_thread_ends_with_the_exit_code_of_a_bug() {
        use rayon::prelude::*;
        let bug = ExitCode::from(EXIT_CODE);
        assert_eq!(code(|| ExitCode::from(3)), ExitCode::from(3));
        assert_eq!(code(|| panic!("of a test, on purpose")), bug);
        let parallel =
            || (0..64).into_par_iter().map(|i: u8| if i == 40 { panic!("of a test, on purpose") } else { i }).max();
        assert_eq!(code(|| ExitCode::from(parallel().unwrap_or(0))), bug);
    }
}
