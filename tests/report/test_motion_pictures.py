"""Pictures of motions between clouds, and the table of the stable area."""

from dataclasses import replace

import numpy as np
import pytest

from tests.comparison.test_rigid_motion import ground, joined, observed, wall
from tribrach.comparison.not_compared import ComparedSurface
from tribrach.comparison.rigid_motion import part_motion
from tribrach.questions.compare.chapters import motions_pictures
from tribrach.questions.compare.motions import CloudMotions, ComparedPlaces, MovedPart, StableArea
from tribrach.questions.compare.moved import motions_tables

STILL = np.zeros(6)


@pytest.fixture(scope="module")
def motions() -> CloudMotions:
    """Ground and a wall that stand, and a wall beside it that came 6 mm towards the south."""
    rng = np.random.default_rng(3)
    still = joined(observed(ground(), STILL, rng), observed(wall(-9, -1), STILL, rng))
    shift = np.array([0, -0.006, 0, 0, 0, 0])
    panel = observed(wall(0, 6), shift, rng)
    stable, moved = part_motion(still), part_motion(panel)
    assert stable is not None
    assert moved is not None
    both = joined(still, panel)
    n, m = len(still), len(panel)
    places = ComparedPlaces(
        xyz=both.core,
        normals=both.normals,
        distance=both.values,
        sigma=both.sigma,
        stable=np.arange(n + m) < n,
        part=np.where(np.arange(n + m) < n, 0, 1),
        core=np.arange(n + m),
    )
    limit = moved.limit(0.05)
    assert moved.statistic > limit
    part = MovedPart("1", "moved", 24.0, moved, None, limit, moved.detectable(0.05, 0.8))
    area = StableArea(12, 0.8, 110.0, stable, stable.limit(0.05), stable.detectable(0.05, 0.8))
    return CloudMotions(
        parts=(part,),
        sites=False,
        stable=area,
        patches=15,
        loose=0.0,
        factor=1.0,
        compared=ComparedSurface(150.0, 0.6),
        not_compared=(),
        places=places,
    )


def test_what_moved_is_drawn_with_an_arrow_and_a_name(motions: CloudMotions) -> None:
    distances, parts = motions_pictures(motions)
    assert "Plan and elevation" in distances.caption
    words = str(parts.drawing.marks)
    assert "part 1: moved" in words
    assert "stable area" in words
    # in plan the shift is seen, in the elevation along the wall it comes towards the reader
    assert words.count("line ink") == 2
    assert "times as long as it is" in parts.caption
    still = replace(motions, parts=(replace(motions.parts[0], verdict="no motion found"),))
    quiet = motions_pictures(still)[1]
    assert "times as long" not in quiet.caption
    assert "line ink" not in str(quiet.drawing.marks)


def test_a_wall_alone_has_no_plan(motions: CloudMotions) -> None:
    rows = motions.places.part == 1
    values = {
        name: getattr(motions.places, name)[rows]
        for name in ("xyz", "normals", "distance", "sigma", "stable", "part", "core")
    }
    alone = replace(motions, places=ComparedPlaces(**values))
    first, second = motions_pictures(alone)
    assert first.caption.startswith("Elevation;")
    assert second.drawing.height < 600
    none = {name: value[:1] for name, value in values.items()}
    assert motions_pictures(replace(motions, places=ComparedPlaces(**none))) == []


def test_the_stable_area_has_a_row_with_the_registration(motions: CloudMotions) -> None:
    stable, parts = motions_tables(motions)
    assert (stable.name, parts.name) == ("stable", "motions")
    assert stable.rows[0].cells[-1].text == "passes"
    assert [t.name for t in motions_tables(replace(motions, stable=None))] == ["motions"]
