"""`results.json` against its JSON Schema, by a validator that shares no code with asperity."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest

import asperity

from conftest import CONFIGS, needs

SURFACE = "surface = { grid = 64, cut_off_mode = 8 }\n"

SCENES = {
    "adhesive": """name = "adhesive"
load = { pressure = ["0.1 MPa", "1 MPa"], unload = true, pull_off = true }
adhesion = { work_of_adhesion = "50 mJ/m2", range = "3 um" }
continuum = { compare_with = ["persson", "srgw", "winkler"], leakage = true, subsurface = { depths = ["1 um"], poisson = 0.3 } }
""",
    "plastic": """name = "plastic"
load = { p_star = [0.02, 0.1], unload = true }
continuum = { hardness = "5 MPa" }
""",
    "accurate": 'name = "accurate"\nload = { p_star = [0.05] }\naccuracy = { error = "30 %" }\n',
}


def closed(node: Any) -> Any:
    """The schema without freedom: keys that it does not list are errors."""
    if isinstance(node, list):
        return [closed(entry) for entry in node]
    if not isinstance(node, dict):
        return node
    node = {key: closed(value) for key, value in node.items()}
    return node | {"additionalProperties": False} if isinstance(node.get("properties"), dict) and "type" in node else node


def faults(results: Path) -> Iterator[str]:
    validator = jsonschema.Draft202012Validator(closed(json.loads(asperity.command("schema", "--results"))))
    for error in validator.iter_errors(json.loads(results.read_text())):
        yield f"{error.json_path}: {error.message[:200]}"


@pytest.mark.parametrize("name", SCENES)
def test_results_have_the_keys_and_types_of_the_schema(tmp_path: Path, name: str) -> None:
    (tmp_path / "scene.toml").write_text(SCENES[name] + SURFACE)
    asperity.run(tmp_path / "scene.toml", tmp_path / "out")
    assert not list(faults(tmp_path / "out" / "results.json"))


def test_results_of_atoms_do(tmp_path: Path) -> None:
    needs("lammps", shutil.which("lmp") or shutil.which("lammps"))
    text = (CONFIGS / "tiny.toml").read_text().replace("[atoms]", "unload = true\n[atoms]\nplasticity = true\nhardness = '4 GPa'")
    (tmp_path / "scene.toml").write_text(text)
    asperity.run(tmp_path / "scene.toml", tmp_path / "out")
    assert not list(faults(tmp_path / "out" / "results.json"))


@pytest.mark.parametrize("change", [{"mean_gap": "1"}, {"mean_gab": 1.0}, {"stop": "tired"}])
def test_wrong_types_values_and_keys_are_found(tmp_path: Path, change: dict[str, Any]) -> None:
    (tmp_path / "scene.toml").write_text(SCENES["plastic"] + SURFACE)
    asperity.run(tmp_path / "scene.toml", tmp_path / "out")
    results = json.loads((tmp_path / "out" / "results.json").read_text())
    results["continuum"]["states"][0] |= change
    (tmp_path / "changed.json").write_text(json.dumps(results))
    assert list(faults(tmp_path / "changed.json"))
