"""Adhesion laws and observables of the caller."""

from __future__ import annotations

import copy
import math
import pickle
from typing import Any

import numpy as np
import pytest

import asperity
from asperity import Adhesion, InputError, State, TabulatedLaw, solve

from conftest import rough

WORK, RANGE = 8e-3, 2e-2


def exponential(gap: float) -> float:
    return WORK / RANGE * math.exp(-gap / RANGE)


def barrier(gap: float) -> float:
    """Attraction near contact, repulsion beyond."""
    return exponential(gap) - 0.1 * WORK / RANGE * math.exp(-(((gap - 3 * RANGE) / RANGE) ** 2))


def test_a_table_of_the_exponential_law_is_the_exponential_law() -> None:
    surface, loads = rough(64), [0.02, 0.1, 0.02]
    built_in = solve(surface, 1.0, pressure=loads, adhesion=Adhesion(WORK, RANGE))
    own = solve(surface, 1.0, pressure=loads, adhesion=Adhesion.from_traction(exponential, 30 * RANGE))
    for one, other in zip(built_in, own):
        assert abs(one.gap - other.gap).max() < 1e-6 * one.mean_gap
        assert np.isclose(one.energy, other.energy, rtol=1e-6)


def test_tables_state_their_error() -> None:
    law = TabulatedLaw(exponential, 30 * RANGE)
    gaps = np.linspace(0, 29 * RANGE, 2001)
    error = abs(law(gaps) - [exponential(g) for g in gaps]).max() / exponential(0)
    assert 0 < error < 1.5 * law.error < 1e-6
    assert np.isclose([law.work_of_adhesion, law.range], [WORK, RANGE], rtol=1e-6).all()
    assert law(-1.0) == law(0.0) and law(100.0) == 0
    assert "error" in repr(law)


def test_tables_are_scaled_like_other_laws() -> None:
    surface, law = rough(64), TabulatedLaw(lambda gap: math.exp(-gap), 30.0)
    scaled = solve(surface, 1.0, pressure=0.02, adhesion=Adhesion(WORK, RANGE, law))[0]
    assert np.isclose(scaled.mean_gap, solve(surface, 1.0, pressure=0.02, adhesion=Adhesion(WORK, RANGE))[0].mean_gap, rtol=1e-6)


@pytest.mark.parametrize("method", ["fast", "gfmd", "bvm"])
def test_solvers_agree_on_a_law_with_a_barrier(method: str) -> None:
    adhesion = Adhesion.from_traction(barrier, 12 * RANGE)
    state, reference = (solve(rough(48), 1.0, pressure=0.05, adhesion=adhesion, method=m, tolerance=1e-9)[0] for m in (method, "fast"))
    assert np.isclose(state.mean_gap, reference.mean_gap, rtol=1e-6)
    assert np.isclose(state.energy, reference.energy, rtol=1e-6)


def test_pull_off_of_an_own_law_is_that_of_the_built_in_one() -> None:
    surface, law = rough(32), TabulatedLaw(exponential, 30 * RANGE)
    found = [
        solve(surface, 1.0, pressure=0.05, adhesion=Adhesion(WORK / 2, RANGE, shape), pull_off=True).pull_off
        for shape in ("exponential", law)
    ]
    assert found[0] is not None and found[1] is not None
    assert np.isclose(found[0].pressure, found[1].pressure, rtol=1e-5)


@pytest.mark.parametrize(
    ("traction", "cutoff", "words"),
    [
        (exponential, 2 * RANGE, "cutoff.*accepted"),
        (exponential, -1.0, "cutoff.*positive"),
        (exponential, "far", "cutoff.*number"),
        (lambda gap: float(gap < RANGE), 2 * RANGE, "continuous"),
        (lambda gap: -exponential(gap), 30 * RANGE, "positive work"),
        (lambda gap: float("nan"), 1.0, "finite"),
        (lambda gap: "much", 1.0, "traction = 'much'"),
        (3.0, 1.0, "a function of the gap"),
    ],
)
def test_what_is_no_law_is_refused(traction: Any, cutoff: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        TabulatedLaw(traction, cutoff)


def test_exceptions_of_a_law_reach_the_caller() -> None:
    with pytest.raises(ZeroDivisionError):
        TabulatedLaw(lambda gap: 1 / (gap * 0), 1.0)


def test_methods_that_need_a_closed_form_refuse_tables() -> None:
    adhesion = Adhesion.from_traction(exponential, 30 * RANGE)
    for method in ("fft-ia", "bicgstab", "ms-archard"):
        with pytest.raises(InputError, match="adhesion.*accepted"):
            asperity.estimate(rough(32), 1.0, 0.05, method=method, adhesion=adhesion)


def test_laws_are_copied() -> None:
    law = TabulatedLaw(exponential, 30 * RANGE)
    for twin in (pickle.loads(pickle.dumps(law)), copy.deepcopy(law)):
        assert (twin.work_of_adhesion, twin.range, twin.error) == (law.work_of_adhesion, law.range, law.error)


def _widest(state: State) -> float:
    return float(state.gap.max())


def test_observables_are_evaluated_for_every_state() -> None:
    path = solve(rough(32), 1.0, p_star=[0.02, 0.05], observables={"widest": _widest, "clusters": lambda s: len(s.clusters().sizes)})
    assert [s.observed["widest"] for s in path] == [s.gap.max() for s in path]
    assert path.curve["widest"].tolist() == [s.gap.max() for s in path]
    assert path.dataset["clusters"].values.tolist() == [len(s.clusters().sizes) for s in path]
    assert path.plot_curve(y="widest").get_ylabel() == "widest"
    assert "widest" in path._repr_html_()
    assert pickle.loads(pickle.dumps(path))[1].observed == path[1].observed


def test_exceptions_of_observables_end_the_path_and_keep_its_states() -> None:
    def fails(state: State) -> float:
        raise LookupError("no such thing")

    with pytest.raises(LookupError) as caught:
        solve(rough(32), 1.0, p_star=[0.02, 0.05], observables={"bad": fails})
    assert len(caught.value.load_path) >= 1  # type: ignore[attr-defined]
    assert "bad" not in caught.value.load_path[0].observed  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("observables", "words"),
    [([_widest], "accepted"), ({"x": 3}, "accepted"), ({"gap": _widest}, "gap"), ({"text": lambda s: "wide"}, "text = 'wide'")],
)
def test_bad_observables_are_refused(observables: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        solve(rough(32), 1.0, p_star=0.02, observables=observables)
