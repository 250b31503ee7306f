"""Rough surfaces."""

from __future__ import annotations

import json
import operator
import os
from typing import Any, TypedDict, cast

import numpy as np
import numpy.typing as npt

from . import _asperity
from ._errors import InputError
from ._html import table

Map = npt.NDArray[np.float64]


class Preparation(TypedDict, total=False):
    """Steps of preparation of a map, applied in this order. Lengths are in the unit of the surface."""

    crop: tuple[int, int, int, int]
    """First column, first row, columns and rows of the part that is kept."""
    remove_outliers: float
    """Points that deviate from the median of their neighbourhood by more than this many robust standard deviations are removed."""
    fill: str
    """Replaces missing points (NaN): ``nearest`` or ``harmonic``."""
    detrend: str
    """Subtracts ``mean``, ``plane`` or ``quadratic``."""
    low_pass: float
    """Wavelength below which waves are removed."""
    high_pass: float
    """Wavelength above which waves are removed."""
    filter: str
    """``gaussian`` (default) or ``sharp``."""
    resample: tuple[int, int]
    """Columns and rows of the resampled map."""
    edges: str
    """Makes the map periodic: ``taper`` or ``mirror``."""


WORDS = ("fill", "detrend", "filter", "edges")
LENGTHS = ("remove_outliers", "low_pass", "high_pass")
COUNTS = {"crop": 4, "resample": 2}
STEPS = ("crop", "remove_outliers", "fill", "detrend", "low_pass", "high_pass", "filter", "resample", "edges")


def _steps(preparation: Preparation | None) -> dict[str, Any]:
    if not isinstance(preparation, (dict, type(None))):
        raise InputError(f"preparation = {preparation!r}; accepted: a dictionary of {', '.join(STEPS)}")
    given: dict[str, Any] = {key: value for key, value in (preparation or {}).items() if value is not None}
    if unknown := sorted(set(given) - set(STEPS)):
        raise InputError(f"preparation = {unknown}; accepted: {', '.join(STEPS)}")
    for key, value in given.items():
        if key in WORDS and not isinstance(value, str):
            raise InputError(f"{key} = {value!r}; accepted: a word, as Preparation lists them")
        if key in LENGTHS:
            given[key] = real(key, value)
        if key in COUNTS:
            given[key] = _counts(key, value)
    return {"filter": "gaussian"} | dict.fromkeys((s for s in STEPS if s != "filter")) | given


def _counts(key: str, values: Any) -> tuple[int, ...]:
    try:
        counts = tuple(operator.index(v) for v in values)
    except TypeError:
        counts = ()
    if len(counts) != COUNTS[key] or min(counts) < 0:
        raise InputError(f"{key} = {values!r}; accepted: {COUNTS[key]} whole numbers")
    return counts


def as_map(name: str, values: npt.ArrayLike) -> Map:
    """A real map ``[ny, nx]``; not copied where it has 64-bit floating-point numbers already."""
    if np.ma.isMaskedArray(values):
        # The stubs of numpy lose the mask in `astype`.
        masked: Any = values
        values = masked.astype(np.float64).filled(np.nan)
    if set(getattr(values, "dims", ())) == {"x", "y"}:
        # An array of xarray names its axes.
        labelled: Any = values
        values = labelled.transpose("y", "x")
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise InputError(f"{name} = rows of different lengths ({error}); accepted: real numbers [ny, nx]") from None
    if array.ndim != 2 or array.size == 0 or array.dtype.kind not in "fiu":
        raise InputError(f"{name} = an array of shape {array.shape} and type {array.dtype}; accepted: real numbers [ny, nx]")
    return np.asarray(array, dtype=np.float64)


def real(name: str, value: float) -> float:
    """A number, for a message that names the argument."""
    try:
        if isinstance(value, (str, bytes, bool)):
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise InputError(f"{name} = {value!r}; accepted: a number") from None


class Surface:
    """A rough surface on a cell: a height map, or the waves of a spectrum on a grid.

    Made by :meth:`from_array`, :meth:`from_file`, :meth:`from_spectrum` or :meth:`from_topography`.

    Attributes
    ----------
    unit : str
        Unit of its lengths: a label for tables and axes. Results have the unit of the surface, whatever it is.
    """

    def __init__(self, native: _asperity.Surface, unit: str = "", origin: tuple[str, tuple[Any, ...]] | None = None) -> None:
        if not isinstance(native, _asperity.Surface):
            raise InputError("Surface(…) takes no heights; accepted: Surface.from_array, from_file, from_spectrum, from_topography")
        if not isinstance(unit, str):
            raise InputError(f"unit = {unit!r}; accepted: a word, such as um")
        self._native = native
        self._origin = origin
        self.unit = unit

    @classmethod
    def from_array(
        cls,
        heights: npt.ArrayLike,
        length: float,
        *,
        touching: str,
        length_y: float | None = None,
        periodic: bool = True,
        unit: str = "",
        preparation: Preparation | None = None,
    ) -> Surface:
        """A surface from an array of heights.

        Parameters
        ----------
        heights : array_like, shape (ny, nx)
            Heights in the unit of `length`; x is the fast axis. NaN and masked points are missing.
        length : float
            Extent along x.
        touching : {'high-points', 'low-points'}
            Which points touch the other body first. ``high-points``: heights point out of the rough body.
        length_y : float, optional
            Extent along y. Default: square pixels.
        periodic : bool
            Whether the map repeats. If not, filters and fill do not continue across its edges, and :func:`asperity.solve` requires
            ``body=NonPeriodic()`` or a preparation of the edges, or warns.
        unit : str, optional
            Label of the unit of lengths.
        preparation : Preparation, optional
            Steps that the map goes through.

        Raises
        ------
        InputError
            For values that are not accepted, and missing points without a fill.

        Examples
        --------
        >>> import numpy as np, asperity
        >>> x = np.arange(64) / 64 * 2 * np.pi
        >>> surface = asperity.Surface.from_array(0.1 * np.cos(x)[:, None] * np.cos(x), 10.0, touching="high-points")
        >>> surface.shape, round(surface.rms_height, 3)
        ((64, 64), 0.05)
        """
        lengths = (real("length", length), None if length_y is None else real("length_y", length_y))
        native = _asperity.Surface.from_array(as_map("heights", heights), lengths, touching, bool(periodic), _steps(preparation))
        return cls(native, unit)

    @classmethod
    def from_file(
        cls,
        path: str | os.PathLike[str],
        *,
        length: float | None = None,
        touching: str | None = None,
        dataset: str | None = None,
        unit: str = "",
        preparation: Preparation | None = None,
    ) -> Surface:
        """A surface from a file: text, ``.npy``, ``.npz``, HDF5, NetCDF, ``.x3p``, ``.sdf``, ``.sur`` or ``.gwy``.

        What the file declares is used; what it does not declare is an argument. Lengths are in the unit of the heights.

        Parameters
        ----------
        path : path_like
            The file.
        length : float, optional
            Extent along x, if the file does not declare it.
        touching : {'high-points', 'low-points'}, optional
            Which points touch first, if the file does not declare it.
        dataset : str, optional
            Name of the array or channel, in a file with several.
        unit : str, optional
            Label of the unit of lengths. Default: that of the file.
        preparation : Preparation, optional
            Steps that the map goes through.

        Raises
        ------
        InputError
            For files that cannot be read, and values that are missing or differ from those of the file.
        """
        steps = _steps(preparation)
        native = _asperity.Surface.from_file(os.fspath(path), length, touching, dataset, steps)
        surface = cls(native, unit)
        surface.unit = unit or str((surface.provenance or {}).get("unit") or "")
        return surface

    @classmethod
    def from_spectrum(
        cls,
        nodes: int,
        *,
        length: float = 1.0,
        seed: int,
        hurst: float = 0.8,
        lambda_r: float = 0.2,
        lambda_s: float = 0.001,
        rms_gradient: float = 1.0,
        amplitudes: str = "gaussian",
        unit: str = "",
    ) -> Surface:
        """A realisation of a self-affine spectrum. Defaults are those of the contact-mechanics challenge.

        Parameters
        ----------
        nodes : int
            Nodes along x and along y.
        length : float
            Extent of the cell.
        seed : int
            Seed of the phases: the same waves on every grid.
        hurst : float
            Hurst exponent H.
        lambda_r, lambda_s : float
            Roll-off wavelength and short cut-off, over `length`.
        rms_gradient : float
            rms gradient of the whole spectrum.
        amplitudes : {'gaussian', 'fixed'}
            Distribution of the moduli of the modes.
        unit : str, optional
            Label of the unit of lengths.

        Raises
        ------
        InputError
            For values out of their range.

        References
        ----------
        Müser et al., Tribol. Lett. 65 (2017) 118, eq. 1.

        Examples
        --------
        >>> import asperity
        >>> surface = asperity.Surface.from_spectrum(64, seed=1, lambda_s=1 / 16, rms_gradient=0.1)
        >>> round(surface.rms_gradient, 12)
        0.1
        """
        for name, value, least in (("nodes", nodes, 1), ("seed", seed, 0)):
            if not isinstance(value, (int, np.integer)) or not least <= value < 2**64:
                raise InputError(f"{name} = {value!r}; accepted: a whole number from {least} on")
        spectrum = (real("hurst", hurst), real("lambda_r", lambda_r), real("lambda_s", lambda_s), real("rms_gradient", rms_gradient))
        values = (spectrum, amplitudes, (int(nodes), real("length", length), int(seed)))
        return cls(_asperity.Surface.from_spectrum(*values), unit, ("from_spectrum", values))

    @classmethod
    def from_topography(cls, topography: Any, *, touching: str = "high-points", preparation: Preparation | None = None) -> Surface:
        """A surface from a map of `SurfaceTopography`, with its extents, unit, missing points and periodicity.

        Arrays of SurfaceTopography have x as the slow axis; it becomes the fast axis here.
        """
        if not all(hasattr(topography, name) for name in ("physical_sizes", "is_periodic", "unit", "heights")):
            accepted = "a topography of SurfaceTopography; Surface.from_array takes arrays"
            raise InputError(f"topography = {type(topography).__name__}; accepted: {accepted}")
        x, y = topography.physical_sizes
        return cls.from_array(
            topography.heights().T,
            x,
            length_y=y,
            touching=touching,
            periodic=bool(topography.is_periodic),
            unit=str(topography.unit or ""),
            preparation=preparation,
        )

    @property
    def shape(self) -> tuple[int, int]:
        """Shape ``(ny, nx)`` of its maps."""
        return self._native.shape()

    @property
    def periodic(self) -> bool:
        """Whether the map repeats, or was made to by its preparation. :func:`asperity.solve` takes every surface as periodic unless its
        body is :class:`asperity.NonPeriodic`, and warns where this is False."""
        return self._native.is_periodic()

    @property
    def cell(self) -> tuple[float, float]:
        """Extents of the cell along x and along y."""
        return self._native.cell()

    @property
    def heights(self) -> Map:
        """Heights ``[ny, nx]`` in the unit of the length: low points touch first, the lowest is at 0. A new array each time."""
        return self._native.heights()

    @property
    def rms_height(self) -> float:
        """rms of the heights about their mean."""
        return self._native.rms_height()

    @property
    def rms_gradient(self) -> float:
        """rms gradient of all waves that the grid resolves."""
        return self._native.rms_gradient()

    @property
    def warnings(self) -> list[str]:
        """What limits results on this surface: unresolved waves, steep slopes, quantised heights."""
        return self._native.warnings()

    @property
    def preparation_steps(self) -> list[str]:
        """Steps of preparation that were applied, with their parameters."""
        return self._native.preparation_steps()

    @property
    def provenance(self) -> dict[str, Any] | None:
        """File, declared properties and preparation of a surface from a file."""
        text = self._native.provenance()
        return None if text is None else cast("dict[str, Any]", json.loads(text))

    def statistics(self) -> dict[str, Any]:
        """Shape, extents, rms height, rms gradient and range of the heights."""
        return {
            "shape": self.shape,
            "cell": self.cell,
            "rms_height": self.rms_height,
            "rms_gradient": self.rms_gradient,
            "height_range": float(np.ptp(self.heights)),
        }

    def __repr__(self) -> str:
        (ny, nx), (x, y), unit = self.shape, self.cell, f" {self.unit}" if self.unit else ""
        return f"<Surface {nx} x {ny} nodes, {x:.6g} x {y:.6g}{unit}, rms height {self.rms_height:.4g}{unit}>"

    def _repr_html_(self) -> str:
        (ny, nx), (x, y) = self.shape, self.cell
        rows = [
            ("nodes", f"{nx} × {ny}"),
            ("extents", f"{x:.6g} × {y:.6g} {self.unit}"),
            ("rms height", f"{self.rms_height:.4g} {self.unit}"),
            ("rms gradient", f"{self.rms_gradient:.4g}"),
            *(("preparation", step) for step in self.preparation_steps),
            *(("warning", text) for text in self.warnings),
        ]
        return table(None, rows)

    def __reduce__(self) -> tuple[Any, ...]:
        if self._origin is not None:
            return _restored, (*self._origin, self.unit)
        (x, y), heights = self.cell, self.heights
        values = (heights, (x, y), "low-points", self.periodic, _steps(None))
        return _restored, ("from_array", values, self.unit)

    def plot_map(self, **options: Any) -> Any:
        """Map of :attr:`heights` by matplotlib: low points touch first. Options are `ax` and those of ``Axes.imshow``; returns the axes."""
        from ._plot import plot_map

        return plot_map(self.heights, self.cell, ("height (low points touch first)", self.unit), self.unit, **options)


def _restored(maker: str, values: tuple[Any, ...], unit: str) -> Surface:
    return Surface(getattr(_asperity.Surface, maker)(*values), unit, (maker, values) if maker == "from_spectrum" else None)
