"""Arrays that enter: any layout of the same numbers gives the same result, in every function that takes an array."""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

import asperity
from asperity import InputError, Surface

# The heights are noise, about which solves warn.
pytestmark = pytest.mark.filterwarnings("ignore::asperity.AsperityWarning")

SHAPE = (6, 8)
RNG = np.random.default_rng(3)

#: Whole numbers, which all types hold: heights, and a map of contact.
HEIGHTS: npt.NDArray[np.float64] = RNG.integers(0, 100, SHAPE).astype(np.float64)
FLAGS: npt.NDArray[np.bool_] = HEIGHTS > 40

REAL = [order + kind for kind in ("f2", "f4", "f8", "i2", "i4", "i8", "u2", "u4", "u8") for order in "<>"] + ["i1", "u1", "g"]
BINARY = ["?", "i1", "u1", "<i4", ">i4", ">u8"]


class Own(np.ndarray[Any, Any]):
    """A sub-class that changes what it hands out by an index."""

    def __getitem__(self, index: Any) -> Any:
        raise AssertionError("not an index of the array that entered")


def packed(values: npt.NDArray[Any], before: str, after: str) -> npt.NDArray[Any]:
    records = np.zeros(values.shape, [("before", before), ("values", values.dtype), ("after", after)])
    records["values"] = values
    return np.asarray(records["values"])


def unaligned(values: npt.NDArray[Any], shift: int) -> npt.NDArray[Any]:
    buffer = bytearray(shift) + values.tobytes()
    return np.frombuffer(buffer, values.dtype, offset=shift).reshape(values.shape)


def stepped(values: npt.NDArray[Any], down: int, across: int) -> npt.NDArray[Any]:
    ny, nx = values.shape
    large = np.full((ny * abs(down), nx * abs(across)), 7, values.dtype)
    view = large[::down, ::across]
    view[...] = values
    return view


def read_only(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    view = values[...]
    view.flags.writeable = False
    return view


sides = st.sampled_from(["i1", "i4", "f8", "S3", "u2"])
steps = st.sampled_from([-3, -1, 1, 2])
Layout = Callable[[npt.NDArray[Any]], Any]

#: What keeps shape and values.
layouts: st.SearchStrategy[Layout] = st.one_of(
    st.builds(lambda before, after: lambda a: packed(a, before, after), sides, sides),
    st.builds(lambda shift: lambda a: unaligned(a, shift), st.integers(1, 9)),
    st.builds(lambda down, across: lambda a: stepped(a, down, across), steps, steps),
    st.just(np.asfortranarray),
    st.just(read_only),
    st.just(lambda a: a.view(Own)),
    st.just(lambda a: a.T.copy().T),
    st.just(np.ma.masked_array),
    st.just(lambda a: xarray.DataArray(a, dims=("y", "x"))),
    st.just(lambda a: xarray.DataArray(a.T.copy(), dims=("x", "y"))),
    st.just(lambda a: packed(packed(a, "i1", "i1")[::-1], "S3", "i1")[::-1]),
)
checked: Callable[..., Callable[[Callable[..., None]], Callable[..., None]]] = settings(max_examples=60, deadline=None)


def rough() -> Surface:
    return Surface.from_array(HEIGHTS, 80.0, touching="low-points")


def numbers(found: Any) -> list[Any]:
    """What a result holds, as plain lists."""
    if isinstance(found, np.ndarray):
        return [found.shape, found.tolist()]
    if isinstance(found, (list, tuple)):
        return [numbers(value) for value in found]
    return numbers(list(vars(found).values())) if hasattr(found, "__dict__") and vars(found) else [found]


def solved(**options: Any) -> list[Any]:
    state = asperity.solve(rough(), 1.0, p_star=0.05, progress=False, **options)[0]
    return [state.gap.tolist(), state.stress.tolist(), state.contact_area]


#: Every function that takes a real map.
OF_REAL: dict[str, Callable[[Any], Any]] = {
    "from_array": lambda a: Surface.from_array(a, 80.0, touching="low-points").heights,
    "hardness": lambda a: solved(hardness=a),
    "initial_gap": lambda a: solved(initial_gap=a),
    "contact_area": lambda a: asperity.contact_area(a, (8.0, 6.0), threshold=30.0),
    "gap_distribution": lambda a: asperity.gap_distribution(a, [0, 20, 50]),
    "stress_distribution": lambda a: asperity.stress_distribution(a, FLAGS, [0, 20, 50]),
    "hydraulic_gap": lambda a: asperity.hydraulic_gap(a),
    "subsurface": lambda a: asperity.subsurface(a, (8.0, 6.0), 0.5, poisson=0.3),
}

#: Every function that takes a map of contact.
OF_FLAGS: dict[str, Callable[[Any], Any]] = {
    "clusters": lambda a: asperity.clusters(a),
    "percolation": lambda a: asperity.percolation(a),
    "stress_distribution": lambda a: asperity.stress_distribution(HEIGHTS, a, [0, 20, 50]),
    "compare_maps": lambda a: asperity.compare_maps(a, FLAGS),
    "compare_maps, reference": lambda a: asperity.compare_maps(FLAGS, a),
}

LAW = asperity.TabulatedLaw(lambda gap: max(1 - gap / 100, 0), cutoff=100.0)

#: Every function that takes numbers in a row.
OF_ROW: dict[str, Callable[[Any], Any]] = {
    "edges": lambda a: asperity.gap_distribution(HEIGHTS, a),
    "depths": lambda a: asperity.subsurface(HEIGHTS, (80.0, 60.0), a, poisson=0.3),
    "mean_gap": lambda a: [s.pressure for s in asperity.solve(rough(), 1.0, mean_gap=a, progress=False)],
    "law": lambda a: LAW(a),
}


@checked
@given(st.sampled_from(sorted(OF_REAL)), st.sampled_from(REAL), layouts)
def test_any_layout_of_a_real_map_is_the_same_map(function: str, dtype: str, layout: Layout) -> None:
    values = HEIGHTS + 1
    assert numbers(OF_REAL[function](layout(values.astype(dtype)))) == numbers(OF_REAL[function](values))


@checked
@given(st.sampled_from(sorted(OF_FLAGS)), st.sampled_from(BINARY), layouts)
def test_any_layout_of_a_contact_map_is_the_same_map(function: str, dtype: str, layout: Layout) -> None:
    assert numbers(OF_FLAGS[function](layout(FLAGS.astype(dtype)))) == numbers(OF_FLAGS[function](FLAGS))


@checked
@given(st.sampled_from(sorted(OF_ROW)), st.sampled_from(REAL), layouts)
def test_any_layout_of_a_row_is_the_same_row(function: str, dtype: str, layout: Layout) -> None:
    values = np.tile([1.0, 30.0, 50.0], (2, 1))
    laid = layout(values.astype(dtype))
    row = laid.view(np.ndarray)[0] if isinstance(laid, Own) else laid.transpose("y", "x")[0] if hasattr(laid, "dims") else laid[0]
    assert numbers(OF_ROW[function](row)) == numbers(OF_ROW[function](values[0]))


@pytest.mark.parametrize("function", OF_REAL)
@pytest.mark.parametrize("part", [np.s_[:1], np.s_[:, :1], np.s_[:1, :1]], ids=["row", "column", "value"])
def test_broadcast_maps_are_their_copies(function: str, part: Any) -> None:
    view = np.broadcast_to(HEIGHTS[part] + 1, SHAPE)
    assert numbers(OF_REAL[function](view)) == numbers(OF_REAL[function](view.copy()))


@checked
@given(st.sampled_from(["<f8", ">f8", "<f4", ">i2"]), layouts)
def test_results_of_callbacks_are_numbers_of_any_layout(dtype: str, layout: Layout) -> None:
    laid: Any = np.asarray(layout(np.full(SHAPE, 3).astype(dtype)))
    path = asperity.solve(rough(), 1.0, p_star=0.05, observables={"own": lambda state: laid[1, 1], "view": lambda state: laid[0, 0, ...]})
    assert path[0].observed == {"own": 3.0, "view": 3.0}
    law = asperity.TabulatedLaw(lambda gap: laid[1, 2, ...] * max(1 - gap / 100, 0), cutoff=100.0)
    assert law(0.0) == 3.0


@pytest.mark.parametrize("value", [np.complex128(1 + 2j), np.array("1.5"), np.str_("1.5"), np.timedelta64(3, "s"), np.bool_(True)])
def test_what_numpy_turns_into_another_number_is_refused(value: Any) -> None:
    with pytest.raises(InputError, match="accepted: a number"):
        asperity.solve(rough(), 1.0, p_star=0.05, observables={"own": lambda state: value})
    with pytest.raises(InputError, match="accepted: a number"):
        asperity.contact_area(HEIGHTS, (8.0, 6.0), threshold=value)


def test_masked_contacts_and_rows_are_refused() -> None:
    masked: Any = np.ma.masked_array(FLAGS, mask=HEIGHTS > 90)
    for function in OF_FLAGS.values():
        with pytest.raises(InputError, match="masked"):
            function(masked)
    row: Any = np.ma.masked_array([1.0, 30.0, 50.0], mask=[False, True, False])
    for function in OF_ROW.values():
        with pytest.raises(InputError, match="masked"):
            function(row)


def test_bools_of_files_have_any_bits() -> None:
    bits = np.where(FLAGS, RNG.integers(1, 256, SHAPE), 0).astype(np.uint8)
    for function in OF_FLAGS.values():
        assert numbers(function(np.frombuffer(bits.tobytes(), bool).reshape(SHAPE))) == numbers(function(FLAGS))


def test_a_pickled_surface_is_read_from_any_place_of_memory() -> None:
    buffers: list[pickle.PickleBuffer] = []
    data = pickle.dumps(rough(), 5, buffer_callback=buffers.append)
    copies = [memoryview(bytearray(3) + bytes(buffer.raw()))[3:] for buffer in buffers]
    aligned = pickle.loads(pickle.dumps(rough()))
    assert copies and np.array_equal(pickle.loads(data, buffers=copies).heights, aligned.heights)
    np.testing.assert_allclose(aligned.heights, rough().heights, rtol=1e-13)


#: Runs one function on a map that the limit of address space does not hold, or hardly.
UNDER_LIMIT = """
import resource, sys
import numpy as np
import asperity
call, bytes_left, side = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
ones = {dtype: np.broadcast_to(np.ones((1, 1), dtype), (side, side)) for dtype in ("f8", "f4", "?", "u1")}
calls = {
    "from_array": lambda a: asperity.Surface.from_array(a["f4"], 1.0, touching="low-points"),
    "contact_area": lambda a: asperity.contact_area(a["f8"], (1.0, 1.0)),
    "gap_distribution": lambda a: asperity.gap_distribution(a["f4"], [0, 2]),
    "stress_distribution": lambda a: asperity.stress_distribution(a["f8"], a["u1"], [0, 2]),
    "hydraulic_gap": lambda a: asperity.hydraulic_gap(a["f8"]),
    "subsurface": lambda a: asperity.subsurface(a["f8"], (1.0, 1.0), 0.5, poisson=0.3),
    "clusters": lambda a: asperity.clusters(a["?"]),
    "percolation": lambda a: asperity.percolation(a["u1"]),
    "compare_maps": lambda a: asperity.compare_maps(a["?"], a["u1"]),
    "law": lambda a: asperity.TabulatedLaw(lambda gap: max(1 - gap, 0), cutoff=1.0)(a["f4"]),
    "edges": lambda a: asperity.gap_distribution(np.ones((2, 2)), np.broadcast_to(np.float32(1), (side * side,))),
    "hardness": lambda a: asperity.solve(asperity.Surface.from_spectrum(8, seed=1, lambda_s=0.5), 1.0, p_star=0.1, hardness=a["f4"]),
    "heights": lambda a: asperity.Surface.from_spectrum(side, seed=1, lambda_s=0.2).heights,
    "statistics": lambda a: asperity.Surface.from_spectrum(side, seed=1, lambda_s=0.2).statistics(),
    "solve": lambda a: asperity.solve(asperity.Surface.from_spectrum(side, seed=1, lambda_s=0.2), 1.0, p_star=0.05),
    "resample": lambda a: asperity.Surface.from_array(
        np.eye(8), 1.0, touching="low-points", preparation={"resample": (side, side)}),
}
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
if bytes_left:
    resource.setrlimit(resource.RLIMIT_AS, (used + bytes_left,) * 2)
try:
    calls[call](ones)
except (asperity.ResourceError, asperity.InputError) as error:
    print(type(error).__name__, error)
"""

CALLS = [line.split('"')[1] for line in UNDER_LIMIT.splitlines() if line.startswith('    "') and "lambda" in line]


def limited(call: str, left: int, side: int) -> str:
    words = [sys.executable, "-c", UNDER_LIMIT, call, str(left), str(side)]
    ended = subprocess.run(words, capture_output=True, text=True, env={"RAYON_NUM_THREADS": "1"})
    assert ended.returncode == 0, f"{call}, {left} bytes left: exit code {ended.returncode}\n{ended.stderr[-2000:]}"
    return ended.stdout


@pytest.mark.parametrize("call", CALLS)
def test_maps_beyond_all_memory_are_refused_with_their_name(call: str) -> None:
    said = limited(call, 0, 10**6)
    assert said.startswith(("ResourceError", "InputError")), said


@pytest.mark.parametrize("call", CALLS)
def test_memory_that_cannot_be_had_is_an_error(call: str) -> None:
    # 4.2 million values, from none of their copies to all of them.
    for left in range(8, 400, 28):
        limited(call, left << 20, 2048)


def test_threads_are_bounded() -> None:
    with pytest.raises(InputError, match="up to 1024|to 1024"):
        asperity.solve(rough(), 1.0, p_star=0.05, threads=65536)
    code = "import asperity; asperity.hydraulic_gap([[1.0, 2.0]])"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env={"RAYON_NUM_THREADS": "100000"})
    assert "InputError: environment: RAYON_NUM_THREADS" in ended.stderr and "up to 1024" in ended.stderr, ended.stderr
