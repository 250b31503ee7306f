"""Figures by matplotlib, which is needed only here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from ._errors import InputError, needed

if TYPE_CHECKING:
    from ._solve import LoadPath


def _label(name: str, unit: str) -> str:
    words = name.replace("_", " ")
    return f"{words} / {unit}" if unit else words


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
    axes = needed("matplotlib.pyplot").subplots(layout="constrained")[1] if ax is None else ax
    image = axes.imshow(values, origin="lower", extent=(0, cell[0], 0, cell[1]), **options)
    axes.set_xlabel(_label("x", length_unit))
    axes.set_ylabel(_label("y", length_unit))
    if values.dtype != bool:
        # A bar as tall as the map.
        axes.figure.colorbar(image, ax=axes, label=_label(*quantity), fraction=0.046 * cell[1] / cell[0], pad=0.04)
    else:
        axes.set_title(quantity[0])
    return axes


def plot_curve(path: LoadPath, x: str, y: str, *, ax: Any = None, **options: Any) -> Any:
    """One number of the states over another."""
    from ._solve import NUMBERS

    if unknown := [name for name in (x, y) if name not in NUMBERS]:
        raise InputError(f"curve = {unknown}; accepted: {', '.join(NUMBERS)}")
    axes = needed("matplotlib.pyplot").subplots(layout="constrained")[1] if ax is None else ax
    # Unloading starts where loading ends.
    loading, unloading = path.branch("loading"), path.branch("unloading")
    for label, states in (("loading", loading), ("unloading", loading[-1:] + unloading if unloading else ())):
        if states:
            style = {"marker": "o", "label": label} | options
            axes.plot([getattr(s, x) for s in states], [getattr(s, y) for s in states], **style)
    units = path.units
    axes.set_xlabel(_label(x, units.get(x, "")))
    axes.set_ylabel(_label(y, units.get(y, "")))
    if path.branch("unloading"):
        axes.legend()
    return axes
