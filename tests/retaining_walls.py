"""Pairs of campaigns at the retaining wall, and the motions found there against the truth."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.comparison.rigid_motion import COMPONENTS, face_axes
from tribrach.comparison.sites import ComparisonSite
from tribrach.geometry.pose import Pose
from tribrach.io.twins import write_twin
from tribrach.job.cloud_file import open_cloud, station_pair
from tribrach.job.compare import compare_clouds
from tribrach.questions.compare.motions import CloudMotions, MotionCollector, MovedPart
from tribrach.simulate.twins import build
from tribrach.simulate.twins.retaining_wall import MOTIONS

Array = np.ndarray
CAMPAIGNS = ("epoch1", "epoch2")
#: what is seen of a plane: along its normal, tilt, turn
SEEN = [COMPONENTS.index(name) for name in ("out", "tilt", "turn")]


def campaigns(folder: Path, seed: int, points: int) -> None:
    """Simulate and run both; not compared with their truth, which takes as long again."""
    folder.mkdir(parents=True, exist_ok=True)
    write_twin(build("retaining-wall", points, seed), folder, lambda *what: None)
    for name in CAMPAIGNS:
        path = folder / f"{name}.toml"
        lines = [line for line in path.read_text().splitlines() if not line.startswith("truth =")]
        path.write_text("\n".join(lines))
        result = CliRunner().invoke(app, ["run", str(path), "-q"])
        assert result.exit_code == 0, result.output


def panels(folder: Path) -> dict[str, Any]:
    """Faces and motions of the panels."""
    path = folder / "epoch2" / "truth" / "truth.json"
    facts: dict[str, Any] = json.loads(path.read_text())["facts"]["panels"]
    return facts


def sites(folder: Path) -> list[ComparisonSite]:
    """A box around the face of each panel, away from its edges."""
    out = []
    for name, panel in panels(folder).items():
        low, high = np.array(panel["face"]) + np.outer([1, -1], [0.25, -0.06, 0.25])
        out.append(ComparisonSite(name, tuple(low), tuple(high)))
    return out


def moved(folder: Path, sites: list[ComparisonSite]) -> CloudMotions:
    """What is said to have moved between the clouds of the second station."""
    later, earlier = (
        open_cloud(folder / "out" / name / "clouds" / "S2.laz") for name in reversed(CAMPAIGNS)
    )
    pair = station_pair(earlier, later)
    assert pair is not None
    collector = MotionCollector(pair)
    results = compare_clouds(
        later, earlier, sites, method="m3c2", stations=pair, distances=collector
    )
    return collector.motions(earlier, results, sites)


def truth_of(motion: Pose, middle: Array, normal: Array) -> Array:
    """Shift along the normal, tilt and turn (3,) of a true motion at the middle of a part."""
    axes = face_axes(normal)
    turn = motion.rotation - motion.rotation.T
    r = np.array([turn[2, 1], turn[0, 2], turn[1, 0]]) / 2
    shift = axes[0] @ (motion @ middle - middle)
    return np.array([shift, r @ np.cross(axes[2], axes[0]), r @ np.cross(axes[1], axes[0])])


@dataclass(frozen=True)
class Judged:
    """Errors over their sigmas (3,) of a panel: out, tilt, turn."""

    off: Array


def judged(folder: Path, part: Mapping[str, Any]) -> Judged | None:
    """A panel of the JSON against its truth; None with too few distances."""
    found = part["motion"]
    if found is None:
        return None
    motion = Pose.from_matrix(np.array(panels(folder)[part["name"]]["motion"]))
    true = truth_of(motion, np.array(found["middle"]), np.array(found["normal"]))
    values = np.array([found["components"][COMPONENTS[k]] for k in SEEN], dtype=float)
    sigmas = np.array([found["covariance"][k][k] for k in SEEN], dtype=float) ** 0.5
    return Judged((values - true) / sigmas)


@dataclass(frozen=True)
class MovedPanels:
    """What was found in one pair of campaigns.

    Attributes
    ----------
    off : array (6, 3)
        Errors over sigmas of the panels as sites.
    relative : array (k, 3)
        The same against the stable area, of parts that were found on one panel.
    statistic, dof
        All errors of the panels together, with their joint covariance.
    still_called_moved
        Of the panels that stand still.
    moved_called_moved
        Were all panels that moved called so?
    parts_on_moved
        Panels that moved and have a part by itself on them.
    parts_elsewhere
        Parts that were called moved where nothing did.
    registration_fails
        Is the registration said to be wrong?
    stable_share
        Of the surface in patches.
    """

    off: Array
    statistic: float
    dof: int
    still_called_moved: int
    moved_called_moved: bool
    parts_on_moved: set[str]
    parts_elsewhere: int
    registration_fails: bool
    stable_share: float


def moved_panels(folder: Path) -> MovedPanels:
    """Panels as sites, and the whole by itself, against the truth."""
    truth = panels(folder)
    named = moved(folder, sites(folder))
    off, errors, gains, own, covariance = [], [], [], [], None
    still, all_moved = 0, True
    for part in named.parts:
        motion = part.motion
        assert motion is not None, part.name
        pose = Pose.from_matrix(np.array(truth[part.name]["motion"]))
        true = truth_of(pose, motion.middle, motion.normal)
        sigma = np.sqrt(np.diag(motion.covariance))[SEEN]
        off.append((motion.values[SEEN] - true) / sigma)
        # the same in the directions that are seen, with what the stations do to them
        whole = np.zeros(6)
        whole[SEEN] = true * [1, motion.lever, motion.lever]
        errors.append(motion.parameters - motion.basis.T @ whole)
        gains.append(motion.gain)
        own.append(motion.own)
        if part.name in MOTIONS:
            all_moved &= part.verdict == "moved"
        else:
            still += part.verdict != "no motion found"
    later, earlier = (
        open_cloud(folder / "out" / name / "clouds" / "S2.laz") for name in reversed(CAMPAIGNS)
    )
    pair = station_pair(earlier, later)
    assert pair is not None
    gain, error = np.vstack(gains), np.concatenate(errors)
    covariance = gain @ pair.covariance @ gain.T
    start = 0
    for block in own:
        stop = start + len(block)
        covariance[start:stop, start:stop] += block
        start = stop
    alone = moved(folder, [])
    on, elsewhere = set[str](), 0
    for part in alone.parts:
        if part.verdict == "no motion found" or part.verdict == "too few distances":
            continue
        names = under(part, truth)
        on |= names & set(MOTIONS)
        elsewhere += not names & set(MOTIONS)
    stable = alone.stable
    return MovedPanels(
        off=np.array(off),
        statistic=float(error @ np.linalg.solve(covariance, error)),
        dof=len(error),
        still_called_moved=still,
        moved_called_moved=all_moved,
        parts_on_moved=on,
        parts_elsewhere=elsewhere,
        registration_fails=stable is not None and not stable.agrees,
        stable_share=0.0 if stable is None else stable.share,
    )


def under(part: MovedPart, truth: Mapping[str, Any]) -> set[str]:
    """Panels that a part lies on: those whose face its middle, or a lever beside it, is on."""
    assert part.motion is not None
    middle, lever = part.motion.middle, part.motion.lever
    out = set()
    for name, panel in truth.items():
        low, high = np.array(panel["face"])
        within = (middle[0] + 0.7 * lever > low[0]) and (middle[0] - 0.7 * lever < high[0])
        if within and abs(middle[1] - low[1]) < 0.1 and low[2] < middle[2] < high[2]:
            out.add(name)
    return out
