"""The same problem in other programs: Tamaas and ContactMechanics, for those who come from one of them.

Each function solves the contact of a periodic surface on a half-space without adhesion and returns an :class:`asperity.Estimate`, so that fields
compare as those of any method. The programs are installed by ``pip install tamaas ContactMechanics``. ``python -m asperity.peers`` prints a
comparison.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ._arguments import Map, positive
from ._errors import InputError, NotConverged, needed
from ._solve import solve
from ._state import Estimate
from ._surface import Surface, native

if TYPE_CHECKING:
    import pandas

#: A function of this module.
Peer = Callable[[Surface, float, float], Estimate]

#: Iterations after which a peer gives up.
MAX_ITERATIONS = 20_000


def tamaas(surface: Surface, modulus: float, pressure: float, *, tolerance: float = 1e-10) -> Estimate:
    """The contact by the solver of Polonsky, Keer and Rey in `Tamaas <https://tamaas.readthedocs.io>`_.

    Parameters
    ----------
    surface : Surface
        A periodic surface with even numbers of nodes: with odd ones the pressures of Tamaas 2.9 do not satisfy the convolution.
    modulus, pressure : float
        Contact modulus E* and mean pressure.
    tolerance : float
        Sum of pressure times gap over sum of pressure times rms height.

    Raises
    ------
    InputError
        For odd numbers of nodes.
    NotConverged
        If the tolerance is not reached.
    """
    package, heights = needed("tamaas"), _high_points(surface)
    if any(n % 2 for n in heights.shape):
        raise InputError(f"surface = {heights.shape[1]} x {heights.shape[0]} nodes; accepted: even numbers, which Tamaas solves correctly")
    package.set_log_level(package.LogLevel.error)
    clock = time.perf_counter()
    model = package.Model(package.model_type.basic_2d, list(surface.cell[::-1]), list(heights.shape))
    # E* = E/(1 - ν²).
    model.E, model.nu = positive("modulus", modulus), 0.0
    solver = package.PolonskyKeerRey(model, heights, tolerance)
    solver.max_iter = MAX_ITERATIONS
    error = solver.solve(positive("pressure", pressure))
    seconds = time.perf_counter() - clock
    if not error <= tolerance:
        raise NotConverged(f"Tamaas: residual {error:.1e} after {MAX_ITERATIONS} iterations, tolerance {tolerance:.1e}")
    return _estimate("Tamaas", np.array(model.traction), np.array(model.displacement) - heights, seconds)


def contact_mechanics(surface: Surface, modulus: float, pressure: float, *, tolerance: float = 1e-9) -> Estimate:
    """The contact by constrained conjugate gradients with restart in `ContactMechanics <https://contactengineering.github.io/ContactMechanics/>`_.

    Parameters
    ----------
    surface : Surface
        A periodic surface.
    modulus, pressure : float
        Contact modulus E* and mean pressure.
    tolerance : float
        Largest remaining gap in the contact over the rms height.

    Raises
    ------
    NotConverged
        If the tolerance is not reached.
    """
    package, systems = needed("ContactMechanics"), needed("ContactMechanics.Systems")
    optimisation, topography = needed("NuMPI.Optimization.CCGWithRestart"), needed("SurfaceTopography")
    # x is its first axis.
    heights, sizes = _high_points(surface).T, surface.cell
    clock = time.perf_counter()
    half_space = package.PeriodicFFTElasticHalfSpace(heights.shape, positive("modulus", modulus), sizes)
    system = systems.NonSmoothContactSystem(
        substrate=half_space, surface=topography.Topography(heights, physical_sizes=sizes, periodic=True)
    )
    # Unknowns are forces on nodes.
    area = sizes[0] * sizes[1] / heights.size
    solution = optimisation.constrained_conjugate_gradients_with_restart(
        system.dual_objective(0.0, gradient=True),
        system.dual_hessian_product,
        x0=np.full(heights.shape, positive("pressure", pressure) * area),
        mean_val=pressure * area,
        gtol=tolerance * float(heights.std()),
        maxiter=MAX_ITERATIONS,
    )
    seconds = time.perf_counter() - clock
    if not solution.success:
        raise NotConverged(f"ContactMechanics: not converged after {solution.nit} iterations, tolerance {tolerance:.1e}")
    forces = np.asarray(solution.x, dtype=np.float64).reshape(heights.shape)
    # Its displacements are those of the half-space's surface away from the forces.
    gap = -half_space.evaluate_disp(forces) - heights
    return _estimate("ContactMechanics", (forces / area).T, gap.T, seconds)


def compare(surface: Surface, modulus: float, pressure: float) -> pandas.DataFrame:
    """One problem in all three programs, each with its default tolerance here: contact, mean gap, wall time, and the largest differences of gap
    and pressure from asperity, over their means.
    """
    state = solve(surface, modulus, pressure=pressure, tolerance=1e-10, progress=False)[0]
    own = Estimate("asperity", "zero gap", state.contact_nodes, state.mean_gap, state.gap, state.stress, state.contact, state.seconds)
    rows = []
    for other in (own, tamaas(surface, modulus, pressure), contact_mechanics(surface, modulus, pressure)):
        assert other.gap is not None and other.stress is not None
        rows.append(
            {
                "program": other.method,
                "contact": other.contact_area,
                "mean gap": other.mean_gap,
                "gap off by": float(abs(other.gap - state.gap).max()) / state.mean_gap,
                "pressure off by": float(abs(other.stress - state.stress).max()) / state.pressure,
                "seconds": other.seconds,
            }
        )
    table: pandas.DataFrame = needed("pandas").DataFrame(rows).set_index("program")
    return table


def _high_points(surface: Surface) -> Map:
    """Heights of which the high points touch first, as both programs take them."""
    heights = native(surface).heights()
    return np.ascontiguousarray(heights.max() - heights)


def _estimate(program: str, pressure: Map, gap: Map, seconds: float) -> Estimate:
    """The contact is where the pressure is positive; there the gap is zero, which fixes its offset."""
    contact = pressure > 0
    gap = gap - gap[contact].mean()
    return Estimate(program, "positive pressure", float(contact.mean()), float(gap.mean()), gap, pressure, contact, seconds)


def main(arguments: list[str]) -> None:
    """Prints the comparison on a surface with the number of nodes that is given, or 256."""
    nodes = int(arguments[0]) if arguments else 256
    surface = Surface.from_spectrum(nodes, seed=1, lambda_s=8 / nodes)
    options: dict[str, Any] = {"float_format": "{:.4g}".format}
    print(f"{nodes} x {nodes} nodes, p = 0.05 E*\n\n{compare(surface, 1.0, 0.05).to_string(**options)}")


if __name__ == "__main__":
    main(sys.argv[1:])
