"""Folders of sweeps."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._arguments import a_path
from ._errors import InputError, needed
from ._html import table
from ._run import Run, Where, open_run

if TYPE_CHECKING:
    import pandas

#: Schema of ``ensemble.json``, as in src/record/ensemble.rs.
SCHEMA = 4

ACCEPTED = "the folder of a sweep that has run; the command that made it writes it again"


@dataclass(frozen=True)
class SweepPoint:
    """A point of a sweep: the values of the varied keys; `status` is ``done``, ``failed`` for `reason`, or ``waiting``."""

    label: str
    values: dict[str, Any]
    status: str
    reason: str | None
    folder: Path

    @property
    def run(self) -> Run:
        """Its run, opened anew and verified by :func:`open_run`; InputError if it is not done."""
        if self.status != "done":
            raise InputError(f"{self.folder}: {': '.join(filter(None, (self.status, self.reason)))}; accepted: a point that is done")
        return open_run(self.folder)


class Sweep:
    """The folder of a sweep or an ensemble; :func:`open_sweep` reads it. Tables count loads from 1, `results` from 0.

    Attributes
    ----------
    results : dict
        All of ``ensemble.json``.
    name : str
        Name of the sweep.
    keys : tuple of str
        The varied keys.
    points : tuple of SweepPoint
        All points, also those that are not done.
    """

    def __init__(self, folder: Where) -> None:
        self.folder = a_path("folder", folder)
        path = self.folder / "ensemble.json"
        try:
            self.results: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            if self.results["schema"] != SCHEMA:
                raise ValueError(f"schema {self.results['schema']}, not {SCHEMA}")
            self.name: str = self.results["name"]
            self.keys: tuple[str, ...] = tuple(self.results["keys"])
            self.points = tuple(map(self._point, self.results["points"]))
        except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
            raise InputError(f"{path}: cannot be read ({error}); accepted: {ACCEPTED}") from error

    def _point(self, row: dict[str, Any]) -> SweepPoint:
        values = dict(zip(self.keys, row["values"], strict=True))
        return SweepPoint(row["label"], values, row["status"], row.get("reason"), self.folder / "points" / row["label"])

    @property
    def missing(self) -> dict[str, str]:
        """Labels of the points that are not done: why they failed, or ``waiting``."""
        return {point.label: point.reason or point.status for point in self.points if point.status != "done"}

    def point(self, chosen: str | Mapping[str, Any]) -> SweepPoint:
        """The point with this label, or with these values of varied keys; InputError unless it is one."""
        values = chosen.items() if isinstance(chosen, Mapping) else None
        found = [p for p in self.points if (p.label == chosen if values is None else values <= p.values.items())]
        if len(found) != 1:
            raise InputError(f"{self.folder}: {chosen!r} = {len(found)} points; accepted: a label, or values of varied keys, of one point")
        return found[0]

    @property
    def statistics(self) -> pandas.DataFrame:
        """``statistics.csv``: a row with its unit for each mean over the realisations."""
        return self._table("statistics.csv")

    @property
    def differences(self) -> pandas.DataFrame:
        """``differences.csv``: a row with its unit for each mean difference between two sources."""
        return self._table("differences.csv")

    @property
    def numbers(self) -> pandas.DataFrame:
        """``numbers.csv``: a row with its unit for each number of each point."""
        return self._table("numbers.csv")

    def _table(self, name: str) -> pandas.DataFrame:
        # Units are text, also "1". A key may have the value "NA": only empty cells have none.
        options = {"dtype": {"unit": str}, "keep_default_na": False, "na_values": [""]}
        path = self.folder / name
        try:
            read: pandas.DataFrame = needed("pandas").read_csv(path, **options)
        except (OSError, ValueError) as error:
            raise InputError(f"{path}: cannot be read ({error}); accepted: {ACCEPTED}") from error
        return read

    @property
    def report(self) -> Path:
        """The report, for a browser."""
        return self.folder / "report.html"

    def __repr__(self) -> str:
        return f"<Sweep {self.name!r} in {self.folder}: {len(self.points) - len(self.missing)} of {len(self.points)} points done>"

    def _repr_html_(self) -> str:
        return table((*self.keys, "status"), ((*p.values.values(), self.missing.get(p.label, p.status)) for p in self.points))


def open_sweep(folder: Where) -> Sweep:
    """The folder of a sweep or an ensemble, as far as it is done.

    Runs are opened and verified when they are asked for. Tables are read without verification.

    Raises
    ------
    InputError
        If the folder has no ``ensemble.json``, or that of another version.
    """
    return Sweep(folder)
