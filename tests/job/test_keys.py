"""Every field of everything that results depend on is in their keys."""

import copy
import datetime
import importlib
import pkgutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from enum import Enum
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel

import tribrach
from tests.job.cloud_jobs import NOISE, several
from tribrach.cloud.placement import CalibrationShare, Placement
from tribrach.comparison.sites import ComparisonSite
from tribrach.comparison.station_pair import StationPair
from tribrach.geodesy.geoid_grid import GeoidGrid
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.projection import ProjectedGrid
from tribrach.geodesy.site import FlatSite
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.geometry.pose import Pose
from tribrach.instruments.calibration import find_model
from tribrach.instruments.correction import Correction
from tribrach.io.scans.formats import read_scans
from tribrach.job.find_targets import find_targets
from tribrach.job.scans import MeasuredScan, StationScan
from tribrach.job.state import NOT_IN_DIGEST, Remembered, digest
from tribrach.project.sections import CloudSection, TargetSection
from tribrach.scan.face import HeadTurn, ScanFace
from tribrach.scan.scan import Scan


class Colour(Enum):
    RED = 1
    BLUE = 2


def samples(folder: Path) -> list[Any]:
    """Everything that keys are made of, no field of it empty."""
    several(folder / "a.e57", 1)
    (folder / "b.xyz").write_text("1 2 3\n4 5 6\n7 8 9\n")
    (folder / "geoid.gtx").write_bytes(b"heights")
    correction = Correction(find_model("lichti", ("A3", "B6"), (1.2, 9.6)), np.array([1e-3, 1e-5]))
    pose = Pose(np.eye(3), np.array([1.0, 2.0, 3.0]))
    prepared = {
        "pose": pose,
        "grid": (2, 3),
        "crs": "EPSG:4978",
        "bounds": np.array([[0.0, 0, 0], [9, 9, 9]]),
        "scanner": (0.1, 0.2, 0.3),
        "warnings": ("odd",),
        "facts": {"sensor": "one"},
        "face": ScanFace(HeadTurn(0.1, 0.01, 90), 1.0),
        "correction": correction,
    }
    scans = [
        replace(scan, **prepared)
        for file in ("a.e57", "b.xyz")
        for scan in read_scans(folder / file)
    ]
    share = CalibrationShare(correction, np.eye(2), np.ones((6, 2)))
    projection = ProjectedGrid("EPSG:32648", 505_000.0, 2_331_000.0, 20.0)
    work = WorkFrame(projection.site, projection, 30.0, GeoidGrid(folder / "geoid.gtx"))
    return [
        *(MeasuredScan("S1", "S1", scan, NOISE) for scan in scans),
        Placement("S1", pose, np.eye(6), NOISE, share),
        OutputFrame(work, "projected", "EPSG:32648", 2020.0),
        WorkFrame(FlatSite(6.4e6)),
        StationPair(np.zeros(3), np.ones(3), np.eye(12)),
        ComparisonSite("wall", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
        CloudSection(),
        TargetSection(sphere_radius_m=(0.07,)),
        [Colour.RED, datetime.date(2026, 1, 2), None, True, b"x", 1 + 2j, frozenset({1, 2})],
    ]


def changed(value: Any) -> Any:
    """Another value, as near as there is."""
    match value:
        case None:
            return 1.0
        case Enum():
            return Colour.BLUE
        case bool():
            return not value
        case int():
            return value + 1
        case float() | complex():
            return np.nextafter(value.real, np.inf) + value.imag * 1j ** bool(value.imag)
        case str():
            return value + "'"
        case bytes():
            return value + b"'"
        case datetime.date():
            return value + datetime.timedelta(days=1)
        case Path():
            other = value.with_name("other")
            other.mkdir(exist_ok=True)
            (other / value.name).write_bytes(value.read_bytes() + b" ")
            return other / value.name
        case np.ndarray():
            near = value.copy()
            near.flat[0] = np.nextafter(near.flat[0], np.inf)
            return near
        case np.dtype():
            return np.dtype("<i2")
        case FunctionType():
            return lambda r, h, v, k: (r, 1, 2)
        case frozenset():
            return value | {0}
    raise AssertionError(f"how is {value!r} changed?")


def variants(value: Any) -> Iterator[tuple[str, Any]]:
    """The same with one thing changed, each thing in turn, and what it is."""
    if is_dataclass(value) and not isinstance(value, type):
        for item in fields(value):
            for name, other in variants(getattr(value, item.name)):
                near = copy.copy(value)
                object.__setattr__(near, item.name, other)
                yield f"{type(value).__name__}.{item.name} {name}", near
    elif isinstance(value, BaseModel):
        for key in type(value).model_fields:
            for name, other in variants(getattr(value, key)):
                yield f"{type(value).__name__}.{key} {name}", value.model_copy(update={key: other})
    elif isinstance(value, Mapping):
        yield "one more", {**value, "more": 1}
        for key in value:
            for name, other in variants(value[key]):
                yield f"[{key}] {name}", {**value, key: other}
    elif isinstance(value, list | tuple):
        yield "one more", [*value, 0]
        for k, part in enumerate(value):
            for name, other in variants(part):
                yield f"[{k}] {name}", [*value[:k], other, *value[k + 1 :]]
    else:
        yield "", changed(value)


def test_every_field_changes_the_key(tmp_path: Path) -> None:
    state = Remembered(tmp_path / "out")
    seen = set[str]()
    for sample in samples(tmp_path):
        key = state.key(find_targets, sample)
        assert state.key(find_targets, copy.copy(sample)) == key
        keys = {key}
        for name, other in variants(sample):
            new = state.key(find_targets, other)
            assert new not in keys, name
            keys.add(new)
            seen.add(name)
    # the walk went through all of these, down to their fields
    words = " ".join(seen)
    for kind in (MeasuredScan, ScanFace, HeadTurn, Correction, CalibrationShare, Pose, Placement,
                 OutputFrame, WorkFrame, ProjectedGrid, GeoidGrid, FlatSite, StationPair,
                 ComparisonSite):  # fmt: skip
        for item in fields(kind):
            assert f"{kind.__name__}.{item.name}" in words
    for item in fields(Scan):
        assert f"E57Scan.{item.name}" in words
        assert f"XyzScan.{item.name}" in words
    for model in (CloudSection, TargetSection):
        for key in model.model_fields:
            assert f"{model.__name__}.{key}" in words


def test_what_the_network_is_told_of_a_scan_makes_no_points_anew(tmp_path: Path) -> None:
    """Targets need not be sought again when one of them gets a name."""
    several(tmp_path / "a.e57", 1)
    scan = StationScan("S1", "S1", read_scans(tmp_path / "a.e57")[0], NOISE, False, {})
    told = replace(scan, levelled=True, names={"T1": (1.0, 2.0, 3.0)})
    key = Remembered(tmp_path / "out").key
    assert key(find_targets, scan.measured) == key(find_targets, told.measured)
    assert key(find_targets, scan) != key(find_targets, told)


def test_files_count_by_name_and_contents_not_by_place_and_date(tmp_path: Path) -> None:
    key = Remembered(tmp_path / "out").key
    one, other = tmp_path / "a" / "x.las", tmp_path / "b" / "x.las"
    for path in (one, other):
        path.parent.mkdir()
        path.write_bytes(b"points")
    assert key(find_targets, one) == key(find_targets, other)
    assert key(find_targets, one) != key(find_targets, one.rename(tmp_path / "a" / "y.las"))
    other.write_bytes(b"Points")
    assert key(find_targets, other) != key(find_targets, tmp_path / "a" / "y.las")


def test_functions_count_by_what_they_do() -> None:
    def scaled(by: float) -> Any:
        return lambda x: by * x

    assert digest(scaled(2.0)) == digest(scaled(2.0))
    assert digest(scaled(2.0)) != digest(scaled(3.0))
    assert digest(np.sin) != digest(np.cos)
    units = [find_model("lichti", ("A3",), unit_lengths) for unit_lengths in ((1, 2), (1.5, 2))]
    assert units[0].name == units[1].name
    assert digest(units[0]) != digest(units[1])


class Unknown:
    pass


@pytest.mark.parametrize(
    "part", [Unknown(), object(), [Unknown()], {"a": Unknown()}, np.array([Unknown()]), iter([])]
)
def test_what_is_not_understood_is_refused(part: object) -> None:
    with pytest.raises(TypeError, match="no digest is defined"):
        digest(part)


def test_a_path_alone_says_nothing_of_the_contents() -> None:
    with pytest.raises(TypeError, match=r"use Remembered\.key"):
        digest(Path("a.las"))


@dataclass(frozen=True)
class Kept:
    value: float
    note: str = field(default="", metadata={NOT_IN_DIGEST: "made of the value when first needed"})


@dataclass(frozen=True)
class Careless:
    value: float
    note: str = field(default="", metadata={NOT_IN_DIGEST: " "})


def test_a_field_is_left_out_with_a_reason_only() -> None:
    assert digest(Kept(1.0, "a")) == digest(Kept(1.0, "b")) != digest(Kept(2.0, "a"))
    with pytest.raises(TypeError, match="note is left out of digests without a reason"):
        digest(Careless(1.0))


def test_every_field_that_is_left_out_says_why() -> None:
    for info in pkgutil.walk_packages(tribrach.__path__, "tribrach."):
        if info.name.startswith(("tribrach.gnss.engine_worker", "tribrach.__main__")):
            continue
        for thing in vars(importlib.import_module(info.name)).values():
            if isinstance(thing, type) and is_dataclass(thing):
                for item in fields(thing):
                    reason = item.metadata.get(NOT_IN_DIGEST, "one that is not left out")
                    assert len(reason.split()) > 3, f"{thing.__name__}.{item.name}"
