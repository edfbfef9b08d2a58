"""A total station's raw file of a simulated survey: both faces, sets, axis errors of the day.

GSI with 16 characters of data, as Leica instruments write it: a block for each set-up with the
height of the instrument, and one for each sight. Readings scatter by themselves; errors of
centring and heights are those of occupations, and refraction is that of a set-up, as the
instrument's precision says.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.instruments.precision import Precision
from tribrach.simulate.surveying import eccentricities, refraction, true_sights
from tribrach.units import GON, SEC


@dataclass(frozen=True)
class InstrumentDay:
    """State of an instrument on one day."""

    #: collimation and index error [rad]
    collimation: float = 6 * SEC
    index: float = -4 * SEC
    sets: int = 2  #: that are measured
    twist: float = 3 * SEC  #: standard deviation by which the tripod turns from set to set [rad]
    #: share of the targets that are hidden in a set, in both faces; each is seen in one at least
    missing: float = 0.1


#: a day on which nothing turns and nothing is hidden
STILL = InstrumentDay(twist=0.0, missing=0.0)


def gsi(
    places: Mapping[str, Array],
    lines: Sequence[tuple[str, str]],
    height_instrument: Mapping[str, float],
    height_target: Mapping[str, float],
    precision: Precision,
    rng: np.random.Generator,
    day: InstrumentDay | None = None,
) -> str:
    """Raw file of sights, a set-up for each start; visible targets in face 1, then face 2."""
    day = day or InstrumentDay()
    direction, zenith, distance = true_sights(
        places,
        lines,
        height_instrument,
        height_target,
        refraction(lines, precision, rng),
        eccentricities(lines, precision, rng),
    )
    readings = _readings(direction, zenith, distance, precision, rng, day)
    setups: dict[str, list[int]] = {}
    for k, (start, _) in enumerate(lines):
        setups.setdefault(start, []).append(k)
    rows: list[list[str]] = []
    for start, sights in setups.items():
        turn = np.full(day.sets, rng.uniform(0, 2 * np.pi))
        if day.twist:
            turn += np.concatenate([[0.0], rng.normal(0, day.twist, day.sets - 1)])
        hidden = _hidden(day, len(sights), rng)
        rows.append([_name(start), _length("88", height_instrument.get(start, 0.0))])
        for one in range(day.sets):
            seen = [k for k, out in zip(sights, hidden[one], strict=True) if not out]
            for face, order in ((0, seen), (1, seen[::-1])):
                for k in order:
                    h, v, s = readings[:, one, face, k]
                    end = lines[k][1]
                    rows.append(
                        [
                            _name(end),
                            _angle("21", (h + turn[one]) % (2 * np.pi)),
                            _angle("22", v % (2 * np.pi)),
                            _length("31", s),
                            "51....+00000000000+0000",
                            _length("87", height_target.get(end, 0.0)),
                        ]
                    )
    blocks = [f"*11{k % 10000:04d}{words[0]} {' '.join(words[1:])} " for k, words in
              enumerate(rows, start=1)]  # fmt: skip
    return "\n".join([*blocks, ""])


def _readings(
    direction: Array,
    zenith: Array,
    distance: Array,
    precision: Precision,
    rng: np.random.Generator,
    day: InstrumentDay,
) -> Array:
    """Directions, zenith angles and distances (3, sets, faces, n) as the instrument reads them."""
    n = len(distance)
    assert precision.direction is not None
    assert precision.zenith is not None
    assert precision.distance is not None
    own = np.stack(
        [
            np.full(n, precision.direction),
            np.full(n, precision.zenith),
            precision.distance + precision.scale * distance,
        ]
    )
    noise = own[:, None, None] * rng.normal(size=(3, day.sets, 2, n))
    off = day.collimation / np.sin(zenith)
    both = np.stack(
        [
            np.stack([direction + off, direction + np.pi - off]),
            np.stack([zenith + day.index, 2 * np.pi - zenith + day.index]),
            np.stack([distance, distance]),
        ]
    )
    read: Array = both[:, None] + noise
    return read


def _hidden(day: InstrumentDay, n: int, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Which of n targets are hidden in which set (sets, n)."""
    if not day.missing:
        return np.zeros((day.sets, n), dtype=bool)
    out = rng.random((day.sets, n)) < day.missing
    out[rng.integers(day.sets, size=n), np.arange(n)] = False
    return out


def _name(name: str) -> str:
    """Sign and data of word 11."""
    return f"+{name.rjust(16, '0')}"


def _angle(index: str, value: float) -> str:
    """A word in units of 1e-5 gon."""
    return f"{index}.102+{round(value / GON * 1e5):016d}"


def _length(index: str, value: float) -> str:
    """A word in units of 0.1 mm."""
    return f"{index}...6{'-' if value < 0 else '+'}{round(abs(value) * 1e4):016d}"
