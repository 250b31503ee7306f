"""What the files of a release say about it is the same in all of them."""

from __future__ import annotations

import json
import re

import asperity

from conftest import REPOSITORY


def text(file: str) -> str:
    return (REPOSITORY / file).read_text()


def value(file: str, key: str) -> str:
    """Of the first line `key = "value"` of a TOML file or `key: value` of a YAML file, in tables of any name."""
    found = re.search(rf"^ *{key}(?: = |: )\"?(.*?)\"?$", text(file), flags=re.MULTILINE)
    assert found, f"{file} has no {key}"
    return found[1]


def test_versions_agree() -> None:
    version = value("Cargo.toml", "version")
    assert asperity.__version__ == version
    for file in ("python/Cargo.toml", "CITATION.cff", "packaging/conda/recipe.yaml"):
        assert value(file, "version") == version, file
    assert json.loads(text("codemeta.json"))["version"] == version
    crates = re.findall(r'^asperity-\w+ = \{ path = .*? version = "(.*?)"', text("Cargo.toml"), flags=re.MULTILINE)
    assert len(crates) == len(list((REPOSITORY / "crates").iterdir())) and set(crates) == {version}
    headings = re.findall(r"^## \[(\d.*?)\]", text("CHANGELOG.md"), flags=re.MULTILINE)
    assert headings[0] == version


def test_title_licence_and_description_agree() -> None:
    meta = json.loads(text("codemeta.json"))
    assert {value("CITATION.cff", "title"), meta["name"], value("python/pyproject.toml", "name")} == {"asperity"}
    description = value("Cargo.toml", "description")
    assert {value("CITATION.cff", "abstract"), meta["description"], value("python/pyproject.toml", "description")} == {description}
    licence = value("Cargo.toml", "license")
    assert {value("CITATION.cff", "license"), value("python/pyproject.toml", "license"), value("python/Cargo.toml", "license")} == {licence}
    assert meta["license"].rsplit("/", 1)[-1] == licence
    assert text("LICENSE").startswith(f"{licence} License")
