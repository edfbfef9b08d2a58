"""Lever arms that a job estimated, and files of them for the next job."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.answers import Matrix, Result, Vector
from tribrach.errors import AdjustmentError
from tribrach.io.lever_arm_file import LeverArmResult, lever_arm_text
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.observations.base import Use
from tribrach.observations.gnss import Antennas, MountedPoints
from tribrach.observations.scanner import Inclinations, TargetCentres


@dataclass(frozen=True, eq=False)
class UnlevelledArm(Result):
    """The lever arm without what levels the scanners [m, m^2]."""

    vector: Vector
    covariance: Matrix


@dataclass(frozen=True, eq=False)
class EstimatedLeverArm(
    Result, without=("name",), keys={"gap": "horizon_without_targets", "free": "unlevelled"}
):
    """An estimated lever arm in the scanner frame."""

    name: str
    #: (3,) [m] and (3, 3) [m^2], zero for held components
    vector: Vector
    covariance: Matrix
    stations: tuple[str, ...]  #: those that carry it
    #: widest part of the horizon [rad] without targets, at the station that sees best all around;
    #: None without targets
    gap: float | None
    free: UnlevelledArm | None = None  #: vector and covariance without what levels the scanners

    @property
    def sigma(self) -> Array:
        """Standard deviations (3,) [m]."""
        out: Array = np.sqrt(np.diag(self.covariance))
        return out


def lever_arms(adjustment: Adjustment, factor: float = 1.0) -> list[EstimatedLeverArm]:
    """All lever arms of which a component is an unknown."""
    carried = _carried(adjustment)
    unlevelled = _unlevelled(adjustment) if carried else None
    covariances = factor * adjustment.family_covariances("vector")
    out = []
    for k, stations in carried.items():
        if not covariances[k].any():
            continue
        free = None
        if unlevelled is not None:
            own = factor * unlevelled.family_covariances("vector")[k]
            free = UnlevelledArm(unlevelled.state.vectors[k], own)
        gaps = [gap for s in stations if (gap := _gap(adjustment, s)) is not None]
        out.append(
            EstimatedLeverArm(
                adjustment.layout.names["vector"][k],
                adjustment.state.vectors[k],
                covariances[k],
                tuple(adjustment.layout.names["pose"][s] for s in stations),
                min(gaps, default=None),
                free,
            )
        )
    return out


def _carried(adjustment: Adjustment) -> dict[int, list[int]]:
    """Stations (numbers) by the number of the lever arm that they carry."""
    out: dict[int, set[int]] = {}
    for o in adjustment.network.observations:
        if isinstance(o, Antennas | MountedPoints):
            for k in np.flatnonzero(o.use == Use.ACTIVE):
                out.setdefault(int(o.lever_arm[k]), set()).add(int(o.station[k]))
    return {arm: sorted(stations) for arm, stations in sorted(out.items())}


def _gap(adjustment: Adjustment, station: int) -> float | None:
    """Widest part of a scanner's horizon without targets [rad]."""
    around: list[float] = []
    for o in adjustment.network.observations:
        if isinstance(o, TargetCentres):
            active = (o.station == station) & (o.use == Use.ACTIVE)
            around += np.arctan2(o.values[active, 1], o.values[active, 0]).tolist()
    if not around:
        return None
    angles = np.sort(around)
    return float(np.diff(angles, append=angles[0] + 2 * np.pi).max())


def _unlevelled(adjustment: Adjustment) -> Adjustment | None:
    """The network without inclinations, if it has any and can do without them."""
    network = adjustment.network
    tables = []
    for o in network.observations:
        levels = isinstance(o, Inclinations)
        tables.append(replace(o, use=np.full(len(o), Use.OFF)) if levels else o)
    if not any(isinstance(o, Inclinations) for o in network.observations):
        return None
    try:
        return adjust(replace(network, observations=tuple(tables)))
    except AdjustmentError:
        return None


def lever_arm_files(
    arms: Sequence[EstimatedLeverArm], folder: Path, datum: str, sigma_origin: str
) -> dict[Path, str]:
    """Contents of ``lever-arm-NAME.toml`` by their paths."""
    today = datetime.date.today().isoformat()
    texts = {}
    for arm in arms:
        plain = "".join(ch if ch.isalnum() or ch in "-_" else "_" for ch in arm.name)
        result = LeverArmResult(
            arm.name, arm.vector, arm.covariance, arm.stations, today, datum, sigma_origin
        )
        texts[folder / f"lever-arm-{plain}.toml"] = lever_arm_text(result)
    return texts
