#!/usr/bin/env python3
"""Hardness of the crystal from indentations: rigid spheres and flat punches pressed on blocks of calcium-like atoms.

Writes the map of each indenter and a scene, runs `asperity run`, and prints for each load the contact radius over that of the indenter, the mean
contact stress (load over touching area) of the atoms, and the deviations of contact area and mean gap of the compliant wall without and with hardness.
A flat punch is a cone with flanks of 45°, cut off at the given radius.

    scripts/indentation.py --asperity target/release/asperity --out runs/indentation
    scripts/indentation.py --asperity target/release/asperity --spheres 5,10 --hardness 4.5
    scripts/indentation.py --asperity target/release/asperity --flats 2,3 --shifts 0,1,2

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


# Mean pressures on the cell of a sphere, MPa; those of a flat punch over its own area, MPa.
SPHERE_MPA = [10, 20, 40, 80, 160, 320]
FLAT_MPA = [1000, 2000, 3000, 4000, 5000, 6000]


def sphere(radius, r):
    """Height in nm at the distance r from the axis."""
    return max(math.sqrt(max(radius * radius - r * r, 0.0)) - radius, -CAP_NM)


def flat(radius, r):
    return -min(max(r - radius, 0.0), CAP_NM)


def write_map(path, height, cells, shift):
    """Heights in nm on a plane, high points touching. Each shift moves the axis to another place between the atoms."""
    length = cells * A0_NM
    n = NODES_PER_CELL * cells
    at = [(i + 0.5) / n * length - length / 2 for i in range(n)]
    dx, dy = 0.37 * shift * A0_NM, 0.61 * shift * A0_NM
    with path.open("w") as file:
        for y in at:
            print(" ".join(f"{height(math.hypot(x - dx, y - dy)):.6f}" for x in at), file=file)
    return length


def rms_gradient(asperity, path, length):
    """The map's rms gradient, over which p* counts."""
    command = [asperity, "surface", path, "--length", f"{length * 1e-3:.8f}um", "--unit", "nm", "--touching", "high-points", "--json"]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["rms_gradient"]


def indent(asperity, out, shape, radius, shift, hardness):
    # A block several contact radii wide and deep.
    cells = min(64, max(36, round(4.8 * radius / A0_NM / 2) + 12))
    name = f"{shape.__name__}-{radius:g}nm" + (f"-{shift}" if shift else "")
    length = write_map(out / f"{name}.txt", lambda r: shape(radius, r), cells, shift)
    share = math.pi * radius * radius / length**2
    pressures = SPHERE_MPA if shape is sphere else [share * p for p in FLAT_MPA]
    gradient = rms_gradient(asperity, out / f"{name}.txt", length)
    p_star = ", ".join(f"{p / (E_STAR_MPA * gradient):.6g}" for p in pressures)
    (out / f"{name}.toml").write_text(
        f"""name = "{name}"
[laboratory]
length = "{length * 1e-3:.8f} um"
modulus = "{E_STAR_MPA} MPa"
[surface]
heights = "{name}.txt"
unit = "0.001 um"
touching = "high-points"
[load]
p_star = [{p_star}]
[atoms]
cells = {cells}
depth_cells = {round(0.62 * cells)}
plasticity = true
hardness = "{hardness} GPa"
force_tolerance = "0.1 eV/Å"
"""
    )
    run = out / name
    with (out / f"{name}.log").open("w") as log:
        subprocess.run([asperity, "run", out / f"{name}.toml", "--out", run], check=True, stdout=log, stderr=log)
    results = json.loads((run / "results.json").read_text())
    for state, load in zip(results["atoms"]["states"], results["comparison"]["loads"]):
        walls = {m["id"]: m for m in load["continuum"]}
        area = load["atoms"]["contact_area"]
        row = [name, f"{math.sqrt(area / math.pi) * length / radius:.3f}", state["contacts"], f"{state['contact_stress_gpa']:.2f}"]
        row.append(state["defects"]["atoms"])
        row += [f"{100 * (walls[wall]['contact_area'] / area - 1):+.0f}" for wall in ("compliant_wall", "yielding_wall")]
        gaps = [load[f"{wall}_mean_gap_angstrom"] for wall in ("atoms", "compliant_wall", "yielding_wall")]
        row += [f"{gap - gaps[0]:+.2f}" for gap in gaps[1:]]
        print("\t".join(map(str, row)), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--asperity", default="asperity")
    parser.add_argument("--out", type=Path, default=Path("runs/indentation"))
    parser.add_argument("--spheres", default="", help="radii, nm")
    parser.add_argument("--flats", default="", help="radii, nm")
    parser.add_argument("--shifts", default="0", help="numbers of the places of the axis")
    parser.add_argument("--hardness", type=float, default=4.5, help="of the continuum that the atoms are compared with, GPa")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    head = ["indenter", "a/R", "contacts", "stress/GPa", "defects", "elastic area/%", "plastic area/%", "elastic gap/Å", "plastic gap/Å"]
    print("\t".join(head))
    shapes = [(sphere, arguments.spheres), (flat, arguments.flats)]
    if not any(radii for _, radii in shapes):
        shapes = [(sphere, "5"), (flat, "3")]
    for shape, radii in shapes:
        for radius in filter(None, radii.split(",")):
            for shift in map(int, arguments.shifts.split(",")):
                indent(arguments.asperity, arguments.out, shape, float(radius), shift, arguments.hardness)
    return 0


if __name__ == "__main__":
    sys.exit(main())
