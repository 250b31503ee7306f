#!/usr/bin/env python3
"""Compares contact with a hardness between asperity and ContactMechanics on the same map, one thread each.

    benches/peers/hardness.py [--points N] [--waves N] [--ratios LIST] [--alone] [--asperity PROGRAM]

Prints for each ratio of pressure to hardness the nodes that differ in contact and in flow, the largest difference of the stress over the
hardness, the processor times of both solvers, and transform pairs and processor time of asperity over those of its elastic solve. ContactMechanics is installed as by compare.py. A seed of its own makes the map.
"""

import argparse
import json
import os
import subprocess

from compare import HERE, PYTHON, ROOT, WORK, install

PRESSURE = 0.03
# At 0.5 ContactMechanics does not converge.
RATIOS = (0.1, 0.2, 0.3)
# Both leave stresses of about this size, over the hardness.
TOLERANCES = {"asperity": 1e-9, "ContactMechanics": 1e-7}
# Nodes within this of the hardness flow.
AT_HARDNESS = 1e-6

# Waves of random phase, self-affine with a Hurst exponent of 0.8 from half of the cell down, rms gradient 1.
MAP = """
import sys, numpy as np
n, waves = map(int, sys.argv[1:3])
q = np.fft.fftfreq(n, 1 / n)
x, y = np.meshgrid(q, q)
k = np.hypot(x, y)
phases = np.exp(2j * np.pi * np.random.default_rng(5).random((n, n)))
h = np.fft.ifft2(np.where((k >= 2) & (k <= waves), np.maximum(k, 1) ** -1.8, 0) * phases).real
slope = [np.fft.ifft2(2j * np.pi * axis * np.fft.fft2(h)).real for axis in (x, y)]
h /= np.sqrt((slope[0] ** 2 + slope[1] ** 2).mean())
np.save(sys.argv[3], h - h.min())
"""

DIFFERENCES = """
import sys, json, numpy as np
ours, theirs, contact = (np.load(f) for f in sys.argv[1:4])
hardness, at = float(sys.argv[4]), 1 - float(sys.argv[5])
print(json.dumps(dict(
    contact=int(((theirs > 0) != (contact != 0)).sum()),
    flow=int(((theirs >= at * hardness) != (ours >= at * hardness)).sum()),
    stress=float(abs(ours - theirs).max() / hardness))))
"""


def run(*command):
    environment = os.environ | {v: "1" for v in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
    return subprocess.run([str(c) for c in command], check=True, capture_output=True, text=True, env=environment).stdout


def solve(asperity, heights, out, *flags):
    """The JSON of a solve of the map under the pressure."""
    command = [asperity, "solve", heights, "--length", 1, "--modulus", 1, "--touching", "low-points", "--pressure", PRESSURE]
    command += ["--tolerance", TOLERANCES["asperity"], "--threads", 1, "--json", "--out", out, "--overwrite"]
    return json.loads(run(*command, *flags))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=256)
    parser.add_argument("--waves", type=int, default=32, help="of the shortest wavelength along the cell")
    parser.add_argument("--ratios", default=",".join(map(str, RATIOS)), help="pressures over hardness")
    parser.add_argument("--alone", action="store_true", help="asperity only: its cost over that of the elastic solve")
    parser.add_argument("--asperity", default=ROOT / "target/release/asperity")
    given = parser.parse_args()
    install()
    heights, theirs, out = WORK / "hardness.npy", WORK / "hardness-stress.npy", WORK / "hardness"
    run(PYTHON, "-c", MAP, given.points, given.waves, heights)
    elastic = solve(given.asperity, heights, out)
    print(f"elastic: {elastic['fft_pairs']:.0f} transform pairs, {elastic['cpu_seconds']:.2f} s")
    print(
        "p/H   contact   nodes: contact  flow   stress/H   processor time / s: asperity  ContactMechanics  ratio   over elastic: pairs  time",
        flush=True,
    )
    for ratio in map(float, given.ratios.split(",")):
        hardness = PRESSURE / ratio
        own = solve(given.asperity, heights, out, "--hardness", hardness)
        over = [own[key] / elastic[key] for key in ("fft_pairs", "cpu_seconds")]
        if given.alone:
            print(f"{ratio}: {own['fft_pairs']:.0f} transform pairs, {own['cpu_seconds']:.2f} s, over elastic {over[0]:.2f} {over[1]:.2f}")
            continue
        script = HERE / "contactmechanics_hardness.py"
        peer = json.loads(run(PYTHON, script, heights, PRESSURE, hardness, TOLERANCES["ContactMechanics"], theirs))
        if not peer["converged"]:
            print(
                f"{ratio}: asperity {own['cpu_seconds']:.2f} s, over elastic {over[0]:.2f} {over[1]:.2f}; ContactMechanics has not converged"
                f" after {peer['iterations']} iterations, {peer['cpu_seconds']:.0f} s"
            )
            continue
        fields = (out / "stress.npy", theirs, out / "contact.npy")
        found = json.loads(run(PYTHON, "-c", DIFFERENCES, *fields, hardness, AT_HARDNESS))
        times = own["cpu_seconds"], peer["cpu_seconds"]
        print(
            f"{ratio:<5} {100 * own['contact_area']:6.2f} %  {found['contact']:14} {found['flow']:5} {found['stress']:10.1e}"
            f" {times[0]:29.2f} {times[1]:17.2f} {times[1] / times[0]:6.0f} {over[0]:20.2f} {over[1]:5.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
