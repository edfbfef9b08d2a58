"""Reading an E57 file in chunks, against the raw reader of pye57 that takes the scan as a whole.

Ours also drops invalid points, gives fields their types and colours their range, and never holds
more than a chunk. Each way runs in a process of its own, so that the peak memory is its.
Run: ``python benchmarks/e57_reading.py [millions of points, 5]``.
"""

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pye57

REPEATS = 8


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


def timed(way: str, path: Path) -> list[float]:
    """Wall and processor seconds, best of three, and peak memory [MB], in its own process."""
    return [float(word) for word in alone(way, str(path)).split()]


def alone(*arguments: str) -> str:
    """What this program prints in a process of its own."""
    command = [sys.executable, __file__, *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def main() -> None:
    millions = float(sys.argv[1]) if len(sys.argv) > 1 else 5.0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scan.e57"
        alone("make", str(path), str(int(millions * 1e6)))
        runs: dict[str, list[list[float]]] = {"raw": [], "ours": []}
        for _ in range(REPEATS):
            for way, figures in runs.items():
                figures.append(timed(way, path))
    best = {way: np.min(figures, axis=0) for way, figures in runs.items()}
    for way, (wall, cpu, peak) in best.items():
        print(
            f"{way}: {wall:.2f} s ({cpu:.2f} s of the processor), "
            f"{millions / wall:.1f} million points/s, peak {peak:.0f} MB"
        )
    ratio = best["ours"] / best["raw"]
    print(f"ratio: {ratio[0]:.2f} ({ratio[1]:.2f} of the processor)")


if __name__ == "__main__":
    if len(sys.argv) > 3:
        make(Path(sys.argv[2]), int(sys.argv[3]))
    elif len(sys.argv) > 2:
        function, times = {"raw": raw, "ours": ours}[sys.argv[1]], []
        for _ in range(3):  # the first also loads libraries and compiled code
            start = time.perf_counter(), time.process_time()
            function(sys.argv[2])
            times.append((time.perf_counter() - start[0], time.process_time() - start[1]))
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(*np.min(times, axis=0), peak)
    else:
        main()
