#!/usr/bin/env python3
"""Accepted ranges of the challenge's statements S04, A01 and A02 from independent code.

    challenge-ranges.py [--realisations N] [--grid N] [--gap-grid N]

Draws Gaussian surfaces with the challenge's spectrum by NumPy, and solves them at the reference load by Tamaas. Prints mean, standard
deviation over the realisations and standard error of the mean of: rms height, mean minus lowest height and range of heights (µm) on the
grid that holds every wave; mean gap (µm) and contact stiffness (E* ḡ/L) on the grid of A01 and A02. Needs the packages of
benches/peers/requirements.txt.
"""

import argparse

import numpy as np

LENGTH_UM = 100.0
HURST = 0.8
ROLL_OFF, CUT_OFF = 5, 1000  # L over the wavelengths 20 µm and 0.1 µm
LOADS = (0.01, 0.0104)  # p* of the reference load, and of the difference quotient
TOLERANCE = 1e-7  # of Tamaas; 1e-8 changes the mean gap by less than 1e-6 of itself


def surface(points, rng):
    """Heights [points, points] in µm: spectrum flat below the roll-off, rms gradient 1 in expectation over all waves."""
    def power(mode2):
        inside = (mode2 > 0) & (mode2 <= CUT_OFF**2)
        return np.where(inside, np.maximum(mode2, ROLL_OFF**2) ** -(1.0 + HURST), 0.0)

    # Mean square gradient of the full spectrum, whatever the grid holds of it.
    m = np.arange(-CUT_OFF, CUT_OFF + 1.0) ** 2
    gradient2 = sum((power(m + k * k) * (m + k * k)).sum() for k in range(-CUT_OFF, CUT_OFF + 1)) * (2 * np.pi / LENGTH_UM) ** 2
    x, y = np.fft.rfftfreq(points, 1 / points), np.fft.fftfreq(points, 1 / points)
    mode2 = x[None, :] ** 2 + y[:, None] ** 2
    white = np.fft.rfft2(rng.standard_normal((points, points))) / points
    return np.fft.irfft2(white * np.sqrt(power(mode2) / gradient2), (points, points)) * points**2


def gap_and_stiffness(heights):
    """Mean gap in µm and stiffness in E* ḡ/L at the reference load; low points touch first."""
    import tamaas

    tamaas.set_log_level(tamaas.LogLevel.warning)
    profile = np.ascontiguousarray((heights.max() - heights) / LENGTH_UM)
    gaps = []
    for load in LOADS:
        model = tamaas.Model(tamaas.model_type.basic_2d, [1.0, 1.0], list(profile.shape))
        model.E, model.nu = 1.0, 0.0
        solver = tamaas.PolonskyKeerRey(model, profile, TOLERANCE)
        solver.max_iter = 5_000
        assert solver.solve(load) <= TOLERANCE, "Tamaas has not converged"
        gap = model.displacement - profile
        gaps.append((gap - gap.min()).mean())
    return gaps[0] * LENGTH_UM, (LOADS[1] - LOADS[0]) / (gaps[0] - gaps[1])


def main():
    a = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    a.add_argument("--realisations", type=int, default=100)
    a.add_argument("--grid", type=int, default=2048)
    a.add_argument("--gap-grid", type=int, default=512)
    given = a.parse_args()
    rows = {name: [] for name in ("rms height, µm", "mean minus lowest, µm", "range, µm", "mean gap, µm", "stiffness, E* ḡ/L")}
    for seed in range(given.realisations):
        rng = np.random.default_rng(seed)
        h = surface(given.grid, rng)
        found = [h.std(), h.mean() - h.min(), np.ptp(h), *gap_and_stiffness(surface(given.gap_grid, rng))]
        for name, value in zip(rows, found):
            rows[name].append(value)
    for name, values in rows.items():
        sd = np.std(values, ddof=1)
        print(f"{name:24} {np.mean(values):.4f} ± {sd:.4f} (standard error {sd / len(values)**0.5:.4f}, n = {len(values)})")


if __name__ == "__main__":
    main()
