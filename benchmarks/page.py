"""The page of all ratios, with the machine and the versions that they were measured with."""

from __future__ import annotations

import datetime
import os
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from benchmarks.figures import Cost, Figure, Growth

#: what the figures depend on
PACKAGES = (
    "tribrach", "numpy", "scipy", "numba", "laspy", "lazrs", "pye57",
    "py4dgeo", "small_gicp", "gtsam", "open3d", "dask",
)  # fmt: skip

HEAD = """# Benchmarks

Each row is one run: ours and a peer with the same data, one after the other. A peer is another
program, or an operation that no method avoids. **The ratio is ours over the peer: below 1 we are
faster.** Ratios of the clock and of the processors' seconds differ where one of both uses more
than one core. `python -m benchmarks --write` writes this page; what each program does stands in
its first lines, in the folder `benchmarks/`.

"""


def write_page(file: Path, found: Mapping[str, Sequence[Figure | Growth]]) -> None:
    """Write the page."""
    every = [figure for figures in found.values() for figure in figures]
    figures = [figure for figure in every if isinstance(figure, Figure)]
    growths = [growth for growth in every if isinstance(growth, Growth)]
    parts = [HEAD, _machine(), "\n## Ratios\n\n", _table(_HEADS, [_row(f) for f in figures])]
    if growths:
        heads = ("what", "sizes", "seconds", "grows with")
        parts += ["\n## Growth\n\n", _table(heads, [_growth(g) for g in growths])]
    missing = sorted({f.peer for f in figures if f.theirs is None})
    if missing:
        parts.append(f"\nNot installed when this was measured: {', '.join(missing)}.\n")
    file.write_text("".join(parts), encoding="utf-8", newline="\n")


def _machine() -> str:
    lines = [
        f"* Date: {datetime.datetime.now(datetime.UTC).date()}",
        f"* Machine: {_processor()}, {os.cpu_count()} cores, {_memory()}",
        f"* {platform.system()}, Python {platform.python_version()}",
        "* " + ", ".join(f"{name} {told}" for name in PACKAGES if (told := _version(name))),
    ]
    return "\n".join(lines) + "\n"


def _processor() -> str:
    told = Path("/proc/cpuinfo")
    if told.exists():
        for line in told.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _memory() -> str:
    size = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return f"{size / 2**30:.0f} GiB of memory"


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


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


def _megabytes(cost: Cost | None) -> str:
    return "" if cost is None or cost.memory is None else f"{cost.memory:.0f}"


def _growth(growth: Growth) -> tuple[str, ...]:
    return (
        growth.what,
        ", ".join(f"{size:,.0f}" for size in growth.sizes),
        ", ".join(f"{seconds:.3g}" for seconds in growth.seconds),
        f"{growth.unit}^{growth.exponent():.2f}",
    )


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)
