"""Invariances of the contact problem, for surfaces drawn at random."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from hypothesis import given, settings
from hypothesis import strategies as st

from asperity import State, Surface, solve

Map = npt.NDArray[np.float64]

#: Solves converge to 1e-8 of the pressure; means of the fields agree to some times that.
TOLERANCE = 1e-6


def _heights(seed: int) -> Map:
    """Waves up to a quarter of the Nyquist frequency on 32 x 48 nodes."""
    random = np.random.default_rng(seed)
    spectrum = np.zeros((32, 25), complex)
    spectrum[:5, :7] = random.normal(size=(5, 7)) + 1j * random.normal(size=(5, 7))
    return np.asarray(np.fft.irfft2(spectrum, s=(32, 48)), dtype=np.float64)


def _state(heights: Map, pressure: float = 0.05, length: float = 1.5, modulus: float = 1.0) -> State:
    surface = Surface.from_array(heights, length, touching="high-points")
    state: State = solve(surface, modulus, p_star=pressure)[0]
    return state


seeds = st.integers(0, 10_000)
checked: Callable[..., Callable[[Callable[..., None]], Callable[..., None]]] = settings(max_examples=12, deadline=None)


@checked
@given(seeds, st.integers(0, 31), st.integers(0, 47))
def test_rolled_surfaces_have_rolled_states(seed: int, y: int, x: int) -> None:
    heights = _heights(seed)
    one, other = _state(heights), _state(np.roll(heights, (y, x), (0, 1)))
    assert np.isclose(other.mean_gap, one.mean_gap, rtol=TOLERANCE)
    assert np.allclose(np.roll(one.gap, (y, x), (0, 1)), other.gap, rtol=0, atol=1e-5 * np.ptp(heights))


@checked
@given(seeds)
def test_transposed_surfaces_have_transposed_states(seed: int) -> None:
    heights = _heights(seed)
    one, other = _state(heights), _state(heights.T, length=1.0)
    assert np.allclose(one.gap.T, other.gap, rtol=0, atol=1e-5 * np.ptp(heights))


@checked
@given(seeds, st.floats(1e-6, 1e6), st.floats(1e-6, 1e6))
def test_units_cancel(seed: int, length: float, modulus: float) -> None:
    heights = _heights(seed)
    one = _state(heights)
    other = _state(heights * length, length=1.5 * length, modulus=modulus)
    assert np.isclose(other.contact_area, one.contact_area, rtol=TOLERANCE)
    assert np.isclose(other.mean_gap, length * one.mean_gap, rtol=TOLERANCE)
    assert np.isclose(other.pressure, modulus * one.pressure, rtol=TOLERANCE)


@checked
@given(seeds, st.floats(-1e3, 1e3))
def test_offsets_do_not_matter(seed: int, offset: float) -> None:
    heights = _heights(seed)
    assert np.isclose(_state(heights + offset).mean_gap, _state(heights).mean_gap, rtol=TOLERANCE)


@checked
@given(seeds, st.floats(0.01, 0.2))
def test_more_load_closes_the_gap(seed: int, load: float) -> None:
    heights = _heights(seed)
    assert _state(heights, 1.5 * load).mean_gap < _state(heights, load).mean_gap
