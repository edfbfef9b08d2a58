"""A cloud in a file as one stream of points, and where its scanner stood if that is known."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pyproj import CRS
from pyproj.exceptions import CRSError

from tribrach._types import Array
from tribrach.cloud.placement import Placement
from tribrach.cloud.shared_part import CloudPoints
from tribrach.comparison.sites import ComparisonSite
from tribrach.comparison.station_pair import StationPair
from tribrach.errors import InputError
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.io.scans.formats import read_scans
from tribrach.job.poses import POSES, PoseFile, read_poses
from tribrach.scan.no_return import screened
from tribrach.scan.scan import Chunk, Scan
from tribrach.sentences import Sentence


@dataclass(frozen=True)
class CloudFile:
    """All scans of a file in its world: placed by their poses where the file has them.

    scanner (3,) [m] : None where it is not known or there are several; placement : of the scan with
    covariance and noise, in the same frame, where a run left them; poses : the file that says so;
    frame : what points are carried into after their poses.
    """

    path: Path
    scans: tuple[Scan, ...]
    scanner: Array | None
    placement: Placement | None = None
    poses: PoseFile | None = None
    frame: OutputFrame | None = None

    @property
    def records(self) -> int | None:
        """Number of points that the headers state, at most; None if they do not."""
        counts = [scan.records for scan in self.scans]
        return None if None in counts else sum(c for c in counts if c is not None)

    @property
    def crs(self) -> str | None:
        """WKT of the coordinates, if the file says."""
        return next((scan.crs for scan in self.scans if scan.crs), None)

    @property
    def sentences(self) -> tuple[str, ...]:
        """Oddities and points left out, without the final stop."""
        return tuple(
            Sentence("{name}: {said}", name=scan.source, said=said)
            for scan in self.scans
            for said in scan.remarks
        )

    @property
    def columns(self) -> int:
        """Columns of :meth:`lit`: four where the noise of the points and intensities are known."""
        known = self.placement is not None and self.placement.noise is not None
        return 4 if known and all("intensity" in scan.names for scan in self.scans) else 3

    def stream(self) -> Iterator[Array]:
        """Chunks of points (n, 3) [m]."""
        for scan in self.scans:
            for chunk in scan.chunks():
                if len(chunk):
                    yield self._world(scan, chunk)

    def lit(self) -> Iterator[Array]:
        """Chunks of points (n, 3) [m], or (n, 4) with the intensity of the scan that was placed."""
        if self.columns == 3:
            yield from self.stream()
            return
        for scan in self.scans:
            for chunk in scan.chunks():
                if len(chunk):
                    yield np.column_stack([self._world(scan, chunk), _light(scan, chunk)])

    def _world(self, scan: Scan, chunk: Chunk) -> Array:
        """Points (n, 3) [m] of a chunk of a scan."""
        placed = chunk.xyz if scan.pose is None else scan.pose @ chunk.xyz
        return placed if self.frame is None else self.frame.from_work(placed)


def _light(scan: Scan, chunk: Chunk) -> Array:
    """Intensities (n,) in the units of the scan that a cloud was made of, NaN where unknown."""
    light = chunk.values.get("intensity")
    return np.full(len(chunk), np.nan) if light is None else stated_light(scan.facts, light)


def stated_light(facts: Mapping[str, str], light: NDArray[Any]) -> Array:
    """Intensities (n,) in the units of the scan, from what our clouds say of their stretching."""
    low, _, high = facts.get("intensity", "").partition(" to ")
    try:
        shift, span = float(low), float(high) - float(low)
    except ValueError:
        return light.astype(np.float64)
    return shift + light.astype(np.float64) * (span / 65535)


def open_cloud(path: Path, poses: Path | None = None) -> CloudFile:
    """A cloud of any readable format.

    poses : a file as Tribrach writes it beside its clouds; that one is taken if none is given. The
    scan in it is found by the name of the cloud. Clouds with poses of their own need none.
    """
    scans = tuple(screened(scan) for scan in read_scans(path))
    scanner = None
    if len(scans) == 1 and scans[0].pose is not None and scans[0].origin != "unknown":
        scanner = scans[0].pose.translation
    beside = path.parent / POSES if poses is None else poses
    if poses is None and not beside.is_file():
        return CloudFile(path, scans, scanner)
    known = read_poses(beside)
    at = known.of_cloud(path)
    if at is None:
        return CloudFile(path, scans, scanner)
    if scanner is None:
        scanner = at.placement.pose.translation
    whole = at.certain and at.placement.noise is not None
    return CloudFile(path, scans, scanner, at.placement if whole else None, known)


def seen_at(cloud: CloudFile, origin: tuple[float, float, float] | None) -> CloudFile:
    """The cloud with its scanner at a place [m] of its coordinates, where it does not know one."""
    if origin is None or cloud.scanner is not None:
        return cloud
    at = np.array(origin, dtype=float)
    if not np.isfinite(at).all():
        raise InputError(
            "the scanner's place has coordinates that are no finite numbers",
            file=cloud.path,
            cure="give --origin X Y Z in metres",
        )
    return replace(cloud, scanner=at)


def station_pair(first: CloudFile, second: CloudFile) -> StationPair | None:
    """The stations of two clouds with their joint covariance; None where one is not known.

    Clouds of two runs share what both were given alike, where the runs left it (method section
    12.7); else they are taken as independent.
    """
    if first.placement is None or second.placement is None:
        return None
    one, two = first.poses, second.poses
    if one is not None and two is not None and one_run(first, second):
        scans = one.of_cloud(first.path), two.of_cloud(second.path)
        return None if scans[0] is None or scans[1] is None else one.pair(scans[0], scans[1])
    if one is not None and two is not None and one.shared is not None and two.shared is not None:
        at = one.of_cloud(first.path), two.of_cloud(second.path)
        if at[0] is not None and at[1] is not None:
            names = at[0].scan, at[1].scan
            if names[0] in one.shared.scans and names[1] in two.shared.scans:
                return StationPair.of_results(one.shared, names[0], two.shared, names[1])
    return StationPair.independent(first.placement, second.placement)


def one_run(first: CloudFile, second: CloudFile) -> bool:
    """Were both clouds placed by one file of poses?"""
    one, two = first.poses, second.poses
    return one is not None and two is not None and one.path.resolve() == two.path.resolve()


def cloud_points(
    path: str | Path,
    *,
    ball: tuple[ArrayLike, float] | None = None,
    box: tuple[ArrayLike, ArrayLike] | None = None,
    poses: str | Path | None = None,
    effective: float | None = None,
) -> CloudPoints:
    """Read points of a delivered cloud, with what they share with all points of the run.

    Parameters
    ----------
    path : path
        A cloud of one scan, as a run wrote it.
    ball : (array_like (3,), float), optional
        Only points within a radius [m] of a centre [m].
    box : (array_like (3,), array_like (3,)), optional
        Only points between two corners [m].
    poses : path, optional
        The ``poses.json`` of the run or its folder; the one beside the cloud if not given.
    effective : float, optional
        How many of the points count as independent; what the noise says that neighbours share if
        not given.

    Returns
    -------
    CloudPoints
        In the frame of the cloud. Points of several clouds of one run know what they share.

    Raises
    ------
    InputError
        No cloud, no file of poses, or none with the joint covariance; a cloud of several scans; a
        cloud that was placed by other poses; no points.

    References
    ----------
    Method section 5.10.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError("there is no such file", file=path, cure="check its name and folder")
    region = _region(ball, box)
    beside = _poses_of(path, None if poses is None else Path(poses))
    known = read_poses(beside)
    at = known.of_cloud(path)
    if known.shared is None or (at is not None and at.scan not in known.shared.scans):
        raise InputError(
            "what the points of the clouds share is not known",
            file=beside,
            cure="keep poses_covariance.npy beside poses.json, or run the project again",
        )
    if at is None:
        raise InputError(
            "the cloud is not one scan of the run",
            file=path,
            cure="take a cloud of one scan (merged = false), and the poses.json of its run",
        )
    noise = at.placement.noise
    cloud = CloudFile(path, tuple(screened(scan) for scan in read_scans(path)), None, at.placement)
    if any(at.placed(scan.facts) is False for scan in cloud.scans):
        raise InputError(
            f"this cloud was not placed by the pose of scan {at.scan} in {beside.name}: it is one "
            "of another scan or of another run",
            file=path,
            cure="give each cloud the name and the poses.json that it was written with",
        )
    kept = [np.empty((0, cloud.columns))]
    kept += [chunk[region.inside(chunk[:, :3])] if region else chunk for chunk in cloud.lit()]
    points = np.concatenate(kept)
    if not len(points):
        raise InputError("no point of the cloud is in the region", file=path)
    light = points[:, 3] if noise is not None and noise.law is not None else None
    return known.shared.points(points[:, :3], at.scan, intensity=light, effective=effective)


def _poses_of(cloud: Path, given: Path | None) -> Path:
    """The file of poses of a cloud: the one that is given, or in a folder that is, or beside it."""
    if given is None:
        beside = cloud.parent / POSES
        if not beside.is_file():
            raise InputError(
                "there is no poses.json beside the cloud",
                file=cloud,
                cure="give the poses.json that the run left beside its clouds",
            )
        return beside
    at = given / POSES if given.is_dir() else given
    if not at.is_file():
        raise InputError(
            "there is no such file of poses",
            file=at,
            cure="give the poses.json that the run left beside its clouds, or its folder",
        )
    return at


def _region(
    ball: tuple[ArrayLike, float] | None, box: tuple[ArrayLike, ArrayLike] | None
) -> ComparisonSite | None:
    """A ball, a box, or everywhere."""
    if ball is not None and box is not None:
        raise InputError("a region is a ball or a box", cure="give one of them")
    try:
        if ball is not None:
            x, y, z = (float(v) for v in np.asarray(ball[0], dtype=float))
            radius = float(ball[1])
            if not 0 < radius < np.inf:
                raise InputError(
                    f"the ball has a radius of {radius:g} m", cure="give a radius above zero"
                )
            return ComparisonSite.ball("region", (x, y, z), radius)
        if box is not None:
            low, high = (np.asarray(corner, dtype=float) for corner in box)
            corners = np.sort(np.stack([low, high]), axis=0).reshape(2, 3).tolist()
            return ComparisonSite("region", tuple(corners[0]), tuple(corners[1]))
    except (ValueError, TypeError) as error:
        raise InputError(
            "a region is not made of numbers",
            cure="give ball = ((x, y, z), radius) or box = ((x, y, z), (x, y, z))",
        ) from error
    return None


def refuse_other_frames(a: CloudFile, b: CloudFile) -> None:
    """Clouds that say to be in different coordinate systems are not compared."""
    refuse_other_systems(a.crs, b.crs, b.path)


def refuse_other_systems(a: str | None, b: str | None, file: Path) -> None:
    """What says to be in different coordinate systems is not compared; WKT of both."""
    if a is None or b is None or a == b:
        return
    try:
        one, two = CRS.from_user_input(a), CRS.from_user_input(b)
    except CRSError:
        return
    if not one.equals(two, ignore_axis_order=True):
        raise InputError(
            f"the clouds are in different coordinate systems: {one.name} and {two.name}",
            file=file,
            cure="write both in one frame",
        )
