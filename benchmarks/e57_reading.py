"""Reading an E57 file in chunks, against the raw reader of pye57 that takes the scan as a whole.

Ours also drops invalid points, gives fields their types and colours their range, and never holds
more than a chunk. Each way runs in a process of its own, so that the peak memory is its.
"""

import json
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pye57

from benchmarks.figures import Cost, Figure, alone, cost_of, least, run

#: processes of each way
TURNS = 4


def make(path: Path, points: int) -> None:
    """Random points with intensity, colours, a grid and one tenth of them invalid."""
    rng = np.random.default_rng(0)
    data = {f"cartesian{axis}": rng.uniform(-20, 20, points) for axis in "XYZ"}
    data["intensity"] = rng.uniform(0, 1, points).astype(np.float32)
    for colour in ("Red", "Green", "Blue"):
        data[f"color{colour}"] = rng.integers(0, 256, points).astype(np.uint8)
    data["rowIndex"] = (np.arange(points) % 2000).astype(np.uint16)
    data["columnIndex"] = (np.arange(points) // 2000).astype(np.uint16)
    data["cartesianInvalidState"] = (rng.random(points) < 0.1).astype(np.int8)
    file = pye57.E57(str(path), mode="w")
    file.write_scan_raw(data)
    file.close()


def raw(path: str) -> int:
    """All columns of the scan at once."""
    file = pye57.E57(path)
    data = file.read_scan_raw(0)
    file.close()
    return len(data["cartesianX"])


def ours(path: str) -> int:
    """The same in chunks."""
    from tribrach.io.scans.e57 import read

    (scan,) = read(Path(path))
    return sum(len(chunk) + chunk.dropped for chunk in scan.chunks())


def measure(millions: float) -> Iterator[Figure]:
    """Both by turns, each in a process of its own; the least of each."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scan.e57"
        alone("e57_reading", "make", path, int(millions * 1e6))
        runs: dict[str, list[Cost]] = {"raw": [], "ours": []}
        for _ in range(TURNS):
            for way, costs in runs.items():
                costs.append(Cost(**alone("e57_reading", way, path)))
    best = {way: least(costs) for way, costs in runs.items()}
    told = f"{millions / best['ours'].wall:.1f} million points a second"
    size = f"{millions:g} million points"
    peer = "read_scan_raw of pye57, the scan at once"
    yield Figure(
        "E57 read in chunks, typed and checked", size, best["ours"], peer, best["raw"], told
    )


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["make", file, points]:
            make(Path(file), int(points))
            print("{}")
        case ["raw" | "ours" as way, file]:
            # the first also loads libraries and compiled code
            _, cost = cost_of(lambda: {"raw": raw, "ours": ours}[way](file), 3)
            print(json.dumps(asdict(cost)))
        case _:
            run(measure, full=(5,), small=(0.5,))
