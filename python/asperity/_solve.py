"""Solves and estimates."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from . import _asperity
from ._arguments import fits, real, real_map, reals, whole
from ._body import Body, body_settings
from ._errors import AsperityWarning, InputError
from ._law import Adhesion, adhesion_settings
from ._progress import Progress, bar
from ._state import Accuracy, Estimate, LoadPath, PullOff, State
from ._surface import Surface, native

Loads = float | Sequence[float] | npt.NDArray[np.floating[Any]]
Observables = Mapping[str, Callable[[State], float]]


def _loads(loads: dict[str, Loads | None]) -> tuple[str, list[float]]:
    chosen = {kind: values for kind, values in loads.items() if values is not None}
    if len(chosen) != 1:
        raise InputError(f"loads = {', '.join(chosen) or 'none'}; accepted: one of {', '.join(loads)}")
    ((kind, values),) = chosen.items()
    return kind, reals(kind, values).tolist()


def _settings(
    *,
    method: str,
    precision: str = "f64",
    body: Body | None = None,
    adhesion: Adhesion | None = None,
    tolerance: float | None = None,
    max_iterations: int | None = None,
    penalty_length: float | None = None,
    hardness: npt.ArrayLike | None = None,
    initial_gap: npt.ArrayLike | None = None,
) -> dict[str, Any]:
    uniform = np.ndim(0 if hardness is None else hardness) == 0
    return adhesion_settings(adhesion) | {
        "body": body_settings(body),
        "method": method,
        "precision": precision,
        "tolerance": None if tolerance is None else real("tolerance", tolerance),
        "max_iterations": None if max_iterations is None else whole("max_iterations", max_iterations, 1),
        "penalty_length": None if penalty_length is None else real("penalty_length", penalty_length),
        "hardness": real("hardness", cast("float", hardness)) if uniform and hardness is not None else None,
        "hardness_map": None if hardness is None or uniform else real_map("hardness", hardness),
        "initial_gap": None if initial_gap is None else real_map("initial_gap", initial_gap),
    }


def _observables(observables: Observables | None) -> Observables:
    functions = {} if observables is None else observables
    if not isinstance(functions, Mapping) or not all(isinstance(name, str) and callable(f) for name, f in functions.items()):
        raise InputError(f"observables = {functions!r}; accepted: a dictionary of names and functions of a State")
    if taken := sorted(set(functions) & {f.name for f in fields(State)}):
        raise InputError(f"observables = {', '.join(taken)}; accepted: names other than those of State")
    return functions


def _threads(threads: int | None) -> int:
    return 0 if threads is None else whole("threads", threads, 1, _asperity.MOST_THREADS)


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
    error: float | str | Mapping[str, float | str] | None = None,
    budget: float | None = None,
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
        Mean pressures over E* times the rms gradient: of a map its own, of a spectrum that of all waves, those beyond the grid included.
    mean_gap : float or sequence, optional
        Mean gaps, in the unit of the surface. They reach states that are unstable under a prescribed pressure.
    displacement : float or sequence, optional
        Displacements from first contact, in the unit of the surface.
    contact : float or sequence, optional
        Contact areas over the area of the cell, between 0 and 1: the pressure of each is found first, to one node.
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
    error : float, str or dict, optional
        Largest accepted relative errors: ``0.05`` or ``"5%"`` of all quantities, ``{"area": 0.02, "mean_gap": 0.01}`` of those named.
        Grids are solved from coarse to fine until the stated errors of all states are within them. A spectrum goes on beyond its own
        nodes, a map ends with them. :attr:`LoadPath.accuracy` says what was reached; what was not is an :class:`AsperityWarning`.
    budget : float, optional
        Seconds after which no finer grid is begun: the least errors within them.
    max_iterations : int, optional
        Iterations per load after which the solver stops.
    penalty_length : float, optional
        Penetration under a pressure of E*, for a soft repulsion. Default: a hard wall, without penetration.
    hardness : float or array_like, shape (ny, nx), optional
        Largest contact pressure, in the unit of `modulus`, of the whole surface or of each node. Where it is reached, the surface
        flows; unloading is elastic. Default: an elastic body. Methods fast, bvm and gfmd.
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

    A number with an error of at most 5 %, on whatever grid gives it:

    >>> path = asperity.solve(surface, 1.0, p_star=0.05, error={"area": 0.05})
    >>> bool(path[0].contact_area_error <= 0.05 * path[0].contact_area), path.accuracy.met
    (True, True)
    """
    kind, values = _loads({"pressure": pressure, "p_star": p_star, "mean_gap": mean_gap, "displacement": displacement, "contact": contact})
    settings = _settings(
        method=method,
        precision=precision,
        body=body,
        adhesion=adhesion,
        tolerance=tolerance,
        max_iterations=max_iterations,
        penalty_length=penalty_length,
        hardness=hardness,
        initial_gap=initial_gap,
    )
    problem = (native(surface), real("modulus", modulus))
    functions = _observables(observables)
    labels: dict[str, Any] = {"cell": surface.cell, "body": body, "length_unit": surface.unit, "pressure_unit": pressure_unit}
    states: list[State] = []
    # Maps of gap, stress and contact of each state.
    fits("maps of the loads", len(values) * surface.shape[0] * surface.shape[1], 17)

    def warn(text: str) -> None:
        warnings.warn(text, AsperityWarning, stacklevel=3)

    def visit(numbers: dict[str, Any]) -> None:
        states.append(State(control=kind, load=values[len(states)], **numbers, **labels))
        for name, function in functions.items():
            states[-1].observed[name] = real(name, function(states[-1]))

    with bar(progress, len(values)) as show:

        def report(*numbers: Any) -> None:
            if show is not None:
                show(len(states), *numbers)

        calls: dict[str, Callable[..., object] | None] = {"warn": warn, "visit": visit, "progress": None if show is None else report}
        asked = (bool(pull_off), _accuracy(error, budget))
        pulled, reached, failure = _asperity.solve(problem, (kind, values), asked, settings, _threads(threads), calls)
        if failure is None:
            report(0.0, states[-1].iterations, states[-1].residual)
    accuracy = None if reached is None else Accuracy._read(json.loads(reached))
    path = LoadPath(tuple(states), None if pulled is None else PullOff(**pulled), adhesion is not None, accuracy)
    if failure is not None:
        failure.load_path = path  # type: ignore[attr-defined]
        raise failure
    if accuracy is not None and accuracy.met is False:
        warnings.warn(f"the error that was asked for is not reached: {accuracy}", AsperityWarning, stacklevel=2)
    return path


def _accuracy(error: float | str | Mapping[str, float | str] | None, budget: float | None) -> tuple[str, float | None] | None:
    """Errors as the command line takes them, and a time."""
    if error is None and budget is None:
        return None
    if error is not None and isinstance(error, (str, Mapping)) and not error:
        raise InputError(f"error = {error!r}; accepted: an error such as 0.05, '5%' or {{'area': 0.02}}")
    if isinstance(error, Mapping):
        text = ",".join(f"{name}={value}" for name, value in error.items())
    else:
        text = "" if error is None else str(error)
    return text, None if budget is None else real("budget", budget)


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
    >>> persson = asperity.estimate(surface, 1.0, 0.05, method="persson")
    >>> persson.gap is None
    True
    >>> persson.missing["gap_map"]
    'statistical method without positions'
    """
    settings = _settings(method=method, body=body, adhesion=adhesion)
    problem = (native(surface), real("modulus", modulus))
    return Estimate(**_asperity.estimate(problem, real("pressure", pressure), settings, _threads(threads)))


def memory(surface: Surface, *, method: str = "auto", precision: str = "f64") -> int:
    """Bytes that a solve takes besides the surface, without adhesion."""
    return _asperity.memory((native(surface), 1.0), _settings(method=method, precision=precision))
