//! The compiled part of the Python package `asperity`: conversion between numpy arrays and the crate. `python/asperity` has the
//! interface that users see.

mod arrays;
mod errors;
mod law;
mod observe;
mod pool;
mod runs;
mod solve;
mod surface;

/// Functions and classes of the crate on plain values; private to the package `asperity`.
#[pyo3::pymodule]
mod _asperity {
    #[pymodule_export]
    use crate::arrays::expect_memory;
    #[pymodule_export]
    use crate::law::TabulatedLaw;
    #[pymodule_export]
    use crate::observe::{
        clusters, compare_maps, contact_area, gap_distribution, hydraulic_gap, methods, percolation,
        stress_distribution,
    };
    #[pymodule_export]
    use crate::runs::FinishedRun;
    #[pymodule_export]
    use crate::solve::{dissipation, estimate, memory, solve, subsurface};
    #[pymodule_export]
    use crate::surface::{Surface, contact_modulus, formats};

    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
    #[pymodule_export]
    const MOST_THREADS: usize = asperity::grid::sys::threads::MOST_THREADS;
}
