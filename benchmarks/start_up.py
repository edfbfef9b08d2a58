"""How long commands take before they begin: processes as they are called from a shell.

``start_up.py`` compares the list of commands and the adjustment of ten observations with a Python
that imports numpy and the sparse matrices of scipy, which any adjustment needs. ``start_up.py demo
[THOUSANDS]`` runs the demo (of its own size, or with so many thousand points at a station) with no
compiled loops yet and then with them, by the clock and of the processor. Seconds are the least of
several turns.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

#: turns of each command, in alternation
TURNS = 7
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


def seconds(code: list[str], folder: Path, **environment: str) -> tuple[float, float]:
    """Seconds of the processor and by the clock of one Python with these arguments."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(
        [sys.executable, *code],
        cwd=folder,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", **environment},
        stdout=subprocess.DEVNULL,
        check=True,
    )
    wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return used, wall


def starts(folder: Path) -> None:
    """Compare the start of commands with that of what they compute with."""
    (folder / "ten.gkf").write_text(TEN)
    # byte code of all of it is in a folder of its own, as an installer leaves it beside the sources
    kept = {"PYTHONPYCACHEPREFIX": str(folder / "bytecode"), "PYTHONDONTWRITEBYTECODE": ""}
    commands = {
        "import numpy, scipy.sparse": ["-c", "import numpy, scipy.sparse"],
        "tribrach --help": ["-m", "tribrach", "--help"],
        "tribrach adjust, 10 observations": ["-m", "tribrach", "adjust", "ten.gkf"],
        "the same with --json": ["-m", "tribrach", "adjust", "ten.gkf", "-q", "--json", "a.json"],
    }
    measured: dict[str, list[tuple[float, float]]] = {name: [] for name in commands}
    for turn in range(TURNS + 1):
        for name, code in commands.items():
            found = seconds(code, folder, **kept)
            if turn:
                measured[name].append(found)
    least = {
        name: [min(figures) for figures in zip(*m, strict=True)] for name, m in measured.items()
    }
    unit = least["import numpy, scipy.sparse"][0]
    for name, (used, wall) in least.items():
        print(
            f"{name:34s} {used:6.2f} s of the processor = {used / unit:4.2f} x   {wall:6.2f} s wall"
        )


def demo(folder: Path, points: list[str]) -> None:
    """Run the demo without compiled loops and then with them."""
    kept = {"NUMBA_CACHE_DIR": str(folder / "kernels")}
    figures = []
    for name in ("first", "second"):
        code = ["-m", "tribrach", "demo", "--quiet", "--out", name, *points]
        figures.append(seconds(code, folder, **kept))
        used, wall = figures[-1]
        print(f"{name:8s} demo: {wall:7.1f} s wall, {used:7.1f} s of the processor", flush=True)
    (used, wall), (used_again, wall_again) = figures
    print(f"first / second: {wall / wall_again:.2f} wall, {used / used_again:.2f} of the processor")


def main() -> None:
    """Measure starts, or the demo."""
    with tempfile.TemporaryDirectory() as name:
        if sys.argv[1:2] == ["demo"]:
            demo(Path(name), [f"--points={1000 * int(n)}" for n in sys.argv[2:3]])
        else:
            starts(Path(name))


if __name__ == "__main__":
    main()
