"""JSON lines of DynAdjust from version 1.4 on: the elements of DynaML, one record a line.

The first line has frame and epoch. Names are those of DynaML; what may be there several times is a
list, and baselines and points of a cluster have their stations with them. Numbers may be texts.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree

from tribrach.errors import RefusalCollector
from tribrach.io.json_text import json_text
from tribrach.io.survey.dynadjust import dynaml, writer
from tribrach.io.survey.dynadjust.records import RecordPlace, Records
from tribrach.io.survey.exported import Exported
from tribrach.io.totalstation.text import read_lines
from tribrach.network.network import Network

#: first records of files, of measurements and of reports
_HEADS = ("DnaXmlFormat", "DnaAdjustmentReport")
#: elements that are lists, and those of a cluster that have their stations with them
_LISTS = ("GPSBaseline", "Clusterpoint", "GPSCovariance", "PointCovariance", "Directions")
_ENTRIES = ("GPSBaseline", "Clusterpoint")
#: elements that are texts though they may look like numbers
_TEXTS = {
    *("Name", "Constraints", "Type", "Ignore", "First", "Second", "Third", "Target"),
    *("ReferenceFrame", "Epoch", "Coords"),
}
#: numbers that may be packed degrees, which have no exponent
_PACKED = ("Value", "XAxis", "YAxis")
#: levels of a record
_DEEP = 4


def parse(path: Path, refused: RefusalCollector) -> Records:
    """Records of one file."""
    records = Records(str(path), *dynaml.DEFAULT)
    for line, text in enumerate(read_lines(path), start=1):
        if not text.strip():
            continue
        place = RecordPlace(records.file, line)
        with refused.record():
            for tag, record in _objects(text, place):
                if tag in _HEADS:
                    records.frame = str(record.get("referenceframe") or records.frame)
                    records.epoch = str(record.get("epoch") or records.epoch)
                else:
                    dynaml.take(records, _element(tag, record, place))
    return records


def _objects(text: str, place: RecordPlace) -> list[tuple[str, Mapping[str, Any]]]:
    """The record of a line, by its name."""
    try:
        found = json.loads(text, parse_float=str, parse_int=str, parse_constant=str)
    except (ValueError, RecursionError) as error:
        raise place.error("the line is not JSON", "write one record on each line") from error
    if not isinstance(found, dict) or not all(isinstance(one, dict) for one in found.values()):
        raise place.error("the line is no record of DynAdjust")
    return list(found.items())


def _element(tag: str, value: Any, place: RecordPlace, depth: int = 0) -> Any:
    """A value as the element of DynaML that it stands for."""
    try:
        element: Any = etree.Element(tag)
        element.sourceline = min(place.line or 1, 65535)
        if isinstance(value, dict) and depth < _DEEP:
            for name, child in value.items():
                for one in child if isinstance(child, list) else [child]:
                    element.append(_element(name, one, place, depth + 1))
        elif not isinstance(value, dict | list):
            element.text = _text(tag, value)
    except ValueError as error:
        raise place.error(f"the name or text {tag[:20]!r} is not of DynaML") from error
    return element


def _text(tag: str, value: Any) -> str:
    """What stands in an element."""
    if tag == "Ignore":
        return "*" if value else ""
    text = "" if value is None else str(value)
    if tag in _PACKED and re.fullmatch(r"[-+]?\d(\.\d+)?[eE][-+]?\d{1,2}", text):
        return str(np.format_float_positional(float(text)))
    return text


def write(network: Network) -> Exported:
    """The network as the text of a file with stations and measurements."""
    writing, root = writer.document(network)
    head = {"DnaXmlFormat": {str(key): value for key, value in root.attrib.items()}}
    lines = [head, *({str(one.tag): _object(one)} for one in root)]
    return writing.exported("".join(f"{json_text(line)}\n" for line in lines))


def _object(element: etree._Element) -> dict[str, Any]:
    """An element as an object."""
    out: dict[str, Any] = {}
    ends: dict[str, Any] = {}
    kind = element.findtext("Type")
    for child in element:
        value: Any = _object(child) if len(child) else _value(child)
        if child.tag in ("First", "Second"):
            ends[child.tag] = value
        if child.tag in _LISTS:
            owner = ends if child.tag in _ENTRIES and kind != "G" else {}
            out.setdefault(child.tag, []).append({**owner, **value})
        else:
            out.setdefault(child.tag, value)
    if kind == "D":
        out.setdefault("Directions", [])
    return out


def _value(element: etree._Element) -> str | float | int:
    """Text or number; digits beyond a double stay text."""
    text = element.text or ""
    if element.tag in _TEXTS or not text:
        return text
    if re.fullmatch(r"-?\d{1,9}", text):
        return int(text)
    return float(text) if repr(float(text)) == text else text
