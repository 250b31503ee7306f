"""Surfaces of the tests. Importing matplotlib's display-less backend comes first."""

from __future__ import annotations

import matplotlib
import pytest

import asperity

matplotlib.use("Agg")


def rough(nodes: int = 64, seed: int = 1, length: float = 1.0) -> asperity.Surface:
    """A surface whose spectrum the grid resolves."""
    return asperity.Surface.from_spectrum(nodes, length=length, seed=seed, lambda_s=8 / nodes)


@pytest.fixture
def surface() -> asperity.Surface:
    return rough()
