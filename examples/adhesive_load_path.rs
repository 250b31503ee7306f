// Loads and unloads an adhesive contact: both branches, the hysteresis and the pull-off pressure.
//
//     cargo run --release --example adhesive_load_path

use asperity::{Adhesion, Branch, LoadKind, Loads, Problem, Spectrum, Surface, SynthesisOptions};

fn main() -> asperity::Result<()> {
    // Reduced units: the cell has the extent 1, the contact modulus is 1.
    let spectrum = Spectrum { lambda_s: 1.0 / 8.0, ..Spectrum::CHALLENGE };
    let surface = Surface::from_spectrum(spectrum, SynthesisOptions { nodes: 256, length: 1.0, seed: 3 })?;
    let adhesion = Adhesion { work_of_adhesion: 4e-3, range: 5.6e-3, ..Adhesion::default() };
    let problem = Problem { adhesion: Some(adhesion), ..Problem::new(surface, 1.0) };

    let loads = Loads { pull_off: true, ..Loads::new(LoadKind::Pressure, [0.005, 0.05, 0.1, 0.05, 0.005]) };
    let path = problem.load_path(&loads)?;
    for state in &path.states {
        println!(
            "{:9} p/E* {:.3}: contact area {:.4}, mean gap {:.5} L",
            format!("{:?}", state.branch),
            state.pressure,
            state.contact_area,
            state.mean_gap.expect("a solver has a gap")
        );
    }
    println!("dissipation {:.2e} E* L", path.dissipation());
    let pull_off = path.pull_off.as_ref().expect("it was requested");
    println!("pull-off at p/E* = {:.4}, mean gap {:.4} L", pull_off.pressure, pull_off.mean_gap);

    // On unloading the contact is larger at the same load, and the cycle dissipates energy.
    let unloading: Vec<_> = path.branch(Branch::Unloading).collect();
    for (loading, unloading) in path.branch(Branch::Loading).zip(unloading.iter().rev()) {
        assert_eq!(loading.pressure, unloading.pressure);
        assert!(unloading.contact_area > loading.contact_area);
    }
    assert!(path.dissipation() > 0.0 && pull_off.pressure < 0.0);
    Ok(())
}
