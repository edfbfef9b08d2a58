"""Heads of lists of coordinates as they come from the field, in our own names.

``Punkt; Rechtswert; Hochwert; Höhe``, ``Id, Northing, Easting, Z``, ``sE [mm]``: the words that
surveyors put over columns in a number of languages. What a head means is told in a sentence, since
nobody wrote it in our words; what may mean two things is an error that asks.
"""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from tribrach.errors import InputError

#: words over columns by our name of the column, as :func:`letters` leaves them. German, English,
#: French, Spanish, Italian, Portuguese, Dutch, Czech, Polish
_WORDS: dict[str, str] = {
    "point": "point punkt punktnummer punktnr punktname punktbezeichnung punktid pktnr pkt pnr nr "
    "nummer name id no number num pt ptid ptno ptname pointid pointname pointno pointnumber "
    "pointnr pno station target mark matricule nom numero punto nombre nome ponto punt "
    "puntnummer puntnr naam bod cislobodu cbodu nrpunktu numerpunktu nrpkt",
    "easting": "easting east eastings e est este ost ostwert rechtswert rechts rw oost leste "
    "ecoord eastcoordinate ecoordinate rechtswerty",
    "northing": "northing north northings n nord norte nordwert hochwert hoch hw noord ncoord "
    "northcoordinate ncoordinate hochwertx",
    "height": "height elevation elev h z hohe hoehe u up level rl reducedlevel alt altitude cota "
    "elevacion elevacao altitud quota hoogte vyska wysokosc rzedna nhn hohenhn hoehenhn zcoord "
    "zcoordinate ellipsoidalheight ellh orthometricheight hellips hortho",
    "x": "x xcoord xcoordinate xkoordinate coordx",
    "y": "y ycoord ycoordinate ykoordinate coordy",
    "role": "role rolle rol ruolo papel",
    "comment": "code comment remark remarks description desc feature bemerkung kommentar note "
    "notes beschreibung art",
}
_MEANING = {word: name for name, words in _WORDS.items() for word in words.split()}
#: what stands before the axis in the head of a standard deviation
_SIGMA = re.compile(
    r"(?:standarddeviation|standardabweichung|stddev|stdev|stdabw|sigma|std|sd|rms|s|m)"
)
#: units as heads have them, by ours
_UNITS = {
    "m": "m", "meter": "m", "metre": "m", "meters": "m", "metres": "m", "mm": "mm", "cm": "cm",
    "km": "km", "ft": "ft", "feet": "ft", "foot": "ft", "usft": "usft", "ftus": "usft",
    "millimeter": "mm", "millimetre": "mm",
}  # fmt: skip
#: what stands in brackets, as units do
BRACKETS = re.compile(r"[\[(]([^\[\]()]*)[\])]")
_LAST = re.compile(r"^(.*?)[\s_/,.-]+(?:in\s+)?([A-Za-z]+)$")
#: sigmas of these columns
_AXES = ("easting", "northing", "height")
_NUMBER = re.compile(r"\s*[+-]?[\d.,'\u00a0 ]*\d[\d.,]*\s*$")
_FIX = "to the entry of the file"


class HeadQuestion(InputError):
    """A question for the user: unit of columns, or which of two columns is east.

    ``what``, ``cure``: the question, and where it is answered; ``point``: head or number of the
    column of names; ``coordinates``: heads or numbers of the columns of coordinates: two of the
    plan, and one of heights; ``usual``: which way the first of them points in most lists written
    so.
    """

    def __init__(
        self,
        what: str,
        *,
        file: Path,
        line: int,
        cure: str,
        point: str | int,
        coordinates: Sequence[str | int],
        usual: Literal["east", "north"] = "east",
    ) -> None:
        super().__init__(what, file=file, line=line, cure=cure)
        self.point, self.coordinates, self.usual = point, tuple(coordinates), usual


class AxesQuestion(HeadQuestion):
    """Whether X points east or north."""


@dataclass(frozen=True)
class Heads:
    """What heads mean."""

    #: our names of the columns with their units, "" for one that is left out
    names: tuple[str, ...]
    remarks: tuple[str, ...]  #: sentences about them without the stop


def letters(text: str) -> str:
    """Small letters and digits of a text, without accents."""
    lower = text.casefold().replace("ł", "l").replace("σ", "sigma").replace("№", "no")
    plain = unicodedata.normalize("NFKD", lower)
    return "".join(c for c in plain if c.isalnum() and c.isascii())


def coordinate_word(title: str) -> str | None:
    """The coordinate that a word over a column means, in any of the languages; None if none."""
    meaning = _MEANING.get(letters(title))
    return meaning if meaning in (*_AXES, "x", "y") else None


def _parts(title: str) -> tuple[str, str | None]:
    """Words and unit of a head, such as ``sE [mm]``."""
    for found in BRACKETS.finditer(title):
        unit = _UNITS.get(letters(found.group(1)))
        if unit is not None:
            return title[: found.start()] + title[found.end() :], unit
    title = BRACKETS.sub(" ", title)
    last = _LAST.match(title.strip())
    if last and last.group(2).lower() in _UNITS:
        return last.group(1), _UNITS[last.group(2).lower()]
    return title, None


def looks_headless(cells: Sequence[str]) -> bool:
    """True if the first row has numbers where heads should be."""
    filled = [cell for cell in cells if cell.strip()]
    return len(filled) > 2 and sum(bool(_NUMBER.match(cell)) for cell in filled) >= 2


def refuse_headless(path: Path, line: int, cells: Sequence[str]) -> None:
    """Refuse a list without heads."""
    numbers = [k for k, cell in enumerate(cells, start=1) if _NUMBER.match(cell)]
    # the first column is that of names, be they numbers or not
    places = [k for k in numbers if k > 1][:3]
    example = ", ".join(
        f"{name} = {k}" for name, k in zip(("easting", "northing", "height"), places, strict=False)
    )
    raise HeadQuestion(
        f"the list has no header: {', '.join(cells[:6])} stands in its first line",
        file=path,
        line=line,
        cure=f"write heads above the columns, or add columns = {{ point = 1, {example} }} {_FIX} "
        "if these are they",
        point=1,
        coordinates=places if len(places) > 1 else (2, 3),
    )


def named_columns(
    path: Path, line: int, titles: Sequence[str], columns: Mapping[str, str | int]
) -> list[str]:
    """Our names of the columns that a project names, "" for the others."""
    out = [""] * len(titles)
    plain = [" ".join(title.split()).casefold() for title in titles]
    for name, given in columns.items():
        if isinstance(given, int):
            if not 1 <= given <= len(titles):
                what = f"columns names column {given} as {name}, and there are {len(titles)}"
                raise InputError(what, file=path, line=line, cure="count columns from 1")
            at = given - 1
        else:
            wanted = " ".join(given.split()).casefold()
            if wanted not in plain:
                near = difflib.get_close_matches(wanted, plain, 1)
                cure = (
                    f"did you mean {titles[plain.index(near[0])]}"
                    if near
                    else (f"its columns are {', '.join(titles)}")
                )
                what = f"columns names {given} as {name}, which is no column"
                raise InputError(what, file=path, line=line, cure=cure)
            at = plain.index(wanted)
        if out[at]:
            what = f"columns names {titles[at]} as {out[at]} and as {name}"
            raise InputError(what, file=path, line=line, cure="name it once")
        own = _parts(titles[at])[1]
        out[at] = name if own is None or _has_unit(name) or name in _PLAIN else f"{name}_{own}"
    return out


#: names of ours that have no unit
_PLAIN = frozenset(
    ("point", "role", "use", "reason", "group", "comment", "from", "to", "at", "station", "target",
     "gnss", "mark", "set", "code", "setup", "face", "kind")
)  # fmt: skip


def _has_unit(name: str) -> bool:
    """True if one of our names ends in a unit."""
    return name.rpartition("_")[2] in (
        *_UNITS.values(),
        "gon",
        "deg",
        "dms",
        "mgon",
        "arcsec",
        "mm2",
        "m2",
    )


def heads_of(path: Path, line: int, titles: Sequence[str], known: Sequence[str]) -> Heads | None:
    """What the heads of a list of coordinates mean; None if it is none that we know."""
    names = list(known)
    said: dict[str, str] = {}
    units: set[str] = set()
    left: list[str] = []
    have = {_bare(name) for name in names if name}
    _refuse_held(path, line, titles)
    for k, title in enumerate(titles):
        if names[k] or not title.strip():
            continue
        words, unit = _parts(title)
        meaning = _MEANING.get(letters(words)) or _sigma(words)
        if meaning is None or _SAME.get(meaning, meaning) in have:
            left.append(title)
            continue
        have.add(_SAME.get(meaning, meaning))
        if meaning.startswith("sigma") and unit is None:
            raise InputError(
                f"column {title} is a standard deviation without a unit",
                file=path,
                line=line,
                cure=f"name it {title} [mm] or {title} [m], or add "
                f'columns = {{ {meaning}_mm = "{title}" }} {_FIX}',
            )
        plain = meaning in _PLAIN
        names[k] = meaning if plain else f"{meaning}_{unit or 'm'}"
        said[meaning] = title
        if not plain and unit is None:
            units.add(title)
    if {"e", "n"} <= have:
        # a second pair beside easting and northing, of whatever system
        for name in ("x", "y"):
            if name in said:
                names[titles.index(said[name])] = ""
                left.append(said.pop(name))
    places = {"e", "n", "u", "x", "y", "ecef_x"} & have
    if "point" not in have or not places or not said:
        return None
    _refuse_axes(path, line, titles, said, have)
    for title in left:
        _refuse_misspelt(path, line, title)
    foreign = {_parts(title)[1] for title in titles} - {None, "m", "mm"}
    if units and foreign:
        raise InputError(
            f"columns {', '.join(sorted(units))} have no unit, and others are in "
            f"{', '.join(sorted(filter(None, foreign)))}",
            file=path,
            line=line,
            cure="give every column its unit, such as E [m]",
        )
    means = [f"{title} is {name}" for name, title in said.items() if letters(title) != name]
    remarks = [f"heads are taken as follows: {', '.join(means)}"] if means else []
    if units:
        remarks.append(f"no unit is given for {', '.join(sorted(units))}: metres are taken")
    if left:
        remarks.append(f"columns that are left out: {', '.join(title.strip() for title in left)}")
    return Heads(tuple(names), tuple(remarks))


#: our short names of axes by the long ones
_SAME = {"easting": "e", "northing": "n", "height": "u", "z": "u", "code": "comment"}


def _bare(name: str) -> str:
    """A name without its unit, axes by their short names."""
    quantity = name.rpartition("_")[0] if _has_unit(name) else name
    return _SAME.get(quantity, quantity)


def _sigma(words: str) -> str | None:
    """Our name of a standard deviation, such as ``sigma_easting`` of ``sE``."""
    plain = letters(words)
    found = _SIGMA.match(plain)
    if found is None:
        return None
    axis = _MEANING.get(plain[found.end() :])
    if axis in _AXES:
        return f"sigma_{axis}"
    return {"x": "sigma_x", "y": "sigma_y"}.get(axis or "")


def _refuse_axes(
    path: Path, line: int, titles: Sequence[str], said: Mapping[str, str], have: set[str]
) -> None:
    """Ask which of X and Y is east: both ways are usual."""
    if not {"x", "y"} & set(said) or {"e", "n"} <= have:
        return
    point, x, y = (said.get(name, name.upper()) for name in ("point", "x", "y"))
    order = [t.strip() for t in titles]
    hint = ""
    if x in order and y in order and order.index(y) < order.index(x):
        hint = " (Y before X is usual where X points north)"
    raise AxesQuestion(
        f"columns {x} and {y}: does {x} point east or north{hint}",
        file=path,
        line=line,
        point=point,
        coordinates=(x, y),
        usual="north" if hint else "east",
        cure=f'add columns = {{ point = "{point}", easting = "{x}", northing = "{y}" }} {_FIX}, '
        "or the other way round",
    )


#: heads of columns that say which coordinates of a point are held
_HELD = re.compile(r"(?:is)?(?:fixed|fix|held|hold|fest|constrained)(?:[enuhxyz]|plan|height)$")


def _refuse_held(path: Path, line: int, titles: Sequence[str]) -> None:
    """Refuse columns that say of each coordinate whether it is held: they must not be left out."""
    held = [title.strip() for title in titles if _HELD.match(letters(title))]
    if held:
        raise InputError(
            f"column{'' if len(held) == 1 else 's'} {', '.join(held)} say which coordinates are "
            "held, one by one, which is not read",
            file=path,
            line=line,
            cure="write a column role with the word fixed for points that are held, and leave "
            "those of their coordinates empty that are not",
        )


def _refuse_misspelt(path: Path, line: int, title: str) -> None:
    """Refuse a head that is nearly one of a standard deviation: it must not be left out."""
    plain = letters(_parts(title)[0])
    usual = [
        f"{start}{axis}"
        for start in ("sigma", "std", "stddev")
        for axis in (*_AXES, "e", "n", "u", "h")
    ]
    near = difflib.get_close_matches(plain, usual, 1, cutoff=0.8) if len(plain) > 4 else []
    if near or plain.startswith(("sigma", "sigm")):
        raise InputError(
            f"column {title} is nearly the head of a standard deviation",
            file=path,
            line=line,
            cure=f"name it {near[0] if near else 'sigma_e_mm'} with its unit, or "
            f"say it with columns {_FIX}",
        )
