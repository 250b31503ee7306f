//! Elastic constants of a body on the command line.

use super::file::refused;
use crate::Result;
use crate::scene::{BodyScene, Stress};
use asperity_grid::units::{Dimension, Measure};

/// Elastic constants of a body, as a person writes them: E,NU or E,NU,HARDNESS.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BodyFlag {
    pub young: Measure,
    pub poisson: f64,
    pub hardness: Option<Measure>,
}

impl std::str::FromStr for BodyFlag {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        const ACCEPTED: &str = "E,NU or E,NU,HARDNESS, such as 70GPa,0.33";
        let parts: Vec<Measure> =
            text.split(',').map(|part| part.trim().parse()).collect::<std::result::Result<_, String>>()?;
        let (young, poisson, hardness) = match parts[..] {
            [young, poisson] => (young, poisson, None),
            [young, poisson, hardness] => (young, poisson, Some(hardness)),
            _ => return Err(ACCEPTED.into()),
        };
        match poisson.unit {
            None => Ok(BodyFlag { young, poisson: poisson.value, hardness }),
            Some(_) => Err(ACCEPTED.into()),
        }
    }
}

impl BodyFlag {
    /// Its stresses.
    pub(super) fn stresses(&self) -> impl Iterator<Item = Measure> {
        [Some(self.young), self.hardness].into_iter().flatten()
    }

    /// The table of a scene, in the unit of the stresses.
    ///
    /// # Errors
    /// What is no stress.
    pub(super) fn scene(&self, stress_pa: Option<f64>) -> Result<BodyScene> {
        let plain = |m: Measure| {
            let m = m.of(Dimension::Stress).map_err(|accepted| refused("--body", m, accepted))?;
            Ok(Stress::plain(m.unit.zip(stress_pa).map_or(m.value, |(unit, pa)| m.value * (unit.si / pa))))
        };
        let hardness = self.hardness.map(plain).transpose()?;
        Ok(BodyScene { young: plain(self.young)?, poisson: self.poisson, hardness })
    }
}
