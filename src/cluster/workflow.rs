//! A sweep as the file of a workflow program: Snakemake (<https://snakemake.readthedocs.io>) or row (<https://row.readthedocs.io>).

use super::machine::Machine;
use super::script::{memory_mb, shell_quoted};
use std::fmt::Write;
use std::path::Path;

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Workflow {
    Snakemake,
    Row,
}

/// What a workflow runs.
pub struct WorkflowInput<'a> {
    pub machine: &'a Machine,
    pub program: &'a Path,
    pub labels: Vec<&'a str>,
    /// Arguments of `asperity run` after scene and folder.
    pub arguments: &'a [String],
    /// Planned memory of the largest point.
    pub bytes: u64,
    /// Working folder and command that writes the tables of the sweep.
    pub collect: (&'a Path, Vec<String>),
}

impl Workflow {
    pub fn file(self) -> &'static str {
        match self {
            Workflow::Snakemake => "Snakefile",
            Workflow::Row => "workflow.toml",
        }
    }

    /// How the workflow is started in the folder of the sweep.
    pub fn start(self, machine: &Machine) -> String {
        match self {
            Workflow::Snakemake => format!("snakemake --cores {}", machine.cpus),
            Workflow::Row => "row submit".into(),
        }
    }

    /// Text of the file. Paths are relative to the folder of the sweep.
    pub fn text(self, input: &WorkflowInput) -> String {
        match self {
            Workflow::Snakemake => snakefile(input),
            Workflow::Row => row(input),
        }
    }
}

fn words(list: &[String]) -> String {
    list.iter().fold(String::new(), |text, word| text + " " + &shell_quoted(word))
}

/// `asperity run` of the scene and folder of a point. Exit code 1, a statement of the challenge that failed, is a result.
fn run(input: &WorkflowInput, name: &str) -> String {
    let program = shell_quoted(&input.program.display().to_string());
    let setup: String = input.machine.setup.iter().fold(String::new(), |text, line| text + line + "; ");
    let arguments = words(input.arguments);
    format!(
        "{setup}{program} run scenes/{name}.toml --out points/{name}{arguments} > logs/{name}.log 2>&1 || [ $? -eq 1 ]"
    )
}

fn snakefile(input: &WorkflowInput) -> String {
    let labels = serde_json::to_string(&input.labels).expect("text");
    // Braces name wildcards.
    let mark = "\u{0}";
    let literal = |text: String| serde_json::to_string(&text.replace('{', "{{").replace('}', "}}")).expect("text");
    let shell = literal(run(input, mark)).replace("\\u0000", "{wildcards.label}");
    let (folder, command) = &input.collect;
    let program = shell_quoted(&input.program.display().to_string());
    let collect = format!("cd {} && {program}{}", shell_quoted(&folder.display().to_string()), words(command));
    let mut text =
        String::from("# Runs the points of a sweep; the last rule writes its tables. Written by asperity.\n");
    let mut line = |l: String| writeln!(text, "{l}").expect("a string takes any text");
    line(format!("LABELS = {labels}\n"));
    line("wildcard_constraints:\n    label=\"[^/]+\"\n".into());
    line("localrules: all, collect\n".into());
    line("rule all:\n    input: \"ensemble.json\"\n".into());
    line("rule point:\n    input: \"scenes/{label}.toml\"\n    output: \"points/{label}/results.json\"".into());
    line(format!("    threads: {}", input.machine.cpus));
    let minutes = input.machine.seconds().div_ceil(60);
    line(format!("    resources: mem_mb={}, runtime={minutes}", memory_mb(input.machine, input.bytes)));
    line(format!("    shell: {shell}\n"));
    line("rule collect:\n    input: expand(\"points/{label}/results.json\", label=LABELS)".into());
    line(format!("    output: \"ensemble.json\"\n    shell: {}", literal(collect)));
    text
}

fn row(input: &WorkflowInput) -> String {
    let command = toml::Value::String(run(input, "{directory}"));
    let (hours, minutes) = (input.machine.seconds() / 3600, input.machine.seconds() / 60 % 60);
    let (folder, collect) = &input.collect;
    format!(
        "# Runs the points of a sweep. Its tables are written by, in {}:\n# asperity{}\n[workspace]\npath = \"points\"\n\n\
         [[action]]\nname = \"run\"\ncommand = {command}\nproducts = [\"results.json\"]\n\n\
         [action.group]\nmaximum_size = 1\n\n[action.resources]\nprocesses.per_directory = 1\n\
         threads_per_process = {}\nwalltime.per_directory = \"{hours:02}:{minutes:02}:00\"\n",
        folder.display(),
        words(collect),
        input.machine.cpus,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input(machine: &Machine) -> WorkflowInput<'_> {
        WorkflowInput {
            machine,
            program: Path::new("/opt/asperity"),
            labels: vec!["seed-1", "seed-2"],
            arguments: &[],
            bytes: 800_000_000,
            collect: (Path::new("/home/me"), vec!["sweep".into(), "a.toml".into()]),
        }
    }

    #[test]
    fn a_snakefile_has_a_rule_for_points_and_one_for_tables() {
        let machine = Machine { cpus: 4, time: "02:00:00".into(), ..Machine::default() };
        let arguments = ["--launcher=srun -n {ranks}".to_string()];
        let text = Workflow::Snakemake.text(&WorkflowInput { arguments: &arguments, ..input(&machine) });
        for part in [
            "LABELS = [\"seed-1\",\"seed-2\"]\n",
            "    threads: 4\n    resources: mem_mb=1200, runtime=120\n",
            "run scenes/{wildcards.label}.toml --out points/{wildcards.label} '--launcher=srun -n {{ranks}}' > logs/",
            "cd '/home/me' && '/opt/asperity' 'sweep' 'a.toml'",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }

    #[test]
    fn a_workflow_of_row_has_an_action_for_each_folder_of_a_point() {
        let machine = Machine { cpus: 4, time: "1-00:30".into(), ..Machine::default() };
        let text = Workflow::Row.text(&input(&machine));
        let table: toml::Table = text.parse().expect("TOML");
        let action = &table["action"][0];
        let command = action["command"].as_str().expect("text");
        assert!(command.contains("run scenes/{directory}.toml --out points/{directory} >"), "{command}");
        assert_eq!(action["resources"]["walltime"]["per_directory"].as_str(), Some("24:30:00"));
        assert_eq!(table["workspace"]["path"].as_str(), Some("points"));
    }
}
