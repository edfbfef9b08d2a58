"""Files of scans registered by their clouds alone, and what is written of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tribrach._types import Array, Progress
from tribrach.cloud.placement import Placement
from tribrach.errors import InputError
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.geometry.pose import Pose
from tribrach.io.clouds.e57 import copy_with_poses
from tribrach.io.outputs import write_texts
from tribrach.io.scans.formats import read_scans
from tribrach.job.approximate_poses import NO_POSES, ApproximatePoses, approximate_poses
from tribrach.job.poses import joint_covariance, pose_texts
from tribrach.job.scans import StationScan
from tribrach.registration.clouds.pair import APPROXIMATE, ApproximateSigma
from tribrach.registration.clouds.prepared import PreparedScan, prepare
from tribrach.registration.clouds.proposals import Choice
from tribrach.registration.clouds.relative_covariance import GATES as COVARIANCE
from tribrach.registration.clouds.together import CloudRegistration, register_clouds
from tribrach.scan.no_return import screened
from tribrach.scan.scan import Scan

__all__ = ["RegisteredFiles", "register_files", "write_placed"]


@dataclass(frozen=True, eq=False)
class RegisteredFiles:
    """Scans by the names that they have in the registration, and the registration."""

    scans: dict[str, Scan]
    points: dict[str, int]
    registration: CloudRegistration
    approximate: ApproximatePoses = NO_POSES

    @property
    def sentences(self) -> tuple[str, ...]:
        """What was left out of the scans, and what the registration has to say."""
        beams = [
            f"{name}: {scan.no_return.sentence}"
            for name, scan in self.scans.items()
            if scan.no_return is not None
        ]
        return (*beams, *self.approximate.sentences, *self.registration.sentences)


def register_files(
    paths: Sequence[Path],
    *,
    approximate: bool = True,
    poses: Sequence[Path] = (),
    sigma: ApproximateSigma = APPROXIMATE,
    no_return: bool = False,
    choice: Choice = "proposed",
    floor: tuple[float, float] = COVARIANCE.floor,
    progress: Progress = lambda what, done, total: None,
) -> RegisteredFiles:
    """Register all scans of files; no more than one scan's surfels are made at a time.

    Parameters
    ----------
    paths
        Files of scans in the frames of their scanners.
    approximate
        Are poses used that stand beside the scans or in their headers, as proposals among others?
    poses
        Lists of approximate poses, or folders of files with one each, instead of these.
    sigma
        What approximate poses may be wrong by.
    no_return
        Are points that files have for beams without return kept?
    choice
        ``proposed`` for the pairs that promise most, ``all`` for every pair.
    floor
        Sigmas [m], [rad] of what residuals never show.
    progress
        Called with what is being done.

    Raises
    ------
    InputError
        Fewer than two scans, a scan whose scanner's place is not known, or without surfaces; what
        the readers have to say.
    """
    scans = _named([scan for path in paths for scan in read_scans(path)])
    if len(scans) < 2:
        raise InputError(
            f"there {'is one scan' if scans else 'are no scans'} in these files",
            cure="give at least two scans",
        )
    known = approximate_poses(scans, poses, sigma) if approximate or poses else NO_POSES
    prepared: list[PreparedScan] = []
    for name, scan in scans.items():
        if scan.origin == "unknown":
            raise InputError(
                "it is not known where the scanner stood in these coordinates",
                file=scan.path,
                record=scan.name,
                cure="give scans in the frame of their scanner, with it at zero",
            )
        if not no_return:
            progress(f"beams of {name}", 0, None)
            scans[name] = scan = screened(scan)
        prepared.append(prepare(name, _watched(name, scan, progress)))
    registration = register_clouds(
        prepared, known.poses, sigma=sigma, choice=choice, floor=floor, progress=progress
    )
    points = {p.name: p.points for p in prepared}
    return RegisteredFiles(scans, points, registration, known)


def _named(scans: Sequence[Scan]) -> dict[str, Scan]:
    """Scans by names that tell them apart: their own, with the file where that is not enough."""
    out: dict[str, Scan] = {}
    names = [scan.name for scan in scans]
    for scan in scans:
        name = scan.name if names.count(scan.name) == 1 else scan.source
        if name in out:
            raise InputError(
                f"two scans have the name {name}", file=scan.path, cure="rename one of the files"
            )
        out[name] = scan
    return out


def _watched(name: str, scan: Scan, progress: Progress) -> Iterator[Array]:
    """The points of a scan, with progress."""
    done = 0
    for chunk in scan.chunks():
        done += len(chunk)
        progress(f"points of {name}", done, scan.records)
        yield chunk.xyz


def write_placed(
    result: RegisteredFiles, folder: Path, progress: Progress = lambda what, done, total: None
) -> list[Path]:
    """Write poses.csv and poses.json of the largest group, and E57 files with their new poses.

    Raises
    ------
    InputError
        Nothing hangs together, or nowhere to write.
    """
    group = result.registration.groups[0]
    if group.adjustment is None:
        raise InputError(
            "no two scans could be joined, so that there are no poses to write",
            cure="see the sentences on the pairs",
        )
    frame = OutputFrame(WorkFrame())
    scans = [StationScan(n, n, result.scans[n], None, False, {}) for n in group.stations]
    placements = {
        name: Placement(name, group.poses[name], group.covariances[name], None)
        for name in group.stations
    }
    joint = joint_covariance(group.adjustment, group.stations, frame)
    texts = pose_texts(folder, scans, placements, frame, "prior", joint)
    written = write_texts(texts)
    files: dict[Path, dict[int, Pose]] = {}
    for name in group.stations:
        scan = result.scans[name]
        if scan.path.suffix.lower() == ".e57":
            files.setdefault(scan.path, {})[scan.index] = group.poses[name]
    for number, (path, poses) in enumerate(files.items()):
        progress("clouds with poses", number, len(files))
        target = folder / path.name
        if target.resolve() == path.resolve():
            raise InputError(
                "the cloud would be written over its source",
                file=path,
                cure="choose another folder",
            )
        copy_with_poses(path, target, poses, None)
        written.append(target)
    return written
