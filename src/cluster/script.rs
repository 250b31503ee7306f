//! Batch scripts of Slurm.

use super::machine::Machine;
use std::fmt::Write;
use std::path::Path;

/// Memory of a task beyond a quarter more than planned: the program itself, and pages of files, MB.
const MEMORY_RESERVE_MB: u64 = 200;

/// Time limit and memory of the job that collects the results: it reads one file of each point.
const COLLECT_MINUTES: u64 = 60;
const COLLECT_MB: u64 = 2000;

/// The scripts of a submission.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scripts {
    pub points: String,
    pub collect: String,
}

impl Scripts {
    /// `name`: of the sweep. `program`: path of asperity. `bytes`: planned memory of the largest task.
    pub fn new(machine: &Machine, name: &str, program: &Path, tasks: usize, bytes: u64) -> Scripts {
        let program = shell_quoted(&program.display().to_string());
        // A line of the set-up that fails ends the task with its message, instead of a run without what it sets up.
        let strict = if machine.setup.is_empty() { "" } else { "set -e\n" };
        let setup: String = machine.setup.iter().fold(strict.to_string(), |text, line| text + line + "\n");
        let job = job_name(name);
        let at_once = machine.at_once.map_or(String::new(), |n| format!("%{n}"));
        let memory = memory_mb(machine, bytes);
        let ranks = machine.lammps.ranks.unwrap_or(1);
        let mut options = vec![
            format!("--job-name={job}"),
            format!("--array=0-{}{at_once}", tasks.saturating_sub(1)),
            format!("--ntasks={ranks}"),
            format!("--cpus-per-task={}", (machine.cpus / ranks).max(1)),
            format!("--time={}", machine.time),
            format!("--mem={memory}M"),
            format!("--signal=B:USR1@{}", machine.margin_seconds),
            "--requeue".into(),
            "--open-mode=append".into(),
            "--output=slurm/task-%a.log".into(),
        ];
        if machine.lammps.launcher.is_none() {
            // mpirun and threads are of one machine.
            options.push("--nodes=1".into());
        }
        let points = script(options.iter().chain(&machine.sbatch), &setup, &|text| {
            // The program replaces the shell, which would keep signals and exit code from Slurm.
            writeln!(text, "exec {program} slurm-task . \"$SLURM_ARRAY_TASK_ID\"")
        });
        let options = [
            format!("--job-name={}", collect_name(name)),
            format!("--time={COLLECT_MINUTES}"),
            format!("--mem={COLLECT_MB}M"),
            "--ntasks=1".into(),
            "--output=slurm/collect.log".into(),
        ];
        let collect =
            script(options.iter().chain(&machine.sbatch), &setup, &|text| writeln!(text, "exec {program} collect ."));
        Scripts { points, collect }
    }
}

/// Memory of a task for planned bytes, MB.
pub(super) fn memory_mb(machine: &Machine, bytes: u64) -> u64 {
    machine.memory_mb.unwrap_or(bytes / 800_000 + MEMORY_RESERVE_MB)
}

fn script<'a>(
    options: impl Iterator<Item = &'a String>,
    setup: &str,
    command: &dyn Fn(&mut String) -> std::fmt::Result,
) -> String {
    // A login shell: it has the command module.
    let mut text = options.fold("#!/bin/bash -l\n".to_string(), |text, option| text + "#SBATCH " + option + "\n");
    text += setup;
    command(&mut text).expect("a string takes any text");
    text
}

/// A name that Slurm and shells take as it is.
pub fn job_name(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    format!("asperity-{}", name.chars().map(plain).collect::<String>())
}

/// That of the job which collects the results.
pub fn collect_name(name: &str) -> String {
    format!("{}-collect", job_name(name))
}

/// One word of a shell.
pub fn shell_quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cluster::Engine;
    use asperity_atoms::lammps_command::LammpsCommand;

    #[test]
    fn scripts_hold_the_options_of_the_machine() {
        let machine = Machine {
            engine: Engine::Slurm,
            setup: vec!["module load lammps".into()],
            sbatch: vec!["--partition=short".into()],
            time: "04:00:00".into(),
            cpus: 8,
            at_once: Some(50),
            lammps: LammpsCommand {
                ranks: Some(4),
                launcher: Some("srun -n {ranks}".into()),
                ..LammpsCommand::default()
            },
            ..Machine::default()
        };
        let scripts = Scripts::new(&machine, "25 nm; literal", Path::new("/opt/it's/asperity"), 12, 800_000_000);
        let expected = "#!/bin/bash -l\n\
            #SBATCH --job-name=asperity-25-nm--literal\n#SBATCH --array=0-11%50\n#SBATCH --ntasks=4\n\
            #SBATCH --cpus-per-task=2\n#SBATCH --time=04:00:00\n#SBATCH --mem=1200M\n#SBATCH --signal=B:USR1@120\n\
            #SBATCH --requeue\n#SBATCH --open-mode=append\n#SBATCH --output=slurm/task-%a.log\n\
            #SBATCH --partition=short\nset -e\nmodule load lammps\n\
            exec '/opt/it'\\''s/asperity' slurm-task . \"$SLURM_ARRAY_TASK_ID\"\n";
        assert_eq!(scripts.points, expected);
        assert!(scripts.collect.ends_with("set -e\nmodule load lammps\nexec '/opt/it'\\''s/asperity' collect .\n"));
        assert!(!scripts.points.contains("--nodes=1"), "a launcher may use several machines");
    }
}
