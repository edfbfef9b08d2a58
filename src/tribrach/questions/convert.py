"""Scans from one format into another, every field kept, placed by their own poses or not."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer
from numpy.typing import NDArray

from tribrach._types import Array, Progress
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.clouds.formats import WRITERS, create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.scans.formats import read_scans
from tribrach.io.scans.units import as_filed, unit_of_crs
from tribrach.report.answer import Answer
from tribrach.scan.scan import Field, Lattice, Scan
from tribrach.scan.unit_doubt import slender
from tribrach.sentences import Sentence, joined
from tribrach.shell.command import WRITTEN, command

#: step of coordinates of clouds that come without one [m], and steps across their extent at least
_FINEST, _MANY = 1e-4, 1e5
#: points that are looked at of each chunk, digits after the point, and what tells them from noise
_GLANCE, _MOST_DIGITS, _TOLD = 5000, 9, 0.05
#: metres in a degree of a meridian
_DEGREE = 111_000.0
#: largest number of steps from the offset
_REACH = 2**31 - 2
_NORMALS = ("normal_x", "normal_y", "normal_z")


class ConvertedCloud(NamedTuple):
    """A file that was written."""

    path: Path
    points: int  #: how many
    cost: str = ""  #: what its steps cost, without the final stop; "" if nothing


@command(json=None, html=None, scans=True)
def convert(
    source: Annotated[Path, typer.Argument(help="A file of scans.")],
    destination: Annotated[
        Path, typer.Argument(help="File to write: .las, .laz, .copc.laz, .ply or .e57."), WRITTEN
    ],
    placed: Annotated[bool, typer.Option(help="Apply the poses that the source has.")] = False,
    step_mm: Annotated[
        float | None,
        typer.Option(
            min=1e-3, max=10, help="Coordinate step of LAS, LAZ and E57; that of the source."
        ),
    ] = None,
    *,
    progress: Progress,
) -> Answer:
    """Write scans in another format, every field kept."""
    scans, step = read_scans(source), None if step_mm is None else step_mm / 1e3
    made = convert_scans(scans, destination, placed=placed, step=step, progress=progress)
    lines = [f"{p}: {points} points" + (f"; {cost}" if cost else "") for p, points, cost in made]
    return Answer("Scans in another format", "", None, made, terminal=lines)


def convert_scans(
    scans: Sequence[Scan],
    destination: Path,
    *,
    placed: bool,
    step: float | None,
    progress: Callable[[str, int, int | None], None],
) -> list[ConvertedCloud]:
    """Write each scan; several into files with the scan's number before the suffix.

    placed : carry points by the pose of the scan, formats with a pose of their own keep it
    instead; step : of integer coordinates [m], None for that of the source.
    """
    paths = [_numbered(destination, number) for number in range(1, len(scans) + 1)]
    if len(scans) == 1:
        paths = [destination]
    sources = {scan.path.resolve() for scan in scans}
    for path in paths:
        if path.resolve() in sources:
            raise InputError(
                "the file would overwrite its source", file=path, cure="name another file"
            )
    return [
        _convert(scan, path, placed, step, progress)
        for scan, path in zip(scans, paths, strict=True)
    ]


def as_copc(source: Path, *, path: Path, progress: Progress) -> int:
    """Write a cloud as COPC for a viewer, in the steps that it is stored in."""
    scans = read_scans(source)
    if len(scans) != 1:
        raise InputError(
            f"the file has {len(scans)} scans, and one cloud is made of one",
            file=source,
            cure='say format = "copc" in [cloud]',
        )
    placed = scans[0].pose is not None
    return _convert(scans[0], path, placed, None, progress, metric=True).points


def _numbered(path: Path, number: int) -> Path:
    """``a.copc.laz`` becomes ``a-2.copc.laz``."""
    name = path.name
    if not name:
        raise InputError("this is a folder, no file", file=path, cure="name a file in it")
    suffix = next((known for known in WRITERS if name.lower().endswith(known)), path.suffix)
    stem = name[: len(name) - len(suffix)]
    return path.with_name(f"{stem}-{number}{name[len(stem) :]}")


def _convert(
    scan: Scan,
    path: Path,
    placed: bool,
    step: float | None,
    progress: Callable[[str, int, int | None], None],
    *,
    metric: bool = False,
) -> ConvertedCloud:
    """Write one scan; ``metric`` carries it into metres."""
    keeps_pose = path.suffix.lower() == ".e57"
    # E57 is in metres by its standard, and cells of COPC are cubes
    metric = metric or keeps_pose or (scan.unit.factors is None and _is_copc(path))
    if placed and scan.pose is None:
        raise InputError(
            f"scan {scan.name} has no pose to be placed by",
            file=scan.path,
            cure="leave --placed out, or run a project",
        )
    if not metric and scan.unit.by_crs:
        scan = as_filed(scan)  # the reference system goes with the points and says the unit
    pose = scan.pose if placed and not keeps_pose and scan.pose is not None else Pose.identity()
    moved = pose.translation.any() or not np.array_equal(pose.rotation, np.eye(3))
    seen = _seen(scan, pose, whole=path.suffix.lower() != ".ply")
    stored, cost = _steps(scan, seen, step, moved=bool(moved), alike=_is_copc(path))
    header = CloudHeader(
        name=scan.name,
        fields=seen.fields,
        step=stored.steps,
        offset=np.array(stored.offsets),
        crs=scan.crs,
        pose=scan.pose if keeps_pose else None,
    )
    done = 0
    with ExitStack() as stack:
        writer = stack.enter_context(create(path, header))
        for chunk in scan.chunks():
            values = _single(chunk.values)
            writer.write(pose @ chunk.xyz if moved else chunk.xyz, _turned(values, pose))
            done += len(chunk)
            progress(scan.name, done, scan.records)
    return ConvertedCloud(path, done, "" if path.suffix.lower() == ".ply" else cost)


def _is_copc(path: Path) -> bool:
    """True for names of COPC files."""
    return path.name.lower().endswith(".copc.laz")


@dataclass
class _Seen:
    """What a writer must know of the points before the first is written."""

    #: with limits and steps where they were looked for; several values of a point one by one
    fields: tuple[Field, ...]
    bounds: Array | None  #: (2, 3), smallest and largest coordinates, None without points
    #: digits after the point of x, y and z, None where there are more than are looked for
    digits: tuple[int | None, int | None, int | None] = (None, None, None)


def _seen(scan: Scan, pose: Pose, whole: bool) -> _Seen:
    """Read a scan once before it is written, unless its header tells all; ``whole`` numbers."""
    bounds = None
    if scan.bounds is not None and np.isfinite(scan.bounds).all():
        bounds = pose @ scan.bounds
    light = [f for f in scan.fields if f.name == "intensity"]
    known = all(f.step is not None and None not in (f.low, f.high) for f in light)
    if scan.lattice is not None and bounds is not None and known:
        first = next(scan.chunks(_GLANCE), None)
        columns = {} if first is None else _shapes(first.values)
        return _Seen(_split(scan.fields, columns), bounds)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    digits: list[int | None] = [0, 0, 0]
    columns, limits, integral = {}, [np.inf, -np.inf], True
    for chunk in scan.chunks():
        if not len(chunk):
            continue
        columns = columns or _shapes(chunk.values)
        xyz = pose @ chunk.xyz
        low, high = np.minimum(low, xyz.min(axis=0)), np.maximum(high, xyz.max(axis=0))
        some = chunk.xyz[:: max(1, len(chunk) // _GLANCE)]
        digits = [_digits(some[:, k], digits[k]) for k in range(3)]
        if light and "intensity" in chunk.values:
            values = chunk.values["intensity"]
            finite = values[np.isfinite(values)]
            integral = integral and len(finite) == len(values) and not (values % 1).any()
            if len(finite):
                limits = [min(limits[0], float(finite.min())), max(limits[1], float(finite.max()))]
        if not whole:
            break
    fields = _split(scan.fields, columns)
    if whole and limits[0] <= limits[1]:
        fields = tuple(
            _limited(f, limits, integral) if f.name == "intensity" else f for f in fields
        )
    x, y, z = digits
    return _Seen(fields, np.stack([low, high]) if np.isfinite(low).all() else None, (x, y, z))


def _limited(field: Field, limits: Sequence[float], integral: bool) -> Field:
    """An intensity with the limits and the step of its values where the file states none."""
    stated = (field.low, field.high) if None not in (field.low, field.high) else limits
    inside = stated[0] <= limits[0] and limits[1] <= stated[1]  # type: ignore[operator]
    low, high = stated if inside else limits
    return replace(field, low=low, high=high, step=1.0 if integral else field.step)


def _shapes(values: Mapping[str, NDArray[Any]]) -> dict[str, int]:
    """How many values of a point each field has that has several."""
    return {name: column.shape[1] for name, column in values.items() if column.ndim > 1}


def _split(fields: Sequence[Field], shapes: Mapping[str, int]) -> tuple[Field, ...]:
    """Fields of which none has several values of a point."""
    out: list[Field] = []
    for one in fields:
        many = shapes.get(one.name)
        if many is None:
            out.append(one)
        else:
            out += [replace(one, name=f"{one.name}_{k}") for k in range(many)]
    return tuple(out)


def _single(values: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Values of a chunk by the names of :func:`_split`."""
    out: dict[str, NDArray[Any]] = {}
    for name, column in values.items():
        if column.ndim > 1:
            out |= {f"{name}_{k}": column[:, k] for k in range(column.shape[1])}
        else:
            out[name] = column
    return out


def _digits(values: Array, least: int | None) -> int | None:
    """Digits after the point that all values (n,) have at most; None if too many."""
    for digits in range(_MOST_DIGITS + 1) if least is None else range(least, _MOST_DIGITS + 1):
        if least is None:
            return None
        scaled = values * 10.0**digits
        noise = 8 * np.spacing(np.abs(scaled).max(initial=1.0))
        if noise > _TOLD:
            return None
        if np.abs(scaled - np.rint(scaled)).max(initial=0.0) <= noise:
            return digits
    return None


def _steps(
    scan: Scan, seen: _Seen, step: float | None, *, moved: bool, alike: bool
) -> tuple[Lattice, str]:
    """The lattice that coordinates are written on, and what it costs in words.

    ``alike``: along all axes, as cells that are cubes take it.
    """
    bounds = np.zeros((2, 3)) if seen.bounds is None else seen.bounds
    # degrees that no reference system tells are kept as such
    angles = scan.unit.names[0] == "degree" or slender(np.ptp(bounds, axis=0))
    filed = scan.unit.by_crs and scan.crs == scan.unit.crs
    metres = np.ones(3)
    if angles:
        metres[:2] = _DEGREE
    elif filed and (of_crs := unit_of_crs(scan.crs or "")) is not None and of_crs.factors:
        metres = np.array(of_crs.factors)
    own = None if moved else scan.lattice
    if own is not None and alike:
        own = replace(own, steps=(float(np.min(own.steps)),) * 3)
    if step is None and own is not None and _reaches(own, bounds):
        return own, ""
    decimal = [None if d is None or moved else 10.0**-d for d in seen.digits]
    exact = np.array([np.nan if d is None else d for d in decimal]) if own is None else own.steps
    if step is None:
        usual = _round_down(np.minimum(_FINEST, np.ptp(bounds * metres, axis=0).max() / _MANY))
        wanted = np.fmin(np.asarray(exact, dtype=float), _round_down(usual / metres))
    else:
        wanted = _round_down(np.full(3, step) / metres) if angles or filed else np.full(3, step)
    if alike:
        wanted = np.full(3, wanted.min())
    middle = bounds.mean(axis=0)
    offsets = np.round(middle, 0 if angles else -1) if own is None else np.array(own.offsets)
    if not _reaches(_lattice(wanted, offsets), bounds):
        offsets = np.round(middle, 0 if angles else -1)
    while not _reaches(_lattice(wanted, offsets), bounds) and step is None:
        beyond = _too_far(wanted, offsets, bounds)
        wanted = wanted * np.where(beyond | (alike & beyond.any()), 10.0, 1.0)
    # rounding to a lattice that holds the digits of the source costs nothing
    fraction = np.asarray(exact, dtype=float) / wanted
    shifted = np.zeros(3) if own is None else (np.array(own.offsets) - offsets) / wanted
    with np.errstate(invalid="ignore"):
        free = (np.abs(fraction - np.rint(fraction)) < 1e-6) & (fraction > 0.5)
        free &= np.abs(shifted - np.rint(shifted)) < 1e-6
    if free.all() or seen.bounds is None:
        return _lattice(wanted, offsets), ""
    costs = wanted * metres
    sizes = dict.fromkeys(np.round(costs[~free], 9).tolist())
    words = joined(" and ", (Sentence("{size:mmg3}", size=size) for size in sizes))
    cost = Sentence("coordinates are rounded to steps of {words}", words=words)
    return _lattice(wanted, offsets), cost


def _lattice(steps: Array, offsets: Array) -> Lattice:
    """A lattice of arrays (3,)."""
    x, y, z = (float(v) for v in steps)
    a, b, c = (float(v) for v in offsets)
    return Lattice((x, y, z), (a, b, c))


def _too_far(steps: Array, offsets: Array, bounds: Array) -> NDArray[np.bool_]:
    """(3,), true where a lattice of whole numbers of 32 bits does not reach the bounds (2, 3)."""
    return np.asarray(np.abs(bounds - offsets).max(axis=0) / steps > _REACH)


def _reaches(lattice: Lattice, bounds: Array) -> bool:
    """True if whole numbers of 32 bits reach the bounds."""
    far = _too_far(np.array(lattice.steps), np.array(lattice.offsets), bounds)
    return not far.any()


def _round_down(values: Any) -> Array:
    """The next smaller 1, 2 or 5 times a power of ten, at least a thousandth of a micrometre."""
    each = np.maximum(np.asarray(values, dtype=float), 1e-9) * (1 + 1e-9)
    decade = 10.0 ** np.floor(np.log10(each))
    lead = each / decade
    out: Array = decade * np.where(lead >= 5, 5.0, np.where(lead >= 2, 2.0, 1.0))
    return out


def _turned(values: Mapping[str, NDArray[Any]], pose: Pose) -> Mapping[str, NDArray[Any]]:
    """Values with the normals turned by a pose, if there are any."""
    if not all(name in values for name in _NORMALS):
        return values
    normals = np.stack([values[name] for name in _NORMALS], axis=1) @ pose.rotation.T
    return {**values, **dict(zip(_NORMALS, normals.astype(np.float32).T, strict=True))}
