"""Observables of gap, pressure and contact maps ``[ny, nx]`` on a periodic cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _asperity
from ._arguments import extents, finite_map, flag_map, real, reals
from ._errors import InputError


@dataclass(frozen=True)
class ContactArea:
    """Contact area of a gap map over that of the cell, contact nodes over all nodes, perimeter per area, number of contact nodes."""

    contact_area: float
    contact_nodes: float
    perimeter: float
    count: int


@dataclass(frozen=True, eq=False)
class Clusters:
    """Connected clusters of contact nodes.

    Attributes
    ----------
    labels : ndarray of int, shape (ny, nx)
        Number of each node's cluster from 1 on; 0 without contact.
    sizes : list of int
        Nodes of each cluster, in the order of the labels.
    median_size : int or None
        Half of the contact area lies in clusters of at most this many nodes.
    """

    labels: npt.NDArray[np.int64]
    sizes: list[int]
    median_size: int | None

    def __repr__(self) -> str:
        return f"Clusters({len(self.sizes)} clusters, largest {max(self.sizes, default=0)} nodes, median_size={self.median_size})"


@dataclass(frozen=True, eq=False)
class Distribution:
    """A distribution over bins, in fractions of all nodes.

    Attributes
    ----------
    edges : ndarray
        Edges of the bins.
    fractions : ndarray
        Fractions in the bins.
    delta, below, above : float
        Fractions in the delta function, below the first and above the last edge.
    """

    edges: npt.NDArray[np.float64]
    fractions: npt.NDArray[np.float64]
    delta: float
    below: float
    above: float

    @property
    def density(self) -> npt.NDArray[np.float64]:
        """Fractions over the widths of the bins."""
        return self.fractions / np.diff(self.edges)


@dataclass(frozen=True)
class Overlap:
    """Agreement of two contact maps: Jaccard index, precision, recall and Cohen's κ."""

    jaccard: float
    precision: float
    recall: float
    kappa: float


@dataclass(frozen=True)
class MapAgreement:
    """Agreement of two contact maps, with the control of a shifted map and the shift in nodes that fits best."""

    aligned: Overlap
    shifted: Overlap
    best_shift: tuple[int, int]


@dataclass(frozen=True)
class Method:
    """A method of solving or estimating a contact problem."""

    id: str
    paper_name: str
    family: str
    solves: bool
    adhesion: bool
    criterion: str
    calibrated_on: str | None
    summary: str
    references: list[str]


def _edges(values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    edges = reals("edges", values)
    if edges.size < 2 or not np.isfinite(edges).all() or not (np.diff(edges) > 0).all():
        raise InputError(f"edges = {values!r}; accepted: the edges of the bins, two or more finite numbers that rise")
    return edges


def contact_area(
    gap: npt.ArrayLike, cell: tuple[float, float], *, threshold: float = 0.0, periodic: bool = True
) -> ContactArea:
    """Contact area of a gap map: nodes with a gap of at most `threshold`. The border of a map that is not periodic is no edge.

    Examples
    --------
    >>> import numpy as np, asperity
    >>> gap = np.ones((8, 8)); gap[3, 3] = 0
    >>> asperity.contact_area(gap, (8.0, 8.0)).count
    1
    """
    area = _asperity.contact_area(finite_map("gap", gap), real("threshold", threshold), extents("cell", cell), periodic)
    return ContactArea(*area)


def clusters(contact: npt.ArrayLike, *, corners: bool = True, periodic: bool = True) -> Clusters:
    """Connected clusters of a contact map. `corners`: whether nodes that share a corner only are neighbours; `periodic`: whether those on
    opposite sides of the map are.

    Examples
    --------
    >>> import numpy as np, asperity
    >>> asperity.clusters(np.eye(4, dtype=bool), corners=False).sizes
    [1, 1, 1, 1]
    """
    return Clusters(*_asperity.clusters(flag_map("contact", contact), corners, periodic))


def percolation(contact: npt.ArrayLike, *, periodic: bool = True) -> tuple[bool, bool]:
    """Whether the contact connects a periodic cell with its image along x and along y, or opposite sides of a map that is not periodic;
    corners connect.

    Examples
    --------
    >>> import numpy as np, asperity
    >>> asperity.percolation(np.eye(4, dtype=bool))
    (True, True)
    """
    return _asperity.percolation(flag_map("contact", contact), periodic)


def _distribution(edges: npt.NDArray[np.float64], histogram: tuple[list[float], float, float, float]) -> Distribution:
    fractions, delta, below, above = histogram
    return Distribution(edges, np.array(fractions), delta, below, above)


def gap_distribution(gap: npt.ArrayLike, edges: npt.ArrayLike, *, threshold: float = 0.0) -> Distribution:
    """Distribution Pr(u) of a gap map; nodes with a gap of at most `threshold` are its delta function.

    Examples
    --------
    >>> import numpy as np, asperity
    >>> gaps = asperity.gap_distribution(np.array([[0.0, 0.5], [1.5, 3.0]]), [0, 1, 2])
    >>> gaps.delta, gaps.fractions.tolist(), gaps.above
    (0.25, [0.25, 0.25], 0.25)
    """
    bins = _edges(edges)
    return _distribution(bins, _asperity.gap_distribution(finite_map("gap", gap), real("threshold", threshold), bins.tolist()))


def stress_distribution(stress: npt.ArrayLike, contact: npt.ArrayLike, edges: npt.ArrayLike) -> Distribution:
    """Distribution Pr(σ) of the stress of the nodes in contact, in fractions of all nodes.

    Examples
    --------
    >>> import numpy as np, asperity
    >>> p = np.array([[0.0, 0.5], [1.5, 0.0]])
    >>> asperity.stress_distribution(p, p > 0, [0, 1, 2]).fractions.tolist()
    [0.25, 0.25]
    """
    values, flags, bins = finite_map("stress", stress), flag_map("contact", contact), _edges(edges)
    if values.shape != flags.shape:
        raise InputError(f"contact = an array of shape {flags.shape}; accepted: {values.shape}, as stress has")
    return _distribution(bins, _asperity.stress_distribution(values, flags, bins.tolist())[1])


def hydraulic_gap(gap: npt.ArrayLike, *, threshold: float = 0.0) -> float:
    """Height of the uniform gap with the same pressure-driven flow, in Bruggeman's effective-medium approximation.

    Examples
    --------
    >>> import numpy as np, asperity
    >>> round(asperity.hydraulic_gap(np.full((4, 4), 2.0)), 9)
    2.0
    """
    return _asperity.hydraulic_gap(finite_map("gap", gap), real("threshold", threshold))


def compare_maps(contact: npt.ArrayLike, reference: npt.ArrayLike) -> MapAgreement:
    """Compares a contact map with a reference on the same grid.

    Examples
    --------
    >>> import numpy as np, asperity
    >>> reference = np.zeros((30, 30), bool); reference[:6, :10] = True
    >>> asperity.compare_maps(reference, reference).aligned.kappa
    1.0
    """
    aligned, shifted, shift = _asperity.compare_maps(flag_map("contact", contact), flag_map("reference", reference))
    return MapAgreement(Overlap(*aligned), Overlap(*shifted), (shift[0], shift[1]))


@dataclass(frozen=True)
class FieldAgreement:
    """Agreement of two maps of gaps, stresses or heights; differences are the map minus the reference."""

    mean_difference: float
    rms_difference: float
    largest_difference: float
    """Largest absolute value."""
    correlation: float | None
    """Of Pearson; None if a map is constant."""


def compare_fields(field: npt.ArrayLike, reference: npt.ArrayLike) -> FieldAgreement:
    """Compares a map of gaps, stresses or heights with a reference on the same grid, in the same unit.

    Examples
    --------
    >>> import numpy as np, asperity
    >>> gap = np.array([[0.0, 0.5], [1.5, 3.0]])
    >>> round(asperity.compare_fields(gap + 0.1, gap).rms_difference, 12)
    0.1
    """
    values, of = finite_map("field", field), finite_map("reference", reference)
    if values.shape != of.shape:
        raise InputError(f"field = an array of shape {values.shape}; accepted: {of.shape}, as reference has")
    difference = values - of
    varies = np.ptp(values) > 0 and np.ptp(of) > 0
    common = ((values - values.mean()) * (of - of.mean())).mean()
    return FieldAgreement(
        mean_difference=float(difference.mean()),
        rms_difference=float(np.sqrt((difference**2).mean())),
        largest_difference=float(np.abs(difference).max()),
        correlation=float(np.clip(common / (values.std() * of.std()), -1, 1)) if varies else None,
    )


def methods() -> list[Method]:
    """All methods, in the order in which tables list them.

    Examples
    --------
    >>> import asperity
    >>> "fast" in [m.id for m in asperity.methods() if m.solves]
    True
    """
    entries: list[dict[str, Any]] = _asperity.methods()
    return [Method(**entry) for entry in entries]
