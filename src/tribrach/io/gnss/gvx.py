"""GVX, the vector exchange format of the US National Geodetic Survey (version 1.0, 2021).

``POINT`` gives approximate coordinates, ``GNSS_VECTOR`` a vector from mark to mark in ECEF with
standard deviations and correlations (``SDX`` to ``PYZ``). XML without entities.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from lxml import etree

from tribrach._types import Array
from tribrach.errors import InputError, RefusalCollector
from tribrach.geodesy import frames
from tribrach.io.gnss.records import GnssRecords
from tribrach.io.xml_file import line_of, load
from tribrach.units import LARGEST, too_large

_METRES = ("meter", "meters", "metre", "metres", "m", "")


def read_gvx(path: Path) -> GnssRecords:
    """Points and vectors of a GVX file."""
    root = load(path, "GVX")
    records = GnssRecords()
    systems = {_text(s, "ID"): _text(s, "NAME") for s in root.iter("REFERENCE_SYSTEM")}
    for unit in root.iter("LINEAR_UNIT"):
        name = (_text(unit, "NAME") or (unit.text or "")).strip().lower()
        if name not in _METRES:
            raise InputError(
                f"lengths are in {name!r}, and only metres are read", file=path, line=line_of(unit)
            )
    names: dict[str, str] = {}
    vectors: list[list[float]] = []
    blocks: list[Array] = []
    with RefusalCollector() as refused:
        for point in root.iter("POINT"):
            with refused.record():
                number = _needed(path, point, "ID")
                name = _text(point, "NAME") or number
                taken = name in names.values()
                names[number] = name
                if taken:
                    raise InputError(
                        f"two points are named {name}",
                        file=path,
                        line=line_of(point),
                        cure="give each point a name of its own",
                    )
                _add_point(path, records, point, name, systems)
        for vector in root.iter("GNSS_VECTOR"):
            with refused.record():
                ends = [
                    _needed(path, vector, f"{which}_POINT_ID") for which in ("INITIAL", "TERMINAL")
                ]
                for end in ends:
                    if end not in names:
                        raise InputError(
                            f"the vector's point {end} is not in the file",
                            file=path,
                            line=line_of(vector),
                        )
                vectors.append([_number(path, vector, f"D{axis}") for axis in "XYZ"])
                blocks.append(_covariance(path, vector))
                records.start.append(names[ends[0]])
                records.end.append(names[ends[1]])
                records.vector_sources.append(f"{path.name}:{line_of(vector)}")
        refused.settle()
        if not vectors:
            raise InputError("the file has no vectors", file=path)
    records.vectors, records.blocks = np.array(vectors), np.array(blocks)
    return records


def _add_point(
    path: Path, records: GnssRecords, point: etree._Element, name: str, systems: dict[str, str]
) -> None:
    """Approximate coordinates of a point, and its frame and epoch."""
    place = point.find(".//GEOCENTRIC_COORDINATES")
    if place is not None and _text(place, "X"):
        xyz = [_number(path, place, axis) for axis in "XYZ"]
        if np.linalg.norm(xyz) > 1e6:
            records.approximate[name] = np.array(xyz)
    system = systems.get(_text(point, "REFERENCE_SYSTEM_ID"), "")
    epoch = _text(point, "EPOCH")
    if system and not records.frame:
        try:
            frames.frame(system)
        except InputError:
            text = f"{path.name}: the frame {system} is not known, its epoch is not compared"
            if text not in records.warnings:
                records.warnings.append(text)
        else:
            records.frame = system
    if epoch and records.epoch is None:
        try:
            records.epoch = frames.decimal_year(epoch)
        except InputError as error:
            raise InputError(error.what, file=path, cure=error.cure) from error


def _covariance(path: Path, vector: etree._Element) -> np.ndarray[tuple[int, int]]:
    """Covariance (3, 3) [m^2] of a vector."""
    sigma = np.array([_number(path, vector, f"SD{axis}") for axis in "XYZ"])
    correlation = np.eye(3)
    for (i, j), name in (((0, 1), "PXY"), ((0, 2), "PXZ"), ((1, 2), "PYZ")):
        correlation[i, j] = correlation[j, i] = _number(path, vector, name)
    fair = ((sigma > 0) & (sigma < LARGEST)).all() and (np.abs(correlation) <= 1).all()
    if not fair or not (np.linalg.eigvalsh(correlation) > 0).all():
        raise InputError(
            "the standard deviations and correlations of a vector are no covariance matrix",
            file=path,
            line=line_of(vector),
            cure="correlations are between -1 and 1, sigmas above zero",
        )
    matrix: np.ndarray[tuple[int, int]] = sigma[:, None] * correlation * sigma
    return matrix


def _text(element: etree._Element, tag: str) -> str:
    """Text of the first element of a name inside another, "" if there is none."""
    child = element.find(f".//{tag}")
    return "" if child is None else (child.text or "").strip()


def _needed(path: Path, element: etree._Element, tag: str) -> str:
    """Text of an element that must be there."""
    text = _text(element, tag)
    if not text:
        raise InputError(f"<{element.tag}> has no <{tag}>", file=path, line=line_of(element))
    return text


def _number(path: Path, element: etree._Element, tag: str) -> float:
    """Number of an element that must be there."""
    text = _needed(path, element, tag)
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise InputError(f"<{tag}> is {text!r}, no number", file=path, line=line_of(element))
    if too_large(value):
        what = f"<{tag}> is {text}, beyond any measurement"
        raise InputError(what, file=path, line=line_of(element))
    return value
