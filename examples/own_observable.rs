// Evaluates an observable that the crate does not have: how pressure and area depend on the size of a contact cluster.
//
//     cargo run --release --example own_observable

use asperity::{Problem, Spectrum, State, StateMaps, Surface, SynthesisOptions};

/// A cluster in numbers.
struct Cluster {
    nodes: usize,
    mean_pressure: f64,
    largest_pressure: f64,
}

/// All clusters of a state, the largest first: maps are arrays, so an observable is a loop over them.
fn clusters_by_size(state: &State) -> Vec<Cluster> {
    let (found, stress) = state.clusters().zip(state.stress()).expect("a solver has maps");
    let mut list: Vec<Cluster> =
        found.sizes.iter().map(|&nodes| Cluster { nodes, mean_pressure: 0.0, largest_pressure: 0.0 }).collect();
    for (label, pressure) in found.labels.iter().zip(stress).filter(|(label, _)| **label > 0) {
        let cluster = &mut list[label - 1];
        cluster.mean_pressure += pressure / cluster.nodes as f64;
        cluster.largest_pressure = cluster.largest_pressure.max(*pressure);
    }
    list.sort_by_key(|c| std::cmp::Reverse(c.nodes));
    list
}

fn main() -> asperity::Result<()> {
    let spectrum = Spectrum { lambda_s: 1.0 / 32.0, ..Spectrum::CHALLENGE };
    let surface = Surface::from_spectrum(spectrum, SynthesisOptions { nodes: 256, length: 1.0, seed: 2 })?;
    let state = Problem::new(surface, 1.0).solve(0.02)?;
    let clusters = clusters_by_size(&state);
    println!("{} clusters; the largest:", clusters.len());
    println!("{:>6} {:>14} {:>17}", "nodes", "mean p/E*", "largest p/E*");
    for c in clusters.iter().take(8) {
        println!("{:6} {:14.4} {:17.4}", c.nodes, c.mean_pressure, c.largest_pressure);
    }

    // Together the clusters carry the load.
    let nodes = state.gap().expect("a solver has maps").len() as f64;
    let carried: f64 = clusters.iter().map(|c| c.mean_pressure * c.nodes as f64).sum::<f64>() / nodes;
    assert!((carried / 0.02 - 1.0).abs() < 1e-4, "{carried}");
    Ok(())
}
