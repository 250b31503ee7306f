"""Surfaces of the problems, and what their fields of pressure are judged by: no program that is compared computes anything here.

usage: evaluator.py surface KIND POINTS SEED OUT.npy
       evaluator.py judge HEIGHTS.npy PRESSURE LAW FIELD [REFERENCE]

Cell of extent 1, E* = 1, low points touch first. KIND: rough (self-affine, rms gradient 1) or sphere. The first prints the pressure of full
contact of the surface. LAW: hard, a hardness, love or truncated; the last two are the half-space without periodic images. FIELD: a .npy, or
a folder of `asperity solve --out`. REFERENCE: a field, a mean gap, hertz, full for the full contact, or none. A line of JSON:

complementarity   (<p g+> + <(H - p) g->) / (mean pressure * rms height), H the hardness: a bound of the error of the energy
bounds            the most by which pressures are negative or above the hardness, over the mean pressure
load              relative error of the mean pressure
area, mean_gap    share of nodes with pressure, mean of g+
nodes, gap, pressure   nodes in contact in one of field and reference only; relative differences of mean gap and peak pressure, for the full
                  contact the largest difference of the pressure over its mean
"""

import json
import sys
from pathlib import Path

import numpy as np
from scipy.fft import next_fast_len
from scipy.special import itj0y0

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "peers"))
from evaluate import displacement

HURST, LONGEST, SHORTEST = 0.8, 4, 64  # wavelengths of the rough surface are 1/4 to 1/64 of the extent
SPHERE = 1.0  # radius over the extent


def wave_numbers(rows: int, columns: int, extent: float = 1.0) -> np.ndarray:
    """|q| for a real transform."""
    return 2 * np.pi / extent * np.hypot(np.fft.fftfreq(rows, 1 / rows)[:, None], np.arange(columns // 2 + 1)[None, :])


def surface(kind: str, points: int, seed: int) -> np.ndarray:
    if kind == "sphere":
        x = (np.arange(points) + 0.5) / points - 0.5
        return (x[:, None] ** 2 + x[None, :] ** 2) / (2 * SPHERE)
    # The same waves on every grid.
    n, q = 2 * SHORTEST, wave_numbers(points, points)
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal((n, n)))
    spectrum, rows = np.zeros(q.shape, complex), np.fft.fftfreq(n, 1 / n).astype(int)
    spectrum[rows, : n // 2 + 1] = noise
    k = q / (2 * np.pi)
    inside = (k >= LONGEST) & (k <= SHORTEST - 1)
    spectrum = np.where(inside, np.maximum(k, 1) ** (-1 - HURST) * spectrum / np.maximum(abs(spectrum), 1e-300), 0)
    heights = np.fft.irfft2(spectrum, s=(points, points))
    # Parseval: the mean square of the gradient is that of q times the heights.
    return heights / np.fft.irfft2(q * spectrum, s=(points, points)).std()


def full_contact(heights: np.ndarray) -> np.ndarray:
    """The pressure that flattens the surface, without its mean."""
    return -np.fft.irfft2(wave_numbers(*heights.shape) / 2 * np.fft.rfft2(heights), s=heights.shape)


def love(pressure: np.ndarray) -> np.ndarray:
    """Displacement without images under uniform pressure on each pixel (Love 1929), by a convolution on twice the points."""
    n, shape = pressure.shape[0], tuple(2 * m for m in pressure.shape)
    x = np.fft.fftfreq(2 * n, 1 / (2 * n)) / n
    edges, influence = ((x + 0.5 / n, 1), (x - 0.5 / n, -1)), np.zeros(shape)
    for a, b in ((a, b) for a in edges for b in edges):
        y, x = a[0][:, None], b[0][None, :]
        influence += a[1] * b[1] * (x * np.arcsinh(y / abs(x)) + y * np.arcsinh(x / abs(y))) / np.pi
    convolved = np.fft.irfft2(np.fft.rfft2(pressure, s=shape) * np.fft.rfft2(influence), s=shape)
    return convolved[:n, : pressure.shape[1]]


def truncated(pressure: np.ndarray) -> np.ndarray:
    """Displacement without images under the interpolated pressure: 1/(pi r) cut off smoothly beyond the diagonal of the surface, in a cell
    that keeps images apart (Vico, Greengard & Ferrando 2016)."""
    n, diagonal = pressure.shape[0], np.sqrt(2.0)
    m = next_fast_len(int(np.ceil(n * (1 + 1.1 * diagonal))), real=True)
    q = wave_numbers(m, m, m / n)
    lengths, index = np.unique(q, return_inverse=True)
    # A mean of sharp cut-offs, whose factor is the integral of J0; it is 1 to 1e-12 for shorter waves than those.
    s = (2 * np.arange(32) + 1) / 32 - 1
    weights = np.exp(30 * (np.sqrt(1 - s * s) - 1))
    x = diagonal * lengths[lengths * diagonal < 624]
    factor = np.ones_like(lengths)
    factor[: x.size] = sum(w * itj0y0(x * (1.05 + 0.05 * t))[0] for w, t in zip(weights, s, strict=True)) / weights.sum()
    lengths[0], factor[0] = 1.0, 1.05 * diagonal
    compliance = (2 * factor / lengths)[index].reshape(q.shape)
    return np.fft.irfft2(np.fft.rfft2(pressure, s=(m, m)) * compliance, s=(m, m))[:n, :n]


def read(path: str) -> np.ndarray:
    return np.load(Path(path) / "stress.npy" if Path(path).is_dir() else path)


def gap_of(heights: np.ndarray, pressure: np.ndarray, law: str) -> tuple[np.ndarray, float]:
    """The gap and the hardness. The approach is that of the smallest violation: nodes with negative gap share the load at the hardness."""
    operators = {"love": love, "truncated": truncated}
    hardness = np.inf if law in ("hard", *operators) else float(law)
    gap = heights + operators.get(law, displacement)(pressure)
    return gap - np.quantile(gap, pressure.mean() / hardness, method="inverted_cdf"), hardness


def judge(heights: np.ndarray, load: float, law: str, field: str) -> tuple[dict, np.ndarray]:
    pressure = read(field)
    gap, hardness = gap_of(heights, pressure, law)
    open_, closed = np.maximum(gap, 0), np.maximum(-gap, 0)
    violation = (pressure * open_).mean()
    if np.isfinite(hardness):
        violation += ((hardness - pressure) * closed).mean()
    found = dict(
        complementarity=violation / (load * heights.std()),
        bounds=max(0.0, -pressure.min(), pressure.max() - hardness) / load,
        load=abs(pressure.mean() / load - 1),
        area=(pressure > 0).mean(),
        mean_gap=open_.mean(),
    )
    return {key: float(value) for key, value in found.items()}, pressure


def compared(found: dict, pressure: np.ndarray, heights: np.ndarray, load: float, law: str, reference: str) -> dict:
    if reference == "full":
        return dict(pressure=float(abs(pressure - load - full_contact(heights)).max() / load))
    if reference == "hertz":
        radius = (0.75 * load * SPHERE) ** (1 / 3)
        return dict(area=found["area"] / (np.pi * radius**2) - 1, pressure=float(pressure.max() / (2 * radius / (np.pi * SPHERE)) - 1))
    if not Path(reference).exists():
        return dict(gap=found["mean_gap"] / float(reference) - 1)
    known, other = judge(heights, load, law, reference)
    nodes = int(((pressure > 0) != (other > 0)).sum())
    return dict(nodes=nodes, gap=found["mean_gap"] / known["mean_gap"] - 1)


def main() -> None:
    if sys.argv[1] == "surface":
        kind, points, seed, out = sys.argv[2:]
        heights = surface(kind, int(points), int(seed))
        np.save(out, heights)
        print(json.dumps(dict(full_contact=float(-full_contact(heights).min()))))
        return
    heights, load, law = np.load(sys.argv[2]), float(sys.argv[3]), sys.argv[4]
    found, pressure = judge(heights, load, law, sys.argv[5])
    if len(sys.argv) > 6 and sys.argv[6] != "none":
        found["differences"] = compared(found, pressure, heights, load, law, sys.argv[6])
    print(json.dumps(found))


if __name__ == "__main__":
    main()
