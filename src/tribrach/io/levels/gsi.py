"""Leica levels in GSI: words 331 to 336 are staff readings, 32 distances, 83 heights.

331 and 335 are the first and second reading to the backsight, 332 and 336 to the foresight, 333 to
an intermediate point, 330 and 334 readings that belong to no line. A code block (41) with a
question mark begins a line. Words 571 to 574 repeat what was read.
"""

from __future__ import annotations

import math
from pathlib import Path

from tribrach.io.levels.readings import LevelBook, LevelFile, StaffReading
from tribrach.io.opened_files import lines_of
from tribrach.io.totalstation.gsi import parse_words
from tribrach.io.totalstation.gsi import sniff as begins_as_gsi
from tribrach.io.totalstation.text import read_lines
from tribrach.units import LARGEST

_READINGS = {"331": "back", "335": "back", "332": "fore", "336": "fore", "333": "side"}
_CIRCLES = ("21", "22", "31")


def sniff(text: str) -> bool:
    """True if a text has blocks with staff readings and no angles."""
    if not begins_as_gsi(text):
        return False
    found = False
    for line in lines_of(text):
        words = {word.index for word in parse_words(line)} if line.strip() else set()
        if words & set(_CIRCLES):
            return False
        found |= bool(words & {*_READINGS, "330", "334"})
    return found


def read(path: Path) -> LevelFile:
    """Read a file."""
    book = LevelBook()
    for number, line in enumerate(read_lines(path), start=1):
        if not line.strip("\x02\x03\x04\x1a\t "):
            continue
        words = parse_words(line)
        if words and words[0].index == "41" and words[0].data.strip("0 ").startswith("?"):
            book.close()
        if not words or words[0].index != "11":
            continue
        by_index = {word.index: word for word in words}
        name = words[0].text
        try:
            readings = [(kind, by_index[w].value) for w, kind in _READINGS.items() if w in by_index]
            distance = by_index["32"].value if "32" in by_index else math.nan
            height = by_index["83"].value if "83" in by_index else math.nan
        except ValueError as error:
            book.problems.append((number, str(error)))
            continue
        for kind, value in readings:
            if not math.isnan(value):
                book.add(StaffReading(kind, name, value, distance, number))
        derived = name in book.computed or any(w.index.startswith("57") for w in words)
        if name and not readings and not derived and abs(height) < LARGEST:
            book.given.setdefault(name, (height, number))
    return book.file(path, "Leica GSI of a level")
