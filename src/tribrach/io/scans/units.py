"""From the coordinates of a file to metres: the one place where their unit is decided.

In this order: what the file states in words, the axes of its reference system (PROJ), metres. E57
has metres by its standard. Files in degrees are read as they are by those who only copy or describe
them; whoever asks for lengths is told that there are none.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from pyproj import CRS
from pyproj.exceptions import CRSError

from tribrach.geometry.pose import Pose
from tribrach.scan.length_unit import METRES, LengthUnit
from tribrach.scan.scan import Scan

#: metres of units by what people write, without blanks, full stops, hyphens and underscores
_WORDS: dict[str, tuple[str, float]] = {
    word: (name, metres)
    for name, metres, words in (
        ("metre", 1.0, "m metre metres meter meters mtr"),
        ("millimetre", 1e-3, "mm millimetre millimetres millimeter millimeters"),
        ("centimetre", 1e-2, "cm centimetre centimetres centimeter centimeters"),
        ("decimetre", 1e-1, "dm decimetre decimetres decimeter decimeters"),
        ("micrometre", 1e-6, "um µm micrometre micrometres micrometer micrometers micron microns"),
        ("kilometre", 1e3, "km kilometre kilometres kilometer kilometers"),
        ("foot", 0.3048, "ft foot feet ift internationalfoot internationalfeet ftint intft"),
        (
            "US survey foot",
            1200 / 3937,
            "usft usftus ftus usfoot usfeet ussurveyfoot ussurveyfeet surveyfoot surveyfeet sft",
        ),
        ("inch", 0.0254, "in inch inches"),
        ("yard", 0.9144, "yd yard yards"),
    )
    for word in words.split()
}
#: metres of units by our names
LINEAR: dict[str, float] = dict(_WORDS.values())
_DEGREES = {"deg", "degree", "degrees", "°"}
#: a statement of the unit in a comment or in a value with that name
_KEY = re.compile(
    r"(?i)^\W*(?:(?:coordinate|coordinates|length|linear|xyz|point|points|model|file|scale)[\s_-]*)?"
    r"units?(?:[\s_-]*(?:of[\s_-]*)?(?:length|measure|measurement|coordinates?|xyz))?\s*"
    r"(?:[:=]|\bis\b|\bare\b|\bin\b|\s)\s*(.+)$"
)
#: coordinates in millimetres
_IN = re.compile(
    r"(?i)^\W*(?:all\s+)?(?:the\s+)?(?:coordinates?|lengths?|distances?|dimensions?|xyz|x\W*y\W*z|"
    r"points?)\s*(?:are|is)?\s*(?:given|expressed|stored)?\s*(?:in|:|=)\s+(.+)$"
)
_BARE = re.compile(r"[\s._()\[\]\"'-]")
#: more than a circle is no longitude, and no scan reaches over so many degrees
_CIRCLE, _WIDEST = 360.5, 3.0


def named_unit(word: str) -> LengthUnit | None:
    """The unit that a word means; None if it is none."""
    bare = _BARE.sub("", word.strip().lower().replace("u.s.", "us"))
    if bare in _DEGREES:
        return LengthUnit(("degree", "degree", "metre"), None, "stated in the file")
    found = _WORDS.get(bare)
    if found is None:
        return None
    name, metres = found
    return LengthUnit((name,) * 3, (metres,) * 3, "stated in the file")


def stated_unit(comments: Iterable[str]) -> LengthUnit | None:
    """The unit that comments of a file state, such as ``units: mm``; None if they state none."""
    for comment in comments:
        for pattern in (_KEY, _IN):
            match = pattern.match(comment.strip())
            if match is None:
                continue
            words = match.group(1).split()
            for many in range(min(len(words), 4), 0, -1):
                unit = named_unit(" ".join(words[:many]).rstrip(",;"))
                if unit is not None:
                    return unit
    return None


def unit_of_crs(wkt: str) -> LengthUnit | None:
    """The units of the axes of a reference system; None if PROJ does not know it.

    Heights without an axis of their own are counted as the plane is, those beside degrees in
    metres.
    """
    try:
        crs = CRS.from_user_input(wkt)
    except CRSError:
        return None
    while crs.source_crs is not None and crs.is_bound:
        crs = crs.source_crs
    parts = list(crs.sub_crs_list) or [crs]
    axes = [axis for part in parts for axis in part.axis_info]
    heights = [a for a in axes if a.direction.lower() in ("up", "down")]
    plane = [a for a in axes if a.direction.lower() not in ("up", "down")][:2]
    if crs.is_geocentric:
        plane, heights = axes[:2], axes[2:3]
    if len(plane) < 2:
        plane = []
    source = "the axes of the reference system"
    if any("deg" in a.unit_name.lower() or "rad" in a.unit_name.lower() for a in plane) or (
        any(part.is_geographic for part in parts)
    ):
        beside = str(heights[0].unit_name) if heights else "metre"
        return LengthUnit(("degree", "degree", beside), None, source, wkt, True)
    x, y = plane if plane else (None, None)
    z = heights[0] if heights else x
    found = [a for a in (x, y, z) if a is not None]
    if not found or not all(a.unit_conversion_factor > 0 for a in found):
        return None
    names = tuple("metre" if a is None else str(a.unit_name) for a in (x, y, z))
    factors = tuple(1.0 if a is None else float(a.unit_conversion_factor) for a in (x, y, z))
    return LengthUnit(
        (names[0], names[1], names[2]), (factors[0], factors[1], factors[2]), source, wkt, True
    )


def metric_crs(wkt: str) -> str | None:
    """The same reference system with metres along its axes; None if unknown."""
    try:
        told = json.loads(CRS.from_user_input(wkt).to_json())
        return str(CRS.from_json_dict(_metric(told)).to_wkt())
    except (CRSError, ValueError, TypeError, KeyError):
        return None


def _metric(told: Any) -> Any:
    """PROJJSON with metres along linear axes, without the codes that no longer apply."""
    if isinstance(told, list):
        return [_metric(one) for one in told]
    if not isinstance(told, dict):
        return told
    out = {key: _metric(value) for key, value in told.items() if key != "conversion"}
    if "conversion" in told:
        out["conversion"] = told["conversion"]
    if "coordinate_system" in told or "components" in told:
        was, now = told, out
        if was != now:
            now.pop("id", None)
            now["name"] = f"{told.get('name', 'unknown')} (in metres)"
    if "axis" in told and "subtype" in told:
        for axis in out["axis"]:
            unit = axis.get("unit")
            if unit != "metre" and not (isinstance(unit, str) and "degree" in unit):
                axis["unit"] = "metre"
    return out


def in_metres(scan: Scan, given: LengthUnit | None = None) -> Scan:
    """A scan as its reader has it, in metres from now on.

    ``given``: the unit that the user gives, instead of what the file says.
    """
    of_crs = None if scan.crs is None else unit_of_crs(scan.crs)
    stated = given
    if stated is None and scan.unit != METRES:
        stated = scan.unit
    stated = stated or stated_unit(_comments(scan)) or (METRES if scan.standard_metres else None)
    warnings = list(scan.warnings)
    unit = stated or of_crs or METRES
    if unit.factors is None and _beyond_circle(scan):
        warnings.append(
            f"the coordinates are no degrees, which the file says they are ({unit.source}): they "
            "are taken as metres"
        )
        unit = METRES
    elif stated is not None and of_crs is not None and stated.factors != of_crs.factors:
        told = (
            "E57 has metres by its standard"
            if scan.standard_metres
            else (f"the unit is {stated.words}, {stated.source}")
        )
        warnings.append(f"{told}, and the axes of the reference system have {of_crs.words}")
    unit = replace(unit, crs=scan.crs)
    crs = scan.crs
    if crs is not None and of_crs is not None and unit.factors is not None:
        crs = crs if of_crs.metric or of_crs.factors is None else metric_crs(crs)
    if unit.factors is None:
        return replace(scan, unit=unit, origin="unknown", warnings=tuple(warnings))
    if unit.metric:
        return replace(scan, unit=unit, crs=crs, warnings=tuple(warnings))
    return replace(
        scan, unit=unit, crs=crs, warnings=tuple(warnings), **_scaled(scan, unit.factors)
    )


def as_filed(scan: Scan) -> Scan:
    """A scan with the coordinates and the reference system of its file, whatever they count."""
    unit = replace(scan.unit, factors=(1.0, 1.0, 1.0))
    if scan.unit.factors is None or scan.unit.metric:
        return replace(scan, unit=unit, crs=scan.unit.crs or scan.crs)
    x, y, z = scan.unit.factors
    return replace(scan, unit=unit, crs=scan.unit.crs, **_scaled(scan, (1 / x, 1 / y, 1 / z)))


def _scaled(scan: Scan, factors: tuple[float, float, float]) -> dict[str, Any]:
    """Bounds, lattice and pose by factors along the axes."""
    each = np.array(factors)
    pose = scan.pose
    if pose is not None:
        pose = Pose(pose.rotation, pose.translation * each)
    return {
        "bounds": None if scan.bounds is None else scan.bounds * each,
        "lattice": None if scan.lattice is None else scan.lattice.scaled(each),
        "pose": pose,
    }


def _comments(scan: Scan) -> list[str]:
    """What the header says in words."""
    out = []
    for key, value in scan.facts.items():
        out.append(f"{key}: {value}")
        out += [line for text in value.split("; ") for line in text.splitlines()]
    return out


def _beyond_circle(scan: Scan) -> bool:
    """True if stated bounds or first points are not longitudes and latitudes."""
    bounds = scan.bounds
    if bounds is None or not np.isfinite(bounds).all():
        first = next(iter(scan.stored(1000)), None)
        if first is None or not len(first):
            return False
        bounds = np.stack([first.xyz.min(axis=0), first.xyz.max(axis=0)])
    plane = bounds[:, :2]
    return bool(np.abs(plane).max() > _CIRCLE or np.ptp(plane, axis=0).max() > _WIDEST)
