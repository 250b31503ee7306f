"""Surfaces of the tests. Importing matplotlib's display-less backend comes first."""

from __future__ import annotations

import os
from pathlib import Path

import matplotlib
import pytest

import asperity

matplotlib.use("Agg")

REPOSITORY = Path(__file__).parents[2]
CONFIGS = REPOSITORY / "configs"


def rough(nodes: int = 64, seed: int = 1, length: float = 1.0) -> asperity.Surface:
    """A surface whose spectrum the grid resolves."""
    return asperity.Surface.from_spectrum(nodes, length=length, seed=seed, lambda_s=8 / nodes)


@pytest.fixture
def surface() -> asperity.Surface:
    return rough()


def needs(tool: str, found: object) -> None:
    """Skips the test without the tool and lists it, as `tests/common/tools.rs` does for the tests in Rust; fails where it is required."""
    if found:
        return
    test = os.environ["PYTEST_CURRENT_TEST"].split()[0]
    assert tool not in os.environ.get("ASPERITY_REQUIRE", "").split(","), f"{tool} is missing"
    if (folder := REPOSITORY / "target" / "tmp").is_dir():
        with (folder / "skipped").open("a") as list_of_skipped:
            list_of_skipped.write(f"{test}: {tool} is missing\n")
    pytest.skip(f"{tool} is missing")
