"""How long commands take before they begin: processes as they are called from a shell.

The list of commands and the adjustment of ten observations are compared with a Python that imports
numpy and the sparse matrices of scipy, which any adjustment needs; the demo with no compiled loops
yet, which a second process compiles ahead, with the demo that follows it.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.figures import Cost, Figure, least, run, whole_process

PEER = "import numpy, scipy.sparse"
#: ten observations, one point from three
TEN = """\
<?xml version="1.0" ?>
<gama-local xmlns="http://www.gnu.org/software/gama/gama-local">
<network axes-xy="ne" angles="left-handed">
<parameters sigma-apr="1" conf-pr="0.95" tol-abs="1000" sigma-act="apriori"/>
<points-observations direction-stdev="10" distance-stdev="3">
<point id="A" x="1000" y="1000" fix="xy"/>
<point id="B" x="1200" y="1010" fix="xy"/>
<point id="C" x="1105" y="1160" fix="xy"/>
<point id="P" adj="xy"/>
<obs from="P">
<direction to="A" val="168.62126"/> <distance to="A" val="102.9588"/>
<direction to="B" val="314.13490"/> <distance to="B" val="117.0431"/>
<direction to="C" val="27.71097"/> <distance to="C" val="111.0194"/>
</obs>
<obs from="A">
<direction to="B" val="275.85596"/> <direction to="C" val="335.70431"/>
<direction to="P" val="304.95897"/> <distance to="P" val="102.9579"/>
</obs>
</points-observations>
</network>
</gama-local>
"""


def starts(turns: int, folder: Path) -> Iterator[Figure]:
    """Commands in alternation with the start of what they compute with; the least of each."""
    (folder / "ten.gkf").write_text(TEN, encoding="utf-8")
    # byte code of all of it is in a folder of its own, as an installer leaves it beside the sources
    kept = {
        "PYTHONPYCACHEPREFIX": str(folder / "bytecode"),
        "PYTHONDONTWRITEBYTECODE": "",
        "OPENBLAS_NUM_THREADS": "1",
    }
    adjust = ["-m", "tribrach", "adjust", str(folder / "ten.gkf")]
    commands = {
        PEER: ["-c", PEER],
        "tribrach --help": ["-m", "tribrach", "--help"],
        "tribrach adjust FILE": adjust,
        "tribrach adjust FILE --json": [*adjust, "-q", "--json", str(folder / "a.json")],
    }
    costs: dict[str, list[Cost]] = {name: [] for name in commands}
    for turn in range(turns + 1):
        for name, code in commands.items():
            cost = whole_process([sys.executable, *code], **kept)
            if turn:
                costs[name].append(cost)
    peer = least(costs.pop(PEER))
    for name, found in costs.items():
        size = "ten observations" if "adjust" in name else "no data"
        yield Figure(name, size, least(found), PEER, peer)


def demo(thousands: float, folder: Path) -> Figure:
    """The demo without compiled loops and then with them."""
    kept = {
        "NUMBA_CACHE_DIR": str(folder / "kernels"),
        "OPENBLAS_NUM_THREADS": "1",
        "TRIBRACH_COMPILE_AHEAD": "1",
    }
    words = [sys.executable, "-m", "tribrach", "demo", "--quiet"]
    words += [f"--points={1000 * thousands:.0f}"] if thousands else []
    first, second = (
        whole_process([*words, "--out", str(folder / name)], **kept) for name in ("one", "two")
    )
    size = f"{1000 * thousands:,.0f} points a station" if thousands else "its own size"
    return Figure("tribrach demo, nothing compiled yet", size, first, "the second time", second)


def measure(turns: float, *demos: float) -> Iterator[Figure]:
    """So many turns of small commands; demos of so many thousand points, 0 for its own size."""
    with tempfile.TemporaryDirectory() as name:
        yield from starts(int(turns), Path(name))
    for thousands in demos:
        with tempfile.TemporaryDirectory() as name:
            yield demo(thousands, Path(name))


if __name__ == "__main__":
    run(measure, full=(7, 0), small=(3,))
