"""Equilibria, load paths and estimates: what solves return."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _asperity
from ._arguments import Flags, Map
from ._body import Body, NonPeriodic
from ._errors import InputError, needed
from ._html import label, table
from ._observe import Clusters, Distribution, clusters, gap_distribution, hydraulic_gap, percolation, stress_distribution
from ._plot import plot_curve, plot_map
from ._subsurface import SubsurfaceStress, subsurface

if TYPE_CHECKING:
    import pandas
    import xarray


@dataclass(frozen=True, eq=False)
class State:
    """An equilibrium. Units are those of surface and modulus; maps are ``[ny, nx]`` and not writeable.

    Attributes
    ----------
    control : {'pressure', 'p_star', 'mean_gap', 'displacement', 'contact'}
        What was prescribed.
    load : float
        Its value.
    branch : {'loading', 'unloading'}
        Branch of the load path.
    gap, stress, contact : ndarray, shape (ny, nx)
        Gap, interfacial stress (compression positive, with the adhesive stress), and whether a node is in contact.
    pressure, mean_gap : float
        Mean pressure, the mean of the stress, and mean gap.
    displacement : float
        Displacement of the far field from first contact: of a periodic body the mean gap at first contact minus the mean gap, plus the
        mean plastic displacement, else the rigid approach.
    contact_area : float
        Contact area over the area of the cell: the best value. Under a hard wall nodes on the edge of the contact represent less than
        a pixel of contact; their excess is subtracted.
    contact_nodes : float
        Contact nodes over all nodes.
    stiffness : float or None
        Contact stiffness, the derivative of the mean pressure by the approach without change of the contact. None without contact, at
        full contact, and where the state is unstable under an imposed pressure.
    contact_area_error, mean_gap_error, stiffness_error : float or None
        Errors of these, of the same units. None where a part of the error is not known.
    perimeter : float
        Perimeter of the contact per area.
    energy, elastic_energy, interaction_energy : float
        Energies per area: of body and interaction, and their sum with the energy of the load, pressure times mean gap (less the mean plastic
        displacement), or less pressure times displacement for NonPeriodic.
    plastic_displacement : ndarray, shape (ny, nx), or None
        Plastic displacement of the surface since the first load; None before the first flow.
    flowing_fraction, displaced_fraction : float
        Fractions of nodes whose plastic displacement grows in this load, and of nodes that have one.
    mean_plastic_displacement, plastic_work : float
        Mean of the displacement, and plastic work per area.
    load_error, residual : float
        Error of the load balance, and rms residual, over the mean pressure.
    iterations : int
        Iterations on this load.
    seconds : float
        Wall time of this load, s.
    cell : tuple of float
        Extents along x and along y.
    body : Layer, Cubic, NonPeriodic or None
        The elastic body; None is a half-space.
    length_unit, pressure_unit : str
        Labels.
    observed : dict of str to float
        Values of the `observables` of :func:`solve`.
    """

    control: str
    load: float
    branch: str
    gap: Map
    stress: Map
    contact: Flags
    pressure: float
    mean_gap: float
    displacement: float
    contact_area: float
    contact_nodes: float
    contact_area_error: float | None
    mean_gap_error: float | None
    stiffness: float | None
    stiffness_error: float | None
    perimeter: float
    energy: float
    elastic_energy: float
    interaction_energy: float
    plastic_displacement: Map | None
    flowing_fraction: float
    displaced_fraction: float
    mean_plastic_displacement: float
    plastic_work: float
    load_error: float
    residual: float
    iterations: int
    seconds: float
    cell: tuple[float, float]
    body: Body | None = None
    length_unit: str = ""
    pressure_unit: str = ""
    observed: dict[str, float] = field(default_factory=dict)

    def clusters(self) -> Clusters:
        """Contact clusters; nodes that share an edge or a corner are neighbours."""
        return clusters(self.contact, periodic=self._periodic)

    def percolation(self) -> tuple[bool, bool]:
        """Whether the contact connects the cell with its image along x and along y, or opposite sides of a body that is not periodic."""
        return percolation(self.contact, periodic=self._periodic)

    @property
    def _periodic(self) -> bool:
        return not isinstance(self.body, NonPeriodic)

    def hydraulic_gap(self) -> float:
        """Height of the uniform gap with the same pressure-driven flow, in Bruggeman's approximation."""
        return hydraulic_gap(self.gap)

    def gap_distribution(self, edges: npt.ArrayLike) -> Distribution:
        """Distribution of the gap over bins with these edges."""
        return gap_distribution(self.gap, edges)

    def stress_distribution(self, edges: npt.ArrayLike) -> Distribution:
        """Distribution of the stress of the nodes in contact over bins with these edges."""
        return stress_distribution(self.stress, self.contact, edges)

    def subsurface(self, depths: float | Sequence[float], *, poisson: float | None = None) -> list[SubsurfaceStress]:
        """Stresses in the body at `depths`, in the unit of the modulus: :func:`asperity.subsurface` of the stress of this state.

        Examples
        --------
        >>> import asperity
        >>> surface = asperity.Surface.from_spectrum(64, seed=1, lambda_s=1 / 8)
        >>> near, deep = asperity.solve(surface, 1.0, pressure=0.05)[0].subsurface([0.02, 0.2], poisson=0.3)
        >>> near.shear.max > deep.shear.max
        True
        """
        return subsurface(self.stress, self.cell, depths, poisson=poisson, body=self.body)

    def plot_map(self, quantity: str = "stress", **options: Any) -> Any:
        """Map of ``gap``, ``stress`` or ``contact`` by matplotlib; returns the axes."""
        units = {"gap": self.length_unit, "stress": self.pressure_unit, "contact": ""}
        if quantity not in units:
            raise InputError(f"quantity = {quantity!r}; accepted: {', '.join(units)}")
        return plot_map(getattr(self, quantity), self.cell, (quantity, units[quantity]), self.length_unit, **options)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        for values in (self.gap, self.stress, self.contact, self.plastic_displacement):
            if values is not None:
                values.flags.writeable = False

    def __repr__(self) -> str:
        return (
            f"<State {self.branch}: mean pressure {self.pressure:.6g} {self.pressure_unit}".rstrip()
            + f", contact {100 * self.contact_area:.4g} %, mean gap {self.mean_gap:.6g} {self.length_unit}".rstrip()
            + ">"
        )


@dataclass(frozen=True)
class PullOff:
    """The largest tensile pressure of an equilibrium on separation, with its errors, and the force on the measured map at it.

    The force is in the unit of the pressure times that of lengths squared; None for a profile.
    """

    pressure: float
    pressure_error: float | None
    force: float | None
    mean_gap: float
    mean_gap_error: float | None


@dataclass(frozen=True)
class Accuracy:
    """How the accuracy of a load path was reached.

    Attributes
    ----------
    met : bool or None
        Whether every error is within what was asked for; None where only a time was.
    last : str
        Why no finer grid was solved: ``met``, ``map`` (it has no further nodes), ``waves`` (16 nodes per shortest wave), ``budget``,
        ``memory`` or ``not_converged``.
    errors : dict of str to float or None
        Largest relative errors of the states, by quantity; None where one is not known.
    grids : tuple of dict
        The grids that were solved, from coarse to fine, each with ``nx``, ``ny``, ``seconds`` and ``errors``.
    """

    met: bool | None
    last: str
    errors: dict[str, float | None]
    grids: tuple[dict[str, Any], ...]

    @classmethod
    def _read(cls, results: dict[str, Any]) -> Accuracy:
        met = results["last"] == "met" if results["requested"] else None
        return cls(met, results["last"], results["grids"][-1]["errors"], tuple(results["grids"]))

    def __str__(self) -> str:
        errors = ", ".join(f"{name} {'not known' if e is None else f'{100 * e:.3g} %'}" for name, e in self.errors.items())
        return f"{errors} on {self.grids[-1]['nx']} x {self.grids[-1]['ny']} nodes ({self.last})"


MAPS = ("gap", "stress", "contact")

#: Numbers and words of a state in the order of tables.
COLUMNS = tuple(
    f.name
    for f in fields(State)
    if f.name not in (*MAPS, "plastic_displacement", "cell", "body", "length_unit", "pressure_unit", "observed")
)


@dataclass(frozen=True, eq=False)
class LoadPath(Sequence[State]):
    """Equilibria of a load path: a sequence of states.

    Attributes
    ----------
    states : tuple of State
        One for each load, in their order.
    pull_off : PullOff or None
        Where it was requested.
    adhesive : bool
        Whether the surfaces attract each other.
    accuracy : Accuracy or None
        Where an error or a budget was asked for.
    """

    states: tuple[State, ...]
    pull_off: PullOff | None = None
    adhesive: bool = False
    accuracy: Accuracy | None = None

    def __len__(self) -> int:
        return len(self.states)

    def __getitem__(self, index: Any) -> Any:
        return self.states[index]

    def __iter__(self) -> Iterator[State]:
        return iter(self.states)

    def branch(self, name: str) -> tuple[State, ...]:
        """States of the branch ``loading`` or ``unloading``."""
        if name not in ("loading", "unloading"):
            raise InputError(f"branch = {name!r}; accepted: loading, unloading")
        return tuple(state for state in self.states if state.branch == name)

    def dissipation(self) -> float:
        """Energy per area that the path dissipates, open or closed: the work of the load less the change of the stored energy.

        With adhesion an estimate by trapezoids from the first load on, which finer loads improve; otherwise the plastic work since
        first contact.
        """
        path = [
            (s.pressure, s.displacement, s.elastic_energy + s.interaction_energy, s.plastic_work) for s in self.states
        ]
        return _asperity.dissipation(path, self.adhesive)

    def _columns(self) -> dict[str, list[Any]]:
        """Numbers, words and observables of the states, by name. The last state has not all observables where a function of one failed."""
        columns = {name: [getattr(s, name) for s in self.states] for name in COLUMNS}
        observables = self.states[0].observed if self.states else ()
        return columns | {name: [s.observed.get(name, np.nan) for s in self.states] for name in observables}

    @property
    def curve(self) -> pandas.DataFrame:
        """Numbers of all states as a table of pandas, one row for each load."""
        curve: pandas.DataFrame = needed("pandas").DataFrame(self._columns())
        return curve

    @property
    def units(self) -> dict[str, str]:
        """Units of maps and numbers, from the labels of surface and pressures; empty where these are."""
        if not self.states:
            return {}
        control, length, pressure = self.states[0].control, self.states[0].length_unit, self.states[0].pressure_unit
        both = bool(length and pressure)
        return (
            dict.fromkeys(("gap", "mean_gap", "mean_gap_error", "displacement", "mean_plastic_displacement"), length)
            | dict.fromkeys(("stress", "pressure"), pressure)
            | dict.fromkeys(("stiffness", "stiffness_error"), f"{pressure}/{length}" if both else "")
            | dict.fromkeys(("energy", "elastic_energy", "interaction_energy", "plastic_work"), f"{pressure} {length}" if both else "")
            | {"perimeter": f"1/{length}" if length else "", "seconds": "s"}
            | {"load": {"pressure": pressure, "mean_gap": length, "displacement": length}.get(control, "1")}
        )

    @property
    def dataset(self) -> xarray.Dataset:
        """Maps and numbers of all states as a dataset of xarray with the dimensions load_step, y and x."""
        if not self.states:
            raise InputError("dataset = a load path without states; accepted: one or more")
        first, units, data = self.states[0], self.units, dict[str, tuple[Any, ...]]()
        for name in MAPS:
            data[name] = ("load_step", "y", "x"), np.stack([getattr(s, name) for s in self.states]), {"units": units.get(name, "1")}
        for name, values in self._columns().items():
            # None becomes NaN.
            numbers = np.array(values, dtype=np.float64 if None in values else None)
            data[name] = "load_step", numbers, {} if name in first.observed else {"units": units.get(name, "1")}
        # The kind of the load is one word; the branch is a coordinate.
        del data["control"], data["branch"]
        (ny, nx), (lx, ly), length = first.gap.shape, first.cell, {"units": first.length_unit}
        coordinates = {
            "x": ("x", np.arange(nx) * lx / nx, length),
            "y": ("y", np.arange(ny) * ly / ny, length),
            "branch": ("load_step", [s.branch for s in self.states]),
        }
        dataset: xarray.Dataset = needed("xarray").Dataset(data, coordinates, {"program": f"asperity {_asperity.VERSION}"})
        return dataset

    def plot_curve(self, x: str = "pressure", y: str = "contact_area", **options: Any) -> Any:
        """One number of the states over another by matplotlib, one line for each branch. Options are `ax` and those of ``Axes.plot``;
        returns the axes."""
        return plot_curve(self._columns(), x, y, self.units, **options)

    def __repr__(self) -> str:
        return "\n".join([f"<LoadPath of {len(self)} states>", *(f"  {state!r}" for state in self.states)])

    def _repr_html_(self) -> str:
        columns, units = self._columns(), self.units
        short = ("branch", "pressure", "contact_area", "mean_gap", "iterations", "seconds")
        names = [*short, *(name for name in columns if name not in COLUMNS)]
        return table([label(name, units.get(name, "")) for name in names], zip(*(columns[name] for name in names), strict=True))


@dataclass(frozen=True, eq=False)
class Estimate:
    """The contact under one load as any method gives it; maps are None where the method has none.

    ``missing`` has the reasons for what the method does not deliver, at all or under this load.
    """

    method: str
    criterion: str
    contact_area: float
    mean_gap: float | None
    gap: Map | None
    stress: Map | None
    contact: Flags | None
    seconds: float
    missing: dict[str, str] = field(default_factory=dict)
