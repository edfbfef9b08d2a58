"""The head of a COPC file: how many points, where, and its coarsest ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from laspy import CopcReader
from laspy.copc import Bounds
from laspy.errors import LaspyException
from lazrs import LazrsError
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.scans.facts import told_facts
from tribrach.io.scans.las import FACTS, check_header

#: place and content of the record that comes first in every COPC file
_AT, _COPC = 377, b"copc"
_COLOURS = {"red", "green", "blue"}


@dataclass(frozen=True)
class CopcHead:
    """What the first bytes of a cloud tell."""

    points: int  #: how many there are
    bounds: Array  #: (2, 3), lowest and highest coordinates [m]
    colours: bool  #: do points have colours of their own?
    #: values (n,) of the points of the coarsest node by the name of the field
    sample: dict[str, NDArray[Any]]


def is_copc(path: Path) -> bool:
    """Tell whether a file says that it is COPC."""
    with path.open("rb") as file:
        head = file.read(_AT + len(_COPC))
    return head.startswith(b"LASF") and head[_AT:] == _COPC


def read_copc_head(path: Path) -> CopcHead:
    """Read the header and the coarsest points of a COPC file."""
    try:
        check_header(path)
        if not is_copc(path):
            raise InputError("this is no COPC file", file=path, cure="convert it to COPC")
        with CopcReader.open(str(path)) as reader:
            header = reader.header
            points = reader.query(level=0)
            names = list(header.point_format.dimension_names)
            sample = {name: np.asarray(points[name]) for name in names}
            bounds = np.array([header.mins, header.maxs], dtype=np.float64)
            colours = set(names) >= _COLOURS and any(sample[c].any() for c in _COLOURS)
            return CopcHead(int(header.point_count), bounds, colours, sample)
    except (OSError, ValueError, IndexError, LaspyException, LazrsError) as error:
        raise InputError(f"this cloud cannot be read ({error})", file=path) from error


@dataclass(frozen=True)
class CloudPoint:
    """A point of a cloud."""

    xyz: Array  #: (3,), its coordinates [m]
    values: dict[str, float]  #: numbers by the name of the field
    facts: Mapping[str, str]  #: what the cloud says of itself


def nearest_point(path: Path, place: Array, within: float) -> CloudPoint | None:
    """Find the point of a COPC file that is nearest to a place.

    ``place`` (3,): coordinates [m]; ``within``: half the side of the box about the place that is
    looked through [m].
    """
    try:
        check_header(path)
        with CopcReader.open(str(path)) as reader:
            found = reader.query(bounds=Bounds(place - within, place + within))
            records = [v for v in reader.header.vlrs if (v.user_id, v.record_id) == FACTS]
            told = told_facts(records[0].record_data_bytes()) if records else {}
            xyz = np.stack([found.x, found.y, found.z], axis=1).reshape(-1, 3)
            if not len(xyz):
                return None
            nearest = int(np.argmin(((xyz - place) ** 2).sum(axis=1)))
            names = [n for n in reader.header.point_format.dimension_names if n not in "XYZ"]
            values = {name: float(np.asarray(found[name])[nearest]) for name in names}
            return CloudPoint(xyz[nearest], values, told)
    except (OSError, ValueError, IndexError, LaspyException, LazrsError) as error:
        raise InputError(f"this cloud cannot be read ({error})", file=path) from error
