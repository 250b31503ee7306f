"""Checks of arguments: numbers, and maps ``[ny, nx]``. Messages name the argument."""

from __future__ import annotations

import operator
import os
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from . import _asperity
from ._errors import InputError

Map = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


#: Values from which on memory is planned.
MANY = 1 << 20


def a_path(name: str, value: str | os.PathLike[str]) -> Path:
    """The path of a file or folder."""
    if not isinstance(value, (str, os.PathLike)):
        raise InputError(f"{name} = {value!r}; accepted: a path, as text or of pathlib")
    return Path(value).expanduser()


def positive(name: str, value: float) -> float:
    """A number above zero."""
    if not (number := real(name, value)) > 0:
        raise InputError(f"{name} = {value!r}; accepted: a number above zero")
    return number


def real(name: str, value: float) -> float:
    """A number."""
    try:
        # Scalars and arrays of numpy hand out a number for text, for the real part of a complex number, and for a time.
        if isinstance(value, (str, bytes, bool)) or getattr(getattr(value, "dtype", None), "kind", "f") not in "fiuO":
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise InputError(f"{name} = {value!r}; accepted: a number") from None


def whole(name: str, value: int, least: int, most: int = 2**64 - 1) -> int:
    """A whole number in a range."""
    try:
        number = least - 1 if isinstance(value, bool) else operator.index(value)
    except TypeError:
        number = least - 1
    if not least <= number <= most:
        raise InputError(f"{name} = {value!r}; accepted: a whole number from {least} {'on' if most == 2**64 - 1 else f'to {most}'}")
    return number


def fits(name: str, count: int, each: int) -> None:
    """Refuses `count` values whose copies, `each` bytes for each value, memory cannot hold."""
    if count > MANY:
        _asperity.expect_memory(f"{name} = {count} values", min(count * each, 2**64 - 1))


def reals(name: str, values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """A number, or a sequence of them, as an array of one dimension."""
    try:
        array = np.atleast_1d(np.asarray(unmasked(name, values)))
    except ValueError:
        # Rows of different lengths.
        array = np.empty(1, object)
    if array.ndim == 1 and array.size and array.dtype.kind in "fiu":
        # The array, a list of numbers, and the vector of the compiled part.
        fits(name, array.size, 64)
        return array.astype(np.float64)
    given = "no values" if array.size == 0 else f"an array of shape {array.shape}" if array.ndim > 1 else repr(values)
    raise InputError(f"{name} = {given}; accepted: a number or a sequence of numbers")


def unmasked(name: str, values: npt.ArrayLike) -> npt.ArrayLike:
    """The values, none of which may be masked."""
    if np.ma.is_masked(values):
        raise InputError(f"{name} = an array with masked values; accepted: an array without")
    return values


def rows_first(values: npt.ArrayLike) -> npt.ArrayLike:
    """The values with y as the first axis, where they are an array of xarray, which names its axes."""
    if set(getattr(values, "dims", ())) == {"x", "y"}:
        labelled: Any = values
        return cast(npt.ArrayLike, labelled.transpose("y", "x"))
    return values


def real_map(name: str, values: npt.ArrayLike, each: int = 24) -> Map:
    """A real map; not copied where it has 64-bit floating-point numbers already. `each`: see :func:`fits`."""
    if np.ma.isMaskedArray(values):
        # The stubs of numpy lose the mask in `astype`.
        masked: Any = values
        fits(name, masked.size, each + 8)
        values = masked.astype(np.float64).filled(np.nan)
    try:
        array = np.asarray(rows_first(values))
    except ValueError as error:
        raise InputError(f"{name} = rows of different lengths ({error}); accepted: real numbers [ny, nx]") from None
    if array.ndim != 2 or array.size == 0 or array.dtype.kind not in "fiu":
        raise InputError(f"{name} = an array of shape {array.shape} and type {array.dtype}; accepted: real numbers [ny, nx]")
    fits(name, array.size, each)
    return np.asarray(array, dtype=np.float64)


def finite_map(name: str, values: npt.ArrayLike) -> Map:
    """A map without missing values."""
    array = real_map(name, values)
    if not np.isfinite(array).all():
        raise InputError(f"{name} = an array with values that are not finite; accepted: finite numbers")
    return array


def flag_map(name: str, values: npt.ArrayLike, each: int = 64) -> Flags:
    """A map of bool, or of 0 and 1. `each`: see :func:`fits`."""
    array = np.asarray(rows_first(unmasked(name, values)))
    fits(name, array.size, each)
    if array.dtype == np.bool_:
        # A bool of a file may have any bits.
        array = array.view(np.uint8) != 0
    binary = array.dtype.kind in "iub" and bool(((array == 0) | (array == 1)).all())
    if array.ndim != 2 or array.size == 0 or not binary:
        raise InputError(f"{name} = an array of shape {array.shape} and type {array.dtype}; accepted: bool, or 0 and 1, [ny, nx]")
    return np.asarray(array != 0)


def extents(name: str, values: tuple[float, float]) -> tuple[float, float]:
    """Extents of a cell along x and along y."""
    x, y = values
    if not (0 < x < np.inf and 0 < y < np.inf):
        raise InputError(f"{name} = {values!r}; accepted: positive extents along x and y")
    return real(name, x), real(name, y)
