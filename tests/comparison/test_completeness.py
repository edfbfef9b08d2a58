"""Completeness: cells counted once, seen by whom, sigma of the best station, gaps, memory."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tribrach.errors import InputError
from tribrach.questions.complete import completeness as module
from tribrach.questions.complete.chapters import FORM, answer_of
from tribrach.questions.complete.completeness import (
    PatchGrid,
    SurfacePatches,
    assess_completeness,
    found_in,
)

GRID = PatchGrid(np.zeros(3), 0.1)


def wall(low: float, high: float, pitch: float = 0.02) -> np.ndarray:
    """Points of a wall in the middle of cells in y, from low to high along x, 2 m high."""
    x, z = np.meshgrid(np.arange(low, high, pitch) + pitch / 2, np.arange(0, 2, pitch) + pitch / 2)
    return np.stack([x.ravel(), np.full(x.size, 0.05), z.ravel()], axis=1)


def patches(xyz: np.ndarray, sigma: float | np.ndarray | None = None) -> SurfacePatches:
    out = SurfacePatches()
    variance = None if sigma is None else np.broadcast_to(np.square(sigma), len(xyz)).copy()
    out.add(GRID.keys(xyz), variance)
    out.merge()
    return out


@settings(deadline=None)
@given(st.lists(st.tuples(*[st.integers(-(10**5), 10**5)] * 3), min_size=1, max_size=40))
def test_cells_are_numbered_both_ways(cells: list[tuple[int, int, int]]) -> None:
    grid = PatchGrid(np.array([2.3e6, 5.5e5, 12.0]), 0.05)
    index = np.array(cells)
    centres = grid.origin + (index + 0.5) * grid.size
    keys = grid.keys(centres)
    assert (grid.signed(keys) == index).all()
    assert grid.centres(keys) == pytest.approx(centres, abs=1e-6)
    moved = grid.keys(centres + grid.size * np.array([1, -1, 0]))
    assert (PatchGrid.shifted(keys, (1, -1, 0)) == moved).all()


def test_chunks_give_what_one_gives(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_WAITING", 50)
    rng = np.random.default_rng(1)
    xyz, sigma = rng.uniform(-2, 2, (5000, 3)), rng.uniform(1e-3, 5e-3, 5000)
    once = patches(xyz, sigma)
    parts = SurfacePatches()
    for k in range(0, 5000, 137):
        parts.add(GRID.keys(xyz[k : k + 137]), sigma[k : k + 137] ** 2)
    parts.merge()
    assert (parts.keys == once.keys).all()
    assert (parts.counts == once.counts).all()
    assert parts.sums == pytest.approx(once.sums)
    assert once.counts.sum() == 5000


def test_too_many_cells_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST", 100)
    with pytest.raises(InputError, match="take larger ones"):
        patches(np.random.default_rng(1).uniform(-5, 5, (500, 3)))


def test_points_far_apart_are_refused() -> None:
    with pytest.raises(InputError, match="105 km apart"):
        GRID.keys(np.array([[2e5, 0.0, 0.0]]))


def test_found_in() -> None:
    keys = np.array([2, 5, 9])
    assert found_in(keys, np.array([5, 4, 10, 2, 1])).tolist() == [1, -1, -1, 0, -1]
    assert found_in(np.zeros(0, dtype=np.int64), keys).tolist() == [-1, -1, -1]


def test_shares_of_a_wall() -> None:
    """10 m of wall: the first six metres from A, the last six from B, of which two from both."""
    both = {"A": patches(wall(0, 6)), "B": patches(wall(4, 10))}
    found = assess_completeness(GRID, both)
    assert len(found.seen) == 100 * 20
    assert found.seen_by == {
        "no station": 0,
        "one station": (40 + 40) * 20,
        "two stations": 20 * 20,
        "three and more": 0,
    }
    assert found.area == pytest.approx(20, rel=2e-3)
    assert found.area_seen_by["two stations"] == pytest.approx(4, rel=2e-3)
    assert found.stations["A"] == pytest.approx(0.6, abs=1e-3)
    assert [gap.cells for gap in found.gaps.one_station] == [40 * 20, 40 * 20]
    assert found.gaps.one_station[0].area == pytest.approx(8, rel=2e-3)
    assert found.gaps.one_station[0].extent == pytest.approx((4.0, 0.1, 2.0))
    assert found.gaps.one_station[0].middle == pytest.approx((2.0, 0.05, 1.0))
    assert [one.key for one in answer_of("wall", found).findings] == ["seen", "no_model"]


def test_a_model_shows_what_nobody_saw() -> None:
    stations = {"A": patches(wall(0, 6)), "B": patches(wall(4, 8))}
    found = assess_completeness(GRID, stations, model=patches(wall(0, 10)))
    assert found.seen_by["no station"] == 20 * 20
    assert found.area_seen_by["no station"] == pytest.approx(4, rel=2e-3)
    (gap,) = found.gaps.no_station
    assert gap.middle[0] == pytest.approx(9)
    assert [one.key for one in answer_of("wall", found).findings] == ["seen"]
    assert FORM.data(found)["surface"] == "model"


def test_noise_across_a_border_of_cells_hides_nothing() -> None:
    rng = np.random.default_rng(3)
    stations = {}
    for name, side in (("A", 1), ("B", -1)):
        xyz = wall(0, 5)
        # A sees the wall just in front of the border of two layers, B just behind
        xyz[:, 1] = 0.1 + side * np.abs(rng.normal(0, 0.002, len(xyz)))
        stations[name] = patches(xyz)
    found = assess_completeness(GRID, stations)
    assert found.seen_by["one station"] == 0


def test_stray_points_are_no_surface() -> None:
    stations = {"A": patches(np.vstack([wall(0, 1), [[50.0, 50.0, 50.0]]]))}
    assert len(assess_completeness(GRID, stations).seen) == 10 * 20


def test_sigma_is_that_of_the_best_station() -> None:
    stations = {
        "A": patches(wall(0, 6), 0.004),
        "B": patches(wall(4, 10), 0.008),
        "C": patches(wall(0, 1)),
    }
    found = assess_completeness(GRID, stations, required=0.005)
    assert np.unique(np.round(found.sigmas, 9)).tolist() == [0.004, 0.008]
    assert found.sigma == {"reached": 60 * 20, "not reached": 40 * 20, "unknown": 0}
    assert found.gaps.sigma_not_reached[0].cells == 40 * 20
    told = answer_of("wall", found).findings[-1]
    assert told.key == "sigma_reached"
    assert told.values["reached"] == pytest.approx(0.6, abs=1e-3)
    nothing = assess_completeness(GRID, {"C": patches(wall(0, 1))}, required=0.005)
    assert nothing.sigma == {"reached": 0, "not reached": 0, "unknown": 200}


def test_many_points_do_not_make_a_sigma_small() -> None:
    few, many = patches(wall(0, 1, 0.05), 0.003), patches(wall(0, 1, 0.01), 0.003)
    for one in (few, many):
        sigma = assess_completeness(GRID, {"A": one}).sigmas
        assert sigma == pytest.approx(0.003)


def turned(about_z: float, about_y: float) -> np.ndarray:
    c, s, d, t = np.cos(about_z), np.sin(about_z), np.cos(about_y), np.sin(about_y)
    upright = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return np.asarray(upright @ np.array([[d, 0, t], [0, 1, 0], [-t, 0, d]]))


@pytest.mark.parametrize("size", [0.05, 0.1, 0.2])
@pytest.mark.parametrize("angles", [(0.0, 0.0), (0.4, 0.0), (0.3, 0.5), (0.7, 0.7)])
def test_shares_are_those_of_the_shadows(size: float, angles: tuple[float, float]) -> None:
    """A board before a floor of 8 by 6 m, seen from two stations, of clouds alone.

    The cells were not right: 0.40 to 0.48 of it seen by one station only, where 0.49 is.
    """
    rng = np.random.default_rng(1)
    frame, grid = turned(*angles), PatchGrid(np.array([0.013, 0.02, 0.0]), size)

    def seen(xyz: np.ndarray, scanner: np.ndarray) -> np.ndarray:
        at = xyz + ((1.5 - xyz[:, 2]) / (scanner[2] - xyz[:, 2]))[:, None] * (scanner - xyz)
        return ~((np.abs(at[:, 0] - 3.75) < 1.25) & (np.abs(at[:, 1] - 3.0) < 1.0))

    scanners = np.array([[2.0, 1.0, 4.0], [6.0, 5.0, 4.0]])
    floor = rng.uniform([0, 0, 0], [8, 6, 0], (200_000, 3))
    number = np.sum([seen(floor, scanner) for scanner in scanners], axis=0)
    stations = {}
    for k, scanner in enumerate(scanners):
        xyz = rng.uniform([0, 0, 0], [8, 6, 0], (100_000, 3))
        xyz = xyz[seen(xyz, scanner)]
        xyz[:, 2] += rng.normal(0, 0.002, len(xyz))
        stations[str(k)] = SurfacePatches()
        stations[str(k)].add(grid.keys(xyz @ frame.T))
        stations[str(k)].merge()
    found = assess_completeness(grid, stations)
    one = (number == 1).sum() / (number > 0).sum()
    assert found.area_seen_by["one station"] / found.area == pytest.approx(one, abs=0.03)
    assert found.area == pytest.approx(48 * (number > 0).mean(), rel=0.05)
