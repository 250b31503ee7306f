//! Time of a force evaluation on this machine.

use super::run_script::RunScript;
use asperity_grid::error::{Error, Result};
use asperity_surface::files::atomic_file::put;
use std::path::Path;

const SCRIPT: (&str, &str) = ("force_evaluation.in", include_str!("../lammps-inputs/force_evaluation.in"));

/// Measures the processor time of a force evaluation of one LAMMPS process, seconds per atom, with
/// `lammps-inputs/force_evaluation.in`: about a second in `folder`, which keeps script and log. `potential`, in that
/// folder, is a table of `element`; its crystal has the lattice constant `a0_angstrom`.
///
/// # Errors
/// `Io`; `Lammps` if the run fails or prints no loop time.
pub fn measure(
    lammps: &dyn RunScript,
    folder: &Path,
    (potential, element, a0_angstrom): (&str, &str, f64),
) -> Result<f64> {
    let script = put(folder, SCRIPT.0, SCRIPT.1)?;
    let vars =
        [("potential", potential.to_owned()), ("element", element.to_owned()), ("a0", format!("{a0_angstrom:.10}"))];
    let printed = lammps.run(folder, &script, &vars)?;
    evaluation(&printed).ok_or_else(|| Error::lammps(folder, "it printed no time of its loop"))
}

/// Evaluates the lines `Loop time of 0.65 on 1 procs for 20 steps with 48600 atoms` and
/// `98.8% CPU use with 1 MPI tasks ...`: the wall time includes the use of other programs.
fn evaluation(printed: &str) -> Option<f64> {
    let line = printed.lines().find(|l| l.starts_with("Loop time of"))?;
    let numbers: Vec<f64> = line.split_whitespace().filter_map(|w| w.parse().ok()).collect();
    let [seconds, _, steps, atoms] = numbers[..] else { return None };
    let used: f64 = printed.lines().find_map(|l| l.split_once("% CPU use")?.0.trim().parse().ok())?;
    let seconds_per_evaluation = 1e-2 * used * seconds / (steps * atoms);
    (seconds_per_evaluation.is_finite() && seconds_per_evaluation > 0.0).then_some(seconds_per_evaluation)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Prints(&'static str);

    impl RunScript for Prints {
        fn run(&self, folder: &Path, script: &Path, vars: &[(&str, String)]) -> Result<String> {
            assert!(script.starts_with(folder) && script.is_file());
            assert_eq!(vars.iter().map(|v| v.1.as_str()).collect::<Vec<_>>(), ["x.alloy", "Ca", "5.5884000000"]);
            Ok(self.0.to_string())
        }
    }

    #[test]
    fn the_loop_time_is_divided_by_steps_and_atoms() {
        let folder = tempfile::tempdir().unwrap();
        let measured = |text| measure(&Prints(text), folder.path(), ("x.alloy", "Ca", 5.5884));
        let text =
            "noise\nLoop time of 0.5 on 1 procs for 20 steps with 50000 atoms\n\n80.0% CPU use with 1 MPI tasks x 1\n";
        assert!((measured(text).unwrap() / 4e-7 - 1.0).abs() < 1e-12);
        for less in [
            "",
            "Loop time of 0.5 on 1 procs for 20 steps with 50000 atoms\n",
            "Loop time of 0.5\n80.0% CPU use with 1\n",
        ] {
            assert!(measured(less).unwrap_err().to_string().contains("no time of its loop"), "{less}");
        }
    }
}
