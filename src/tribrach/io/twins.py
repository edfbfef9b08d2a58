"""A twin on disk: scans, tables, project file, and the truth.

``truth/truth.json`` holds poses, points and what each station can see; ``truth/truth-SCAN.npz`` the
true places of a random share of the points that are no mixture of several surfaces: ``point`` (n,)
in the order of the file, ``xyz`` (n, 3) world [m].
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.outputs import write_bytes, write_texts
from tribrach.scan.scan import Field
from tribrach.simulate.scanner import Block
from tribrach.simulate.twin import Twin, TwinScan, child_rng

__all__ = ["write_twin"]

Array = NDArray[np.float64]

#: coordinate step on disk [m]
STEP = 1e-5
#: points of a scan whose truth is kept
TRUTH = 100_000

_FIELDS = (
    Field("intensity", "float32", 0.0, 1.0, "reflectance times cosine"),
    Field("row", "int32", description="row of the grid"),
    Field("column", "int32", description="column of the grid"),
)


def write_twin(
    twin: Twin,
    folder: Path,
    progress: Callable[[str, int, int], None] | None = None,
    truth: int = TRUTH,
) -> Path:
    """Simulate all scans of a twin and write everything; the path of the project file.

    progress : told the scan's name, directions done and their number; truth : points of each scan
    whose true place is kept.

    Raises
    ------
    InputError : a file cannot be written.
    """
    tell = progress or (lambda name, done, all_of_it: None)
    counts = {}
    for number, one in enumerate(twin.scans):
        counts[one.name] = _write_scan(twin, number, folder, tell, truth)
    path = folder / f"{twin.name}.toml"
    texts: dict[Path, str | bytes] = {folder / name: text for name, text in twin.files.items()}
    texts[folder / "truth" / "truth.json"] = json.dumps(truth_of(twin, counts), indent=1) + "\n"
    texts[path] = project_text(twin)
    write_texts(texts)
    return path


def _file(twin: Twin, one: TwinScan) -> str:
    return f"scans/{one.name}{twin.suffix}"


def _write_scan(
    twin: Twin, number: int, folder: Path, tell: Callable[[str, int, int], None], truth: int
) -> int:
    """One scan and its truth; the number of its points."""
    one = twin.scans[number]
    header = CloudHeader(one.name, _FIELDS, step=STEP)
    keeper = _Keeper(truth, child_rng(twin.seed, "truth"))
    done = 0
    tell(one.name, 0, one.rays)
    with create(folder / _file(twin, one), header) as writer:
        for block in twin.measure(number):
            values = {"intensity": block.intensity, "row": block.row, "column": block.column}
            writer.write(block.xyz, values)
            keeper.take(block)
            done += block.rays
            tell(one.name, done, one.rays)
    if truth and keeper.seen:
        write_bytes(folder / "truth" / f"truth-{_title(one)}.npz", keeper.packed())
    return keeper.seen


class _Keeper:
    """Keeps the truth of a random share of points that come in blocks."""

    def __init__(self, count: int, rng: np.random.Generator) -> None:
        self._count, self._rng, self.seen, self.mixed = count, rng, 0, 0
        self._lot, self._point, self._xyz = (
            np.empty(0),
            np.empty(0, dtype=np.int64),
            np.empty((0, 3)),
        )

    def take(self, block: Block) -> None:
        """The points of a block; those with the smallest lots stay."""
        alone = np.flatnonzero(~block.mixed)
        lot = np.concatenate([self._lot, self._rng.random(len(alone))])
        keep = np.sort(np.argsort(lot)[: self._count])
        self._lot = lot[keep]
        self._point = np.concatenate([self._point, self.seen + alone])[keep]
        self._xyz = np.concatenate([self._xyz, block.truth[alone]])[keep]
        self.seen += len(block)
        self.mixed += len(block) - len(alone)

    def packed(self) -> bytes:
        """Numbers in the file and world coordinates, as npz."""
        buffer = BytesIO()
        np.savez(buffer, point=self._point, xyz=self._xyz)
        return buffer.getvalue()


def _title(one: TwinScan) -> str:
    """The scan's name in a project, where a station may have several."""
    return one.name if one.name == one.station else f"{one.station} {one.name}"


def project_text(twin: Twin) -> str:
    """The project file: the twin's own sections, then its scans and stations."""
    parts = [twin.project]
    for one in twin.scans:
        parts.append(
            f'[[scans]]\nfile = "{_file(twin, one)}"\nstation = "{one.station}"\n'
            'instrument = "scanner"\norigin = "scanner"\n'
        )
    parts += list(_station_sections(twin))
    parts.append('[output]\nfolder = "out"\nangle = "gon"\n')
    return "\n".join(parts)


def _station_sections(twin: Twin) -> Iterator[str]:
    arms = twin.facts.get("lever_arms", {})
    for station in twin.stations:
        text = f"[stations.{station.name}]\nlevelled = {str(station.levelled).lower()}\n"
        text += 'instrument = "scanner"\n'
        if station.name in arms:
            text += f'lever_arm = "{arms[station.name]}"\n'
        yield text


def truth_of(twin: Twin, counts: dict[str, int]) -> dict[str, Any]:
    """The truth as JSON: metres, radians, poses as 4x4 world from scanner."""
    return {
        "twin": twin.name,
        "seed": twin.seed,
        "stations": {
            s.name: {
                "world_from_scanner": s.pose.matrix.tolist(),
                "levelled": s.levelled,
                "visible": twin.visible(s.name),
                "sights": {n: vars(sight) for n, sight in twin.sights[s.name].items()},
            }
            for s in twin.stations
        },
        "targets": {
            t.name: {
                "kind": t.kind,
                "size": t.size,
                "normal": None if t.normal is None else t.normal.tolist(),
            }
            for t in twin.targets
        },
        "points": {
            **{name: np.asarray(x).tolist() for name, x in twin.marks.items()},
            **{t.name: t.center.tolist() for t in twin.targets},
        },
        "scans": {
            one.name: {
                "file": _file(twin, one),
                "station": one.station,
                "points": counts.get(one.name, 0),
                "step": one.grid.step,
            }
            for one in twin.scans
        },
        "calibration": dict(twin.scanner.parameters),
        "facts": dict(twin.facts),
    }
