"""Surfaces: arrays of any layout, files, spectra, preparation, copies."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray

import asperity
from asperity import InputError, Surface

RNG = np.random.default_rng(7)
HEIGHTS: npt.NDArray[np.float64] = RNG.normal(size=(24, 36))

#: Heights are scaled by the length and back.
ROUNDING = 4e-16


def of(heights: npt.ArrayLike, **options: Any) -> Surface:
    return Surface.from_array(heights, 36.0, touching="low-points", **options)


def test_low_points_are_lowered_to_zero() -> None:
    assert np.allclose(of(HEIGHTS).heights, HEIGHTS - HEIGHTS.min(), rtol=0, atol=10 * ROUNDING)


def test_high_points_are_turned_over() -> None:
    surface = Surface.from_array(HEIGHTS, 36.0, touching="high-points")
    assert np.allclose(surface.heights, HEIGHTS.max() - HEIGHTS, rtol=0, atol=10 * ROUNDING)


@pytest.mark.parametrize(
    "layout",
    [
        np.asfortranarray(HEIGHTS),
        np.repeat(HEIGHTS, 2, axis=1)[:, ::2],
        HEIGHTS[::-1][::-1],
        HEIGHTS.astype(">f8"),
        HEIGHTS.tolist(),
        np.ma.masked_array(HEIGHTS),
    ],
    ids=["column-major", "strided", "negative strides", "big-endian", "list", "masked"],
)
def test_any_layout_gives_the_same_surface(layout: Any) -> None:
    assert np.array_equal(of(layout).heights, of(HEIGHTS).heights)


@pytest.mark.parametrize("dtype", [np.float32, np.int16, np.uint8])
def test_other_numbers_are_converted(dtype: Any) -> None:
    heights = (10 * HEIGHTS + 40).astype(dtype)
    assert np.array_equal(of(heights).heights, of(heights.astype(np.float64)).heights)


def test_shape_and_cell_are_those_of_the_array() -> None:
    assert (of(HEIGHTS).shape, of(HEIGHTS).cell) == ((24, 36), (36.0, 24.0))
    assert of(HEIGHTS, length_y=12.0).cell == (36.0, 12.0)


def test_x_is_the_fast_axis() -> None:
    x = np.cos(2 * np.pi * np.arange(32) / 32)
    surface = Surface.from_array(np.tile(x, (8, 1)), 1.0, touching="low-points", length_y=4.0)
    assert np.isclose(surface.rms_gradient, 2 * np.pi / np.sqrt(2), rtol=1e-12)


@pytest.mark.parametrize(
    ("heights", "words"),
    [
        (np.zeros(4), "shape (4,)"),
        (np.zeros((0, 3)), "shape (0, 3)"),
        (np.zeros((2, 2), complex), "complex128"),
        (np.full((2, 2), "a"), "<U1"),
        (np.zeros((2, 2), bool), "bool"),
        (np.array([[1.0, np.inf]]), "inf"),
        (np.array([[1.0, np.nan]]), "row 1, column 2"),
        (np.full((2, 2), np.nan), "no measured height"),
    ],
)
def test_bad_heights_are_refused(heights: Any, words: str) -> None:
    with pytest.raises(InputError, match="heights|height") as caught:
        of(heights)
    assert words in str(caught.value)


@pytest.mark.parametrize("length", [0.0, -1.0, np.nan, np.inf, "long", None])
def test_bad_lengths_are_refused(length: Any) -> None:
    with pytest.raises(InputError, match="length"):
        Surface.from_array(HEIGHTS, length, touching="low-points")


def test_bad_words_are_refused_with_those_accepted() -> None:
    with pytest.raises(InputError, match="touching.*low-points.*high-points"):
        Surface.from_array(HEIGHTS, 1.0, touching="peaks")
    with pytest.raises(InputError, match="fill.*nearest.*harmonic"):
        of(HEIGHTS, preparation={"fill": "zero"})
    with pytest.raises(InputError, match="detrent.*accepted.*detrend"):
        of(HEIGHTS, preparation={"detrent": "plane"})


@pytest.mark.parametrize(
    "steps", ["plane", {"low_pass": "3 um"}, {"crop": 5}, {"crop": (1, 2)}, {"detrend": True}, {"resample": (4, -4)}, {"low_pass": -3}]
)
def test_bad_preparations_are_refused(steps: Any) -> None:
    with pytest.raises(InputError, match="accepted") as caught:
        of(HEIGHTS, preparation=steps)
    assert "--" not in str(caught.value)


def test_heights_are_no_surface() -> None:
    with pytest.raises(InputError, match="from_array"):
        Surface(HEIGHTS)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="from_array"):
        Surface.from_topography(HEIGHTS)
    with pytest.raises(InputError, match="lengths"):
        of([[1.0, 2.0], [3.0]])


def test_named_axes_are_respected() -> None:
    labelled = xarray.DataArray(HEIGHTS.T, dims=("x", "y"))
    assert np.array_equal(of(labelled).heights, of(HEIGHTS).heights)


def test_preparation_removes_tilt_and_fills_holes() -> None:
    tilted = HEIGHTS + 3.0 * np.arange(36)
    tilted[5, 7] = np.nan
    surface = of(tilted, periodic=False, preparation={"fill": "harmonic", "detrend": "plane", "edges": "mirror"})
    assert surface.shape == (48, 72)
    assert surface.rms_height < 1.1
    assert [step.split()[0] for step in surface.preparation_steps] == ["detrend", "fill", "edges"]


def test_masked_points_are_missing() -> None:
    masked = np.ma.masked_array(HEIGHTS, HEIGHTS > 2)
    with pytest.raises(InputError):
        of(masked)
    assert len(of(masked, preparation={"fill": "nearest"}).preparation_steps) == 1


def test_files_are_read_with_what_they_declare() -> None:
    path = Path(__file__).parents[2] / "configs" / "measured-surface.txt"
    surface = Surface.from_file(path, touching="high-points", preparation={"fill": "harmonic", "detrend": "plane"})
    assert surface.provenance is not None
    assert surface.provenance["file"].endswith("measured-surface.txt")
    assert surface.unit == "m"
    with pytest.raises(InputError, match="touching"):
        Surface.from_file(path)


def test_missing_files_are_named() -> None:
    with pytest.raises(InputError, match="nowhere.npy"):
        Surface.from_file("nowhere.npy", length=1.0, touching="low-points")


def test_npy_files_and_arrays_give_the_same_surface(tmp_path: Path) -> None:
    np.save(tmp_path / "h.npy", HEIGHTS)
    stored = Surface.from_file(tmp_path / "h.npy", length=36.0, touching="low-points")
    assert np.array_equal(stored.heights, of(HEIGHTS).heights)


def test_spectra_are_reproducible_and_independent_of_the_grid() -> None:
    coarse, fine = (Surface.from_spectrum(n, seed=3, lambda_s=1 / 16) for n in (64, 128))
    difference = fine.heights[::2, ::2] - coarse.heights
    assert np.ptp(difference) < 1e-12


@pytest.mark.parametrize(
    "values",
    [
        *({"nodes": n} for n in (0, 1.5)),
        *({"seed": seed} for seed in (-1, "x")),
        *({"hurst": hurst} for hurst in (0, -1, 1.5, np.nan)),
        *({"lambda_s": wave} for wave in (0, -1, 1e-6, 10, np.nan)),
        *({"lambda_r": wave} for wave in (0, -2, 1.5, np.nan)),
        *({"rms_gradient": gradient} for gradient in (0, -1, np.nan, np.inf)),
        {"amplitudes": "flat"},
    ],
)
def test_bad_spectra_are_refused(values: dict[str, Any]) -> None:
    given = {"nodes": 32, "seed": 1} | values
    with pytest.raises(InputError, match=next(iter(values))):
        Surface.from_spectrum(given.pop("nodes"), **given)


def test_topographies_of_surface_topography() -> None:
    class Topography:
        """What SurfaceTopography's `Topography` has: x is the first axis."""

        physical_sizes, is_periodic, unit = (36.0, 24.0), True, "um"

        def heights(self) -> npt.NDArray[np.float64]:
            return HEIGHTS.T

    surface = Surface.from_topography(Topography(), touching="low-points")
    assert np.array_equal(surface.heights, of(HEIGHTS, length_y=24.0).heights)
    assert (surface.unit, surface.cell) == ("um", (36.0, 24.0))


def test_copies_are_equal() -> None:
    for surface in (Surface.from_spectrum(32, seed=2, lambda_s=0.25, unit="m"), of(HEIGHTS, unit="nm")):
        for twin in (pickle.loads(pickle.dumps(surface)), copy.deepcopy(surface)):
            assert np.allclose(twin.heights, surface.heights, rtol=0, atol=10 * ROUNDING)
            assert (twin.cell, twin.shape, twin.unit) == (surface.cell, surface.shape, surface.unit)


def test_statistics_and_words(surface: Surface) -> None:
    statistics = surface.statistics()
    assert np.isclose(statistics["rms_height"], surface.heights.std(), rtol=1e-12)
    assert statistics["height_range"] == np.ptp(surface.heights)
    assert "64 x 64 nodes" in repr(surface)
    assert surface._repr_html_().count("<tr>") == 4 and "64 × 64" in surface._repr_html_()
    assert "does not resolve" in Surface.from_spectrum(64, seed=1, lambda_s=1 / 40)._repr_html_()


def test_unresolved_waves_are_a_warning() -> None:
    assert "does not resolve" in Surface.from_spectrum(64, seed=1).warnings[0]


def test_maps_are_plotted(surface: Surface) -> None:
    assert surface.plot_map().get_xlabel() == "x"
    assert asperity.solve(surface, 1.0, pressure=0.1)[0].plot_map("contact").get_title() == "contact"


def test_functions_of_a_wave() -> None:
    """A wave of amplitude 1 along x, and what a blunt tip cannot see of it."""
    x = 2 * np.pi * 3 * np.arange(60) / 60
    surface = Surface.from_array(np.tile(np.cos(x), (20, 1)), 6.0, touching="high-points")
    numbers = surface.statistics()
    assert numbers["sku"] == pytest.approx(1.5) and numbers["ssk"] == pytest.approx(0, abs=1e-12)
    assert numbers["sal"] == pytest.approx(np.arccos(0.2) / np.pi, rel=1e-2) and numbers["str"] is None
    q, density = surface.power_spectrum("x")
    assert q[2] == pytest.approx(np.pi) and density[2] == pytest.approx(6 / 4) and np.delete(density, 2).max() < 1e-20
    assert surface.power_spectrum("y")[1].max() < 1e-20 and surface.power_spectrum()[1].max() > 0
    differences = surface.scale_dependent("x")
    half_wave = np.isclose(differences["distance"], 1.0)
    assert differences["structure_function"][half_wave] == pytest.approx(2) and differences["slope"][half_wave] == pytest.approx(2**0.5)
    assert np.isnan(differences["curvature"][0]) and surface.scale_dependent("y")["slope"].max() < 1e-12
    for call in (lambda: surface.power_spectrum("z"), lambda: surface.scale_dependent("radius")):
        with pytest.raises(InputError, match="axis"):
            call()
    sharp, blunt = (surface.tip(radius, half_angle=10) for radius in (0.04, 0.5))
    # Over a stencil of the length s the wave bends by 4 sin²(qs/4), at the cut-off as half of the tip does.
    bend = 4 * np.sin(np.pi * blunt["cutoff"] / 4) ** 2 / (blunt["cutoff"] / 2) ** 2
    assert sharp["cutoff"] is None and bend == pytest.approx(0.5 / 0.5, rel=1e-2)
    assert sharp["touched"].all() and not blunt["touched"].all()
    # Low points touch first inside: the true surface is nowhere lower than the map.
    assert (blunt["heights"] >= surface.heights - 1e-12).all()
    for radius, angle in ((0, 0), (-1, 0), (1, 90), (1, -1)):
        with pytest.raises(InputError, match="accepted"):
            surface.tip(radius, half_angle=angle)
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    spectra, slopes = surface.plot_functions()
    assert [len(axes.lines) for axes in (spectra, slopes)] == [2, 2]


def test_two_bodies_are_the_sum_of_their_heights() -> None:
    first, other = of(HEIGHTS), of(RNG.normal(size=HEIGHTS.shape))
    over = other.heights[:, (-np.arange(36)) % 36]
    exact = first.heights + np.roll(over, (2, -5), (0, 1))
    both = first.facing(other, shift=(-5.0, 2.0))
    assert np.allclose(both.heights, exact - exact.min(), rtol=0, atol=20 * ROUNDING)
    assert "turned over, shifted by -5 x 2" in both.preparation_steps[-1]
    patches = [of(HEIGHTS, periodic=False), of(other.heights, periodic=False)]
    common = patches[0].facing(patches[1], turned_over=False, shift=(3.0, -4.0))
    exact = HEIGHTS[:20, 3:] + other.heights[4:, :33]
    assert common.shape == (20, 33) and np.allclose(common.heights, exact - exact.min(), rtol=0, atol=20 * ROUNDING)
    assert np.allclose(pickle.loads(pickle.dumps(both)).heights, both.heights, rtol=0, atol=20 * ROUNDING)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"quarter_turns": 4}, "0, 1, 2 or 3"),
        ({"shift": (1.0, 2.0, 3.0)}, "two lengths"),
        ({"quarter_turns": 1}, "that of the first body.*periodic=False"),
        ({"shift": (np.nan, 0.0)}, "shift"),
    ],
)
def test_bodies_that_do_not_fit_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        of(HEIGHTS).facing(of(HEIGHTS), **options)


def test_units_of_two_bodies_are_equal() -> None:
    with pytest.raises(InputError, match="accepted: that of this surface, 'um'"):
        of(HEIGHTS, unit="um").facing(of(HEIGHTS, unit="nm"))


def test_compliances_of_bodies_add_up() -> None:
    assert asperity.contact_modulus((3.0, 0.5), (2.0, 0.0)) == pytest.approx(1 / (0.25 + 0.5), rel=1e-15)
    wrong: list[tuple[Any, str]] = [((), "one or two"), (((1.0,),), "one or two"), (((0.0, 0.3),), "young"), (((1.0, 0.6),), "poisson")]
    for bodies, words in wrong:
        with pytest.raises(InputError, match=words):
            asperity.contact_modulus(*bodies)


def test_profiles_are_surfaces_of_one_line(tmp_path: Path) -> None:
    x = np.arange(100) * 0.5
    z = np.cos(2 * np.pi * x / 50)
    np.savetxt(tmp_path / "profile.txt", np.c_[x, z])
    surface = Surface.from_file(tmp_path / "profile.txt", touching="high-points", profile=True)
    assert surface.shape == (1, 100) and surface.cell == pytest.approx((50.0, 0.5))
    assert surface.rms_height == pytest.approx(np.sqrt(0.5))
    with pytest.raises(InputError, match="profile"):
        Surface.from_file(tmp_path / "profile.txt", touching="high-points")


def test_the_unit_of_a_file_is_not_another(tmp_path: Path) -> None:
    file = tmp_path / "map.txt"
    np.savetxt(file, HEIGHTS, header="Height units: nm")
    file.write_text("# Width: 4 nm\n# Value units: nm\n" + file.read_text())
    options: dict[str, Any] = {"touching": "high-points"}
    assert Surface.from_file(file, unit="nm", **options).unit == "nm"
    for unit in ("um", "furlong"):
        with pytest.raises(InputError, match=f"unit = .*{unit}"):
            Surface.from_file(file, unit=unit, **options)


@pytest.mark.parametrize(("steps", "says"), [({"filter": "sharp"}, "filter.*low_pass or high_pass"), ({"seed": 3}, "seed = 3.*extend_to")])
def test_steps_without_an_effect_are_refused(steps: asperity.Preparation, says: str) -> None:
    with pytest.raises(InputError, match=says):
        of(HEIGHTS, preparation=steps)


def test_waves_below_the_measured_ones_follow_a_seed() -> None:
    surface = Surface.from_spectrum(128, seed=1, lambda_s=1 / 32, rms_gradient=0.2)

    def extended(seed: int) -> Surface:
        steps: asperity.Preparation = {"low_pass": 0.06, "extend_to": 0.02, "seed": seed}
        return Surface.from_array(surface.heights, 1.0, touching="low-points", preparation=steps)

    one, two, again = map(extended, (1, 2, 1))
    assert one.shape == (200, 200) and one.heights.tobytes() == again.heights.tobytes() != two.heights.tobytes()
    assert one.rms_gradient > 1.05 * surface.rms_gradient
    assert "seed 1" in one.preparation_steps[-1]
    with pytest.raises(InputError, match="extend_to = 0.02; accepted: only together with low_pass"):
        Surface.from_array(surface.heights, 1.0, touching="low-points", preparation={"extend_to": 0.02, "seed": 1})
    with pytest.raises(InputError, match="seed"):
        Surface.from_array(surface.heights, 1.0, touching="low-points", preparation={"low_pass": 0.06, "extend_to": 0.02})


def test_a_profile_is_one_realisation_of_an_isotropic_map() -> None:
    profile = Surface.from_spectrum(128, seed=1, lambda_r=0.1, lambda_s=1 / 32, rms_gradient=0.2).heights[:1]

    def isotropic(seed: int) -> Surface:
        steps: asperity.Preparation = {"isotropic_map": True, "seed": seed}
        return Surface.from_array(profile, 1.0, touching="low-points", periodic=False, preparation=steps)

    one, two, again = map(isotropic, (1, 2, 1))
    assert one.shape == (128, 128) and one.periodic and one.cell == (1.0, 1.0)
    assert one.heights.tobytes() == again.heights.tobytes() != two.heights.tobytes()
    assert 0.1 < one.rms_gradient < 0.3
    assert "one realisation, of seed 1" in one.preparation_steps[-1]
    with pytest.raises(InputError, match="isotropic_map = 24 x 36 points|isotropic_map = 36 x 24 points"):
        of(HEIGHTS, preparation={"isotropic_map": True, "seed": 1})
    with pytest.raises(InputError, match="seed"):
        of(HEIGHTS[:1], preparation={"isotropic_map": True})


def test_three_points_level_a_map() -> None:
    tilted = HEIGHTS + 3.0 * np.arange(36)
    surface = Surface.from_array(tilted, 36.0, touching="low-points", preparation={"detrend": "three-points=5,5;30,6;10,20"})
    assert surface.rms_height < 3.0 and "means of 21, 21, 21 points" in surface.preparation_steps[0]
    for points, words in (("three-points=5,5;30,6", "X1,Y1"), ("three-points=5um,5um;30um,6um;1um,1um", "without a unit"), ("tilt", "facets")):
        with pytest.raises(InputError, match=words):
            of(tilted, preparation={"detrend": points})


def test_a_single_column_is_no_map() -> None:
    with pytest.raises(InputError, match="one column of 24 points"):
        Surface.from_array(HEIGHTS[:, :1], 36.0, touching="low-points")
    assert Surface.from_array(HEIGHTS[:1], 36.0, touching="low-points").shape == (1, 36)
