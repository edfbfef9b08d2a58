"""Motions of parts, drawn with their errors: estimates, covariances, what is unseen."""

import numpy as np
import pytest
from scipy import stats

from tests.comparison.two_stations import ORIGIN, PLACES, joint_covariance, pair
from tribrach.comparison.not_compared import REASONS, areas_without
from tribrach.comparison.rigid_motion import (
    COMPONENTS,
    PlaceDistances,
    components,
    face_axes,
    part_motion,
    relative_motion,
)
from tribrach.comparison.station_pair import along_normals
from tribrach.comparison.surface_patches import moving_parts, patches_of, stable_patches
from tribrach.questions.compare.motions import _found, _stable_area

Array = np.ndarray

NOISE = 3e-4
OUT, TILT, TURN = COMPONENTS.index("out"), COMPONENTS.index("tilt"), COMPONENTS.index("turn")


def wall(west: float, east: float, height: float = 4.0, step: float = 0.5) -> tuple[Array, Array]:
    """Places on a wall that faces south, and their normals."""
    e, u = np.meshgrid(np.arange(west, east, step), np.arange(0.25, height, step))
    xyz = np.stack([e.ravel(), np.full(e.size, 5.0), u.ravel()], axis=1)
    return ORIGIN + xyz, np.tile([0.0, -1.0, 0.0], (len(xyz), 1))


def ground() -> tuple[Array, Array]:
    e, n = np.meshgrid(np.arange(-10.0, 10.0, 0.5), np.arange(-4.0, 4.0, 0.5))
    xyz = np.stack([e.ravel(), n.ravel(), np.zeros(e.size)], axis=1)
    return ORIGIN + xyz, np.tile([0.0, 0.0, 1.0], (len(xyz), 1))


def observed(
    surface: tuple[Array, Array], moved: Array, rng: np.random.Generator, error: Array | None = None
) -> PlaceDistances:
    """Distances with the motion (6,) of the whole about the origin, noise, and station errors."""
    core, normals = surface
    true = along_normals(core, normals, ORIGIN) @ moved
    found = PlaceDistances(
        core, normals, true, np.full(len(core), NOISE), np.zeros(len(core), np.int64), pair()
    )
    drawn = true + NOISE * rng.normal(size=len(core))
    if error is not None:
        drawn = drawn + found.by_stations @ error
    return PlaceDistances(core, normals, drawn, found.sigma, found.site, found.pair)


def joined(*several: PlaceDistances) -> PlaceDistances:
    columns = ("core", "normals", "values", "sigma", "site")
    arrays = (np.concatenate([getattr(d, name) for d in several]) for name in columns)
    return PlaceDistances(*arrays, pair=several[0].pair)


def test_a_wall_that_tilts_about_its_foot() -> None:
    """2 mm/m towards the south: 4 mm at the middle of a wall of 4 m, its upper end outwards."""
    core, normals = wall(0, 6)
    exact = PlaceDistances(
        core,
        normals,
        0.002 * (core[:, 2] - ORIGIN[2]),
        np.full(len(core), NOISE),
        np.zeros(len(core), np.int64),
        pair(),
    )
    found = part_motion(exact)
    assert found is not None
    assert found.values[OUT] == pytest.approx(0.004, abs=1e-12)
    assert found.values[TILT] == pytest.approx(0.002, abs=1e-12)
    assert found.values[TURN] == pytest.approx(0.0, abs=1e-12)
    # what moves it within its face leaves every distance as it was
    assert list(found.seen) == [True, False, False, True, True, False]
    assert found.dof == 3
    assert np.isnan(found.values[[1, 2, 5]]).all()


def test_axes_of_faces() -> None:
    assert face_axes(np.array([0.0, -1.0, 0.0])) == pytest.approx(
        np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    )
    assert face_axes(np.array([0.0, 0.0, 1.0])) == pytest.approx(
        np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    )
    # of ground the tilt is its north end up
    core, normals = ground()
    rows = components(core, normals, ORIGIN, face_axes(np.array([0.0, 0.0, 1.0])))
    assert rows[:, TILT] == pytest.approx(core[:, 1] - ORIGIN[1], abs=1e-9)
    assert rows[:, TURN] == pytest.approx(core[:, 0] - ORIGIN[0], abs=1e-9)


def test_motions_and_their_differences_scatter_as_stated() -> None:
    """Against control and against a stable part, chi-square with bounds that 1 in 1,000 fails."""
    rng = np.random.default_rng(8)
    moved = np.array([0.001, -0.008, 0.0, 0.0015, 0.0, 0.0005])
    still, part, sums, draws = joined, wall(2, 8), np.zeros(3), 150
    for _ in range(draws):
        error = rng.multivariate_normal(np.zeros(12), joint_covariance())
        stable = still(
            observed(wall(-10, 2), np.zeros(6), rng, error),
            observed(ground(), np.zeros(6), rng, error),
        )
        some = observed(part, moved, rng, error)
        fixed, found = part_motion(stable), part_motion(some)
        assert fixed is not None
        assert found is not None
        relative = relative_motion(some, found, fixed)
        assert relative is not None
        true = found.solver @ (along_normals(*part, ORIGIN) @ moved)[found.kept]
        for k, (one, expected) in enumerate(((found, true), (relative, true), (fixed, 0.0))):
            off = one.parameters - expected
            sums[k] += float(off @ np.linalg.solve(one.cofactor, off))
        # both registrations cancel but for their own points
        assert np.trace(relative.cofactor) < 0.05 * np.trace(found.cofactor)
    for total, rank in zip(sums, (3, 3, fixed.dof), strict=True):
        low, high = stats.chi2.ppf([0.0005, 0.9995], rank * draws)
        assert low < total < high


def test_distances_that_do_not_go_along_are_left_out_and_counted() -> None:
    rng = np.random.default_rng(4)
    some = observed(wall(0, 6), np.zeros(6), rng)
    some.values[:6] += 0.02
    found = part_motion(some)
    assert found is not None
    assert found.left_out == 6
    assert found.statistic < found.limit(0.001)
    few = observed(wall(0, 6), np.zeros(6), rng).some(np.arange(3))
    assert part_motion(few) is None


def test_what_would_have_been_found_is_found_so_often() -> None:
    """A shift of the detectable size fails its test in 80 of 100, within four of their sigmas."""
    rng = np.random.default_rng(6)
    part, hits, draws = wall(0, 6), 0, 300
    first = part_motion(observed(part, np.zeros(6), rng))
    assert first is not None
    shift = first.detectable(0.05, 0.8)
    for _ in range(draws):
        error = rng.multivariate_normal(np.zeros(12), joint_covariance())
        found = part_motion(observed(part, np.array([0, -shift, 0, 0, 0, 0]), rng, error))
        assert found is not None
        hits += found.statistic > found.limit(0.05)
    assert abs(hits / draws - 0.8) < 4 * np.sqrt(0.8 * 0.2 / draws)


def test_stable_area_and_a_part_that_moved_are_found_by_themselves() -> None:
    """Whatever the registration is wrong by: it is only tested afterwards."""
    rng = np.random.default_rng(9)
    shift = np.array([0.0, -0.006, 0.0, 0.0, 0.0, 0.0])
    for bad in (0.0, 0.02):
        error = np.zeros(12)
        error[7] = bad
        whole = joined(
            observed(wall(-10, 2), np.zeros(6), rng, error),
            observed(ground(), np.zeros(6), rng, error),
            observed(wall(2, 8), shift, rng, error),
        )
        patches = patches_of(whole, 0.5)
        stable = stable_patches(patches)
        assert stable is not None
        on_part = (whole.core[:, 0] > ORIGIN[0] + 1.99) & (whole.normals[:, 1] < -0.5)
        assert not on_part[np.isin(patches.of, np.flatnonzero(stable))].any()
        assert patches.count[stable].sum() > 0.75 * (~on_part).sum()
        fixed = part_motion(whole.some(np.isin(patches.of, np.flatnonzero(stable))))
        assert fixed is not None
        # an error of the registration of 20 mm is one of the registration, not a motion
        assert (fixed.statistic > fixed.limit(0.001)) == (bad > 0)
        parts = moving_parts(patches, stable)
        assert len(parts) == 1
        rows = np.isin(patches.of, parts[0])
        assert on_part[rows].all()
        assert rows.sum() > 0.7 * on_part.sum()
        found = part_motion(whole.some(rows))
        assert found is not None
        relative = relative_motion(whole.some(rows), found, fixed)
        assert relative is not None
        assert relative.values[OUT] == pytest.approx(0.006, abs=3e-4)


def test_neighbours_that_move_apart_are_never_one_part() -> None:
    rng = np.random.default_rng(10)
    up, back = np.array([0, -0.006, 0, 0, 0, 0]), np.array([0, 0.004, 0, 0, 0, 0])
    whole = joined(
        observed(wall(-10, 2), np.zeros(6), rng),
        observed(ground(), np.zeros(6), rng),
        observed(wall(2, 5), up, rng),
        observed(wall(5, 8), back, rng),
    )
    patches = patches_of(whole, 0.5)
    stable = stable_patches(patches)
    assert stable is not None
    outs = []
    for part in moving_parts(patches, stable):
        # a patch across the border of both may be one by itself
        if len(part) < 2:
            continue
        found = part_motion(whole.some(np.isin(patches.of, part)))
        assert found is not None
        outs.append(round(1e3 * float(found.values[OUT])))
    assert set(outs) == {-4, 6}


def told(*walls):
    """Verdicts on the parts that are found beside a wall and ground that stay."""
    rng = np.random.default_rng(14)
    still = [observed(surface, np.zeros(6), rng) for surface in (wall(-10, 2), ground())]
    whole = joined(*still, *(observed(surface, moved, rng) for surface, moved in walls))
    patches = patches_of(whole, 0.5)
    stable = stable_patches(patches)
    area = _stable_area(whole, patches, stable, 0.5)
    parts, number = _found(whole, patches, stable, area, 0.5)
    assert number.max() == len(parts)
    return [part.verdict for part in parts]


def test_pieces_that_tilt_towards_each_other_are_one_that_bends() -> None:
    """A ridge of 12 mm over 6 m; the same two pieces with a step between them are two."""
    tilt = 4e-3
    up = np.array([0, 2 * tilt, 0, 0, 0, -tilt])
    down = np.array([0, -8 * tilt, 0, 0, 0, tilt])
    assert told((wall(2, 5), up), (wall(5, 8), down)).count("bends") == 1
    assert "moved" not in told((wall(2, 5), up), (wall(5, 8), down))
    apart = down - [0, 0.03, 0, 0, 0, 0]
    assert told((wall(2, 5), up), (wall(5, 8), apart)).count("moved") == 2


@pytest.mark.parametrize("out", [0.0015, 0.003])
def test_panels_beside_each_other_are_no_bend(out: float) -> None:
    one, two = np.array([0, -out, 0, 0, 0, 0]), np.array([0, out, 0, 0, 0, 0])
    found = told((wall(2, 5), one), (wall(5, 8), two))
    assert len(found) == 2
    assert "bends" not in found


def test_no_stable_area_where_less_than_half_agrees() -> None:
    """Four walls, each with a shift of its own."""
    rng = np.random.default_rng(12)
    several = [
        observed(wall(6 * k, 6 * k + 6), np.array([0, 0.01 * k, 0, 0, 0, 0]), rng) for k in range(4)
    ]
    patches = patches_of(joined(*several), 0.5)
    assert stable_patches(patches) is None
    assert stable_patches(patches_of(several[0].some(np.arange(3)), 0.5)) is None


def test_areas_without_a_comparison_add_up() -> None:
    places = np.array([[k, 0.0, 0.0] for k in range(10)]) + PLACES[0]
    why = np.array([-1, -1, -1, -1, 0, 0, 1, 1, 1, 3])
    found, reasons = areas_without(places, why, 1.0, places[:2] + 50)
    assert found.share == pytest.approx(4 / 12)
    assert [r.words for r in reasons] == [REASONS[k] for k in (0, 1, 3, 4)]
    assert found.share + sum(r.share for r in reasons) == pytest.approx(1.0)
    assert [r.area for r in reasons] == [2, 3, 1, 2]
    assert reasons[1].places[0].middle == pytest.approx(places[7])
    assert reasons[1].places[0].extent == pytest.approx((3, 1, 1))
