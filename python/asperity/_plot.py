"""Figures by matplotlib, which is needed only here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from ._errors import InputError

if TYPE_CHECKING:
    from ._solve import LoadPath


def _label(name: str, unit: str) -> str:
    words = name.replace("_", " ")
    return f"{words} / {unit}" if unit else words


def plot_map(values: npt.NDArray[Any], cell: tuple[float, float], name: str, unit: str, *, ax: Any = None, **options: Any) -> Any:
    """A map with its extents and a colour bar."""
    import matplotlib.pyplot as plt

    axes = plt.subplots()[1] if ax is None else ax
    image = axes.imshow(values, origin="lower", extent=(0, cell[0], 0, cell[1]), **options)
    axes.set_xlabel("x")
    axes.set_ylabel("y")
    if values.dtype != bool:
        axes.figure.colorbar(image, ax=axes, label=_label(name, unit))
    else:
        axes.set_title(name)
    return axes


def plot_curve(path: LoadPath, x: str, y: str, *, ax: Any = None, **options: Any) -> Any:
    """One number of the states over another."""
    import matplotlib.pyplot as plt

    from ._solve import NUMBERS

    if unknown := [name for name in (x, y) if name not in NUMBERS]:
        raise InputError(f"curve = {unknown}; accepted: {', '.join(NUMBERS)}")
    axes = plt.subplots()[1] if ax is None else ax
    for branch in ("loading", "unloading"):
        states = path.branch(branch)
        if states:
            axes.plot([getattr(s, x) for s in states], [getattr(s, y) for s in states], "o-", label=branch, **options)
    first = path.states[0]
    unit = {"mean_pressure": first.pressure_unit, "mean_gap": first.length_unit}
    axes.set_xlabel(_label(x, unit.get(x, "")))
    axes.set_ylabel(_label(y, unit.get(y, "")))
    if path.branch("unloading"):
        axes.legend()
    return axes
