"""Exceptions: one class for each exit code of the program, with the same messages."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._solve import LoadPath


class AsperityError(Exception):
    """Base class of the exceptions of asperity.

    Attributes
    ----------
    load_path : LoadPath or None
        The states that were solved before the error, from :func:`asperity.solve`.
    """

    load_path: LoadPath | None = None


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
