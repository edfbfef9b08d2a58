"""Files that scans are placed on: read, cut to where the scans are, and made ready."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tribrach._types import Array, Mask, Progress
from tribrach.answers import Number, Result
from tribrach.errors import InputError
from tribrach.geometry.mesh import Mesh
from tribrach.geometry.pose import Pose
from tribrach.io.models.formats import is_model, read_model
from tribrach.job.cloud_file import CloudFile, open_cloud
from tribrach.registration.clouds.reference import (
    ScanReference,
    prepare_reference,
    reference_of_mesh,
)
from tribrach.scan.length_unit import LengthUnit
from tribrach.sentences import Sentence


@dataclass(frozen=True)
class ReferenceFile:
    """A file that scans are placed on, and what is said of it."""

    path: Path
    sigma: float = 0.0  #: what pieces of 10 m are wrong by, each for itself [m]
    shared: float = 0.0  #: what all of it is wrong by along each axis [m]
    unit: LengthUnit | None = None  #: of a model, where the user says so


@dataclass(frozen=True)
class UsedReference(Result, null=("crs",)):
    """A reference as it was used."""

    name: str
    file: str
    model: bool  #: true for surfaces, false for points
    count: int  #: points, or triangles, near the scans
    sigma: Number  #: what pieces of 10 m are wrong by, each for itself [m]
    shared: Number  #: what all of it is wrong by along each axis [m]
    crs: str  #: its reference system as WKT, null where its file does not say
    sentences: tuple[str, ...]  #: what was left out or assumed of it


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
        if about.crs:
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
                "say what all of it is wrong by with --reference-shared-mm",
                name=name,
            )
        )
    if is_model(file.path):
        mesh = read_model(file.path, file.unit)
        count = len(around.mesh(mesh))
        if not count:
            said.append(_elsewhere(name))
        cut = around.mesh if count else lambda whole: whole
        reference = reference_of_mesh(name, mesh, sigma=file.sigma, shared=file.shared, cut=cut)
        crs, count, said = mesh.crs, count or len(mesh), [*mesh.sentences, *said]
    else:
        cloud = open_cloud(file.path)
        try:
            reference = prepare_reference(
                name, _points(cloud, around), sigma=file.sigma, shared=file.shared
            )
        except InputError:
            if not len(around.places):
                raise
            reference = prepare_reference(
                name, cloud.stream(), sigma=file.sigma, shared=file.shared
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


def _points(cloud: CloudFile, around: _Around) -> Iterator[Array]:
    """Points of a cloud where the scans are."""
    for xyz in cloud.stream():
        yield around.points(xyz)


def _elsewhere(name: str) -> str:
    return Sentence(
        "the approximate poses lie where the reference {name} has nothing: all of it is searched",
        name=name,
    )
