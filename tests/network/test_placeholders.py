"""Given coordinates that are placeholders are named, and those that are right stay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import TribrachError
from tribrach.io.survey.formats import read_files
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.blunders.gross import explain
from tribrach.network.network import Datum
from tribrach.network.start.placeholders import contradiction
from tribrach.network.survey import Survey
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles
from tribrach.units import SEC


def keyed(rng: np.random.Generator, count: int) -> list[tuple[float, float, float]]:
    """Coordinates as they are keyed in to begin a job."""
    k = np.arange(1, count + 1)
    spread = rng.permutation(k)
    sort = int(rng.integers(5))
    values = {
        0: [(j, j, 0) for j in spread],
        1: [(1000 * j, 1000 * j, 100) for j in spread],
        2: [(int(str(j) * 4), int(str(j) * 3), 0) for j in spread],
        3: [(100 + 10 * j, 100, 10) for j in spread],
        4: [(0, 3 * j, j) for j in spread],
    }[sort]
    return [(float(e), float(n), float(u)) for e, n, u in values]


def network(
    rng: np.random.Generator, real: int, wrong: int, how: str
) -> tuple[Survey, dict[str, np.ndarray], set[str]]:
    """Three set-ups that see most of twelve points; some given right, some as placeholders.

    how : ``held``, ``weighted`` or ``start``: given by a datum of inner constraints.
    """
    centre = np.array([*rng.uniform(1e5, 5e5, 2), rng.uniform(50, 400)])
    places = {f"P{k}": centre + rng.uniform(-80, 80, 3) * (1, 1, 0.1) for k in range(12)}
    stations = {f"S{k}": centre + rng.uniform(-60, 60, 3) * (1, 1, 0.1) for k in range(3)}
    every = {**places, **stations}
    chosen = rng.permutation(list(every))[: real + wrong].tolist()
    given = {n: every[n] for n in chosen[:real]}
    given |= {n: np.array(x) for n, x in zip(chosen[real:], keyed(rng, wrong), strict=True)}
    survey = Survey(datum=Datum("control") if how != "start" else Datum("free", tuple(chosen)))
    for name, xyz in given.items():
        if how == "held":
            survey.point(name, xyz, free=(False, False, False), role="control")
        elif how == "weighted":
            survey.point(name, xyz, covariance=1e-4 * np.eye(3), role="control")
        else:
            survey.point(name, xyz)
    ends = [
        (s, t) for s in stations for t in every if s != t and (s == "S0" or rng.uniform() < 0.85)
    ]
    start, end = ([e[k] for e in ends] for k in (0, 1))
    d = np.array([every[b] - every[a] for a, b in ends])
    flat, sigma = np.hypot(d[:, 0], d[:, 1]), 5 * SEC
    turn = {s: rng.uniform(0, 2 * np.pi) for s in stations}
    value = np.arctan2(d[:, 0], d[:, 1]) - [turn[s] for s in start]
    noise = rng.normal(size=(3, len(ends)))
    survey.add(Directions, values=(value + sigma * noise[0]) % (2 * np.pi), sigma=sigma,
               start=start, end=end, orientation=[f"o {s}" for s in start])  # fmt: skip
    survey.add(ZenithAngles, values=np.arctan2(flat, d[:, 2]) + sigma * noise[1], sigma=sigma,
               start=start, end=end)  # fmt: skip
    survey.add(SlopeDistances, values=np.linalg.norm(d, axis=1) + 0.003 * noise[2], sigma=0.003,
               start=start, end=end)  # fmt: skip
    return survey, given, set(chosen[real:])


def told(survey: Survey, given: dict[str, np.ndarray], how: str) -> set[str] | None:
    """Points that are named; None if nothing is said."""
    net = survey.network()
    if how == "start":
        found = contradiction(net, given, adjust)
        return None if found is None else set(found.off)
    try:
        solved: Adjustment | None = adjust(net)
    except TribrachError:
        solved = None
    slip = explain(net, solved)
    return None if slip is None or slip.kind != "placeholders" else set(slip.names)


def tried(seeds: range) -> dict[str, tuple[int, int, int]]:
    """Cases, rightly named, and innocents named, by how the coordinates are given."""
    out = dict.fromkeys(("held", "weighted", "start"), (0, 0, 0))
    for seed in seeds:
        rng = np.random.default_rng([seed, 8])
        how = list(out)[seed % 3]
        survey, given, wrong = network(rng, int(rng.integers(2, 5)), int(rng.integers(2, 5)), how)
        named = told(survey, given, how)
        cases, right, innocent = out[how]
        out[how] = (
            cases + 1,
            right + (named == wrong),
            innocent + bool(named is not None and named - wrong),
        )
    return out


def test_placeholders_are_named() -> None:
    for how, (cases, right, innocent) in tried(range(6)).items():
        assert (right, innocent) == (cases, 0), how


@pytest.mark.slow
def test_300_networks_with_placeholders() -> None:
    for how, (cases, right, innocent) in tried(range(1000, 1300)).items():
        print(f"{how}: {right} of {cases} named, {innocent} with an innocent")
        assert innocent <= 0.02 * cases
        assert right >= 0.95 * cases


@pytest.mark.parametrize("how", ["held", "weighted", "start"])
def test_good_coordinates_contradict_nothing(how: str) -> None:
    for seed in range(3):
        survey, given, _ = network(np.random.default_rng(seed), 4, 0, how)
        assert contradiction(survey.network(), given, adjust) is None


def test_rough_coordinates_are_no_placeholders() -> None:
    rng = np.random.default_rng(2)
    survey, given, _ = network(rng, 6, 0, "start")
    rough = {name: xyz + rng.normal(0, 5, 3) for name, xyz in given.items()}
    assert contradiction(survey.network(), rough, adjust, rough=True) is None


def test_a_free_network_leaves_its_placeholders() -> None:
    survey, given, wrong = network(np.random.default_rng(4), 3, 3, "start")
    solved = adjust(survey.network())
    assert set(solved.network.datum.names) == set(given) - wrong
    layout = solved.layout
    for name in set(given) - wrong:
        place = solved.state.points[layout.index("point", name)]
        assert np.abs(place - given[name]).max() < 0.02


@pytest.mark.parametrize("count", [3, 4, 5])
def test_names_exchanged_in_the_control(count: int) -> None:
    """Of four the two that are right agree no better than the two that are exchanged."""
    survey, given, _ = network(np.random.default_rng(7), count, 0, "held")
    a, b = sorted(given)[:2]
    swapped = Survey(datum=survey.datum)
    for name, xyz in {**given, a: given[b], b: given[a]}.items():
        swapped.point(name, xyz, free=(False, False, False), role="control")
    swapped.replace_tables([[table] for table in survey.tables()])
    net = swapped.network()
    slip = explain(net)
    assert slip is not None
    assert (slip.kind, set(slip.names)) == ("exchanged_control", {a, b})


@pytest.mark.parametrize(("name", "kept"), [("a.sdr", {"G3", "D1", "MM9"}), ("b.sdr", set())])
def test_a_job_of_others(shared_data: Path, name: str, kept: set[str]) -> None:
    path = shared_data / "faults" / "networks2" / "08-dummy-coordinates" / name
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    solved = adjust(read_files([path]).network())
    assert set(solved.network.datum.names) == kept
    assert (solved.dof, solved.defect) == (46, 4)
    # centring and heights are shared within a set-up; with errors of each sight it is 0.963
    assert solved.sigma0_posterior == pytest.approx(1.206, abs=0.001)


def test_a_list_comes_before_what_was_keyed_in(shared_data: Path, tmp_path: Path) -> None:
    """Without sigmas and roles a list fits the network; with the role fixed it holds it."""
    path = shared_data / "faults" / "networks2" / "08-dummy-coordinates" / "b.sdr"
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    rows = "G3,1321472.798,480933.048\nD1,1321586.809,480954.206\nMM9,1321592.010,481029.360\n"
    control = tmp_path / "control.csv"
    control.write_text("point,easting_m,northing_m\n" + rows)
    survey = read_files([path, control])
    assert survey.datum == Datum("free", ("G3", "D1", "MM9"))
    assert sum("neither sigmas nor a role" in text for text in survey.warnings) == 1
    assert not any("files give no control" in text for text in survey.warnings)
    wrong = "ST1,1,1\nST2,3,3\nST3,5,5\n"
    control.write_text("point,easting_m,northing_m\n" + wrong)
    assert read_files([control, path]).datum == Datum("free")
    control.write_text("point,easting_m,northing_m,role\n" + rows.replace("\n", ",fixed\n"))
    assert read_files([path, control]).datum == Datum("control")
