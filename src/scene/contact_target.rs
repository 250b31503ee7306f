//! Loads that are given as contact areas: the pressures that produce them.

use super::Case;
use super::load::estimated_p_star;
use crate::{Error, Result};
use asperity_contact::load::{Load, LoadStep};
use asperity_contact::method::{Observer, StartedMethod, Stop};

/// Relative deviation of the contact area that is accepted, or one node if that is more: contact changes by whole nodes.
const CONTACT_TOLERANCE: f64 = 1e-3;

/// Relative distance of two pressures between which the contact jumps past a target.
const JUMP: f64 = 1e-7;

/// Solves per fraction. Regula falsi with the Illinois rule takes 4 to 10.
const MOST_SOLVES: usize = 60;

impl Case {
    /// Finds the pressures of the contact fractions that the scene imposes and puts them in their place. Scenes without such loads stay as
    /// they are. `observer` may stop the search.
    ///
    /// # Errors
    /// `Interrupted` where it does; a solve that does not converge; a fraction that no pressure gives; too little memory.
    pub fn find_contact_pressures(&mut self, observer: &dyn Observer) -> Result<()> {
        let targets = std::mem::take(&mut self.scene.load.contact);
        if targets.is_empty() {
            return Ok(());
        }
        let pressures = self.pressures_of(&targets, observer)?;
        let modulus = self.laboratory.modulus();
        self.scene.load.pressure = pressures.iter().map(|p| modulus.with(p * modulus.value())).collect();
        let path = self.scene.load.with_unloading(&pressures);
        let p_star: Vec<f64> = match self.load_steps.first().and_then(|s| s.p_star) {
            Some(_) => path.iter().map(|p| p / self.gradient).collect(),
            None => Vec::new(),
        };
        let loads: Vec<Load> = path.into_iter().map(Load::Pressure).collect();
        self.load_steps = LoadStep::path(&loads, &p_star, self.scene.load.loading_count());
        Ok(())
    }

    fn pressures_of(&self, targets: &[f64], observer: &dyn Observer) -> Result<Vec<f64>> {
        let method = asperity_methods::find(&self.scene.continuum.method).expect("checked with the scene");
        let heights = self.surface.heights(self.grid, 0.0);
        let problem = self.problem((&heights).into());
        let (required, available) = (method.plan(&problem).bytes, asperity_grid::sys::available_memory_bytes());
        if required > available {
            let description = format!("a solve on {} x {} points", self.grid.nx, self.grid.ny);
            return Err(Error::Memory {
                what: description,
                need: required,
                have: available,
                advice: "surface.resample to fewer points".into(),
            });
        }
        let StartedMethod::Solver(mut run) = method.start(&problem, observer)? else {
            let found = format!("{targets:?} with an estimate");
            let place = self.file.display().to_string();
            return Err(Error::input(
                place,
                "load.contact",
                found,
                "a solver of the fields, continuum.method = \"auto\"",
            ));
        };
        let node = 1.0 / self.grid.points() as f64;
        let mut contact = |pressure: f64| -> Result<f64> {
            let state = run.equilibrate(Load::Pressure(pressure))?;
            if state.stop == Stop::Interrupted {
                return Err(Error::Interrupted);
            }
            if state.stop != Stop::Converged {
                return Err(state.not_converged(method.card().id, state.stop, problem.tolerance, None));
            }
            Ok(problem.contact_area(&state, 0.0).contact_area)
        };
        targets
            .iter()
            .enumerate()
            .map(|(i, &target)| {
                let guess = self.gradient * estimated_p_star(target);
                root(target, guess, (CONTACT_TOLERANCE * target).max(node), &mut contact)?.ok_or_else(|| {
                    let accepted =
                        "a fraction that some pressure gives: the contact fraction of this surface jumps past it";
                    Error::input(self.file.display(), format!("load.contact[{i}]"), target, accepted)
                })
            })
            .collect()
    }
}

/// The pressure at which `contact`, which rises with it, is `target` within `tolerance`. `None`: it jumps over the target.
fn root(target: f64, guess: f64, tolerance: f64, contact: &mut impl FnMut(f64) -> Result<f64>) -> Result<Option<f64>> {
    // In the logarithm of the pressure, which is positive.
    let (mut low, mut high): (Option<[f64; 2]>, Option<[f64; 2]>) = (None, None);
    let (mut x, mut side) = (guess.ln(), 0);
    for _ in 0..MOST_SOLVES {
        let deviation = contact(x.exp())? - target;
        if deviation.abs() <= tolerance {
            return Ok(Some(x.exp()));
        }
        let here = if deviation < 0.0 { -1 } else { 1 };
        // Illinois: an end that stays twice counts half.
        if here == side {
            let other = if deviation < 0.0 { &mut high } else { &mut low };
            other.iter_mut().for_each(|end| end[1] /= 2.0);
        }
        side = here;
        *(if deviation < 0.0 { &mut low } else { &mut high }) = Some([x, deviation]);
        x = match (low, high) {
            (Some([a, fa]), Some([b, fb])) if (b - a).abs() > JUMP => (a * fb - b * fa) / (fb - fa),
            (Some(_), Some(_)) => return Ok(None),
            // Contact is about proportional to the pressure.
            (Some([a, fa]), None) => a + (target / (target + fa).max(target / 10.0)).ln().max(0.1),
            (None, Some([b, fb])) => b - ((target + fb) / target).ln().max(0.1),
            (None, None) => unreachable!("one of them was set"),
        };
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_is_found_from_a_poor_guess_and_a_jump_is_reported() {
        for guess in [1e-6, 0.3, 1e3] {
            let mut solves = 0;
            let mut smooth = |p: f64| {
                solves += 1;
                Ok(p / (1.0 + p))
            };
            let actual = root(0.2, guess, 1e-6, &mut smooth).expect("no error").expect("a root");
            assert!((actual - 0.25).abs() < 1e-5 && solves < 40, "{actual} after {solves}");
        }
        let mut step = |p: f64| Ok(if p < 0.5 { 0.1 } else { 0.9 });
        assert_eq!(root(0.5, 0.4, 1e-3, &mut step).expect("no error"), None);
    }
}
