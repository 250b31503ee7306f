"""Stress below the surface: equality with the program, units, bodies, refusals."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import asperity
from asperity import Cubic, InputError, Layer, NonPeriodic, Surface, solve

from conftest import rough

#: Of the largest value: the program takes the solver's pressure, which off contact is zero only to the tolerance of 1e-8.
OFF_CONTACT = 1e-8


@pytest.mark.parametrize("body", [None, Layer(0.3, 0.2), NonPeriodic()])
def test_stresses_are_those_of_the_program(tmp_path: Path, body: Any) -> None:
    np.save(tmp_path / "h.npy", rough(64).heights)
    poisson = None if isinstance(body, Layer) else 0.3
    more = ["--poisson", "0.3", *(["--non-periodic"] if body == NonPeriodic() else [])]
    if poisson is None:
        more = ["--thickness", "0.3", "--poisson", "0.2"]
    out = tmp_path / "out"
    given = ["--touching", "low-points", "--length", "1", "--modulus", "2", "--pressure", "0.04", "--subsurface", "0,0.05", "--out", str(out)]
    line = json.loads(asperity.command("solve", tmp_path / "h.npy", "--json", *given, *more).splitlines()[0])
    surface = Surface.from_array(np.load(tmp_path / "h.npy"), 1.0, touching="low-points", periodic=body != NonPeriodic())
    state = solve(surface, 2.0, pressure=0.04, body=body)[0]
    found = state.subsurface([0.0, 0.05], poisson=poisson)
    assert [s.depth for s in found] == [0.0, 0.05]
    for k, (ours, slice_) in enumerate(zip(found, line["subsurface"]["slices"], strict=True)):
        for name, key in (("von-mises", "von_mises"), ("shear", "shear")):
            stress, peak = getattr(ours, key), slice_[key]
            stored = np.load(out / f"{name}-depth-{k + 1}.npy")
            assert np.allclose(stress.values, stored, rtol=0, atol=OFF_CONTACT * peak["value"])
            assert np.isclose(stress.max, peak["value"], rtol=OFF_CONTACT)
            assert stress.at == (peak["x"], peak["y"])


def test_lengths_and_stresses_have_the_units_of_the_caller() -> None:
    heights = rough(32).heights
    one = solve(Surface.from_array(heights, 1.0, touching="low-points"), 1.0, pressure=0.05)[0]
    many = solve(Surface.from_array(7 * heights, 7.0, touching="low-points"), 3.0, pressure=0.15)[0]
    a, b = one.subsurface(0.03, poisson=0.3)[0], many.subsurface(7 * 0.03, poisson=0.3)[0]
    assert np.allclose(3 * a.shear.values, b.shear.values, rtol=1e-6)
    assert np.allclose(7 * np.array(a.shear.at), b.shear.at)
    assert b.shear.values[tuple(round(at / 7 * 32) for at in reversed(b.shear.at))] == b.shear.max == b.shear.values.max()


def test_bodies_are_kept_with_the_state(surface: Surface) -> None:
    layer = Layer(0.05, 0.45)
    state = pickle.loads(pickle.dumps(solve(surface, 1.0, pressure=0.05, body=layer)[0]))
    assert state.body == layer
    below = state.subsurface(0.02)[0].von_mises.max
    assert below != state.__class__.subsurface(solve(surface, 1.0, pressure=0.05)[0], 0.02, poisson=0.45)[0].von_mises.max
    with pytest.raises(ValueError, match="read-only"):
        state.subsurface(0.02)[0].shear.values[0, 0] = 1.0


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"depths": -0.1, "poisson": 0.3}, "depths = -0.1"),
        ({"depths": [], "poisson": 0.3}, "depths = "),
        ({"depths": "deep", "poisson": 0.3}, "depths = 'deep'"),
        ({"depths": 0.1}, "poisson = not given"),
        ({"depths": 0.1, "poisson": 0.7}, "from 0 to 0.5"),
        ({"depths": 0.1, "poisson": 0.3, "body": Cubic(2.0, 1.0, 1.0)}, "isotropic"),
        ({"depths": 0.3, "body": Layer(0.2, 0.3)}, "0 to 0.2"),
        ({"depths": 0.1, "poisson": 0.3, "body": Layer(0.2, 0.3)}, "the layer's own, 0.3"),
    ],
)
def test_bad_values_are_refused(values: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        asperity.subsurface(np.ones((8, 8)), (1.0, 1.0), **values)


def test_maps_that_are_not_finite_are_refused() -> None:
    with pytest.raises(InputError, match="pressure = "):
        asperity.subsurface(np.full((8, 8), np.nan), (1.0, 1.0), 0.1, poisson=0.3)
