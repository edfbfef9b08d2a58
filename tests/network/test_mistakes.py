"""Blunders on the twin hanoi-facade: each is found, and named for what it is."""

import re
from pathlib import Path

import numpy as np
import pytest

from tests.network.hanoi import survey, twin
from tribrach.errors import InputError
from tribrach.job.name_targets import known_points
from tribrach.network.adjustment import adjust
from tribrach.network.blunders.common_causes import common_causes
from tribrach.network.blunders.gross import explain
from tribrach.network.blunders.mistakes import mistakes
from tribrach.network.blunders.snooping import snoop
from tribrach.network.blunders.suspects import find_suspects
from tribrach.network.network import Network
from tribrach.network.reliability import weigh
from tribrach.network.survey import Survey
from tribrach.simulate.twin import Twin
from tribrach.solution import AdjustmentSettings, adjust_network

NAME = slice(8, 24)


@pytest.fixture(scope="module")
def made() -> Twin:
    return twin()


def higher(text: str, station: str, by: float) -> str:
    """The raw file with another height of instrument at a station [m]."""
    found = re.compile(rf"(\*11\d{{4}}\+0*{station} 88\.\.\.6\+)(\d{{16}})")
    return found.sub(lambda m: m[1] + f"{int(m[2]) + round(1e4 * by):016d}", text)


def taller(text: str, target: str, by: float) -> str:
    """The raw file with another height of the prism in all sights to a target [m]."""
    lines = []
    for line in text.splitlines():
        if line[NAME].lstrip("0") == target and " 21." in line:
            line = re.sub(
                r"( 87\.\.\.6\+)(\d{16})",
                lambda m: m[1] + f"{int(m[2]) + round(1e4 * by):016d}",
                line,
            )
        lines.append(line)
    return "\n".join([*lines, ""])


def renamed(text: str, station: str, first: str, second: str) -> str:
    """The raw file with two names exchanged in the sights of a set-up."""
    lines, at = [], ""
    other = {first: second, second: first}
    for line in text.splitlines():
        name = line[NAME].lstrip("0")
        at = name if " 88" in line else at
        if at == station and name in other and " 21." in line:
            line = line[:8] + other[name].rjust(16, "0") + line[24:]
        lines.append(line)
    return "\n".join([*lines, ""])


def said(found: Survey) -> list[str]:
    return list(mistakes(adjust(found.network())).sentences)


def test_nothing_is_found_where_nothing_is_wrong(tmp_path: Path) -> None:
    """In 8 surveys without blunder there is one common cause at most: 0.1 % each are expected."""
    named = [s for seed in range(8) for s in said(survey(twin(seed), tmp_path, seed=seed))]
    assert len(named) <= 1, named


def test_20_mm_in_a_target_of_one_scan(made: Twin, tmp_path: Path) -> None:
    found = survey(made, tmp_path, moved={("S1", "N2"): np.array([0.0, 0.02, 0.0])})
    adjustment, log = snoop(found.network())
    first = log.steps[0]
    assert first.observation == "target centre S1 -> N2 (scan S1)"
    assert first.action == "switched off"
    assert first.gross_error == pytest.approx(0.02, abs=0.003)
    assert [s.observation for s in log.steps if s.action == "switched off"] == [first.observation]
    assert adjustment.sigma0_posterior < 1.2


@pytest.mark.parametrize("target", ["N2", "E4", "E7"])
def test_20_mm_between_total_station_and_scans(made: Twin, tmp_path: Path, target: str) -> None:
    move = np.array([0.012, -0.012, 0.0106])
    (cause,) = common_causes(
        adjust(survey(made, tmp_path, moved={("", target): move}).network())
    ).named
    assert f"target {target} is not in one place" in cause.sentence()
    assert (np.abs(cause.size + move) < 4 * cause.sigma).all()
    assert cause.statistic > 100


@pytest.mark.parametrize("station", ["A", "B", "C", "D", "E"])
def test_5_mm_in_a_height_of_instrument(made: Twin, tmp_path: Path, station: str) -> None:
    found = survey(made, tmp_path, lambda text: higher(text, station, 0.005))
    (cause,) = common_causes(adjust(found.network())).named
    assert cause.words.startswith(f"the height of instrument at {station} (1.")
    assert abs(cause.size[0] + 0.005) < 3.5 * cause.sigma[0]
    assert "too high" in cause.sentence()


@pytest.mark.parametrize("score", [-1e6, -1.0])
def test_a_cause_is_not_named_beside_a_doubt_that_explains_more(
    made: Twin, tmp_path: Path, score: float
) -> None:
    """Without the doubtful coordinate nothing is left; a lesser doubt changes nothing."""
    clean = adjust(survey(made, tmp_path).network())
    wrong = adjust(survey(made, tmp_path, lambda text: higher(text, "B", 0.005)).network())
    named = mistakes(wrong, clean, score).sentences
    assert bool(named) == (score == -1.0)


@pytest.mark.parametrize("target", ["B", "D"])
def test_6_mm_in_a_height_of_target(made: Twin, tmp_path: Path, target: str) -> None:
    found = survey(made, tmp_path, lambda text: taller(text, target, 0.006))
    (cause,) = common_causes(adjust(found.network())).named
    assert cause.words == f"the height of target at {target} (1.5060 m)"
    assert abs(cause.size[0] + 0.006) < 3.5 * cause.sigma[0]


@pytest.mark.parametrize(
    ("station", "first", "second"), [("C", "E4", "E6"), ("B", "N1", "N5"), ("D", "E1", "E3")]
)
def test_exchanged_names(made: Twin, tmp_path: Path, station: str, first: str, second: str) -> None:
    found = survey(made, tmp_path, lambda text: renamed(text, station, first, second))
    (sentence,) = said(found)
    assert f" {first} and {second} " in sentence or f" {second} and {first} " in sentence
    assert f"exchanged at {station}:" in sentence
    with pytest.raises(InputError, match=f"exchanged at {station}"):
        known_points(found)


def test_no_exchange_is_found_where_names_are_right(made: Twin, tmp_path: Path) -> None:
    network = survey(made, tmp_path).network()
    assert explain(network, adjust(network)) is None


def test_an_exchange_is_told_from_a_wild_reading(made: Twin, tmp_path: Path) -> None:
    """A direction that is wrong by a gon is one observation, not two names."""
    network = survey(made, tmp_path).network()
    table = [o.kind for o in network.observations].index("direction")
    direction = network.observations[table]
    direction.values[10] += np.pi / 200
    adjustment = adjust(network)
    assert explain(network, adjustment) is None
    worst = find_suspects(weigh(adjustment))[0]
    assert worst.key == (table, 10)
    assert "direction" in Network.describe(direction, 10, adjustment.state)


def test_the_report_names_them_first(made: Twin, tmp_path: Path) -> None:
    """Also where snooping then switches single observations off."""
    found = survey(made, tmp_path, lambda text: higher(text, "D", -0.005)).network()
    for settings in (AdjustmentSettings(), AdjustmentSettings(snoop=True)):
        content = adjust_network(found, settings)
        (named,) = [w for w in content.warnings if "in the way of one mistake" in w]
        assert "the height of instrument at D" in named
        assert "too low" in named
