"""Comp3D's project file (``.comp``): which files, which grid, which kind of computation.

It is JSON after ``data=`` and also holds the results of the last run, which are not read. Without a
project file the files themselves are named and the defaults of a local system are taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, pi
from pathlib import Path
from typing import Any

from tribrach.errors import InputError
from tribrach.geodesy.projection import ProjectedGrid, stereographic
from tribrach.io.json_file import LENIENT
from tribrach.io.keeping import keep
from tribrach.io.named_files import named_file
from tribrach.io.xml_file import MAX_BYTES
from tribrach.units import GON, LARGEST

#: latitude [degrees] of a local system that states none
DEFAULT_LATITUDE = 45.0
DEFAULT_REFRACTION = 0.12
#: radians of the angular unit, by the project file's number for it
_UNITS = {0: 1.0, 1: GON, 2: pi / 180}


@dataclass(frozen=True)
class Comp3dProject:
    """The entries of a project besides points and observations."""

    name: str  #: of the project
    folder: Path  #: of its files
    #: names of the files
    points: str
    observations: str
    grid: ProjectedGrid | None  #: none where only the coordinates can tell where the project is
    unit: float  #: radians of the files' angular unit
    refraction: float  #: coefficient of refraction
    inner_constraints: bool  #: the project uses inner constraints
    simulation: str  #: "" or the kind of simulation, for which measured values do not count
    covariance: str = ""  #: name of the file with covariances of weighted coordinates, "" for none


def read_project(paths: Sequence[Path]) -> Comp3dProject:
    """The project of a ``.comp`` file, or of an ``.obs`` and a ``.cor`` file."""
    if len(paths) == 1 and paths[0].suffix.lower() == ".comp":
        return _from_json(paths[0])
    by_kind = {path.suffix.lower(): path for path in paths}
    points = by_kind.get(".cor") or by_kind.get(".new")
    observations = by_kind.get(".obs")
    if points is None or observations is None or len(paths) != 2:
        raise InputError(
            "Comp3D files are one .comp project, or one .obs and one .cor file",
            record=" ".join(path.name for path in paths),
            cure="give the other one with it; of a file that Comp3D did not write make a CSV table",
        )
    if points.parent.resolve() != observations.parent.resolve():
        raise InputError("both files must be in one folder", file=points.name)
    return Comp3dProject(
        name=observations.stem,
        folder=observations.parent,
        points=points.name,
        observations=observations.name,
        grid=None,
        unit=GON,
        refraction=DEFAULT_REFRACTION,
        inner_constraints=False,
        simulation="",
    )


def _from_json(path: Path) -> Comp3dProject:
    config = _config(path)
    names = [_entry(config, key, str, path) for key in ("root_COR_file", "root_OBS_file")]
    kind = _entry(config, "compute_type", int, path)
    unit = _entry(config, "files_unit", int, path)
    if kind not in (0, 1, 2) or unit not in _UNITS:
        raise InputError(f"unknown compute_type {kind} or files_unit {unit}", file=path.name)
    return Comp3dProject(
        name=str(config.get("name") or path.stem),
        folder=path.parent,
        points=_beside(names[0], path),
        observations=_beside(names[1], path),
        grid=_grid(config, path),
        unit=_UNITS[unit],
        refraction=float(_entry(config, "refraction", (int, float), path)),
        inner_constraints=bool(config.get("internal_constraints")),
        simulation=("", "propagation of variances", "Monte Carlo")[kind],
        covariance=_covariance(config, path),
    )


def _covariance(config: dict[str, Any], path: Path) -> str:
    """Name of the file with covariances of coordinates, "" for none."""
    given: str = _entry({"coord_cov_file": "", **config}, "coord_cov_file", str, path)
    return _beside(given, path) if given else ""


def _beside(name: str, path: Path) -> str:
    """Name of a file that the project names; refused outside of the project's folder."""
    try:
        named_file(name, path.parent)
    except InputError as error:
        raise InputError(error.what, file=path.name, cure=error.cure) from error
    return name.replace("\\", "/")


def _grid(config: dict[str, Any], path: Path) -> ProjectedGrid:
    centre = _entry(config, "local_center", list, path)
    if len(centre) < 2 or not all(isinstance(c, int | float) and isfinite(c) for c in centre[:2]):
        raise InputError("local_center is not two numbers", file=path.name)
    easting, northing = float(centre[0]), float(centre[1])
    if config.get("use_proj"):
        definition = _entry(config, "proj_def", str, path).strip()
        # Comp3D takes places of any grid to latitude and longitude of WGS 84, heights as they are
        grid = ProjectedGrid(definition, easting, northing, geographic="EPSG:4326")
        try:
            _ = grid.site
        except InputError as error:
            raise InputError(error.what, file=path.name, cure=error.cure) from error
        return grid
    latitude = float(_entry(config, "center_latitude", (int, float), path))
    if not abs(latitude) < 89:
        raise InputError(f"center_latitude is {latitude:g} degrees", file=path.name)
    return ProjectedGrid(stereographic(latitude, easting, northing), easting, northing)


def _entry(config: dict[str, Any], key: str, kind: type | tuple[type, ...], path: Path) -> Any:
    value = config.get(key)
    far = isinstance(value, int | float) and not abs(value) < LARGEST
    if far or not isinstance(value, kind):
        raise InputError(f"{key} is {value!r}", file=path.name, record="config")
    return value


def _config(path: Path) -> dict[str, Any]:
    """The ``config`` object of a project file."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"larger than {MAX_BYTES // 1_000_000} MB", file=path.name)
        keep([path])
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path.name) from error
    except UnicodeDecodeError as error:
        raise InputError("not UTF-8", file=path.name) from error
    start = text.find("{")
    try:
        # control characters occur inside the strings that Comp3D writes
        document = LENIENT.raw_decode(text, max(start, 0))[0]
    except (ValueError, RecursionError) as error:
        raise InputError("broken JSON", file=path.name, line=getattr(error, "lineno", 1)) from error
    config = document.get("config") if isinstance(document, dict) else None
    if not isinstance(config, dict):
        raise InputError("there is no config object", file=path.name)
    return config
