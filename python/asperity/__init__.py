"""Contact mechanics of rough surfaces: continuum solvers with adhesion, LAMMPS simulations of the same profile, their comparison.

Units are those of the caller: lengths have the unit of the surface, pressures that of the contact modulus, and energies per area
their product. Maps are arrays ``[ny, nx]``, x fastest.
"""

from __future__ import annotations

from ._asperity import VERSION as __version__
from ._body import Cubic, Layer, NonPeriodic, contact_modulus
from ._errors import AsperityError, AsperityWarning, InputError, LammpsError, NotConverged, ResourceError
from ._law import Adhesion, TabulatedLaw
from ._observe import (
    Clusters,
    ContactArea,
    Distribution,
    FieldAgreement,
    MapAgreement,
    Method,
    Overlap,
    clusters,
    compare_fields,
    compare_maps,
    contact_area,
    gap_distribution,
    hydraulic_gap,
    methods,
    percolation,
    stress_distribution,
)
from ._program import command, ensemble, program, run, sweep, tradeoff
from ._progress import Progress
from ._run import Run, RunState, open_run
from ._solve import estimate, memory, solve
from ._state import Accuracy, Estimate, LoadPath, PullOff, State
from ._subsurface import StressMap, SubsurfaceStress, subsurface
from ._surface import Preparation, Surface
from ._sweep import Sweep, SweepPoint, open_sweep

__all__ = [
    "Accuracy",
    "Adhesion",
    "AsperityError",
    "AsperityWarning",
    "Clusters",
    "ContactArea",
    "Cubic",
    "Distribution",
    "Estimate",
    "FieldAgreement",
    "InputError",
    "LammpsError",
    "Layer",
    "LoadPath",
    "MapAgreement",
    "Method",
    "NonPeriodic",
    "NotConverged",
    "Overlap",
    "Preparation",
    "Progress",
    "PullOff",
    "ResourceError",
    "Run",
    "RunState",
    "State",
    "StressMap",
    "SubsurfaceStress",
    "Surface",
    "Sweep",
    "SweepPoint",
    "TabulatedLaw",
    "__version__",
    "clusters",
    "command",
    "compare_fields",
    "compare_maps",
    "contact_area",
    "contact_modulus",
    "ensemble",
    "estimate",
    "gap_distribution",
    "hydraulic_gap",
    "memory",
    "methods",
    "open_run",
    "open_sweep",
    "percolation",
    "program",
    "run",
    "solve",
    "stress_distribution",
    "subsurface",
    "sweep",
    "tradeoff",
]
