"""Stress below the surface of an isotropic body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from . import _asperity
from ._arguments import Map, extents, finite_map, real, reals
from ._body import Body, body_settings


@dataclass(frozen=True, eq=False)
class StressMap:
    """A stress at all nodes of a depth, and its maximum.

    Attributes
    ----------
    values : ndarray, shape (ny, nx)
        Values in the unit of the pressure.
    max : float
        The largest of them.
    at : tuple of float
        Where it is, along x and along y, in the unit of the cell.
    """

    values: Map
    max: float
    at: tuple[float, float]


@dataclass(frozen=True, eq=False)
class SubsurfaceStress:
    """Stresses at a depth.

    Attributes
    ----------
    depth : float
        Depth, in the unit of the cell.
    von_mises : StressMap
        Equivalent stress after von Mises.
    shear : StressMap
        Largest shear stress: half the difference of the largest and the smallest principal stress.
    """

    depth: float
    von_mises: StressMap
    shear: StressMap


def subsurface(
    pressure: npt.ArrayLike,
    cell: tuple[float, float],
    depths: float | Sequence[float],
    *,
    poisson: float | None = None,
    body: Body | None = None,
) -> list[SubsurfaceStress]:
    """Stresses in an isotropic body below a pressure map.

    Parameters
    ----------
    pressure : array_like, shape (ny, nx)
        Interfacial pressure, compression positive. Stresses have its unit.
    cell : tuple of float
        Extents along x and along y.
    depths : float or sequence of float
        Depths from 0 to the thickness of a layer, in the unit of the cell.
    poisson : float, optional
        Poisson's ratio of a half-space, from 0 to 0.5; a layer has its own.
    body : Layer or NonPeriodic, optional
        The elastic body. Default: a half-space under a periodic surface, whose mean strain along the surface is zero.

    Returns
    -------
    list of SubsurfaceStress
        One for each depth.

    Raises
    ------
    InputError
        For a depth outside of the body, a Poisson's ratio that is not accepted, and a crystal.

    Examples
    --------
    Below p cos(qx) the largest shear stress is p qz exp(-qz), whose maximum is p/e:

    >>> import numpy as np, asperity
    >>> q = 2 * np.pi
    >>> pressure = np.tile(np.cos(q * np.arange(16) / 16), (16, 1))
    >>> below = asperity.subsurface(pressure, (1.0, 1.0), 1 / q, poisson=0.3)[0]
    >>> round(below.shear.max * np.e, 9)
    1.0
    """
    numbers = reals("depths", depths).tolist()
    ratio = None if poisson is None else real("poisson", poisson)
    stresses = _asperity.subsurface(finite_map("pressure", pressure), extents("cell", cell), body_settings(body), numbers, ratio)

    def stress(values: Map, largest: float, at: list[float]) -> StressMap:
        return StressMap(values, largest, (at[0], at[1]))

    return [SubsurfaceStress(depth, stress(*a), stress(*b)) for depth, (a, b) in zip(numbers, stresses, strict=True)]
