// Applies every method to one surface and compares areas, mean gaps and contact maps.
//
//     cargo run --release --example all_methods

use asperity::{Problem, Spectrum, StateMaps, Surface, SynthesisOptions, compare_maps, methods};

fn main() -> asperity::Result<()> {
    let spectrum = Spectrum { lambda_s: 1.0 / 16.0, ..Spectrum::CHALLENGE };
    let surface = Surface::from_spectrum(spectrum, SynthesisOptions { nodes: 64, length: 1.0, seed: 1 })?;
    let pressure = 0.05;
    let mut problem = Problem { tolerance: Some(1e-6), ..Problem::new(surface, 1.0) };
    let reference = problem.solve(pressure)?;

    println!("{:14} {:>8} {:>9} {:>6}  counted as contact", "method", "contact", "mean gap", "kappa");
    for method in methods() {
        problem.method = asperity::method(method.id)?;
        let found = match problem.estimate(pressure) {
            Ok(found) => found,
            Err(refusal) => {
                println!("{:14} {refusal}", method.id);
                continue;
            }
        };
        let maps = found.contact().zip(reference.contact());
        let agreement = maps.map(|(map, reference)| compare_maps(map, reference)).transpose()?;
        let or_dash = |value: Option<f64>, digits: usize| value.map_or("-".into(), |v| format!("{v:.digits$}"));
        println!(
            "{:14} {:8.4} {:>9} {:>6}  {}",
            method.id,
            found.contact_area,
            or_dash(found.mean_gap, 5),
            or_dash(agreement.map(|a| a.aligned.kappa), 2),
            found.criterion
        );
        // Solvers of the same equations agree.
        if method.solves && found.criterion == "zero gap" {
            let [gap, expected] = [found.mean_gap, reference.mean_gap].map(|gap| gap.expect("a solver has a gap"));
            assert!((gap / expected - 1.0).abs() < 0.02, "{}: mean gap {gap}", method.id);
        }
    }
    Ok(())
}
