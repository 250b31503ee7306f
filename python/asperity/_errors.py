"""Exceptions: one class for each exit code of the program, with the same messages."""

from __future__ import annotations

import importlib
from typing import Any


class AsperityError(Exception):
    """Base class of the exceptions of asperity.

    Attributes
    ----------
    load_path : LoadPath or None
        The states that were solved before the error, from :func:`asperity.solve`.
    """

    # Of any type: the module of LoadPath imports this one.
    load_path: Any = None


class InputError(AsperityError, ValueError):
    """A value, file or scene that is not accepted; exit code 2 of the program."""


class NotConverged(AsperityError, RuntimeError):
    """A solver stopped before it reached its tolerance; exit code 3."""


class LammpsError(AsperityError, RuntimeError):
    """LAMMPS was started and failed; exit code 4."""


class ResourceError(AsperityError, RuntimeError):
    """Too little memory or disk, or a program that is missing; exit code 5."""


class AsperityWarning(UserWarning):
    """A result or an input that deserves attention: the problem is solved as given."""


#: Classes by exit code of the program.
CLASSES: dict[int, type[AsperityError]] = {2: InputError, 3: NotConverged, 4: LammpsError, 5: ResourceError}


#: Extras of the package that install what `all` does not.
EXTRAS = {"SurfaceTopography": "files", "tamaas": "peers", "ContactMechanics": "peers"}


def needed(package: str) -> Any:
    """An optional package.

    Raises
    ------
    ImportError
        With what installs it.
    """
    try:
        return importlib.import_module(package)
    except ImportError as error:
        name = package.partition(".")[0]
        extra = EXTRAS.get(name, "all")
        raise ImportError(f'{name} is needed for this; `pip install {name}`, or `pip install "asperity[{extra}]"`') from error
