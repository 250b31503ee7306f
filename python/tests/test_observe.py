"""Observables of maps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import asperity
from asperity import InputError

from conftest import rough


def test_observables_of_a_state_are_those_of_its_maps() -> None:
    state = asperity.solve(rough(), 1.0, pressure=0.1)[0]
    area = asperity.contact_area(state.gap, state.cell)
    assert (area.contact_area, area.perimeter) == (state.contact_area, state.perimeter)
    assert state.clusters().sizes == asperity.clusters(state.contact).sizes
    assert sum(state.clusters().sizes) == state.contact.sum()
    largest = max(state.clusters().sizes)
    assert f"largest {largest} nodes" in repr(state.clusters()) and len(repr(state.clusters())) < 100
    assert state.percolation() == asperity.percolation(state.contact)
    assert 0 < state.hydraulic_gap() < state.mean_gap


def test_distributions_contain_every_node() -> None:
    state = asperity.solve(rough(), 1.0, pressure=0.1)[0]
    gaps = state.gap_distribution(np.linspace(0, state.gap.max() / 2, 20))
    assert np.isclose(gaps.fractions.sum() + gaps.delta + gaps.below + gaps.above, 1, rtol=1e-12)
    assert gaps.delta == state.contact_nodes
    pressures = state.stress_distribution(np.linspace(0, state.stress.max(), 20))
    assert np.isclose(pressures.fractions.sum() + pressures.below + pressures.above, state.contact.mean(), rtol=1e-12)
    assert np.isclose((pressures.density * np.diff(pressures.edges)).sum(), pressures.fractions.sum())


def test_clusters_are_periodic() -> None:
    contact = np.zeros((4, 6), bool)
    contact[0, 0] = contact[3, 5] = True
    assert asperity.clusters(contact, corners=True).sizes == [2]
    assert asperity.clusters(contact, corners=False).sizes == [1, 1]
    assert asperity.clusters(contact.astype(int)).sizes == [2]
    assert asperity.clusters(np.zeros((4, 4), bool)).median_size is None


def test_maps_agree_beyond_chance() -> None:
    state = asperity.solve(rough(), 1.0, pressure=0.1)[0]
    same = asperity.compare_maps(state.contact, state.contact)
    assert (same.aligned.jaccard, same.aligned.kappa, same.best_shift) == (1.0, 1.0, (0, 0))
    assert abs(same.shifted.kappa) < 0.3
    rolled = asperity.compare_maps(np.roll(state.contact, (3, 5), (0, 1)), state.contact)
    assert rolled.best_shift in ((5, 3), (-5, -3))


def test_fields_are_compared_by_their_differences() -> None:
    gap = np.arange(12.0).reshape(3, 4)
    found = asperity.compare_fields(gap - 2, gap)
    assert (found.mean_difference, found.rms_difference, found.largest_difference) == (-2, 2, 2)
    assert found.correlation == pytest.approx(1, abs=1e-12)
    assert asperity.compare_fields(gap.max() - gap, gap).correlation == pytest.approx(-1, abs=1e-12)
    assert asperity.compare_fields(np.ones((3, 4)), gap).correlation is None
    # Their mean is not exact.
    constant = np.full((4, 25), 0.7)
    assert asperity.compare_fields(constant, constant).correlation is None
    assert asperity.compare_fields(constant, np.arange(100.0).reshape(4, 25)).correlation is None


@pytest.mark.parametrize(
    "call",
    [
        lambda: asperity.compare_fields(np.zeros((2, 2)), np.zeros((2, 3))),
        lambda: asperity.compare_fields(np.full((2, 2), np.nan), np.zeros((2, 2))),
        lambda: asperity.clusters(np.zeros((3, 3))),
        lambda: asperity.clusters(np.zeros(3, bool)),
        lambda: asperity.percolation([[2, 0]]),
        lambda: asperity.gap_distribution(np.zeros((2, 2)), 20),
        lambda: asperity.contact_area(np.full((2, 2), np.nan), (1.0, 1.0)),
        lambda: asperity.contact_area(np.zeros((2, 2)), (0.0, 1.0)),
        lambda: asperity.gap_distribution(np.zeros((2, 2)), [1, 0]),
        lambda: asperity.gap_distribution(np.zeros((2, 2)), [1]),
        lambda: asperity.stress_distribution(np.zeros((2, 2)), np.zeros((2, 3), bool), [0, 1]),
        lambda: asperity.compare_maps(np.zeros((2, 2), bool), np.zeros((3, 3), bool)),
        lambda: asperity.hydraulic_gap(np.zeros((0, 2))),
    ],
)
def test_bad_maps_are_refused(call: Any) -> None:
    with pytest.raises(InputError, match="accepted"):
        call()


def test_methods_have_references() -> None:
    listed = asperity.methods()
    assert len({m.id for m in listed}) == len(listed)
    assert all(m.summary and m.criterion for m in listed)
    assert any(m.solves and m.adhesion for m in listed) and any(not m.solves for m in listed)
