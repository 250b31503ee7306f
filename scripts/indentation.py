#!/usr/bin/env python3
"""Hardness of the crystal from indentations: rigid spheres pressed on blocks of calcium-like atoms.

Writes the map of each sphere and a scene, runs `asperity run`, and prints for each load the contact radius over that of the sphere, the mean
contact stress (load over touching area) of the atoms, and contact and mean gap beside those of the compliant wall with hardness.

    scripts/indentation.py --asperity target/release/asperity --out runs/indentation
    scripts/indentation.py --asperity target/release/asperity --radii 5,10 --hardness 4.5

Each load starts from the continuum's solution on the elastic half-space and continues from the load before. No packages.
"""

import argparse
import json
import math
import subprocess
import sys
from pathlib import Path

A0_NM = 0.55884  # lattice constant of the shipped potential
E_STAR_MPA = 28570  # its contact modulus
CAP_NM = 3.0  # depth of the cap that is kept; beyond it the indenter is flat
NODES_PER_CELL = 4


def write_map(path, radius, cells):
    """Heights in nm of a spherical cap on a plane, high points touching."""
    length = cells * A0_NM
    n = NODES_PER_CELL * cells
    at = [(i + 0.5) / n * length - length / 2 for i in range(n)]
    with path.open("w") as file:
        for y in at:
            squares = [radius * radius - x * x - y * y for x in at]
            heights = [max(math.sqrt(s) - radius, -CAP_NM) if s > 0 else -CAP_NM for s in squares]
            print(" ".join(f"{h:.6f}" for h in heights), file=file)
    return length


def rms_gradient(asperity, path, length):
    """The map's rms gradient, over which p* counts."""
    command = [asperity, "surface", path, "--length", f"{length * 1e-3:.8f}um", "--unit", "nm", "--touching", "high-points", "--json"]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["rms_gradient"]


def indent(asperity, out, radius, cells, depth, pressures, hardness):
    name = f"sphere-{radius:g}nm"
    length = write_map(out / f"{name}.txt", radius, cells)
    gradient = rms_gradient(asperity, out / f"{name}.txt", length)
    p_star = ", ".join(f"{p / (E_STAR_MPA * gradient):.6g}" for p in pressures)
    (out / f"{name}.toml").write_text(
        f"""name = "{name}"
[laboratory]
length_um = {length * 1e-3:.8f}
contact_modulus_mpa = {E_STAR_MPA}
[surface]
heights = "{name}.txt"
heights_unit_um = 0.001
touching = "high-points"
[load]
p_star = [{p_star}]
[atoms]
cells = {cells}
depth_cells = {depth}
plasticity = true
hardness_gpa = {hardness}
force_tolerance_ev_per_angstrom = 0.1
"""
    )
    run = out / name
    with (out / f"{name}.log").open("w") as log:
        subprocess.run([asperity, "run", out / f"{name}.toml", "--out", run], check=True, stdout=log, stderr=log)
    results = json.loads((run / "results.json").read_text())
    for state, load in zip(results["atoms"]["states"], results["comparison"]["loads"]):
        walls = {m["id"]: m for m in load["continuum"]}
        area = load["atoms"]["contact_fraction"]
        row = [f"{radius:g}", f"{math.sqrt(area / math.pi) * length / radius:.3f}", state["contacts"], f"{state['contact_stress_gpa']:.2f}"]
        row.append(state["defects"]["atoms"])
        row += [f"{100 * (walls[wall]['contact_fraction'] / area - 1):+.0f}" for wall in ("compliant_wall", "yielding_wall")]
        gaps = [load[f"{wall}_mean_gap_angstrom"] for wall in ("atoms", "compliant_wall", "yielding_wall")]
        row += [f"{gap - gaps[0]:+.2f}" for gap in gaps[1:]]
        print("\t".join(map(str, row)), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--asperity", default="asperity")
    parser.add_argument("--out", type=Path, default=Path("runs/indentation"))
    parser.add_argument("--radii", default="5,10,20", help="radii of the spheres, nm")
    parser.add_argument("--hardness", type=float, default=4.5, help="of the continuum beside the atoms, GPa")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    head = ["R/nm", "a/R", "contacts", "stress/GPa", "defects", "elastic area/%", "plastic area/%", "elastic gap/Å", "plastic gap/Å"]
    print("\t".join(head))
    for radius in map(float, arguments.radii.split(",")):
        # A block several contact radii wide and deep.
        cells = min(64, max(36, round(4.8 * radius / A0_NM / 2) + 12))
        pressures = [10, 20, 40, 80, 160, 320]
        indent(arguments.asperity, arguments.out, radius, cells, round(0.62 * cells), pressures, arguments.hardness)
    return 0


if __name__ == "__main__":
    sys.exit(main())
