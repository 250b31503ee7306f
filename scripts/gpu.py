#!/usr/bin/env python3
"""Solves on the processor and on a GPU, and compares contact, gap, stress and time.

    scripts/gpu.py --asperity target/release/asperity
    scripts/gpu.py --asperity target/release/asperity --sizes 8192,16384,32768

Without --sizes small grids with all that `--device cuda` supports are solved to rounding; with it the surface of the challenge (p* = 0.01, f32,
default tolerance) on these grids: time of the solve, mean time of a transform pair with its sweeps on the GPU (from a solve with a tolerance below the
rounding of f32), and the bytes that it moves at least, per second. The program must have been built with --features cuda. Differences of fields
are relative, in the 2-norm, the largest of all loads. Exit code 1 if they exceed their bounds, or if the GPU does not give the same bits again. No packages.
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
MAP = "--grid 1280 --seed 2 --cut-off 5um --length 1000um"
ADHESION = "--work-of-adhesion 2e-5 --range 2e-3"
# Largest differences of gap and stress, and of contact nodes; the tolerance of the residual is 1e-8 and 1e-2 of the pressure. In f32 rounding may
# decide about a node at the edge of contact.
F64, F32 = (1e-9, 1e-8, 0), (1e-5, 1e-3, 5)
CASES = {
    "hard wall, f64": (f"{SMALL} --p-star 0.02 --precision f64", F64),
    "hard wall, f32": (f"{SMALL} --p-star 0.02 --precision f32", F32),
    "adhesion, f64, loading and unloading": (f"{SMALL} --p-star 0.01,0.03 --unload {ADHESION} --precision f64", F64),
    "adhesion, f32": (f"{SMALL} --p-star 0.01 {ADHESION} --precision f32", F32),
    "imposed mean gap, f64": (f"{SMALL} --mean-gap 0.02 --precision f64", F64),
    "layer, f64": (f"{SMALL} --p-star 0.02 --thickness 0.1 --poisson 0.3 --precision f64", F64),
    "cubic crystal, f32": (f"{SMALL} --p-star 0.02 --crystal 168.4,121.4,75.4 --precision f32", F32),
    "odd number of points, f64": ("--challenge 1125 --seed 3 --cut-off 0.004 --p-star 0.02 --precision f64", F64),
    "prime number of points, f64": ("--challenge 1009 --seed 3 --cut-off 0.004 --p-star 0.02 --precision f64", F64),
    "all waves of the grid, f64": ("--challenge 1024 --seed 3 --p-star 0.02 --precision f64", F64),
    "map of 1280², f64": ("--heights MAP --modulus 1 --pressure 0.02 --precision f64", F64),
}
SMALL_COLUMNS = ["", "pairs, CPU", "GPU", "s, CPU", "GPU", "contact nodes that differ", "mean gap", "gap", "stress"]

# Bytes per point that a pair reads and writes at least: transforms of two passes over 4 bytes each way (32), the multiplication of the spectrum (8),
# and the mean of the sweeps `conjugate` (12) and `descend` (26) of the linear problem; trials take more.
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


def row(asperity, name, case, bounds):
    """Solves all loads on both; returns whether the last states agree."""
    with tempfile.TemporaryDirectory() as folder:
        if "MAP" in case:
            heights = f"{folder}/map.npy"
            subprocess.run([asperity, "surface", *MAP.split(), "--out", heights], check=True, capture_output=True)
            case = case.replace("MAP", heights)
        outs = [Path(folder) / device for device in ("cpu", "cuda")]
        loads = [solve(asperity, device, case, out) for device, out in zip(("cpu", "cuda"), outs)]
        again = Path(folder) / "again"
        solve(asperity, "cuda", case, again)
        files = {end: sorted(p.name for p in outs[0].glob(f"*{end}.npy")) for end in ("gap", "stress")}
        repeats = all((outs[1] / f).read_bytes() == (again / f).read_bytes() for names in files.values() for f in names)
        fields = {end: [[field(out / f) for out in outs] for f in names] for end, names in files.items()}
    errors = [max(difference(*both) for both in fields[end]) for end in ("gap", "stress")]
    nodes = sum((a == 0) != (b == 0) for both in fields["gap"] for a, b in zip(*both))
    pairs = [sum(line["fft_pairs"] for line in lines) for lines in loads]
    relative = max(abs(b["mean_gap"] / a["mean_gap"] - 1) for a, b in zip(*loads))
    cells = [name, *(f"{p:.1f}" for p in pairs), *(f"{sum(l['seconds'] for l in lines):.2f}" for lines in loads), str(nodes)]
    cells += [f"{relative:.1e}", *(f"{e:.1e}" for e in errors)]
    agrees = all(found <= bound for found, bound in zip([*errors, nodes], bounds)) and repeats and loads[1][-1]["device"] == "cuda"
    print("| " + " | ".join(cells) + " |" + ("" if agrees else " differs") + ("" if repeats else ", and when repeated"), flush=True)
    return agrees


def large(asperity, n, cpu):
    """Time of both, and of a transform pair on the GPU, from the same solve with a tolerance below the rounding of f32."""
    case = f"--challenge {n} --p-star 0.01 --precision f32"
    solve(asperity, "cuda", case)  # cuFFT reads its kernels for these sizes
    loads = [solve(asperity, device, case)[-1] for device in (["cpu"] if cpu else []) + ["cuda"]]
    gpu, stalled = loads[-1], solve(asperity, "cuda", f"{case} --tolerance 1e-7", accepted=(3,))[-1]
    per_pair = (stalled["seconds"] - gpu["seconds"]) / (stalled["fft_pairs"] - gpu["fft_pairs"])
    cells = [f"{n}²", f"{loads[0]['seconds']:.2f}" if cpu else "", f"{gpu['seconds']:.2f}", f"{gpu['fft_pairs']:.1f}"]
    cells += [f"{1e3 * per_pair:.2f}", f"{BYTES * n * n / per_pair / 1e12:.2f}"]
    cells += [f"{abs(gpu[key] / loads[0][key] - 1):.1e}" if cpu else "" for key in ("contact_area", "mean_gap")]
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
        agree = [row(arguments.asperity, name, *case) for name, case in CASES.items()]
        sys.exit(0 if all(agree) else 1)


if __name__ == "__main__":
    main()
