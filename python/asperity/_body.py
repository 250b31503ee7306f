"""Elastic bodies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from . import _asperity
from ._arguments import real
from ._errors import InputError


@dataclass(frozen=True)
class Layer:
    """An isotropic elastic layer on a rigid base; `base` is ``bonded`` or ``constant-stress``."""

    thickness: float
    poisson: float
    base: str = "bonded"


@dataclass(frozen=True)
class Cubic:
    """A cubic crystal with an (001) face and x along [100]. Only the ratios of the constants matter."""

    c11: float
    c12: float
    c44: float


@dataclass(frozen=True)
class NonPeriodic:
    """An isotropic half-space under a surface that does not repeat, free outside of the map."""


Body = Layer | Cubic | NonPeriodic


def contact_modulus(*bodies: tuple[float, float]) -> float:
    """Contact modulus E* of one elastic body against a rigid one, or of two: 1/E* = Σ (1-ν²)/E.

    Parameters
    ----------
    bodies : pairs of float
        Young's modulus, in any unit, and Poisson's ratio.

    Returns
    -------
    float
        In the unit of the moduli. The share of a body in the deformation is this over ``contact_modulus(body)``.

    Raises
    ------
    InputError
        For values that are not accepted.

    Examples
    --------
    >>> import asperity
    >>> round(asperity.contact_modulus((2.0, 0.5), (70.0, 0.3)), 3)
    2.577
    """
    if not 1 <= len(bodies) <= 2 or not all(isinstance(body, (tuple, list)) and len(body) == 2 for body in bodies):
        raise InputError(f"bodies = {bodies!r}; accepted: one or two pairs of Young's modulus and Poisson's ratio")
    pairs = [(real("young", young), real("poisson", poisson)) for young, poisson in bodies]
    for young, poisson in pairs:
        if not young > 0:
            raise InputError(f"young = {young!r}; accepted: a positive number")
        if not 0 <= poisson <= 0.5:
            raise InputError(f"poisson = {poisson!r}; accepted: 0 to 0.5")
    return _asperity.contact_modulus(pairs)


def body_settings(body: Body | None) -> dict[str, Any]:
    """A body as the compiled part takes it."""
    settings: dict[str, Any] = {"kind": "half-space", "thickness": 0.0, "poisson": 0.0, "base": None, "constants": [0.0] * 3}
    match body:
        case None:
            pass
        case Layer(thickness, poisson, base):
            settings |= {"kind": "layer", "thickness": real("thickness", thickness), "poisson": real("poisson", poisson), "base": base}
        case Cubic(c11, c12, c44):
            settings |= {"kind": "cubic", "constants": [real("c11", c11), real("c12", c12), real("c44", c44)]}
        case NonPeriodic():
            settings |= {"kind": "non-periodic"}
        case other:
            raise InputError(f"body = {other!r}; accepted: Layer, Cubic, NonPeriodic, or None for a half-space")
    return settings
