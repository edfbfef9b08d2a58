"""One slip that spoils a whole network is named, and nothing else is."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.network.networks import free_stations
from tribrach.errors import InputError, NotConverged
from tribrach.job.opened import open_job
from tribrach.network.adjustment import adjust
from tribrach.network.blunders.clearing import from_adjusted, from_start
from tribrach.network.blunders.gross import explain
from tribrach.network.blunders.mistakes import first_adjustment, mistakes
from tribrach.network.blunders.slip_search import SlipSearch
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.gnss import GnssPositions
from tribrach.observations.levelling import HeightDifferences
from tribrach.project import Project

PI = np.pi


def network(seed: int = 1, targets: int = 8) -> Network:
    """Three free set-ups that see all targets, of which all are control of a millimetre."""
    rng = np.random.default_rng(seed)
    places = {f"T{i}": rng.uniform(-50, 50, 3) * (1, 1, 0.2) for i in range(targets)}
    stations = {f"S{k}": rng.uniform(-20, 20, 3) * (1, 1, 0.1) for k in range(3)}
    return free_stations(stations, places, rng=rng).network()


def table(found: Network, kind: str) -> int:
    return [o.kind for o in found.observations].index(kind)


def edited(found: Network, kind: str, items: list[int], edit: Callable[[float], float]) -> Network:
    """The network with some values of a kind changed."""
    values = found.observations[table(found, kind)].values
    for item in items:
        values[item, 0] = edit(float(values[item, 0]))
    return found


def said(found: Network) -> str:
    """What is said of one slip, whether the network as it is can be adjusted or not."""
    try:
        (sentence,) = mistakes(first_adjustment(found)).sentences
    except InputError as error:
        return str(error)
    return sentence


def test_two_directions_off_by_200_gon(shared_data: Path, tmp_path: Path) -> None:
    """The names T4 and T5 were blamed for them, with a sigma0 of 1350."""
    folder = shared_data / "faults" / "hz200"
    if not folder.is_dir():
        pytest.skip("the project is not there")
    for path in folder.iterdir():
        (tmp_path / path.name).write_text(path.read_text())
    found = open_job(Project.load(tmp_path / "p.toml")).network()
    with pytest.raises(InputError) as caught:
        first_adjustment(found)
    text = str(caught.value)
    assert "2 directions fit when 200 gon is added: S1 -> T4 (o.csv:6), S1 -> T5 (o.csv:7)" in text
    assert "with sigma0 1.04" in text
    assert "exchanged" not in text


@pytest.mark.parametrize("quarter", [1, 2, 3])
@pytest.mark.parametrize("items", [[3], [9, 12], [1, 10, 19]])
def test_directions_off_by_quarters_of_the_circle(quarter: int, items: list[int]) -> None:
    off = edited(network(), "direction", items, lambda v: (v - quarter * PI / 2) % (2 * PI))
    sentence = said(off)
    count = "direction" if len(items) == 1 else f"{len(items)} directions"
    assert count in sentence
    assert f"when {quarter}00 gon is added" in sentence
    for item in items:
        assert f"S{item // 8} -> T{item % 8}" in sentence


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (lambda v: 2 * PI - v, "taken from 400 gon, as readings in face two"),
        (lambda v: PI / 2 - v, "as elevations from the horizon"),
        (lambda v: v + PI, "when 200 gon is subtracted"),
    ],
)
def test_zenith_angles_of_the_other_face_and_elevations(
    edit: Callable[[float], float], words: str
) -> None:
    sentence = said(edited(network(), "zenith", [2, 5], edit))
    assert words in sentence
    assert "2 zenith angles fit" in sentence
    assert "S0 -> T2, S0 -> T5" in sentence


@pytest.mark.parametrize("factor", [0.3048, 1 / 0.3048])
def test_distances_in_feet(factor: float) -> None:
    found = edited(network(), "slope_distance", list(range(24)), lambda v: v / factor)
    sentence = said(found)
    assert "feet" in sentence
    # distances in feet, or coordinates in feet among distances in metres: the list as a whole
    assert ("times 0.3048" if factor < 1 else "all 8 points") in sentence


def test_distances_in_millimetres() -> None:
    found = edited(network(), "slope_distance", list(range(24)), lambda v: v * 1000)
    sentence = said(found)
    assert "millimetres" in sentence
    assert float(sentence.split("sigma0 ")[-1].split(";")[0]) < 1.3


@pytest.mark.parametrize(("unit", "metres"), [("inches", 0.0254), ("yards", 0.9144)])
def test_coordinates_in_other_units(unit: str, metres: float) -> None:
    found = network()
    control = found.observations[table(found, "coordinates")]
    control.values[:] /= metres
    sentence = said(found)
    assert "all 8 points" in sentence
    assert f"fit as {unit}" in sentence


def test_names_exchanged_at_a_set_up() -> None:
    found = network()
    for o in found.observations:
        if o.kind != "coordinates":
            first, second = o.end[8 + 2], o.end[8 + 6]
            o.end[[8 + 2, 8 + 6]] = second, first
    sentence = said(found)
    assert sentence.startswith("The names T2 and T6 are exchanged at S1: with them the other way")
    sigma0 = float(sentence.split("sigma0 ")[1].split(";")[0].split(" to ")[-1])
    assert 0.7 < sigma0 < 1.3


def test_names_exchanged_in_the_given_coordinates() -> None:
    found = network()
    control = found.observations[table(found, "coordinates")]
    control.position[[1, 4]] = control.position[[4, 1]]
    assert said(found).startswith("The names T1 and T4 are exchanged in the given coordinates")


@pytest.mark.parametrize("seed", range(6))
def test_one_wild_value_is_no_slip_of_names(seed: int) -> None:
    """Of any kind and size: the tests of single observations say which it is."""
    rng = np.random.default_rng(seed)
    found = network(seed)
    kind = ("direction", "zenith", "slope_distance")[seed % 3]
    item, size = int(rng.integers(24)), rng.uniform(0.05, 0.4)
    adjustment = adjust(edited(found, kind, [item], lambda v: v + size))
    assert mistakes(adjustment).sentences == ()


@pytest.mark.parametrize("seed", range(4))
def test_a_wrong_coordinate_is_no_slip_of_names(seed: int) -> None:
    found = network(seed)
    found.observations[table(found, "coordinates")].values[3, seed % 3] += 7.0
    try:
        texts = mistakes(first_adjustment(found)).sentences
    except (InputError, NotConverged) as error:
        texts = [str(error)]
    assert not [t for t in texts if "exchanged" in t or "gon" in t or "feet" in t]


def heights(seed: int, geoid: float) -> Network:
    """A levelled net with heights by GNSS in which a geoid height was typed wrongly."""
    rng = np.random.default_rng(seed)
    survey = Survey()
    places = {f"P{i}": rng.uniform(0, 900, 3) * (1, 1, 0.03) for i in range(6)}
    survey.point("P0", places["P0"], covariance=1e-6 * np.eye(3), role="control")
    names = list(places)
    for name in names[1:]:
        survey.point(name)
    pairs = [(a, b) for k, a in enumerate(names) for b in names[k + 1 :]]
    rise = [places[b][2] - places[a][2] for a, b in pairs]
    survey.add(
        HeightDifferences, values=rng.normal(rise, 0.001), sigma=0.001,
        start=[a for a, _ in pairs], end=[b for _, b in pairs],
    )  # fmt: skip
    seen = np.array([places[n] + rng.normal(0, 0.01, 3) for n in names[1:]])
    seen[:, 2] += geoid
    survey.add(GnssPositions, values=seen, sigma=np.full((5, 3), 0.01), position=names[1:])
    return survey.network()


@pytest.mark.parametrize("seed", range(5))
def test_a_wrong_geoid_height_is_no_exchange_of_names(seed: int) -> None:
    adjustment = adjust(heights(seed, 30.0))
    assert adjustment.sigma0_posterior > 100
    assert not [t for t in mistakes(adjustment).sentences if "exchanged" in t]


def wrong_everywhere() -> Network:
    """Every reading of a kind is wrong by something else: no single slip undoes that."""
    rng = np.random.default_rng(5)
    found = network(2, targets=4)
    values = found.observations[table(found, "slope_distance")].values
    values += rng.uniform(-3, 3, values.shape)
    return found


def test_nothing_is_said_where_everything_is_wrong() -> None:
    for text in mistakes(adjust(wrong_everywhere())).sentences:
        assert "exchanged at" not in text
        assert "feet" not in text


def test_the_search_is_bounded_and_says_when_it_gives_up() -> None:
    """Ten adjustments or a given number of iterations, whichever is more."""
    found = wrong_everywhere()
    adjustment = adjust(found)
    search = SlipSearch(adjuster=lambda n: adjust(n), allowed=0.0)
    assert explain(found, adjustment, search) is None
    assert search.tried == 10
    (sentence,) = search.sentences()
    assert sentence.startswith("the search for exchanged names gave up after 10 adjustments, with")
    patient = SlipSearch(allowed=1e9)
    assert explain(found, adjustment, patient) is None
    assert patient.tried > 10
    assert patient.sentences() == []


def test_slow_adjustments_end_after_ten() -> None:
    """Those of a large network use the whole budget up."""
    found = wrong_everywhere()
    adjustment = adjust(found)
    one = SlipSearch()
    one.run(found)
    search = SlipSearch(adjuster=lambda n: adjust(n), allowed=one.spent)
    explain(found, adjustment, search)
    assert search.tried == 10


def test_clearing_finds_the_wild_ones_and_no_others() -> None:
    """From the start values and from the adjusted ones."""
    for seed in range(4):
        found = edited(network(seed), "direction", [4, 13], lambda v: v + 0.3)
        wild = {(table(found, "direction"), 4), (table(found, "direction"), 13)}
        for clear in (from_start(found, adjust), from_adjusted(found, adjust(found), adjust)):
            assert clear is not None
            assert clear.fits
            assert clear.wild >= wild
            assert len(clear.wild) <= 3
