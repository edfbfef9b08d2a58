"""A result as LandXML 1.2: points with codes, set-ups, observations reduced to marks.

North stands before east. A reduced observation is azimuth, horizontal distance and height
difference between two adjusted positions that an observation joins, in the frame of the
coordinates; each has its standard deviations.
"""

from __future__ import annotations

import math
from datetime import UTC, datetime
from typing import Any

import numpy as np
from lxml import etree

from tribrach.errors import InputError
from tribrach.io.delivery.content import DeliveredPosition, Delivery

NAMESPACE = "http://www.landxml.org/schema/LandXML-1.2"
_SCHEMA = f"{NAMESPACE} {NAMESPACE}/LandXML-1.2.xsd"
_INSTANCE = "http://www.w3.org/2001/XMLSchema-instance"
#: roles of points as the schema has them
_ROLES = {"control": "control point"}


def write(delivery: Delivery) -> bytes:
    """The bytes of a LandXML file."""
    if delivery.moves:
        raise InputError(
            "LandXML has no displacements", cure="export compared epochs as dxf, gpkg, csv or xlsx"
        )
    now = datetime.now(UTC)
    spaces: dict[Any, str] = {None: NAMESPACE, "xsi": _INSTANCE}
    given = {
        "version": "1.2",
        "date": now.strftime("%Y-%m-%d"),
        "time": now.strftime("%H:%M:%S"),
        "readOnly": "false",
        "language": "English",
        f"{{{_INSTANCE}}}schemaLocation": _SCHEMA,
    }
    root = etree.Element("LandXML", given, nsmap=spaces)
    units = etree.SubElement(root, "Units")
    etree.SubElement(
        units,
        "Metric",
        {
            "areaUnit": "squareMeter",
            "linearUnit": "meter",
            "volumeUnit": "cubicMeter",
            "temperatureUnit": "celsius",
            "pressureUnit": "milliBars",
            "angularUnit": "decimal degrees",
            "directionUnit": "decimal degrees",
        },
    )
    if delivery.crs:
        system = {"name": delivery.crs}
        if delivery.heights:
            system["verticalDatum"] = delivery.heights
        authority, _, code = delivery.crs.partition(":")
        if authority.upper() == "EPSG" and code.isdecimal():
            system["epsgCode"] = code
        etree.SubElement(root, "CoordinateSystem", system)
    etree.SubElement(root, "Project", {"name": delivery.title, "desc": delivery.datum})
    etree.SubElement(root, "Application", {"name": "Tribrach", "version": delivery.program})
    _points(root, delivery)
    if delivery.lines:
        _survey(root, delivery)
    return etree.tostring(root, pretty_print=True, xml_declaration=True, encoding="UTF-8")


def _points(root: etree._Element, delivery: Delivery) -> None:
    """Coordinates with codes, sigmas, and where the ellipsoid has them."""
    points = etree.SubElement(root, "CgPoints", {"name": "Adjusted"})
    for p in delivery.plan:
        given = {"name": p.name, "role": _ROLES.get(p.role, "calculated")}
        if p.code:
            given |= {"code": p.code, "desc": p.code}
        given |= {"state": "existing"}
        if p.geodetic is not None:
            longitude, latitude, height = p.geodetic
            given |= {"ellipsoidHeight": repr(height)}
            given |= {"latitude": repr(latitude), "longitude": repr(longitude)}
        sigmas = zip(("easting", "northing", "elevation"), p.sigma.tolist(), strict=True)
        given |= {f"{axis}StdError": f"{v:.6f}" for axis, v in sigmas if math.isfinite(v)}
        element = etree.SubElement(points, "CgPoint", given)
        e, n, h = p.xyz.tolist()
        element.text = " ".join(repr(v) for v in (n, e, h) if math.isfinite(v))


def _survey(root: etree._Element, delivery: Delivery) -> None:
    """Set-ups and what is observed from them."""
    survey = etree.SubElement(root, "Survey")
    etree.SubElement(survey, "SurveyHeader", {"name": delivery.title, "type": "computed"})
    starts = dict.fromkeys(a.name for a, _ in delivery.lines)
    ends = dict.fromkeys(name for a, b in delivery.lines for name in (a.name, b.name))
    setups = {name: f"IS{k}" for k, name in enumerate(ends, start=1)}
    for name, number in setups.items():
        given = {"id": number, "stationName": name, "instrumentHeight": "0"}
        setup = etree.SubElement(survey, "InstrumentSetup", given)
        etree.SubElement(setup, "InstrumentPoint", {"pntRef": name})
    for start in starts:
        number = setups[start]
        given = {"id": f"OG{number[2:]}", "setupID": number}
        group = etree.SubElement(survey, "ObservationGroup", given)
        for a, b in delivery.lines:
            if a.name == start:
                etree.SubElement(group, "ReducedObservation", _reduced(a, b, setups))


def _reduced(a: DeliveredPosition, b: DeliveredPosition, setups: dict[str, str]) -> dict[str, str]:
    """Azimuth, horizontal distance and height difference of two positions."""
    e, n, h = (b.xyz - a.xyz).tolist()
    length = math.hypot(e, n)
    out = {
        "desc": f"{a.name} to {b.name}",
        "purpose": "normal",
        "setupID": setups[a.name],
        "targetSetupID": setups[b.name],
        "azimuth": repr(math.degrees(math.atan2(e, n)) % 360.0),
        "horizDistance": repr(length),
    }
    if math.isfinite(h):
        out["vertDistance"] = repr(h)
    if not np.isfinite(length) or length == 0:
        del out["azimuth"]
    return out
