"""Trimble JobXML (``.jxl``): records of the field book that refer to each other by their IDs.

Angles are decimal degrees, lengths metres, whatever the instrument showed. Distances are raw: the
prism constant of the target and the parts per million of the atmosphere are still to be applied;
the reader notes them beside the distances. ``StartRoundRecord`` begins a set. A mean turned angle,
which the instrument made of sets or faces, counts only where the file has no readings of its own
from that set-up to that target. Format: Trimble, "JobXML schema".
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from lxml import etree

from tribrach.io import xml_file
from tribrach.io.totalstation.recorder import Recorder
from tribrach.io.totalstation.records import RawFile
from tribrach.io.totalstation.text import number

_FACES = {"Face1": 1, "Face2": 2}
#: points that were given rather than observed
_GIVEN = ("KeyedIn", "Coordinates", "Imported", "ImportedPoint", "Linked", "CopiedPoint")
_SILENT = (
    "JobRecord", "UnitsRecord", "CorrectionsRecord", "InstrumentRecord", "NoteRecord",
    "CoordinateSystemRecord", "SurveyEventRecord", "AtmosphereRecord", "TargetRecord",
    "PrismRecord", "JobPropertiesRecord", "FeatureCodingRecord", "AppUserRecord", "EndRoundRecord",
    "RoundsMeanTurnedAngleResiduals",
)  # fmt: skip


def sniff(text: str) -> bool:
    """True if the root element is that of the format."""
    return "<JOBFile" in text


def read(path: Path) -> RawFile:
    """Read a file."""
    root = xml_file.load(path, "JOBFile")
    reader = _Reader(Recorder(path, "Trimble JobXML"))
    for book in root.iterchildren("FieldBook"):
        reader.book(book)
    reader.close()
    return reader.recorder.finish()


class _Reader:
    """Turns records into set-ups, sights and coordinates."""

    def __init__(self, recorder: Recorder) -> None:
        self.recorder = recorder
        self.stations: dict[str, etree._Element] = {}
        self.bearings: dict[str, etree._Element] = {}
        self.targets: dict[str, etree._Element] = {}
        self.air: dict[str, etree._Element] = {}
        self.open = ""
        self.bearing = ""
        #: set-up of the last station record, and how many rounds each set-up has had
        self.latest = ""
        self.rounds: Counter[str] = Counter()
        #: set-ups and targets that have readings of their own
        self.read: set[tuple[str, str]] = set()
        self.means = 0
        self.vectors = 0
        self.in_rounds = False

    def book(self, book: etree._Element) -> None:
        """All records of a field book, in their order."""
        known = {
            "StationRecord": self.stations,
            "BackBearingRecord": self.bearings,
            "TargetRecord": self.targets,
            "AtmosphereRecord": self.air,
        }
        self.read |= {
            (_text(record, "StationID"), _text(record, "Name"))
            for record in book.iterchildren("PointRecord")
            if record.find("Circle") is not None and not _deleted(record) and not _is_mean(record)
        }
        self.in_rounds |= book.find("StartRoundRecord") is not None
        for record in _children(book):
            kind = str(record.tag)
            if kind in known:
                known[kind][record.get("ID", "")] = record
            if kind == "StationRecord":
                self.latest = record.get("ID", "")
            if kind == "StartRoundRecord":
                self.rounds[_text(record, "StationID") or self.latest] += 1
                self.recorder.understood[kind] += 1
            if kind == "PointRecord":
                line = xml_file.line_of(record) or 0
                try:
                    self._point(line, record)
                except ValueError as error:
                    self.recorder.problem(line, str(error))
            elif kind == "InstrumentRecord":
                parts = [_text(record, name) for name in ("Type", "Model", "Serial")]
                self.recorder.instrument = " ".join(part for part in parts if part)
            if kind in known or kind in _SILENT:
                self.recorder.understood[kind] += 1
            elif kind not in ("PointRecord", "StartRoundRecord"):
                self.recorder.unknown[f"<{kind}>"] += 1

    def _point(self, line: int, record: etree._Element) -> None:
        """A sight, or coordinates."""
        name, method = _text(record, "Name"), _text(record, "Method")
        deleted = _deleted(record)
        grids = [g for tag in ("Grid", "ComputedGrid") for g in record.iterchildren(tag)]
        circle = next(record.iterchildren("Circle"), None)
        if grids and not deleted:
            e, n, u = (number(_text(grids[0], tag)) for tag in ("East", "North", "Elevation"))
            given = circle is None and (grids[0].tag == "Grid" or method in _GIVEN)
            self.recorder.point(line, name, e, n, u, given=given, code=_text(record, "Code"))
            self.recorder.understood["coordinates"] += 1
        if circle is not None:
            self._sight(line, record, circle, name, "deleted in the field" if deleted else "")
        elif record.find("ECEFDeltas") is not None:
            self.vectors += 1
        elif not grids:
            self.recorder.unknown[f"PointRecord {method or 'without readings'}"] += 1

    def _sight(
        self, line: int, record: etree._Element, circle: etree._Element, name: str, off: str
    ) -> None:
        self._setup(record)
        self._corrections(record)
        if _is_mean(record) and not off:
            if (_text(record, "StationID"), name) in self.read:
                off = "the instrument made this mean of readings that are used"
            else:
                self.means += 1
        target = self.targets.get(_text(record, "TargetID"))
        degrees = [number(_text(circle, x)) for x in ("HorizontalCircle", "VerticalCircle")]
        self.recorder.shot(
            line,
            name,
            direction=math.radians(degrees[0]),
            zenith=math.radians(degrees[1]),
            distance=number(_text(circle, "EDMDistance")),
            face=_FACES.get(_text(circle, "Face"), 0),
            height=math.nan if target is None else number(_text(target, "TargetHeight")),
            code=_text(record, "Code"),
            applied=False,
            series=self._set(_text(record, "StationID")),
            off=off,
        )
        self.recorder.understood["sight"] += 1

    def _set(self, station: str) -> int:
        """Number of the set, 0 without rounds; what comes before the first round belongs to it."""
        return max(self.rounds[station], 1) if self.in_rounds else 0

    def close(self) -> None:
        """Report remarks that concern the whole file."""
        if self.vectors:
            self.recorder.note(
                f"{self.vectors} GNSS vectors stand beside the sights and are not used: name the "
                'file once more in a project, with format = "gnss".'
            )
        if self.means:
            self.recorder.note(
                f"{self.means} mean turned angles have no readings beside them; each is taken as "
                "one reading in one face."
            )

    def _setup(self, record: etree._Element) -> None:
        """Begin the set-up that a sight refers to, if it or its backsight has changed."""
        key, bearing = _text(record, "StationID"), _text(record, "BackBearingID")
        if key not in self.stations:
            raise ValueError(f"the sight refers to station record {key!r}, which is not there")
        if (key, bearing) == (self.open, self.bearing):
            return
        self.open, self.bearing = key, bearing
        station, back = self.stations[key], self.bearings.get(bearing)
        circle = math.nan if back is None else _degrees(back, "Face1HorizontalCircle")
        correction = math.nan if back is None else _degrees(back, "OrientationCorrection")
        self.recorder.setup(
            xml_file.line_of(station) or 0,
            _text(station, "StationName"),
            height=number(_text(station, "TheodoliteHeight")),
            backsight="" if back is None else _text(back, "BackSight"),
            azimuth=(circle + correction) % (2 * math.pi),
            circle=circle,
        )

    def _corrections(self, record: etree._Element) -> None:
        """Prism, parts per million and air of a sight."""
        target = self.targets.get(_text(record, "TargetID"))
        station = self.stations.get(_text(record, "StationID"))
        air = _text(record, "AtmosphereID")
        if not air and station is not None:
            air = _text(station, "AtmosphereID")
        atmosphere = self.air.get(air)
        self.recorder.prism = math.nan if target is None else number(_text(target, "PrismConstant"))
        values = [
            math.nan if atmosphere is None else number(_text(atmosphere, tag))
            for tag in ("PPM", "Temperature", "Pressure")
        ]
        self.recorder.ppm, self.recorder.temperature_c, self.recorder.pressure_hpa = values


def _children(element: etree._Element) -> Iterator[etree._Element]:
    """Child elements without comments and instructions."""
    return (child for child in element.iterchildren() if isinstance(child.tag, str))


def _text(element: etree._Element, tag: str) -> str:
    """Text of a child element, "" if there is none."""
    return (element.findtext(tag) or "").strip()


def _deleted(record: etree._Element) -> bool:
    """True if a record was deleted in the field."""
    return _text(record, "Deleted").lower() == "true"


def _is_mean(record: etree._Element) -> bool:
    """True for a mean that the instrument made."""
    return _text(record, "Method") == "MeanTurnedAngle"


def _degrees(element: etree._Element, tag: str) -> float:
    """Radians of a child element in degrees."""
    return math.radians(number(_text(element, tag)))
