"""The notebooks of docs/tutorials and examples, cell by cell, and the lines of README.md; the documentation shows what the notebooks print."""

from __future__ import annotations

import ast
import json
import shutil
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest

from conftest import REPOSITORY, needs

TUTORIALS = REPOSITORY / "docs" / "tutorials"
NOTEBOOKS = sorted([*TUTORIALS.glob("*.ipynb"), *(REPOSITORY / "examples").glob("*.ipynb")])


def _execute(source: str, names: dict[str, Any]) -> object:
    """Executes a cell as a notebook does, and returns the value of its last expression."""
    body = ast.parse(source).body
    last = body[-1] if body else None
    if not isinstance(last, ast.Expr):
        exec(compile(source, "cell", "exec"), names)
        return None
    exec(compile(ast.Module(body[:-1], []), "cell", "exec"), names)
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names)


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.name)
def test_tutorials_run(notebook: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    if notebook.name in ("atoms.ipynb", "lecture.ipynb"):
        needs("lammps", shutil.which("lmp") or shutil.which("lammps"))
    monkeypatch.chdir(notebook.parent)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    names: dict[str, Any] = {"__name__": "notebook"}
    cells = json.loads(notebook.read_text())["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert len(code) > 3 and not any(cell["outputs"] for cell in code), "outputs are not stored: remove them"
    for cell in code:
        value = _execute("".join(cell["source"]), names)
        html = getattr(value, "_repr_html_", None)
        assert value is None or (html() if html else repr(value))
    plt.close("all")


def test_the_lines_of_the_readme_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(REPOSITORY)
    block = (REPOSITORY / "README.md").read_text().split("```python\n")[1].split("```")[0]
    names: dict[str, Any] = {}
    _execute(block, names)
    assert len(names["path"]) == 3
    plt.close("all")


def test_all_tutorials_are_there() -> None:
    names = {"tour", "own-map", "adhesion", "methods", "atoms", "accuracy"}
    assert {path.stem for path in TUTORIALS.glob("*.ipynb")} == names
