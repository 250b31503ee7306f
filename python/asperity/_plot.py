"""Figures by matplotlib, which is needed only here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy.typing as npt

from ._errors import InputError, needed
from ._html import label


def _axes(ax: Any) -> Any:
    return needed("matplotlib.pyplot").subplots(layout="constrained")[1] if ax is None else ax


def plot_map(
    values: npt.NDArray[Any],
    cell: tuple[float, float],
    quantity: tuple[str, str],
    length_unit: str,
    *,
    ax: Any = None,
    **options: Any,
) -> Any:
    """A map with its extents and a colour bar of its quantity, given by name and unit."""
    axes = _axes(ax)
    image = axes.imshow(values, origin="lower", extent=(0, cell[0], 0, cell[1]), **options)
    axes.set_xlabel(label("x", length_unit))
    axes.set_ylabel(label("y", length_unit))
    if values.dtype != bool:
        # A bar as tall as the map.
        axes.figure.colorbar(image, ax=axes, label=label(*quantity), fraction=0.046 * cell[1] / cell[0], pad=0.04)
    else:
        axes.set_title(quantity[0])
    return axes


def plot_curve(
    numbers: Mapping[str, Sequence[Any]], x: str, y: str, units: Mapping[str, str], *, ax: Any = None, **options: Any
) -> Any:
    """One number of states over another, one line for each branch."""
    if unknown := [name for name in (x, y) if name not in numbers]:
        raise InputError(f"curve = {unknown}; accepted: {', '.join(numbers)}")
    axes = _axes(ax)
    branches = numbers["branch"]
    loading, unloading = ([i for i, branch in enumerate(branches) if branch == name] for name in ("loading", "unloading"))
    # Unloading starts where loading ends.
    for name, states in (("loading", loading), ("unloading", loading[-1:] + unloading if unloading else [])):
        if states:
            axes.plot([numbers[x][i] for i in states], [numbers[y][i] for i in states], **{"marker": "o", "label": name} | options)
    axes.set_xlabel(label(x, units.get(x, "")))
    axes.set_ylabel(label(y, units.get(y, "")))
    if unloading:
        axes.legend()
    return axes


def plot_functions(surface: Any, *, axes: Any = None) -> Any:
    """Profile spectra and scale-dependent slopes of a surface, on logarithmic axes."""
    if axes is None:
        axes = needed("matplotlib.pyplot").subplots(1, 2, layout="constrained", figsize=(9, 4))[1]
    spectra, slopes = axes
    unit = surface.unit
    for axis in ("x", "y"):
        spectra.loglog(*surface.power_spectrum(axis), label=f"along {axis}")
        differences = surface.scale_dependent(axis)
        slopes.loglog(differences["distance"], differences["slope"], marker=".", label=f"along {axis}")
    spectra.set_xlabel(label("wave number", f"1/{unit}" if unit else ""))
    spectra.set_ylabel(label("C1D", f"{unit}³" if unit else ""))
    slopes.set_xlabel(label("distance", unit))
    slopes.set_ylabel("rms slope over the distance")
    for each in axes:
        each.legend()
    return axes
