"""Rough surfaces."""

from __future__ import annotations

import json
import os
import sys
from importlib.util import find_spec
from typing import Any, TypedDict, cast, get_args, get_type_hints

import numpy as np
import numpy.typing as npt

from . import _asperity
from ._arguments import Map, a_path, real, real_map, whole
from ._errors import InputError
from ._html import table
from ._plot import plot_functions, plot_map


class Preparation(TypedDict, total=False):
    """Steps of preparation of a map, applied in this order. Lengths are in the unit of the surface."""

    crop: tuple[int, int, int, int]
    """First column, first row, columns and rows of the part that is kept."""
    remove_outliers: float
    """Points that deviate from the median of their neighbourhood by more than this many robust standard deviations are removed."""
    detrend: str
    """Subtracts ``mean``, ``plane``, ``quadratic`` or ``facets``, or levels each line along x: ``line-median``, ``line-linear``, ``line-quadratic``; or
    subtracts the plane through the mean heights next to three points, in lengths from the first point: ``three-points=1,1;9,1;5,8``."""
    fill: str
    """Replaces missing points (NaN): ``nearest`` or ``harmonic``."""
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
    extend_to: float
    """Shortest of the waves that are added below `low_pass`, down to which the map is trusted: a realisation of the self-affine spectrum that is fitted
    to its waves above."""
    isotropic_map: bool
    """Whether a profile, one line of heights, becomes a square map: a realisation of the isotropic random surface whose profiles have its spectrum."""
    seed: int
    """Seed of the waves that are added, or of the isotropic map."""


#: Type of the value of each step, in the order of the steps.
STEPS: dict[str, Any] = get_type_hints(Preparation)


def _step(key: str, value: Any) -> Any:
    if STEPS[key] is float:
        return real(key, value)
    if STEPS[key] is bool:
        if not isinstance(value, bool):
            raise InputError(f"{key} = {value!r}; accepted: True or False")
        return value
    if STEPS[key] is int:
        return whole(key, value, 0)
    if STEPS[key] is str:
        if not isinstance(value, str):
            raise InputError(f"{key} = {value!r}; accepted: a word, as Preparation lists them")
        return value
    count = len(get_args(STEPS[key]))
    if np.shape(value) != (count,):
        raise InputError(f"{key} = {value!r}; accepted: {count} whole numbers")
    return tuple(whole(key, number, 0) for number in value)


def _steps(preparation: Preparation | None) -> dict[str, Any]:
    if not isinstance(preparation, (dict, type(None))):
        raise InputError(f"preparation = {preparation!r}; accepted: a dictionary of {', '.join(STEPS)}")
    steps = {key: value for key, value in (preparation or {}).items() if value is not None}
    if unknown := sorted(set(steps) - set(STEPS)):
        raise InputError(f"preparation = {unknown}; accepted: {', '.join(STEPS)}")
    adds_waves = "extend_to" in steps or bool(steps.get("isotropic_map"))
    if "seed" in steps and not adds_waves:
        raise InputError(f"seed = {steps['seed']!r}; accepted: none without extend_to or isotropic_map, whose waves it determines")
    if adds_waves and "seed" not in steps:
        raise InputError("seed = None; accepted: a whole number with extend_to or isotropic_map, the seed of its waves")
    return dict.fromkeys(STEPS) | {key: _step(key, value) for key, value in steps.items()}


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
        >>> import numpy as np
        >>> import asperity
        >>> x = np.arange(64) / 64 * 2 * np.pi
        >>> surface = asperity.Surface.from_array(0.1 * np.cos(x)[:, None] * np.cos(x), 10.0, touching="high-points")
        >>> surface.shape, round(surface.rms_height, 3)
        ((64, 64), 0.05)
        """
        lengths = (real("length", length), None if length_y is None else real("length_y", length_y))
        native = _asperity.Surface.from_array(real_map("heights", heights), lengths, touching, bool(periodic), _steps(preparation))
        return cls(native, unit)

    @classmethod
    def from_file(
        cls,
        path: str | os.PathLike[str],
        *,
        length: float | None = None,
        touching: str | None = None,
        dataset: str | None = None,
        profile: bool = False,
        unit: str = "",
        preparation: Preparation | None = None,
    ) -> Surface:
        """A surface from a file: text, ``.npy``, ``.npz``, HDF5, NetCDF, ``.x3p``, ``.sdf``, ``.sur`` or ``.gwy``.

        Other files of instruments, and containers of contact.engineering, are read by SurfaceTopography in another process of this Python
        (``pip install "asperity[files]"``); high points touch first unless `touching` is given.

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
            Name of the array or channel, in a file with several; by SurfaceTopography also its number, as text.
        profile : bool
            Whether the file is a profile: positions and heights in two columns, or one line of heights. The surface is uniform along y (line
            contact), or with ``isotropic_map`` in the preparation one realisation of an isotropic one.
        unit : str, optional
            Unit of lengths, a label if the file declares none. Default: that of the file.
        preparation : Preparation, optional
            Steps that the map goes through.

        Raises
        ------
        InputError
            For files that cannot be read, and values that are missing or differ from those of the file.
        """
        steps = _steps(preparation)
        python = sys.executable if sys.executable and find_spec("SurfaceTopography") else None
        length = None if length is None else real("length", length)
        source = (dataset, python, profile, unit or None)
        native = _asperity.Surface.from_file(os.fspath(a_path("path", path)), length, touching, source, steps)
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
        spectrum = (real("hurst", hurst), real("lambda_r", lambda_r), real("lambda_s", lambda_s), real("rms_gradient", rms_gradient))
        values = (spectrum, amplitudes, (whole("nodes", nodes, 1), real("length", length), whole("seed", seed, 0)))
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

    def facing(
        self, other: Surface, *, turned_over: bool = True, quarter_turns: int = 0, shift: tuple[float, float] = (0.0, 0.0)
    ) -> Surface:
        """The surface that presses on a flat body as this one presses on a second rough body: the sum of their heights.

        Where both repeat, in one cell, the sum does; otherwise it is over the part where one map lies on the other.

        Parameters
        ----------
        other : Surface
            The second rough body, in the same unit of length.
        turned_over : bool
            Whether its map, seen as it was measured, is turned over about its y axis, as one that is laid face down.
        quarter_turns : int
            Quarter turns from x towards y, 0 to 3, after it is turned over.
        shift : pair of float
            Shift along x and y in the unit of the surfaces, after the turns.

        Raises
        ------
        InputError
            For cells that differ, maps that do not lie on each other, and values that are not accepted.

        Examples
        --------
        >>> import asperity
        >>> bodies = [asperity.Surface.from_spectrum(64, seed=seed, lambda_s=1 / 16, rms_gradient=0.1) for seed in (1, 2)]
        >>> both = bodies[0].facing(bodies[1])
        >>> 1.3 < both.rms_gradient / 0.1 < 1.5
        True
        """
        if len(shift) != 2:
            raise InputError(f"shift = {shift!r}; accepted: two lengths")
        moved = [real("shift", s) for s in shift]
        turns = whole("quarter_turns", quarter_turns, 0)
        if turns > 3:
            raise InputError(f"quarter_turns = {quarter_turns!r}; accepted: 0, 1, 2 or 3")
        both = self._native.facing(native(other), (bool(turned_over), turns, moved))
        if self.unit and other.unit and other.unit != self.unit:
            raise InputError(f"other.unit = {other.unit!r}; accepted: that of this surface, {self.unit!r}")
        return Surface(both, self.unit or other.unit)

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
        """Shape, extents, rms height, rms gradient and range of the heights, and parameters of ISO 25178-2: `sa`, `ssk` (peaks towards
        the other body are positive), `sku`, `sdq` (differences between neighbours), `sdr`, `sal` and `str` (autocorrelation 0.2; None
        where it does not decay). No filter is applied."""
        return {
            "shape": self.shape,
            "cell": self.cell,
            "rms_height": self.rms_height,
            "rms_gradient": self.rms_gradient,
            "height_range": float(np.ptp(self.heights)),
            **dict(self._native.areal()),
        }

    def power_spectrum(self, axis: str = "radius") -> tuple[Map, Map]:
        """Wave numbers and power spectral density.

        Along ``x`` or ``y`` the mean of the profiles, ``L |a|²``, and over the ``radius`` the mean of ``A |a|²`` in ten bins per decade, of
        the Fourier coefficients a, extents L and area A (https://doi.org/10.1088/2051-672X/aa51f8). A map that does not repeat is levelled and windowed
        (Hann).

        >>> import numpy as np
        >>> import asperity
        >>> x = np.arange(16) / 16
        >>> surface = asperity.Surface.from_array(np.tile(np.cos(2 * np.pi * x), (16, 1)), 1.0, touching="low-points")
        >>> q, density = surface.power_spectrum("x")
        >>> print(f"{q[0] / (2 * np.pi):.3f} {density[0]:.3f} {abs(density[1:]).max():.3f}")
        1.000 0.250 0.000
        """
        return self._native.power_spectrum(axis)

    def scale_dependent(self, axis: str = "x") -> dict[str, Map]:
        """Differences of heights over a distance along ``x`` or ``y``: `distance`, `structure_function` (mean square difference),
        `slope` (rms difference over the distance) and `curvature` (rms second difference over a stencil of that length, NaN at odd numbers
        of pixels)."""
        return dict(zip(("distance", "structure_function", "slope", "curvature"), self._native.scale_dependent(axis), strict=True))

    def tip(self, radius: float, *, half_angle: float = 0.0) -> dict[str, Any]:
        """What the tip of a scanning probe, a ball of ``radius`` on a cone of ``half_angle`` (degrees), has left of this map.

        `cutoff` is the length below which peaks are as sharp as half of the tip's curvature, or None
        (https://doi.org/10.1016/j.apsadv.2021.100190). `heights` ``[ny, nx]`` is the surface that makes the same map and protrudes
        most, `touched` where it is certain (https://doi.org/10.6028/jres.102.030).
        """
        angle = real("half_angle", half_angle)
        if not real("radius", radius) > 0:
            raise InputError(f"radius = {radius!r}; accepted: a positive number, in the unit of the surface")
        if not 0 <= angle < 90:
            raise InputError(f"half_angle = {half_angle!r}; accepted: 0 to below 90 degrees")
        return dict(zip(("cutoff", "heights", "touched"), self._native.tip(radius, float(np.radians(angle))), strict=True))

    def plot_functions(self, *, axes: Any = None) -> Any:
        """Power spectra, and slope over distance, of both axes by matplotlib; returns the two axes."""
        return plot_functions(self, axes=axes)

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
        return plot_map(self.heights, self.cell, ("height (low points touch first)", self.unit), self.unit, **options)


def _restored(maker: str, values: tuple[Any, ...], unit: str) -> Surface:
    return Surface(getattr(_asperity.Surface, maker)(*values), unit, (maker, values) if maker == "from_spectrum" else None)


def native(surface: Surface) -> _asperity.Surface:
    """A surface as the compiled part takes it."""
    if not isinstance(surface, Surface):
        raise InputError(f"surface = {type(surface).__name__}; accepted: a Surface, as from Surface.from_array")
    return surface._native
