#!/usr/bin/env python3
"""Relaxes the atoms of a scene harmonically and by LAMMPS's own minimiser, and compares states and cost.

    scripts/compare-minimizers.py --asperity target/release/asperity configs/calcium-25nm-gentle.toml --seeds 18 101 102

Per load: force evaluations, Jaccard index of the surface atoms in contact, difference of the indenter's height above the surface (the mean
gap, Å), of the energy with the work of the load (eV; negative: the harmonic relaxation found a lower state), and the time of the harmonic
relaxation besides its force evaluations over the time of these. Per scene: processor time of `asperity atoms run` (LAMMPS, host and force
constants together). Needs numpy. The scene has prescribed loads.
"""

import argparse
import csv
import json
import re
import resource
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import numpy as np

MINIMIZERS = ("auto", "fire")


def with_settings(text, seed, minimizer):
    """The scene with another seed and minimiser."""
    text = re.sub(r"(?m)^seed *= *\d+", f"seed = {seed}", text)
    text = re.sub(r"(?m)^minimizer *=.*\n", "", text)
    return re.sub(r"(?m)^\[atoms\]\n", f'[atoms]\nminimizer = "{minimizer}"\n', text)


def ran(asperity, scene, folder):
    """Load steps, contact maps of the loads, and processor seconds of the relaxation."""
    job, read = folder / "job", folder / "read"
    subprocess.run([asperity, "atoms", "build", scene, "--out", job], check=True, capture_output=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([asperity, "atoms", "run", job], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([asperity, "atoms", "read", scene, "--job", job, "--out", read], check=True, capture_output=True)
    with open(job / "load_steps.csv", newline="") as file:
        steps = list(csv.DictReader(file))[1:]
    with open(job / "load_curve.csv", newline="") as file:
        evaluations = [int(float(row["force_evaluations"])) for row in csv.DictReader(file)][1:]
    maps = [np.load(read / f"load-{k}-site-contact.npy") for k in range(1, len(steps) + 1)]
    seconds = (after.ru_utime - before.ru_utime) + (after.ru_stime - before.ru_stime)
    return steps, evaluations, maps, seconds


def overheads(job):
    """Time of the first harmonic relaxation of each step besides the evaluations over that of the evaluations, by step."""
    found, step = {}, None
    for log in sorted(job.glob("log.[0-9]*")):
        for line in log.read_text(errors="replace").splitlines():
            if match := re.fullmatch(r"load step (\d+)", line):
                step = int(match[1])
            match = re.fullmatch(r"harmonic relaxation: .*; ([0-9.]+) s of force evaluations, ([0-9.]+) s besides", line)
            if match and step not in found:
                found[step] = float(match[2]) / max(float(match[1]), 1e-3)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--asperity", default="asperity")
    parser.add_argument("--seeds", type=int, nargs="+")
    parser.add_argument("--json", action="store_true", help="print a line of JSON per load instead of a table")
    parser.add_argument("scene", type=Path)
    options = parser.parse_args()
    text = options.scene.read_text()
    seeds = options.seeds or [tomllib.loads(text)["surface"]["seed"]]
    asperity = str(Path(options.asperity).resolve()) if "/" in options.asperity else options.asperity
    for seed in seeds:
        with tempfile.TemporaryDirectory() as scratch:
            found = []
            for minimizer in MINIMIZERS:
                folder = Path(scratch) / minimizer
                folder.mkdir()
                scene = folder / options.scene.name
                scene.write_text(with_settings(text, seed, minimizer))
                found.append(ran(asperity, scene, folder))
            overhead = overheads(Path(scratch) / "auto" / "job")
        (steps, evaluations, maps, seconds), (steps_fire, evaluations_fire, maps_fire, seconds_fire) = found
        for k, (a, b) in enumerate(zip(steps, steps_fire)):
            [m, n] = [(x > 0.5) for x in (maps[k], maps_fire[k])]
            load = float(b["load_ev_per_angstrom"])
            height = float(a["indenter_mean_angstrom"]) - float(b["indenter_mean_angstrom"])
            energy = float(a["energy_ev"]) - float(b["energy_ev"]) + load * height
            row = {
                "seed": seed,
                "load": k + 1,
                "minimizer": a["minimizer"],
                "evaluations": evaluations[k],
                "evaluations_fire": evaluations_fire[k],
                "jaccard": float((m & n).sum() / max(1, (m | n).sum())),
                "height_angstrom": height,
                "energy_ev": energy,
                "overhead": overhead.get(k + 1),
            }
            if options.json:
                print(json.dumps(row))
            else:
                print(
                    f"seed {seed} load {k + 1}: {row['evaluations']} ({row['minimizer']}) and {row['evaluations_fire']} evaluations, "
                    f"Jaccard {row['jaccard']:.4f}, height {height:+.5f} Å, energy {energy:+.5f} eV, "
                    + ("overhead –" if row["overhead"] is None else f"overhead {row['overhead']:.2f}")
                )
            sys.stdout.flush()
        if not options.json:
            print(f"seed {seed}: {seconds:.1f} and {seconds_fire:.1f} s of processor time, {seconds / seconds_fire:.3f}", flush=True)


if __name__ == "__main__":
    main()
