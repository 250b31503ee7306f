"""Files of instruments, read by SurfaceTopography and written as NetCDF, which asperity reads.

``pip install "asperity[files]"`` installs the readers. ``python -m asperity.convert FILE OUT.nc`` converts a file and
``python -m asperity.convert FILE --list`` lists its channels, or the measurements of a container of contact.engineering. Unit, extents, missing
points, sign, periodicity and origin are carried over.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib
import os
import re
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from . import _asperity
from ._errors import CLASSES, AsperityError, InputError, ResourceError

#: Units of length of SurfaceTopography in ASCII, as attributes of NetCDF need it.
ASCII = {"µm": "um", "μm": "um", "Å": "angstrom"}

#: Words of a NetCDF file for the points that touch first.
SIGNS = {"high-points": "high points touch first", "low-points": "low points touch first"}

#: Deviation of positions from equal steps, over the step, up to which it is not said that heights are interpolated.
EQUAL_STEPS = 0.02

SELECT = "as --dataset (surface.dataset)"


@dataclass(frozen=True)
class Channel:
    """One map of a file: a channel, or a measurement of a container."""

    name: str
    """Name that selects it."""
    points: tuple[int, ...]
    """Points along x and y; of a line scan one number."""
    lengths: tuple[float, ...] | None
    """Extents along x and y in `unit`, if the file declares them."""
    unit: str | None
    """Unit of heights and extents."""
    quantity: str
    """``height``, or what else the values are."""
    periodic: bool | None
    """Whether the map repeats, if the file declares it."""
    reader: str
    """Format, as SurfaceTopography names it."""
    read: Callable[[], Any]
    """Reads the topography."""

    @property
    def is_map(self) -> bool:
        """Whether it is a map of heights."""
        return self.quantity == "height" and len(self.points) == 2

    @property
    def is_profile(self) -> bool:
        """Whether it is a line of heights."""
        return self.quantity == "height" and len(self.points) == 1

    def __str__(self) -> str:
        points = " x ".join(map(str, self.points))
        extents = "no lateral size" if self.lengths is None else " x ".join(f"{length:.6g}" for length in self.lengths)
        unit = "no unit" if self.unit is None else self.unit
        what = "" if self.is_map else f"; {self.quantity}, no heights" if self.quantity != "height" else "; a profile"
        return f"{self.name}: {points} points, {extents}, {unit}{what}"


class _Entry(NamedTuple):
    """A name that selects a map, and what reads it."""

    name: str
    load: Callable[[], Channel]
    is_measurement: bool = False
    """Of a container: loading reads its heights."""


def _library() -> Any:
    try:
        with warnings.catch_warnings():
            # That it falls back to one process without MPI.
            warnings.simplefilter("ignore", ImportWarning)
            return importlib.import_module("SurfaceTopography")
    except ImportError as error:
        why = str(error).splitlines()[0]
        raise ResourceError(f'SurfaceTopography in {sys.executable} ({why}) was not found; `pip install "asperity[files]"`') from error


def _one_line(error: BaseException) -> str:
    words = " ".join(str(error).split())
    return f"{type(error).__name__}: {words[:300]}" if words else type(error).__name__


def _damaged(path: str, error: Exception, what: str = "") -> AsperityError:
    if isinstance(error, AsperityError):
        return error
    if isinstance(error, MemoryError):
        return ResourceError(f"{path}: {what}memory does not hold it ({_one_line(error)})")
    version = _library().__version__
    accepted = "an undamaged file, or what Gwyddion saves of it as .gwy"
    return InputError(f"{path}: {what}SurfaceTopography {version} cannot read it ({_one_line(error)}); accepted: {accepted}")


def _of_file(path: str) -> list[_Entry]:
    """Channels of a file of an instrument."""
    library = _library()
    try:
        reader = library.open_topography(path)
        return [_Entry(channel.channel_id, partial(_channel, reader, channel)) for channel in reader.channels]
    except library.Exceptions.CannotDetectFileFormat:
        version, accepted = library.__version__, "a format that `python -m asperity.convert --formats` lists"
        raise InputError(f"{path}: no reader of SurfaceTopography {version} knows this file; accepted: {accepted}") from None
    except Exception as error:
        raise _damaged(path, error) from error


def _channel(reader: Any, channel: Any) -> Channel:
    # Of a profile some readers have a number in place of a tuple.
    sizes = None if channel.physical_sizes is None else np.ravel(channel.physical_sizes)
    known = sizes is not None and all(size is not None and np.isfinite(size) and size > 0 for size in sizes)
    # Readers require extents, also where the file has none; these are not written.
    options = {} if sizes is not None else {"physical_sizes": tuple(float(n) for n in channel.nb_grid_pts)}
    return Channel(
        name=channel.channel_id,
        points=tuple(map(int, np.ravel(channel.nb_grid_pts))),
        lengths=tuple(map(float, sizes)) if sizes is not None and known else None,
        unit=channel.unit if isinstance(channel.unit, str) else None,
        quantity=_quantity(channel),
        periodic=None if channel.is_periodic is None else bool(channel.is_periodic),
        reader=f"reader {reader.format()}",
        read=lambda: channel.topography(**options),
    )


def _quantity(channel: Any) -> str:
    """``height``, or what the values of a channel are. Some readers have a unit of the plane and one of the values."""
    is_apart = isinstance(channel.unit, tuple)
    if channel.is_height_channel and not is_apart:
        return "height"
    of_values = channel.unit[-1] if is_apart else channel.data_unit
    return f"{'values' if channel.is_height_channel else channel.data_kind.value} in {of_values or 'no unit'}"


def _of_container(path: str) -> list[_Entry] | None:
    """Measurements of a container, each read when it is needed; None for other files."""
    containers = importlib.import_module("SurfaceTopography.Container.IO")
    try:
        reader = containers.open_container(path)
    except containers.CannotDetectFileFormat:
        return None
    found = []
    for k in range(reader.nb_containers):
        surface, members = reader.container(k), [member for member in reader.members(k) if member.visible]
        title = f"{(surface.info or {}).get('name') or k + 1}/" if reader.nb_containers > 1 else ""
        for index, member in enumerate(members):
            name = f"{title}{member.name}"
            found.append(_Entry(name, partial(_measurement, path, name, (reader.format(), surface, index)), True))
    return found


def _measurement(path: str, name: str, place: tuple[str, Any, int]) -> Channel:
    container, surface, index = place
    try:
        topography = surface[index]
        sizes = topography.physical_sizes
        return Channel(
            name=name,
            points=tuple(topography.nb_grid_pts),
            lengths=None if sizes is None else tuple(map(float, np.ravel(sizes))),
            unit=topography.unit,
            quantity="height",
            periodic=bool(topography.is_periodic) if topography.dim == 2 else None,
            reader=f"container {container}",
            read=lambda: topography,
        )
    except Exception as error:
        raise _damaged(path, error, f"measurement {name!r}: ") from error


def _entries(path: str) -> list[_Entry]:
    """The channels or measurements of a file, with unique names."""
    if not os.path.isfile(path):
        raise InputError(f"{path}: no such file; accepted: a file of an instrument")
    _library()
    entries = _of_container(path)
    entries = _of_file(path) if entries is None else entries
    names = [entry.name for entry in entries]
    return [e._replace(name=f"{e.name}#{k + 1}") if names.count(e.name) > 1 else e for k, e in enumerate(entries)]


def _loaded(entry: _Entry) -> Channel:
    """The map, under the name that selects it."""
    return replace(entry.load(), name=entry.name)


def channels(path: str | os.PathLike[str]) -> list[Channel]:
    """The channels of a file, or the measurements of a container.

    Raises
    ------
    InputError
        For files that cannot be read.
    ResourceError
        Without SurfaceTopography.
    """
    return [_loaded(entry) for entry in _entries(os.fspath(path))]


def _chosen(path: str, dataset: str | int | None, profile: bool) -> tuple[Channel, list[str]]:
    """The map or profile that `dataset` names or counts (from 1), or the only one; and the names of all that may be chosen."""
    entries = _entries(path)

    def fits(channel: Channel) -> bool:
        return channel.is_profile if profile else channel.is_map

    is_one_of_many = len(entries) > 1 and not entries[0].is_measurement
    kind = "profile" if profile else "map of heights"
    fitting = [entry for entry in entries if fits(entry.load())] if is_one_of_many else entries
    listed = ", ".join(f"{entries.index(entry) + 1} {entry.name!r}" for entry in fitting) or f"a file with a {kind}"
    if dataset is None:
        if len(fitting) != 1:
            count = f"{len(fitting)} {'profiles' if profile else 'maps of heights'}"
            others = [] if fitting or profile else [entry for entry in entries if entry.load().is_profile]
            accepted = "a profile with --profile (surface.profile)" if others else f"the name or number of one {SELECT}: {listed}"
            raise InputError(f"{path}: {count}; accepted: {accepted}")
        entry = fitting[0]
    else:
        named = [entry for entry in entries if entry.name == str(dataset)]
        counted = entries[int(dataset) - 1 : int(dataset)] if re.fullmatch(r"[1-9][0-9]{0,8}", str(dataset)) else []
        if not (named or counted):
            raise InputError(f"{path}: dataset = {str(dataset)!r}; accepted: {listed}")
        entry = (named or counted)[0]
    channel = _loaded(entry)
    if not fits(channel):
        found = f"a profile of {channel.points[0]} points" if channel.is_profile else f"a map of {' x '.join(map(str, channel.points))} points"
        found = found if channel.quantity == "height" else f"{channel.quantity}, no heights"
        other = " with --profile (surface.profile)" if channel.is_profile else ""
        accepted = listed if len(fitting) > 1 else f"it{other}" if other else f"a {kind}"
        raise InputError(f"{path}: {entry.name!r} is {found}; accepted: {accepted}")
    return channel, [entry.name for entry in fitting]


def _length(text: str) -> tuple[float, str]:
    """Number and unit of an extent."""
    match = re.fullmatch(r"\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(\S*)\s*", text)
    try:
        number = float(match[1]) if match else 0.0
    except ValueError:
        number = 0.0
    if not match or not 0 < number < np.inf:
        raise InputError(f"length = {text!r}; accepted: a positive number with a unit of length, as 20um")
    return number, match[2]


def convert(
    path: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    dataset: str | int | None = None,
    length: str | None = None,
    touching: str = "high-points",
    profile: bool = False,
) -> Channel:
    """Writes one map or profile of a file as NetCDF, with unit, extents, missing points (NaN), sign, periodicity and origin.

    Parameters
    ----------
    path : path_like
        A file that SurfaceTopography reads, or a container of contact.engineering or Keyence.
    out : path_like
        The NetCDF file.
    dataset : str or int, optional
        Name or number (from 1) of the channel or measurement; required in a file with several maps of heights, or profiles.
    length : str, optional
        Extent along x with its unit (``20um``), if the file does not declare it; pixels are square. A file may also be written without.
    touching : {'high-points', 'low-points'}
        Which points touch first: those of instruments are high, those of a replica low.
    profile : bool
        Whether it is a profile, which becomes a map of one line along x. One without equal steps is interpolated to as many.

    Returns
    -------
    Channel
        What was written.

    Raises
    ------
    InputError
        For files that cannot be read, and values that are not accepted.
    ResourceError
        Without SurfaceTopography.
    """
    path, out = os.fspath(path), os.fspath(out)
    if touching not in SIGNS:
        raise InputError(f"touching = {touching!r}; accepted: {' or '.join(SIGNS)}")
    if os.path.exists(out) and os.path.exists(path) and os.path.samefile(path, out):
        raise InputError(f"{out}: the file that is read; accepted: another file")
    given = None if length is None else _length(length)
    channel, names = _chosen(path, dataset, profile)
    if given is not None and channel.lengths is not None:
        raise InputError(f"{path}: length = {length}; accepted: none, as the file declares {channel}")
    try:
        topography = channel.read()
        channel = replace(channel, unit=topography.unit)
        heights, step = _profile(path, topography) if profile else (np.ma.filled(np.ma.asarray(topography.heights(), float), np.nan), None)
    except Exception as error:
        raise _damaged(path, error, f"{channel.name!r}: ") from error
    if heights.shape != channel.points:
        raise InputError(f"{path}: {channel.name!r} has {heights.shape} points; accepted: {channel.points}, as it declares")
    if profile:
        # A line has one extent; the pixels of the map are square.
        heights, channel = heights[:, np.newaxis], replace(channel, points=(*channel.points, 1))
        if step is not None or channel.lengths is not None:
            step = channel.lengths[0] / len(heights) if step is None and channel.lengths else step
            assert step is not None
            channel = replace(channel, lengths=(step * len(heights), step))
    lateral = channel.unit
    if given is not None:
        spacing, lateral = given[0] / channel.points[0], given[1] or channel.unit
        channel = replace(channel, lengths=(given[0], spacing * channel.points[1]))
    stated = {"sign": SIGNS[touching], "channel": channel.name, "channels": "\n".join(names), "preparation": _origin(path, channel)}
    _write(out, heights, channel, lateral, stated)
    return channel


def _profile(path: str, topography: Any) -> tuple[Any, float | None]:
    """Heights of a line at equal steps, and the step of a line without them."""
    heights: Any = np.ma.filled(np.ma.asarray(topography.heights(), float), np.nan)
    if topography.is_uniform:
        return heights, None
    positions = np.asarray(topography.positions(), float)
    if len(positions) > 1 and positions[-1] < positions[0]:
        positions, heights = positions[::-1], heights[::-1]
    if len(positions) < 2 or not (np.diff(positions) > 0).all():
        raise InputError(f"{path}: positions that neither rise nor fall throughout; accepted: a profile")
    step = float(positions[-1] - positions[0]) / (len(positions) - 1)
    even: Any = positions[0] + step * np.arange(len(positions))
    if np.abs(even - positions).max() > EQUAL_STEPS * step:
        warnings.warn("the positions are not equidistant: heights are interpolated linearly on as many equal steps", stacklevel=2)
    return np.interp(even, positions, heights), step


def _origin(path: str, channel: Channel) -> str:
    """Where the heights come from: the first step of what was done to them."""
    with open(path, "rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest() if sys.version_info >= (3, 11) else hashlib.sha256(file.read()).hexdigest()
    name, version = Path(path).name, _library().__version__
    return f"read from {name} (SHA-256 {digest}), {channel.name!r}, by SurfaceTopography {version} ({channel.reader})"


def _write(out: str, heights: Any, channel: Channel, lateral: str | None, stated: dict[str, str]) -> None:
    """NetCDF-3 as SurfaceTopography writes it: `heights[x, y]`; as a whole or not at all."""
    netcdf = importlib.import_module("scipy.io").netcdf_file
    part, is_own = f"{out}.part-{os.getpid()}", False
    try:
        # A new file: a link of this name is not followed.
        with open(part, "xb") as raw:
            is_own = True
            file = netcdf(raw, "w", version=2)
            for k, name in enumerate("xy"):
                n = heights.shape[k]
                file.createDimension(name, n)
                if channel.lengths is not None:
                    coordinate = file.createVariable(name, "f8", (name,))
                    coordinate[:] = np.arange(n) * (channel.lengths[k] / n)
                    # A plain number would be stored in single precision.
                    coordinate.length = np.float64(channel.lengths[k])
                    if lateral:
                        coordinate.unit = ASCII.get(lateral, lateral)
            variable = file.createVariable("heights", "f8", ("x", "y"))
            variable[:] = heights
            if channel.unit:
                variable.unit = ASCII.get(channel.unit, channel.unit)
            if channel.periodic is not None:
                variable.periodic = int(channel.periodic)
            for key, words in stated.items():
                setattr(variable, key, words.encode())
            file.flush()
        os.replace(part, out)
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error.strerror or error}); accepted: a path in a folder that exists") from error
    finally:
        if is_own:
            Path(part).unlink(missing_ok=True)


def _listed(path: str) -> list[str]:
    """One line for each channel or measurement, also for those that cannot be read."""
    lines = []
    for k, entry in enumerate(_entries(path)):
        try:
            lines.append(f"{k + 1}  {_loaded(entry)}")
        except InputError as error:
            lines.append(f"{k + 1}  {entry.name}: {error}")
    return lines


def formats() -> str:
    """A table in Markdown: the formats that asperity reads, those that SurfaceTopography does, and others that are recognised."""
    readers = importlib.import_module("SurfaceTopography.IO").readers if _library() else []
    containers = importlib.import_module("SurfaceTopography.Container.IO").readers
    rows = [(name, extensions, "asperity") for name, extensions, accepted in _asperity.formats() if accepted is None]
    own = {extension for _, extensions, _ in rows for extension in extensions.split()} - {".mat", ".zip", ".dat"}
    for reader in sorted([*readers, *containers], key=lambda r: str(r.name()).lower()):
        extensions = [f".{extension}" for extension in reader.file_extensions() or []]
        if not own & set(extensions):
            rows.append((reader.name(), " ".join(extensions), f"SurfaceTopography (`{reader.format()}`)"))
    others = {name: accepted for name, _, accepted in _asperity.formats() if accepted}
    for name, accepted in others.items():
        rows.append((name, "", "Gwyddion, which saves it as .gwy" if accepted.startswith("a file that Gwyddion") else "not read"))
    return "\n".join(f"| {' | '.join(row)} |" for row in [("format", "usual names", "read by"), ("---",) * 3, *rows])


def main(arguments: list[str]) -> int:
    """The command ``python -m asperity.convert``; returns its exit code, which is the program's for the same error."""
    description = "Writes a file of an instrument as NetCDF, which asperity reads."
    parser = argparse.ArgumentParser("python -m asperity.convert", description=description)
    parser.add_argument("file", metavar="FILE", nargs="?", help="a file that SurfaceTopography reads, or a container of contact.engineering")
    parser.add_argument("out", metavar="OUT.nc", nargs="?", help="the NetCDF file")
    parser.add_argument("--list", action="store_true", help="list channels or measurements instead")
    parser.add_argument("--formats", action="store_true", help="print a table of the formats instead")
    parser.add_argument("--dataset", "--channel", metavar="NAME|NUMBER", help="the channel or measurement, counted from 1")
    parser.add_argument("--length", metavar="L", help="extent along x with its unit (20um), if the file does not declare it")
    parser.add_argument("--touching", choices=list(SIGNS), default="high-points", help="points that touch first (default: high points)")
    parser.add_argument("--profile", action="store_true", help="the channel or measurement is a profile")
    options = parser.parse_args(arguments)
    asked = (options.file is not None, options.out is not None, options.list, options.formats)
    if asked not in [(True, True, False, False), (True, False, True, False), (False, False, False, True)]:
        parser.error("accepted: FILE OUT.nc, FILE --list, or --formats")
    try:
        with warnings.catch_warnings(record=True) as caught:
            print(_answer(options))
    except AsperityError as error:
        print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
        return next(code for code, kind in CLASSES.items() if isinstance(error, kind))
    for warning in caught:
        if issubclass(warning.category, (UserWarning, RuntimeWarning)):
            print(f"warning: {' '.join(str(warning.message).split())}", file=sys.stderr)
    return 0


def _answer(options: argparse.Namespace) -> str:
    if options.formats:
        return formats()
    if options.list:
        return "\n".join(_listed(options.file))
    chosen = convert(options.file, options.out, dataset=options.dataset, length=options.length, touching=options.touching, profile=options.profile)
    return f"{options.out}: {chosen}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
