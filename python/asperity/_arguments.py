"""Checks of arguments: numbers, and maps ``[ny, nx]``. Messages name the argument."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import InputError

Map = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


def real(name: str, value: float) -> float:
    """A number."""
    try:
        if isinstance(value, (str, bytes, bool)):
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


def reals(name: str, values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """A number, or a sequence of them, as an array of one dimension."""
    try:
        array = np.atleast_1d(np.asarray(values))
    except ValueError:
        # Rows of different lengths.
        array = np.empty(1, object)
    if array.ndim == 1 and array.size and array.dtype.kind in "fiu":
        return array.astype(np.float64)
    given = "no values" if array.size == 0 else f"an array of shape {array.shape}" if array.ndim > 1 else repr(values)
    raise InputError(f"{name} = {given}; accepted: a number or a sequence of numbers")


def real_map(name: str, values: npt.ArrayLike) -> Map:
    """A real map; not copied where it has 64-bit floating-point numbers already."""
    if np.ma.isMaskedArray(values):
        # The stubs of numpy lose the mask in `astype`.
        masked: Any = values
        values = masked.astype(np.float64).filled(np.nan)
    if set(getattr(values, "dims", ())) == {"x", "y"}:
        # An array of xarray names its axes.
        labelled: Any = values
        values = labelled.transpose("y", "x")
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise InputError(f"{name} = rows of different lengths ({error}); accepted: real numbers [ny, nx]") from None
    if array.ndim != 2 or array.size == 0 or array.dtype.kind not in "fiu":
        raise InputError(f"{name} = an array of shape {array.shape} and type {array.dtype}; accepted: real numbers [ny, nx]")
    return np.asarray(array, dtype=np.float64)


def finite_map(name: str, values: npt.ArrayLike) -> Map:
    """A map without missing values."""
    array = real_map(name, values)
    if not np.isfinite(array).all():
        raise InputError(f"{name} = an array with values that are not finite; accepted: finite numbers")
    return array


def flag_map(name: str, values: npt.ArrayLike) -> Flags:
    """A map of bool, or of 0 and 1."""
    array = np.asarray(values)
    binary = array.dtype == np.bool_ or array.dtype.kind in "iu" and bool(np.isin(array, (0, 1)).all())
    if array.ndim != 2 or array.size == 0 or not binary:
        raise InputError(f"{name} = an array of shape {array.shape} and type {array.dtype}; accepted: bool, or 0 and 1, [ny, nx]")
    return array.astype(np.bool_, copy=False)


def extents(name: str, values: tuple[float, float]) -> tuple[float, float]:
    """Extents of a cell along x and along y."""
    x, y = values
    if not (0 < x < np.inf and 0 < y < np.inf):
        raise InputError(f"{name} = {values!r}; accepted: positive extents along x and y")
    return real(name, x), real(name, y)
