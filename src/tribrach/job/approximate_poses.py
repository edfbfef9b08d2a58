"""Approximate poses of scans: from lists, from files beside the scans, or from their headers.

They say which pairs of clouds are tried first and which of several places that fit alike is meant.
They are no observations: where the clouds say otherwise, the clouds are believed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.keeping import keep
from tribrach.io.poses.formats import assigned, beside, read_pose_list
from tribrach.io.scans.origin import scan_name
from tribrach.job.poses import read_poses
from tribrach.registration.clouds.pair import APPROXIMATE, ApproximateSigma
from tribrach.scan.scan import Scan
from tribrach.sentences import Sentence


@dataclass(frozen=True, eq=False)
class ApproximatePoses:
    """Approximate poses of scans in one frame."""

    #: world from scanner, by the names of the scans
    poses: Mapping[str, Pose] = field(default_factory=dict)
    sigma: ApproximateSigma = APPROXIMATE  #: what they may be wrong by
    origin: str = ""  #: where they come from, in words; "" without any

    @property
    def sentences(self) -> tuple[str, ...]:
        """What they are used for, without the final stop; nothing without poses."""
        if not self.poses:
            return ()
        return (
            Sentence(
                "approximate poses of {count} scans ({own.origin}) with sigmas of "
                "{own.sigma.shift:g} m and {own.sigma.turn:degreesg3} say where to look first; "
                "they are no observations, and the frame of the results does not come from them",
                count=len(self.poses),
                own=self,
            ),
        )


#: nothing is known of where the scanners stood
NO_POSES = ApproximatePoses()


def approximate_poses(
    scans: Mapping[str, Scan],
    given: Sequence[Path] = (),
    sigma: ApproximateSigma = APPROXIMATE,
) -> ApproximatePoses:
    """Take the poses of the first of three places that has any: lists, files beside, headers."""
    if given:
        poses: dict[str, Pose] = {}
        words: list[str] = []
        for path in given:
            _take(path, list(scans), poses, words)
        return ApproximatePoses(_telling(poses), sigma, "; ".join(dict.fromkeys(words)))
    poses, origin = _beside(scans)
    if poses:
        return ApproximatePoses(_telling(poses), sigma, origin)
    headers = {name: scan.pose for name, scan in scans.items() if scan.pose is not None}
    return ApproximatePoses(_telling(headers), sigma, "in the headers of their files")


def _take(path: Path, names: Sequence[str], poses: dict[str, Pose], words: list[str]) -> None:
    """Add the poses of a file or folder that was named."""
    if path.is_dir():
        lists = beside(names, path)
        new: dict[str, Pose] = {name: one.poses[0] for name, one in lists.items()}
        words += [
            Sentence("{path.name}: {one.words}", path=path, one=one) for one in lists.values()
        ]
        keep(one.path for one in lists.values())
    elif path.suffix.lower() == ".json":
        keep([path])
        new = {s.scan: s.placement.pose for s in read_poses(path).scans if s.scan in names}
        words.append(path.name)
    else:
        keep([path])
        listed = read_pose_list(path)
        new = dict(assigned(names, listed))
        words.append(Sentence("{path.name}: {listed.words}", path=path, listed=listed))
    if not new:
        raise InputError(
            "there is no pose of any of the scans here",
            file=path,
            cure="name poses after their scans, or give a list in their order",
        )
    for name, pose in new.items():
        if name in poses:
            raise InputError(f"{name} has a second pose here", file=path, cure="give it once")
        poses[name] = pose


def _beside(scans: Mapping[str, Scan]) -> tuple[dict[str, Pose], str]:
    """Poses in files beside scans that have a file to themselves, and their formats in words."""
    count = [scan.path for scan in scans.values()]
    alone = {name: scan for name, scan in scans.items() if count.count(scan.path) == 1}
    poses: dict[str, Pose] = {}
    words: list[str] = []
    for folder in dict.fromkeys(scan.path.parent for scan in alone.values()):
        stems = {scan_name(s.path): n for n, s in alone.items() if s.path.parent == folder}
        for stem, one in beside(list(stems), folder).items():
            keep([one.path])
            poses[stems[stem]] = one.poses[0]
            words.append(Sentence("beside the scans: {one.words}", one=one))
    return poses, "; ".join(dict.fromkeys(words))


def _telling(poses: Mapping[str, Pose]) -> dict[str, Pose]:
    """Poses that no other scan has: files without registration have the same one for all scans."""
    matrices = {name: pose.matrix for name, pose in poses.items()}
    return {
        name: pose
        for name, pose in poses.items()
        if not any(
            other != name and np.allclose(matrix, matrices[name])
            for other, matrix in matrices.items()
        )
    }
