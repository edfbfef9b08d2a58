"""Which files are STAR*NET's: data of any suffix, project files, listings."""

from __future__ import annotations

import re
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.opened_files import lines_of
from tribrach.io.survey.starnet.text import data_line, text_of

#: suffixes of project files
PROJECTS = (".snproj", ".prj")
#: codes that data lines begin with
DATA_TYPES = frozenset(
    (
        *("C", "CH", "P", "PH", "E", "EH", "A", "B", "D", "V", "DV", "M", "BM"),
        *("DB", "DN", "DM", "DE", "TB", "T", "TE", "L", "G0", "G1", "G2", "G3", "SS", "I"),
    )
)
#: those without words
_BARE = ("DE", "TB", "G0")
#: lines that are looked at to recognise data
_LINES = 40
#: share of them that begin as they should; the others are told when the file is read
_SHARE = 0.75
_NUMBER = re.compile(r"[+-]?\d+(?:[.,]\d*)?$")
_LISTING = re.compile(r"^ +Summary of Files Used and Option Settings", re.MULTILINE)


def is_listing(text: str) -> bool:
    """Is a text a listing?"""
    return _LISTING.search(text[:4000]) is not None


def is_settings(path: Path) -> bool:
    """Is a file a project file or a listing, and no data?"""
    return path.suffix.lower() in PROJECTS or is_listing(text_of(path))


def _is_point_list(text: str) -> bool:
    """Is a text a list of points that happen to have the names of data types, as A, B and C?

    Every line is a name that no other line has, and two numbers or more.
    """
    names = []
    for line in lines_of(text)[:_LINES]:
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        if len(words) < 3 or not all(map(_NUMBER.match, words[1:3])):
            return False
        names.append(words[0])
    return len(names) > 1 and len(set(names)) == len(names)


def recognised(path: Path) -> bool:
    """Is a file data of STAR*NET, or a listing?

    Three of four lines that are looked at begin with a data type or an option, and there are
    numbers, or a file that is included.
    """
    try:
        text = text_of(path)
    except InputError:
        return False
    if is_listing(text):
        return True
    if _is_point_list(text):
        return False
    looked = known = numbers = 0
    for number, line in enumerate(lines_of(text), start=1):
        words = data_line(line, path, "", number)
        if words is None:
            continue
        option = words.code.startswith(".") and words.code[1:].isalnum()
        typed = words.code in DATA_TYPES and bool(words.words or words.code in _BARE)
        looked += 1
        known += option or typed
        numbers += any(character.isdigit() for character in "".join(words.words)) and typed
        numbers += option and words.code[:4] == ".INC"
        if looked == _LINES:
            break
    return numbers > 0 and known >= _SHARE * looked
