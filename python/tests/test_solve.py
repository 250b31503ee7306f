"""Load paths: values, equality with the program, errors, interrupts, threads."""

from __future__ import annotations

import json
import os
import pickle
import signal
import threading
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import asperity
from asperity import Adhesion, AsperityWarning, Cubic, InputError, Layer, LoadPath, NonPeriodic, NotConverged, State, Surface, solve

from asperity._errors import needed

from conftest import rough

#: Seconds after which an interrupted solve has returned; the issue is a prompt that waits.
PROMPT = 1.0


def test_states_balance_the_load(surface: Surface) -> None:
    state = solve(surface, 2.0, pressure=0.1)[0]
    assert np.isclose(state.stress.mean(), 0.1, rtol=1e-8)
    assert np.isclose(state.gap.mean(), state.mean_gap, rtol=1e-12)
    assert (state.gap >= 0).all() and np.array_equal(state.contact, state.gap == 0)
    assert (state.stress[~state.contact] == 0).all()
    assert state.contact_nodes == state.contact.mean()


def test_states_are_not_writeable(surface: Surface) -> None:
    state = solve(surface, 1.0, pressure=0.1)[0]
    with pytest.raises(ValueError, match="read-only"):
        state.gap[0, 0] = 1.0


def _stored(tmp_path: Path, surface: Surface) -> Path:
    np.save(tmp_path / "h.npy", surface.heights)
    return tmp_path / "h.npy"


def test_fields_have_the_bits_of_the_program(tmp_path: Path) -> None:
    path = _stored(tmp_path, rough(96))
    flags = ["--touching", "low-points", "--length", "1", "--modulus", "1", "--pressure", "0.04", "--out", str(tmp_path / "out")]
    line = json.loads(asperity.command("solve", path, "--json", *flags).splitlines()[0])
    state = solve(Surface.from_array(np.load(path), 1.0, touching="low-points"), 1.0, pressure=0.04)[0]
    assert np.array_equal(state.gap, np.load(tmp_path / "out" / "gap.npy"))
    assert np.array_equal(state.stress, np.load(tmp_path / "out" / "stress.npy"))
    assert (state.contact_area, state.energy) == (line["contact_area"], line["energy"])


def test_adhesive_paths_have_the_bits_of_the_program(tmp_path: Path) -> None:
    path = _stored(tmp_path, rough(64))
    flags = ["--touching", "low-points", "--length", "1", "--modulus", "1", "--pressure", "0.01,0.05,0.01", "--pull-off"]
    flags += ["--work-of-adhesion", "4e-3", "--range", "1.2e-2"]
    lines = [json.loads(line) for line in asperity.command("solve", path, "--json", *flags).splitlines()]
    surface = Surface.from_array(np.load(path), 1.0, touching="low-points")
    adhesion = Adhesion(4e-3, 1.2e-2)
    found = solve(surface, 1.0, pressure=[0.01, 0.05, 0.01], adhesion=adhesion, pull_off=True)
    with pytest.raises(NotConverged, match="load 2 of 2: the tension separates"):
        solve(surface, 1.0, pressure=[0.01, -1.0], adhesion=adhesion)
    assert [s.mean_gap for s in found] == [line["mean_gap"] for line in lines[:3]]
    assert found.pull_off is not None and found.pull_off.pressure == lines[3]["pull_off_pressure"]
    assert [s.branch for s in found] == ["loading", "loading", "unloading"]
    assert found.dissipation() >= 0


@pytest.mark.parametrize(
    "load", [{"pressure": 0.05}, {"p_star": 0.05}, {"mean_gap": 0.02}, {"displacement": 0.02}, {"contact": 0.1}]
)
def test_loads_of_every_kind(surface: Surface, load: dict[str, Any]) -> None:
    kind, value = next(iter(load.items()))
    state = solve(surface, 1.0, **load)[0]
    first_touch = surface.heights.mean()
    found = {
        "pressure": state.pressure,
        "p_star": state.pressure / surface.rms_gradient,
        "mean_gap": state.mean_gap,
        "displacement": first_touch - state.mean_gap,
        "contact": state.contact_area,
    }[kind]
    assert (state.control, state.load) == (kind, value)
    # The contact area is found to one node.
    assert np.isclose(found, value, rtol=1e-6, atol=1.01 / surface.shape[0] ** 2 if kind == "contact" else 0)


def test_units_are_those_of_the_caller() -> None:
    one, other = solve(rough(), 1.0, p_star=0.05)[0], solve(rough(length=1e4), 25.0, p_star=0.05)[0]
    assert np.allclose(other.gap, 1e4 * one.gap, rtol=1e-12, atol=1e-12)
    assert np.allclose(other.stress, 25 * one.stress, rtol=1e-12, atol=1e-12)


def test_bodies_differ(surface: Surface) -> None:
    bodies = (None, Layer(0.05, 0.3), Layer(0.05, 0.3, "constant-stress"), Cubic(2.0, 1.0, 2.0), NonPeriodic())
    areas = [solve(surface, 1.0, pressure=0.05, body=body)[0].contact_area for body in bodies]
    assert len(set(areas)) == len(bodies) and all(0 < a < 1 for a in areas)


def test_single_precision_agrees(surface: Surface) -> None:
    double, single = (solve(surface, 1.0, pressure=0.05, precision=p)[0] for p in ("f64", "f32"))
    assert np.isclose(single.mean_gap, double.mean_gap, rtol=1e-4)


@pytest.mark.parametrize("method", [m.id for m in asperity.methods() if m.solves and m.id not in ("auto", "experiment", "all-atom")])
def test_every_solver_gives_the_same_state(surface: Surface, method: str) -> None:
    reference, other = solve(surface, 1.0, pressure=0.1), solve(surface, 1.0, pressure=0.1, method=method)
    # bem-bspline has another discretisation, bicgstab a wall of finite range.
    tolerance = {"bem-bspline": 0.05, "bicgstab": 0.005}.get(method, 1e-4)
    assert np.isclose(other[0].mean_gap, reference[0].mean_gap, rtol=tolerance)


def test_first_contact_is_one_node_under_no_pressure(surface: Surface) -> None:
    paths = solve(surface, 1.0, displacement=0.0), solve(surface, 1.0, pressure=0.0), solve(surface, 1.0, p_star=0.0)
    for (state,) in paths:
        assert state.contact.sum() == 1 and state.pressure == 0 and state.mean_gap > 0


def test_a_load_far_beyond_full_contact_warns_once(surface: Surface) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        solve(surface, 1.0, pressure=[0.1, 1e4, 1e5])
    assert sum("check the units of load and modulus" in str(w.message) for w in caught) == 1


def test_estimates_say_what_they_do_not_give(surface: Surface) -> None:
    dense = asperity.estimate(surface, 1.0, 0.5, method="icha")
    assert dense.mean_gap is None and "cell" in dense.missing["mean_gap"]


def test_estimates_cover_the_other_methods(surface: Surface) -> None:
    for method in ("persson", "bvm", "winkler"):
        found = asperity.estimate(surface, 1.0, 0.1, method=method)
        assert 0 < found.contact_area < 1 and found.method == method
    with pytest.raises(InputError, match="solves for the fields"):
        solve(surface, 1.0, pressure=0.1, method="persson")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({}, "loads = none"),
        ({"pressure": 0.1, "p_star": 0.1}, "pressure, p_star"),
        ({"pressure": []}, "no values"),
        ({"pressure": "high"}, "pressure = 'high'"),
        ({"pressure": "0.1"}, "pressure = '0.1'"),
        ({"pressure": True}, "pressure = True"),
        ({"pressure": 0.1, "max_iterations": -2}, "max_iterations = -2"),
        ({"pressure": 0.1, "body": Cubic(1.0, 1.0, -1.0)}, "c44"),
        ({"pressure": [[0.1]]}, "shape"),
        ({"pressure": -0.1}, "pressure = -0.1"),
        ({"pressure": np.nan}, "pressure = NaN"),
        ({"mean_gap": -1.0}, "mean_gap = -1"),
        ({"contact": 1.5}, "contact = 1.5"),
        ({"pressure": 0.1, "method": "magic"}, "method"),
        ({"pressure": 0.1, "precision": "f16"}, "f32"),
        ({"pressure": 0.1, "tolerance": -1.0}, "tolerance"),
        ({"pressure": 0.1, "max_iterations": 0}, "max_iterations"),
        ({"pressure": 0.1, "threads": 0}, "threads"),
        ({"pressure": 0.1, "body": "sphere"}, "body"),
        ({"pressure": 0.1, "body": Layer(-1.0, 0.3)}, "thickness"),
        ({"pressure": 0.1, "body": Layer(1.0, 0.7)}, "poisson"),
        ({"pressure": 0.1, "body": Layer(1.0, 0.3, "glued")}, "bonded"),
        ({"pressure": 0.1, "body": Layer("thick", 0.3)}, "thickness"),  # type: ignore[arg-type]
        ({"pressure": 0.1, "adhesion": 0.05}, "Adhesion"),
        ({"pressure": 0.1, "adhesion": Adhesion(-1.0, 1.0)}, "work_of_adhesion"),
        ({"pressure": 0.1, "adhesion": Adhesion(1.0, 0.0)}, "range"),
        ({"pressure": 0.1, "adhesion": Adhesion(1.0, 1.0, "sticky")}, "exponential"),
        ({"pressure": 0.1, "pull_off": True}, "pull_off"),
        ({"pressure": 0.1, "penalty_length": -1.0}, "penalty_length"),
        ({"pressure": 0.1, "initial_gap": np.zeros((3, 3))}, "initial_gap"),
    ],
)
def test_bad_values_are_refused(surface: Surface, values: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as caught:
        solve(surface, 1.0, **values)
    assert words in str(caught.value)


@pytest.mark.parametrize("modulus", [0.0, -1.0, np.nan, "stiff", None])
def test_bad_moduli_are_refused(surface: Surface, modulus: Any) -> None:
    with pytest.raises(InputError, match="modulus"):
        solve(surface, modulus, pressure=0.1)


def test_other_objects_are_no_surfaces() -> None:
    with pytest.raises(InputError, match="Surface.from_array"):
        solve(np.zeros((4, 4)), 1.0, pressure=0.1)  # type: ignore[arg-type]


def test_states_before_a_failure_are_kept(surface: Surface) -> None:
    iterations = solve(surface, 1.0, pressure=0.01)[0].iterations
    with pytest.raises(NotConverged) as caught:
        solve(surface, 1.0, pressure=[1e-6, 0.3, 0.001], max_iterations=iterations // 2, method="gfmd")
    assert isinstance(caught.value.load_path, LoadPath)
    assert "converging" in str(caught.value)


def test_maps_that_do_not_repeat_are_a_warning() -> None:
    patch = Surface.from_array(rough().heights, 1.0, touching="low-points", periodic=False)
    with pytest.warns(AsperityWarning, match="NonPeriodic"):
        solve(patch, 1.0, pressure=0.1)
    solve(patch, 1.0, pressure=0.1, body=NonPeriodic())
    assert pickle.loads(pickle.dumps(patch)).periodic is False


def test_packages_that_are_missing_are_named(surface: Surface, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(ImportError, match="pip install pandas"):
        _ = solve(surface, 1.0, pressure=0.1).curve


def test_packages_are_named_as_pip_knows_them(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("ase", "ase.io"):
        monkeypatch.setitem(__import__("sys").modules, module, None)
    with pytest.raises(ImportError, match="^ase is needed for this; `pip install ase`,"):
        needed("ase.io")


def test_quick_solves_report_their_end(surface: Surface) -> None:
    seen: list[asperity.Progress] = []
    solve(surface, 1.0, pressure=0.1, progress=seen.append)
    assert seen[-1].finished == 1


def test_problems_worth_a_warning() -> None:
    with pytest.warns(AsperityWarning, match="does not resolve"):
        solve(Surface.from_spectrum(32, seed=1), 1.0, pressure=0.1)


def _path(count: int = 200) -> dict[str, Any]:
    return {"p_star": np.linspace(0.01, 0.2, count).tolist(), "tolerance": 1e-10}


def test_interrupts_keep_what_is_finished() -> None:
    surface = rough(512)
    clock: list[float] = []

    def interrupt(progress: asperity.Progress) -> None:
        if progress.finished == 2 and not clock:
            clock.append(time.monotonic())
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt) as caught:
        solve(surface, 1.0, progress=interrupt, **_path())
    assert time.monotonic() - clock[0] < PROMPT
    kept: LoadPath = caught.value.load_path  # type: ignore[attr-defined]
    assert 2 <= len(kept) < 200 and kept[0].residual < 1e-10


def test_searches_for_a_contact_area_are_interrupted() -> None:
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    begin = time.monotonic()
    timer.start()
    with pytest.raises(KeyboardInterrupt) as caught:
        solve(rough(512), 1.0, contact=np.linspace(0.01, 0.9, 200), tolerance=1e-10)
    assert time.monotonic() - begin < 0.3 + PROMPT
    assert len(caught.value.load_path) == 0  # type: ignore[attr-defined]


def test_estimates_are_interrupted() -> None:
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    begin = time.monotonic()
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        asperity.estimate(rough(1024), 1.0, 0.05, method="gfmd")
    assert time.monotonic() - begin < 0.3 + PROMPT


def test_warnings_as_errors_end_the_solve() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", AsperityWarning)
        with pytest.raises(AsperityWarning) as caught:
            solve(Surface.from_spectrum(512, seed=1), 1.0, **_path())
    assert len(caught.value.load_path) < 200  # type: ignore[attr-defined]


def test_errors_of_the_callable_end_the_solve() -> None:
    def fail(progress: asperity.Progress) -> None:
        raise LookupError(progress.iteration)

    with pytest.raises(LookupError):
        solve(rough(256), 1.0, progress=fail, **_path())


def test_progress_rises() -> None:
    seen: list[asperity.Progress] = []
    solve(rough(256), 1.0, progress=seen.append, **_path(10))
    assert seen and all(p.loads == 10 and 0 <= p.fraction <= 1 for p in seen)
    assert [p.finished for p in seen] == sorted(p.finished for p in seen)


def test_a_bar_is_shown_on_request(capfd: pytest.CaptureFixture[str]) -> None:
    solve(rough(256), 1.0, progress=True, **_path(10))
    assert "asperity" in capfd.readouterr().err


def test_the_bar_needs_no_tqdm(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "tqdm.auto", None)
    solve(rough(256), 1.0, progress=True, **_path(10))
    assert "%, load" in capfd.readouterr().err


def test_results_do_not_depend_on_the_threads() -> None:
    one, two = (solve(rough(128), 1.0, pressure=0.05, threads=n)[0] for n in (1, 2))
    assert np.array_equal(one.gap, two.gap)


def test_two_python_threads_at_once() -> None:
    surfaces = [rough(128, seed) for seed in (1, 2)]
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda s: solve(s, 1.0, pressure=0.05)[0], surfaces))
    for surface, state in zip(surfaces, found):
        assert np.array_equal(state.gap, solve(surface, 1.0, pressure=0.05)[0].gap)


def test_the_interpreter_runs_during_a_solve() -> None:
    counted = [0]
    done = threading.Event()

    def count() -> None:
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.005)

    thread = threading.Thread(target=count)
    thread.start()
    begin = time.monotonic()
    solve(rough(512), 1.0, progress=False, **_path(5))
    seconds = time.monotonic() - begin
    done.set()
    thread.join()
    # A tenth of what an idle interpreter counts.
    assert counted[0] > 0.1 * seconds / 0.005


def _area(seed: int) -> float:
    state: State = solve(rough(64, seed), 1.0, pressure=0.05)[0]
    return state.contact_area


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_forked_processes_solve() -> None:
    expected = [_area(1), _area(2)]
    with get_context("fork").Pool(2) as pool:
        assert pool.map_async(_area, [1, 2]).get(timeout=60) == expected


def test_paths_are_pickled(surface: Surface) -> None:
    path = solve(surface, 1.0, pressure=[0.05, 0.1])
    twin = pickle.loads(pickle.dumps(path))
    assert not twin[0].gap.flags.writeable
    assert np.array_equal(twin[1].gap, path[1].gap) and twin[1].mean_gap == path[1].mean_gap


def test_paths_are_sequences(surface: Surface) -> None:
    path = solve(surface, 1.0, pressure=[0.05, 0.1])
    assert (len(path), path[-1] is path.states[1], len(path.branch("loading"))) == (2, True, 2)
    assert repr(path).count("contact") == 2
    with pytest.raises(InputError, match="accepted"):
        path.branch("load")
    assert path.dissipation() == 0
    assert path._repr_html_().count("<tr>") == 3


def test_tables_and_datasets(surface: Surface) -> None:
    path = solve(Surface.from_spectrum(64, seed=1, lambda_s=1 / 8, unit="um"), 1.0, pressure=[0.05, 0.1], pressure_unit="MPa")
    table, data = path.curve, path.dataset
    assert list(table["mean_gap"]) == [s.mean_gap for s in path]
    assert data.gap.dims == ("load_step", "y", "x") and data.gap.attrs["units"] == "um"
    assert np.array_equal(data.stress[1].values, path[1].stress) and data.pressure.attrs["units"] == "MPa"


def test_curves_are_plotted(surface: Surface) -> None:
    path = solve(surface, 1.0, pressure=[0.05, 0.1], pressure_unit="MPa")
    assert path.plot_curve(marker="s").get_xlabel() == "pressure / MPa"
    with pytest.raises(InputError, match="curve"):
        path.plot_curve("area")


def test_memory_grows_with_the_grid() -> None:
    small, large = (asperity.memory(rough(n)) for n in (64, 128))
    assert 3 < large / small < 5


def test_an_initial_gap_selects_the_branch() -> None:
    surface, adhesion = rough(64), Adhesion(8e-3, 2e-2)
    loaded = solve(surface, 1.0, pressure=[0.01, 0.2, 0.01], adhesion=adhesion)
    again = solve(surface, 1.0, pressure=0.01, adhesion=adhesion, initial_gap=loaded[2].gap)[0]
    assert np.isclose(again.contact_area, loaded[2].contact_area, rtol=1e-6)


def test_a_hardness_bounds_the_pressure(surface: Surface) -> None:
    elastic = solve(surface, 1.0, pressure=0.05)[0]
    hardness = 0.5 * float(elastic.stress.max())
    path = solve(surface, 1.0, pressure=[0.02, 0.05, 0.02], hardness=hardness)
    low, high, back = path
    assert np.isclose(high.stress.max(), hardness, rtol=1e-6)
    assert high.plastic_displacement is not None and (high.plastic_displacement >= 0).all()
    assert high.flowing_fraction > 0 and back.flowing_fraction == 0
    assert np.isclose(high.plastic_displacement.mean(), high.mean_plastic_displacement, rtol=1e-12)
    assert back.contact_area > low.contact_area
    assert path.dissipation() == path[-1].plastic_work > 0
    assert elastic.plastic_displacement is None and elastic.plastic_work == 0
    equal = solve(surface, 1.0, pressure=0.05, hardness=np.full(surface.shape, hardness))[0]
    alone = solve(surface, 1.0, pressure=0.05, hardness=hardness)[0]
    assert np.array_equal(equal.stress, alone.stress) and np.array_equal(equal.gap, alone.gap)
    values = np.full(surface.shape, 2 * hardness)
    values[:, ::2] = hardness
    two = solve(surface, 1.0, pressure=0.05, hardness=values)[0]
    assert np.all(two.stress <= values * (1 + 1e-6)) and not np.array_equal(two.stress, alone.stress)
    for shape, word in (((2, 2), "an array of"), (surface.shape, "row 1, column 1")):
        with pytest.raises(asperity.InputError, match=word):
            solve(surface, 1.0, pressure=0.02, hardness=np.zeros(shape))
    for value, words in ((0.01, "every node flows"), (-1.0, "hardness")):
        with pytest.raises(InputError, match=words):
            solve(surface, 1.0, pressure=0.02, hardness=value)
    with pytest.raises(InputError, match="models plastic flow"):
        solve(surface, 1.0, pressure=0.02, hardness=1.0, method="gfmd-fire")


def test_an_error_is_reached_on_the_coarsest_grid_that_has_it() -> None:
    surface = Surface.from_spectrum(64, seed=1, lambda_s=1 / 16)
    path = solve(surface, 1.0, p_star=[0.03, 0.1], error={"area": 0.1, "mean_gap": "5%"})
    accuracy = path.accuracy
    assert accuracy is not None and accuracy.met and accuracy.last == "met"
    assert all(s.contact_area_error is not None and s.contact_area_error <= 0.1 * s.contact_area for s in path)
    assert set(accuracy.errors) == {"contact_area", "mean_gap"}
    assert accuracy.grids[-1]["nx"] == path[0].gap.shape[1] and accuracy.grids[0]["nx"] == 32
    assert path[0].control == "p_star" and solve(surface, 1.0, p_star=0.03).accuracy is None


def test_an_error_that_a_map_does_not_reach_is_a_warning() -> None:
    wave = 0.02 * np.cos(2 * np.pi * np.arange(32) / 32)
    bump = Surface.from_array(wave + wave[:, None], 1.0, touching="high-points")
    with pytest.warns(AsperityWarning, match="not reached: .*32 x 32 nodes"):
        path = solve(bump, 1.0, pressure=0.01, error=0.001)
    assert path.accuracy is not None and path.accuracy.last == "map" and len(path) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error", AsperityWarning)
        assert solve(bump, 1.0, pressure=0.01, budget=60.0).accuracy is not None


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"error": 5}, "did you mean 5%"),
        ({"error": "500%"}, "below 100%"),
        ({"error": 0.0}, "between 0 and 100%"),
        ({"error": {"volume": 0.1}}, "contact_area, mean_gap"),
        ({"error": 0.05, "method": "persson"}, "solves for the fields"),
        ({"budget": -1.0}, "above zero"),
    ],
)
def test_wrong_errors_are_refused(surface: Surface, arguments: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        solve(surface, 1.0, pressure=0.01, **arguments)
