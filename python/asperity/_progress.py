"""Progress of a solve."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

#: Seconds after which a bar appears by itself.
DELAY = 1.0


@dataclass(frozen=True)
class Progress:
    """Progress of a load path.

    Attributes
    ----------
    finished : int
        Loads that are finished.
    loads : int
        Loads of the path.
    fraction : float
        Estimated fraction of the present load that is done.
    iteration : int
        Iteration of the present grid.
    residual : float
        Residual over the mean pressure.
    """

    finished: int
    loads: int
    fraction: float
    iteration: int
    residual: float


Show = Callable[[int, float, int, float], object]


def visible() -> bool:
    """Whether somebody reads stderr: in a terminal and a notebook."""
    return sys.stderr is not None and (sys.stderr.isatty() or "ipykernel" in sys.modules)


@contextmanager
def bar(progress: bool | Callable[[Progress], object] | None, loads: int) -> Iterator[Show | None]:
    """What the solver calls with its progress: a callable of the user, a bar, or None."""
    if callable(progress):
        call = progress
        yield lambda finished, fraction, iteration, residual: call(Progress(finished, loads, fraction, iteration, residual))
        return
    if progress is False or progress is None and not visible():
        yield None
        return
    shown = _Bar(loads, 0.0 if progress else DELAY)
    try:
        yield shown.update
    finally:
        shown.close()


class _Bar:
    """A bar of tqdm if it is installed, else one line on stderr."""

    def __init__(self, loads: int, delay: float) -> None:
        self._loads, self._begin, self._line = loads, time.monotonic() + delay, False
        self._bar: Any = None
        try:
            from tqdm.auto import tqdm

            self._tqdm: Any = tqdm
        except ImportError:
            self._tqdm = None

    def update(self, finished: int, fraction: float, iteration: int, residual: float) -> None:
        if time.monotonic() < self._begin:
            return
        done, words = finished + fraction, f"load {finished + 1}, iteration {iteration}, residual {residual:.1e}"
        if self._tqdm is None:
            self._line = True
            sys.stderr.write(f"\rasperity: {100 * done / self._loads:5.1f} %, {words}   ")
            sys.stderr.flush()
            return
        if self._bar is None:
            self._bar = self._tqdm(total=float(self._loads), desc="asperity", bar_format="{l_bar}{bar}| {elapsed}{postfix}")
        self._bar.set_postfix_str(words, refresh=False)
        self._bar.update(min(done, self._loads) - self._bar.n)

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()
        if self._line:
            sys.stderr.write("\n")
