#!/usr/bin/env python3
"""Solves on the processor and on a GPU, and compares contact, gap, stress and time.

    scripts/gpu.py --asperity target/release/asperity
    scripts/gpu.py --asperity target/release/asperity --sizes 8192,16384,32768

Without --sizes small grids with all that `--device cuda` supports are solved to rounding; with it the surface of the challenge (p* = 0.01, f32,
default tolerance) on these grids: time of the solve, of a transform pair
on the GPU (from a solve with a tolerance below the rounding of f32), and the bytes that it moves at least, per second. The program must have been built with --features cuda. Differences of fields are relative, in the 2-norm. No packages.
"""

import argparse
import array
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

SMALL = "--challenge 1024 --seed 3 --cut-off 0.004"
ADHESION = "--work-of-adhesion 2e-5 --adhesion-range 2e-3"
CASES = {
    "hard wall, f64": f"{SMALL} --p-star 0.02 --precision f64",
    "hard wall, f32": f"{SMALL} --p-star 0.02 --precision f32",
    "adhesion, f64, loading and unloading": f"{SMALL} --p-star 0.01,0.03 --unload {ADHESION} --precision f64",
    "adhesion, f32": f"{SMALL} --p-star 0.01 {ADHESION} --precision f32",
    "imposed mean gap, f64": f"{SMALL} --mean-gap 0.02 --precision f64",
    "layer, f64": f"{SMALL} --p-star 0.02 --thickness 0.1 --poisson 0.3 --precision f64",
    "cubic crystal, f64": f"{SMALL} --p-star 0.02 --crystal 168.4,121.4,75.4 --precision f64",
    "odd number of points, f64": "--challenge 1125 --seed 3 --cut-off 0.004 --p-star 0.02 --precision f64",
    "all waves of the grid, f64": "--challenge 1024 --seed 3 --p-star 0.02 --precision f64",
}
SMALL_COLUMNS = ["", "pairs, CPU", "GPU", "s, CPU", "GPU", "contact", "mean gap", "gap", "stress"]

# Bytes per point that a pair of the linear problem reads and writes: transforms of two passes over 4 bytes each way (32), the
# multiplication of the spectrum (8), and the mean of the sweeps `conjugate` (12) and `descend` (26).
BYTES = 59


def field(path):
    """Values of a .npy file of floats."""
    raw = path.read_bytes()
    length = int.from_bytes(raw[8:10], "little")
    kind = "f" if b"<f4" in raw[10 : 10 + length] else "d"
    return array.array(kind, raw[10 + length :])


def difference(one, other):
    norm = math.sqrt(sum(a * a for a in one))
    return math.sqrt(sum((a - b) ** 2 for a, b in zip(one, other))) / norm


def solve(asperity, device, case, out=None, accepted=(0,)):
    command = [asperity, "--device", device, "solve", *case.split(), "--json"] + (["--out", out] if out else [])
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode not in accepted:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr.strip()}")
    return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


def row(asperity, name, case):
    with tempfile.TemporaryDirectory() as folder:
        outs = [Path(folder) / device for device in ("cpu", "cuda")]
        loads = [solve(asperity, device, case, out) for device, out in zip(("cpu", "cuda"), outs)]
        last = [lines[-1] for lines in loads]
        files = {end: sorted(p.name for p in outs[0].glob(f"*{end}.npy"))[-1] for end in ("gap", "stress")}
        errors = {end: difference(field(outs[0] / f), field(outs[1] / f)) for end, f in files.items()}
    relative = [abs(last[1][key] / last[0][key] - 1) for key in ("contact_fraction", "mean_gap")]
    cells = [name, *(f"{line['fft_pairs']:.1f}" for line in last), *(f"{sum(l['seconds'] for l in lines):.2f}" for lines in loads)]
    cells += [f"{r:.1e}" for r in relative]
    cells += [f"{errors[n]:.1e}" for n in ("gap", "stress")]
    print("| " + " | ".join(cells) + " |", flush=True)


def large(asperity, n, cpu):
    """Time of both, and of a transform pair on the GPU, from the same solve with a tolerance below the rounding of f32."""
    case = f"--challenge {n} --p-star 0.01 --precision f32"
    solve(asperity, "cuda", case)  # cuFFT reads its kernels for these sizes
    loads = [solve(asperity, device, case)[-1] for device in (["cpu"] if cpu else []) + ["cuda"]]
    gpu, stalled = loads[-1], solve(asperity, "cuda", f"{case} --tolerance 1e-7", accepted=(3,))[-1]
    per_pair = (stalled["seconds"] - gpu["seconds"]) / (stalled["fft_pairs"] - gpu["fft_pairs"])
    cells = [f"{n}²", f"{loads[0]['seconds']:.2f}" if cpu else "", f"{gpu['seconds']:.2f}", f"{gpu['fft_pairs']:.1f}"]
    cells += [f"{1e3 * per_pair:.2f}", f"{BYTES * n * n / per_pair / 1e12:.2f}"]
    cells += [f"{abs(gpu[key] / loads[0][key] - 1):.1e}" if cpu else "" for key in ("contact_fraction", "mean_gap")]
    print("| " + " | ".join(cells) + " |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--asperity", default="asperity")
    parser.add_argument("--sizes", help="points per side, separated by commas")
    parser.add_argument("--no-cpu", action="store_true", help="with --sizes: on the GPU alone")
    arguments = parser.parse_args()
    columns = ["", "s, CPU", "GPU", "pairs", "ms per pair", "TB/s", "contact", "mean gap"] if arguments.sizes else SMALL_COLUMNS
    print("| " + " | ".join(columns) + " |\n|" + "---|" * len(columns))
    if arguments.sizes:
        for n in arguments.sizes.split(","):
            large(arguments.asperity, int(n), not arguments.no_cpu)
    else:
        for name, case in CASES.items():
            row(arguments.asperity, name, case)


if __name__ == "__main__":
    main()
