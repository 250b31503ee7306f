"""The same problem in Tamaas and ContactMechanics, independent programs; topographies of SurfaceTopography."""

from __future__ import annotations

import importlib.util
import warnings

import numpy as np
import pytest

import asperity
from asperity import InputError, Surface, peers

from conftest import needs, rough

#: Largest difference of gap and pressure over their means. All solve to 1e-9 and better.
EQUAL = 1e-8


@pytest.mark.parametrize("pressure", [0.01, 0.1])
@pytest.mark.parametrize("peer", [peers.tamaas, peers.contact_mechanics], ids=["tamaas", "ContactMechanics"])
def test_fields_are_those_of_other_programs(peer: peers.Peer, pressure: float) -> None:
    _needs_peers()
    # Oblong, with another modulus than 1.
    surface = Surface.from_array(np.tile(rough(40).heights, (2, 1)), 1.0, touching="low-points")
    state = asperity.solve(surface, 2.5, pressure=2.5 * pressure, tolerance=1e-11)[0]
    found = peer(surface, 2.5, 2.5 * pressure)
    assert found.gap is not None and found.stress is not None and found.contact is not None
    assert abs(found.stress - state.stress).max() < 10 * EQUAL * state.pressure
    assert abs(found.gap - state.gap).max() < EQUAL * state.mean_gap
    assert (found.contact == state.contact).mean() > 0.999


def test_the_comparison_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    _needs_peers()
    peers.main(["32"])
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[-3:]] == ["asperity", "Tamaas", "ContactMechanics"]


def test_bad_arguments_of_peers_are_refused() -> None:
    _needs_peers()
    with pytest.raises(InputError, match="even numbers"):
        peers.tamaas(rough(33), 1.0, 0.1)
    with pytest.raises(InputError, match="accepted: a Surface"):
        peers.contact_mechanics(rough(32).heights, 1.0, 0.1)  # type: ignore[arg-type]


def test_topographies_keep_axes_sizes_and_unit() -> None:
    _needs_peers()
    from SurfaceTopography import Topography

    heights = np.random.default_rng(7).normal(size=(36, 24))
    topography = Topography(heights, physical_sizes=(36.0, 24.0), unit="um", periodic=True)
    surface = Surface.from_topography(topography)
    assert (surface.shape, surface.cell, surface.unit, surface.periodic) == ((24, 36), (36.0, 24.0), "um", True)
    assert np.allclose(surface.heights, heights.max() - heights.T, rtol=0, atol=1e-14)


def _needs_peers() -> None:
    needs("python", all(map(importlib.util.find_spec, ("tamaas", "ContactMechanics", "SurfaceTopography"))))
    with warnings.catch_warnings():
        # Of NuMPI, which finds no MPI.
        warnings.simplefilter("ignore")
        import ContactMechanics  # noqa: F401
