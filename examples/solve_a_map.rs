// Solves contact for a measured height map and checks the solution.
//
//     cargo run --release --example solve_a_map

use asperity::{FileOptions, Problem, StateMaps, Touching, read_surface};

fn main() -> asperity::Result<()> {
    // Heights in nm on a cell of 20 µm x 20 µm: all lengths below are in nm, all pressures in MPa.
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/configs/own-surface.txt");
    let options = FileOptions { length: Some(20e3), touching: Some(Touching::HighPoints), ..FileOptions::default() };
    let surface = read_surface(file, &options)?;
    println!("rms height {:.1} nm, rms gradient {:.3}", surface.rms_height(), surface.rms_gradient());
    surface.warnings().iter().for_each(|warning| println!("warning: {warning}"));

    let pressure = 0.5;
    let state = Problem::new(surface, 25.0).solve(pressure)?;
    let (gap, stress) = state.gap().zip(state.stress()).expect("a solver has maps");
    println!("contact area {:.4}, mean gap {:.1} nm", state.contact_area, gap.mean().expect("a map has nodes"));
    if let Some(error) = state.contact_area_error {
        println!("the error of the contact area is {error:.4}");
    }
    println!("largest pressure {:.2} MPa", stress.iter().copied().fold(0.0, f64::max));
    println!("{} contact clusters", state.clusters().expect("a solver has maps").sizes.len());

    // The pressure balances the load, and acts only where the gap is closed.
    let mean = stress.mean().expect("a map has nodes");
    assert!((mean / pressure - 1.0).abs() < 1e-6, "mean pressure {mean} MPa");
    assert!(gap.iter().all(|gap| *gap >= 0.0));
    let open = stress.iter().zip(&gap).filter(|(_, gap)| **gap > 0.0);
    assert!(open.into_iter().all(|(p, _)| *p == 0.0));
    Ok(())
}
