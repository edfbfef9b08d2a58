"""Slips that surveyors make are named before a sight is blamed, and nobody innocent is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.network.networks import free_stations
from tribrach.errors import TribrachError
from tribrach.io.survey.formats import read_files
from tribrach.network.adjustment import adjust
from tribrach.network.blunders.control_mistakes import wrong_coordinate
from tribrach.network.blunders.gross import explain
from tribrach.network.blunders.slip_search import Slip
from tribrach.network.network import Datum, Network
from tribrach.network.survey import Survey, observed_part
from tribrach.observations.base import Observations, Use
from tribrach.observations.control import Coordinates
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.sights import (
    Angles,
    Directions,
    HorizontalDistances,
    SlopeDistances,
    ZenithAngles,
)
from tribrach.units import SEC

#: standard deviations of angles [rad] and distances [m]
SIGMA_ANGLE, SIGMA_DISTANCE = 5 * SEC, 0.005


def plan(rng: np.random.Generator, *, directions: bool = False) -> Network:
    """Three held points and five new ones in 500 m, all angles between neighbours, distances."""
    places = {f"K{k}": rng.uniform(0, 500, 2) for k in range(3)}
    while min(
        np.linalg.norm(a - b) for i, a in places.items() for j, b in places.items() if i < j
    ) < 150:  # fmt: skip
        places = {f"K{k}": rng.uniform(0, 500, 2) for k in range(3)}
    places |= {f"N{k}": rng.uniform(0, 500, 2) for k in range(5)}
    survey = Survey(datum=Datum("control"))
    for name, (e, n) in places.items():
        held = name.startswith("K")
        place = (e, n, 0.0) if held else (np.nan, np.nan, 0.0)
        role = "control" if held else "free"
        survey.point(name, place, free=(not held, not held, False), role=role)
    angles: list[tuple[str, str, str, float]] = []
    sights: list[tuple[str, str, float]] = []
    for at, place in places.items():
        others = sorted(places.keys() - {at}, key=lambda n: np.linalg.norm(places[n] - place))[:4]
        azimuths = [np.arctan2(*(places[n] - place)) for n in others]
        sights += [(at, n, a) for n, a in zip(others, azimuths, strict=True)]
        angles += [
            (at, others[0], n, (a - azimuths[0]) % (2 * np.pi))
            for n, a in zip(others[1:], azimuths[1:], strict=True)
        ]
    if directions:
        start, end, value = (list(c) for c in zip(*sights, strict=True))
        turn = dict(zip(places, rng.uniform(0, 2 * np.pi, len(places)), strict=True))
        noisy = [
            (v - turn[s] + rng.normal(0, SIGMA_ANGLE)) % (2 * np.pi)
            for s, v in zip(start, value, strict=True)
        ]
        survey.add(Directions, values=noisy, sigma=SIGMA_ANGLE, start=start, end=end,
                   orientation=[f"o {s}" for s in start])  # fmt: skip
    else:
        at, back, to, value = (list(c) for c in zip(*angles, strict=True))
        noisy = (np.array(value) + rng.normal(0, SIGMA_ANGLE, len(value))) % (2 * np.pi)
        survey.add(Angles, values=noisy, sigma=SIGMA_ANGLE, start=at, end=back, foresight=to)
    pairs = sorted({tuple(sorted((s, e))) for s, e, _ in sights})
    length = [np.linalg.norm(places[a] - places[b]) for a, b in pairs]
    survey.add(
        HorizontalDistances,
        values=np.array(length) + rng.normal(0, SIGMA_DISTANCE, len(length)),
        sigma=SIGMA_DISTANCE,
        start=[a for a, _ in pairs],
        end=[b for _, b in pairs],
    )
    return survey.network()


def edited(network: Network, kind: type[Observations], edit: Callable[..., np.ndarray]) -> Network:
    """The network with other values of a kind: ``edit(observations)`` gives them."""
    observations = tuple(
        replace(o, values=edit(o)) if isinstance(o, kind) else o for o in network.observations
    )
    return replace(network, observations=observations)


def found(network: Network) -> Slip | None:
    """What is found, whether the network can be adjusted or not."""
    try:
        adjustment = adjust(network)
    except TribrachError:
        return explain(network)
    return explain(adjustment.network, adjustment)


def ends_exchanged(rng: np.random.Generator) -> tuple[Network, str, set[int]]:
    clean = plan(rng)
    values = next(o for o in clean.observations if isinstance(o, Angles)).values[:, 0]
    # an angle that is nearly a half circle is the same either way
    clear = np.flatnonzero(np.abs(np.sin(values)) > 0.1)
    item = int(rng.choice(clear))

    def edit(o: Observations) -> np.ndarray:
        new = o.values.copy()
        new[item] = 2 * np.pi - new[item]
        return new

    return edited(clean, Angles, edit), "angle_ends", {item}


def two_ends_exchanged(rng: np.random.Generator) -> tuple[Network, str, set[int]]:
    clean, _, items = ends_exchanged(rng)
    values = next(o for o in clean.observations if isinstance(o, Angles)).values[:, 0]
    clear = np.flatnonzero(np.abs(np.sin(values)) > 0.1)
    other = int(rng.choice(clear[clear != next(iter(items))]))

    def edit(o: Observations) -> np.ndarray:
        new = o.values.copy()
        new[other] = 2 * np.pi - new[other]
        return new

    return edited(clean, Angles, edit), "angle_ends", items | {other}


def all_the_other_way(rng: np.random.Generator) -> tuple[Network, str, set[int]]:
    directions = bool(rng.integers(2))
    kind = Directions if directions else Angles
    clean = plan(rng, directions=directions)
    count = len(next(o for o in clean.observations if isinstance(o, kind)))
    wrong = edited(clean, kind, lambda o: (2 * np.pi - o.values) % (2 * np.pi))
    return wrong, "counter_clockwise", set(range(count))


def one_station_the_other_way(rng: np.random.Generator) -> tuple[Network, str, set[int]]:
    clean = plan(rng)
    o = next(o for o in clean.observations if isinstance(o, Angles))
    station = rng.choice(o.start)
    items = np.flatnonzero(o.start == station)

    def edit(o: Observations) -> np.ndarray:
        new = o.values.copy()
        new[items] = 2 * np.pi - new[items]
        return new

    return edited(clean, Angles, edit), "counter_clockwise", set(items.tolist())


def set_up_elsewhere(rng: np.random.Generator) -> tuple[Network, str, set[int]]:
    """Directions of one set-up that were taken from another point of the network."""
    clean = plan(rng, directions=True)
    o = next(o for o in clean.observations if isinstance(o, Directions))
    truth = adjust(clean).state.points
    station = int(rng.choice(o.start))
    items = np.flatnonzero(o.start == station)
    place = truth[station, :2] + rng.uniform(20, 60) * np.array(
        [np.cos(a := rng.uniform(0, 6.3)), np.sin(a)]
    )

    def edit(o: Observations) -> np.ndarray:
        new = o.values.copy()
        away = truth[o.end[items], :2] - place
        new[items, 0] = (np.arctan2(away[:, 0], away[:, 1]) - 1.0) % (2 * np.pi)
        return new

    return edited(clean, Directions, edit), "setup", set(items.tolist())


def heights_of_nothing(rng: np.random.Generator) -> tuple[Network, str, set[int]]:
    """A network in space whose control has the height zero everywhere."""
    places = {f"T{i}": rng.uniform(-50, 50, 3) * (1, 1, 0.2) for i in range(6)}
    stations = {f"S{k}": rng.uniform(-20, 20, 3) * (1, 1, 0.1) for k in range(3)}
    clean = free_stations(stations, places, rng=rng).network()
    changed = []
    for o in clean.observations:
        if o.coordinate_axes() is not None:
            values = o.values.copy()
            values[np.asarray(o.coordinate_axes()) == 2] = 0.0
            o = replace(o, values=values)
        changed.append(o)
    return replace(clean, observations=tuple(changed)), "equal_heights", set()


def some_heights_of_nothing(rng: np.random.Generator) -> tuple[Network, str, set[int]]:
    """The height zero at two of six points of control, which lie 50 m higher."""
    places = {f"T{i}": rng.uniform(-50, 50, 3) * (1, 1, 0.2) + (0, 0, 50) for i in range(6)}
    stations = {f"S{k}": rng.uniform(-20, 20, 3) * (1, 1, 0.1) + (0, 0, 50) for k in range(3)}
    clean = free_stations(stations, places, rng=rng).network()
    changed = []
    for o in clean.observations:
        if isinstance(o, Coordinates):
            values = o.values.copy()
            values[:2, 2] = 0.0
            o = replace(o, values=values)
        changed.append(o)
    return replace(clean, observations=tuple(changed)), "equal_heights", set()


def two_levelled_heights_of_nothing(rng: np.random.Generator) -> tuple[Network, str, set[int]]:
    """The height zero at two of four benchmarks of a levelling network."""
    heights = dict(zip("ABCDEFGH", rng.uniform(100, 400, 8), strict=True))
    survey = Survey(datum=Datum("control"))
    for name, u in heights.items():
        held = name in "ABCD"
        place = (0, 0, (0.0 if name in "AB" else u) if held else np.nan)
        survey.point(name, place, free=(False, False, not held), role="control" if held else "free")
    ends = [(a, b) for a in heights for b in heights if a < b and rng.uniform() < 0.7]
    rise = [heights[b] - heights[a] + rng.normal(0, 0.002) for a, b in ends]
    start, end = ([pair[k] for pair in ends] for k in (0, 1))
    survey.add(HeightDifferences, values=rise, sigma=0.002, start=start, end=end)
    return survey.network(), "equal_heights", set()


def set_up_turned_midway(rng: np.random.Generator) -> tuple[Network, str, set[int]]:
    """The instrument is turned after two of four or more directions of a set-up."""
    clean = plan(rng, directions=True)
    o = next(o for o in clean.observations if isinstance(o, Directions))
    items = np.flatnonzero(o.start == int(rng.choice(o.start)))
    half = rng.permutation(items)[: len(items) // 2]
    angle = rng.uniform(0.05, 3.0) * rng.choice([-1, 1])

    def edit(o: Observations) -> np.ndarray:
        new = o.values.copy()
        new[half] = (new[half] + angle) % (2 * np.pi)
        return new

    # which of the two halves is turned cannot be told
    return edited(clean, Directions, edit), "turned", set(items.tolist())


SLIPS = (
    ends_exchanged, all_the_other_way, one_station_the_other_way, set_up_elsewhere,
    heights_of_nothing, some_heights_of_nothing, two_levelled_heights_of_nothing,
    set_up_turned_midway,
)  # fmt: skip
Make = Callable[[np.random.Generator], tuple[Network, str, set[int]]]


def tried(make: Make, seeds: range) -> tuple[int, int]:
    """How often a slip is named, and how often something else is."""
    right = wrong = 0
    for seed in seeds:
        network, kind, items = make(np.random.default_rng([seed, 37]))
        slip = found(network)
        if slip is None:
            continue
        same = slip.kind == kind and {item for _, item in slip.keys} == items
        right, wrong = right + same, wrong + (not same)
    return right, wrong


@pytest.mark.parametrize("make", SLIPS, ids=lambda make: make.__name__)
def test_slips_are_named(make: Make) -> None:
    right, wrong = tried(make, range(2))
    assert (right, wrong) == (2, 0)


@pytest.mark.slow
@pytest.mark.parametrize("make", SLIPS, ids=lambda make: make.__name__)
def test_many_slips_are_named(make: Make) -> None:
    count = 60
    right, wrong = tried(make, range(100, 100 + count))
    print(f"{make.__name__}: {right} of {count} named, {wrong} wrongly")
    assert wrong == 0
    assert right >= 0.95 * count


@pytest.mark.slow
def test_one_wrong_sight_is_no_slip() -> None:
    for seed in range(60):
        rng = np.random.default_rng([seed, 38])
        directions = bool(seed % 2)
        clean, kind = plan(rng, directions=directions), Directions if directions else Angles
        item = int(rng.integers(5))

        def edit(o: Observations, item: int = item, size: float = rng.uniform(0.01, 0.5)):
            new = o.values.copy()
            new[item] += size
            return new

        slip = found(edited(clean, kind, edit))
        assert slip is None, slip


def test_names_exchanged_in_directions_alone_are_named() -> None:
    """A field book with two directions in the wrong rows, and the distances in the right ones."""
    clean = plan(np.random.default_rng(7), directions=True)
    o = next(o for o in clean.observations if isinstance(o, Directions))
    measured = next(o for o in clean.observations if isinstance(o, HorizontalDistances))
    station = int(measured.start[0])
    items = np.flatnonzero(o.start == station)
    near = items[np.isin(o.end[items], measured.end[measured.start == station])]
    first, second = int(near[0]), int(items[items != near[0]][0])

    def edit(o: Observations) -> np.ndarray:
        new = o.values.copy()
        new[[first, second]] = new[[second, first]]
        return new

    slip = found(edited(clean, Directions, edit))
    assert slip is not None
    name = clean.start.layout.position_name
    assert f"in the directions at {name(station)}" in slip.words
    assert {name(int(o.end[k])) for k in (first, second)} <= set(slip.words.split())


@pytest.mark.parametrize("directions", [True, False])
def test_the_unit_of_all_angles_is_named(directions: bool) -> None:
    """Degrees read as gon, and 12.3045 for 12 degrees 30 minutes 45 seconds."""

    def packed(o: Observations) -> np.ndarray:
        seconds = np.rint(np.degrees(o.values % (2 * np.pi)) * 3600)
        whole, rest = seconds // 3600, seconds % 3600
        return np.radians(whole + rest // 60 / 100 + rest % 60 / 10000)

    kind = Directions if directions else Angles
    clean = plan(np.random.default_rng(11), directions=directions)
    for edit in (lambda o: 0.9 * o.values, packed):
        slip = found(edited(clean, kind, edit))
        assert slip is not None
        assert slip.kind == "angle_unit"


def optimistic(network: Network, factor: float) -> Network:
    """The network with sigmas of its angles and distances that are too small."""
    kinds = (Angles, Directions, HorizontalDistances)
    return replace(
        network,
        observations=tuple(
            replace(o, covariance=o.covariance / factor**2) if isinstance(o, kinds) else o
            for o in network.observations
        ),
    )


def test_exchanged_ends_are_named_though_sigmas_are_far_too_small() -> None:
    for seed in (0, 1):
        network, kind, items = ends_exchanged(np.random.default_rng([seed, 991]))
        slip = found(optimistic(network, 15))
        assert slip is not None
        assert (slip.kind, {item for _, item in slip.keys}) == (kind, items)


def test_one_wrong_sight_accuses_no_set_up_though_sigmas_are_too_small() -> None:
    def edit(o: Observations) -> np.ndarray:
        new = o.values.copy()
        new[2] += 0.2
        return new

    clean = plan(np.random.default_rng(5), directions=True)
    assert found(optimistic(edited(clean, Directions, edit), 15)) is None


def test_equal_heights_are_named_though_one_of_them_is_seen_in_plan_alone() -> None:
    """No zenith angle goes to the backsight: its height can be neither doubted nor kept."""
    rng = np.random.default_rng(9)
    places = {f"T{i}": rng.uniform(-50, 50, 3) * (1, 1, 0.2) for i in range(5)}
    stations = {f"S{k}": rng.uniform(-20, 20, 3) * (1, 1, 0.1) for k in range(3)}
    clean = free_stations(stations, places, rng=rng).network()
    back, changed = clean.start.layout.index("point", "T0"), []
    for o in clean.observations:
        if isinstance(o, Coordinates):
            values = o.values.copy()
            values[:, 2] = 100.0
            o = replace(o, values=values)
        elif isinstance(o, (ZenithAngles, SlopeDistances)):
            use = o.use.copy()
            use[o.end == back] = Use.OFF
            o = replace(o, use=use)
        changed.append(o)
    slip = found(replace(clean, observations=tuple(changed)))
    assert slip is not None
    assert slip.kind == "equal_heights"
    assert "T0" not in slip.words


def test_two_exchanged_angles_are_named_together() -> None:
    right, wrong = tried(two_ends_exchanged, range(2))
    assert wrong == 0
    assert right >= 1


def test_clean_networks_have_no_slip() -> None:
    for seed in range(3):
        assert found(plan(np.random.default_rng(seed), directions=bool(seed % 2))) is None


def test_a_height_difference_the_other_way() -> None:
    survey = Survey(datum=Datum("control"))
    heights = {"A": 10.0, "B": 12.5, "C": 11.2, "D": 15.0}
    for name, u in heights.items():
        held = name in "AD"
        survey.point(name, (0, 0, u) if held else (0, 0, np.nan), free=(False, False, not held),
                     role="control" if held else "free")  # fmt: skip
    lines = [("A", "B"), ("B", "C"), ("C", "D"), ("A", "C"), ("B", "D"), ("A", "B"), ("C", "D")]
    values = [heights[b] - heights[a] for a, b in lines]
    values[3] = -values[3]
    survey.add(HeightDifferences, values=values, sigma=0.001, start=[a for a, _ in lines],
               end=[b for _, b in lines])  # fmt: skip
    slip = found(survey.network())
    assert slip is not None
    assert "ends exchanged" in slip.words


def readings(folder: Path, rng: np.random.Generator, called: str) -> Network:
    """Four set-ups that see one another and six targets, of which the third has another name."""
    place = {f"T{k}": rng.uniform(-80, 80, 3) * (1, 1, 0.1) for k in range(6)}
    place |= {f"S{k}": rng.uniform(-50, 50, 3) * (1, 1, 0.1) for k in range(4)}
    head = "station,setup,target,face,direction_gon,zenith_gon,slope_distance_m,"
    head += "height_instrument_m,height_target_m\n"
    rows, gon = [], 200 / np.pi
    for station in ("S0", "S1", "S2", "S3"):
        name = called if station == "S2" else station
        for face in (1, 2):
            for target in place.keys() - {station}:
                d = place[target] - place[station] + (0, 0, 1.3 - 1.5)
                hz, z = np.arctan2(d[0], d[1]), np.arctan2(np.hypot(d[0], d[1]), d[2])
                hz, z = gon * np.array([hz, z]) + rng.normal(0, 4e-4, 2)
                hz, z = (hz % 400, z) if face == 1 else ((hz + 200) % 400, 400 - z)
                far = np.linalg.norm(d) + rng.normal(0, 0.001)
                rows.append(f"{name},{station},{target},{face},{hz:.5f},{z:.5f},{far:.4f},1.5,1.3")
    (folder / "sights.csv").write_text(head + "\n".join(rows) + "\n")
    (folder / "control.csv").write_text(
        "point,e_m,n_m,u_m,role\n"
        + "".join(f"T{k},{','.join(f'{v:.4f}' for v in place[f'T{k}'])},fixed\n" for k in range(3))
    )
    return read(folder / "sights.csv", folder / "control.csv")


@pytest.mark.parametrize("called", ["S1", "T4", "S2"])
def test_a_set_up_under_the_name_of_another_point(tmp_path: Path, called: str) -> None:
    slip = found(readings(tmp_path, np.random.default_rng(4), called))
    if called == "S2":
        assert slip is None
        return
    assert slip is not None
    assert slip.kind == "setup_elsewhere"
    assert called in slip.names[0]


# networks of others


@pytest.fixture(scope="module")
def faults(shared_data: Path) -> Path:
    folder = shared_data / "faults" / "networks2"
    if not folder.is_dir():
        pytest.skip(f"third-party data are not in {folder}")
    return folder


def read(*paths: Path) -> Network:
    return observed_part(read_files(list(paths))).network()


def test_angle_of_a_knot_traverse(faults: Path) -> None:
    folder = faults / "06-angle-ends-swapped"
    network = read(*(folder / f"k_{name}.csv" for name in ("pts", "angles", "dist", "az")))
    slip = found(network)
    assert slip is not None
    assert slip.kind == "angle_ends"
    ((table, item),) = slip.keys
    assert network.observations[table].source[item].endswith("k_angles.csv:6")
    assert np.sqrt(slip.after) == pytest.approx(2.65, abs=0.005)
    # the held coordinate that was accused is innocent
    assert wrong_coordinate(adjust(network)) is None


def test_angles_of_a_lab(faults: Path) -> None:
    slip = found(read(faults / "07-angles-counter-clockwise" / "net.dat"))
    assert slip is not None
    assert (slip.kind, len(slip.keys)) == ("counter_clockwise", 12)
    assert slip.after * 14 == pytest.approx(183.177, abs=0.001)


def test_heights_of_placeholders(faults: Path) -> None:
    network = read(faults / "09-zero-heights" / "net.gkf")
    slip = found(network)
    assert slip is not None
    assert slip.kind == "equal_heights"
    assert wrong_coordinate(adjust(network)) is None


def test_a_set_up_of_a_hall(faults: Path) -> None:
    network = read(faults / "26-set-up-turned" / "net.dat")
    slip = found(network)
    assert slip is not None
    assert slip.kind == "setup"
    starts = {network.observations[t].start[i] for t, i in slip.keys}
    assert [network.start.layout.position_name(int(s)) for s in starts] == ["S2"]
