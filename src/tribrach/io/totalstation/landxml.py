"""Survey observations of LandXML 1.0 to 2.0 (``.xml``).

``<InstrumentSetup>`` names station and height; ``<RawObservation>`` and ``<ReducedObservation>``
refer to it by its ID, from within or from an ``<ObservationGroup>``. Units are those of
``<Units>``. Coordinates are north, east, height. Distances are taken as corrected. Schema:
landxml.org.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from lxml import etree

from tribrach.errors import InputError
from tribrach.io import xml_file
from tribrach.io.totalstation.recorder import Recorder
from tribrach.io.totalstation.records import RawFile
from tribrach.io.totalstation.text import angle, number
from tribrach.units import UNITS

_SPACES = [f"{{http://www.landxml.org/schema/LandXML-{v}}}" for v in ("1.2", "1.1", "1.0", "2.0")]
_LENGTHS = {
    "meter": 1.0, "millimeter": 1e-3, "centimeter": 1e-2, "kilometer": 1e3, "foot": UNITS["ft"],
    "ussurveyfoot": UNITS["usft"], "inch": UNITS["ft"] / 12,
}  # fmt: skip
_ANGLES = {
    "radians": "rad", "grads": "gon", "decimal degrees": "deg", "decimal dd.mm.ss": "dms",
}  # fmt: skip
#: names that a sentence lists
_NAMED = 8
_OBSERVATIONS = ("RawObservation", "ReducedObservation")
_READ = (
    *_OBSERVATIONS, "InstrumentSetup", "ObservationGroup", "CgPoints", "SurveyHeader",
    "TargetSetup", "InstrumentPoint", "TargetPoint", "Backsight", "BacksightPoint", "Feature",
    "CgPoint", "Equipment", "Property", "FieldNote",
)  # fmt: skip


def sniff(text: str) -> bool:
    """True if the root element is that of the format."""
    return "<LandXML" in text


def read(path: Path) -> RawFile:
    """Read a file."""
    root = xml_file.load(path, *(space + "LandXML" for space in _SPACES), "LandXML")
    reader = _Reader(Recorder(path, "LandXML"), root)
    surveys = [e for e in root.iter() if _tag(e) == "Survey"]
    if not surveys:
        raise InputError(
            "there is no <Survey>", file=path, cure="export the survey observations, too"
        )
    for points in (e for e in root.iter() if _tag(e) == "CgPoints"):
        reader.points(points)
    for survey in surveys:
        reader.survey(survey)
    return reader.recorder.finish()


class _Reader:
    """Turns elements into set-ups, sights and coordinates."""

    def __init__(self, recorder: Recorder, root: etree._Element) -> None:
        self.recorder = recorder
        self.length, self.angle = 1.0, "deg"
        units = next((e for e in root.iter() if _tag(e) in ("Metric", "Imperial")), None)
        if units is not None:
            self._units(units)
        self.setups: dict[str, etree._Element] = {}
        self.target_setups: dict[str, etree._Element] = {}
        self.open: str | None = None

    def _units(self, units: etree._Element) -> None:
        length = units.get("linearUnit", "meter")
        # the schema's own default
        unit = units.get("angularUnit", "radians")
        if length.lower() not in _LENGTHS or unit.lower() not in _ANGLES:
            raise InputError(
                f"the units {length} and {unit} are unknown",
                file=self.recorder.path,
                line=xml_file.line_of(units),
            )
        self.length, self.angle = _LENGTHS[length.lower()], _ANGLES[unit.lower()]

    def points(self, element: etree._Element) -> None:
        """Coordinates of the file."""
        named = list[str]()
        for point in (e for e in element.iter() if _tag(e) == "CgPoint" and (e.text or "").strip()):
            self._guarded(point, lambda p=point: self._coordinates(p, p.get("name") or "", True))
            if "control" in (point.get("role") or "").lower():
                named.append(point.get("name") or "")
        if named:
            more = f" and {len(named) - _NAMED} more" if len(named) > _NAMED else ""
            self.recorder.note(
                f"the file calls {', '.join(named[:_NAMED])}{more} control and gives no sigma: a "
                "role alone holds no point; state control in a project or a list with a column role"
            )

    def survey(self, survey: etree._Element) -> None:
        """All set-ups and sights of a survey."""
        for element in survey.iter():
            tag = _tag(element)
            if tag == "InstrumentSetup":
                self.setups[element.get("id", "")] = element
            elif tag == "TargetSetup":
                self.target_setups[element.get("id", "")] = element
            elif tag and tag not in ("Survey", *_READ):
                self.recorder.unknown[f"<{tag}>"] += 1
        for element in survey.iter():
            if _tag(element) in _OBSERVATIONS:
                self._guarded(element, lambda e=element: self._sight(e))

    def _guarded(self, element: etree._Element, work: object) -> None:
        """Do the work on an element; if it cannot be right it is left out and counted."""
        assert callable(work)
        try:
            work()
        except ValueError as error:
            self.recorder.problem(xml_file.line_of(element) or 0, str(error))

    def _coordinates(self, element: etree._Element, name: str, given: bool) -> None:
        """North, east, height in the text of an element."""
        cells = [number(cell) * self.length for cell in (element.text or "").split()]
        if len(cells) not in (2, 3):
            raise ValueError(f"point {name} has {len(cells)} coordinates")
        up = cells[2] if len(cells) == 3 else math.nan
        self.recorder.point(
            xml_file.line_of(element) or 0,
            name,
            cells[1],
            cells[0],
            up,
            given=given,
            code=element.get("code") or (element.get("desc") or "").removeprefix(name),
        )
        self.recorder.understood["coordinates"] += 1

    def _setup(self, element: etree._Element) -> None:
        """Begin the set-up that a sight refers to, by itself or through its group."""
        parents = [element, *element.iterancestors()]
        key = next((e.get("setupID") for e in parents if e.get("setupID") is not None), None)
        inside = next((e for e in parents if _tag(e) == "InstrumentSetup"), None)
        if key is None and inside is not None:
            key = inside.get("id", "")
        if key is None or key not in self.setups:
            raise ValueError(f"the sight refers to set-up {key}, which is not there")
        if key == self.open:
            return
        self.open = key
        setup = self.setups[key]
        back = next((e for e in setup.iter() if _tag(e) == "Backsight"), None)
        point = next((e for e in setup.iter() if _tag(e) == "InstrumentPoint"), None)
        name = setup.get("stationName") or ("" if point is None else _name(point))
        line = xml_file.line_of(setup) or 0
        self.recorder.setup(
            line,
            name,
            height=self._length(setup, "instrumentHeight"),
            backsight="" if back is None else _name(next(iter(_points(back)), back)),
            azimuth=math.nan if back is None else self._angle(back, "azimuth"),
            circle=math.nan if back is None else self._angle(back, "circle"),
        )
        self.recorder.understood["set-up"] += 1
        if point is not None and (point.text or "").strip():
            self._coordinates(point, name, True)

    def _sight(self, element: etree._Element) -> None:
        """Readings to a target."""
        self._setup(element)
        point = next(iter(_points(element)), None)
        target = self.target_setups.get(element.get("targetSetupID", ""))
        name = "" if point is None else _name(point)
        height = self._length(element, "targetHeight")
        self.recorder.prism = math.nan
        if target is not None:
            height = self._length(target, "targetHeight") if math.isnan(height) else height
            self.recorder.prism = self._length(target, "prismConstant")
        zenith = self._angle(element, "zenithAngle")
        distance = self._length(element, "slopeDistance")
        if math.isnan(distance) and not math.isnan(zenith):
            distance = self._length(element, "horizDistance") / abs(math.sin(zenith) or math.nan)
        direction = self._angle(element, "horizAngle")
        if math.isnan(direction):
            direction = self._angle(element, "azimuth")
        face = {"true": 1, "1": 1, "false": 2, "0": 2}.get(element.get("directFace", ""), 0)
        self.recorder.shot(
            xml_file.line_of(element) or 0, name, direction=direction, zenith=zenith,
            distance=distance, face=face, height=height, code=element.get("desc") or "",
        )  # fmt: skip
        self.recorder.understood["sight"] += 1
        if point is not None and (point.text or "").strip():
            self._coordinates(point, name, False)

    def _length(self, element: etree._Element, name: str) -> float:
        return number(element.get(name) or "") * self.length

    def _angle(self, element: etree._Element, name: str) -> float:
        return angle(element.get(name) or "", self.angle)


def _tag(element: etree._Element) -> str:
    """Name of an element without its namespace, "" for comments."""
    return etree.QName(element).localname if isinstance(element.tag, str) else ""


def _points(element: etree._Element) -> Iterator[etree._Element]:
    """Points of an observation or of a backsight."""
    return (e for e in element.iterchildren() if _tag(e) in ("TargetPoint", "BacksightPoint"))


def _name(point: etree._Element) -> str:
    """Name of a point: its own, that of the point it refers to, or its description."""
    for attribute in ("name", "pntRef", "desc"):
        if point.get(attribute):
            return (point.get(attribute) or "").strip()
    return ""
