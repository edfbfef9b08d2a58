"""Work by scan on two workers against one, one thread each: targets, planes, samples and clouds.

A simulated courtyard, its scans once for each engine into a folder of its own, in turns: one
worker, two workers, as often as asked. The ratio by the clock says what a user sees on a machine
that does nothing else. The other one holds on a busy machine as well: seconds of the processor
that the one worker takes, with those of the program itself, over those of the busier of the two
workers, again with those of the program itself. Starting workers and the first task of each,
which loads compiled code, are left out.
"""

import hashlib
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import psutil

from benchmarks.figures import Cost, Figure, run
from tribrach import pipeline
from tribrach.io.twins import write_twin
from tribrach.simulate.twins import build
from tribrach.tasks.cluster import local_workers
from tribrach.tasks.engine import Call, Engine

STATIONS = ("S1", "S2", "S3", "S4", "S5", "S6")


def written(points: int, folder: Path) -> Path:
    """Six stations with one scan each, tied by spheres; planes are searched as well."""
    twin = build("sphere-courtyard", points, 1)
    scans = [one for one in twin.scans if one.name in STATIONS or one.name[:2] in STATIONS]
    stations = [station for station in twin.stations if station.name in STATIONS]
    project = write_twin(replace(twin, stations=stations, scans=scans), folder, truth=0)
    text = project.read_text()
    project.write_text(text + '\n[registration]\nby = ["targets", "planes"]\n')
    return project


def _spent() -> float:
    """Seconds of the processor that this worker has taken."""
    times = psutil.Process().cpu_times()
    return float(times.user + times.system)


@dataclass
class Seconds:
    """By the clock, of the program itself, of the busiest worker and of all workers."""

    clock: float = 0.0
    own: float = 0.0
    busiest: float = 0.0
    all: float = 0.0


class Timed:
    """An engine that notes what tasks cost, and nothing that is done between them."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        self.seconds = Seconds()

    def _processors(self) -> list[float]:
        client = self.engine.client()  # type: ignore[attr-defined]
        return [spent for _, spent in sorted(client.run(_spent).items())]

    def completed(self, task: Any, calls: Sequence[Call], progress: Any) -> Iterator[Any]:
        """See :meth:`tribrach.tasks.engine.Engine.completed`."""
        before, clock, own = self._processors(), time.perf_counter(), time.process_time()
        yield from self.engine.completed(task, calls, progress)
        self.seconds.clock += time.perf_counter() - clock
        self.seconds.own += time.process_time() - own
        spent = [b - a for a, b in zip(before, self._processors(), strict=True)]
        self.seconds.busiest += max(spent)
        self.seconds.all += sum(spent)


def by_scan(project: Path, folder: Path, engine: Engine) -> Seconds:
    """Seconds of all tasks of a run."""
    timed = Timed(engine)
    pipeline.run(project, folder, engine=timed)
    return timed.seconds


def digest(folder: Path) -> str:
    """Of all clouds."""
    state = hashlib.blake2b(digest_size=8)
    for path in sorted((folder / "clouds").iterdir()):
        state.update(path.name.encode() + path.read_bytes())
    return state.hexdigest()


def measure(points: float, turns: float) -> Iterator[Figure]:
    """Two workers against one, in turns; the least of each."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        small, project = (written(int(n), folder / str(n)) for n in (10_000, points))
        figures: dict[int, list[Seconds]] = {1: [], 2: []}
        digests = set()
        with local_workers(1, threads=1) as one, local_workers(2, threads=1) as two:
            for count, engine in ((1, one), (2, two)):
                # twice, so that each worker has done every kind of task
                for again in "ab":
                    by_scan(small, folder / f"warm{count}{again}", engine)
            for turn in range(int(turns)):
                for count, engine in ((1, one), (2, two)):
                    results = folder / f"{count}-{turn}"
                    figures[count].append(by_scan(project, results, engine))
                    digests.add(digest(results))
    alone, both = (
        Cost(min(t.clock for t in some), min(t.busiest + t.own for t in some))
        for some in figures.values()
    )
    together = [min(t.all for t in some) for some in figures.values()]
    told = f"clouds {'the same' if len(digests) == 1 else 'NOT the same'}; seconds of all workers "
    told += f"{together[1]:.1f}, of the one {together[0]:.1f}"
    size = f"six stations of {points:,.0f} points"
    yield Figure("work by scan on two workers", size, both, "one worker", alone, told)


if __name__ == "__main__":
    run(measure, full=(300_000, 3), small=(20_000, 1))
