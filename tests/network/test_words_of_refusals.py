"""Networks that cannot be adjusted: what is open, what takes no part, a cure that keeps the job."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import AdjustmentError, InputError
from tribrach.io.survey.formats import read
from tribrach.network.adjustment import adjust
from tribrach.network.facts import StartOnly, facts_of
from tribrach.network.network import Datum
from tribrach.network.survey import Survey, observed_part
from tribrach.observations.base import Use
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.sights import (
    Directions,
    HorizontalDistances,
    SlopeDistances,
    ZenithAngles,
)


def refusal(survey: Survey) -> Sequence[str]:
    with pytest.raises(AdjustmentError) as caught:
        adjust(observed_part(survey).network())
    return caught.value.sentences


def fault(shared_data: Path, folder: str, *names: str) -> Survey:
    there = shared_data / "faults" / "networks2" / folder
    paths = [there / name for name in names]
    if not all(path.is_file() for path in paths):
        pytest.skip(f"{there} is absent")
    return read(paths)


def plan_control(seed: int) -> Survey:
    """Control in plan, and sights with zenith angles that fix heights but for one."""
    rng = np.random.default_rng(seed)
    survey = Survey()
    place = {name: rng.uniform(-80, 80, 3) * (1, 1, 0.1) for name in "ABCP"}
    for name, (e, n, _) in place.items():
        given = name != "P"
        survey.point(
            name, (e, n, np.nan) if given else (np.nan,) * 3, free=(not given, not given, True),
            role="fixed" if given else "free",
        )  # fmt: skip
    ends = {"start": ["P"] * 3, "end": list("ABC")}
    d = np.array([place[b] - place["P"] for b in "ABC"])
    far, flat = np.linalg.norm(d, axis=1), np.hypot(d[:, 0], d[:, 1])
    survey.add(Directions, values=np.arctan2(d[:, 0], d[:, 1]), sigma=1e-5, orientation=["P"] * 3,
               **ends)  # fmt: skip
    survey.add(ZenithAngles, values=np.arctan2(flat, d[:, 2]), sigma=1e-5, **ends)
    survey.add(SlopeDistances, values=far, sigma=0.002, **ends)
    return survey


@pytest.mark.parametrize("seed", range(4))
def test_a_height_that_is_open_lets_the_plan_stay_held(seed: int) -> None:
    said = " ".join(refusal(plan_control(seed)))
    assert "the height of any one point" in said
    assert "datum free" not in said
    survey = plan_control(seed)
    survey.points["A"].xyz = (*survey.points["A"].xyz[:2], 0.0)
    survey.points["A"].free = (False, False, False)
    assert adjust(observed_part(survey).network()).defect == 0


def test_plan_control_of_others(shared_data: Path) -> None:
    said = " ".join(
        refusal(fault(shared_data, "16-plan-only-control", "points.csv", "readings.csv"))
    )
    assert "the height of any one point" in said
    assert "datum free" not in said


def test_what_takes_no_part_is_listed_with_its_reason(shared_data: Path) -> None:
    said = refusal(fault(shared_data, "04-slope-off-add-a-distance", "net.gkf"))
    assert not any("add a distance" in sentence for sentence in said)
    assert any("the height of ST1 is neither fixed nor adjusted" in sentence for sentence in said)


def test_what_is_off_is_listed_where_no_start_is_found(tmp_path: Path) -> None:
    """A free set-up whose slope distances take no part: they are there, and need no repetition."""
    (tmp_path / "n.gkf").write_text(
        '<gama-local><network axes-xy="en" angles="left-handed">'
        '<points-observations direction-stdev="8" distance-stdev="2" zenith-angle-stdev="10">'
        '<point id="A" x="0" y="0" fix="xy"/><point id="B" x="150" y="20" fix="xy"/>'
        '<point id="ST" adj="xy"/><point id="F" adj="xy"/><obs from="ST">'
        + "".join(
            f'<direction to="{to}" val="{hz}"/><s-distance to="{to}" val="{far}"/>'
            f'<z-angle to="{to}" val="{z}"/>'
            for to, hz, far, z in (
                ("A", 281.4506, 92.3309, 103.4492),
                ("B", 386.3380, 113.1769, 101.6877),
                ("F", 70.7422, 58.5235, 94.5544),
            )
        )
        + "</obs></points-observations></network></gama-local>"
    )
    with pytest.raises(AdjustmentError) as caught:
        adjust(observed_part(read([tmp_path / "n.gkf"])).network())
    said = caught.value.sentences
    assert sum("3 slope distances" in sentence for sentence in said) == 2
    assert any("the height of ST is neither fixed nor adjusted" in sentence for sentence in said)
    assert not any("would place it" in sentence for sentence in said)


def test_points_that_no_file_defines_are_named(tmp_path: Path) -> None:
    (tmp_path / "n.gkf").write_text(
        "<gama-local><network><points-observations angle-stdev='5'><obs from='P'>"
        "<angle bs='A' fs='B' val='33.3342'/></obs></points-observations></network></gama-local>"
    )
    with pytest.raises(InputError, match="does not define") as caught:
        read([tmp_path / "n.gkf"])
    assert "<point" in str(caught.value)


def test_slope_distances_without_heights_ask_for_heights() -> None:
    survey = Survey()
    for name, (e, n) in {"A": (0, 0), "B": (150, 20)}.items():
        survey.point(name, (e, n, np.nan), free=(False, False, True), role="fixed")
    ends = {"start": ["S"] * 3, "end": ["A", "B", "F"]}
    survey.add(Directions, values=[1.0, 2.5, 4.0], sigma=1e-5, orientation=["S"] * 3, **ends)
    survey.add(SlopeDistances, values=[92.3, 113.2, 58.5], sigma=0.002, **ends)
    said = " ".join(refusal(survey))
    assert "zenith angles" in said
    assert "coordinates of two points" not in said


def test_any_refusal_lists_what_is_off() -> None:
    """Distances switched off by hand, and directions that are too few."""
    survey = plan_control(0)
    survey.points["A"].xyz = (*survey.points["A"].xyz[:2], 0.0)
    survey.points["A"].free = (False, False, False)
    network = survey.network()
    for table, o in enumerate(network.observations):
        for item in range(len(o)):
            if o.kind != "direction" or item == 0:
                network = network.switched([(table, item)], Use.OFF, "prism tilted")
    with pytest.raises(AdjustmentError) as caught:
        adjust(network)
    assert any("take no part: prism tilted" in sentence for sentence in caught.value.sentences)


def test_a_hinge_without_redundancy_names_points_that_would_start_it(shared_data: Path) -> None:
    """Two places of the hinge fit alike, and nothing tells which."""
    said = " ".join(refusal(fault(shared_data, "05-plan-hinge-three-points", "syn3.gkf")))
    assert "common points" not in said
    assert "rough coordinate" in said
    assert " R" in said.partition("first of")[2]


def test_a_hinge_with_redundancy_is_found_by_trial(shared_data: Path) -> None:
    survey = fault(shared_data, "05-plan-hinge-three-points", "syn4u.gkf")
    adjustment = adjust(observed_part(survey).network())
    place = adjustment.state.points[adjustment.layout.index("point", "R"), :2]
    np.testing.assert_allclose(place, (230.0, 40.0), atol=0.01)
    assert adjustment.dof == 1
    assert any("found by trial" in text for text in adjustment.warnings)


def hinged(seed: int, angles: str) -> tuple[Survey, dict[str, np.ndarray]]:
    """A traverse A-P-Q-R-S-B with directions at some of its points, and one more distance."""
    rng = np.random.default_rng(seed)
    survey, chain = Survey(), "APQRSB"
    place = {n: np.array([60.0 * k, 0.0]) + rng.uniform(-25, 25, 2) for k, n in enumerate(chain)}
    for name, (e, n) in place.items():
        held = name in "AB"
        xyz = (e, n, 0.0) if held else (np.nan, np.nan, 0.0)
        survey.point(name, xyz, free=(not held, not held, False), role="fixed" if held else "free")
    legs = [*pairwise(chain), ("P", "S"), ("A", "R")]
    start, end = ([leg[k] for leg in legs] for k in (0, 1))
    far = [np.linalg.norm(place[a] - place[b]) + rng.normal(0, 0.002) for a, b in legs]
    survey.add(HorizontalDistances, values=far, sigma=0.002, start=start, end=end)
    sights = [(n, chain[chain.index(n) + k]) for n in angles for k in (-1, 1)]
    azimuths = [np.arctan2(*(place[b] - place[a])) + rng.normal(0, 2e-5) for a, b in sights]
    survey.add(Directions, values=np.array(azimuths) % (2 * np.pi), sigma=2e-5,
               orientation=[a for a, _ in sights], start=[a for a, _ in sights],
               end=[b for _, b in sights])  # fmt: skip
    return survey, place


def test_a_start_by_trial_is_the_place(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tribrach.network.start.trials._THROWS", 8)
    survey, place = hinged(2, "PS")
    adjustment = adjust(survey.network())
    for name in "PQRS":
        found = adjustment.state.points[adjustment.layout.index("point", name), :2]
        assert np.abs(found - place[name]).max() < 0.05


def test_what_is_open_everywhere_is_not_said_to_need_a_start() -> None:
    """Three set-ups that see each other and one known point each: a turn and a scale are open."""
    rng = np.random.default_rng(7)
    survey = Survey()
    place = {n: rng.uniform(-200, 200, 2) for n in "ABCSTUVW"}
    for name, (e, n) in place.items():
        held = name in "ABC"
        xyz = (e, n, 0.0) if held else (np.nan, np.nan, 0.0)
        survey.point(name, xyz, free=(not held, not held, False), role="fixed" if held else "free")
    sights = [(a, b) for a, k in zip("STU", "ABC", strict=True) for b in f"{k}STUVW" if a != b]
    azimuths = [np.arctan2(*(place[b] - place[a])) % (2 * np.pi) for a, b in sights]
    survey.add(Directions, values=azimuths, sigma=2e-5, orientation=[a for a, _ in sights],
               start=[a for a, _ in sights], end=[b for _, b in sights])  # fmt: skip
    said = " ".join(refusal(survey))
    assert "open wherever they lie" in said
    assert "rough coordinate" not in said


def resected(seed: int) -> Survey:
    """Directions from five set-ups to known points; one set-up starts far away from all of them."""
    rng = np.random.default_rng(seed)
    survey = Survey()
    known = {f"K{k}": rng.uniform(-100, 100, 2) for k in range(5)}
    for name, (e, n) in known.items():
        survey.point(name, (e, n, 0.0), free=(False,) * 3, role="fixed")
    at = rng.uniform(-40, 40, 2)
    survey.point("S", (1e9, 2e9, 0.0), free=(True, True, False))
    d = np.array([xy - at for xy in known.values()])
    survey.add(
        Directions, values=np.arctan2(d[:, 0], d[:, 1]) % (2 * np.pi), sigma=1e-5,
        orientation=["S"] * 5, start=["S"] * 5, end=list(known),
    )  # fmt: skip
    return survey


@pytest.mark.parametrize("seed", range(4))
def test_a_bad_start_is_not_said_of_the_observations(seed: int) -> None:
    """It adjusts, does not converge, or says that the start is to blame: never that it is open."""
    said = ""
    try:
        adjust(resected(seed).network())
    except AdjustmentError as error:
        said = str(error)
    assert "cannot be determined" not in said
    assert "leave unknowns open" not in said


def test_directions_only_of_others(shared_data: Path) -> None:
    said = refusal(fault(shared_data, "03-directions-only-rank", "net.gkf"))
    assert any("a rough coordinate of ST1" in sentence for sentence in said)
    adjustment = adjust(
        observed_part(fault(shared_data, "03-directions-only-rank", "net_with_start.gkf")).network()
    )
    assert adjustment.dof == 31


def test_parts_of_a_levelling_net_say_what_joins_them() -> None:
    """Each part is one sentence with its cure, not one for each of its points."""
    survey = Survey(datum=Datum("free"))
    lines = [("A", "P"), ("P", "B"), ("A", "B"), ("C", "D"), ("D", "E"), ("C", "E")]
    survey.add(HeightDifferences, values=[0.5, 0.5, 1.0] * 2, sigma=0.001,
               start=[a for a, _ in lines], end=[b for _, b in lines])  # fmt: skip
    (said,) = refusal(survey)
    assert said.startswith("C, D, E are connected")
    assert "the height of one of them" in said


def test_a_list_without_roles_is_named_as_such(tmp_path: Path) -> None:
    """Whoever gave coordinates and is asked for more control is told what those are."""
    (tmp_path / "list.csv").write_text("point,e_m,n_m\nA,0,0\nB,100,0\nC,50,80\n")
    rows = ("N,A,0,60,1,2", "N,B,80,62,1,2", "N,C,300,35,1,2")
    head = "from,to,direction_gon,horizontal_distance_m,sigma_direction_mgon,sigma_distance_mm\n"
    (tmp_path / "sights.csv").write_text(head + "\n".join(rows) + "\n")
    survey = read([tmp_path / "sights.csv", tmp_path / "list.csv"])
    (fact,) = facts_of(survey.facts, StartOnly)
    assert fact == StartOnly("list.csv", ("A", "B", "C"))
    assert any("list.csv" in said for said in refusal(survey))
    said = (tmp_path / "list.csv").read_text().replace("\n", ",approximate\n")
    (tmp_path / "list.csv").write_text(said.replace("n_m,approximate", "n_m,role"))
    assert not facts_of(read([tmp_path / "list.csv"]).facts, StartOnly)
