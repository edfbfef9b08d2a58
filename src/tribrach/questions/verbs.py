"""What the commands of scans and scanners find, as Python objects; nothing is written.

Each function takes what the command of its name takes and gives the object that the command
writes as JSON.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from tribrach._types import Progress

if TYPE_CHECKING:
    from tribrach.calibration.self_calibration import SelfCalibration
    from tribrach.questions.compare.chapters import ComparedClouds
    from tribrach.questions.noise.estimate import NoiseEstimate
    from tribrach.questions.register.registration import RegisteredFiles


def register(
    files: Sequence[str | Path],
    *,
    poses: Sequence[str | Path] = (),
    approximate: bool = True,
    pairs: Literal["proposed", "all"] = "proposed",
    floor_mm: float = 1.0,
    floor_arcsec: float = 10.0,
    keep_no_return: bool = False,
    progress: Progress | None = None,
) -> RegisteredFiles:
    """Register scans by their clouds, as ``tribrach register``.

    Parameters
    ----------
    files : sequence of paths
        Scans, in their scanners' frames.
    poses : sequence of paths, optional
        Approximate poses, or folders with them.
    approximate : bool
        Poses beside the files or in them are tried, among others.
    pairs : {"proposed", "all"}
        Pairs that are needed, or all of them.
    floor_mm, floor_arcsec : float
        Standard deviations of shifts and turns that residuals do not show.
    keep_no_return : bool
        Points of beams without return are kept.
    progress : callable, optional
        Told of long steps: ``progress(what, done, total)``.

    Returns
    -------
    RegisteredFiles
        Poses with covariances, pairs and loops.

    Raises
    ------
    InputError
        A file that cannot be read, or too few scans.
    """
    from tribrach.questions.register.command import register as command

    options = {
        "poses": [Path(path) for path in poses] or None,
        "approximate": approximate,
        "pairs": pairs,
        "floor_mm": floor_mm,
        "floor_arcsec": floor_arcsec,
        "no_return": keep_no_return,
    }
    found: RegisteredFiles = _found(command, _paths(files), progress=progress, **options)
    return found


def noise(
    files: Sequence[str | Path],
    *,
    sheet: str | None = None,
    origin: tuple[float, float, float] | None = None,
    progress: Progress | None = None,
) -> NoiseEstimate:
    """Estimate the noise of a scanner from planes in its scans, as ``tribrach noise``.

    Parameters
    ----------
    files : sequence of paths
        Scans of one scanner in one mode.
    sheet : str, optional
        A model whose data sheet is compared, with its beam.
    origin : tuple of float, optional
        Where the scanner stood in the coordinates of the files [m].
    progress : callable, optional
        Told of long steps: ``progress(what, done, total)``.

    Returns
    -------
    NoiseEstimate
        The law of the noise with its sigmas, and what makes it doubtful.

    Raises
    ------
    InputError
        A file that cannot be read, or scans without planes.
    """
    from tribrach.questions.noise.command import noise as command

    options = {"sheet": sheet, "origin": origin}
    found: NoiseEstimate = _found(command, _paths(files), progress=progress, **options)
    return found


def calibrate(
    project: str | Path, *, estimable: bool = False, progress: Progress | None = None
) -> SelfCalibration:
    """Calibrate scanners from targets that they saw from several stations.

    As ``tribrach calibrate``.

    Parameters
    ----------
    project : path
        A project file with a section ``[calibration]``.
    estimable : bool
        Parameters that cannot be separated are left out.
    progress : callable, optional
        Told of long steps: ``progress(what, done, total)``.

    Returns
    -------
    SelfCalibration
        Parameters with their sigmas, tests and correlations.

    Raises
    ------
    InputError
        What the project or a file says wrong.
    AdjustmentError
        The network cannot be adjusted.
    """
    from tribrach.questions.calibrate.command import calibrate as command

    found: SelfCalibration = _found(command, Path(project), progress=progress, estimable=estimable)
    return found


def compare(
    a: str | Path,
    b: str | Path,
    *,
    sites: str | Path | None = None,
    method: Literal["c2c", "m3c2", "both"] = "both",
    poses: str | Path | None = None,
    limit_m: float | None = None,
    moved: bool = False,
    progress: Progress | None = None,
) -> ComparedClouds:
    """Compare two clouds, on test sites or as a whole, as ``tribrach compare``.

    Parameters
    ----------
    a, b : path
        The compared cloud, and the reference.
    sites : path, optional
        A table of test sites.
    method : {"c2c", "m3c2", "both"}
        Nearest points, along normals, or both.
    poses : path, optional
        The ``poses.json`` of the clouds, the one in their folder if not given.
    limit_m : float, optional
        Longest distance that is compared [m], that of the command if not given.
    moved : bool
        What moved as rigid parts is said as well.
    progress : callable, optional
        Told of long steps: ``progress(what, done, total)``.

    Returns
    -------
    ComparedClouds
        Distances beside their sampling floor and what was predicted.

    Raises
    ------
    InputError
        A file that cannot be read, or clouds without anything in common.
    """
    from tribrach.questions.compare.command import compare as command
    from tribrach.tasks.engine import HERE

    options: dict[str, Any] = {
        "sites_file": None if sites is None else Path(sites),
        "method": method,
        "poses": None if poses is None else Path(poses),
        "what_moved": moved,
        "engine": HERE,
    }
    if limit_m is not None:
        options["limit_m"] = limit_m
    found: ComparedClouds = _found(command, Path(a), Path(b), progress=progress, **options)
    return found


def _paths(files: Sequence[str | Path]) -> list[Path]:
    """Paths of one file or of several."""
    return [Path(file) for file in ([files] if isinstance(files, str | Path) else files)]


def _found(
    command: Callable[..., None], *given: Any, progress: Progress | None, **options: Any
) -> Any:
    """What the function behind a command finds; what it refuses is raised."""
    quiet: Progress = progress or (lambda what, done, total: None)
    answer = inspect.unwrap(command)(*given, **options, progress=quiet)
    if answer.failure is not None:
        raise answer.failure
    return answer.result
