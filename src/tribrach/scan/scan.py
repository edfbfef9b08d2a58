"""A scan of a file, whatever its format: points in chunks, fields, pose, origin.

Points are in the scanner frame (right-handed, origin at the instrument's centre, z along its
standing axis), float64 metres whatever the file counts in (``Scan.unit``). Other values keep the
names below whatever their file calls them.

| field | type | unit |
|---|---|---|
| intensity | float32 | as in the file; `Field.low` and `Field.high` are its limits |
| red, green, blue | uint16 | 0 to 65535, 8-bit colours times 257 |
| time | float64 | seconds as in the file |
| return_number, number_of_returns | uint8 | |
| row, column | int32 | of the scanner's grid |
| normal_x, normal_y, normal_z | float32 | scanner frame |

Fields that are not in the table pass through under their own name.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.answers import Result
from tribrach.errors import InputError, note_doubt
from tribrach.geometry.pose import Pose
from tribrach.instruments.correction import Correction
from tribrach.scan.face import ScanFace
from tribrach.scan.length_unit import METRES, LengthUnit, UnitDoubt
from tribrach.sentences import Sentence, joined

#: points read at a time; 8 columns of 8 bytes are then 32 MB
CHUNK = 500_000

#: whether the scanner is at (0, 0, 0): stated by the format, assumed from the coordinates, unknown
Origin = Literal["stated", "assumed", "unknown"]


@dataclass(frozen=True)
class Field:
    """A value that every point has besides its coordinates."""

    name: str  #: as in the table above
    dtype: str  #: name of a numpy type such as ``float32``
    #: limits that the file states
    low: float | None = None
    high: float | None = None
    description: str = ""  #: what the file says of it
    step: float | None = None  #: every value is a whole multiple of it; None if that is not known


@dataclass(frozen=True)
class Chunk:
    """Consecutive valid points of a scan."""

    xyz: Array  #: (n, 3), points of the scanner frame [m]
    values: Mapping[str, NDArray[Any]]  #: other values (n,) or (n, k), by name of the field
    #: records between the previous chunk and the end of this one that hold no point (invalid, NaN,
    #: no return)
    dropped: int = 0

    def __len__(self) -> int:
        """Points in the chunk."""
        return len(self.xyz)


@dataclass(frozen=True)
class Lattice:
    """Coordinates that are whole numbers of steps from an offset, in the unit of the scan."""

    #: along x, y and z
    steps: tuple[float, float, float]
    offsets: tuple[float, float, float]

    def scaled(self, factors: Array) -> Lattice:
        """The same lattice by factors (3,) along the axes."""
        x, y, z = (np.array(self.steps) * factors).tolist()
        a, b, c = (np.array(self.offsets) * factors).tolist()
        return Lattice((x, y, z), (a, b, c))


@dataclass(frozen=True)
class NoReturn(Result, without=("at_scanner", "total", "doubt")):
    """What a file has for beams that came back from nothing, in its coordinates."""

    #: what :meth:`marks` says of a point
    RETURN: ClassVar[int] = 0
    ZERO: ClassVar[int] = 1
    REPEATED: ClassVar[int] = 2
    SHELL: ClassVar[int] = 3

    #: smallest and largest range of a shell about the scanner [m], null without one
    shell: tuple[float, float] | None = None
    #: places x, y, z [m] that many points share
    places: tuple[tuple[float, float, float], ...] = ()
    at_scanner: bool = False  #: are there points in the very place of the scanner?
    #: number of points in the place of the scanner, in the shared places, and in the shell
    zeros: int = 0
    repeated: int = 0
    in_shell: int = 0
    total: int = 0  #: number of all points of the file
    doubt: UnitDoubt | None = None  #: what speaks against metres in the others

    @property
    def points(self) -> int:
        """Number of points without return."""
        return self.zeros + self.repeated + self.in_shell

    def marks(self, xyz: Array, scanner: Array) -> NDArray[np.int64]:
        """``RETURN``, ``ZERO``, ``REPEATED`` or ``SHELL`` for each point of a file."""
        out = np.zeros(len(xyz), dtype=np.int64)
        if self.at_scanner or self.shell is not None:
            ranges = np.linalg.norm(xyz - scanner, axis=1)
            if self.shell is not None:
                low, high = self.shell
                out[(ranges >= low) & (ranges <= high)] = self.SHELL
        for place in self.places:
            out[(xyz == np.array(place)).all(axis=1)] = self.REPEATED
        if self.at_scanner:
            out[ranges == 0] = self.ZERO
        return out

    @property
    def words(self) -> str:
        """How many points there are of each kind, in words."""
        parts = []
        if self.zeros:
            parts.append(f"{self.zeros} in the place of the scanner")
        if self.repeated:
            where = ", ".join("{:g} {:g} {:g}".format(*p) for p in self.places[:3])
            more = "" if len(self.places) < 4 else " and elsewhere"
            parts.append(f"{self.repeated} that repeat {where}{more}")
        if self.shell is not None and self.in_shell:
            parts.append(
                Sentence("{n} on a shell at {at:m2}", n=self.in_shell, at=sum(self.shell) / 2)
            )
        return joined(", ", parts)

    @property
    def sentence(self) -> str:
        """Points left out and their number, without the final stop."""
        share = self.points / max(self.total, 1)
        return Sentence(
            "{own.points} of {own.total} points ({share:%}) are beams without return and are left "
            "out: {own.words}",
            own=self,
            share=share,
        )


@dataclass(frozen=True)
class Scan(ABC):
    """A cloud in its scanner's frame, streamed in chunks; only its header is in memory.

    A reader derives its own class and gives the points as they are stored, in the unit of the file.
    They become metres first. What the project knows better than the file stands in the last four
    fields and is done to the points as they are read, in this order: beams without return are left
    out, the place of the scanner is taken off, the points of the other face are left out, the
    calibration of the scanner is applied (see :mod:`tribrach.scan.prepared`).
    """

    name: str  #: of the scan, unique within its file
    #: file and place in it
    path: Path
    index: int = 0
    #: number that the header states, valid points or not; None if it states none
    records: int | None = None
    fields: tuple[Field, ...] = ()  #: what every point has besides its coordinates
    pose: Pose | None = None  #: world from scanner as the file has it, None if it has none
    origin: Origin = "unknown"  #: is the scanner at zero?
    grid: tuple[int, int] | None = None  #: rows and columns
    crs: str | None = None  #: WKT of the coordinates if the file says
    #: smallest and largest coordinates (2, 3) [m] that the header states
    bounds: Array | None = None
    warnings: tuple[str, ...] = ()  #: sentences about what was odd
    facts: Mapping[str, str] = field(default_factory=dict)  #: what else the header says
    #: lattice that the coordinates are stored on, None if they are not or it is not known
    lattice: Lattice | None = None
    #: what the coordinates of the file are counted in; bounds, pose and points are metres
    unit: LengthUnit = METRES
    #: where the scanner stood in the coordinates of the file [m]
    scanner: tuple[float, float, float] = (0.0, 0.0, 0.0)
    face: ScanFace | None = None  #: the face whose points these are, None for all points
    #: calibration of the scanner, None if its points are as measured
    correction: Correction | None = None
    #: what the file has for beams without return, None if all its points count
    no_return: NoReturn | None = None

    #: chunks hold as many records as are asked for, wherever they begin, the last one excepted
    even_chunks: ClassVar[bool] = True
    #: the format has metres, whatever its reference system says
    standard_metres: ClassVar[bool] = False

    @abstractmethod
    def stored(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        """Read the points as the file has them, in its order and in its unit."""

    def measured(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        """Read the points of the file in metres, in its order."""
        if self.unit.metric:
            return self.stored(size, start)
        if self.unit.factors is None:
            raise InputError(
                f"the coordinates are degrees ({self.unit.source}), and lengths are needed",
                file=self.path,
                cure="project them first, into a system with metres or feet along its axes",
            )
        factors = np.array(self.unit.factors)
        return (
            Chunk(chunk.xyz * factors, chunk.values, chunk.dropped)
            for chunk in self.stored(size, start)
        )

    def chunks(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        """Read the points in the file's order, at most ``size`` records at a time."""
        stored = self.measured(size, start)
        plain = self.as_stored and self.no_return is None
        return stored if plain else map(self._prepared, stored)

    @property
    def certain_points(self) -> int:
        """Points certain before the first is read; 0 of formats whose records may hold none."""
        return 0

    @property
    def as_stored(self) -> bool:
        """True if the points are those of the file in metres, none moved, no face left out."""
        return not any(self.scanner) and self.face is None and self.correction is None

    def _prepared(self, chunk: Chunk) -> Chunk:
        """Return a chunk of the file with everything done to its points."""
        xyz, values, dropped = chunk.xyz, chunk.values, chunk.dropped
        if self.no_return is not None:
            keep = self.no_return.marks(xyz, np.array(self.scanner)) == NoReturn.RETURN
            values = {name: value[keep] for name, value in values.items()}
            dropped += int(len(keep) - keep.sum())
            xyz = xyz[keep]
        if any(self.scanner):
            xyz = xyz - np.array(self.scanner)
        if self.face is not None:
            keep = self.face.measured(xyz, np.asarray(values["column"]))
            values = {name: value[keep] for name, value in values.items()}
            dropped += int(len(keep) - keep.sum())
            xyz = xyz[keep]
        if self.correction is not None:
            xyz = self.correction.corrected(xyz)
        return Chunk(xyz, values, dropped)

    def screened(self, found: NoReturn) -> Self:
        """The same without its beams without return, and with the doubts that came up."""
        warnings = self.warnings
        if found.doubt is not None:
            note_doubt(self.source, found.doubt.sentence)
            warnings = tuple(dict.fromkeys((*warnings, found.doubt.sentence)))
        left_out = found if found.points else None
        return replace(self, no_return=left_out, warnings=warnings)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Oddities of the scan and points left out, without the final stop."""
        beams = () if self.no_return is None else (self.no_return.sentence,)
        return (*self.warnings, *beams)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fields."""
        return tuple(f.name for f in self.fields)

    @property
    def source(self) -> str:
        """File and scan, for messages and reports."""
        return f"{self.path.name}#{self.name}" if self.name != self.path.stem else self.path.name
