"""Folders of finished runs."""

from __future__ import annotations

import json
import os
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from . import _asperity
from ._arguments import Map, a_path
from ._errors import InputError, needed
from ._html import table
from ._plot import plot_curve, plot_map

if TYPE_CHECKING:
    import ase
    import pandas
    import xarray

Where = str | os.PathLike[str]


@dataclass(frozen=True)
class RunState:
    """One equilibrium of a finished run, in SI units.

    Attributes
    ----------
    branch : {'loading', 'unloading'}
        Branch of the load path.
    p_star : float
        Mean pressure over E* times the rms gradient.
    pressure : float
        Mean pressure, Pa.
    contact_area, contact_nodes : float
        Contact area over the area of the cell, and contact nodes over all nodes.
    mean_gap : float
        Mean gap, m.
    displacement : float
        Displacement of the far field from first contact, m.
    stiffness : float or None
        Contact stiffness, Pa/m.
    contact_area_error, mean_gap_error, stiffness_error : float or None
        Errors of these, of the same units. None where a part of the error is not known.
    flowing_fraction, displaced_fraction : float
        Fractions of nodes whose plastic displacement grows in this load, and of nodes that have one; 0 for an elastic body, as the
        next two.
    mean_plastic_displacement, plastic_work : float
        Mean of the displacement, m, and plastic work per area, J/m².
    hydraulic_gap_x, hydraulic_gap_y : float or None
        Uniform gaps with the same leakage along x and along y, m; None unless the scene requests the leakage, as the next three.
    hydraulic_gap_x_error, hydraulic_gap_y_error : float or None
        Their errors, m. None also where they are not known, as in a sealed direction.
    hydraulic_gap_effective_medium : float or None
        The same gap in Bruggeman's approximation, m.
    von_mises, shear : float or None
        Largest equivalent stress after von Mises and largest shear stress at the depths of the scene, Pa; None unless it requests them.
    """

    branch: str
    p_star: float
    pressure: float
    contact_area: float
    contact_area_error: float | None
    contact_nodes: float
    mean_gap: float
    mean_gap_error: float | None
    displacement: float
    stiffness: float | None
    stiffness_error: float | None
    flowing_fraction: float = 0.0
    displaced_fraction: float = 0.0
    mean_plastic_displacement: float = 0.0
    plastic_work: float = 0.0
    hydraulic_gap_x: float | None = None
    hydraulic_gap_y: float | None = None
    hydraulic_gap_x_error: float | None = None
    hydraulic_gap_y_error: float | None = None
    hydraulic_gap_effective_medium: float | None = None
    von_mises: float | None = None
    shear: float | None = None

    @classmethod
    def _read(cls, row: dict[str, Any]) -> RunState:
        """From a state of ``results.json``, which leaves out what there is not."""
        numbers: dict[str, Any] = {f.name: row.get(f.name, None if f.default is MISSING else f.default) for f in fields(cls)}
        if flow := row.get("leakage"):
            numbers |= zip(("hydraulic_gap_x", "hydraulic_gap_y"), map(_cube_root, flow["conductivity"]), strict=True)
            numbers["hydraulic_gap_effective_medium"] = _cube_root(flow["effective_medium"])
            if errors := flow.get("gap_errors"):
                numbers |= zip(("hydraulic_gap_x_error", "hydraulic_gap_y_error"), errors, strict=True)
        if below := row.get("subsurface"):
            numbers |= {name: below[name]["value"] for name in ("von_mises", "shear")}
        return cls(**numbers)


#: Units of the numbers of a state that have one.
UNITS = (
    dict.fromkeys(("pressure", "von_mises", "shear"), "Pa")
    | dict.fromkeys(("mean_gap", "mean_gap_error", "displacement", "mean_plastic_displacement"), "m")
    | dict.fromkeys((f.name for f in fields(RunState) if f.name.startswith("hydraulic_gap")), "m")
    | {"stiffness": "Pa/m", "stiffness_error": "Pa/m", "plastic_work": "J/m²"}
)


def _cube_root(conductivity: float) -> float:
    """The uniform gap of a conductivity, which is its cube."""
    return float(np.cbrt(conductivity))


class Run:
    """The folder of a finished run, in SI units; :func:`open_run` reads it."""

    def __init__(self, folder: Where) -> None:
        self.folder = a_path("folder", folder)
        self._native = _asperity.FinishedRun(os.fspath(self.folder))
        self._results: dict[str, Any] | None = None

    @property
    def results(self) -> dict[str, Any]:
        """All of ``results.json``."""
        if self._results is None:
            self._results = json.loads(self._native.json())
        return cast("dict[str, Any]", self._results)

    @property
    def name(self) -> str:
        """Name of the scene."""
        return cast(str, self.results["name"])

    @property
    def warnings(self) -> list[str]:
        """Warnings of the run."""
        return cast("list[str]", self.results["warnings"])

    @property
    def length_m(self) -> float:
        """Extent of the cell along x, m."""
        return self._native.scales()[0]

    @property
    def modulus_pa(self) -> float:
        """Contact modulus E* of the continuum at laboratory scale, Pa."""
        return self._native.scales()[1]

    @property
    def states(self) -> tuple[RunState, ...]:
        """Equilibria of the continuum, one for each load."""
        rows = (self.results["continuum"] or {}).get("states", [])
        return tuple(map(RunState._read, rows))

    @property
    def heights(self) -> Map | None:
        """Heights ``[ny, nx]``, m; None if the run stored no maps."""
        return self._native.heights()

    def gap(self, index: int) -> Map | None:
        """Gap ``[ny, nx]`` of a state, m; None if the run did not store it."""
        return self._native.gap(self._index(index))

    def stress(self, index: int) -> Map | None:
        """Interfacial stress ``[ny, nx]`` of a state, Pa, compression positive; None if the run did not store it."""
        return self._native.stress(self._index(index))

    def _index(self, index: int) -> int:
        count = len(self.states)
        if not -count <= index < count:
            raise IndexError(f"state {index} of {count}, counted from 0")
        return index % count

    def contact_frame(self, index: int) -> ase.Atoms:
        """Atoms within some Å of the interface at a load of the atoms, as `Atoms` of ASE; Å.

        ``arrays["contact"]`` is 1 for block atoms in contact, ``arrays["indenter"]`` 1 for atoms of the indenter, and ``arrays["id"]``
        their number in LAMMPS; ``info["p_star"]`` is the load.

        Raises
        ------
        InputError
            If the run has no atoms, or stored no frame of this load.
        """
        states = (self.results["atoms"] or {}).get("states", [])
        if not states:
            raise InputError(f"{self.folder}: atoms = none; accepted: a run with atoms")
        if not -len(states) <= index < len(states):
            raise IndexError(f"load {index} of {len(states)}, counted from 0")
        if not (frame := states[index].get("frame")):
            raise InputError(f"{self.folder}: frame of load {index} = none; accepted: a run that stored its frames")
        atoms: ase.Atoms = needed("ase.io").read(self._native.file(frame))
        return atoms

    @property
    def curve(self) -> pandas.DataFrame:
        """Numbers of all states as a table of pandas."""
        table: pandas.DataFrame = needed("pandas").DataFrame([vars(state) for state in self.states])
        return table

    @property
    def dataset(self) -> xarray.Dataset:
        """``results.nc`` as a dataset of xarray."""
        data: xarray.Dataset = needed("xarray").open_dataset(self._native.file("results.nc"), engine="h5netcdf")
        return data

    def plot_map(self, index: int, quantity: str = "stress", **options: Any) -> Any:
        """Map of ``gap`` or ``stress`` of a state by matplotlib. Options are `ax` and those of ``Axes.imshow``; returns the axes."""
        maps = {"gap": (self.gap, "m"), "stress": (self.stress, "Pa")}
        if quantity not in maps:
            raise InputError(f"quantity = {quantity!r}; accepted: {', '.join(maps)}")
        read, unit = maps[quantity]
        if (values := read(index)) is None:
            raise InputError(f"{self.folder}: {quantity} of state {index} = not stored; accepted: a state with maps")
        cell = (self.length_m, self.length_m * self.results["surface"]["aspect"])
        return plot_map(values, cell, (quantity, unit), "m", **options)

    def plot_curve(self, x: str = "p_star", y: str = "contact_area", **options: Any) -> Any:
        """One number of the states over another by matplotlib. Options are `ax` and those of ``Axes.plot``; returns the axes."""
        numbers = {f.name: [getattr(s, f.name) for s in self.states] for f in fields(RunState)}
        return plot_curve(numbers, x, y, UNITS, **options)

    @property
    def report(self) -> Path:
        """The report, for a browser."""
        return self.folder / "report.html"

    def __reduce__(self) -> tuple[type[Run], tuple[Path]]:
        return Run, (self.folder,)

    def __repr__(self) -> str:
        return f"<Run {self.name!r} in {self.folder}: {len(self.states)} states>"

    def _repr_html_(self) -> str:
        rows = ((s.branch, s.p_star, f"{100 * s.contact_area:.4g} %", s.mean_gap) for s in self.states)
        return table(("branch", "p*", "contact", "mean gap / m"), rows)


def open_run(folder: Where) -> Run:
    """The folder of a finished run.

    Raises
    ------
    InputError
        If the folder has no results, those of another version, or a file that is not as the run wrote it.
    """
    return Run(folder)
