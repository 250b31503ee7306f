"""Files of instruments through SurfaceTopography. Files are written here from the definitions of their formats."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import asperity
from asperity import InputError, ResourceError
from asperity.convert import channels, convert, formats, main

from conftest import REPOSITORY, needs

# SurfaceTopography leaves files to the garbage collector.
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")

NX, NY = 12, 8
#: Integers of the files; the units of both formats make heights of a tenth of a nanometre from them.
NUMBERS = np.array([[(37 * x * x + 11 * x * y + 5 * y) % 201 - 90 for x in range(NX)] for y in range(NY)], "<i2")
HEIGHTS = 0.1 * NUMBERS
#: Point of a hole: row, column.
HOLE = (2, 3)
#: Rounding of a product of scale factors.
ROUNDING = 1e-12


@pytest.fixture(autouse=True)
def _readers() -> None:
    needs("python", find_spec("SurfaceTopography"))


def bcr(path: Path) -> Path:
    """BCR-STM of Image Metrology: 1.2 x 0.8 µm in nm, a void pixel."""
    numbers = NUMBERS.copy()
    numbers[HOLE] = 32767
    size = f"xpixels = {NX}\nypixels = {NY}\nxlength = 1200\nylength = 800\n"
    header = f"fileformat = bcrstm\nheadersize = 2048\n{size}xunit = nm\nyunit = nm\nzunit = nm\nbit2nm = 0.1\nintelmode = 1\nvoidpixels = 1\n"
    path.write_bytes(header.encode().ljust(2048, b"\0") + numbers.tobytes())
    return path


def mi(path: Path) -> Path:
    """PicoView of Agilent: two channels of heights in µm, one of volts. Rows from the bottom."""
    keys = {"fileType": "Image", "version": "PicoView", "xPixels": NX, "yPixels": NY, "xLength": 1.2e-6, "yLength": 0.8e-6}
    for label, unit, scale in [("Topography", "um", 3.2768), ("Topography", "um", 6.5536), ("Deflection", "V", 10.0)]:
        keys[f"bufferLabel {len(keys)}"] = label
        keys[f"bufferUnit {len(keys)}"] = unit
        keys[f"bufferRange {len(keys)}"] = scale
    lines = [f"{key.split()[0]:<14}{value}" for key, value in keys.items()]
    path.write_bytes("\n".join([*lines, "data          BINARY", ""]).encode() + 3 * NUMBERS[::-1].tobytes())
    return path


def uneven(path: Path, positions: tuple[float, ...]) -> Path:
    """A straight line with unequal steps, as two columns."""
    path.write_text("".join(f"{x} {2 * x}\n" for x in positions))
    return path


def container(path: Path) -> Path:
    """Two maps and a line of one surface in a ZIP container of contact.engineering."""
    library: Any = pytest.importorskip("SurfaceTopography")
    write = pytest.importorskip("SurfaceTopography.Container.IO").write_containers
    heights = np.ma.masked_array(HEIGHTS.T, HEIGHTS.T > 10.9)
    maps = [
        library.Topography(heights, (1.2, 0.8), unit="nm", info={"name": "left"}),
        library.Topography(2 * HEIGHTS.T, (1.2, 0.8), unit="µm", periodic=True, info={"name": "right"}),
        library.UniformLineScan(HEIGHTS[0], 1.2, unit="nm", info={"name": "line"}),
    ]
    write([maps], str(path))
    return path


def read(path: Path) -> tuple[asperity.Surface, dict[str, Any]]:
    surface = asperity.Surface.from_file(path, preparation={"fill": "nearest"})
    assert surface.provenance is not None
    return surface, surface.provenance


def expected(heights: Any, hole: bool = False) -> Any:
    """Heights as a surface has them: the high points touch first, and the highest is at 0."""
    heights = heights.copy()
    if hole:
        heights[HOLE] = heights[HOLE[0], HOLE[1] - 1]
    return heights.max() - heights


def test_heights_unit_extents_holes_and_sign_are_carried_over(tmp_path: Path) -> None:
    out = tmp_path / "out.nc"
    convert(bcr(tmp_path / "map.bcr"), out)
    raw = asperity.Surface.from_file(out, preparation={"fill": "harmonic"})
    surface, provenance = read(out)
    assert np.delete(surface.heights, HOLE[0] * NX + HOLE[1]) == pytest.approx(
        np.delete(expected(HEIGHTS, True), HOLE[0] * NX + HOLE[1]), abs=100 * ROUNDING
    )
    assert (surface.unit, surface.shape) == ("nm", (NY, NX)) and surface.cell == pytest.approx((1200, 800))
    assert (provenance["missing_points"], provenance["touching"], provenance["channel"]) == (1, "high-points", "Default")
    assert raw.shape == surface.shape
    (origin, _) = provenance["preparation"]
    version = pytest.importorskip("SurfaceTopography").__version__
    assert origin.startswith("read from map.bcr (SHA-256 ") and origin.endswith(f"by SurfaceTopography {version} (reader bcr)")
    # A replica.
    convert(bcr(tmp_path / "map.bcr"), out, touching="low-points")
    assert read(out)[1]["touching"] == "low-points"


def test_channels_are_listed_and_selected(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = mi(tmp_path / "map.mi"), tmp_path / "out.nc"
    assert [(c.name, c.points, c.unit, c.is_map) for c in channels(path)] == [
        ("Topography#1", (NX, NY), "µm", True),
        ("Topography#2", (NX, NY), "µm", True),
        ("Deflection", (NX, NY), "m", False),
    ]
    assert main([str(path), "--list"]) == 0
    assert "3  Deflection: 12 x 8 points" in capsys.readouterr().out
    with pytest.raises(InputError, match=r"map.mi: 2 maps of heights; accepted: .*--dataset.*: 1 'Topography#1', 2 'Topography#2'$"):
        convert(path, out)
    choices: list[tuple[str | int, float]] = [("Topography#1", 1e-4), (2, 2e-4), ("2", 2e-4)]
    for dataset, factor in choices:
        chosen = convert(path, out, dataset=dataset)
        surface, provenance = read(out)
        assert surface.heights == pytest.approx(expected(factor * NUMBERS), abs=ROUNDING)
        assert (surface.unit, provenance["channel"]) == ("um", chosen.name)
        assert provenance["channels"] == ["Topography#1", "Topography#2"]
    for wrong, found in [("Deflection", "deflection in V, no heights"), ("4", "dataset = '4'"), ("Z", "dataset = 'Z'")]:
        with pytest.raises(InputError, match=f"map.mi: .*{found}; accepted: 1 'Topography#1', 2"):
            convert(path, out, dataset=wrong)


def test_containers_are_opened(tmp_path: Path) -> None:
    path, out = container(tmp_path / "surface.zip"), tmp_path / "out.nc"
    assert [(c.name, c.points) for c in channels(path)] == [("left", (NX, NY)), ("right", (NX, NY)), ("line", (NX,))]
    with pytest.raises(InputError, match="3 maps of heights; accepted: the name or number of one"):
        convert(path, out)
    with pytest.raises(InputError, match="'line' is a profile of 12 points; accepted: .*1 'left'"):
        convert(path, out, dataset=3)
    with pytest.raises(InputError, match="'left' is a map of .* points; accepted"):
        convert(path, out, dataset="left", profile=True)
    convert(path, out, dataset="line", profile=True)
    profile = asperity.Surface.from_file(out, profile=True)
    assert profile.heights == pytest.approx(expected(HEIGHTS[:1]), abs=ROUNDING)
    assert profile.unit == "nm" and profile.cell == pytest.approx((1.2, 0.1), rel=1e-7)
    convert(path, out, dataset="right")
    surface, _ = read(out)
    assert surface.heights == pytest.approx(expected(2 * HEIGHTS), abs=100 * ROUNDING)
    # Containers have extents in single precision.
    assert (surface.unit, surface.periodic) == ("um", True) and surface.cell == pytest.approx((1.2, 0.8), rel=1e-7)
    convert(path, out, dataset="left")
    _, provenance = read(out)
    assert (provenance["missing_points"], provenance["periodic"]) == (np.count_nonzero(HEIGHTS > 10.9), False)


@pytest.mark.parametrize("positions", [(0.0, 1.0, 3.0, 4.0), (9.0, 8.0, 6.0, 5.0)])
def test_a_profile_without_equal_steps_is_interpolated(tmp_path: Path, positions: tuple[float, ...]) -> None:
    with pytest.warns(UserWarning, match="not equidistant"):
        convert(uneven(tmp_path / "line.txt", positions), tmp_path / "out.nc", profile=True)
    profile = asperity.Surface.from_file(tmp_path / "out.nc", profile=True, length=16 / 3)
    # Four points over three steps of 4/3: the straight line keeps its slope of 2.
    assert profile.cell == pytest.approx((16 / 3, 4 / 3))
    assert np.diff(profile.heights[0]) == pytest.approx(-8 / 3)


def test_a_profile_that_turns_back_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="neither rise nor fall"):
        convert(uneven(tmp_path / "line.txt", (0.0, 2.0, 1.0, 3.0)), tmp_path / "out.nc", profile=True)


def test_surfaces_are_read_from_files_of_instruments(tmp_path: Path) -> None:
    surface, provenance = read(bcr(tmp_path / "map.bcr"))
    assert (surface.unit, surface.shape, provenance["format"]) == ("nm", (NY, NX), "through SurfaceTopography")
    assert provenance["file"].endswith("map.bcr") and len(provenance["hash"]) == 64
    converted = tmp_path / "out.nc"
    convert(tmp_path / "map.bcr", converted)
    assert np.array_equal(surface.heights, read(converted)[0].heights)
    with pytest.raises(InputError, match="surface.zip: dataset = 'middle'; accepted: 1 'left', 2 'right'"):
        asperity.Surface.from_file(container(tmp_path / "surface.zip"), dataset="middle")


def test_the_program_converts_in_one_step(tmp_path: Path) -> None:
    path, scratch = bcr(tmp_path / "map.bcr"), tmp_path / "scratch"
    scratch.mkdir()
    words = [str(asperity.program()), "surface", str(path), "--via-python", "--fill", "nearest", "--json"]

    def call(python: str) -> subprocess.CompletedProcess[str]:
        environment = os.environ | {"ASPERITY_PYTHON": python, "TMPDIR": str(scratch)}
        return subprocess.run(words, env=environment, capture_output=True, text=True, check=False)

    printed = call(sys.executable)
    surface, provenance = read(path)
    answer = json.loads(printed.stdout)
    assert answer["preparation"] == provenance["preparation"] and answer["hash"] == provenance["hash"]
    assert answer["length_x_m"] == pytest.approx(1.2e-6) and answer["height_range_m"] == pytest.approx(1e-9 * np.ptp(surface.heights))
    assert not list(scratch.iterdir()), "temporary files remain"
    without = Path(sys.base_prefix) / "bin" / "python3"
    for python, code, said in [(str(without), 5, "asperity in "), ("/nowhere/python", 5, "/nowhere/python was not found; ")]:
        refused = call(python)
        assert refused.returncode == code and said in refused.stderr and refused.stderr.count("\n") == 1, refused.stderr


def test_what_cannot_be_converted_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out.nc"
    (tmp_path / "words.bin").write_bytes(b"\0\1 no map")
    (tmp_path / "cut.bcr").write_bytes(bcr(tmp_path / "map.bcr").read_bytes()[:2100])
    for name, found in [("absent", "no such file"), ("words.bin", "no reader of"), ("cut.bcr", "cannot read it|no reader of")]:
        with pytest.raises(InputError, match=f"{name}: .*({found}).*; accepted: "):
            convert(tmp_path / name, out)
        assert main([str(tmp_path / name), str(out)]) == 2
        said = capsys.readouterr().err
        assert said.startswith("error: ") and said.count("\n") == 1
    with pytest.raises(InputError, match="length = 20um; accepted: none, as the file declares"):
        convert(tmp_path / "map.bcr", out, length="20um")
    with pytest.raises(InputError, match="accepted: a path"):
        convert(tmp_path / "map.bcr", tmp_path / "absent" / "out.nc")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["cut.bcr", "map.bcr", "words.bin"]


def test_a_missing_lateral_size_is_given(tmp_path: Path) -> None:
    np.save(tmp_path / "map.npy", HEIGHTS.T)
    out = tmp_path / "out.nc"
    assert "no lateral size" in str(convert(tmp_path / "map.npy", out))
    with pytest.raises(InputError, match="length = not given"):
        asperity.Surface.from_file(out)
    for wrong in ["", "-2um", "um", "0um"]:
        with pytest.raises(InputError, match="accepted: a positive number"):
            convert(tmp_path / "map.npy", out, length=wrong)
    convert(tmp_path / "map.npy", out, length="24")
    assert read(out)[0].cell == (24, 16)


def test_without_the_readers_the_remedy_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "SurfaceTopography", None)
    with pytest.raises(ResourceError, match=r'SurfaceTopography in .* was not found; `pip install "asperity\[files\]"`'):
        channels(bcr(tmp_path / "map.bcr"))


def test_the_page_of_formats_is_that_of_the_code() -> None:
    page = (REPOSITORY / "docs" / "files.md").read_text()
    assert formats() in page, "python -m asperity.convert --formats prints the table of docs/files.md"
