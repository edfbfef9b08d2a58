"""Names and poses from distances alone: chains of stations, ties, ambiguity, given names."""

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.geometry import rotation
from tribrach.geometry.pose import Pose
from tribrach.registration.identify import Mounted, Sighting, identify


def upright(heading: float, translation: list[float]) -> Pose:
    return Pose(rotation.exp(np.array([0.0, 0.0, heading])), np.array(translation))


def sees(
    station: str, pose: Pose, points: np.ndarray, rng: np.random.Generator, **more: object
) -> Sighting:
    """A station's view of points, shuffled by the caller, 1 mm noise."""
    centers = pose.inverse @ points + rng.normal(0, 1e-3, points.shape)
    n = len(points)
    return Sighting(station, centers, np.full(n, 1e-3), ["sphere"] * n, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", range(5))
def test_a_chain_of_stations_reaches_the_one_without_control(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform([-30, -30, 0], [30, 30, 8], (14, 3))
    control = {f"C{i}": (points[i], 2e-3) for i in range(5)}
    poses = {
        "S1": upright(0.3, [1.0, 2.0, 1.5]),
        "S2": upright(-2.0, [10.0, -4.0, 1.7]),
        "S3": Pose(rotation.exp(np.array([0.1, 0.2, 2.9])), np.array([-8.0, 9.0, 1.6])),
    }
    views = {
        "S1": rng.permutation([0, 1, 2, 3, 4, 5, 6]),
        "S2": rng.permutation([3, 4, 5, 6, 7, 8, 9, 10]),
        "S3": rng.permutation([7, 8, 9, 10, 11]),
    }
    sightings = [sees(s, poses[s], points[views[s]], rng) for s in ("S3", "S2", "S1")]
    found = identify(sightings, control)
    for station, pose in poses.items():
        assert found.poses[station].translation == pytest.approx(pose.translation, abs=0.02)
        for i, name in zip(views[station], found.names[station], strict=True):
            assert name == f"C{i}" if i < 5 else not name.startswith("C")
    seen = {s: dict(zip(views[s], found.names[s], strict=True)) for s in views}
    assert seen["S1"][5] == seen["S2"][5] != ""
    assert seen["S2"][9] == seen["S3"][9] != ""
    assert seen["S3"][11] == ""  # nobody else saw it
    named = [name for i, name in seen["S2"].items() if i >= 5]
    assert len(set(named)) == len(named)


def test_without_coordinates_one_station_is_the_frame() -> None:
    rng = np.random.default_rng(7)
    points = rng.uniform(-10, 10, (6, 3))
    first, second = upright(0.0, [0, 0, 0]), upright(1.0, [3.0, 1.0, 0.2])
    found = identify([sees("A", first, points, rng), sees("B", second, points[:5], rng)], {})
    assert found.poses["B"].translation == pytest.approx([3.0, 1.0, 0.2], abs=0.01)
    assert found.names["B"] == found.names["A"][:5]


def square() -> np.ndarray:
    return np.array([[5.0, 5, 0], [-5, 5, 0], [-5, -5, 0], [5, -5, 0]])


def test_a_square_is_refused_until_a_target_is_named() -> None:
    rng = np.random.default_rng(8)
    control = {f"C{i}": (x, 1e-3) for i, x in enumerate(square())}
    pose = upright(0.2, [0.5, 0.2, 1.0])
    view = sees("S", pose, square(), rng, levelled=True)
    with pytest.raises(InputError, match="4 targets fit in 4 ways") as refused:
        identify([view], control)
    assert "name one" in str(refused.value)
    named = sees("S", pose, square(), rng, levelled=True, known={0: "C0", 1: "C1"})
    found = identify([named], control)
    assert found.names["S"] == ("C0", "C1", "C2", "C3")


def test_no_place_says_so() -> None:
    rng = np.random.default_rng(9)
    control = {f"C{i}": (x, 1e-3) for i, x in enumerate(rng.uniform(-9, 9, (5, 3)))}
    stranger = sees("S", Pose.identity(), rng.uniform(-9, 9, (5, 3)), rng)
    with pytest.raises(InputError, match="station S cannot be matched"):
        identify([stranger], control)


def test_a_mirrored_list_fits_nowhere() -> None:
    """North and East swapped: no proper motion carries the targets onto it."""
    rng = np.random.default_rng(10)
    points = rng.uniform([-20, -20, 0], [20, 20, 9], (8, 3))
    control = {f"C{i}": (x[[1, 0, 2]], 1e-3) for i, x in enumerate(points)}
    with pytest.raises(InputError, match=r"swapped|mirror"):
        identify([sees("S", Pose.identity(), points, rng)], control)


def test_stations_joined_by_something_else_are_matched_as_one() -> None:
    """Each sees two points, too few to place it, and both together see four."""
    rng = np.random.default_rng(11)
    points = rng.uniform([-20, -20, 0], [20, 20, 6], (6, 3))
    control = {f"C{i}": (points[i], 2e-3) for i in range(6)}
    first, second = upright(0.4, [1.0, 2.0, 1.5]), upright(-1.0, [6.0, -4.0, 1.7])
    sightings = [sees("S1", first, points[[0, 1]], rng), sees("S2", second, points[[1, 2, 4]], rng)]
    group = {"S1": Pose.identity(), "S2": first.inverse @ second}
    found = identify(sightings, control, groups=[group])
    assert found.names["S1"] == ("C0", "C1")
    assert found.names["S2"] == ("C1", "C2", "C4")
    for station, pose in (("S1", first), ("S2", second)):
        assert found.poses[station].translation == pytest.approx(pose.translation, abs=0.02)


def test_a_joined_station_without_targets_is_placed_by_the_others() -> None:
    rng = np.random.default_rng(12)
    points = rng.uniform([-20, -20, 0], [20, 20, 6], (6, 3))
    control = {f"C{i}": (points[i], 2e-3) for i in range(6)}
    first, second = upright(0.4, [1.0, 2.0, 1.5]), upright(-1.0, [6.0, -4.0, 1.7])
    group = {"S1": Pose.identity(), "S2": first.inverse @ second}
    found = identify([sees("S1", first, points[:5], rng)], control, groups=[group])
    assert found.poses["S2"].translation == pytest.approx(second.translation, abs=0.02)


def test_a_wrong_joint_does_not_spoil_what_targets_place() -> None:
    rng = np.random.default_rng(13)
    points = rng.uniform([-20, -20, 0], [20, 20, 6], (12, 3))
    control = {f"C{i}": (points[i], 2e-3) for i in range(12)}
    first, second = upright(0.4, [1.0, 2.0, 1.5]), upright(-1.0, [6.0, -4.0, 1.7])
    sightings = [sees("S1", first, points[:5], rng), sees("S2", second, points[5:10], rng)]
    shifted = first.inverse @ upright(-1.0, [9.0, -4.0, 1.7])
    found = identify(sightings, control, groups=[{"S1": Pose.identity(), "S2": shifted}])
    assert found.poses["S1"].translation == pytest.approx(first.translation, abs=0.02)
    assert found.poses["S2"].translation == pytest.approx(second.translation, abs=0.02)


def test_what_cannot_be_placed_is_left_with_its_reason() -> None:
    rng = np.random.default_rng(14)
    points = rng.uniform([-20, -20, 0], [20, 20, 6], (6, 3))
    control = {f"C{i}": (points[i], 2e-3) for i in range(6)}
    pose = upright(0.4, [1.0, 2.0, 1.5])
    sightings = [sees("S1", pose, points[:5], rng), sees("S2", pose, points[:1], rng)]
    found = identify(sightings, control, partial=True)
    assert set(found.poses) == {"S1"}
    assert "1 targets found and 3 needed" in found.unplaced["S2"].words
    with pytest.raises(InputError, match="S2"):
        identify(sightings, control)


def ring(seed: int, count: int = 20) -> tuple[list[Sighting], list[list[str]]]:
    """Stations on a ring of 60 m, each with the targets within 20 m; centres to 4 mm."""
    rng = np.random.default_rng(seed)
    around = np.linspace(0, 2 * np.pi, 5 * count, endpoint=False)
    spread = rng.uniform(-4, 4, (len(around), 3)) * [1, 1, 0.4]
    targets = np.column_stack([60 * np.cos(around), 60 * np.sin(around), 0 * around]) + spread
    sightings, names = [], []
    for k in range(count):
        turn = 2 * np.pi * (k + 0.5) / count
        at = np.array([60 * np.cos(turn), 60 * np.sin(turn), 1.6])
        r = rotation.exp(np.array([[0.01, 0.02, rng.uniform(-3, 3)]]))[0]
        seen = np.flatnonzero(np.linalg.norm(targets - at, axis=1) < 20)
        local = (targets[seen] - at) @ r + rng.normal(0, 0.004, (len(seen), 3))
        sigmas = np.full(len(seen), 0.004)
        sightings.append(Sighting(f"S{k}", local, sigmas, ["sphere"] * len(seen)))
        names.append([str(i) for i in seen])
    return sightings, names


def test_a_chain_around_a_loop_meets_its_beginning() -> None:
    """Each station adds its error; the last ones see points that came from both sides."""
    for seed in (0, 3):
        sightings, names = ring(seed)
        found = identify(sightings, {}, free=True)
        assert set(found.poses) == {s.station for s in sightings}
        truth: dict[str, set[str]] = {}
        for s, own in zip(sightings, names, strict=True):
            for name, true in zip(found.names[s.station], own, strict=True):
                if name:
                    truth.setdefault(name, set()).add(true)
        assert all(len(which) == 1 for which in truth.values())


ARM = np.array([0.0, 0.0, 0.33])


def carries(pose: Pose, wrong: float = 0.0) -> tuple[Mounted, ...]:
    """An antenna on a station, measured too high by so much."""
    return (Mounted(ARM, pose @ ARM + [0, 0, wrong], 2e-3, 5e-3),)


def test_an_antenna_counts_where_targets_are_too_few() -> None:
    """Two known targets and the antenna; a levelled scanner does with one."""
    rng = np.random.default_rng(15)
    points = rng.uniform([-20, -20, 0], [20, 20, 6], (7, 3))
    control = {f"C{i}": (points[i], 2e-3) for i in range(2)}
    leaning = Pose(rotation.exp(np.array([0.02, -0.03, 1.9])), np.array([1.0, 2.0, 1.5]))
    views = rng.permutation(7)
    found = identify(
        [sees("S", leaning, points[views], rng, mounted=carries(leaning))], control, free=True
    )
    assert not found.adrift
    assert found.names["S"] == tuple(f"C{i}" if i < 2 else "" for i in views)
    assert found.poses["S"].translation == pytest.approx(leaning.translation, abs=0.02)
    assert "placed by 2 of its 7 targets and the antenna" in found.sentences[0]
    flat = upright(1.9, [1.0, 2.0, 1.5])
    view = sees("S", flat, points[views], rng, levelled=True, mounted=carries(flat))
    found = identify([view], {"C0": control["C0"]}, free=True)
    assert found.names["S"] == tuple("C0" if i == 0 else "" for i in views)


def test_a_wrong_antenna_does_not_spoil_what_targets_place() -> None:
    rng = np.random.default_rng(16)
    points = rng.uniform([-20, -20, 0], [20, 20, 6], (5, 3))
    control = {f"C{i}": (x, 2e-3) for i, x in enumerate(points)}
    pose = upright(0.7, [1.0, 2.0, 1.5])
    found = identify([sees("S", pose, points, rng, mounted=carries(pose, 0.1))], control)
    assert found.names["S"] == tuple(control)


def test_stations_joined_by_clouds_are_placed_by_their_antennas() -> None:
    """Three antennas place the model; what targets it shows gets its names then."""
    rng = np.random.default_rng(17)
    points = rng.uniform([-20, -20, 0], [20, 20, 6], (4, 3))
    poses = {
        "S1": upright(0.4, [1.0, 2.0, 1.5]),
        "S2": upright(-1.0, [16.0, -4.0, 1.7]),
        "S3": upright(2.0, [3.0, 14.0, 3.0]),
    }
    group = {name: poses["S1"].inverse @ pose for name, pose in poses.items()}
    sightings = [sees(name, p, points, rng, mounted=carries(p)) for name, p in poses.items()]
    found = identify(sightings, {"C0": (points[0], 2e-3)}, free=True, groups=[group])
    assert not found.adrift
    for name, pose in poses.items():
        assert found.names[name][0] == "C0"
        assert found.poses[name].translation == pytest.approx(pose.translation, abs=0.02)


def test_an_antenna_that_leaves_two_ways_says_so() -> None:
    """Two pairs of targets with the same distances from each other and from the antenna."""
    rng = np.random.default_rng(18)
    pose = upright(0.0, [0.0, 0.0, 0.0])
    points = np.array([[9.0, 3.0, 0.33], [-6.0, 8.0, 0.33], [-9.0, -3.0, 0.33], [6.0, -8.0, 0.33]])
    control = {"C0": (points[0], 2e-3), "C1": (points[1], 2e-3)}
    view = sees("S", pose, points, rng, mounted=carries(pose))
    found = identify([view], control, partial=True)
    assert found.unplaced["S"].words.startswith("2 targets and the antenna fit in 2 ways")
    with pytest.raises(InputError, match="name one of its targets"):
        identify([view], control)
    named = sees("S", pose, points, rng, mounted=carries(pose), known={0: "C0"})
    assert identify([named], control).names["S"] == ("C0", "C1", "", "")


def test_names_that_two_scans_share_place_what_distances_leave_open() -> None:
    """Four targets in a square fit in eight ways; nobody has coordinates of them."""
    square = np.array([[5.0, 0, 0], [0, 5.0, 0], [-5.0, 0, 0], [0, -5.0, 0]])
    names = {0: "P", 1: "Q", 2: "R", 3: "S"}
    turn = rotation.exp(np.array([0.1, -0.2, 1.3]))
    other = [2, 0, 3, 1]
    seen = [
        Sighting("S1", square, np.full(4, 1e-3), ["corner"] * 4, known=names),
        Sighting(
            "S2",
            (square @ turn)[other],
            np.full(4, 1e-3),
            ["corner"] * 4,
            known={i: names[k] for i, k in enumerate(other)},
        ),
    ]
    found = identify(seen, {})
    np.testing.assert_allclose(found.poses["S2"].rotation, turn, atol=1e-6)
    assert len(set(found.names["S2"])) == 4
    assert [found.names["S1"][k] for k in other] == list(found.names["S2"])
