"""A comparison is made again where anything that it depends on has changed, and only there."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pytest
from pydantic import TypeAdapter

from tests.job.test_station_comparison import job
from tribrach.cloud.shared_part import SharedPart
from tribrach.geometry.pose import Pose
from tribrach.io.outputs import write_text
from tribrach.job import station_comparison
from tribrach.job import steps as survey_run
from tribrach.job.memo import put_together, taken_apart
from tribrach.job.station_comparison import StationComparison, compare_stations
from tribrach.pipeline import run
from tribrach.project import Project
from tribrach.report.chapters.comparisons import SUBJECT, comparison_chapter
from tribrach.report.content import Report

__all__ = ["job"]  # a fixture


def same(one: Any, other: Any) -> bool:
    """Equal in every digit, arrays and dataclasses included."""
    if is_dataclass(one):
        return type(one) is type(other) and all(
            same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one)
        )
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=True)
    if isinstance(one, list | tuple):
        return type(one) is type(other) and len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, Mapping):
        return same(list(one.items()), list(other.items()))
    return bool(one == other)


@dataclass
class Calls:
    """What a run gives to the comparison, and how often clouds were really compared."""

    folder: Path
    given: tuple[Any, ...]
    count: int = 0

    def again(self, **changes: Any) -> tuple[int, StationComparison]:
        """Comparisons made with some of it changed, and the chapter."""
        wished, shared, _, frame, state, progress = self.given
        shared, frame = changes.pop("shared", shared), changes.pop("frame", frame)
        wish = replace(wished[0], **changes.pop("wish", {}))
        before = self.count
        (chapter,) = compare_stations(
            [wish], shared, shared.delivered(frame), frame, state, progress
        )
        return self.count - before, chapter

    @property
    def wish(self) -> Any:
        return self.given[0][0]

    @property
    def shared(self) -> SharedPart:
        found: SharedPart = self.given[1]
        return found


@pytest.fixture(scope="module")
def second(job: tuple[Path, Report]) -> tuple[Calls, Report]:
    """A second run of the job, which compares nothing; then every comparison is counted."""
    folder, _ = job
    calls = Calls(folder, ())
    original: Callable[..., Any] = station_comparison.compare_clouds

    def counted(*arguments: Any, **options: Any) -> Any:
        calls.count += 1
        return original(*arguments, **options)

    def heard(*given: Any) -> Any:
        calls.given = given
        return compare_stations(*given)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(station_comparison, "compare_clouds", counted)
        patch.setattr(survey_run, "compare_stations", heard)
        content = run(Project.load(folder / "hanoi-facade.toml"))
        yield calls, content


def test_a_second_run_compares_nothing_and_says_the_same(
    job: tuple[Path, Report], second: tuple[Calls, Report]
) -> None:
    calls, content = second
    assert calls.count == 0
    (before,), (after,) = job[1].job.comparisons, content.job.comparisons
    assert same(before, after)
    one, other = comparison_chapter(before), comparison_chapter(after)
    written = TypeAdapter(SUBJECT.model)
    assert written.dump_json([one.data]) == written.dump_json([other.data])
    assert [p.drawing for p in one.pictures] == [p.drawing for p in other.pictures]


def test_the_regression_has_the_unit_of_the_report(job: tuple[Path, Report]) -> None:
    (one,) = job[1].job.comparisons
    if one.regression is None:
        pytest.skip("too few sites for a regression")
    slopes = {}
    for angle, unit in (("deg", "°"), ("gon", "gon")):
        tables = {t.name.split("-")[0]: t for t in comparison_chapter(one, angle).tables}
        assert f"incidence in {unit}" in tables["terms"].note
        rows = [[cell.key for cell in row.cells] for row in tables["terms"].rows]
        slopes[angle] = [row[3] for row in rows if row[2] == "incidence"]
    np.testing.assert_allclose(slopes["gon"], 0.9 * np.array(slopes["deg"]), rtol=1e-9)


def test_nothing_is_lost_in_the_record(job: tuple[Path, Report]) -> None:
    (chapter,) = job[1].job.comparisons
    text = json.dumps(taken_apart(chapter))
    assert same(put_together(StationComparison, json.loads(text)), chapter)
    site = replace(chapter.sites[0], c2c=None, m3c2=None, prediction=None, seen_a=None)
    bare = replace(chapter, sites=(site,), offsets=None)
    assert same(put_together(StationComparison, taken_apart(bare)), bare)


def test_what_it_depends_on_makes_it_anew(second: tuple[Calls, Report]) -> None:
    calls, _ = second
    section, sites = calls.wish.section, calls.wish.sites
    assert calls.again()[0] == 0
    limit = section.model_copy(update={"limit_mm": 150.0})
    nearest = section.model_copy(update={"method": "c2c"})
    moved = (replace(sites[0], high=tuple(x + 0.01 for x in sites[0].high)), *sites[1:])
    quieter = tuple(replace(scan, noise=replace(scan.noise, range=1e-3)) for scan in calls.wish.a)
    for change in (
        {"wish": {"section": limit}},
        {"wish": {"section": nearest}},
        {"wish": {"sites": moved}},
        {"wish": {"sites": sites[:2]}},
        {"wish": {"a": quieter}},
        {"shared": replace(calls.shared, covariance=1.5 * calls.shared.covariance)},
        {"shared": _shifted(calls.shared)},
    ):
        made, chapter = calls.again(**dict(change))
        assert made == 1, change
        made, again = calls.again(**dict(change))
        assert made == 0, change
        assert same(chapter, again)
    assert calls.again()[0] == 1  # the last change is what is remembered


def _shifted(shared: SharedPart) -> SharedPart:
    """One station a tenth of a millimetre elsewhere."""
    scans = {
        name: replace(
            where, pose=Pose(where.pose.rotation, where.pose.translation + 1e-4 * np.eye(3)[0])
        )
        if where.station == "S3"
        else where
        for name, where in shared.scans.items()
    }
    return replace(shared, scans=scans)


def test_points_of_a_scan(second: tuple[Calls, Report]) -> None:
    """A new date of the file changes nothing, one new point does."""
    calls, _ = second
    _, before = calls.again()
    path = calls.wish.a[0].scan.path
    path.touch()
    assert calls.again()[0] == 0
    whole = path.read_bytes()
    las = laspy.read(path)
    las.X[len(las.X) // 2] += 1
    las.write(path)
    made, after = calls.again()
    assert made == 1
    assert not same(before.sites, after.sites)
    path.write_bytes(whole)
    made, back = calls.again()
    assert made == 1
    assert same(before, back)


@pytest.mark.parametrize("harm", ["cut", "other", "packed"])
def test_damaged_records_are_made_anew(second: tuple[Calls, Report], harm: str) -> None:
    calls, _ = second
    _, before = calls.again()
    (path,) = (calls.folder / "out" / ".tribrach").glob("comparison-1-*.json")
    text = path.read_text()
    if harm == "cut":
        write_text(path, text[:-100])
    else:
        data = json.loads(text)
        if harm == "other":
            data["facts"] = {"sites": [{"n": 1}], "offsets": None, "remarks": []}
        else:
            data["facts"]["sites"][0]["c2c"]["sample"]["packed"] = "AAAA"
        write_text(path, json.dumps(data))
    made, after = calls.again()
    assert made == 1
    assert same(before, after)
