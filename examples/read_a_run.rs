// Reads the folder of a finished run: its load path, and one map.
//
//     asperity run configs/quickstart.toml --out runs/quickstart
//     cargo run --release --example read_a_run runs/quickstart

use asperity::{Connectivity, FinishedRun, clusters};
use std::path::Path;

fn main() -> asperity::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or("runs/quickstart".into());
    print(Path::new(&folder))
}

fn print(folder: &Path) -> asperity::Result<()> {
    let run = FinishedRun::read(folder)?;
    println!("{} ({}), cell {:.3e} m, E* = {:.3e} Pa", run.name, run.method, run.length_m, run.modulus_pa);
    run.warnings.iter().for_each(|warning| println!("warning: {warning}"));
    for state in &run.states {
        let mean_gap = state.mean_gap.expect("a solver has a gap");
        println!(
            "{:?} p* = {:<8} {:.3e} Pa: contact area {:.4}, mean gap {:.3e} m",
            state.branch, state.p_star, state.pressure, state.contact_area, mean_gap
        );
        let (Some(gap), Some(stress)) = (run.gap(state)?, run.stress(state)?) else { continue };
        let sizes = clusters(gap.mapv(|g| g <= 0.0).view(), Connectivity::Eight, !state.non_periodic).sizes;
        println!("    {} contact clusters, the largest of {} nodes", sizes.len(), sizes.iter().max().unwrap_or(&0));
        // The maps agree with the numbers of the state.
        let mean = |map: &ndarray::Array2<f64>| map.mean().expect("a map has nodes");
        assert!((mean(&gap) / mean_gap - 1.0).abs() < 1e-6);
        assert!((mean(&stress) / state.pressure - 1.0).abs() < 1e-6);
    }
    Ok(())
}
