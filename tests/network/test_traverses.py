"""Traverses are found in a network and close as they do on a form."""

from itertools import pairwise

import numpy as np
import pytest

from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.survey import Survey
from tribrach.network.traverses import Traverse, traverses
from tribrach.observations.sights import Directions, HorizontalDistances
from tribrach.units import SEC

#: control at both ends and beyond, and four new points between
CONTROL = {"A": (0.0, 300.0), "B": (0.0, 0.0), "C": (900.0, 100.0), "D": (900.0, 500.0)}
NEW = {"1": (180.0, 60.0), "2": (350.0, -20.0), "3": (540.0, 90.0), "4": (730.0, 30.0)}
PLACES = {name: np.array(place) for name, place in (CONTROL | NEW).items()}
SIGMA, SIGMA_DISTANCE = 2 * SEC, 0.002


def azimuth(a: str, b: str) -> float:
    return float(np.arctan2(*(PLACES[b] - PLACES[a])))


def adjusted(
    chain: str,
    seen: dict[str, str],
    control: str,
    turned: dict[str, float] | None = None,
    longer: dict[str, float] | None = None,
    rng: np.random.Generator | None = None,
    beyond: float = 0.0,
) -> Adjustment:
    """A chain whose set-ups see their neighbours and others; angles at some of them are wrong."""
    survey = Survey()
    for name in dict.fromkeys([*chain, *control]):
        held = name in control
        place = (*PLACES[name], 0.0) if held else (np.nan, np.nan, 0.0)
        role = "control" if held else "free"
        survey.point(name, place, free=(not held, not held, False), role=role)
    rows: list[tuple[str, str, float]] = []
    legs = list(pairwise(chain))
    noise = (lambda s: float(rng.normal(0, s))) if rng is not None else (lambda s: 0.0)
    for at in dict.fromkeys(chain):
        ahead = [b for a, b in legs if a == at]
        back = [a for a, b in legs if b == at]
        for to in dict.fromkeys([*back, *seen.get(at, ""), *ahead]):
            wrong = (turned or {}).get(at, 0.0) if to in ahead else 0.0
            wrong += beyond if at == chain[-1] and to in seen.get(at, "") else 0.0
            rows.append((at, to, azimuth(at, to) - 1.0 + wrong + noise(SIGMA)))
    start, end, value = (list(c) for c in zip(*rows, strict=True))
    survey.add(Directions, values=np.mod(value, 2 * np.pi), sigma=SIGMA, start=start, end=end,
               orientation=[f"o{s}" for s in start])  # fmt: skip
    lengths = [
        float(np.linalg.norm(PLACES[b] - PLACES[a])) + (longer or {}).get(a, 0.0)
        + noise(SIGMA_DISTANCE) for a, b in legs
    ]  # fmt: skip
    survey.add(HorizontalDistances, values=lengths, sigma=SIGMA_DISTANCE,
               start=[a for a, _ in legs], end=[b for _, b in legs])  # fmt: skip
    return adjust(survey.network())


def one(adjustment: Adjustment) -> Traverse:
    (found,) = traverses(adjustment)
    return found


ENDS = {"B": "A", "C": "D"}


def test_a_traverse_without_errors_closes() -> None:
    found = one(adjusted("B1234C", ENDS, "ABCD"))
    assert found.points == ("B", "1", "2", "3", "4", "C")
    legs = [np.linalg.norm(PLACES[b] - PLACES[a]) for a, b in pairwise("B1234C")]
    assert found.length == pytest.approx(sum(legs))
    assert abs(found.angle) < 1e-9
    assert found.plan < 1e-6
    assert found.sigma_angle == pytest.approx(SIGMA * np.sqrt(12))


def test_misclosures_are_those_of_a_form() -> None:
    """All six angles are put right by a sixth of what they are too large together."""
    wrong = {"1": 20 * SEC, "3": -8 * SEC}
    found = one(adjusted("B1234C", ENDS, "ABCD", wrong, {"2": 0.05}))
    assert found.angle == pytest.approx(12 * SEC, abs=1e-9)
    azimuths, reading = [], azimuth("B", "1") - 2 * SEC
    for before, at, after in zip("B123", "1234", "234C", strict=True):
        azimuths.append(reading)
        reading += azimuth(at, after) - azimuth(before, at) + wrong.get(at, 0.0) - 2 * SEC
    azimuths.append(reading)
    lengths = [np.linalg.norm(PLACES[b] - PLACES[a]) for a, b in pairwise("B1234C")]
    lengths[2] += 0.05
    end = PLACES["B"] + np.array([np.sin(azimuths), np.cos(azimuths)]) @ lengths
    off = end - PLACES["C"]
    assert (found.east, found.north) == pytest.approx(tuple(off), abs=1e-6)
    assert found.ratio == pytest.approx(found.length / np.hypot(*off))
    assert np.hypot(found.along, found.across) == pytest.approx(found.plan)
    assert found.along == pytest.approx(0.05, abs=0.01)
    assert found.angle_at == ""


@pytest.mark.parametrize("at", ["B", "1", "2", "3", "4", "C"])
def test_a_gross_angle_is_located(at: str) -> None:
    rng = np.random.default_rng(3)
    # at the last point the sight beyond it is turned, and the coordinates show nothing
    wrong, beyond = ({at: 200 * SEC}, 0.0) if at != "C" else ({}, 200 * SEC)
    found = one(adjusted("B1234C", ENDS, "ABCD", wrong, rng=rng, beyond=beyond))
    assert found.angle_at == at


def test_two_gross_angles_are_not() -> None:
    found = one(adjusted("B1234C", ENDS, "ABCD", {"1": 200 * SEC, "4": 150 * SEC}))
    assert found.angle_at == ""


def test_one_oriented_end_has_no_misclosure_of_angles() -> None:
    for seen in ({"B": "A"}, {"C": "D"}):
        found = one(adjusted("B1234C", seen, "ABCD", longer={"1": 0.03}))
        assert np.isnan(found.angle)
        assert found.plan == pytest.approx(0.03, abs=1e-4)


def test_a_ring_closes_on_itself() -> None:
    """A ring on one control point and the azimuth of its first leg."""
    found = one(adjusted("B1234CB", {"B": "A"}, "AB", {"2": 30 * SEC}))
    assert found.points[0] == found.points[-1] == "B"
    assert abs(found.angle) == pytest.approx(30 * SEC, abs=2e-6)
    assert np.isnan(found.along)
    # six angles: five of the ring and the one that closes it, put right by a sixth each
    azimuths, reading = [], azimuth("B", "1")
    for before, at, after in zip("B1234", "1234C", "234CB", strict=True):
        azimuths.append(reading)
        reading += azimuth(at, after) - azimuth(before, at) - 5 * SEC
        reading += 30 * SEC if at == "2" else 0.0
    azimuths.append(reading)
    lengths = [np.linalg.norm(PLACES[b] - PLACES[a]) for a, b in pairwise("B1234CB")]
    off = np.array([np.sin(azimuths), np.cos(azimuths)]) @ lengths
    assert found.plan == pytest.approx(np.hypot(*off), rel=1e-3)


def test_noise_closes_within_its_sigma() -> None:
    rng = np.random.default_rng(5)
    found = [one(adjusted("B1234C", ENDS, "ABCD", rng=rng)) for _ in range(200)]
    ratio = np.array([f.angle / f.sigma_angle for f in found])
    assert 0.86 < ratio.std() < 1.15
    assert not any(f.angle_at for f in found)


def test_networks_of_many_sights_have_none() -> None:
    """Where set-ups see more than two others there is no one way through."""
    every = {name: "".join(n for n in NEW if n != name) for name in NEW}
    assert traverses(adjusted("B1234C", ENDS | every, "ABCD")) != []
    survey = adjusted("B12341C", ENDS, "ABCD")
    assert all("1" not in f.points[1:-1] for f in traverses(survey))
