"""The page of all ratios, and the machine, versions and load they were measured with."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from benchmarks.figures import Cost, Figure, Growth
from benchmarks.record import Machine, Measured

HEAD = """# Benchmarks

Each row is one run: ours and a peer with the same data, one after the other. A peer is another
program, or an operation that no method avoids. **The ratio is ours over the peer: below 1 ours
takes less.** Ratios of the clock and of the processors' seconds differ where one of both uses more
than one core. Where sizes differ in their numbers alone, the row is that of the last, and ratios
of the others stand before its own. `python -m benchmarks --write` writes this page; what each
program does stands in its first lines, in the folder `benchmarks/`.

"""
#: share of a processor that others may take of a machine that is called idle
_IDLE = 0.1


def write_page(
    file: Path, where: Machine, measured: Mapping[str, Measured], names: Iterable[str]
) -> None:
    """Write the page, and its tables to the folder ``measured`` beside it.

    Parameters
    ----------
    file : Path
        Of the page.
    where : Machine
        The machine and the versions that all of it was measured with.
    measured : mapping
        By the names of benchmarks.
    names : iterable of str
        All benchmarks, in the order of the page.
    """
    runs = [measured[name] for name in names if name in measured]
    every = [figure for run in runs for figure in run.found]
    figures = [figure for figure in every if isinstance(figure, Figure)]
    growths = [growth for growth in every if isinstance(growth, Growth)]
    parts = [HEAD, _machine(where, runs)]
    parts += ["\n## Ratios\n\n", table(file, "ratios", _HEADS, by_size(map(_row, figures)))]
    if growths:
        heads = ("what", "sizes", "seconds", "grows with")
        parts += ["\n## Growth\n\n", table(file, "growth", heads, [_growth(g) for g in growths])]
    missing = sorted({f.peer for f in figures if f.theirs is None})
    if missing:
        parts.append(f"\nNot installed when this was measured: {', '.join(missing)}.\n")
    parts += ["\n## Runs\n\n", _runs(runs)]
    left = [f"`{name}`" for name in names if name not in measured]
    if left:
        parts.append(f"\nNot measured: {', '.join(left)}.\n")
    part = file.with_name(f".{file.name}.part")
    part.write_text("".join(parts), encoding="utf-8", newline="\n")
    part.replace(file)


def _machine(where: Machine, runs: Sequence[Measured]) -> str:
    dates = sorted(run.date for run in runs)
    lines = [
        f"* Date: {' to '.join(dict.fromkeys((dates[0], dates[-1])))} UTC",
        f"* Machine: {where.machine}",
        f"* {where.system}",
        f"* {where.packages}",
        f"* {_idle(runs)}",
    ]
    return "\n".join(lines) + "\n"


def _idle(runs: Sequence[Measured]) -> str:
    """A sentence on what else the machine did."""
    others = [run.others for run in runs if run.others is not None]
    if not others:
        return "What else the machine did is not known."
    least, most = min(others), max(others)
    if most <= _IDLE:
        return "The machine did nothing else."
    return (
        f"**The machine was not idle**: other programs kept {least:.2g} to {most:.2g} of its "
        f"{os.cpu_count()} processors busy meanwhile. Seconds are longer than they need be, those "
        "of the clock most, and ratios uncertain: both sides ran one after the other."
    )


def _runs(runs: Sequence[Measured]) -> str:
    """Which commits were measured, by what, and under what load."""
    least, most = min(run.load for run in runs), max(run.load for run in runs)
    lines = [
        "One program after the other; load averages when they began, which count what ran before: "
        f"{least:.1f} to {most:.1f}. Commits, with + where files had changed:\n\n"
    ]
    for tree in dict.fromkeys(run.tree for run in runs):
        names = (
            f"`{run.name}`" + ("" if run.sizes == "full" else f" ({run.sizes})")
            for run in runs
            if run.tree == tree
        )
        lines.append(f"* {tree}: {', '.join(names)}\n")
    return "".join(lines)


_HEADS = (
    "what", "size", "peer", "ratio", "ratio of the processors", "ours [s]", "peer [s]",
    "memory, ours / peer [MB]", "agreement",
)  # fmt: skip


def _row(figure: Figure) -> tuple[str, ...]:
    theirs = figure.theirs
    told = (figure.ratio(), figure.ratio("processor"))
    return (
        figure.what,
        figure.size,
        figure.peer,
        *("" if ratio is None else f"{ratio:.3g}" for ratio in told),
        f"{figure.ours.wall:.3g}",
        "not installed" if theirs is None else f"{theirs.wall:.3g}",
        " / ".join(_megabytes(cost) for cost in (figure.ours, theirs)).strip(" /"),
        figure.agreement,
    )


def by_size(rows: Iterable[tuple[str, ...]]) -> list[tuple[str, ...]]:
    """One row for sizes that differ in their numbers alone."""
    found: dict[tuple[str, ...], tuple[str, ...]] = {}
    for what, size, peer, *figures in rows:
        key = (what, re.sub(r"[\d.,]+", "0", size), peer)
        before = found.get(key, ("",) * 5)[3:5]
        ratios = (", ".join(filter(None, both)) for both in zip(before, figures, strict=False))
        found[key] = (what, size, peer, *ratios, *figures[2:])
    return list(found.values())


def _megabytes(cost: Cost | None) -> str:
    return "" if cost is None or cost.memory is None else f"{cost.memory:.0f}"


def _growth(growth: Growth) -> tuple[str, ...]:
    return (
        growth.what,
        ", ".join(f"{size:,.0f}" for size in growth.sizes),
        ", ".join(f"{seconds:.3g}" for seconds in growth.seconds),
        f"{growth.unit}^{growth.exponent():.2f}",
    )


def table(page: Path, name: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Write a table as CSV; returns the line by which ``docs/inserts.py`` puts it into the page."""
    folder = page.parent / "measured"
    folder.mkdir(exist_ok=True)
    with (folder / f"{name}.csv").open("w", encoding="utf-8", newline="") as out:
        csv.writer(out, lineterminator="\n").writerows([heads, *rows])
    return f"{{insert: measured measured/{name}.csv}}\n"
