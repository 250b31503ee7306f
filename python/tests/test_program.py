"""The program that the wheel installs, and the folders of its runs."""

from __future__ import annotations

import logging
import os
import pickle
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import cast

import numpy as np
import pytest

import asperity
from asperity import InputError, NotConverged

from conftest import CONFIGS, needs

SCENE = "name = 'small'\nsurface = {{ grid = {grid}, cut_off_mode = 8 }}\nload = {{ p_star = [0.02, 0.05] }}\n"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.format(grid=32))
    return path


@pytest.fixture
def two_points(scene: Path) -> Path:
    path = scene.with_name("sweep.toml")
    path.write_text("name = 'two'\nscene = 'scene.toml'\nover = { surface.seed = '1..2', load.p_star = [[0.02, 0.05]] }\n")
    return path


def test_the_program_is_that_of_the_module() -> None:
    assert asperity.command("--version").split()[1] == asperity.__version__


def test_runs_are_read(scene: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "asperity"):
        run = asperity.run(scene, tmp_path / "out")
    assert any("continuum" in record.message for record in caplog.records)
    assert (run.name, len(run.states), run.report.exists()) == ("small", 2, True)
    assert run.curve["p_star"].tolist() == [s.p_star for s in run.states]
    gap, heights = run.gap(-1), run.heights
    assert gap is not None and heights is not None and gap.shape == heights.shape
    assert np.isclose(gap.mean(), run.states[1].mean_gap, rtol=1e-6)
    assert "2 states" in repr(run) and run._repr_html_().count("<tr>") == 3
    with pytest.raises(IndexError):
        run.gap(2)
    assert run.plot_map(-1, "gap").get_xlabel() == "x / m"
    assert run.plot_curve(y="mean_gap").get_ylabel() == "mean gap / m"
    with pytest.raises(InputError, match="quantity"):
        run.plot_map(0, "contact")
    with pytest.raises(InputError, match="a run with atoms"):
        run.contact_frame(0)


def test_states_have_flow_leakage_and_stress_below_the_surface(scene: Path, tmp_path: Path) -> None:
    """Under the names of ``curve.csv`` and ``results.nc``, with the numbers of ``results.json``."""
    plain = asperity.run(scene, tmp_path / "plain").states[0]
    assert (plain.flowing_fraction, plain.plastic_work, plain.hydraulic_gap_x, plain.von_mises) == (0.0, 0.0, None, None)
    more = "continuum = { leakage = true, hardness = '3 MPa', subsurface = { depths = ['0.5 um', '1 um'], poisson = 0.3 } }\n"
    scene.write_text(SCENE.format(grid=64) + more)
    run = asperity.run(scene, tmp_path / "out")
    for state, row in zip(run.states, run.results["continuum"]["states"], strict=True):
        assert state.flowing_fraction > 0 and state.displaced_fraction >= state.flowing_fraction
        for name in ("flowing_fraction", "displaced_fraction", "mean_plastic_displacement", "plastic_work"):
            assert getattr(state, name) == row[name]
        flow = row["leakage"]
        gaps = (state.hydraulic_gap_x, state.hydraulic_gap_y, state.hydraulic_gap_effective_medium)
        np.testing.assert_allclose([g**3 for g in gaps if g is not None], [*flow["conductivity"], flow["effective_medium"]])
        assert [state.hydraulic_gap_x_error, state.hydraulic_gap_y_error] == flow.get("gap_errors", [None, None])
        assert (state.von_mises, state.shear) == (row["subsurface"]["von_mises"]["value"], row["subsurface"]["shear"]["value"])
    assert run.states[0].hydraulic_gap_x_error is not None
    # One vocabulary: the columns that a table and the NetCDF file both have are the same numbers.
    with run.dataset as data:
        shared = {str(name) for name in data.variables} & set(run.curve.columns)
        assert shared >= {"flowing_fraction", "plastic_work", "hydraulic_gap_x", "hydraulic_gap_effective_medium", "von_mises", "shear"}
        for name in shared:
            np.testing.assert_allclose(data[name], run.curve[name], err_msg=name)
    assert run.plot_curve(y="hydraulic_gap_x").get_ylabel().endswith(" / m")


def test_runs_agree_with_solves(scene: Path, tmp_path: Path) -> None:
    run = asperity.run(scene, tmp_path / "out")
    assert run.heights is not None
    surface = asperity.Surface.from_array(run.heights / run.length_m, 1.0, touching="low-points")
    state = asperity.solve(surface, 1.0, pressure=run.states[0].pressure / run.modulus_pa)[0]
    assert np.isclose(state.contact_area, run.states[0].contact_area, rtol=1e-9)


def test_results_open_in_xarray(scene: Path, tmp_path: Path) -> None:
    with asperity.run(scene, tmp_path / "out").dataset as data:
        assert data.attrs or data.sizes


@pytest.mark.parametrize("name", ["results.json", "continuum/load-1-gap.npy", "results.nc", "surface/done.json"])
def test_files_that_are_not_as_the_run_wrote_them_are_refused(scene: Path, tmp_path: Path, name: str) -> None:
    asperity.run(scene, tmp_path / "out")
    path = tmp_path / "out" / name
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    with pytest.raises(InputError, match="computes again what is damaged"):
        run = asperity.open_run(tmp_path / "out")
        run.gap(0)
        run.dataset.close()


def test_errors_have_the_words_of_the_program(scene: Path, tmp_path: Path) -> None:
    scene.write_text(scene.read_text().replace("0.02", "-1"))
    with pytest.raises(InputError, match=r"load\.p_star\[0\] = -1; accepted"):
        asperity.run(scene, tmp_path / "out")
    with pytest.raises(InputError, match="missing.toml"):
        asperity.run(tmp_path / "missing.toml")
    with pytest.raises(InputError):
        asperity.open_run(tmp_path)


def test_exit_codes_have_classes(tmp_path: Path) -> None:
    scene = tmp_path / "hard.toml"
    scene.write_text(SCENE.format(grid=64) + "continuum = { max_iterations = 1 }\n")
    with pytest.raises(NotConverged):
        asperity.run(scene, tmp_path / "out")


class _Interrupt(logging.Handler):
    """Interrupts this process, as Ctrl-C does, when the program reports its first solve."""

    def emit(self, record: logging.LogRecord) -> None:
        if "loads on" in record.getMessage():
            os.kill(os.getpid(), signal.SIGINT)


def test_interrupted_runs_resume_to_the_same_results(tmp_path: Path) -> None:
    scene = tmp_path / "long.toml"
    scene.write_text("name = 'long'\nsurface = { grid = 512 }\nload = { p_star = [0.01, 0.02, 0.03, 0.04, 0.05] }\n")
    interrupt, log = _Interrupt(), logging.getLogger("asperity")
    log.addHandler(interrupt)
    log.setLevel(logging.INFO)
    try:
        with pytest.raises(KeyboardInterrupt):
            asperity.run(scene, tmp_path / "out")
    finally:
        log.removeHandler(interrupt)
        log.setLevel(logging.NOTSET)
    with pytest.raises(InputError):
        asperity.open_run(tmp_path / "out")
    resumed, whole = asperity.run(scene, tmp_path / "out"), asperity.run(scene, tmp_path / "whole")
    assert resumed.states == whole.states


def test_bad_arguments_are_refused(scene: Path) -> None:
    calls = (
        lambda: asperity.run(3),  # type: ignore[arg-type]
        lambda: asperity.run(scene, threads=-1),
        lambda: asperity.run(scene, arguments="--overwrite"),
        lambda: asperity.command(["doctor"]),  # type: ignore[arg-type]
        lambda: asperity.tradeoff(scene, methods="fast"),
        lambda: asperity.tradeoff(scene, methods=["slow"]),
        lambda: asperity.tradeoff(scene, grids=[7]),
        lambda: asperity.tradeoff(3),  # type: ignore[arg-type]
        lambda: asperity.sweep(3),  # type: ignore[arg-type]
        lambda: asperity.sweep(scene),
        lambda: asperity.ensemble(scene, seeds="1..2", arguments=["--fast"]),
        lambda: asperity.ensemble(scene, seeds=[]),
    )
    for call in calls:
        with pytest.raises(InputError):
            call()


def test_messages_are_echoed_on_request(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = asperity.run(scene, tmp_path / "out", echo=True)
    assert "continuum" in capsys.readouterr().err
    assert pickle.loads(pickle.dumps(run)).name == run.name


#: Threads that ask for the program first, in an interpreter that switches between them as often as it can.
AT_ONCE = """
import sys, threading
from concurrent.futures import ThreadPoolExecutor
from asperity._program import program
sys.setswitchinterval(1e-6)
together = threading.Barrier(16)
with ThreadPoolExecutor(16) as pool:
    assert len(set(pool.map(lambda _: together.wait() < 0 or program(), range(16)))) == 1
"""


def test_threads_find_the_program_at_once() -> None:
    for _ in range(10):
        subprocess.run([sys.executable, "-P", "-c", AT_ONCE], check=True)


def test_a_missing_program_is_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ASPERITY_PROGRAM", "/nowhere/asperity")
    with pytest.raises(asperity.ResourceError, match="ASPERITY_PROGRAM"):
        asperity.program()


def test_costs_and_errors_come_as_a_dictionary(scene: Path, tmp_path: Path) -> None:
    found = asperity.tradeoff(scene, tmp_path / "out", methods=["fast", "persson"], grids=[16], repeats=1)
    assert {point["method"] for point in found["points"]} == {"fast", "persson"}
    assert all(point["nx"] in (8, 16, 32) for point in found["points"])
    assert (tmp_path / "out" / "tradeoff.json").exists()


def test_sweeps_are_read(two_points: Path, tmp_path: Path) -> None:
    sweep = asperity.sweep(two_points, tmp_path / "out", jobs=2)
    assert (sweep.name, len(sweep.points), sweep.missing, sweep.report.exists()) == ("two", 2, {}, True)
    assert "2 of 2 points" in repr(sweep) and sweep._repr_html_().count("<tr>") == 3
    point = sweep.point({"surface.seed": 2})
    assert point == sweep.point(point.label) and point.values == {"load.p_star": [0.02, 0.05], "surface.seed": 2}
    areas, numbers = [[s.contact_area for s in p.run.states] for p in sweep.points], sweep.numbers
    rows = numbers[(numbers["source"] == "continuum") & (numbers["quantity"] == "contact_area")]
    assert np.allclose(rows["value"], np.ravel(areas), rtol=1e-12) and list(rows["load"]) == [1, 2, 1, 2]
    statistics = sweep.statistics
    means = statistics[(statistics["source"] == "continuum") & (statistics["quantity"] == "contact_area")]["mean"]
    assert np.allclose(means, np.mean(areas, axis=0), rtol=1e-12)
    assert set(statistics[statistics["quantity"] == "mean_gap"]["unit"]) == {"um"} and sweep.differences.empty
    for chosen in ("seed-3", {"surface.seed": 3}, {"load.p_star": [0.02, 0.05]}, {}):
        with pytest.raises(InputError, match="of one point"):
            sweep.point(chosen)


def test_damaged_points_are_refused_when_they_are_opened(two_points: Path, tmp_path: Path) -> None:
    asperity.sweep(two_points, tmp_path / "out")
    first, second = asperity.open_sweep(tmp_path / "out").points
    path = first.folder / "results.json"
    path.write_text(path.read_text().replace("0.02", "0.03"))
    with pytest.raises(InputError, match="computes again what is damaged"):
        first.run
    shutil.rmtree(second.folder)
    with pytest.raises(InputError, match=second.label):
        second.run
    sweep = asperity.sweep(two_points, tmp_path / "out")
    assert [point.run.states[0].p_star for point in sweep.points] == [0.02, 0.02]


@pytest.mark.parametrize("damage", [lambda text: text[:-9], lambda text: text.replace('"schema": 4', '"schema": 3'), lambda text: "[]"])
def test_tables_of_another_version_are_refused(two_points: Path, tmp_path: Path, damage: Callable[[str], str]) -> None:
    sweep = asperity.sweep(two_points, tmp_path / "out")
    path = sweep.folder / "ensemble.json"
    path.write_text(damage(path.read_text()))
    with pytest.raises(InputError, match=r"ensemble\.json"):
        asperity.open_sweep(sweep.folder)
    (sweep.folder / "statistics.csv").unlink()
    with pytest.raises(InputError, match=r"statistics\.csv"):
        sweep.statistics


def test_points_that_fail_are_named(tmp_path: Path) -> None:
    (tmp_path / "hard.toml").write_text(SCENE.format(grid=64))
    file = tmp_path / "sweep.toml"
    file.write_text("scene = 'hard.toml'\nover = { continuum.max_iterations = [1, 500] }\n")
    with pytest.raises(NotConverged, match="max-iterations-1 failed"):
        asperity.sweep(file, tmp_path / "out")
    sweep = asperity.open_sweep(tmp_path / "out")
    assert list(sweep.missing) == ["max-iterations-1"] and "1 of 2 points" in repr(sweep)
    failed, done = sweep.points
    assert done.run.states and failed.reason and failed.reason in sweep._repr_html_()
    with pytest.raises(InputError, match="failed: .* accepted: a point that is done"):
        failed.run


def test_ensembles_are_sweeps_over_seeds(scene: Path, tmp_path: Path) -> None:
    found = asperity.ensemble(scene, tmp_path / "out", seeds=range(1, 3))
    assert found.keys == ("surface.seed",) and [point.values for point in found.points] == [{"surface.seed": 1}, {"surface.seed": 2}]
    again = asperity.ensemble(scene, tmp_path / "out", seeds="1..2")
    assert again.results == found.results == asperity.open_sweep(tmp_path / "out").results


def test_lammps_is_that_of_the_argument(tmp_path: Path) -> None:
    with pytest.raises(asperity.ResourceError, match="nowhere/lmp"):
        asperity.run(CONFIGS / "tiny.toml", tmp_path / "out", lammps=tmp_path / "nowhere/lmp")


def test_contact_frames_are_atoms_of_ase(tmp_path: Path) -> None:
    lammps = shutil.which("lmp") or shutil.which("lammps")
    needs("lammps", lammps)
    run = asperity.run(CONFIGS / "tiny.toml", tmp_path / "out", lammps=lammps)
    frame, facts = run.contact_frame(-1), run.results["atoms"]["states"][-1]
    assert frame.info["p_star"] == facts["p_star"] and list(frame.pbc) == [True, True, False]
    assert frame.arrays["contact"].sum() == facts["contacts"]
    assert set(frame.arrays["indenter"]) == {0, 1}
    assert set(frame.numbers[frame.arrays["indenter"] == 0]) == {20}
    with pytest.raises(IndexError):
        run.contact_frame(2)


@pytest.mark.parametrize("folder", [None, 3, object()])
def test_folders_are_paths(folder: object) -> None:
    for opened in cast("list[Callable[[str], object]]", [asperity.open_run, asperity.open_sweep]):
        with pytest.raises(InputError, match="folder = .*; accepted: a path"):
            opened(cast("str", folder))


def test_maps_of_oblong_pixels_have_the_extents_of_the_cell(tmp_path: Path) -> None:
    heights = np.cos(np.arange(24) / 24 * 2 * np.pi)[None, :] * np.cos(np.arange(16) / 16 * 2 * np.pi)[:, None]
    np.savetxt(tmp_path / "map.txt", heights)
    surface = "heights = 'map.txt'\nunit = 'nm'\ntouching = 'high-points'\n"
    lab = "length = '6 um'\nlength_y = '2 um'\nmodulus = '1 GPa'\n"
    path = tmp_path / "oblong.toml"
    path.write_text(f"name = 'oblong'\n[laboratory]\n{lab}[surface]\n{surface}[load]\np_star = [0.1]\n")
    run = asperity.run(path, tmp_path / "out")
    assert run.plot_map(0, "gap").images[0].get_extent() == pytest.approx([0, 6e-6, 0, 2e-6])
