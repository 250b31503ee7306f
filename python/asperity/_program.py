"""The program `asperity`, which the wheel installs, and the folders of its runs."""

from __future__ import annotations

import json
import logging
import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import threading
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from . import _asperity
from ._errors import CLASSES, AsperityError, InputError, ResourceError, needed
from ._html import table
from ._progress import visible
from ._surface import Map, real

if TYPE_CHECKING:
    import ase
    import pandas
    import xarray

Where = str | os.PathLike[str]

LOG = logging.getLogger("asperity")

#: Exit code of an interrupted program.
INTERRUPTED = 130

#: Seconds that an interrupted program has for its checkpoint.
PATIENCE = 30.0


def program() -> Path:
    """Path of the program: that of the environment variable ASPERITY_PROGRAM, of this installation, or on the search path.

    Raises
    ------
    ResourceError
        If there is none.
    """
    given = os.environ.get("ASPERITY_PROGRAM")
    schemes = [sysconfig.get_path("scripts"), sysconfig.get_path("scripts", f"{os.name}_user")]
    installed = (str(Path(folder) / "asperity") for folder in schemes)
    for path in [given] if given else [*installed, shutil.which("asperity")]:
        if path and os.access(path, os.X_OK):
            return Path(path)
    raise ResourceError("the program asperity was not found; install the wheel again, or set ASPERITY_PROGRAM to its path")


def command(*arguments: Where | float, cwd: Where | None = None, echo: bool | None = None) -> str:
    """Runs the program with these arguments and returns what it prints on stdout.

    Its messages go to the logger ``asperity``, and with `echo` to stderr; by default in a terminal and a notebook.

    At Ctrl-C the program is interrupted, writes its checkpoint, and KeyboardInterrupt is raised; the same command resumes it.

    Raises
    ------
    InputError, NotConverged, LammpsError, ResourceError
        By its exit code, with its message.

    Examples
    --------
    >>> import asperity
    >>> asperity.command("--version").startswith("asperity ")
    True
    """
    for argument in arguments:
        if not isinstance(argument, (str, os.PathLike, int, float)):
            raise InputError(f"argument = {argument!r}; accepted: each word of the command line as an argument of its own")
    show = visible() if echo is None else echo
    words = [str(program()), *(os.fspath(a) if isinstance(a, os.PathLike) else str(a) for a in arguments)]
    # In a session of its own: a terminal's Ctrl-C would reach it twice.
    child = subprocess.Popen(
        words, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, encoding="utf-8", start_new_session=True
    )
    lines: list[str] = []

    def listen() -> None:
        assert child.stderr is not None
        with child.stderr as stream:
            for line in stream:
                lines.append(line.rstrip())
                LOG.info(lines[-1])
                if show:
                    print(lines[-1], file=sys.stderr)

    listener = threading.Thread(target=listen, daemon=True)
    listener.start()
    assert child.stdout is not None
    try:
        found = child.stdout.read()
        code = child.wait()
    except BaseException:
        child.send_signal(signal.SIGINT)
        try:
            child.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            child.kill()
        raise
    finally:
        child.stdout.close()
    listener.join()
    if code == 0:
        return found
    if code == INTERRUPTED:
        raise KeyboardInterrupt
    marks = [i for i, line in enumerate(lines) if "error: " in line]
    text = "\n".join(lines[marks[-1] :] if marks else lines[-5:]).split("error: ", 1)[-1]
    raise CLASSES.get(code, AsperityError)(text or f"{' '.join(words)} ended with exit code {code}")


@dataclass(frozen=True)
class RunState:
    """One equilibrium of a finished run, in SI units."""

    branch: str
    p_star: float
    pressure_pa: float
    contact_area: float
    contact_area_error: float | None
    contact_nodes: float
    mean_gap_m: float
    mean_gap_error_m: float | None
    stiffness_pa_per_m: float | None


class Run:
    """The folder of a finished run, in SI units; :func:`open_run` reads it."""

    def __init__(self, folder: Where) -> None:
        self.folder = Path(folder).expanduser()
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
        """Contact modulus E*, Pa."""
        return self._native.scales()[1]

    @property
    def states(self) -> tuple[RunState, ...]:
        """Equilibria of the continuum, one for each load."""
        return tuple(RunState(**row) for row in self._native.states())

    @property
    def heights(self) -> Map | None:
        """Heights ``[ny, nx]``, m; None if the run stored no maps."""
        return self._native.heights()

    def gap(self, index: int) -> Map | None:
        """Gap ``[ny, nx]`` of a state, m; None if the run did not store it."""
        return self._native.gap(self._index(index))

    def pressure(self, index: int) -> Map | None:
        """Interfacial pressure ``[ny, nx]`` of a state, Pa, compression positive; None if the run did not store it."""
        return self._native.pressure(self._index(index))

    def _index(self, index: int) -> int:
        count = len(self._native.states())
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
        atoms: ase.Atoms = needed("ase.io").read(self.folder / frame)
        return atoms

    @property
    def curve(self) -> pandas.DataFrame:
        """Numbers of all states as a table of pandas."""
        table: pandas.DataFrame = needed("pandas").DataFrame([vars(state) for state in self.states])
        return table

    @property
    def dataset(self) -> xarray.Dataset:
        """``results.nc`` as a dataset of xarray."""
        data: xarray.Dataset = needed("xarray").open_dataset(self.folder / "results.nc", engine="h5netcdf")
        return data

    def plot_map(self, index: int, quantity: str = "pressure", **options: Any) -> Any:
        """Map of ``gap`` or ``pressure`` of a state by matplotlib. Options are `ax` and those of ``Axes.imshow``; returns the axes."""
        from ._plot import plot_map

        maps = {"gap": (self.gap, "m"), "pressure": (self.pressure, "Pa")}
        if quantity not in maps:
            raise InputError(f"quantity = {quantity!r}; accepted: {', '.join(maps)}")
        read, unit = maps[quantity]
        if (values := read(index)) is None:
            raise InputError(f"{self.folder}: {quantity} of state {index} = not stored; accepted: a state with maps")
        ny, nx = values.shape
        return plot_map(values, (self.length_m, self.length_m * ny / nx), (quantity, unit), "m", **options)

    def plot_curve(self, x: str = "p_star", y: str = "contact_area", **options: Any) -> Any:
        """One number of the states over another by matplotlib. Options are `ax` and those of ``Axes.plot``; returns the axes."""
        from ._plot import plot_curve

        numbers = {f.name: [getattr(s, f.name) for s in self.states] for f in fields(RunState)}
        return plot_curve(numbers, x, y, {"pressure_pa": "Pa", "mean_gap_m": "m", "mean_gap_error_m": "m", "stiffness_pa_per_m": "Pa/m"}, **options)

    @property
    def report(self) -> Path:
        """The report, for a browser."""
        return self.folder / "report.html"

    def __reduce__(self) -> tuple[type[Run], tuple[Path]]:
        return Run, (self.folder,)

    def __repr__(self) -> str:
        return f"<Run {self.name!r} in {self.folder}: {len(self.states)} states>"

    def _repr_html_(self) -> str:
        rows = ((s.branch, s.p_star, f"{100 * s.contact_area:.4g} %", s.mean_gap_m) for s in self.states)
        return table(("branch", "p*", "contact", "mean gap / m"), rows)


def open_run(folder: Where) -> Run:
    """The folder of a finished run.

    Raises
    ------
    InputError
        If the folder has no results, or those of another version.
    """
    return Run(folder)


def run(
    scene: Where,
    out: Where | None = None,
    *,
    atoms: bool = True,
    overwrite: bool = False,
    threads: int | None = None,
    echo: bool | None = None,
    arguments: Sequence[str] = (),
) -> Run:
    """Runs a scene: surface, continuum, atoms, comparison, report. The same call resumes an interrupted run.

    Parameters
    ----------
    scene : path_like
        Scene file (TOML).
    out : path_like, optional
        Run folder. Default: ``runs/NAME`` with the scene's name.
    atoms : bool
        Whether to run the atoms of the scene.
    overwrite : bool
        Replace the results of another scene in that folder.
    threads : int, optional
        Threads; all cores by default.
    echo : bool, optional
        Whether to print the messages of the program; by default in a terminal and a notebook.
    arguments : sequence of str
        Further arguments of ``asperity run``.

    Raises
    ------
    InputError, NotConverged, LammpsError, ResourceError
        As the program reports them.
    """
    words: list[Where | float] = ["run", _scene(scene), "--json", *_words(arguments)]
    words += [] if threads is None else [f"--threads={threads}"]
    words += [] if out is None else ["--out", out]
    words += [] if atoms else ["--no-atoms"]
    words += ["--overwrite"] if overwrite else []
    return Run(json.loads(command(*words, echo=echo))["out"])


def advise(
    scene: Where,
    quantity: str,
    *,
    error: float | None = None,
    budget: str | None = None,
    extrapolate: bool = False,
) -> dict[str, Any]:
    """The cheapest setting for an error, or the most accurate for a time, from measured tables.

    Parameters
    ----------
    scene : path_like
        Scene file (TOML).
    quantity : str
        Such as ``contact_area`` or ``mean_gap``.
    error : float, optional
        Largest relative error.
    budget : str, optional
        Largest wall time, as ``30s``, ``10m`` or ``2h``.
    extrapolate : bool
        Whether to go beyond the measured settings.

    Returns
    -------
    dict
        As ``asperity advise --json`` prints it.
    """
    if (error is None) == (budget is None):
        raise InputError("advise: error and budget are both given or both missing; accepted: one of them")
    words: list[Where | float] = ["advise", _scene(scene), "--quantity", quantity, "--json"]
    words += [] if error is None else [f"--error={real('error', error)}"]
    words += [] if budget is None else ["--budget", budget]
    words += ["--extrapolate"] if extrapolate else []
    return cast("dict[str, Any]", json.loads(command(*words)))


def tradeoff(
    scene: Where,
    out: Where | None = None,
    *,
    methods: Sequence[str] | None = None,
    grids: Sequence[int] | None = None,
    reference: int | None = None,
    budget: str | None = None,
    repeats: int | None = None,
    threads: int | None = None,
    echo: bool | None = None,
    arguments: Sequence[str] = (),
) -> dict[str, Any]:
    """Measures cost and error of methods, grids, precisions and tolerances against one reference solution.

    The same call resumes an interrupted measurement, and :func:`advise` uses the table in the default folder.

    Parameters
    ----------
    scene : path_like
        Scene file (TOML): its surface, loads and adhesion.
    out : path_like, optional
        Run folder. Default: ``runs/NAME-tradeoff`` with the scene's name.
    methods : sequence of str, optional
        Ids of :func:`methods`. Default: all.
    grids : sequence of int, optional
        Points per side, divisors of the reference's. Default: the scene's, a half, a quarter.
    reference : int, optional
        Points per side of the reference. Default: the scene's.
    budget : str, optional
        Limit on the time of all settings, as ``90s``, ``10m`` or ``2h``; what is skipped is listed.
    repeats : int, optional
        Runs of each setting, of which the fastest counts.
    threads, echo
        As in :func:`run`.
    arguments : sequence of str
        Further arguments of ``asperity tradeoff``, such as ``["--layer-thickness", "0.1"]``.

    Returns
    -------
    dict
        The table in ``tradeoff.json`` of the folder: ``references``, ``points`` with cost and error of each setting, ``skipped``,
        ``warnings``.

    Raises
    ------
    InputError, NotConverged, LammpsError, ResourceError
        As the program reports them.
    """
    words: list[Where | float] = ["tradeoff", _scene(scene), "--json", *_words(arguments)]
    words += [] if out is None else ["--out", out]
    words += [] if methods is None else ["--methods", ",".join(_words(methods, "methods"))]
    words += [] if grids is None else ["--grids", ",".join(str(grid) for grid in grids)]
    numbers = (("reference", reference), ("repeats", repeats), ("threads", threads), ("budget", budget))
    words += [f"--{name}={value}" for name, value in numbers if value is not None]
    return cast("dict[str, Any]", json.loads(command(*words, echo=echo))["tradeoff"])


def _scene(scene: Where) -> Where:
    if not isinstance(scene, (str, os.PathLike)):
        raise InputError(f"scene = {scene!r}; accepted: the path of a scene file")
    return scene


def _words(arguments: Sequence[str], name: str = "arguments") -> Sequence[str]:
    if isinstance(arguments, str) or not all(isinstance(word, str) for word in arguments):
        raise InputError(f"{name} = {arguments!r}; accepted: a list of words")
    return arguments
