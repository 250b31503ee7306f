"""The program `asperity`, which the wheel installs."""

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
from pathlib import Path
from typing import Any, cast

from ._arguments import real
from ._errors import CLASSES, AsperityError, InputError, ResourceError
from ._progress import visible
from ._run import Run, Where
from ._sweep import Sweep

#: Folders of programs of this installation. Threads that ask for them at once fail in CPython; an import is in one thread.
SCRIPTS = [sysconfig.get_path("scripts"), sysconfig.get_path("scripts", f"{os.name}_user")]

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
    installed = (str(Path(folder) / "asperity") for folder in SCRIPTS)
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
        output = child.stdout.read()
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
        return output
    if code == INTERRUPTED:
        raise KeyboardInterrupt
    marks = [i for i, line in enumerate(lines) if "error: " in line]
    # Of a sweep, the points that failed.
    failed = [line.strip() for line in lines if " failed: " in line]
    text = "\n".join(lines[marks[-1] :] if marks else failed or lines[-5:]).split("error: ", 1)[-1]
    raise CLASSES.get(code, AsperityError)(text or f"{' '.join(words)} ended with exit code {code}")


def run(
    scene: Where,
    out: Where | None = None,
    *,
    atoms: bool = True,
    overwrite: bool = False,
    lammps: Where | None = None,
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
    lammps : path_like, optional
        LAMMPS: a program of the search path, or a path. Default: that of the scene.
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
    options = _options(no_atoms=not atoms, overwrite=bool(overwrite), out=out, lammps=lammps, threads=threads)
    return Run(_json("run", scene, *options, *_words(arguments), echo=echo)["out"])


def sweep(
    file: Where,
    out: Where | None = None,
    *,
    jobs: int | None = None,
    atoms: bool = True,
    overwrite: bool = False,
    lammps: Where | None = None,
    echo: bool | None = None,
    arguments: Sequence[str] = (),
) -> Sweep:
    """Runs a scene with varied keys. The same call resumes an interrupted sweep.

    Parameters
    ----------
    file : path_like
        File of the sweep (TOML): the scene and the keys that vary.
    out : path_like, optional
        Folder of the sweep. Default: ``runs/NAME-sweep``.
    jobs : int, optional
        Points that run at once. Default: one for each core, as many as memory permits.
    atoms, lammps, echo
        As in :func:`run`.
    overwrite : bool
        Replace the tables of another sweep in that folder, and the results of points whose scene has changed.
    arguments : sequence of str
        Further arguments of ``asperity sweep``.

    Raises
    ------
    InputError, NotConverged, LammpsError, ResourceError
        As the program reports them. A point that fails does not stop the others: :func:`open_sweep` then opens the folder.
    """
    options = _options(no_atoms=not atoms, overwrite=bool(overwrite), out=out, jobs=jobs, lammps=lammps)
    return Sweep(_json("sweep", file, *options, *_words(arguments), echo=echo)["out"])


def ensemble(
    scene: Where,
    out: Where | None = None,
    *,
    seeds: str | int | Sequence[int],
    jobs: int | None = None,
    atoms: bool = True,
    overwrite: bool = False,
    lammps: Where | None = None,
    echo: bool | None = None,
    arguments: Sequence[str] = (),
) -> Sweep:
    """Runs a scene for several seeds of its surface. The same call resumes an interrupted ensemble.

    Parameters
    ----------
    scene : path_like
        Scene file (TOML).
    seeds : str, int or sequence of int
        Seeds of the surface: ``"1..12"``, ``"1,5,7"`` or ``[1, 5, 7]``.
    out, jobs, atoms, overwrite, lammps, echo, arguments
        As in :func:`sweep`.

    Raises
    ------
    InputError, NotConverged, LammpsError, ResourceError
        As in :func:`sweep`.
    """
    numbers = [seeds] if isinstance(seeds, int) else seeds
    listed = numbers if isinstance(numbers, str) else ",".join(map(str, numbers))
    options = _options(no_atoms=not atoms, overwrite=bool(overwrite), out=out, seeds=listed, jobs=jobs, lammps=lammps)
    return Sweep(_json("ensemble", scene, *options, *_words(arguments), echo=echo)["out"])


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

    The same call resumes an interrupted measurement.

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
        Time after which no further setting begins, as ``90s``, ``10min`` or ``2h``; what is skipped is listed.
    repeats : int, optional
        Runs of each setting, of which the fastest counts.
    threads, echo
        As in :func:`run`.
    arguments : sequence of str
        Further arguments of ``asperity tradeoff``, such as ``["--atoms", "15x6"]``.

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
    ids = None if methods is None else ",".join(_words(methods, "methods"))
    sides = None if grids is None else ",".join(map(str, grids))
    options = _options(out=out, methods=ids, grids=sides, reference=reference, repeats=repeats, threads=threads, budget=budget)
    return cast("dict[str, Any]", _json("tradeoff", scene, *options, *_words(arguments), echo=echo)["tradeoff"])


def _json(name: str, scene: Where, *words: str, echo: bool | None = None) -> dict[str, Any]:
    """What a command for a scene prints."""
    if not isinstance(scene, (str, os.PathLike)):
        raise InputError(f"{'file' if name == 'sweep' else 'scene'} = {scene!r}; accepted: the path of a file")
    return cast("dict[str, Any]", json.loads(command(name, scene, "--json", *words, echo=echo)))


def _options(**values: Where | float | None) -> list[str]:
    """Options of the command line. True is a switch."""
    given = ((name.replace("_", "-"), value) for name, value in values.items() if value is not None and value is not False)
    texts = ((name, os.fspath(value) if isinstance(value, os.PathLike) else value) for name, value in given)
    return [f"--{name}" if value is True else f"--{name}={value}" for name, value in texts]


def _words(arguments: Sequence[str], name: str = "arguments") -> Sequence[str]:
    if isinstance(arguments, str) or not all(isinstance(word, str) for word in arguments):
        raise InputError(f"{name} = {arguments!r}; accepted: a list of words")
    return arguments
