"""Opens the frames of a run folder in ASE as a user would, and holds them against the run's other files."""

import json
import pathlib
import sys

import ase.io
import numpy as np

folder = pathlib.Path(sys.argv[1])
results = json.loads((folder / "results.json").read_text())["atoms"]
states, contact_distance = results["states"], results["repulsion"]["contact_distance_angstrom"]
assert states
for state in states:
    atoms = ase.io.read(folder / state["frame"])
    indenter = atoms.arrays["indenter"] == 1
    contact = atoms.arrays["contact"] == 1
    symbols = np.array(atoms.get_chemical_symbols())
    assert set(symbols[indenter]) == {"X"} and set(symbols[~indenter]) == {"Ca"}
    assert contact.sum() == state["contacts"] and not contact[indenter].any()
    assert atoms.info["p_star"] == state["p_star"]
    assert list(atoms.pbc) == [True, True, False]
    # Contact is an indenter atom within d_c: with the periodic images that ASE makes of the cell.
    [block, rigid] = [atoms.positions[mask] for mask in (~indenter, indenter)]
    difference = block[:, None, :] - rigid[None, :, :]
    for axis in (0, 1):
        length = atoms.cell[axis, axis]
        difference[:, :, axis] -= length * np.round(difference[:, :, axis] / length)
    near = np.sqrt((difference**2).sum(axis=2).min(axis=1)) < contact_distance
    # Coordinates have six decimals, so that an atom at d_c may change sides.
    assert (near != contact[~indenter]).sum() <= 1
    assert len(set(atoms.arrays["id"])) == len(atoms)

print("checked: ASE")
