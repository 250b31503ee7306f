/// A state of a load path, as its work needs it; energies per area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkPoint {
    /// Mean pressure.
    pub pressure: f64,
    /// Displacement of the far field, the work conjugate of the pressure, from any origin.
    pub displacement: f64,
    /// Free energy of the bodies: elastic and of the interaction, without that of the load.
    pub stored: f64,
    /// Plastic work since first contact.
    pub plastic_work: f64,
}

/// Energy per area that a load path dissipates, open or closed: the work of the load, ∫ p dδ, less the change of the stored energy.
///
/// Without adhesion nothing but plastic flow dissipates, and the plastic work since first contact is exact for any loads. With
/// adhesion jumps dissipate, too: the work is that of trapezoids from the first load on, an estimate that finer loads improve, added to
/// the plastic work up to that load.
pub fn dissipation(path: &[WorkPoint], adhesive: bool) -> f64 {
    let [Some(first), Some(last)] = [path.first(), path.last()] else { return 0.0 };
    if adhesive { first.plastic_work + external_work(path) - (last.stored - first.stored) } else { last.plastic_work }
}

/// Work of the load along a path per area, by trapezoids.
fn external_work(path: &[WorkPoint]) -> f64 {
    path.windows(2).map(|w| 0.5 * (w[0].pressure + w[1].pressure) * (w[1].displacement - w[0].displacement)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding.
    const TOLERANCE: f64 = 1e-15;

    fn path(points: &[(f64, f64, f64)]) -> Vec<WorkPoint> {
        // Of the distance of the surfaces.
        let point = |&(pressure, separation, stored): &(f64, f64, f64)| WorkPoint {
            pressure,
            displacement: -separation,
            stored,
            plastic_work: 0.0,
        };
        points.iter().map(point).collect()
    }

    #[test]
    fn a_closed_path_dissipates_the_area_of_its_loop() {
        // Approach at pressure 2 and separation at pressure 1, by 0.5 each.
        let closed = path(&[(1.0, 1.0, 0.3), (2.0, 1.0, 0.7), (2.0, 0.5, 0.2), (1.0, 0.5, 0.1), (1.0, 1.0, 0.3)]);
        assert!((dissipation(&closed, true) - 0.5).abs() < TOLERANCE);
        let there = [(0.1, 1.0, 0.0), (0.3, 0.4, 0.2), (1.0, 0.1, 0.5)];
        let and_back = path(&[&there[..], &[there[1], there[0]]].concat());
        assert!(dissipation(&and_back, true).abs() < TOLERANCE);
    }

    /// A path that does not end at its first state: what the load did and the bodies do not store.
    #[test]
    fn an_open_path_dissipates_what_is_not_stored() {
        let open = path(&[(1.0, 1.0, 0.25), (3.0, 0.5, 0.75)]);
        assert!((dissipation(&open, true) - 0.5).abs() < TOLERANCE);
        assert_eq!((dissipation(&open, false), dissipation(&[], true), dissipation(&open[..1], true)), (0.0, 0.0, 0.0));
    }

    #[test]
    fn plastic_work_counts_from_first_contact() {
        let mut open = path(&[(1.0, 1.0, 0.25), (3.0, 0.5, 0.75)]);
        (open[0].plastic_work, open[1].plastic_work) = (0.125, 0.625);
        assert_eq!(dissipation(&open, false), 0.625);
        assert!((dissipation(&open, true) - 0.625).abs() < TOLERANCE);
    }
}
