"""Files of scans registered by their clouds alone, and what is written of it."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from tribrach._types import Array, Progress
from tribrach.answers import Number, PoseEstimate, Result, part
from tribrach.cloud.placement import Placement
from tribrach.errors import InputError
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.clouds.e57 import copy_with_poses
from tribrach.io.keeping import keep, refuse_loss
from tribrach.io.outputs import write_texts
from tribrach.io.poses.names import POSE_FILES
from tribrach.io.scans.formats import read_scans
from tribrach.job.approximate_poses import NO_POSES, ApproximatePoses, approximate_poses
from tribrach.job.clouds import write_clouds
from tribrach.job.grouping import groups
from tribrach.job.poses import pose_texts
from tribrach.job.references import (
    ReferenceFile,
    reach_around,
    read_references,
)
from tribrach.job.scans import StationScan
from tribrach.job.shared import shared_part
from tribrach.job.state import Remembered
from tribrach.project.sections import CloudSection
from tribrach.registration.clouds.graph import StationLoop
from tribrach.registration.clouds.pair import APPROXIMATE, ApproximateSigma, CloudPair
from tribrach.registration.clouds.prepared import PreparedScan, prepare
from tribrach.registration.clouds.proposals import Choice
from tribrach.registration.clouds.reference import PlacedOn, ReferenceOffset, UsedReference
from tribrach.registration.clouds.relative_covariance import GATES as COVARIANCE
from tribrach.registration.clouds.together import (
    HELD_TURN,
    CloudGroup,
    CloudRegistration,
    register_clouds,
)
from tribrach.scan.no_return import screened
from tribrach.scan.prepared import seen_from
from tribrach.scan.scan import Scan
from tribrach.sentences import Sentence

#: what the parts of covariances are of
COVARIANCE_OF = "translation [m], left rotation increments [rad]"
RELATIVE_OF = "translation in the first [m], rotation vector in the second"
#: places of standing surfaces that are kept of a scan, and what stands [sine of the slope]
_DRAWN, _STANDING = 1500, 0.5


#: files that name a registration
_NAMED = 4


@dataclass(frozen=True)
class PlacedOutput:
    """What a registration leaves in a folder."""

    folder: Path  #: the folder
    #: how clouds are written, None for copies of E57 files alone
    clouds: CloudSection | None = None
    #: of single points, for the sigmas in clouds; None if it is not known
    noise: ScanNoise | None = None

    def refuse_loss(self, scans: Mapping[str, Scan]) -> None:
        """Refuse before any work is done what would be lost, or cannot be written."""
        keep(kind=_job_of(scans.values(), self.folder))
        for name in POSE_FILES:
            refuse_loss(self.folder / name)
        if self.clouds is None:
            return
        if self.clouds.merged and self.clouds.format == "e57":
            raise InputError(
                "an E57 file keeps points in the frames of their scanners, one scan per file",
                cure="leave merging out, or take another format",
            )
        for group in groups(self.stations(scans), self.clouds):
            refuse_loss(self.folder / group.file)

    def stations(self, scans: Mapping[str, Scan]) -> list[StationScan]:
        """Scans as those of stations of their own."""
        return [
            StationScan(name, name, scan, self.noise, False, {}) for name, scan in scans.items()
        ]


def _job_of(scans: Iterable[Scan], folder: Path) -> str:
    """The files of a registration, from its folder: those of others are another job."""
    files = sorted({os.path.relpath(scan.path.resolve(), folder.resolve()) for scan in scans})
    if len(files) > _NAMED:
        whole = hashlib.sha256("\n".join(files).encode()).hexdigest()[:8]
        files = [*files[:_NAMED], f"... ({whole})"]
    return f"of {', '.join(files)}"


@dataclass(frozen=True)
class RegisteredScan(Result):
    """A scan and its file."""

    scan: str
    file: str
    points: int  #: without beams that came back from nothing
    no_return: int  #: beams that came back from nothing, left out


@dataclass(frozen=True)
class PlacedPair(Result):
    """A pair against the adjusted poses: root mean squares on flat places [m]."""

    first: str
    second: str
    places: int
    #: differences, and what is predicted of them by the noise and by the registration
    observed: Number
    noise: Number
    registration: Number


@dataclass(frozen=True)
class PlacedGroup(Result):
    """Stations that hang together, in the frame of one of them."""

    frame_of: str
    stations: dict[str, PoseEstimate]
    differences: tuple[PlacedPair, ...]

    @classmethod
    def of(cls, group: CloudGroup) -> PlacedGroup:
        """The figures of a group."""
        placed = {n: PoseEstimate(p.matrix, group.covariances[n]) for n, p in group.poses.items()}
        pairs = tuple(PlacedPair(*ends, **vars(d)) for ends, d in group.differences.items())
        return cls(group.stations[0], placed, pairs)


@dataclass(frozen=True)
class Approximate(Result):
    """Approximate poses that said where to look [m, rad]."""

    scans: tuple[str, ...]
    origin: str
    sigma_shift: Number
    sigma_turn: Number


@dataclass(frozen=True, eq=False)
class RegisteredFiles(
    Result,
    without=("files", "points", "registration", "known", "walls"),
    also=(
        "scans", "pairs", "loops", "not_used", "groups", "approximate", "sentences",
        "offsets", "placed_on",
    ),
    maybe=("references", "offsets", "placed_on"),
):  # fmt: skip
    """Scans by the names that they have in the registration, and the registration."""

    files: dict[str, Scan]  #: scans by name
    points: dict[str, int]  #: their numbers of points
    registration: CloudRegistration  #: pairs, loops and groups
    known: ApproximatePoses = NO_POSES  #: approximate poses that were used
    #: some places (n, 3) of standing surfaces in the frame of each scan [m]
    walls: Mapping[str, Array] = field(default_factory=dict)
    #: what the scans were placed on; left out without any
    references: tuple[UsedReference, ...] = ()
    covariance_of: str = field(default=COVARIANCE_OF, init=False)
    relative_covariance_of: str = field(default=RELATIVE_OF, init=False)
    sigma_origin: str = field(default="prior", init=False)

    pairs = part("registration.pairs", list[CloudPair], "Pairs that were tried.")
    loops = part("registration.consistency.loops", tuple[StationLoop, ...], "Loops of pairs.")

    @property
    def offsets(self) -> tuple[ReferenceOffset, ...]:
        """What the network says of the places of references."""
        return self.registration.offsets

    @property
    def placed_on(self) -> tuple[PlacedOn, ...]:
        """Scans on references, and how much of them lies there."""
        return self.registration.placed_on

    @property
    def scans(self) -> tuple[RegisteredScan, ...]:
        """The scans, and what of them took part."""
        beams = {n: s.no_return.points if s.no_return else 0 for n, s in self.files.items()}
        return tuple(
            RegisteredScan(name, scan.path.name, self.points[name], beams[name])
            for name, scan in self.files.items()
        )

    @property
    def not_used(self) -> list[tuple[str, str]]:
        """Pairs that were taken away since their loops do not close."""
        return [(e.first, e.second) for e in self.registration.consistency.dropped]

    @property
    def groups(self) -> list[PlacedGroup]:
        """Stations that hang together, the largest group first."""
        return [PlacedGroup.of(group) for group in self.registration.groups]

    @property
    def approximate(self) -> Approximate | None:
        """Null where there were no approximate poses."""
        known, sigma = self.known, self.known.sigma
        if not known.poses:
            return None
        return Approximate(tuple(known.poses), known.origin, sigma.shift, sigma.turn)

    @property
    def sentences(self) -> tuple[str, ...]:
        """What was left out of the scans, and what the registration has to say."""
        scans = [
            Sentence("{name}: {said}", name=name, said=said)
            for name, scan in self.files.items()
            for said in scan.remarks
        ]
        told = [said for reference in self.references for said in reference.sentences]
        return (*scans, *self.known.sentences, *told, *self.registration.sentences)


def register_files(
    paths: Sequence[Path],
    *,
    approximate: bool = True,
    poses: Sequence[Path] = (),
    sigma: ApproximateSigma = APPROXIMATE,
    no_return: bool = False,
    choice: Choice = "proposed",
    floor: tuple[float, float] = COVARIANCE.floor,
    origin: tuple[float, float, float] | None = None,
    references: Sequence[ReferenceFile] = (),
    output: PlacedOutput | None = None,
    progress: Progress = lambda what, done, total: None,
) -> RegisteredFiles:
    """Register all scans of files; no more than one scan's surfels are made at a time.

    ``approximate``: are poses used that stand beside the scans or in their headers? ``poses`` are
    lists of them, or folders, instead. ``no_return``: are points kept that stand for beams without
    return? ``floor`` holds sigmas [m], [rad] of what residuals never show, ``origin`` the place of
    the scanner in each file, where files do not say. ``output`` is refused before any work is done.
    """
    read = [scan for path in paths for scan in read_scans(path)]
    scans = _named(read if origin is None else [seen_from(scan, origin) for scan in read])
    if len(scans) < 2 - bool(references):
        raise InputError(
            f"there {'is one scan' if scans else 'are no scans'} in these files",
            cure="give at least two scans, or one and a --reference",
        )
    if output is not None:
        output.refuse_loss(scans)
    known = approximate_poses(scans, poses, sigma) if approximate or poses else NO_POSES
    prepared: list[PreparedScan] = []
    for name, scan in scans.items():
        if scan.origin == "unknown":
            raise InputError(
                "it is not known where the scanner stood in these coordinates",
                file=scan.path,
                record=scan.name,
                cure="give its place in the coordinates of the files with --origin X Y Z, "
                "--origin 0 0 0 if it is at zero",
            )
        progress(f"beams of {name}", 0, None)
        scan = screened(scan)
        scans[name] = scan = replace(scan, no_return=None) if no_return else scan
        prepared.append(prepare(name, _watched(name, scan, progress)))
    reach = reach_around(prepared, sigma)
    ready, used = read_references(references, list(scans), known.poses, reach, progress)
    registration = register_clouds(
        prepared,
        known.poses,
        references=ready,
        sigma=sigma,
        choice=choice,
        floor=floor,
        progress=progress,
    )
    _refuse_unheld(registration)
    points = {p.name: p.points for p in prepared}
    walls = {p.name: _walls(p) for p in prepared}
    return RegisteredFiles(scans, points, registration, known, walls, used)


def _refuse_unheld(registration: CloudRegistration) -> None:
    """Refuse scans of which none is held by another: a lone wall or a cylinder places nothing."""
    joined = [group for group in registration.groups if group.adjustment is not None]
    turns = [
        float(np.sqrt(np.trace(group.covariances[name][3:, 3:])))
        for group in joined
        for name in group.stations[1:]
    ]
    if turns and min(turns) > HELD_TURN:
        raise InputError(
            "what these scans have in common does not hold how they are turned: "
            + "; ".join(registration.sentences[:3]),
            cure="give scans that see more of the same than a wall or a round surface",
        )


def _walls(scan: PreparedScan) -> Array:
    """Some places (n, 3) of standing surfaces of a scan [m]."""
    s = scan.coarse.surfels
    at = s.center[np.abs(s.normal[:, 2]) < _STANDING]
    return np.asarray(at[:: max(1, -(-len(at) // _DRAWN))])


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
    result: RegisteredFiles,
    output: PlacedOutput,
    progress: Progress = lambda what, done, total: None,
) -> tuple[list[Path], list[str]]:
    """Write poses and clouds of the largest group."""
    group = result.registration.groups[0]
    if group.adjustment is None:
        raise InputError(
            "no two scans could be joined, so that there are no poses to write",
            cure="see the sentences on the pairs",
        )
    frame = OutputFrame(WorkFrame(), crs=next((r.crs for r in result.references if r.crs), None))
    stations = [name for name in group.stations if name in result.files]
    scans = output.stations({name: result.files[name] for name in stations})
    placements = {
        name: Placement(name, group.poses[name], group.covariances[name], output.noise)
        for name in stations
    }
    shared = shared_part(scans, group.adjustment)
    written = write_texts(pose_texts(output.folder, scans, placements, frame, "prior", shared))
    if output.clouds is None:
        return written + _copied(result, group, output.folder, progress), []
    state = Remembered(output.folder)
    made = write_clouds(
        scans, placements, frame, output.clouds, output.folder, state, progress, "prior"
    )
    sentences = [sentence for product in made for sentence in product.sentences]
    if output.noise is None and output.clouds.format != "e57":
        # the same of every cloud
        sentences = ["points in the clouds have no sigmas: no instrument is named for their noise"]
    return written + [product.path for product in made], list(dict.fromkeys(sentences))


def _copied(
    result: RegisteredFiles, group: CloudGroup, folder: Path, progress: Progress
) -> list[Path]:
    """E57 files of a group, copied with their new poses."""
    written: list[Path] = []
    files: dict[Path, dict[int, Pose]] = {}
    for name, scan in result.files.items():
        if name in group.poses and scan.path.suffix.lower() == ".e57":
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
