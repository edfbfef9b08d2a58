"""Ratios that must not grow: those of the small sizes, with room for a busy machine.

Seconds are those of the processors, since they change least with what else a machine does.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.figures import Figure, Growth

#: the largest ratio of the processors' seconds by benchmark and by what it measures
FILE = Path(__file__).with_name("guard.toml")


def grown(found: Mapping[str, Sequence[Figure | Growth]], file: Path = FILE) -> list[str]:
    """A sentence for each ratio over its limit, and for each limit of something not measured."""
    limits = tomllib.loads(file.read_text(encoding="utf-8"))
    told = []
    for name, figures in found.items():
        of = dict(limits.get(name, {}))
        for figure in figures:
            if not isinstance(figure, Figure) or figure.theirs is None:
                continue
            ratio = figure.ratio("processor")
            limit = of.pop(figure.what, None)
            if limit is not None and ratio is not None and ratio > limit:
                told.append(
                    f"{name}, {figure.what}: {ratio:.2f} times {figure.peer}, the limit in "
                    f"{file.name} is {limit:g}"
                )
        peers = {f.what for f in figures if isinstance(f, Figure)}
        told += [
            f"{name}: {file.name} has a limit for {what!r}, which is not measured"
            for what in of
            if what not in peers
        ]
    return told
