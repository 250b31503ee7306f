"""Opens the frames of a run folder in OVITO as a user would, and holds them against the run's other files."""

import json
import pathlib
import sys

import numpy as np
from ovito.io import import_file

folder = pathlib.Path(sys.argv[1])
states = json.loads((folder / "results.json").read_text())["atoms"]["states"]
assert states
for state in states:
    frame = import_file(str(folder / state["frame"])).compute()
    atoms = frame.particles
    contact, indenter = np.array(atoms["contact"]) == 1, np.array(atoms["indenter"]) == 1
    types = {t.id: t.name for t in atoms.particle_types.types}
    elements = np.array([types[t] for t in atoms.particle_types])
    assert set(elements[indenter]) == {"X"} and set(elements[~indenter]) == {"Ca"}
    assert contact.sum() == state["contacts"] and not contact[indenter].any()
    assert frame.attributes["p_star"] == state["p_star"]
    assert tuple(frame.cell.pbc) == (True, True, False)
    # The colours that the file gives: contact differs from the rest of the block.
    colours = np.array(atoms.colors)
    assert len({tuple(c) for c in colours[contact]} & {tuple(c) for c in colours[~contact & ~indenter]}) == 0
    assert len(set(atoms.identifiers)) == atoms.count

print("checked: OVITO")
