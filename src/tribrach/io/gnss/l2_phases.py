"""GPS phases on L2 in files of RINEX 2: those of P(Y) and those of L2C, a quarter of a cycle apart.

RINEX 2 has one column L2. Some receivers write into it the phase of L2C where a satellite has that
signal and the phase of P(Y) where it has not. L2C lags P(Y) by 90 degrees (IS-GPS-200), so that
double differences between the two kinds of satellites, against a receiver that writes P(Y) for all,
are off by 0.25 cycles, and no integers fit. L2C phases that are moved by -0.25 cycles are those of
P(Y). Some receivers do that themselves, and nothing in the file says so: only a trial can tell. The
two kinds are known by bit 2 of the loss-of-lock indicator, which is set for phases that were
measured under anti-spoofing, which are those of P(Y).

L. Wanninger 2018, Detection of RINEX-2 files with mixed GPS L2P(Y)/L2C carrier phase observations,
Sensors 18:4507; RINEX 2.11, table A1. Method section 2.7.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

from tribrach.io.gnss.observation_file import RinexObservations, header_text, records_2

#: what makes a phase of L2C one of P(Y) [cycles]
SHIFT = -0.25
#: of either kind there are at least so many satellites: a trial decides what they mean
FEWEST = 1
#: bit of the loss-of-lock indicator: measured under anti-spoofing
_SPOOFED = 4
#: phases in RINEX 2 stay below this in their fourteen characters [cycles]
_LARGEST = 9.99e8
_NUMBER = re.compile(rb"-?\d+\.\d{3}")
_TYPES = "# / TYPES OF OBSERV"


@dataclass(frozen=True)
class MixedPhases:
    """GPS satellites of a file by the signal of their phases on L2."""

    precise: frozenset[str]  #: satellites with phases of P(Y) only
    civil: frozenset[str]  #: satellites with phases of L2C


def _column(file: RinexObservations) -> tuple[int, int] | None:
    """The place of L2 and the number of types; None where a file cannot have the mixture."""
    if file.version >= 3:
        return None
    lines, start = header_text(file.path, file.text)
    types = " ".join(text[6:] for label, text in lines if label == _TYPES).split()
    # types that change within the file would move the column
    if "L2" not in types or _TYPES.encode() in file.text[start:]:
        return None
    return types.index("L2"), len(types)


def _phases(
    file: RinexObservations, column: int, kinds: int
) -> Iterator[tuple[str, int, float, bool]]:
    """GPS phases on L2: satellite, offset in the text, value [cycles], whether it is of P(Y)."""
    down, across = divmod(column, 5)
    data = file.text
    for name, start in records_2(file, kinds):
        at = start
        for _ in range(down):
            at = data.find(b"\n", at) + 1 or len(data)
        line = data[at : at + 80].split(b"\n")[0]
        word, flag = line[16 * across : 16 * across + 14], line[16 * across + 14 :][:1]
        if name[:1] == "G" and _NUMBER.fullmatch(word.strip()):
            spoofed = flag.isdigit() and bool(int(flag) & _SPOOFED)
            yield name, at + 16 * across, float(word), spoofed


def mixed_l2(file: RinexObservations) -> MixedPhases | None:
    """Which GPS satellites have phases of P(Y) on L2 and which those of L2C."""
    place = _column(file)
    if place is None:
        return None
    counts: dict[bool, Counter[str]] = {True: Counter(), False: Counter()}
    for name, _, _, spoofed in _phases(file, *place):
        counts[spoofed][name] += 1
    civil = {name for name, n in counts[False].items() if n > counts[True][name]}
    precise = set(counts[True]) - civil
    if min(len(civil), len(precise)) < FEWEST:
        return None
    return MixedPhases(frozenset(precise), frozenset(civil))


def aligned_l2(file: RinexObservations) -> RinexObservations:
    """The file with its phases of L2C moved by -0.25 cycles."""
    place = _column(file)
    if place is None or mixed_l2(file) is None:
        return file
    text = bytearray(file.text)
    for _, at, value, spoofed in _phases(file, *place):
        if not spoofed and value and abs(value) < _LARGEST:
            text[at : at + 14] = b"%14.3f" % (value + SHIFT)
    return replace(file, text=bytes(text))
