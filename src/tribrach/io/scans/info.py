"""Describes a scan and what looks wrong with it, for ``tribrach info`` and reports.

One pass over the points, in bounded memory, gives the statistics; a description states them in
words and as JSON.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyproj import CRS
from pyproj.exceptions import CRSError

from tribrach._types import Array
from tribrach.answers import Matrix, Number, Result, part
from tribrach.errors import InputError
from tribrach.geometry.rotation import log
from tribrach.io.clouds.header import single_resolution
from tribrach.io.scans.units import as_filed
from tribrach.scan.angular_step import angular_step
from tribrach.scan.coordinate_step import axis_steps, coordinate_step
from tribrach.scan.no_return import point_hashes, screened
from tribrach.scan.scan import Chunk, Field, NoReturn, Scan
from tribrach.sentences import capital, stopped
from tribrach.units import percent

#: points that are kept: the first ones, for what needs neighbours, and some from all over the scan
_FIRST, _SPREAD = 1_500_000, 300_000
#: points that are compared with each other to find doubles
_COMPARED = 300_000
#: what is worth a sentence: resolution and step [m], bounds that differ by [m], share of doubles
_RESOLUTION, _STEP, _BOUNDS, _DOUBLED = 1e-4, 1e-3, 1e-3, 1e-3
_QUANTILES = (0.0, 0.05, 0.5, 0.95, 1.0)
#: fewer points do not tell the angular step
_FEW = 1000
_ORIGIN = {
    "stated": "at zero, as the format says",
    "assumed": "at zero, assumed because that lies among the points",
    "unknown": "unknown",
}


@dataclass
class FieldRange:
    """The values of one field."""

    #: smallest and largest finite value
    low: float = np.inf
    high: float = -np.inf
    bad: int = 0  #: how many are not finite

    def add(self, column: NDArray[Any]) -> None:
        """Take a column (n,) or (n, k) into account."""
        if column.dtype.kind == "f":
            finite = np.isfinite(column)
            if not finite.all():
                self.bad += int(column.size - np.count_nonzero(finite))
                column = column[finite]
        if column.size:
            self.low = min(self.low, float(column.min()))
            self.high = max(self.high, float(column.max()))


@dataclass
class Statistics:
    """The valid points of a scan in figures."""

    points: int = 0  #: how many
    dropped: int = 0  #: records that hold no point
    #: (2, 3), smallest and largest coordinates [m], None without points
    bounds: Array | None = None
    zeros: int = 0  #: points at exactly 0, 0, 0
    single: bool = True  #: all coordinates are numbers of 32 bits
    doubled: float = 0.0  #: share of points that occurred before
    fields: dict[str, FieldRange] = field(default_factory=dict)  #: range of each field
    first: Array = field(default_factory=lambda: np.zeros((0, 3)))  #: (k, 3), the first points [m]
    #: (k, 3), points from all over the scan [m]
    spread: Array = field(default_factory=lambda: np.zeros((0, 3)))


def statistics(scan: Scan) -> Statistics:
    """Read a scan once."""
    out, doubles = Statistics(), _Doubles()
    first: list[Array] = []
    spread: list[Array] = []
    stride = max((scan.records or 0) // _SPREAD, 1)
    for chunk in scan.chunks():
        out.dropped += chunk.dropped
        if len(chunk) == 0:
            continue
        if out.points < _FIRST:
            first.append(chunk.xyz[: _FIRST - out.points])
        spread.append(chunk.xyz[(-out.points) % stride :: stride].copy())
        out.points += len(chunk)
        doubles.add(chunk.xyz)
        _add(out, chunk)
    out.doubled = doubles.share
    if first:
        out.first, out.spread = np.concatenate(first), np.concatenate(spread)
    return out


def _add(out: Statistics, chunk: Chunk) -> None:
    """Bounds, zeros, float resolution and the fields of one more chunk."""
    bounds = np.stack([chunk.xyz.min(axis=0), chunk.xyz.max(axis=0)])
    if out.bounds is not None:
        bounds[0] = np.minimum(bounds[0], out.bounds[0])
        bounds[1] = np.maximum(bounds[1], out.bounds[1])
    out.bounds = bounds
    out.zeros += int(len(chunk) - np.count_nonzero(chunk.xyz.any(axis=1)))
    with np.errstate(over="ignore"):
        out.single = out.single and bool((chunk.xyz.astype(np.float32) == chunk.xyz).all())
    for name, column in chunk.values.items():
        out.fields.setdefault(name, FieldRange()).add(column)


class _Doubles:
    """Counts doubled points among those whose hash ends in enough zeros, wherever they stand."""

    def __init__(self) -> None:
        self._kept: NDArray[np.uint64] = np.zeros(0, dtype=np.uint64)
        self._bits = 0

    def add(self, xyz: Array) -> None:
        """Take points (n, 3) into account."""
        self._kept = np.concatenate([self._kept, self._chosen(point_hashes(xyz))])
        while len(self._kept) > _COMPARED and self._bits < 40:
            self._bits += 1
            self._kept = self._chosen(self._kept)

    def _chosen(self, mixed: NDArray[np.uint64]) -> NDArray[np.uint64]:
        """The hashes whose lowest bits are zero."""
        mask = np.uint64((1 << self._bits) - 1)
        return np.asarray(mixed[(mixed & mask) == 0])

    @property
    def share(self) -> float:
        """Share of points that occurred before."""
        if len(self._kept) == 0:
            return 0.0
        return 1 - len(np.unique(self._kept)) / len(self._kept)


@dataclass(frozen=True)
class DescribedField(Result):
    """A field of the points with its range."""

    name: str
    dtype: str
    low: Number
    high: Number


@dataclass(frozen=True)
class DescribedUnit(Result):
    """Unit of the coordinates of a file; all lengths here are metres."""

    names: tuple[str, ...]  #: of x, y and z
    metres: tuple[Number, ...] | None  #: in one unit of x, y and z; null if x and y are degrees
    source: str  #: who says so


@dataclass(frozen=True, eq=False)
class Description(
    Result,
    without=("scan", "figures", "among", "axes"),
    also=(
        "file", "name", "index", "points", "records", "dropped", "no_return", "bounds", "fields",
        "grid", "pose", "crs", "unit", "origin", "doubled_share", "facts", "sentences",
    ),
    keys={
        "name": "scan",
        "step": "angular_step",
        "ranges": "range_quantiles",
        "coarse": "coordinate_step",
    },
):  # fmt: skip
    """A scan of a file [m, rad]."""

    scan: Scan
    figures: Statistics  #: of its points
    among: int  #: number of scans in its file
    step: tuple[Number, Number] | None  #: between neighbouring directions (H, V), null if not known
    #: 0, 5, 50, 95 and 100 % quantiles of the ranges, empty if the origin is not known
    ranges: tuple[Number, ...]
    coarse: Number | None  #: step that all coordinates are multiples of, null if it is fine
    #: steps along x, y and z where they differ much, None where they do not
    axes: tuple[float, float, float] | None = None

    name = part("scan.name", str, "Name of the scan.")
    index = part("scan.index", int, "Its number in the file.")
    points = part("figures.points", int, "How many are valid.")
    records = part("scan.records", int | None, "What the file says that it holds.")
    dropped = part("figures.dropped", int, "Records that hold no point.")
    no_return = part("scan.no_return", NoReturn | None, "Beams that came back from nothing.")
    bounds = part("figures.bounds", Matrix | None, "Smallest and largest coordinates.")
    grid = part("scan.grid", tuple[int, int] | None, "Rows and columns.")
    pose = part("scan.pose.matrix", Matrix | None, "World from scanner, 4 x 4.")
    origin = part(
        "scan.origin", str, "Whether the scanner is at 0, 0, 0: stated, assumed or unknown."
    )
    doubled_share = part("figures.doubled", Number, "Share of points that occurred before.")
    facts = part("scan.facts", dict[str, str], "What else the file says.")

    @property
    def angles(self) -> bool:
        """True if the coordinates are degrees."""
        return self.scan.unit.names[0] == "degree"

    @property
    def crs(self) -> str | None:
        """Reference system of the file."""
        return self.scan.unit.crs or self.scan.crs

    @property
    def unit(self) -> DescribedUnit:
        """Unit of the coordinates of the file."""
        unit = self.scan.unit
        metres = None if self.angles else tuple(unit.factors or ())
        return DescribedUnit(tuple(unit.names), metres, unit.source)

    @property
    def file(self) -> str:
        """Path of the file."""
        return str(self.scan.path)

    @property
    def fields(self) -> tuple[DescribedField, ...]:
        """Fields of the points; one that occurred nowhere is zero."""
        own = self.figures
        zero = FieldRange(0.0, 0.0) if own.points else FieldRange()
        found = [(f, own.fields.get(f.name, zero)) for f in self.scan.fields]
        return tuple(DescribedField(f.name, f.dtype, r.low, r.high) for f, r in found)

    @property
    def title(self) -> str:
        """Name of file and scan."""
        return self.scan.source

    def rows(self) -> list[tuple[str, str]]:
        """Names and values, in the order of reading."""
        scan, figures = self.scan, self.figures
        records = "not stated" if scan.records is None else f"{scan.records}"
        rows = [
            (
                "points",
                f"{figures.points} of {records} records, {figures.dropped} hold no point",
            ),
        ]
        if figures.bounds is not None:
            for name, low, high in zip("xyz", *figures.bounds, strict=True):
                rows.append((f"extent {name}", self._extent(name, low, high)))
        rows.append(("unit", self._unit_words()))
        if scan.no_return is not None:
            rows.append(("beams without return", scan.no_return.words))
        if scan.grid is not None:
            rows.append(("grid", f"{scan.grid[0]} rows, {scan.grid[1]} columns"))
        if self.step is not None:
            h, v = self.step
            mm = f"{1e4 * h:.1f} by {1e4 * v:.1f} mm at 10 m"
            rows.append(("angular step", f"H {1e3 * h:.4f} mrad, V {1e3 * v:.4f} mrad ({mm})"))
        if self.ranges:
            words = ", ".join(
                f"{percent(q)} {r:.3f}" for q, r in zip(_QUANTILES, self.ranges, strict=True)
            )
            rows.append(("ranges", words + " m"))
        rows.append(("scanner", _ORIGIN[scan.origin]))
        rows.append(("pose", _pose_words(scan)))
        rows.append(("CRS", _crs_words(scan.unit.crs or scan.crs)))
        rows += [(f"field {f.name}", self._field_words(f)) for f in scan.fields]
        described = {f"field {f.name}" for f in scan.fields}
        rows += [(key, value) for key, value in scan.facts.items() if key not in described]
        return rows

    def _extent(self, name: str, low: float, high: float) -> str:
        """Smallest and largest coordinate; degrees as such, in digits that tell millimetres."""
        if not self.angles or name == "z":
            return f"{low:.4f} to {high:.4f} m ({high - low:.3f} m)"
        return f"{low:.9f} to {high:.9f} deg ({high - low:.9f} deg)"

    def _unit_words(self) -> str:
        """What the file counts in, who says so, and what is shown here."""
        unit = self.scan.unit
        shown = ", shown in metres" if not (unit.metric or self.angles) else ""
        return f"{unit.words} ({unit.source}){shown}"

    def _field_words(self, item: Field) -> str:
        """Type, range and description of a field."""
        values = self.figures.fields.get(item.name)
        what = f"{item.dtype}, "
        if values is None or values.low > values.high:
            what += "no values" if values is not None else "zero throughout"
        else:
            what += f"{values.low:g} to {values.high:g}"
        said = item.description.strip() or self.scan.facts.get(f"field {item.name}", "")
        return f"{what} ({said})" if said else what

    @property
    def sentences(self) -> list[str]:
        """What looks wrong or is worth knowing, one sentence each."""
        out = [stopped(capital(w)) for w in self.scan.warnings]
        if self.figures.points == 0:
            return out or ["The scan has no points."]
        return out + self._of_coordinates() + self._of_values() + self._of_pose()

    def _of_coordinates(self) -> list[str]:
        """Sentences on resolution, doubled points, zeros and bounds."""
        figures, out = self.figures, list[str]()
        far = 0.0 if figures.bounds is None else float(np.abs(figures.bounds).max())
        if self.angles:
            out.append(
                "The coordinates are degrees: nothing that needs lengths is made of them, and "
                "convert keeps them as they are."
            )
            return out + self._of_records()
        with np.errstate(over="ignore"):
            resolution = single_resolution(far)
        if self.axes is not None:
            steps = [f"{n} of {1e3 * s:g} mm" for n, s in zip("xyz", self.axes, strict=True) if s]
            out.append(f"The coordinates are in coarse steps: {', '.join(steps)}.")
        elif self.coarse is not None and self.coarse < 1.0:
            out.append(f"All coordinates are multiples of {1e3 * self.coarse:g} mm.")
        elif self.coarse is None and figures.single and resolution >= _RESOLUTION:
            out.append(
                f"The coordinates are numbers of 32 bits: at {far:.0f} m they resolve "
                f"{1e3 * resolution:.2g} mm."
            )
        return out + self._of_records()

    def _of_records(self) -> list[str]:
        """Sentences on beams without return, zeros, doubled points and bounds."""
        scan, figures, out = self.scan, self.figures, []
        if scan.no_return is not None:
            out.append(f"{scan.no_return.sentence}.")
        if figures.zeros:
            out.append(f"{figures.zeros} points lie at exactly 0, 0, 0.")
        if figures.doubled >= _DOUBLED:
            out.append(f"{percent(figures.doubled)} of the points are there more than once.")
        invalid = figures.dropped - (0 if scan.no_return is None else scan.no_return.points)
        if invalid and scan.grid is None:
            share = invalid / (figures.dropped + figures.points)
            out.append(
                f"{invalid} records ({percent(share)}) hold no point: invalid, or not finite."
            )
        if scan.bounds is not None and figures.bounds is not None:
            out += _of_bounds(scan.bounds, figures.bounds)
        return out

    def _of_values(self) -> list[str]:
        """Sentences on intensities that are all alike and on values that are not finite."""
        out = []
        intensity = self.figures.fields.get("intensity")
        if intensity is not None and intensity.low == intensity.high and self.figures.points > 1:
            out.append(f"All intensities are {intensity.low:g}.")
        for name, values in self.figures.fields.items():
            if values.bad:
                out.append(f"{values.bad} values of {name} are not finite.")
        return out

    def _of_pose(self) -> list[str]:
        """Sentences on the frame of the points."""
        out, pose = [], self.scan.pose
        if pose is not None:
            if np.linalg.det(pose.rotation) < 0:
                out.append("The pose mirrors: its determinant is -1.")
            elif self.among > 1 and _is_identity(self.scan):
                out.append(
                    f"The pose is the identity although the file has {self.among} scans: "
                    "they may not be registered."
                )
        if self.scan.origin == "unknown" and not {"sigma_x", "sigma_y", "sigma_z"} <= set(
            self.scan.names
        ):
            out.append(
                "Where the scanner stood among the points is not known: they get no uncertainty "
                "of their own unless the project says so."
            )
        return out


def describe(scan: Scan, among: int = 1) -> Description:
    """Read and describe a scan; beams without return are counted separately."""
    if scan.unit.factors is None:
        scan = as_filed(scan)
    scan = screened(scan)
    figures = statistics(scan)
    step: tuple[float, float] | None = None
    ranges: tuple[float, ...] = ()
    # coordinates that nothing can be computed with are described as they are
    with np.errstate(over="ignore", invalid="ignore"):
        if scan.origin != "unknown" and figures.points:
            distance = np.linalg.norm(figures.spread, axis=1)
            ranges = tuple(float(q) for q in np.quantile(distance, _QUANTILES))
            step = _step(figures.first)
        coarse = coordinate_step(figures.spread, _STEP) or None
        axes = axis_steps(figures.spread, coarse or 0.0) if figures.points else None
    return Description(scan, figures, among, step, ranges, coarse, axes)


def _step(xyz: Array) -> tuple[float, float] | None:
    """The angular step [rad] if there are enough points to tell."""
    if len(xyz) < _FEW:
        return None
    try:
        return angular_step(xyz)
    except InputError:
        return None


def _of_bounds(stated: Array, bounds: Array) -> list[str]:
    """A sentence if the bounds of the header are not those of the points; both (2, 3) [m]."""
    if not np.isfinite(stated).all():
        if np.isfinite(stated).any():
            return ["Some bounds in the header are not finite numbers."]
        return ["None of the bounds in the header is a finite number."]
    off = np.abs(stated - bounds).max()
    if off <= _BOUNDS:
        return []
    return [f"The bounds in the header differ from the points' by {off:.3f} m."]


def _is_identity(scan: Scan) -> bool:
    pose = scan.pose
    return pose is not None and bool((pose.matrix == np.eye(4)).all())


def _pose_words(scan: Scan) -> str:
    """Position and turn of a pose."""
    if scan.pose is None:
        return "none"
    if _is_identity(scan):
        return "identity"
    x, y, z = scan.pose.translation
    turn = float(np.degrees(np.linalg.norm(log(scan.pose.rotation))))
    return f"{x:.4f} {y:.4f} {z:.4f} m, turned by {turn:.4f} deg"


def _crs_words(wkt: str | None) -> str:
    """Name and code of a reference system."""
    if wkt is None:
        return "none"
    try:
        crs = CRS.from_user_input(wkt)
    except CRSError:
        return "not understood"
    code = crs.to_authority()
    return str(crs.name) + (f" ({':'.join(code)})" if code else "")
