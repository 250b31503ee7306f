#!/usr/bin/env python3
"""How shallow a block may be: blocks on a rigid, prescribed and elastic base, compared with the full depth of a scene.

Runs `asperity run` for each block and prints at each load the contact atoms, the Jaccard index of the contact sites with the full block's, the
difference of the mean gap, and the force evaluations; then atoms and wall time of LAMMPS, and with adhesion the pull-off. "Cells" counts lattice constants of atoms that
move: those of an elastic base do.

    scripts/elastic-base.py --asperity target/release/asperity --scene configs/calcium-8nm.toml --depth 20 --out runs/elastic-base
    scripts/elastic-base.py --asperity target/release/asperity --scene configs/calcium-25nm.toml --seed 2 --blocks elastic:4,rigid:4 --out runs/elastic-base

The scene has a start from the continuum, or none. No packages.
"""

import argparse
import ast
import json
import re
import subprocess
from pathlib import Path

ELASTIC_CELLS = 2  # the elastic base of the shipped potential: four layers


def sites(path):
    """Contact flags of a .npy file of one byte each."""
    raw = path.read_bytes()
    length = int.from_bytes(raw[8:10], "little")
    header = ast.literal_eval(raw[10 : 10 + length].decode())
    assert header["descr"] in ("|b1", "|u1"), header
    return raw[10 + length :]


def run(asperity, text, out, depth, kind, cells):
    """Results of a block in a scene's text, and its contact flags per load."""
    name = f"{kind}-{cells}"
    atoms = {
        "rigid": f"depth_cells = {cells}",
        "prescribed": f'depth_cells = {cells}\nfoundation_cells = {depth - cells}\nbase = "prescribed"',
        "elastic": f'depth_cells = {cells - ELASTIC_CELLS}\nfoundation_cells = {depth - cells + ELASTIC_CELLS}\nbase = "elastic"',
    }[kind]
    (out / f"{name}.toml").write_text(re.sub(r"(?m)^depth_cells *=.*$", atoms, text))
    folder = out / name
    subprocess.run([asperity, "run", out / f"{name}.toml", "--out", folder], check=True, stdout=subprocess.DEVNULL)
    results = json.loads((folder / "results.json").read_text())
    contacts = [sites(folder / "atoms" / f"load-{k + 1}-site-contact.npy") for k in range(len(results["atoms"]["states"]))]
    return results, contacts


def evaluations(results):
    steps = [s["force_evaluations"] for s in results["atoms"]["load_steps"]]
    return steps[1:] if results["atoms"].get("from_continuum") else [sum(steps)]


def pull_off(results):
    """Largest tension of the steps as -p*; 0 without adhesion."""
    return max(0.0, *(-step["p_star"] for step in results["atoms"]["load_steps"]))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--asperity", default="asperity")
    parser.add_argument("--scene", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--depth", type=int, help="lattice constants of the full block; default: the scene's")
    parser.add_argument("--seed", type=int, help="of the surface; default: the scene's")
    parser.add_argument("--blocks", default="elastic:4,elastic:3,prescribed:4,rigid:4", help="kind:cells, separated by commas")
    arguments = parser.parse_args()
    text = arguments.scene.read_text()
    depth = arguments.depth or int(re.search(r"(?m)^depth_cells *= *(\d+)", text).group(1))
    out = arguments.out
    if arguments.seed is not None:
        text = re.sub(r"(?m)^seed *=.*$", f"seed = {arguments.seed}", text)
        out = out / f"seed-{arguments.seed}"
    out.mkdir(parents=True, exist_ok=True)
    full, reference = run(arguments.asperity, text, out, depth, "rigid", depth)
    print("| base, cells | atoms | load | contact atoms | Jaccard | mean gap, Å | evaluations | LAMMPS, s |")
    print("|---|---|---|---|---|---|---|---|")
    blocks = [f"rigid:{depth}"] + arguments.blocks.split(",")
    for block in blocks:
        kind, cells = block.split(":")
        results, contacts = (full, reference) if block == blocks[0] else run(arguments.asperity, text, out, depth, kind, int(cells))
        atoms = results["atoms"]["deformable"] + results["atoms"]["fixed"]
        seconds = next(s["seconds"] + s["earlier_seconds"] for s in results["stages"] if s["name"] == "lammps")
        steps = evaluations(results)
        for k, (state, own, other) in enumerate(zip(results["atoms"]["states"], contacts, reference)):
            both, either = sum(a & b for a, b in zip(own, other)), sum(a | b for a, b in zip(own, other))
            gap = state["mean_gap_angstrom"] - full["atoms"]["states"][k]["mean_gap_angstrom"]
            first = (f"{kind}, {cells}", str(atoms)) if k == 0 else ("", "")
            print(
                f"| {first[0]} | {first[1]} | {state['p_star']:g} | {state['contacts']} | {both / max(either, 1):.3f} | {gap:+.4f} "
                f"| {steps[k] if len(steps) > k else ''} | {f'{seconds:.1f}' if k == 0 else ''} |"
            )
        if pull_off(full) > 0:
            tension = pull_off(results)
            print(f"|  |  | pull-off | p* = {-tension:.3e} | {tension / pull_off(full) - 1:+.2%} |  |  |  |")


if __name__ == "__main__":
    main()
