"""Warnings say what to do; what chance makes of a clean network is told and is no warning."""

import numpy as np
import pytest
from scipy.stats import norm

from tribrach.network.adjustment import adjust
from tribrach.network.quality import assess
from tribrach.network.survey import Survey
from tribrach.observations.levelling import HeightDifferences
from tribrach.report import text
from tribrach.report.build import build
from tribrach.report.content import Report


def repeated(*outliers: float, count: int = 276) -> Report:
    """One height difference measured 276 times: normal quantiles, some replaced [sigma]."""
    z = norm.ppf((np.arange(count) + 0.5) / count)
    z[: len(outliers)] = outliers
    survey = Survey()
    survey.point("A", (0, 0, 0), free=(False,) * 3, role="control")
    survey.point("B", (0, 0, np.nan), free=(False, False, True))
    survey.add(
        HeightDifferences,
        values=1.0 + 1e-3 * z,
        sigma=1e-3,
        start=["A"] * count,
        end=["B"] * count,
        source=[f"levels.csv:{k + 2}" for k in range(count)],
    )
    adjustment = adjust(survey.network())
    return build(adjustment, assess(adjustment))


def test_three_of_276_beyond_the_limit_are_told_as_chance() -> None:
    """The worst of 276 is beyond 3.73 in one clean network of twenty; 3.4 is none of those."""
    content = repeated(3.4, -3.4, 3.35)
    assert not any("uspicious" in warning for warning in content.warnings)
    chapter = content.chapter("adjustment")
    assert chapter is not None
    (sentence,) = [s for s in chapter.sentences if "by chance" in s]
    assert "3 of 276 tests are beyond the limit, 0.3 would be by chance" in sentence
    assert "nothing is to be done about height difference A -> B (levels.csv:" in sentence
    assert "0.3 would be by chance" in " ".join(text.brief(content).split())
    chance = content.quality.chance
    assert (chance.beyond, chance.tests, chance.act) == (3, 276, False)
    assert chance.expected == pytest.approx(0.276)
    assert chance.limit == pytest.approx(1 - 0.95 ** (1 / 276))


def test_more_than_chance_is_a_warning_that_says_what_to_do() -> None:
    content = repeated(3.4, 5.0)
    (warning,) = [w for w in content.warnings if "uspicious" in w]
    assert warning.startswith("Suspicious observations take part: height difference A -> B (levels")
    assert "levels.csv:3" in warning
    assert "in fewer than 5 of 100 networks like this" in warning
    assert "look into the field notes, or let snooping decide (--snoop" in warning
    assert content.quality.chance.act


def test_notes_tell_of_columns_that_are_there() -> None:
    def notes(content: Report) -> dict[str, str]:
        return {table.name: table.note for one in content.chapters for table in one.tables}

    assert "Likely error" in notes(repeated(3.4, 5.0))["worst"]
    clean = notes(repeated())
    assert "Likely error" not in clean["worst"]
    # A is held and nothing else is given
    assert clean["control"].startswith("Held coordinates are taken as free of errors")


def test_clean_networks_are_told_to_act_as_seldom_as_stated() -> None:
    """Of 80 networks of 60 values 5 %: 4 with a sigma of 2; 13 once in 10,000 times."""
    rng, acts = np.random.default_rng(3), 0
    for _ in range(80):
        survey = Survey()
        survey.point("A", (0, 0, 0), free=(False,) * 3, role="control")
        survey.point("B", (0, 0, np.nan), free=(False, False, True))
        values = 1 + 1e-3 * rng.standard_normal(60)
        ends = {"start": ["A"] * 60, "end": ["B"] * 60}
        survey.add(HeightDifferences, values=values, sigma=1e-3, **ends)
        acts += assess(adjust(survey.network())).chance.act
    assert acts <= 12


def test_little_redundancy_is_named() -> None:
    survey = Survey()
    survey.point("A", (0, 0, 0), free=(False,) * 3, role="control")
    for name in "BC":
        survey.point(name, (0, 0, np.nan), free=(False, False, True))
    survey.add(
        HeightDifferences,
        values=[1.0, 1.001, 2.0],
        sigma=[[0.001], [0.02], [0.001]],
        start=["A", "A", "B"],
        end=["B", "B", "C"],
        source=["levels.csv:2", "levels.csv:3", "levels.csv:4"],
    )
    adjustment = adjust(survey.network())
    warnings = build(adjustment, assess(adjustment)).warnings
    (none,) = [w for w in warnings if "controlled by no other" in w]
    assert none.startswith("1 of 3 values is controlled by no other")
    assert "height difference B -> C (levels.csv:4): observe these points a second time" in none
    (poor,) = [w for w in warnings if "redundancy number below 0.1" in w]
    assert "height difference A -> B (levels.csv:2): observe these points again" in poor
