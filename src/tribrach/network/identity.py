"""The id of an observation: ``kind:from:to:file:n``, such as ``slope_distance:A:B:traverse.gsi:1``.

Reports, results and edits name an observation by its id. It consists of what a surveyor would say
of the observation, so it stays the same when other observations are switched off, when files are
given in another order, and whether the network is adjusted by itself or within a whole project:

* ``kind``: the name of the kind;
* ``from``, ``to``: names of its ends, empty where there is none;
* ``file``: where it was written, without folders; of two files with one name as many of their
  folders as tell them apart (``day1/traverse.gsi``); empty for observations that come from no file;
* ``n``: 1 for the first of those that agree in all of this, 2 for the second, in the order of
  their lines.

A colon or backslash within a part has a backslash before it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import PurePath
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tribrach.observations.base import Observations
from tribrach.observations.unknowns import Layout

AnyPath = TypeVar("AnyPath", bound=PurePath)

#: ``scan: what was found in it``
_WITH_WORDS = re.compile(r"(.+?): ")
_SPECIAL = re.compile(r"([\\:])")
#: numbers of lines with more digits are none
_DIGITS = 18


def escaped(part: str) -> str:
    r"""A part of an id, colons and backslashes with a backslash before them.

    Examples
    --------
    >>> escaped("pillar 4:2")
    'pillar 4\\:2'
    """
    return _SPECIAL.sub(r"\\\1", part) if ":" in part or "\\" in part else part


def file_and_line(source: str) -> tuple[str, int]:
    """What an observation was written in, and its line; 0 where it has none.

    >>> file_and_line("traverse.gsi:43")
    ('traverse.gsi', 43)
    >>> file_and_line("S1: checkerboard")
    ('S1', 0)
    >>> file_and_line("scale bar 1")
    ('scale bar 1', 0)
    """
    file, _, line = source.rpartition(":")
    if file and len(line) <= _DIGITS and line.isascii() and line.isdigit() and "\n" not in file:
        return file, int(line)
    words = _WITH_WORDS.match(source)
    return (words[1] if words else source), 0


def names_apart(paths: Iterable[AnyPath]) -> dict[AnyPath, str]:
    """Tell files of one name apart by their folders.

    >>> apart = names_apart(map(PurePath, ["job/day1/a.gsi", "job/day2/a.gsi", "job/b.csv"]))
    >>> list(apart.values())
    ['day1/a.gsi', 'day2/a.gsi', 'b.csv']
    """
    whole = list(dict.fromkeys(paths))
    ends: Counter[tuple[str, ...]] = Counter()
    for path in whole:
        ends.update(path.parts[-k:] for k in range(1, len(path.parts) + 1))
    out = {}
    for path in whole:
        lengths = range(1, len(path.parts) + 1)
        # a path that another one ends with is given whole
        length = next((k for k in lengths if ends[path.parts[-k:]] == 1), len(lengths))
        out[path] = PurePath(*path.parts[-length:]).as_posix()
    return out


def observation_ids(
    tables: Sequence[Observations], layout: Layout
) -> tuple[NDArray[np.object_], ...]:
    """Ids (n,) of all observations of each table; see the head of this module.

    Returns (n,): .
    """
    sources = [str(source) for o in tables for source in o.source]
    places = [file_and_line(source) for source in sources]
    files = dict.fromkeys(file for file, _ in places)
    paths = {file: PurePath(file.replace("\\", "/")) for file in files if file}
    apart = names_apart(paths.values())
    written = {file: escaped(apart[path]) for file, path in paths.items()} | {"": ""}
    starts: list[str] = []
    ends: list[str] = []
    for o in tables:
        for names, column in zip((starts, ends), o.end_names(layout), strict=True):
            listed = column.tolist()
            written_of = {name: escaped(str(name)) for name in dict.fromkeys(listed)}
            names += [written_of[name] for name in listed]
    kinds = [kind for o in tables for kind in [escaped(o.kind)] * len(o)]
    stems = [
        f"{kind}:{start}:{end}:{written[file]}"
        for kind, start, end, (file, _) in zip(kinds, starts, ends, places, strict=True)
    ]
    rank = {group: k for k, group in enumerate(sorted({o.group for o in tables}))}
    groups = np.array([rank[o.group] for o in tables for _ in range(len(o))], dtype=np.int64)
    lines = np.array([line for _, line in places], dtype=np.int64)
    ids = np.empty(len(stems), dtype=object)
    count: dict[str, int] = {}
    for k in np.lexsort((groups, lines)).tolist():
        stem = stems[k]
        number = count[stem] = count.get(stem, 0) + 1
        ids[k] = f"{stem}:{number}"
    last = np.cumsum([len(o) for o in tables])
    return tuple(np.split(ids, last[:-1])) if len(tables) else ()
