"""Evaluates a pressure field independently of the tool that computed it.

usage: evaluate.py HEIGHTS.npy PRESSURE FIELD [REFERENCE]

Heights over the cell's extent, low points known_contact first. A field is a .npy of the contact pressure over E*, or a folder
written by `asperity solve --out`: its stress where its contact map is set, zero elsewhere. Prints one line of JSON:

area              fraction of the nodes in contact: positive pressure, or the contact map
mean_gap          of the gap h + u - d, where u follows from the pressure alone and d such that its mean over the contact is zero
complementarity   mean of p |gap| over mean pressure and rms height
penetration       largest negative gap over the rms height
load_error        relative error of the mean of the field; the field is then scaled to the pressure
energy            -<p u>/2 - <p h>: never above the free energy per area of the solution, and equal to it there
pixels            nodes in contact in either field or reference, not in both
gap_difference    relative difference of the mean gaps of field and reference
energy_difference the same of the energies
area_difference   the same of the areas
"""

import json
import sys
from pathlib import Path

import numpy as np


def displacement(pressure):
    """u_q = 2 p_q / (E* |q|) on a periodic cell of extent 1 with E* = 1; the mean of u is zero."""
    rows, columns = pressure.shape
    n_y = np.fft.fftfreq(rows, 1 / rows)[:, None]
    n_x = np.arange(columns // 2 + 1)[None, :]
    q = 2 * np.pi * np.hypot(n_x, n_y)
    q[0, 0] = np.inf
    return np.fft.irfft2(np.fft.rfft2(pressure) * (2 / q), s=pressure.shape)


def read(path):
    """Pressure, non-negative and zero outside contact, and the map of contact."""
    if Path(path).is_dir():
        contact = np.load(Path(path) / "contact.npy").astype(bool)
        return np.where(contact, np.maximum(np.load(Path(path) / "stress.npy"), 0.0), 0.0), contact
    pressure = np.maximum(np.load(path), 0.0)
    return pressure, pressure > 0


def evaluate(heights, load, path):
    """The numbers above, and the map of contact."""
    pressure, contact = read(path)
    mean = pressure.mean()
    pressure *= load / mean
    h = heights - heights.mean()
    rms = h.std()
    u = displacement(pressure)
    gap = h + u
    gap -= gap[contact].mean()
    found = dict(
        area=contact.mean(),
        mean_gap=gap.mean(),
        complementarity=(pressure * np.abs(gap)).mean() / (load * rms),
        penetration=max(0.0, -gap.min()) / rms,
        load_error=abs(mean / load - 1),
        energy=-0.5 * (pressure * u).mean() - (pressure * h).mean(),
    )
    return {key: float(value) for key, value in found.items()}, contact


def main():
    heights, load = np.load(sys.argv[1]), float(sys.argv[2])
    found, contact = evaluate(heights, load, sys.argv[3])
    if len(sys.argv) > 4:
        known, known_contact = evaluate(heights, load, sys.argv[4])
        found["pixels"] = int((contact != known_contact).sum())
        found["area_difference"] = abs(found["area"] / known["area"] - 1)
        found["gap_difference"] = abs(found["mean_gap"] / known["mean_gap"] - 1)
        found["energy_difference"] = abs(found["energy"] / known["energy"] - 1)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
