//! Children that lead a process group of their own. The group ends with its leader, with its owner, and with this process.

use std::io::{Error, ErrorKind, Read, Result, Write};
use std::os::fd::{AsRawFd, RawFd};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// Time between SIGTERM and SIGKILL. Open MPI's `mpirun` takes one second to end its ranks, which have groups of their own.
const GRACE: Duration = Duration::from_secs(3);
const POLL: Duration = Duration::from_millis(2);

/// Ends the group whose number is the first line on its input, unless a second line comes before the end of its input: a killed owner
/// ends no group itself. It alone sends SIGTERM: Open MPI's `mpirun` exits at a second one without ending its ranks.
const GUARD: &str = r#"trap '' HUP INT TERM
read -r group && ! read -r ended || exit 0
kill -s TERM -- "-$group"
n=0
while [ $n -lt 30 ] && kill -s 0 -- "-$group"; do sleep 0.1; n=$((n + 1)); done
kill -s KILL -- "-$group""#;

/// How a group ends before its leader has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// By SIGKILL.
    AtOnce,
    /// By SIGTERM, and SIGKILL after three seconds: launchers end processes outside of their group first.
    Gently,
}

/// A running child and all that it started in its group.
#[derive(Debug)]
pub struct ProcessGroup {
    leader: Child,
    guard: Child,
    end: End,
    ended: bool,
}

impl ProcessGroup {
    /// Starts a command.
    ///
    /// # Errors
    /// Those of starting it, and `sh`.
    pub fn start(command: &mut Command, end: End) -> Result<ProcessGroup> {
        let mut guard = Command::new("/bin/sh");
        guard.args(["-c", GUARD]).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
        let named = |e: Error| Error::other(format!("/bin/sh: {e}"));
        let mut guard = guard.process_group(0).spawn().map_err(named)?;
        command.process_group(0);
        if end == End::AtOnce {
            die_with_parent(command);
        }
        match command.spawn() {
            Ok(leader) => {
                let mut group = ProcessGroup { leader, guard, end, ended: false };
                let number = group.id();
                group.tell_guard(&format!("{number}\n"))?;
                Ok(group)
            }
            Err(e) => {
                drop(guard.stdin.take());
                guard.wait()?;
                Err(e)
            }
        }
    }

    /// Number of the leader and of the group.
    pub fn id(&self) -> u32 {
        self.leader.id()
    }

    /// How the leader ended, if it has. What it left in its group is killed.
    ///
    /// # Errors
    /// Those of the system.
    pub fn try_wait(&mut self) -> Result<Option<ExitStatus>> {
        if !self.ended {
            if !has_ended(self.id())? {
                return Ok(None);
            }
            // Before the leader is waited for: its number is nobody else's until then.
            kill_process_group(self.id());
            // A guard that was killed needs no word.
            let _ = self.tell_guard("ended\n");
            self.ended = true;
        }
        self.leader.wait().map(Some)
    }

    fn tell_guard(&mut self, line: &str) -> Result<()> {
        self.guard.stdin.as_mut().map_or(Ok(()), |pipe| pipe.write_all(line.as_bytes()))
    }

    fn end_group(&mut self) {
        if self.end == End::Gently {
            send_signal(self.id(), |leader| -leader, libc::SIGTERM);
            let begun = Instant::now();
            while begun.elapsed() < GRACE && has_ended(self.id()).is_ok_and(|ended| !ended) {
                std::thread::sleep(POLL);
            }
        }
        kill_process_group(self.id());
        // A failed wait needs no action: the group has been killed.
        let _ = self.leader.wait();
    }
}

impl Drop for ProcessGroup {
    fn drop(&mut self) {
        if !self.ended {
            self.end_group();
            let _ = self.tell_guard("ended\n");
        }
        drop(self.guard.stdin.take());
        let _ = self.guard.wait();
    }
}

/// Whether a child has ended, without waiting for it.
fn has_ended(child: u32) -> Result<bool> {
    // SAFETY: waitid fills the plain struct it is handed, for which all-zero bytes are a value.
    let (answer, pid) = unsafe {
        let mut info: libc::siginfo_t = std::mem::zeroed();
        let flags = libc::WEXITED | libc::WNOHANG | libc::WNOWAIT;
        let answer = libc::waitid(libc::P_PID, child as libc::id_t, &mut info, flags);
        (answer, info.si_pid())
    };
    if answer == 0 { Ok(pid != 0) } else { Err(Error::last_os_error()) }
}

/// Kills a process group by its leader. A group that has already ended is no error.
fn kill_process_group(leader: u32) {
    send_signal(leader, |leader| -leader, libc::SIGKILL);
}

/// Sends SIGTERM to a process.
pub fn terminate(process: u32) {
    send_signal(process, |process| process, libc::SIGTERM);
}

fn send_signal(process: u32, target: fn(libc::pid_t) -> libc::pid_t, signal: libc::c_int) {
    // 0 and 1 would address this process's own group and every process there is.
    if let Some(process) = libc::pid_t::try_from(process).ok().filter(|p| *p > 1) {
        // SAFETY: kill takes two integers and touches no memory of this process.
        unsafe { libc::kill(target(process), signal) };
    }
}

/// Makes the kernel kill the child when the thread that starts it ends: a killed program leaves no child that goes on writing
/// into its folder. Linux only; no effect elsewhere.
pub fn die_with_parent(command: &mut Command) {
    #[cfg(target_os = "linux")]
    {
        let parent = std::process::id();
        // SAFETY: between fork and exec only prctl and getppid are called, which are async-signal-safe and take at most
        // integers; no error made here allocates.
        unsafe {
            command.pre_exec(move || {
                if libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL) != 0 {
                    return Err(Error::last_os_error());
                }
                // A parent that ended before prctl sends no signal any more.
                if std::os::unix::process::parent_id() == parent { Ok(()) } else { Err(ErrorKind::NotFound.into()) }
            });
        }
    }
    #[cfg(not(target_os = "linux"))]
    let _ = command;
}

/// Makes the child inherit a file, and with it a lock on it, which then lasts until both have closed it.
pub fn inherit(command: &mut Command, file: &impl AsRawFd) {
    let file: RawFd = file.as_raw_fd();
    // SAFETY: between fork and exec only fcntl is called, which is async-signal-safe and takes integers; no error made here allocates.
    unsafe {
        command.pre_exec(move || match libc::fcntl(file, libc::F_SETFD, 0) {
            -1 => Err(Error::last_os_error()),
            _ => Ok(()),
        });
    }
}

/// What a short run of a program printed, and how it ended.
#[derive(Debug)]
pub struct Printed {
    pub status: ExitStatus,
    pub stdout: Vec<u8>,
    pub stderr: Vec<u8>,
}

impl Printed {
    /// Why the program failed: the first line with a word that it printed, on stderr if possible.
    pub fn complaint(&self) -> Option<String> {
        let (errors, text) = (String::from_utf8_lossy(&self.stderr), String::from_utf8_lossy(&self.stdout));
        let line = errors.lines().chain(text.lines()).find(|l| l.contains(char::is_alphanumeric));
        line.map(|line| line.trim().chars().take(LONGEST_LINE).collect())
    }
}

/// Characters of a line of a program in a message.
pub const LONGEST_LINE: usize = 200;

/// Reads at most so many bytes in a thread, and sends them.
fn reader(pipe: impl Read + Send + 'static, most_bytes: u64) -> Receiver<Result<Vec<u8>>> {
    let (send, receive) = std::sync::mpsc::channel();
    // Ends when all members of the group have closed the pipe, at the latest when they are killed.
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        let read = pipe.take(most_bytes).read_to_end(&mut bytes).map(|_| bytes);
        // Nobody listens any more after the time limit.
        let _ = send.send(read);
    });
    receive
}

/// Runs a program to its end and returns what it printed. It has no stdin, and leads its own process group, which is killed at either limit;
/// no limit of time is none.
///
/// # Errors
/// `TimedOut` after `limit`; `FileTooLarge` if it prints more than `most_bytes`; those of starting it.
pub fn probe(mut command: Command, limit: Option<Duration>, most_bytes: u64) -> Result<Printed> {
    let started = Instant::now();
    let left = || limit.map_or(Duration::MAX, |limit| limit.saturating_sub(started.elapsed()));
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut group = ProcessGroup::start(&mut command, End::AtOnce)?;
    let stdout = group.leader.stdout.take().map(|pipe| reader(pipe, most_bytes + 1)).expect("a pipe");
    let stderr = group.leader.stderr.take().map(|pipe| reader(pipe, most_bytes + 1)).expect("a pipe");
    let read = |pipe: Receiver<Result<Vec<u8>>>| match pipe.recv_timeout(left()) {
        Ok(Ok(bytes)) if bytes.len() as u64 > most_bytes => {
            Err(Error::new(ErrorKind::FileTooLarge, format!("it printed more than {most_bytes} bytes")))
        }
        Ok(read) => read,
        Err(_) => Err(ErrorKind::TimedOut.into()),
    };
    let (stdout, stderr) = (read(stdout)?, read(stderr)?);
    loop {
        match group.try_wait()? {
            Some(status) => return Ok(Printed { status, stdout, stderr }),
            None if left() > Duration::ZERO => std::thread::sleep(POLL),
            None => return Err(ErrorKind::TimedOut.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::BufRead;
    use std::os::unix::process::ExitStatusExt;

    fn shell(script: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        command
    }

    /// A launcher that does not `exec`: the number of what it started.
    fn launched(end: End, script: &str) -> (ProcessGroup, u32) {
        let mut command = shell(script);
        let mut group = ProcessGroup::start(command.stdout(Stdio::piped()), end).expect("started");
        let mut line = String::new();
        std::io::BufReader::new(group.leader.stdout.take().expect("a pipe")).read_line(&mut line).expect("read");
        (group, line.trim().parse().expect("a number"))
    }

    fn runs(process: u32) -> bool {
        let text = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
        text.rsplit(')').next().and_then(|t| t.split_whitespace().next()).is_some_and(|state| state != "Z")
    }

    fn ends(process: u32) -> bool {
        (0..500).any(|_| {
            std::thread::sleep(Duration::from_millis(20));
            !runs(process)
        })
    }

    #[test]
    fn a_group_ends_with_its_owner_and_with_its_leader() {
        for end in [End::AtOnce, End::Gently] {
            let (group, member) = launched(end, "sleep 60 & echo $!; wait");
            assert!(runs(member));
            drop(group);
            assert!(ends(member), "{end:?}");
            let (mut group, member) = launched(end, "sleep 60 & echo $!");
            while group.try_wait().expect("waited").is_none() {}
            assert!(ends(member), "{end:?}");
        }
        // Would be this process's own group.
        kill_process_group(0);
    }

    /// What a leader does at SIGTERM it has time for; without an end it is killed.
    #[test]
    fn launchers_have_time_to_end_what_they_started() {
        let folder = tempfile::tempdir().expect("scratch");
        let file = folder.path().join("ended");
        let (group, member) = launched(
            End::Gently,
            &format!("trap 'sleep 0.2; echo > {}; exit' TERM; echo $$; while :; do sleep 0.05; done", file.display()),
        );
        drop(group);
        assert!(file.exists() && ends(member));
        let (group, member) = launched(End::Gently, "trap '' TERM; echo $$; while :; do sleep 0.05; done");
        drop(group);
        assert!(ends(member));
    }

    /// The guard of an owner that is killed, here by the end of its input.
    #[test]
    fn the_group_of_a_killed_owner_ends() {
        let (mut group, member) = launched(End::AtOnce, "sleep 60 & echo $!; wait");
        drop(group.guard.stdin.take());
        assert!(ends(member));
    }

    /// The end of the thread that started a launcher is none, and of the signals of its guard it gets one SIGTERM: `mpirun` exits at a second
    /// one without ending its ranks.
    #[test]
    fn a_launcher_of_a_killed_owner_gets_one_sigterm() {
        let folder = tempfile::tempdir().expect("scratch");
        let file = folder.path().join("signals");
        let script =
            format!("trap 'echo term >> {}' TERM; echo $$; while :; do sleep 60 & wait $!; done", file.display());
        let started = std::thread::spawn(move || launched(End::Gently, &script));
        let (mut group, leader) = started.join().expect("joined");
        std::thread::sleep(Duration::from_millis(300));
        drop(group.guard.stdin.take());
        assert!(ends(leader));
        assert_eq!(std::fs::read_to_string(&file).ok().as_deref(), Some("term\n"));
    }

    /// A program that answers, one that hangs with a child that holds the pipe, and one that prints for ever.
    #[test]
    fn probes_have_a_limit_of_time_and_of_output() {
        let probed = |script: &str, milliseconds| probe(shell(script), Some(Duration::from_millis(milliseconds)), 1000);
        let answered = probed("echo yes; echo ---- >&2; echo why >&2; exit 3", 10_000).expect("answered");
        assert_eq!((answered.stdout.as_slice(), answered.status.code()), (b"yes\n".as_slice(), Some(3)));
        assert_eq!(answered.complaint().as_deref(), Some("why"));
        assert_eq!(probed("exit 1", 10_000).expect("ended").complaint(), None);
        let started = Instant::now();
        for (script, kind) in [
            ("sleep 60 & wait", ErrorKind::TimedOut),
            ("exec >&- 2>&-; sleep 60", ErrorKind::TimedOut),
            ("while :; do echo more; done", ErrorKind::FileTooLarge),
            ("while :; do echo more >&2; done", ErrorKind::FileTooLarge),
        ] {
            assert_eq!(probed(script, 500).err().map(|e| e.kind()), Some(kind), "{script}");
        }
        assert!(started.elapsed().as_secs() < 30, "a limit did not end its program");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_child_is_killed_when_the_thread_that_started_it_ends() {
        let started = std::thread::spawn(|| {
            let mut command = Command::new("sleep");
            command.arg("60");
            die_with_parent(&mut command);
            command.spawn().expect("a child")
        });
        let mut child = started.join().expect("joined");
        assert_eq!(child.wait().expect("waited").signal(), Some(libc::SIGKILL));
    }

    /// A lock lasts until the child that inherited it has ended.
    #[test]
    fn a_lock_lasts_as_long_as_the_child() {
        let folder = tempfile::tempdir().expect("scratch");
        let path = folder.path().join("lock");
        let [own, other] = [(); 2].map(|()| std::fs::File::create(&path).expect("created"));
        own.lock().expect("locked");
        let mut command = shell("sleep 60; :");
        inherit(&mut command, &own);
        let group = ProcessGroup::start(&mut command, End::AtOnce).expect("started");
        drop(own);
        assert!(other.try_lock().is_err(), "the child has no lock");
        drop(group);
        other.lock().expect("free");
    }
}
