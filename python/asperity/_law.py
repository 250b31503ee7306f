"""Adhesion: built-in laws, and those of the caller."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _asperity
from ._arguments import fits, real, reals, unmasked
from ._errors import InputError


class TabulatedLaw:
    """An attraction of your own: its traction as a function of the gap, tabulated once.

    Between 257 nodes the traction is a cubic with the values and slopes of its ends; the distance of the nodes grows with the square
    root of the gap. The energy is the exact integral of the table. Pickling needs a function of a module, no lambda.

    Parameters
    ----------
    traction : callable
        Traction at a gap, attraction positive, in the unit of the modulus; the gap is a number in the unit of the surface. It is
        called some thousand times, only here.
    cutoff : float
        Gap from which on there is no traction.

    Attributes
    ----------
    work_of_adhesion : float
        Integral of the traction, in units of modulus times length.
    range : float
        Work of adhesion over the largest traction.
    error : float
        Largest difference between table and `traction`, over the largest traction.

    Raises
    ------
    InputError
        For tractions that are not finite, jump, or have not vanished at the cutoff, and those without a positive work of separation.

    Examples
    --------
    >>> import math, asperity
    >>> law = asperity.TabulatedLaw(lambda gap: 2.0 * math.exp(-gap / 0.02), cutoff=0.4)
    >>> round(law.work_of_adhesion, 6), round(law.range, 6), law.error < 1e-6
    (0.04, 0.02, True)
    """

    def __init__(self, traction: Callable[[float], float], cutoff: float) -> None:
        if not callable(traction):
            raise InputError(f"traction = {traction!r}; accepted: a function of the gap")
        self._origin = (traction, real("cutoff", cutoff))
        self._native = _asperity.TabulatedLaw(lambda gap: real("traction", traction(gap)), self._origin[1])
        self.work_of_adhesion, self.range, self.error = self._native.numbers()

    def __call__(self, gap: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Traction of the table at gaps; at negative gaps that of zero gap."""
        gaps = np.asarray(unmasked("gap", gap))
        # Lists of the numbers before and after.
        fits("gap", gaps.size, 128)
        numbers = reals("gap", gaps.reshape(-1)).tolist() if gaps.size else []
        return np.array(self._native.tractions(numbers)).reshape(gaps.shape)

    def __reduce__(self) -> tuple[Any, ...]:
        return TabulatedLaw, self._origin

    def __repr__(self) -> str:
        return f"<TabulatedLaw: work of adhesion {self.work_of_adhesion:.6g}, range {self.range:.6g}, error {self.error:.1e}>"


@dataclass(frozen=True)
class Adhesion:
    """Attraction between the surfaces.

    Attributes
    ----------
    work_of_adhesion : float
        Work of adhesion γ, in units of modulus times length: with µm and MPa, 0.05 J/m² is 0.05.
    range : float
        Range ρ, in the unit of the surface.
    law : {'exponential', 'dugdale', 'power-9-3'} or TabulatedLaw
        Decay of the attraction with the gap. A table gives the shape, which is scaled to the work and the range.
    resolution : {'mesh', 'true', 'extrapolate'}
        Where the grid does not resolve the range, ``mesh`` takes the shortest range that it resolves, ``true`` takes the range as
        it is, and ``extrapolate`` solves with three longer ranges and extrapolates.
    """

    work_of_adhesion: float
    range: float
    law: str | TabulatedLaw = "exponential"
    resolution: str = "mesh"

    @classmethod
    def from_traction(cls, traction: Callable[[float], float], cutoff: float, *, resolution: str = "mesh") -> Adhesion:
        """An attraction of your own from its traction, which is tabulated up to the gap `cutoff`: see :class:`TabulatedLaw`.

        Examples
        --------
        >>> import asperity
        >>> cohesive = asperity.Adhesion.from_traction(lambda gap: 2.0 * max(1 - gap / 0.1, 0), cutoff=0.1)
        >>> round(cohesive.work_of_adhesion, 9)
        0.1
        """
        law = TabulatedLaw(traction, cutoff)
        return cls(law.work_of_adhesion, law.range, law, resolution)


def adhesion_settings(adhesion: Adhesion | None) -> dict[str, Any]:
    """An adhesion as the compiled part takes it."""
    match adhesion:
        case None:
            return {"adhesion": None, "law": "exponential", "table": None, "resolution": "mesh"}
        case Adhesion(work, reach, law, resolution):
            numbers = (real("work_of_adhesion", work), real("range", reach))
            word, table = ("exponential", law._native) if isinstance(law, TabulatedLaw) else (law, None)
            return {"adhesion": numbers, "law": word, "table": table, "resolution": resolution}
        case other:
            raise InputError(f"adhesion = {other!r}; accepted: an Adhesion, or None")
