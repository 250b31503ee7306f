"""Imports between the files of the package."""

from __future__ import annotations

import ast
from pathlib import Path

import asperity

from conftest import REPOSITORY

#: Start of the line in docs/architecture.md that lists the files from the highest to the lowest.
HIGHEST = "__init__, peers → "


def _imported(file: Path) -> set[str]:
    """Files of the package that a file imports: anywhere in it, for type checkers, too."""
    modules: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            package = "asperity." * node.level
            modules |= {package + node.module} if node.module else {package + alias.name for alias in node.names}
    return {name.removeprefix("asperity").removeprefix(".") or "__init__" for name in modules if name.split(".")[0] == "asperity"}


def test_files_import_from_files_below_them() -> None:
    lines = (REPOSITORY / "docs" / "architecture.md").read_text().splitlines()
    tiers = next(line for line in lines if line.startswith(HIGHEST)).split(" → ")
    depth = {name: k for k, tier in enumerate(tiers) for name in tier.split(", ")}
    imports = {file.stem: _imported(file) for file in Path(asperity.__file__).parent.glob("*.py")}
    # By python/src/errors.rs.
    imports["_asperity"] = {"_errors"}
    assert set(imports) == set(depth) and sum(map(len, imports.values())) > 50
    upwards = [f"{file} imports {other}" for file, others in imports.items() for other in others if depth[other] <= depth[file]]
    assert not upwards
