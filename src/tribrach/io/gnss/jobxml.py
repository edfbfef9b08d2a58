"""GNSS vectors of Trimble JobXML (``.jxl``): ``ECEFDeltas`` with the covariance of their record.

A vector goes from the base that its record names (``RTK_Base``, or the point of the record that
``ReferenceRecordID`` refers to) to its point. ``QualityControl2`` holds variances and covariances
in X, Y and Z [m^2]; where a record has none but ``Precision``, east and north are taken with the
whole horizontal precision each, and without correlations. Positions in ``WGS84`` are start values.
Sights of the same file are read by the reader of total stations.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from lxml import etree

from tribrach._types import Array
from tribrach.errors import InputError, RefusalCollector
from tribrach.geodesy.site import ecef_from_geodetic, enu_rotation
from tribrach.io import xml_file
from tribrach.io.gnss.records import GnssRecords
from tribrach.io.gnss.vector_text import covariance, numbers
from tribrach.io.opened_files import contents

_ELEMENTS = ("VCVxx", "VCVxy", "VCVxz", "VCVyy", "VCVyz", "VCVzz")


def has_vectors_only(path: Path) -> bool:
    """True if a file is JobXML with vectors and without sights of a total station."""
    data = contents(path, xml_file.MAX_BYTES)
    return b"<JOBFile" in data[:4000] and b"<ECEFDeltas>" in data and b"<Circle>" not in data


def read_jobxml(path: Path) -> GnssRecords:
    """Vectors of a job and start values of its points."""
    root = xml_file.load(path, "JOBFile")
    records = GnssRecords()
    names = {
        record.get("ID", ""): _text(record, "PointName") or _text(record, "Name")
        for book in root.iterchildren("FieldBook")
        for record in book.iterchildren("PointRecord", "ReferenceRecord")
    }
    vectors: list[Array] = []
    blocks: list[Array] = []
    antennas = 0
    with RefusalCollector() as refused:
        for record in root.iter("PointRecord"):
            if _text(record, "Deleted").lower() == "true":
                continue
            with refused.record():
                _place(path, record, records)
                if record.find("ECEFDeltas") is None:
                    continue
                vector, block = _vector(path, record, names, records)
                vectors.append(vector)
                blocks.append(block)
                antennas += bool(_text(record, "AntennaID"))
        refused.settle()
        if not vectors:
            raise InputError("the job has no GNSS vectors", file=path)
    records.vectors, records.blocks = np.array(vectors), np.array(blocks)
    if antennas:
        records.warnings.append(
            f"{path.name}: {antennas} vectors name antennas; heights of antennas are not applied, "
            "the vectors are taken from mark to mark"
        )
    return records


def _vector(
    path: Path, record: etree._Element, names: dict[str, str], records: GnssRecords
) -> tuple[Array, Array]:
    """Vector and covariance of a record, whose ends are noted."""
    line = xml_file.line_of(record) or 0
    end = _text(record, "Name")
    reference = _text(record, "ReferenceRecordID") or _text(record, "ReferenceID")
    start = _text(record, "RTK_Base") or names.get(reference, "")
    if not start or not end or start == end:
        what = f"the vector to {end or 'a point without a name'} has no base"
        cure = "export the job with the records of its bases"
        raise InputError(what, file=path, line=line, cure=cure)
    deltas = [_text(record, f"ECEFDeltas/Delta{axis}") for axis in "XYZ"]
    vector = numbers(deltas, "the vector", path, line)
    elements = [_text(record, f"QualityControl2/{name}") for name in _ELEMENTS]
    known = [_text(record, f"Precision/{name}") for name in ("Horizontal", "Vertical")]
    at = [_text(record, f"WGS84/{name}") for name in ("Latitude", "Longitude")]
    if all(elements):
        upper = numbers(elements, "the covariance", path, line)
    elif all(known) and all(at):
        plan, height = numbers(known, "the precision", path, line)
        latitude, longitude = np.radians(numbers(at, "the position", path, line))[:, None]
        axes = enu_rotation(latitude, longitude)[0]
        upper = (axes.T @ np.diag([plan, plan, height]) ** 2 @ axes)[np.triu_indices(3)]
        records.warnings.append(
            f"the vector from {start} to {end} has no covariance: east and north are taken with "
            f"the horizontal precision of {plan:g} m each, up with {height:g} m, uncorrelated"
        )
    else:
        raise InputError(
            f"the vector from {start} to {end} has neither a covariance, nor a precision with a "
            "position",
            file=path,
            line=line,
            cure="export the job with QC2 records",
        )
    block = covariance(upper, path, line)
    records.start.append(start)
    records.end.append(end)
    records.vector_sources.append(f"{path.name}:{line}")
    return vector, block


def _place(path: Path, record: etree._Element, records: GnssRecords) -> None:
    """A position on the ellipsoid as start value, where a record has one."""
    words = [_text(record, f"WGS84/{name}") for name in ("Latitude", "Longitude", "Height")]
    name = _text(record, "Name")
    if not all(words) or not name or name in records.approximate:
        return
    line = xml_file.line_of(record) or 0
    place = numbers(words, "the position", path, line)
    latitude, longitude = np.radians(place[:1]), np.radians(place[1:2])
    records.approximate[name] = ecef_from_geodetic(latitude, longitude, place[2:]).reshape(3)


def _text(element: etree._Element, tag: str) -> str:
    """Text of an element inside another, "" if there is none."""
    return (element.findtext(tag) or "").strip()
