"""Lever arms that a job estimated: a chapter of its report, and files for the next job."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import AdjustmentError
from tribrach.io.lever_arm_file import LeverArmResult, lever_arm_text
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.observations.base import Use
from tribrach.observations.gnss import Antennas, MountedPoints
from tribrach.observations.scanner import Inclinations, TargetCentres
from tribrach.report.chapter import Chapter
from tribrach.report.columns import ColumnSet
from tribrach.report.style import Style
from tribrach.report.tables import build_table

__all__ = ["EstimatedLeverArm", "lever_arm_chapter", "lever_arm_files", "lever_arms"]


#: targets that leave a wider part of the horizon free than this are not all around [rad]
_GAP = np.radians(180.0)


#: a component is not zero from here on (99 %)
_SIGNIFICANT = 2.58


@dataclass(frozen=True, eq=False)
class EstimatedLeverArm:
    """An estimated lever arm in the scanner frame.

    vector (3,) [m], covariance (3, 3) [m^2], zero for held components; stations : that carry it;
    gap : widest part of the horizon [rad] without targets, at the station that sees best all
    around, None without targets; free : the same without what levels the scanners.
    """

    name: str
    vector: Array
    covariance: Array
    stations: tuple[str, ...]
    gap: float | None
    free: tuple[Array, Array] | None = None

    @property
    def sigma(self) -> Array:
        """Standard deviations (3,) [m]."""
        out: Array = np.sqrt(np.diag(self.covariance))
        return out


def lever_arms(adjustment: Adjustment, factor: float = 1.0) -> list[EstimatedLeverArm]:
    """All lever arms of which a component is an unknown.

    factor : on a-priori covariances (a posteriori variance).
    """
    carried = _carried(adjustment)
    unlevelled = _unlevelled(adjustment) if carried else None
    covariances = factor * adjustment.family_covariances("vector")
    out = []
    for k, stations in carried.items():
        if not covariances[k].any():
            continue
        free = None
        if unlevelled is not None:
            free = unlevelled.state.vectors[k], factor * unlevelled.family_covariances("vector")[k]
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
            mine = (o.station == station) & (o.use == Use.ACTIVE)
            around += np.arctan2(o.values[mine, 1], o.values[mine, 0]).tolist()
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


@dataclass(frozen=True)
class _Row:
    name: str
    how: str
    values: tuple[float, ...]
    sigmas: tuple[float, ...]


def lever_arm_chapter(found: Sequence[EstimatedLeverArm], angle: str, sigma_origin: str) -> Chapter:
    """The chapter of the report; found : at least one."""
    rows = []
    for arm in found:
        how = "as adjusted" if arm.free is None else "with levelling, as adjusted"
        rows.append(_Row(arm.name, how, tuple(arm.vector), tuple(arm.sigma)))
        if arm.free is not None:
            vector, covariance = arm.free
            sigma = np.sqrt(np.diag(covariance))
            rows.append(_Row(arm.name, "without levelling", tuple(vector), tuple(sigma)))
    columns = ColumnSet(Style("deg" if angle == "deg" else "gon"))
    specs = [columns.word("Lever arm", "name"), columns.word("Solution", "how")]
    for k, axis in enumerate("xyz"):
        specs.append(columns.mm(axis, lambda row, k=k: row.values[k]))  # type: ignore[misc]
        specs.append(columns.mm(f"σ {axis}", lambda row, k=k: row.sigmas[k]))  # type: ignore[misc]
    note = (
        "From the origin of the scanner to the antenna or prism, in the scanner frame. "
        f"{sigma_origin}"
    )
    sentences = [sentence for arm in found for sentence in _sentences(arm)]
    return Chapter(
        "lever_arm_calibration",
        "Lever arms",
        tuple(sentences),
        (),
        (build_table("lever-arms", "Lever arms", note, rows, specs),),
        {arm.name: _facts(arm) for arm in found},
    )


def _sentences(arm: EstimatedLeverArm) -> list[str]:
    """What a surveyor should know of a lever arm."""
    size = ", ".join(
        f"{axis} {1e3 * v:.1f} mm (held)" if s == 0 else f"{axis} {1e3 * v:.1f} +- {1e3 * s:.1f} mm"
        for axis, v, s in zip("xyz", arm.vector, arm.sigma, strict=True)
    )
    carriers = f"{len(arm.stations)} station{'s' if len(arm.stations) > 1 else ''}"
    out = [f"Lever arm {arm.name}, carried by {carriers}: {size}."]
    odd = [
        axis
        for axis, v, s in zip("xy", arm.vector, arm.sigma, strict=False)
        if s > 0 and abs(v) > _SIGNIFICANT * s
    ]
    if odd:
        out.append(
            f"Lever arm {arm.name} is not zero in {' and '.join(odd)}: the antenna does not stand "
            "over the scanner's axis."
        )
    if arm.gap is not None and arm.gap > _GAP:
        open_deg = np.degrees(arm.gap)
        out.append(
            f"The targets that determine lever arm {arm.name} leave {open_deg:.0f} degrees of the "
            "horizon free: the scanner's place is extrapolated from them; with targets all around "
            "z and the component across the view become two to three times better."
        )
    if arm.free is not None:
        vector, covariance = arm.free
        change, sigma = vector - arm.vector, np.sqrt(np.diag(covariance))
        worst = int(np.argmax(np.abs(change)))
        out.append(
            f"Without levelling lever arm {arm.name} changes by {1e3 * change[worst]:+.1f} mm in "
            f"{'xyz'[worst]} (sigma there {1e3 * sigma[worst]:.1f} mm)."
        )
    return out


def _facts(arm: EstimatedLeverArm) -> dict[str, object]:
    return {
        "vector": arm.vector.tolist(),
        "covariance": arm.covariance.tolist(),
        "stations": list(arm.stations),
        "horizon_without_targets": arm.gap,
        "unlevelled": None
        if arm.free is None
        else {"vector": arm.free[0].tolist(), "covariance": arm.free[1].tolist()},
    }


def lever_arm_files(
    found: Sequence[EstimatedLeverArm], folder: Path, datum: str, sigma_origin: str
) -> dict[Path, str]:
    """Contents of ``lever-arm-NAME.toml`` by their paths."""
    today = datetime.date.today().isoformat()
    texts = {}
    for arm in found:
        plain = "".join(ch if ch.isalnum() or ch in "-_" else "_" for ch in arm.name)
        result = LeverArmResult(
            arm.name, arm.vector, arm.covariance, arm.stations, today, datum, sigma_origin
        )
        texts[folder / f"lever-arm-{plain}.toml"] = lever_arm_text(result)
    return texts
