"""Surfaces of scripts/errors.py: heights of a rigid surface whose low points touch first, on a unit cell, on any grid.

A `Surface` is either a Fourier series (`modes`, interpolated to any grid of at least its own points), cells of equal height (`cells`,
repeated), or a function of the coordinates.
"""

import numpy as np


class Surface:
    """Heights on n × n nodes at i/n, for n of at least `points`."""

    def __init__(self, kind, points, modes=None, cells=None, function=None):
        self.kind, self.points, self.modes, self.cells, self.function = kind, points, modes, cells, function

    def heights(self, n):
        if self.cells is not None:
            factor, rest = divmod(n, self.cells.shape[0])
            if rest:
                raise ValueError(f"{n} is no multiple of {self.cells.shape[0]}")
            return np.repeat(np.repeat(self.cells, factor, 0), factor, 1)
        if self.modes is not None:
            return interpolated(self.modes, n)
        y, x = np.meshgrid(np.arange(n) / n, np.arange(n) / n, indexing="ij")
        return self.function(x, y)

    def rms_gradient(self, n=256):
        """As asperity computes it from the Fourier series of the map on its own points."""
        modes = np.fft.fft2(self.heights(self.points)) / self.points**2
        k = np.fft.fftfreq(self.points, 1.0 / self.points)
        q2 = (2 * np.pi) ** 2 * (k[:, None] ** 2 + k[None, :] ** 2)
        return float(np.sqrt(np.sum(q2 * np.abs(modes) ** 2)))


def interpolated(modes, n):
    """The series with these coefficients (numpy's order, over the number of points) on n × n nodes."""
    m = modes.shape[0]
    if n == m:
        return np.fft.ifft2(modes * m * m).real
    k = np.fft.fftfreq(m, 1.0 / m).astype(int)
    wide = np.zeros((n, n), complex)
    keep = np.abs(k) < m / 2
    inside = np.ix_(keep, keep)
    wide[np.ix_(k[keep] % n, k[keep] % n)] = modes[inside]
    return np.fft.ifft2(wide * n * n).real


def band_limited(heights, points, cut):
    """Coefficients on `points`² of heights on a finer grid, without waves shorter than `cut` of the cell or two points."""
    n = heights.shape[0]
    modes = np.fft.fft2(heights) / n**2
    k = np.fft.fftfreq(n, 1.0 / n).astype(int)
    radius = np.hypot(k[:, None], k[None, :])
    modes[radius * cut > 1 + 1e-9] = 0
    keep = np.flatnonzero(np.abs(k) < points / 2)
    result = np.zeros((points, points), complex)
    result[np.ix_(k[keep] % points, k[keep] % points)] = modes[np.ix_(keep, keep)]
    return result


def self_affine_modes(rng, points, hurst, roll_off, cut, stretch=1.0):
    """Random coefficients with the power spectrum of a self-affine surface: constant up to 1/roll_off (none: 0), zero beyond 1/cut."""
    n = points
    k = np.fft.fftfreq(n, 1.0 / n)
    noise = np.fft.fft2(rng.standard_normal((n, n))) / n
    radius = np.hypot(k[:, None], k[None, :])
    shape = np.hypot(k[:, None] * stretch, k[None, :] / stretch)
    first = 1 / roll_off if roll_off else 1.0
    with np.errstate(divide="ignore"):
        amplitude = np.maximum(shape, first) ** -(1.0 + hurst)
    amplitude[(radius * cut > 1 + 1e-9) | (radius == 0)] = 0
    nyquist = np.abs(k) >= n / 2
    amplitude[nyquist, :] = 0
    amplitude[:, nyquist] = 0
    return noise * amplitude


def with_gradient(modes, gradient):
    n = modes.shape[0]
    k = np.fft.fftfreq(n, 1.0 / n)
    q2 = (2 * np.pi) ** 2 * (k[:, None] ** 2 + k[None, :] ** 2)
    return modes * (gradient / np.sqrt(np.sum(q2 * np.abs(modes) ** 2)))


def self_affine(rng, points, hurst, roll_off, cut, gradient, stretch=1.0):
    modes = with_gradient(self_affine_modes(rng, points, hurst, roll_off, cut, stretch), gradient)
    return Surface("anisotropic" if stretch != 1.0 else "self-affine", points, modes=modes)


def line_waves(rng, points, hurst, cut):
    """Random coefficients (numpy's rfft, over the number of points) of a self-affine line of `points`, without waves shorter than `cut`."""
    k = np.arange(points // 2 + 1)
    with np.errstate(divide="ignore"):
        amplitude = np.where((k > 0) & (k * cut <= 1 + 1e-9) & (2 * k < points), k ** -(0.5 + hurst), 0.0)
    return amplitude * (rng.standard_normal(len(k)) + 1j * rng.standard_normal(len(k)))


class Profile:
    """Heights on 1 × n nodes at i/n."""

    function = None

    def __init__(self, rng, points, hurst, cut, gradient):
        waves = line_waves(rng, points, hurst, cut)
        self.kind, self.points, self.waves = "profile", points, waves
        self.waves = waves * (gradient / self.rms_gradient())

    def heights(self, n):
        waves = np.zeros(n // 2 + 1, complex)
        kept = min(len(waves), len(self.waves))
        waves[:kept] = self.waves[:kept]
        return np.fft.irfft(waves, n)[None, :] * n

    def rms_gradient(self):
        k = np.arange(len(self.waves))
        return float(np.sqrt(np.sum(2 * (2 * np.pi * k * np.abs(self.waves)) ** 2)))


def grooves(rng, points, hurst, cut, gradient, noise):
    """Self-affine along x and uniform along y, and isotropic roughness with `noise` times the rms gradient."""
    line = line_waves(rng, points, hurst, cut)
    modes = np.zeros((points, points), complex)
    modes[0, : len(line)] = line
    modes[0, -(len(line) - 1) :] = np.conj(line[:0:-1])
    fine = with_gradient(self_affine_modes(rng, points, hurst, 0.0, cut), noise * gradient)
    return Surface("grooves", points, modes=with_gradient(modes, gradient) + fine)


def plateau_honed(rng, points, cut, gradient):
    """A fine roughness whose high points are worn down, crossed by grooves: band-limited afterwards."""
    n = 8 * points
    fine = interpolated(self_affine_modes(rng, points, 0.7, 0.0, cut), n)
    fine /= fine.std()
    y, x = np.meshgrid(np.arange(n) / n, np.arange(n) / n, indexing="ij")
    grooves = np.zeros((n, n))
    for sign in (1, -1):
        for _ in range(2):
            a, b, phase = rng.integers(1, 4), rng.integers(1, 4), rng.uniform()
            grooves += np.maximum(0.0, np.cos(2 * np.pi * (a * x + sign * b * y + phase)) - 0.8) / 0.2
    worn = np.maximum(fine, np.quantile(fine, rng.uniform(0.2, 0.6)))
    worn = worn + rng.uniform(0.01, 0.1) * fine + 5.0 * grooves
    return Surface("plateau-honed", points, modes=with_gradient(band_limited(worn, points, cut), gradient))


def stepped(rng, points, gradient):
    """Terraces, flat punches or gratings: heights of cells."""
    which = rng.choice(["terraces", "punches", "grating", "random cells"])
    step = gradient / points * rng.uniform(1.0, 10.0)
    y, x = np.meshgrid(np.arange(points), np.arange(points), indexing="ij")
    if which == "terraces":
        smooth = interpolated(self_affine_modes(rng, points, rng.uniform(0.5, 1.0), 0.0, rng.uniform(0.1, 0.3)), points)
        cells = step * np.round(rng.uniform(1.0, 3.0) * smooth / smooth.std())
    elif which == "punches":
        cells = np.full((points, points), 4.0 * step)
        for _ in range(rng.integers(1, 6)):
            w, h = rng.integers(points // 12, points // 3, 2)
            i, j = rng.integers(0, points, 2)
            inside = ((x - i) % points < w) & ((y - j) % points < h)
            cells[inside] = step * rng.integers(0, 3)
    elif which == "grating":
        period = int(rng.choice([d for d in (8, 16, 32) if points % d == 0]))
        cells = np.where((x % period) < rng.integers(2, period - 1), 0.0, step * 3.0)
        if rng.uniform() < 0.5:
            cells = cells + np.where((y % period) < rng.integers(2, period - 1), 0.0, step * 2.0)
    else:
        coarse = rng.integers(0, 4, (points // 4, points // 4)) * step
        cells = np.repeat(np.repeat(coarse, 4, 0), 4, 1)
    return Surface("stepped", points, cells=np.ascontiguousarray(cells, float))


def bump(rng, points, gradient):
    """One rounded bump, anywhere relative to the nodes; some elliptic."""
    a, b = rng.uniform(0.45, 0.55, 2)
    rx, ry = rng.uniform(0.5, 1.0, 2) if rng.uniform() < 0.5 else (1.0, 1.0)
    kind = rng.choice(["parabola", "cosine", "quartic"])

    def height(x, y):
        # The nearest image: in a periodic cell the map has a kink at the edge and no step.
        dx, dy = ((t + 0.5) % 1.0 - 0.5 for t in (x - a, y - b))
        r2 = (dx / rx) ** 2 + (dy / ry) ** 2
        if kind == "parabola":
            return gradient * r2
        if kind == "quartic":
            return gradient * 4 * r2**2
        return gradient * (2 - np.cos(2 * np.pi * (x - a)) / rx - np.cos(2 * np.pi * (y - b)) / ry) / (2 * np.pi)

    return Surface("bump", points, function=height)
