"""Tables and labels for notebooks and figures."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from typing import Any


def label(name: str, unit: str) -> str:
    """A name with its unit."""
    words = name.replace("_", " ")
    return f"{words} / {unit}" if unit else words


def table(head: Sequence[str] | None, rows: Iterable[Sequence[Any]]) -> str:
    """A table of HTML: numbers with six digits, texts escaped."""

    def row(cells: Sequence[Any], tag: str) -> str:
        texts = (f"{cell:.6g}" if isinstance(cell, float) else html.escape(str(cell)) for cell in cells)
        return "<tr>" + "".join(f"<{tag}>{text}</{tag}>" for text in texts) + "</tr>"

    lines = [] if head is None else [row(head, "th")]
    return "<table>" + "".join(lines + [row(cells, "td") for cells in rows]) + "</table>"
