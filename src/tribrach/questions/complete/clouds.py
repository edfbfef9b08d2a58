"""Clouds through the grid of completeness: every station of every file, chunk by chunk."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tribrach._types import Array, Progress
from tribrach.errors import InputError
from tribrach.geometry.triangles import covering_pieces
from tribrach.io.json_file import read_json
from tribrach.io.models.formats import is_model, read_model
from tribrach.io.poses.names import POSES
from tribrach.io.scans.formats import read_scans
from tribrach.questions.complete.completeness import (
    Completeness,
    PatchGrid,
    SurfacePatches,
    assess_completeness,
)
from tribrach.scan.no_return import screened
from tribrach.scan.scan import Chunk, Scan

# Which station was a cloud taken from? The file of poses beside it knows.
#
# One station may have several scans, each with a cloud of its own; a merged cloud numbers its scans
# in the order of that file.


@dataclass(frozen=True)
class StationNames:
    """Names of scans and their stations, in order; both empty where no file of poses is."""

    scans: tuple[str, ...] = ()
    stations: tuple[str, ...] = ()

    def of_cloud(self, path: Path) -> str | None:
        """The station of a cloud with one scan; None if the poses do not name it."""
        stem = path.stem.removesuffix(".copc")
        for scan, station in zip(self.scans, self.stations, strict=True):
            if stem in (scan, _plain(scan)):
                return station
        return None

    def of_number(self, number: int) -> str | None:
        """The station of a scan in a merged cloud; None if the poses have fewer."""
        return self.stations[number] if 0 <= number < len(self.stations) else None


def station_names(folder: Path) -> StationNames:
    """The names that the file of poses in a folder gives."""
    path = folder / POSES
    if not path.is_file():
        return StationNames()
    try:
        rows = read_json(path)["scans"]
        names = tuple((str(row["scan"]), str(row["station"])) for row in rows)
    except (ValueError, TypeError, KeyError) as error:
        raise InputError(
            "this is no file of poses", file=path, cure="run the project again, or move it away"
        ) from error
    return StationNames(tuple(scan for scan, _ in names), tuple(station for _, station in names))


def _plain(name: str) -> str:
    """The name of a scan as files are named after it."""
    return "".join(c if c.isalnum() or c in "-_." else "_" for c in name).strip(".")


_SIGMAS = ("sigma_x", "sigma_y", "sigma_z")


def complete_clouds(
    clouds: Sequence[Path],
    model: Path | None,
    size: float,
    required: float | None,
    progress: Progress,
) -> Completeness:
    """Completeness of clouds on their union or on a model.

    A scan is a station, unless the poses beside its file or its own field ``station`` say more.
    size : of cells [m]; required : three-dimensional sigma [m]; progress : called with a name,
    points done, points in all.
    """
    _refuse_twice(clouds)
    grid = _grid(clouds[0], size)
    stations: dict[str, SurfacePatches] = {}
    for path in clouds:
        names = station_names(path.parent)
        for scan in map(screened, read_scans(path)):
            if required is not None and not set(_SIGMAS) <= set(scan.names):
                raise InputError(
                    f"{scan.source} has no sigmas of points",
                    file=path,
                    cure="give clouds as Tribrach writes them, or leave the required sigma out",
                )
            _count(scan, grid, stations, names, progress)
    for patches in stations.values():
        patches.merge()
    if not any(len(patches.keys) for patches in stations.values()):
        raise InputError("the clouds have no points", file=clouds[0], cure="give others")
    surface = None if model is None else _surface(model, grid)
    found = assess_completeness(grid, stations, model=surface, required=required)
    if not found.cells:
        raise InputError(
            f"no cell of {grid.size:g} m holds enough points for a surface",
            file=clouds[0],
            cure="give clouds with more points, or larger cells",
        )
    return found


def _refuse_twice(clouds: Sequence[Path]) -> None:
    """A file that counts twice would look like two stations."""
    seen = set()
    for path in clouds:
        if path.resolve() in seen:
            raise InputError("the cloud is given twice", file=path, cure="give it once")
        seen.add(path.resolve())


def _grid(path: Path, size: float) -> PatchGrid:
    """The grid around the first points of a cloud."""
    for scan in read_scans(path):
        for chunk in scan.chunks():
            if len(chunk):
                return PatchGrid.around(_world(scan, chunk), size)
    raise InputError("the cloud has no points", file=path, cure="give another")


def _world(scan: Scan, chunk: Chunk) -> Array:
    """Points (n, 3) of a chunk, placed by the pose of their scan if it has one."""
    return chunk.xyz if scan.pose is None else scan.pose @ chunk.xyz


def _count(
    scan: Scan,
    grid: PatchGrid,
    stations: dict[str, SurfacePatches],
    names: StationNames,
    progress: Progress,
) -> None:
    """Count the points of a scan for its station, or for the stations that its points name."""
    known = names.of_cloud(scan.path)
    own = known or scan.name
    while known is None and own in stations:
        own += "'"
    done = 0
    for chunk in scan.chunks():
        keys, variance = grid.keys(_world(scan, chunk)), _variance(chunk)
        numbers = chunk.values.get("station")
        if numbers is None:
            stations.setdefault(own, SurfacePatches()).add(keys, variance)
        else:
            for number in np.unique(numbers):
                members = numbers == number
                part = None if variance is None else variance[members]
                name = names.of_number(int(number)) or f"{own} {number:g}"
                stations.setdefault(name, SurfacePatches()).add(keys[members], part)
        done += len(chunk)
        progress(scan.source, done, scan.records)


def _variance(chunk: Chunk) -> Array | None:
    """Squared three-dimensional sigmas (n,) [m^2], None without sigmas."""
    if not all(name in chunk.values for name in _SIGMAS):
        return None
    sigma = np.stack([chunk.values[name] for name in _SIGMAS], axis=1).astype(np.float64)
    variance: Array = np.nan_to_num((sigma**2).sum(axis=1))
    return variance


def _surface(model: Path, grid: PatchGrid) -> SurfacePatches:
    """Cells of a model: of its triangles with their areas if it is a mesh, else of its points."""
    patches = SurfacePatches()
    if is_model(model):
        for xyz, areas in covering_pieces(read_model(model).triangles, grid.size / 3):
            patches.add(grid.keys(xyz), areas)
    else:
        for scan in map(screened, read_scans(model)):
            for chunk in scan.chunks():
                patches.add(grid.keys(_world(scan, chunk)))
    patches.merge()
    if len(patches.keys) == 0:
        raise InputError("the model has no points", file=model, cure="give another")
    return patches
