"""Pairs of many scans: neighbours come first, no connection is lost, bare pairs get their loops."""

from collections.abc import Callable
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from tests.registration.clouds.scenes import error, scanned, yard_scans
from tests.registration.clouds.streets import street, sweeps
from tribrach._types import Array
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.io.scans.formats import read_scans
from tribrach.registration.clouds import proposals
from tribrach.registration.clouds.graph import CloudEdge, consistent, groups
from tribrach.registration.clouds.likeness import Walls, likeness
from tribrach.registration.clouds.prepared import PreparedScan, prepare
from tribrach.registration.clouds.proposals import (
    Attempt,
    common_area,
    promise_of,
    try_all,
    try_proposed,
)
from tribrach.registration.clouds.together import pairwise, settled
from tribrach.scan.no_return import screened

SIGMA = np.repeat([1e-3, 5e-5], 3)


class Field:
    """Stations in the plane; pairs nearer than the reach have a relative pose, others none."""

    def __init__(self, seed: int, count: int, width: float, reach: float = 15.0) -> None:
        self.rng = np.random.default_rng(seed)
        place = np.column_stack([self.rng.uniform(0, width, (count, 2)), np.zeros(count)])
        self.names = [f"S{k:02d}" for k in range(count)]
        turns = self.rng.uniform(-3, 3, count)
        self.poses = {
            n: Pose(exp(np.array([0.0, 0.0, h])), p)
            for n, h, p in zip(self.names, turns, place, strict=True)
        }
        self.distance = np.linalg.norm(place[:, None] - place[None], axis=2)
        self.reach = reach
        self.radii = dict.fromkeys(self.names, reach)
        self.tried: list[tuple[str, str]] = []
        self.wrong: set[frozenset[str]] = set()

    def joined(self) -> Array:
        """Which stations overlap (n, n)."""
        return (self.distance < self.reach) & ~np.eye(len(self.names), dtype=bool)

    def promise(self, noise: float) -> Array:
        """Near pairs promise more, but for noise."""
        n = len(self.names)
        some = np.triu(self.rng.normal(0, noise, (n, n)), 1)
        return np.clip(np.exp(-self.distance / self.reach) + some + some.T, 0, None)

    def attempt(self) -> Attempt:
        """A registration that takes every pair that overlaps and no other."""
        joined = self.joined()

        def work(a: str, b: str) -> tuple[CloudEdge | None, int]:
            self.tried.append((a, b))
            i, j = self.names.index(a), self.names.index(b)
            if not joined[i, j]:
                return None, 0
            off = self.rng.normal(0, SIGMA)
            if {a, b} in self.wrong:
                off = off + np.array([0.0, 4.0, 0.0, 0.0, 0.0, 0.0])
            true = self.poses[a].inverse @ self.poses[b]
            pose = Pose(true.rotation @ exp(off[3:]), true.translation + off[:3])
            return CloudEdge(a, b, pose, np.diag(SIGMA**2)), 6

        return work


def edges_of(field: Field, search: Callable[[Attempt], None]) -> list[CloudEdge]:
    """The edges that a way of trying pairs finds."""
    found: list[CloudEdge] = []
    attempt = field.attempt()

    def noted(a: str, b: str) -> tuple[CloudEdge | None, int]:
        edge, held = attempt(a, b)
        found.extend([] if edge is None else [edge])
        return edge, held

    search(noted)
    return found


def parts(field: Field, edges: list[CloudEdge]) -> set[frozenset[str]]:
    """Groups of stations that hang together."""
    return {frozenset(g) for g in groups(field.names, edges)}


@pytest.mark.parametrize("noise", [0.05, 0.3, 3.0])
def test_no_connection_is_lost(noise: float) -> None:
    """Whatever the promise is worth; sparse fields fall into groups, by an independent count."""
    tried, every = 0, 0
    for seed in range(25):
        field = Field(seed, 14, 70.0)
        promise = field.promise(noise)
        edges = edges_of(field, lambda a, f=field, p=promise: try_proposed(f.names, p, f.radii, a))
        count, label = connected_components(csr_array(field.joined()))
        truth = {frozenset(np.array(field.names)[label == k].tolist()) for k in range(count)}
        assert parts(field, edges) == truth
        assert len(field.tried) == len(set(field.tried))
        tried += len(field.tried)
        every += 14 * 13 // 2
    assert tried <= every


def test_pairs_grow_with_the_scans_and_not_with_their_square() -> None:
    """In fields that hang together, with a promise that is right in the main."""
    share = {}
    for count in (12, 48):
        field = Field(5, count, 6.0 * np.sqrt(count))
        promise = field.promise(0.05)
        edges = edges_of(field, lambda a, f=field, p=promise: try_proposed(f.names, p, f.radii, a))
        assert len(parts(field, edges)) == 1
        share[count] = len(field.tried) / count
    assert share[48] < 3.5
    assert share[48] < 1.5 * share[12]


def test_every_pair_that_can_gets_a_loop_and_most_a_short_one() -> None:
    can, short = 0, 0
    for seed in range(10):
        field = Field(100 + seed, 16, 40.0)
        promise = field.promise(0.1)
        edges = edges_of(field, lambda a, f=field, p=promise: try_proposed(f.names, p, f.radii, a))
        found = consistent(edges)
        looped = {e.ends for loop in found.loops for e in loop.edges}
        held = {e.ends for loop in found.loops if len(loop.stations) <= 4 for e in loop.edges}
        joined = field.joined()
        for e in found.used:
            i, j = field.names.index(e.first), field.names.index(e.second)
            if (joined[i] & joined[j]).any():
                assert e.ends in looped, e.name
                can += 1
                short += e.ends in held
    assert can > 200
    assert short >= 0.98 * can


def test_a_wrong_pair_is_found_by_the_loops_that_are_sought() -> None:
    """The pair that promises most is wrong by 4 m: it goes, and the rest stays in one piece."""
    for seed in range(10):
        field = Field(200 + seed, 12, 28.0)
        promise = field.promise(0.05)
        i, j = np.unravel_index(np.argmax(np.where(field.joined(), promise, 0)), promise.shape)
        bad = frozenset((field.names[i], field.names[j]))
        field.wrong = {bad}
        edges = edges_of(field, lambda a, f=field, p=promise: try_proposed(f.names, p, f.radii, a))
        found = consistent(edges)
        assert bad in {e.ends for e in found.dropped}
        assert parts(field, list(found.used)) == {frozenset(field.names)}


def test_a_group_of_its_own_is_tried_against_all_others() -> None:
    """A scan that overlaps nothing costs its pairs once, and no more."""
    field = Field(3, 10, 20.0)
    field.distance[:, 9] = field.distance[9, :] = 1000.0
    promise = np.exp(-field.distance / field.reach)
    edges = edges_of(field, lambda a: try_proposed(field.names, promise, field.radii, a))
    assert {len(p) for p in parts(field, edges)} == {9, 1}
    assert sum("S09" in pair for pair in field.tried) == 9


def test_common_area_of_circles() -> None:
    """Closed forms: inside, apart, two equal circles at a distance of one radius."""
    third = (2 * np.pi / 3 - np.sqrt(3) / 2) / np.pi
    distance = np.array([0.0, 0.5, 3.1, 1.0])
    first, second = np.array([2.0, 2.0, 2.0, 1.0]), np.ones(4)
    np.testing.assert_allclose(common_area(distance, first, second), [1, 1, 0, third], atol=1e-12)
    np.testing.assert_allclose(common_area(distance, second, first), [1, 1, 0, third], atol=1e-12)


def test_approximate_poses_put_what_is_out_of_reach_last() -> None:
    names = ["A", "B", "C", "D"]
    alike = np.full((4, 4), 0.5)
    alike[0, 2] = alike[2, 0] = 1.0
    poses = {
        n: Pose(np.eye(3), np.array([x, 0.0, 0.0])) for n, x in zip("ABC", (0, 8, 200), strict=True)
    }
    promise = promise_of(names, alike, dict.fromkeys(names, 20.0), poses, 0.25)
    assert promise[0, 1] > 10 * promise[0, 2]
    assert promise[0, 3] == alike[0, 3]
    # poses that are known to a hundred metres decide little
    vague = promise_of(names, alike, dict.fromkeys(names, 20.0), poses, 100.0)
    assert vague[0, 2] > 0.5 * vague[0, 1]


def test_plans_of_neighbours_are_alike_however_they_are_turned() -> None:
    """Three scans of one yard against two of a street, all with headings of their own."""
    yard, _ = yard_scans()
    scene = street(7, 60.0)
    other, _ = scanned(scene, ((10.0, 0.0, 0.5), (15.0, 0.3, -2.0)), points=40_000, seed=4)
    alike = likeness([Walls.of(scan) for scan in (*yard, *other)])
    np.testing.assert_allclose(alike, alike.T)
    assert (np.diag(alike) == 0).all()
    same = [alike[0, 1], alike[0, 2], alike[1, 2], alike[3, 4]]
    assert min(same) > alike[:3, 3:].max()


def registered(scans: list[PreparedScan], poses: list[Pose], chain: bool) -> int:
    """Register by proposed pairs; all are joined and right; the number of pairs tried."""
    pairs = pairwise(scans)
    found = settled(scans, pairs)
    (group,) = found.groups
    first = poses[int(group.stations[0])]
    for name, pose in group.poses.items():
        assert error(pose, first.inverse @ poses[int(name)])[0] < 5e-3
    assert found.consistency.dropped == ()
    if chain:
        ends = {frozenset((p.a, p.b)) for p in pairs if p.fit}
        assert {frozenset((f"{k:06d}", f"{k + 1:06d}")) for k in range(len(scans) - 1)} <= ends
    return len(pairs)


def test_sweeps_of_a_street(monkeypatch: pytest.MonkeyPatch) -> None:
    """Five sweeps, with the rule for many scans: neighbours are found, not told."""
    monkeypatch.setattr(proposals, "GATES", proposals.ProposalGates(all_pairs=2))
    scans, poses = sweeps(5, 31, points=15_000)
    assert registered(scans, poses, chain=True) <= 9


@pytest.mark.slow
def test_sixteen_sweeps_take_less_than_three_times_the_pairs_that_matter() -> None:
    """120 pairs could be tried; 15 join the street."""
    scans, poses = sweeps(16, 32)
    assert registered(scans, poses, chain=True) < 45


@pytest.mark.data
def test_real_street_loses_nothing(shared_data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Four sweeps: all six pairs where they are few; by the rule for many all hang together."""
    files = sorted((shared_data / "scans" / "street").glob("*.pcd"))
    scans = []
    for path in files:
        (scan,) = (screened(s) for s in read_scans(path))
        scans.append(prepare(scan.name, (chunk.xyz for chunk in scan.chunks())))
    every = pairwise(scans)
    assert [p.fit is not None for p in every] == [True] * 6
    whole = settled(scans, every)
    assert len(whole.groups) == 1
    assert all(loop.closes for loop in whole.consistency.loops)
    monkeypatch.setattr(proposals, "GATES", proposals.ProposalGates(all_pairs=2))
    few = settled(scans, pairwise(scans))
    (one,), (other,) = few.groups, whole.groups
    for name in one.stations:
        assert error(one.poses[name], other.poses[name])[0] < 0.02


def test_all_pairs_are_tried_where_that_is_wanted() -> None:
    field = Field(1, 9, 20.0)
    edges_of(field, lambda a: try_all(field.names, a))
    assert field.tried == list(combinations(field.names, 2))
