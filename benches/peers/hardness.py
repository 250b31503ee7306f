#!/usr/bin/env python3
"""Compares contact with a hardness between asperity and ContactMechanics on the same map, one thread each.

    benches/peers/hardness.py [--points N] [--asperity PROGRAM]

Prints for each ratio of pressure to hardness the nodes that differ in contact and in flow, the largest difference of the stress over the
hardness, and the processor times of both solvers. ContactMechanics is installed as by compare.py. A seed of its own makes the map.
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

# Waves of random phase, self-affine with a Hurst exponent of 0.8 between half and 1/32 of the cell, rms gradient 1.
MAP = """
import sys, numpy as np
n = int(sys.argv[1])
q = np.fft.fftfreq(n, 1 / n)
x, y = np.meshgrid(q, q)
k = np.hypot(x, y)
phases = np.exp(2j * np.pi * np.random.default_rng(5).random((n, n)))
h = np.fft.ifft2(np.where((k >= 2) & (k <= 32), np.maximum(k, 1) ** -1.8, 0) * phases).real
slope = [np.fft.ifft2(2j * np.pi * axis * np.fft.fft2(h)).real for axis in (x, y)]
h /= np.sqrt((slope[0] ** 2 + slope[1] ** 2).mean())
np.save(sys.argv[2], h - h.min())
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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=256)
    parser.add_argument("--asperity", default=ROOT / "target/release/asperity")
    given = parser.parse_args()
    install()
    heights, theirs, out = WORK / "hardness.npy", WORK / "hardness-stress.npy", WORK / "hardness"
    run(PYTHON, "-c", MAP, given.points, heights)
    print("p/H   contact   nodes: contact  flow   stress/H   processor time / s: asperity  ContactMechanics  ratio")
    for ratio in RATIOS:
        hardness = PRESSURE / ratio
        script = HERE / "contactmechanics_hardness.py"
        peer = json.loads(run(PYTHON, script, heights, PRESSURE, hardness, TOLERANCES["ContactMechanics"], theirs))
        if not peer["converged"]:
            print(f"{ratio}: ContactMechanics has not converged after {peer['iterations']} iterations")
            continue
        flags = ["--length", 1, "--modulus", 1, "--touching", "low-points", "--pressure", PRESSURE, "--hardness", hardness]
        flags += ["--tolerance", TOLERANCES["asperity"], "--threads", 1, "--json", "--out", out, "--overwrite"]
        own = json.loads(run(given.asperity, "solve", heights, *flags))
        fields = (out / "stress.npy", theirs, out / "contact.npy")
        found = json.loads(run(PYTHON, "-c", DIFFERENCES, *fields, hardness, AT_HARDNESS))
        times = own["cpu_seconds"], peer["cpu_seconds"]
        print(
            f"{ratio:<5} {100 * own['contact_fraction']:6.2f} %  {found['contact']:14} {found['flow']:5} {found['stress']:10.1e}"
            f" {times[0]:29.2f} {times[1]:17.2f} {times[1] / times[0]:6.0f}"
        )


if __name__ == "__main__":
    main()
