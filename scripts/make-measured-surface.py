#!/usr/bin/env python3
"""Writes configs/measured-surface.txt: a map as an instrument exports it, with known defects.

Part of a self-affine surface (H = 0.8) that does not repeat, tilted, with noise and points that were not measured, as text with the
header of a Gwyddion export. Usage: make-measured-surface.py > configs/measured-surface.txt
"""

import numpy as np

NX, NY, CELL = 96, 64, 30e-6  # columns, rows, extent in x in m
rng = np.random.default_rng(5)
n = 4 * NX
q = np.hypot(*np.meshgrid(np.fft.fftfreq(n, 1 / n), np.fft.fftfreq(n, 1 / n)))
amplitude = np.where((q >= 8) & (q <= n / 8), np.maximum(q, 24.0) ** -1.8, 0.0)
noise = rng.standard_normal((n, n))
wide = np.fft.ifft2(np.fft.fft2(noise) * amplitude).real
heights = wide[:NY, :NX] / wide.std() * 0.15e-6
y, x = np.mgrid[:NY, :NX]
heights += 0.03 * CELL / NX * x - 0.02 * CELL / NX * y  # tilt
heights += 1e-9 * rng.standard_normal((NY, NX))  # noise of the instrument
heights[rng.random((NY, NX)) < 0.005] = np.nan  # single points
heights[40:43, 70:74] = np.nan  # a hole

print("# Channel: Height")
print(f"# Width: {CELL * 1e6:.2f} µm")
print(f"# Height: {CELL * 1e6 * NY / NX:.2f} µm")
print("# Value units: m")
print("# Not measured: scripts/make-measured-surface.py made it.")
for row in heights:
    print("\t".join(f"{h:.5e}" for h in row))
