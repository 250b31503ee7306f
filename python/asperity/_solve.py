"""Load paths and estimates."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _asperity
from ._body import Body, body_settings
from ._errors import AsperityWarning, InputError, needed
from ._law import TabulatedLaw
from ._observe import Clusters, Distribution, clusters, gap_distribution, hydraulic_gap, percolation, pressure_distribution
from ._progress import Progress, bar
from ._html import label, table
from ._subsurface import SubsurfaceStress, subsurface
from ._surface import Map, Surface, as_map, real

if TYPE_CHECKING:
    import pandas
    import xarray

Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Adhesion:
    """Attraction between the surfaces.

    Attributes
    ----------
    work_of_adhesion : float
        Work of adhesion γ, in units of modulus times length: with µm and MPa, 0.05 J/m² is 0.05.
    range : float
        Range ρ, in the unit of the surface.
    law : {'exponential', 'dugdale', 'power-9-3'} or TabulatedLaw
        Decay of the attraction with the gap. A table gives the shape, which is scaled to the work and the range.
    resolution : {'mesh', 'true', 'extrapolate'}
        Where the grid does not resolve the range, ``mesh`` takes the shortest range that it resolves, ``true`` takes the range as
        it is, and ``extrapolate`` solves with three longer ranges and extrapolates.
    """

    work_of_adhesion: float
    range: float
    law: str | TabulatedLaw = "exponential"
    resolution: str = "mesh"

    @classmethod
    def from_traction(cls, traction: Callable[[float], float], cutoff: float, *, resolution: str = "mesh") -> Adhesion:
        """An attraction of your own from its traction, which is tabulated up to the gap `cutoff`: see :class:`TabulatedLaw`.

        Examples
        --------
        >>> import asperity
        >>> cohesive = asperity.Adhesion.from_traction(lambda gap: 2.0 * max(1 - gap / 0.1, 0), cutoff=0.1)
        >>> round(cohesive.work_of_adhesion, 9)
        0.1
        """
        table = TabulatedLaw(traction, cutoff)
        return cls(table.work_of_adhesion, table.range, table, resolution)


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
    gap, pressure, contact : ndarray, shape (ny, nx)
        Gap, interfacial pressure (compression positive, with the adhesive stress), and whether a node is in contact.
    mean_pressure, mean_gap : float
        Means of the two.
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
        Free energy per area, and its parts.
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
    pressure: Map
    contact: Flags
    mean_pressure: float
    mean_gap: float
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
        return clusters(self.contact)

    def percolation(self) -> tuple[bool, bool]:
        """Whether the contact connects the cell with its image along x and along y."""
        return percolation(self.contact)

    def hydraulic_gap(self) -> float:
        """Height of the uniform gap with the same pressure-driven flow, in Bruggeman's approximation."""
        return hydraulic_gap(self.gap)

    def gap_distribution(self, edges: npt.ArrayLike) -> Distribution:
        """Distribution of the gap over bins with these edges."""
        return gap_distribution(self.gap, edges)

    def pressure_distribution(self, edges: npt.ArrayLike) -> Distribution:
        """Distribution of the pressure of the nodes in contact over bins with these edges."""
        return pressure_distribution(self.pressure, self.contact, edges)

    def subsurface(self, depths: float | Sequence[float], *, poisson: float | None = None) -> list[SubsurfaceStress]:
        """Stresses in the body at `depths`, in the unit of the modulus: :func:`asperity.subsurface` of the pressure of this state.

        Examples
        --------
        >>> import asperity
        >>> surface = asperity.Surface.from_spectrum(64, seed=1, lambda_s=1 / 8)
        >>> near, deep = asperity.solve(surface, 1.0, pressure=0.05)[0].subsurface([0.02, 0.2], poisson=0.3)
        >>> near.shear.max > deep.shear.max
        True
        """
        return subsurface(self.pressure, self.cell, depths, poisson=poisson, body=self.body)

    def plot_map(self, quantity: str = "pressure", **options: Any) -> Any:
        """Map of ``gap``, ``pressure`` or ``contact`` by matplotlib; returns the axes."""
        from ._plot import plot_map

        units = {"gap": self.length_unit, "pressure": self.pressure_unit, "contact": ""}
        if quantity not in units:
            raise InputError(f"quantity = {quantity!r}; accepted: {', '.join(units)}")
        return plot_map(getattr(self, quantity), self.cell, (quantity, units[quantity]), self.length_unit, **options)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        for values in (self.gap, self.pressure, self.contact, self.plastic_displacement):
            if values is not None:
                values.flags.writeable = False

    def __repr__(self) -> str:
        return (
            f"<State {self.branch}: mean pressure {self.mean_pressure:.6g} {self.pressure_unit}".rstrip()
            + f", contact {100 * self.contact_area:.4g} %, mean gap {self.mean_gap:.6g} {self.length_unit}".rstrip()
            + ">"
        )


@dataclass(frozen=True)
class PullOff:
    """The largest tensile pressure of an equilibrium on separation, with its errors."""

    mean_pressure: float
    pressure_error: float | None
    mean_gap: float
    mean_gap_error: float | None


#: Numbers of a state in the order of tables.
NUMBERS = tuple(
    f.name
    for f in fields(State)
    if f.name not in ("gap", "pressure", "contact", "plastic_displacement", "cell", "body", "length_unit", "pressure_unit", "observed")
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
    """

    states: tuple[State, ...]
    pull_off: PullOff | None = None
    adhesive: bool = False

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
            (s.mean_pressure, s.mean_gap - s.mean_plastic_displacement, s.elastic_energy + s.interaction_energy, s.plastic_work)
            for s in self.states
        ]
        return _asperity.dissipation(path, self.adhesive)

    @property
    def curve(self) -> pandas.DataFrame:
        """Numbers of all states as a table of pandas, one row for each load."""
        rows = [{name: getattr(s, name) for name in NUMBERS} | s.observed for s in self.states]
        table: pandas.DataFrame = needed("pandas").DataFrame(rows)
        return table

    @property
    def units(self) -> dict[str, str]:
        """Units of maps and numbers, from the labels of surface and pressures; empty where these are."""
        if not self.states:
            return {}
        length, pressure = self.states[0].length_unit, self.states[0].pressure_unit
        per_area = f"{pressure} {length}" if pressure and length else ""
        load = {"pressure": pressure, "mean_gap": length, "displacement": length}.get(self.states[0].control, "1")
        return (
            {name: length for name in ("gap", "mean_gap", "mean_gap_error", "mean_plastic_displacement")}
            | {name: f"{pressure}/{length}" if pressure and length else "" for name in ("stiffness", "stiffness_error")}
            | {name: pressure for name in ("pressure", "mean_pressure")}
            | {name: per_area for name in ("energy", "elastic_energy", "interaction_energy", "plastic_work")}
            | {"load": load, "seconds": "s", "perimeter": f"1/{length}" if length else ""}
        )

    @property
    def dataset(self) -> xarray.Dataset:
        """Maps and numbers of all states as a dataset of xarray with the dimensions load_step, y and x."""
        if not self.states:
            raise InputError("dataset = a load path without states; accepted: one or more")
        first, units = self.states[0], self.units
        (ny, nx), (lx, ly), length = first.gap.shape, first.cell, first.length_unit

        def of(name: str, dimensions: tuple[str, ...]) -> tuple[tuple[str, ...], Any, dict[str, str]]:
            return dimensions, np.stack([np.asarray(getattr(s, name)) for s in self.states]), {"units": units.get(name, "1")}

        optional = ("contact_area_error", "mean_gap_error", "stiffness", "stiffness_error")
        numbers = [n for n in NUMBERS if n not in ("control", "branch", *optional)]
        data = {name: of(name, ("load_step", "y", "x")) for name in ("gap", "pressure", "contact")}
        data |= {name: of(name, ("load_step",)) for name in numbers}
        data |= {name: (("load_step",), np.array([s.observed.get(name, np.nan) for s in self.states]), {}) for name in first.observed}
        for name in optional:
            values = [getattr(s, name) for s in self.states]
            data[name] = (("load_step",), np.array([np.nan if v is None else v for v in values]), {"units": units.get(name, "1")})
        coordinates = {
            "x": ("x", np.arange(nx) * lx / nx, {"units": length}),
            "y": ("y", np.arange(ny) * ly / ny, {"units": length}),
            "branch": ("load_step", [s.branch for s in self.states]),
        }
        about = {"program": f"asperity {_asperity.VERSION}"}
        found: xarray.Dataset = needed("xarray").Dataset(data, coordinates, about)
        return found

    def plot_curve(self, x: str = "mean_pressure", y: str = "contact_area", **options: Any) -> Any:
        """One number of the states over another by matplotlib, one line for each branch. Options are `ax` and those of ``Axes.plot``;
        returns the axes."""
        from ._plot import plot_curve

        numbers = {name: [getattr(s, name) for s in self.states] for name in NUMBERS}
        observed = {name: [s.observed.get(name, np.nan) for s in self.states] for s in self.states[:1] for name in s.observed}
        return plot_curve(numbers | observed, x, y, self.units, **options)

    def __repr__(self) -> str:
        return "\n".join([f"<LoadPath of {len(self)} states>", *(f"  {state!r}" for state in self.states)])

    def _repr_html_(self) -> str:
        columns = ("branch", "mean_pressure", "contact_area", "mean_gap", "iterations", "seconds")
        observed = list(self.states[0].observed) if self.states else []
        units = self.units
        head = [label(c, units.get(c, "")) for c in (*columns, *observed)]
        return table(head, ([*(getattr(s, c) for c in columns), *(s.observed.get(name) for name in observed)] for s in self.states))


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
    pressure: Map | None
    contact: Flags | None
    seconds: float
    missing: dict[str, str] = field(default_factory=dict)


Loads = float | Sequence[float] | npt.NDArray[np.floating[Any]]
KINDS = ("pressure", "p_star", "mean_gap", "displacement", "contact")


def _loads(given: dict[str, Loads | None]) -> tuple[str, list[float]]:
    chosen = [(kind, values) for kind, values in given.items() if values is not None]
    if len(chosen) != 1:
        found = ", ".join(kind for kind, _ in chosen) or "none"
        raise InputError(f"problem: loads = {found}; accepted: one of {', '.join(KINDS)}")
    kind, values = chosen[0]
    try:
        array = np.asarray(values)
        if array.size and array.dtype.kind not in "fiu":
            raise TypeError
        numbers = np.atleast_1d(array.astype(np.float64))
    except (TypeError, ValueError):
        raise InputError(f"problem: {kind} = {values!r}; accepted: a number or a sequence of numbers") from None
    if numbers.size == 0:
        raise InputError(f"problem: {kind} = no values; accepted: a number or a sequence of numbers")
    if numbers.ndim != 1:
        raise InputError(f"problem: {kind} = an array of shape {numbers.shape}; accepted: a number or a sequence of numbers")
    return kind, numbers.tolist()


def _settings(
    body: Body | None,
    adhesion: Adhesion | None,
    initial_gap: npt.ArrayLike | None,
    *,
    method: str,
    precision: str = "f64",
    tolerance: float | None = None,
    targets: tuple[float | None, float | None, float | None] = (None, None, None),
    max_iterations: int | None = None,
    penalty_length: float | None = None,
    hardness: npt.ArrayLike | None = None,
) -> dict[str, Any]:
    if max_iterations is not None and (not isinstance(max_iterations, int) or max_iterations < 1):
        raise InputError(f"problem: max_iterations = {max_iterations!r}; accepted: a whole number from 1 on")
    if adhesion is not None and not isinstance(adhesion, Adhesion):
        raise InputError(f"problem: adhesion = {adhesion!r}; accepted: an Adhesion")
    law = adhesion or Adhesion(0.0, 0.0)
    hardness_map = None if hardness is None or np.ndim(hardness) == 0 else as_map("hardness", hardness)
    values = None if adhesion is None else (real("work_of_adhesion", law.work_of_adhesion), real("range", law.range))
    return {
        "body": body_settings(body),
        "method": method,
        "precision": precision,
        "tolerance": tolerance,
        "max_iterations": max_iterations,
        "penalty_length": penalty_length,
        "hardness": hardness if hardness_map is None else None,
        "hardness_map": hardness_map,
        "adhesion": values,
        "law": "exponential" if isinstance(law.law, TabulatedLaw) else law.law,
        "table": law.law._native if isinstance(law.law, TabulatedLaw) else None,
        "resolution": law.resolution,
        "initial_gap": None if initial_gap is None else as_map("initial_gap", initial_gap),
        "targets": targets,
    }


Observables = Mapping[str, Callable[[State], float]]


def _observables(observables: Observables | None) -> Observables:
    given = {} if observables is None else observables
    if not isinstance(given, Mapping) or not all(isinstance(name, str) and callable(f) for name, f in given.items()):
        raise InputError(f"observables = {given!r}; accepted: a dictionary of names and functions of a State")
    if taken := sorted(set(given) & {f.name for f in fields(State)}):
        raise InputError(f"observables = {', '.join(taken)}; accepted: names other than those of State")
    return given


def _threads(threads: int | None) -> int:
    if threads is None:
        return 0
    if not isinstance(threads, int) or not 1 <= threads <= 65536:
        raise InputError(f"threads = {threads!r}; accepted: a whole number from 1 to 65536, or None for all cores")
    return threads


def solve(
    surface: Surface,
    modulus: float,
    *,
    pressure: Loads | None = None,
    p_star: Loads | None = None,
    mean_gap: Loads | None = None,
    displacement: Loads | None = None,
    contact: Loads | None = None,
    body: Body | None = None,
    adhesion: Adhesion | None = None,
    pull_off: bool = False,
    method: str = "auto",
    precision: str = "f64",
    tolerance: float | None = None,
    energy_target: float | None = None,
    area_target: float | None = None,
    mean_gap_target: float | None = None,
    max_iterations: int | None = None,
    penalty_length: float | None = None,
    hardness: npt.ArrayLike | None = None,
    initial_gap: npt.ArrayLike | None = None,
    pressure_unit: str = "",
    observables: Observables | None = None,
    threads: int | None = None,
    progress: bool | Callable[[Progress], object] | None = None,
) -> LoadPath:
    """Equilibria of a rough surface on an elastic body under a sequence of loads.

    Exactly one of `pressure`, `p_star`, `mean_gap`, `displacement` and `contact` is given: a number or a sequence, applied in
    its order. With adhesion, loading and unloading lead to different states.

    Parameters
    ----------
    surface : Surface
        The rough surface, which is rigid.
    modulus : float
        Contact modulus E* = E/(1-ν²). Pressures have its unit.
    pressure : float or sequence, optional
        Mean pressures, compression positive.
    p_star : float or sequence, optional
        Mean pressures over E* times the rms gradient.
    mean_gap : float or sequence, optional
        Mean gaps, in the unit of the surface. They reach states that are unstable under a prescribed pressure.
    displacement : float or sequence, optional
        Displacements from first contact, in the unit of the surface.
    contact : float or sequence, optional
        Fractions of nodes in contact, between 0 and 1: the pressure of each is found first, to one node.
    body : Layer, Cubic or NonPeriodic, optional
        The elastic body. Default: a half-space under a periodic surface.
    adhesion : Adhesion, optional
        Attraction between the surfaces.
    pull_off : bool
        Separate the surfaces after the last load, and find the largest tensile pressure.
    method : str
        An id of :func:`asperity.methods` that solves for the fields; ``auto`` is the fastest.
    precision : {'f64', 'f32'}
        Floating-point type of the fields.
    tolerance : float, optional
        Largest rms residual over the mean pressure. Default: 1e-8, in single precision what rounding allows.
    energy_target, area_target, mean_gap_target : float, optional
        Estimated relative errors at which the solver may stop earlier.
    max_iterations : int, optional
        Iterations per load after which the solver stops.
    penalty_length : float, optional
        Penetration under a pressure of E*, for a soft repulsion. Default: a hard wall, without penetration.
    hardness : float or array_like, shape (ny, nx), optional
        Largest contact pressure, in the unit of `modulus`, of the whole surface or of each node. Where it is reached, the surface flows; unloading is elastic. Default:
        an elastic body. Methods fast, bvm and gfmd.
    initial_gap : array_like, shape (ny, nx), optional
        Gap from which the first load starts. Default: first contact.
    pressure_unit : str, optional
        Label of the unit of pressures.
    observables : dict of str to callable, optional
        Numbers of your own: functions of a :class:`State`, called for each state when it is solved, while the next load is. Their values
        are in :attr:`State.observed`, :attr:`LoadPath.curve` and :attr:`LoadPath.dataset`. An exception of a function ends the path;
        its attribute `load_path` has the states.
    threads : int, optional
        Threads; all cores by default. Results do not depend on it.
    progress : bool or callable, optional
        Whether to show a progress bar; None shows one in a terminal or notebook, after a second. A callable receives a
        :class:`Progress`.

    Returns
    -------
    LoadPath
        One state for each load.

    Raises
    ------
    InputError
        For values that are not accepted.
    NotConverged
        If a load does not converge. Its attribute `load_path` has the states before it.
    KeyboardInterrupt
        At Ctrl-C, within a fraction of a second. Its attribute `load_path` has the states that are finished.

    Examples
    --------
    >>> import asperity
    >>> surface = asperity.Surface.from_spectrum(64, seed=1, lambda_s=1 / 8)
    >>> path = asperity.solve(surface, 1.0, p_star=[0.02, 0.05])
    >>> [round(state.contact_area, 3) for state in path]
    [0.04, 0.102]

    An observable of your own:

    >>> path = asperity.solve(surface, 1.0, p_star=[0.02, 0.05], observables={"widest gap": lambda state: state.gap.max()})
    >>> bool(path[1].observed["widest gap"] == path[1].gap.max())
    True
    """
    loads = _loads({"pressure": pressure, "p_star": p_star, "mean_gap": mean_gap, "displacement": displacement, "contact": contact})
    settings = _settings(
        body,
        adhesion,
        initial_gap,
        method=method,
        precision=precision,
        tolerance=tolerance,
        targets=(energy_target, area_target, mean_gap_target),
        max_iterations=max_iterations,
        penalty_length=penalty_length,
        hardness=hardness,
    )
    problem = (_native(surface), real("modulus", modulus))

    def warn(text: str) -> None:
        warnings.warn(text, AsperityWarning, stacklevel=3)

    functions = _observables(observables)
    labels: dict[str, Any] = {"cell": surface.cell, "body": body, "length_unit": surface.unit, "pressure_unit": pressure_unit}
    states: list[State] = []

    def visit(values: dict[str, Any]) -> None:
        states.append(State(control=loads[0], load=loads[1][len(states)], **values, **labels))
        for name, function in functions.items():
            states[-1].observed[name] = real(name, function(states[-1]))

    with bar(progress, len(loads[1])) as show:

        def shown(*values: Any) -> None:
            if show is not None:
                show(len(states), *values)

        calls: dict[str, Callable[..., object] | None] = {"warn": warn, "visit": visit, "progress": None if show is None else shown}
        pulled, error = _asperity.solve(problem, loads, bool(pull_off), settings, _threads(threads), calls)
        if error is None:
            shown(0.0, states[-1].iterations, states[-1].residual)
    path = LoadPath(tuple(states), None if pulled is None else PullOff(**pulled), adhesion is not None)
    if error is not None:
        error.load_path = path  # type: ignore[attr-defined]
        raise error
    return path


def _native(surface: Surface) -> _asperity.Surface:
    if not isinstance(surface, Surface):
        raise InputError(f"problem: surface = {type(surface).__name__}; accepted: a Surface, as from Surface.from_array")
    return surface._native


def estimate(
    surface: Surface,
    modulus: float,
    pressure: float,
    *,
    method: str,
    body: Body | None = None,
    adhesion: Adhesion | None = None,
    threads: int | None = None,
) -> Estimate:
    """The contact under a mean pressure by any method of :func:`asperity.methods`, estimates included.

    Parameters
    ----------
    surface, modulus, body, adhesion, threads
        As in :func:`solve`.
    pressure : float
        Mean pressure.
    method : str
        Id of the method.

    Raises
    ------
    InputError
        For values that are not accepted, and methods that do not cover the problem.

    Examples
    --------
    >>> import asperity
    >>> surface = asperity.Surface.from_spectrum(64, seed=1, lambda_s=1 / 8)
    >>> found = asperity.estimate(surface, 1.0, 0.05, method="persson")
    >>> found.gap is None
    True
    >>> found.missing["gap_map"]
    'statistical method without positions'
    """
    settings = _settings(body, adhesion, None, method=method)
    problem = (_native(surface), real("modulus", modulus))
    return Estimate(**_asperity.estimate(problem, real("pressure", pressure), settings, _threads(threads)))


def memory(surface: Surface, *, method: str = "auto", precision: str = "f64") -> int:
    """Bytes that a solve takes besides the surface, without adhesion."""
    settings = _settings(None, None, None, method=method, precision=precision)
    return _asperity.memory((_native(surface), 1.0), settings)
