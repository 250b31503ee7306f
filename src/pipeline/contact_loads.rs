//! Loads that a scene gives as contact areas.

use crate::scene::{Case, GivenUnits};
use crate::{Error, Result};
use asperity_contact::method::Observer;
use asperity_contact::path::pressures_of_contact;

/// Finds the pressures of the contact areas that a scene imposes, and puts them in their place. Other scenes stay as they are.
///
/// # Errors
/// Those of [`pressures_of_contact`], in these units.
pub fn impose_contact(case: &mut Case, units: GivenUnits, observer: &dyn Observer) -> Result<()> {
    let areas = &case.scene.load.contact;
    if areas.is_empty() {
        return Ok(());
    }
    let method = asperity_methods::find(&case.scene.continuum.method).expect("checked with the scene");
    let heights = case.surface().heights(case.model.grid, 0.0);
    let problem = case.problem((&heights).into());
    let pressures = pressures_of_contact(areas, &problem, method, case.gradient, observer);
    let pressures = pressures.map_err(|error| match error {
        Error::Input { list, .. } => Error::Input { place: case.file.display().to_string(), list },
        other => other,
    });
    let pressures = pressures.map_err(|error| units.rewrite(error))?;
    case.impose_pressures(&pressures);
    Ok(())
}
