"""What a submission says against what is true: coverage of its regions, and their size."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import beta, chi2, norm

from benchmarks.coverage.scenes import Truth
from benchmarks.coverage.submission import Pose, Submission
from benchmarks.coverage.world import Array

__all__ = ["HEADS", "Row", "Score", "advice", "pose_error", "score"]

ARCSEC = np.pi / 180 / 3600
#: share of truth that a region is to hold
LEVEL = 0.95
#: an error beyond this probability is wrong and sure: five sigma of one normal quantity
SURE = float(2 * norm.sf(5))


def pose_error(true: Array, pose: Array) -> Array:
    """Shift [m] and rotation vector [rad] (6,) that make a stated pose (4, 4) the true one.

    ``t_true = t + dt`` and ``R_true = Exp(d) R``, both along the axes of the first scan.
    """
    turn = Rotation.from_matrix(true[:3, :3] @ pose[:3, :3].T).as_rotvec()
    return np.concatenate([true[:3, 3] - pose[:3, 3], turn])


def normalised(error: Array, covariance: Array) -> float:
    """Squared error in units of its covariance."""
    scale = np.sqrt(np.diag(covariance))
    lower = np.linalg.cholesky(covariance / np.outer(scale, scale))
    return float((np.linalg.solve(lower, error / scale) ** 2).sum())


@dataclass(frozen=True)
class Row:
    """One pose or one point that was stated."""

    scene: str
    #: of the scan, or of the check point
    name: str
    error: Array
    covariance: Array
    #: squared error in units of its covariance
    square: float

    @property
    def inside(self) -> bool:
        """Does the stated region of 95 % hold the truth?"""
        return self.square <= chi2.ppf(LEVEL, len(self.error))

    @property
    def sure(self) -> bool:
        """Is the truth beyond five sigma?"""
        return bool(chi2.sf(self.square, len(self.error)) < SURE)

    def size(self, part: slice) -> float:
        """Geometric mean of the sigmas along the principal axes of a part of the region."""
        sigmas = np.linalg.eigvalsh(self.covariance[part, part])
        return float(np.exp(0.5 * np.log(sigmas).mean()))


@dataclass(frozen=True)
class Score:
    """What is to be said of one program."""

    program: str
    poses: list[Row] = field(default_factory=list)
    points: list[Row] = field(default_factory=list)
    #: scene and scan of poses that were refused, with the reasons
    refused: list[tuple[str, str, str]] = field(default_factory=list)
    #: of all scenes together [s]
    seconds: float = 0.0
    #: poses that were asked for
    asked: int = 0

    def of(self, sort: str) -> Score:
        """The same of one sort of sites."""

        def ours(scene: str) -> bool:
            return scene.startswith(f"{sort}-")

        refused = [r for r in self.refused if ours(r[0])]
        poses = [r for r in self.poses if ours(r.scene)]
        points = [r for r in self.points if ours(r.scene)]
        return Score(self.program, poses, points, refused, np.nan, len(poses) + len(refused))

    def cells(self) -> tuple[str, ...]:
        """A row of the table, under :data:`HEADS`."""
        poses, points = self.poses, self.points
        low, high = binomial(sum(r.inside for r in poses), len(poses))
        return (
            self.program,
            f"{len(poses)} of {self.asked}",
            _share(poses, (low, high)),
            str(sum(r.sure for r in poses)),
            _median([1e3 * r.size(slice(0, 3)) for r in poses]),
            _median([1e3 * float(np.linalg.norm(r.error[:3])) for r in poses]),
            _median([r.size(slice(3, 6)) / ARCSEC for r in poses]),
            _median([float(np.linalg.norm(r.error[3:])) / ARCSEC for r in poses]),
            _share(points, by_scenes(points)),
            "" if np.isnan(self.seconds) else f"{self.seconds:.0f}",
        )


HEADS = (
    "program", "poses stated", "inside 95 %", "wrong and sure", "sigma [mm]", "error [mm]",
    'sigma ["]', 'error ["]', "points inside 95 %", "time [s]",
)  # fmt: skip


def _share(rows: Sequence[Row], interval: tuple[float, float]) -> str:
    if not rows:
        return ""
    share = np.mean([r.inside for r in rows])
    return f"{100 * share:.1f} % ({100 * interval[0]:.0f} to {100 * interval[1]:.0f})"


def _median(values: Sequence[float]) -> str:
    return f"{np.median(values):.3g}" if len(values) else ""


def binomial(inside: int, count: int, level: float = LEVEL) -> tuple[float, float]:
    """Interval of Clopper and Pearson for a share."""
    tail = (1 - level) / 2
    low = float(beta.ppf(tail, inside, count - inside + 1)) if inside else 0.0
    high = float(beta.ppf(1 - tail, inside + 1, count - inside)) if inside < count else 1.0
    return low, high


def by_scenes(rows: Sequence[Row], draws: int = 2000) -> tuple[float, float]:
    """Interval for the share of points: those of a scene share its pose, so scenes are drawn."""
    scenes = sorted({r.scene for r in rows})
    if not scenes:
        return 0.0, 1.0
    counts = np.array([[0.0, 0.0]] * len(scenes))
    for row in rows:
        counts[scenes.index(row.scene)] += row.inside, 1
    drawn = np.random.default_rng(1).integers(0, len(scenes), (draws, len(scenes)))
    sums = counts[drawn].sum(axis=1)
    low, high = np.percentile(sums[:, 0] / sums[:, 1], [2.5, 97.5])
    return float(low), float(high)


def score(submission: Submission, truths: Mapping[str, Truth]) -> Score:
    """Hold a submission against the truth; what it leaves out counts as refused."""
    out = Score(submission.program, asked=sum(len(t.first_from_scan) for t in truths.values()))
    seconds = 0.0
    for name, truth in truths.items():
        answer = submission.scenes.get(name)
        seconds += answer.seconds if answer else 0.0
        for scan, true in truth.first_from_scan.items():
            pose = answer.poses.get(scan) if answer else None
            if not isinstance(pose, Pose):
                out.refused.append((name, scan, pose or "nothing was submitted"))
                continue
            error = pose_error(true, pose.matrix)
            square = normalised(error, pose.covariance)
            out.poses.append(Row(name, scan, error, pose.covariance, square))
        for point, place in (answer.points if answer else {}).items():
            off = truth.points[point] - place.xyz
            square = normalised(off, place.covariance)
            out.points.append(Row(name, point, off, place.covariance, square))
    return Score(out.program, out.poses, out.points, out.refused, seconds, out.asked)


def advice(submission: Submission, truths: Mapping[str, Truth]) -> list[str]:
    """What another convention would make right: a slip of the submission, not of the program."""
    stated = [
        (truths[n].first_from_scan[s], pose)
        for n, answer in submission.scenes.items()
        if n in truths
        for s, pose in answer.poses.items()
        if isinstance(pose, Pose)
    ]
    if not stated:
        return []

    def inverse(pose: Array) -> Array:
        return np.linalg.inv(pose)

    def transposed(pose: Array) -> Array:
        out = pose.copy()
        out[:3, :3] = pose[:3, :3].T
        return out

    def millimetres(pose: Array) -> Array:
        out = pose.copy()
        out[:3, 3] /= 1e3
        return out

    def off(change: Callable[[Array], Array]) -> float:
        errors = [pose_error(true, change(pose.matrix)) for true, pose in stated]
        return float(np.median([np.linalg.norm(e[:3]) + np.linalg.norm(e[3:]) for e in errors]))

    as_is = off(lambda pose: pose)
    told = [
        f"poses look {what}: so read, their median error shrinks from {as_is:.3g} to {other:.3g}"
        for change, what in (
            (inverse, "like scan_from_first, and first_from_scan is asked for"),
            (transposed, "as if their rotations were transposed"),
            (millimetres, "as if their shifts were in millimetres"),
        )
        if (other := off(change)) < 0.1 * as_is
    ]
    if told:
        return told
    swap = [3, 4, 5, 0, 1, 2]

    def fits(change: Callable[[Array], Array]) -> float:
        """How far squares of shifts or of turns are from those of normal quantities."""
        out = 0.0
        for part in (slice(0, 3), slice(3, 6)):
            squares = [
                normalised(pose_error(true, p.matrix)[part], change(p.covariance)[part, part])
                for true, p in stated
            ]
            out = max(out, float(abs(np.log(np.median(squares) / chi2.median(3)))))
        return out

    degrees = np.diag([1.0] * 3 + [np.pi / 180] * 3)
    millimetre = np.diag([1e-3] * 3 + [1.0] * 3)
    as_is = fits(lambda c: c)
    return [
        f"covariances look {what}"
        for change, what in (
            (lambda c: c[np.ix_(swap, swap)], "as if the rotation stood before the translation"),
            (lambda c: degrees @ c @ degrees, "as if turns were in degrees"),
            (lambda c: millimetre @ c @ millimetre, "as if they were in square millimetres"),
        )
        if as_is > 3 and fits(change) < 1
    ]
