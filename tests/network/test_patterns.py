"""What nearly all set-ups have a little of is a pattern; what one has alone is a mistake."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.io.survey.formats import read
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.blunders.common_causes import common_causes
from tribrach.network.blunders.mistakes import mistakes
from tribrach.network.survey import Survey
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles
from tribrach.solution import AdjustmentSettings, solve
from tribrach.units import SEC

SETUPS, SETS = 12, 6
SIGMA = 5 * SEC


def campus(
    rng: np.random.Generator,
    *,
    shared: float = 0.0,
    within: float = 1.0,
    missing: dict[str, float] | None = None,
    heights: bool = False,
) -> Adjustment:
    """A levelled ring of set-ups that see four others each in six sets.

    Zenith angles have a stated sigma of 5"; ``shared`` is the standard deviation of what a set-up
    has in all of its sights, ``within`` that of each reading, both in the stated sigma. ``missing``
    is what an instrument stands higher than its height says [m].
    """
    turn = np.arange(SETUPS) * 2 * np.pi / SETUPS
    place = np.column_stack([150 * np.cos(turn), 150 * np.sin(turn), rng.normal(0, 4, SETUPS)])
    name = np.array([f"P{k}" for k in range(SETUPS)])
    start = np.repeat(np.arange(SETUPS), 4 * SETS)
    end = (start + np.tile([1, 2, SETUPS - 1, SETUPS - 2], SETUPS * SETS)) % SETUPS
    hi = np.where(heights, 1.5 + 0.01 * start, 0.0)
    standing = hi + np.array([(missing or {}).get(name[s], 0.0) for s in start])
    e, n, u = (place[end] - place[start]).T
    u = u - standing
    flat = np.hypot(e, n)
    common = np.abs(rng.normal(0, shared, SETUPS))[start] if shared else 0.0
    noise = SIGMA * (common + within * rng.normal(size=len(start)))
    ends = {"start": name[start], "end": name[end], "height_instrument": hi}
    survey = Survey()
    known = 1e-6 * np.eye(3)
    for k in (0, 4, 8):
        survey.point(name[k], place[k], covariance=known, role="control")
    sets = np.array([f"{a}/{k // 4 % SETS}" for k, a in enumerate(name[start])])
    hz = np.arctan2(e, n) + SIGMA * rng.normal(size=len(start))
    survey.add(Directions, values=hz % (2 * np.pi), sigma=SIGMA, orientation=sets, **ends)
    survey.add(ZenithAngles, values=np.arctan2(flat, u) + noise, sigma=SIGMA, **ends)
    far = np.hypot(flat, u) + 0.002 * rng.normal(size=len(start))
    survey.add(SlopeDistances, values=far, sigma=0.002, **ends)
    step = np.diff(place[:, 2], append=place[0, 2]) + 0.0005 * rng.normal(size=SETUPS)
    ring = {"start": name, "end": np.roll(name, -1)}
    survey.add(HeightDifferences, values=step, sigma=0.0005, **ring)
    return adjust(survey.network())


@pytest.mark.parametrize("heights", [False, True])
def test_what_all_setups_have_is_no_mistake_of_one(heights: bool) -> None:
    """The sets scatter by a third of their sigma, what they share is larger than it."""
    blamed, told = 0, 0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        adjustment = campus(rng, shared=1.2, within=0.3, heights=heights)
        found = common_causes(adjustment)
        blamed += len(found.named)
        if (pattern := found.pattern) is not None:
            told += 1
            assert pattern.count == SETUPS
            assert pattern.scatter > 2
            assert pattern.same_sign == SETUPS
            assert "none of them is shown to be a mistake" in pattern.sentence()
            assert pattern.sentence().count("with the same sign") == 1
    assert blamed == 0
    # a network without any rejected observation is not looked at
    assert told >= 1


def test_one_mistake_stands_out_of_a_pattern() -> None:
    for seed in range(3):
        adjustment = campus(
            np.random.default_rng(seed),
            shared=1.2,
            within=0.3,
            missing={"P3": 0.1},
            heights=True,
        )
        (cause,) = common_causes(adjustment).named
        assert cause.words == "the height of instrument at P3 (1.5300 m)"
        assert cause.size[0] == pytest.approx(0.1, abs=0.01)
        assert "too low" in cause.sentence()


def test_setups_without_blunder_are_silent() -> None:
    """At 0.1 % together in 10 networks."""
    found = [common_causes(campus(np.random.default_rng(100 + k))) for k in range(10)]
    assert not [f for f in found if f.named or f.pattern]


@pytest.mark.parametrize("missing", [{"P2": 0.008}, {"P2": 0.008, "P7": -0.010}])
def test_small_mistakes_of_few_setups_are_still_named(missing: dict[str, float]) -> None:
    """Eight sigmas; the others do not scatter."""
    for seed in range(3):
        found = common_causes(campus(np.random.default_rng(seed), missing=missing, heights=True))
        named = {c.words.split(" at ")[1].split()[0]: c for c in found.named}
        assert set(named) == set(missing)
        for name, size in missing.items():
            assert abs(named[name].size[0] - size) < 4 * named[name].sigma[0]


def test_a_height_that_nobody_gave_is_not_too_low() -> None:
    adjustment = campus(np.random.default_rng(1), missing={"P5": 1.512})
    sentence = mistakes(adjustment).sentences[0]
    assert "the height of instrument at P5 (none is given), its sights fit with +151" in sentence
    assert "too low" not in sentence


def test_a_real_survey_of_a_campus_is_not_blamed(shared_data: Path) -> None:
    """Accepted by its listing with a factor of 0.980; no heights of instruments are given."""
    folder = shared_data / "networks" / "starnet"
    paths = [folder / f"industry_case_combined_{part}.txt" for part in ("input", "output")]
    if not all(path.is_file() for path in paths):
        pytest.skip("industry_case_combined is not there")
    solved = solve(read(paths).network(), AdjustmentSettings())
    texts = [w.text for w in solved.warnings]
    assert not [t for t in texts if "in the way of one mistake" in t]
    (told,) = [t for t in texts if "in most cases" in t]
    assert "37 of 41 with the same sign: 5.2 times what their sigmas say, most at OOP" in told


def test_little_redundancy_names_nothing_that_leaves_a_misfit(shared_data: Path) -> None:
    """Two set-ups over one mark see the same point twice and disagree with control as well."""
    path = shared_data / "totalstation" / "geoeasy" / "ruide" / "group_1_obs.sdr"
    if not path.is_file():
        pytest.skip(f"{path.name} is not there")
    adjustment = adjust(read([path]).network())
    assert adjustment.dof < 15
    assert common_causes(adjustment).named == ()
