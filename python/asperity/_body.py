"""Elastic bodies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

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
