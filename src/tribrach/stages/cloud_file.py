"""A cloud in a file as one stream of points, and where its scanner stood if that is known."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyproj import CRS
from pyproj.exceptions import CRSError

from tribrach.errors import InputError
from tribrach.io.scans.formats import read_scans
from tribrach.io.xml_file import read_bytes
from tribrach.scan.scan import Scan

__all__ = ["CloudFile", "open_cloud", "refuse_other_frames"]

Array = NDArray[np.float64]

#: beside the clouds that they belong to
_POSES = "poses.json"


@dataclass(frozen=True)
class CloudFile:
    """All scans of a file in its world: placed by their poses where the file has them.

    scanner (3,) [m] : None where it is not known or there are several.
    """

    path: Path
    scans: tuple[Scan, ...]
    scanner: Array | None

    @property
    def records(self) -> int | None:
        """Number of points that the headers state, at most; None if they do not."""
        counts = [scan.records for scan in self.scans]
        return None if None in counts else sum(c for c in counts if c is not None)

    @property
    def crs(self) -> str | None:
        """WKT of the coordinates, if the file says."""
        return next((scan.crs for scan in self.scans if scan.crs), None)

    def stream(self) -> Iterator[Array]:
        """Chunks of points (n, 3) [m]."""
        for scan in self.scans:
            for chunk in scan.chunks():
                if len(chunk):
                    yield chunk.xyz if scan.pose is None else scan.pose @ chunk.xyz


def open_cloud(path: Path, poses: Path | None = None) -> CloudFile:
    """A cloud of any readable format.

    poses : a file as Tribrach writes it beside its clouds; that one is taken if none is given. The
    scan in it is found by the name of the cloud. Clouds with poses of their own need none.

    Raises
    ------
    InputError : what the reader has to say; a file of poses that is none.
    """
    scans = read_scans(path)
    scanner = None
    if len(scans) == 1 and scans[0].pose is not None and scans[0].origin != "unknown":
        scanner = scans[0].pose.translation
    beside = path.parent / _POSES
    if scanner is None and (poses is not None or beside.is_file()):
        scanner = _scanner(beside if poses is None else poses, path)
    return CloudFile(path, scans, scanner)


def _scanner(poses: Path, cloud: Path) -> Array | None:
    """Where the scan of a cloud was taken from; None if the file does not name it."""
    cure = "give the poses.json that was written beside the clouds"
    try:
        data: dict[str, Any] = json.loads(read_bytes(poses))
        rows = [(str(r["scan"]), str(r["file"]), r["world_from_scanner"]) for r in data["scans"]]
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise InputError("this is no file of poses", file=poses, cure=cure) from error
    stem = cloud.stem.removesuffix(".copc")
    named = [m for scan, _, m in rows if stem in (scan, _plain(scan))]
    named = named or [m for _, file, m in rows if file == cloud.name]
    if len(named) != 1:
        return None
    try:
        matrix = np.array(named[0], dtype=np.float64)
    except (ValueError, TypeError) as error:
        raise InputError("a pose is no matrix of numbers", file=poses, cure=cure) from error
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise InputError("a pose is no 4x4 matrix of numbers", file=poses, cure=cure)
    return np.asarray(matrix[:3, 3], dtype=np.float64)


def _plain(name: str) -> str:
    """The name of a scan as files are named after it."""
    return "".join(c if c.isalnum() or c in "-_." else "_" for c in name).strip(".")


def refuse_other_frames(a: CloudFile, b: CloudFile) -> None:
    """Clouds that say to be in different coordinate systems are not compared.

    Raises
    ------
    InputError : both name a coordinate system, and not the same.
    """
    if a.crs is None or b.crs is None or a.crs == b.crs:
        return
    try:
        one, two = CRS.from_user_input(a.crs), CRS.from_user_input(b.crs)
    except CRSError:
        return
    if not one.equals(two, ignore_axis_order=True):
        raise InputError(
            f"the clouds are in different coordinate systems: {one.name} and {two.name}",
            file=b.path,
            cure="write both in one frame",
        )
