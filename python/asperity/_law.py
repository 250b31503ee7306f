"""Adhesion laws of the caller."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _asperity
from ._errors import InputError
from ._surface import real


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
        gaps = np.asarray(gap, dtype=np.float64)
        return np.array(self._native.tractions(gaps.ravel().tolist())).reshape(gaps.shape)

    def __reduce__(self) -> tuple[Any, ...]:
        return TabulatedLaw, self._origin

    def __repr__(self) -> str:
        return f"<TabulatedLaw: work of adhesion {self.work_of_adhesion:.6g}, range {self.range:.6g}, error {self.error:.1e}>"
