"""Files that scans are placed on: read, cut to where the scans are, made ready, and matched."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from pyproj import CRS
from pyproj.exceptions import CRSError

from tribrach._types import Array, Mask, Progress
from tribrach.errors import InputError
from tribrach.geodesy.site import EllipsoidSite
from tribrach.geometry.mesh import Mesh
from tribrach.geometry.pose import Pose
from tribrach.io.models.formats import is_model, model_unit, read_model
from tribrach.job.approximate_poses import ApproximatePoses
from tribrach.job.cloud_file import CloudFile, open_cloud
from tribrach.job.cloud_pairs import StationSurfels
from tribrach.job.gnss_observations import passage
from tribrach.job.state import Remembered
from tribrach.registration.alternatives import ApproximateSigma
from tribrach.registration.clouds.graph import CloudEdge
from tribrach.registration.clouds.prepared import PreparedScan
from tribrach.registration.clouds.reference import (
    PlacedOn,
    ReferencePlace,
    ScanReference,
    UsedReference,
    on_references,
    prepare_reference,
    reference_of_mesh,
)
from tribrach.scan.length_unit import LengthUnit
from tribrach.sentences import Sentence, joined
from tribrach.units import MM

if TYPE_CHECKING:
    from tribrach.job.opened import Job


@dataclass(frozen=True)
class ReferenceFile:
    """A file that scans are placed on, and what is said of it."""

    path: Path
    sigma: float = 0.0  #: what pieces of 10 m are wrong by, each for itself [m]
    shared: float = 0.0  #: what all of it is wrong by along each axis [m]
    unit: LengthUnit | None = None  #: of a model, where the user says so
    #: from its coordinates (n, 3) to those of the network
    into: Callable[[Array], Array] = lambda xyz: xyz
    #: reference system that its coordinates are to be in; None where it may be any
    crs: str | None = None
    #: how a user says what all of it is wrong by
    option: str = "--reference-shared-mm"


@dataclass(frozen=True)
class _Around:
    """Where the scans are: within a reach [m] of places (n, 3), everywhere without places."""

    places: Array
    reach: float

    def points(self, xyz: Array) -> Array:
        """Those of points (n, 3) that are there."""
        if not len(self.places):
            return xyz
        return xyz[self._inside(xyz[:, :2], xyz[:, :2])]

    def mesh(self, mesh: Mesh) -> Mesh:
        """Those triangles that reach there."""
        if not len(self.places):
            return mesh
        low, high = mesh.triangles.min(axis=1), mesh.triangles.max(axis=1)
        return mesh.subset(self._inside(low[:, :2], high[:, :2]))

    def _inside(self, low: Array, high: Array) -> Mask:
        """Which boxes (n,) between corners (n, 2) reach there."""
        inside = np.zeros(len(low), dtype=bool)
        for place in self.places[:, :2]:
            inside |= ((high >= place - self.reach) & (low <= place + self.reach)).all(axis=1)
        return inside


def read_references(
    files: Sequence[ReferenceFile],
    scans: Sequence[str],
    priors: Mapping[str, Pose],
    reach: float,
    progress: Progress,
) -> tuple[list[ScanReference], tuple[UsedReference, ...]]:
    """Read references; far away from approximate poses they are not needed."""
    ready: list[ScanReference] = []
    used: list[UsedReference] = []
    places = np.array([pose.translation for pose in priors.values()]).reshape(-1, 3)
    systems: dict[str, Path] = {}
    for file in files:
        name = file.path.stem
        if name in scans or any(name == other.name for other in used):
            name = f"reference {file.path.name}"
        if any(name == other.name for other in used):
            raise InputError(
                f"two references have the name {file.path.name}",
                file=file.path,
                cure="rename one of the files",
            )
        progress(f"reference {name}", len(used), len(files))
        reference, about = _read(file, name, _Around(places, reach))
        # in a project each is in the grid of the site
        if about.crs and file.crs is None:
            systems[about.crs] = file.path
        ready.append(reference)
        used.append(about)
    if len(systems) > 1:
        raise InputError(
            "the references are in different coordinate systems: "
            + ", ".join(path.name for path in systems.values()),
            cure="convert them to one",
        )
    return ready, tuple(used)


def _read(file: ReferenceFile, name: str, around: _Around) -> tuple[ScanReference, UsedReference]:
    """A reference, and what is said of it."""
    said: list[str] = []
    if file.sigma == 0 and file.shared == 0:
        said.append(
            Sentence(
                "the reference {name} is taken as exact but for the noise that its surfaces show: "
                "say what all of it is wrong by with {option}",
                name=name,
                option=file.option,
            )
        )
    if is_model(file.path):
        mesh = read_model(file.path, file.unit)
        _refuse_other_grid(file, mesh.crs)
        there = file.into(mesh.triangles.reshape(-1, 3)).reshape(-1, 3, 3)
        mesh = replace(mesh, triangles=there)
        count = len(around.mesh(mesh))
        if not count:
            said.append(_elsewhere(name))
        cut = around.mesh if count else lambda whole: whole
        reference = reference_of_mesh(name, mesh, sigma=file.sigma, shared=file.shared, cut=cut)
        crs, count, said = mesh.crs, count or len(mesh), [*mesh.sentences, *said]
    else:
        cloud = open_cloud(file.path)
        _refuse_other_grid(file, cloud.crs)
        try:
            reference = prepare_reference(
                name, map(around.points, _points(cloud, file)), sigma=file.sigma, shared=file.shared
            )
        except InputError:
            if not len(around.places):
                raise
            reference = prepare_reference(
                name, _points(cloud, file), sigma=file.sigma, shared=file.shared
            )
            said.append(_elsewhere(name))
        crs, count, said = cloud.crs, reference.scan.points, [*cloud.sentences, *said]
    used = UsedReference(
        name,
        file.path.name,
        is_model(file.path),
        count,
        file.sigma,
        file.shared,
        crs or "",
        tuple(said),
    )
    return reference, used


def _points(cloud: CloudFile, file: ReferenceFile) -> Iterator[Array]:
    """Points of a cloud in the frame of the network."""
    return map(file.into, cloud.stream())


def _elsewhere(name: str) -> str:
    return Sentence(
        "the approximate poses lie where the reference {name} has nothing: all of it is searched",
        name=name,
    )


def _refuse_other_grid(file: ReferenceFile, crs: str | None) -> None:
    """A reference in another grid than that of the project is not placed on."""
    if file.crs is None or crs is None:
        return
    try:
        own, other = (_in_plan(CRS.from_user_input(one)) for one in (file.crs, crs))
    except CRSError:
        return
    if not own.equals(other, ignore_axis_order=True):
        raise InputError(
            f"the reference is in {other.name} and the project in {own.name}",
            file=file.path,
            cure="convert it to the system of the project",
        )


def _in_plan(crs: CRS) -> CRS:
    """The system of easting and northing without that of heights."""
    return crs.sub_crs_list[0] if crs.is_compound else crs.to_2d()


@dataclass(frozen=True, eq=False)
class OnReferences:
    """What the scans of a project have on its references."""

    places: tuple[ReferencePlace, ...] = ()
    edges: tuple[CloudEdge, ...] = ()  #: from references to stations
    used: tuple[UsedReference, ...] = ()
    placed_on: tuple[PlacedOn, ...] = ()
    sentences: tuple[str, ...] = ()
    #: by the name of a station why it is on no reference
    obstacles: Mapping[str, str] = field(default_factory=dict)

    def frame(
        self, poses: Mapping[str, Pose], groups: Sequence[Mapping[str, Pose]], *, adrift: bool
    ) -> tuple[Mapping[str, Pose], bool]:
        """Poses in the frame of the network, and whether they still float.

        ``poses`` float where ``adrift``; ``groups`` hang together in frames of their own.
        """
        at = {place.name: Pose(np.eye(3), place.origin) for place in self.places}
        placed = {edge.second: at[edge.first] @ edge.pose for edge in reversed(self.edges)}
        out = {} if adrift else dict(poses)
        for group in (poses, *groups, *({name: pose} for name, pose in placed.items())):
            known = [name for name in group if name in placed]
            if known and not any(name in out for name in group):
                moved = placed[known[0]] @ group[known[0]].inverse
                out |= {name: moved @ pose for name, pose in group.items()}
        return (out, False) if out else (poses, adrift)


def placed_on_references(
    job: Job,
    stations: StationSurfels,
    known: ApproximatePoses,
    together: Mapping[str, Pose],
    floor: tuple[float, float],
    state: Remembered,
    progress: Progress,
) -> OnReferences:
    """Match the stations of a project with its references, or remember how they lie.

    ``known`` are poses in the frame of the network, ``together`` relative ones of stations.
    """
    sections = job.project.reference
    files = [_of_section(job, k) for k in range(len(sections))]
    maker = placed_on_references
    poses = [{n: pose.matrix for n, pose in some.items()} for some in (known.poses, together)]
    paths = [file.path for file in files]
    frame = job.frame, job.files.realisation
    key = state.key(maker, stations.sources, paths, sections, frame, poses, known.sigma, floor)

    def made() -> OnReferences:
        scans = [stations[name] for name in stations.stations]
        reach = reach_around(scans, known.sigma)
        ready, used = read_references(files, list(stations.stations), known.poses, reach, progress)
        progress("places on references", 0, len(ready))
        pairs = on_references(scans, ready, known.poses, together, known.sigma, floor)
        of = {reference.name: reference for reference in ready}
        said = [s for one in used for s in one.sentences]
        said += [s for pair in pairs if pair.fit is not None for s in pair.sentences]
        return OnReferences(
            tuple(reference.place for reference in ready),
            tuple(
                CloudEdge(p.a, p.b, p.fit.pose, p.fit.precision.covariance) for p in pairs if p.fit
            ),
            used,
            tuple(PlacedOn.of(of[p.a], stations[p.b], p.fit) for p in pairs if p.fit),
            tuple(said),
            {p.b: joined("; ", p.sentences) for p in reversed(pairs) if not p.fit},
        )

    return state.once("references", key, OnReferences, made)


#: a reference is read so many radii of a scan and sigmas of the approximate poses around these
_SEEN, _AROUND = 2.0, 5.0


def reach_around(scans: Sequence[PreparedScan], sigma: ApproximateSigma) -> float:
    """How far around approximate poses references are needed [m]."""
    return _SEEN * max(scan.radius for scan in scans) + _AROUND * sigma.shift


def _of_section(job: Job, number: int) -> ReferenceFile:
    """A reference of a project, which goes the way of its coordinates into the network."""
    section, frame = job.project.reference[number], job.frame
    keys = ("reference", number)
    path = job.folder / section.file
    if not path.is_file():
        raise job.error((*keys, "file"), f"there is no file {section.file}", "check its name")
    try:
        carry, unit = passage(section, job.files.realisation), model_unit(section.unit)
    except InputError as error:
        raise job.error(keys, error.what, error.cure) from error
    shared = section.shared_mm * MM
    if carry is not None and not isinstance(frame.site, EllipsoidSite):
        raise job.error(
            keys,
            "a reference of another frame or epoch needs a place on the ellipsoid, and the site "
            "is flat",
            "give the site latitude_deg and longitude_deg, or a crs",
        )
    if carry is not None:
        shared = float(np.hypot(shared, carry.positions(np.array([[6378137.0, 0.0, 0.0]]))[1]))

    def into(xyz: Array) -> Array:
        there = frame.from_own(xyz)[0]
        if carry is None:
            return there
        assert isinstance(frame.site, EllipsoidSite)
        return frame.site.from_ecef(carry.positions(frame.site.to_ecef(there))[0])

    crs = job.project.site.crs if frame.grid is None else frame.grid.crs
    return ReferenceFile(path, section.sigma_mm * MM, shared, unit, into, crs, "shared_mm")
