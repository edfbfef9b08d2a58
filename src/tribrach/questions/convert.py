"""Scans from one format into another, every field kept, placed by their own poses or not."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.clouds.formats import WRITERS, create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.scans.formats import read_scans
from tribrach.report.answer import Answer
from tribrach.scan.scan import Scan
from tribrach.shell.command import WRITTEN, command

__all__ = ["as_copc", "convert", "convert_scans"]

#: step of coordinates of clouds that come without one [m]
_FINEST = 1e-4
_NORMALS = ("normal_x", "normal_y", "normal_z")


@command(json=None, html=None)
def convert(
    source: Annotated[Path, typer.Argument(help="A file of scans.")],
    destination: Annotated[
        Path, typer.Argument(help="File to write: .las, .laz, .copc.laz, .ply or .e57."), WRITTEN
    ],
    placed: Annotated[bool, typer.Option(help="Apply the poses that the source has.")] = False,
    step_mm: Annotated[
        float, typer.Option(min=1e-3, max=10, help="Coordinate step of LAS and LAZ.")
    ] = 0.1,
    *,
    progress: Progress,
) -> Answer:
    """Write scans in another format, every field kept."""
    scans, step = read_scans(source), step_mm / 1e3
    made = convert_scans(scans, destination, placed=placed, step=step, progress=progress)
    lines = [f"{path}: {points} points" for path, points in made]
    return Answer("Scans in another format", "", None, made, terminal=lines)


def convert_scans(
    scans: Sequence[Scan],
    destination: Path,
    *,
    placed: bool,
    step: float,
    progress: Callable[[str, int, int | None], None],
) -> list[tuple[Path, int]]:
    """Write each scan; several into files with the scan's number before the suffix.

    placed : carry points by the pose of the scan, formats with a pose of their own keep it
    instead; step : of integer coordinates [m]. Returns files with their numbers of points.
    """
    paths = [_numbered(destination, number) for number in range(1, len(scans) + 1)]
    if len(scans) == 1:
        paths = [destination]
    sources = {scan.path.resolve() for scan in scans}
    for path in paths:
        if path.resolve() in sources:
            raise InputError(
                "the file would overwrite its source", file=path, cure="name another file"
            )
    return [
        (path, _convert(scan, path, placed, step, progress))
        for scan, path in zip(scans, paths, strict=True)
    ]


def as_copc(source: Path, *, path: Path, progress: Progress) -> int:
    """Write a cloud as COPC for a viewer, in the steps that it is stored in."""
    # the reader of LAS takes its time to load, and only some conversions need it
    from tribrach.io.clouds.copc_head import stored_step

    scans = read_scans(source)
    if len(scans) != 1:
        raise InputError(
            f"the file has {len(scans)} scans, and one cloud is made of one",
            file=source,
            cure='say format = "copc" in [cloud]',
        )
    placed, step = scans[0].pose is not None, stored_step(source) or _FINEST
    return _convert(scans[0], path, placed, step, progress)


def _numbered(path: Path, number: int) -> Path:
    """``a.copc.laz`` becomes ``a-2.copc.laz``."""
    name = path.name
    if not name:
        raise InputError("this is a folder, no file", file=path, cure="name a file in it")
    suffix = next((known for known in WRITERS if name.lower().endswith(known)), path.suffix)
    stem = name[: len(name) - len(suffix)]
    return path.with_name(f"{stem}-{number}{name[len(stem) :]}")


def _convert(
    scan: Scan,
    path: Path,
    placed: bool,
    step: float,
    progress: Callable[[str, int, int | None], None],
) -> int:
    keeps_pose = path.suffix.lower() == ".e57"
    if placed and scan.pose is None:
        raise InputError(
            f"scan {scan.name} has no pose to be placed by",
            file=scan.path,
            cure="leave --placed out, or run a project",
        )
    pose = scan.pose if placed and not keeps_pose and scan.pose is not None else Pose.identity()
    offset = np.zeros(3)
    if scan.bounds is not None and np.isfinite(scan.bounds).all():
        offset = np.round((pose @ scan.bounds).mean(axis=0), -1)
    elif pose.translation.any():
        offset = np.round(pose.translation, -1)
    header = CloudHeader(
        name=scan.name,
        fields=scan.fields,
        step=step,
        offset=offset,
        crs=scan.crs,
        pose=scan.pose if keeps_pose else None,
    )
    done = 0
    with ExitStack() as stack:
        writer = stack.enter_context(create(path, header))
        for chunk in scan.chunks():
            writer.write(pose @ chunk.xyz, _turned(chunk.values, pose))
            done += len(chunk)
            progress(scan.name, done, scan.records)
    return done


def _turned(values: Mapping[str, NDArray[Any]], pose: Pose) -> Mapping[str, NDArray[Any]]:
    """Values with the normals turned by a pose, if there are any."""
    if not all(name in values for name in _NORMALS):
        return values
    normals = np.stack([values[name] for name in _NORMALS], axis=1) @ pose.rotation.T
    return {**values, **dict(zip(_NORMALS, normals.astype(np.float32).T, strict=True))}
