"""The chapter on scanner stations: where they stand, where they look, how they lean."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array
from tribrach.geometry.rotation import skew
from tribrach.network.adjustment import Adjustment
from tribrach.report.chapter import Chapter
from tribrach.report.chapters.points import Uncertainty, places_of
from tribrach.report.content import Head, ReportSettings, StationRow
from tribrach.report.numbers import matrix, number, sigmas, triple
from tribrach.report.subject import Subject
from tribrach.report.tables import ReportTable, Spec, Worst, build_table

if TYPE_CHECKING:
    from tribrach.job.results import JobResults

#: a total tilt below this [rad] has no direction, so no derivative
_LEVEL = 1e-9

#: rows of a network of very many stations
_WORST = Worst("those with the largest sigma", lambda s: sum((v or 0.0) ** 2 for v in s.sigma))


@dataclass(frozen=True)
class Attitude:
    """Heading in [0, 2 pi), tilts about E, N, total (n, 4) [rad]; derivative (n, 4, 3) by turns."""

    angles: Array
    derivative: Array

    def sigma(self, covariance: Array) -> Array:
        """Standard deviations (n, 4) from covariances (n, 3, 3) of the increments."""
        j = self.derivative
        variance = np.einsum("nij,njk,nik->ni", j, covariance, j)
        return np.sqrt(np.where(variance > 0, variance, np.nan))


def attitude(rotation: Array) -> Attitude:
    """Heading and tilts of rotations (n, 3, 3) world from scanner.

    Heading is the azimuth ``atan2(a_E, a_N)`` of the scanner's x axis a; the tilts turn its z
    axis c: about E ``atan2(-c_N, c_U)``, about N ``atan2(c_E, c_U)``, in total the angle between
    c and the vertical. An increment d moves an axis by ``d x a = -[a]x d``.
    """
    a, c = rotation[:, :, 0], rotation[:, :, 2]
    by_a, by_c = -skew(a), -skew(c)
    flat = np.hypot(c[:, 0], c[:, 1])
    angles = np.stack(
        [
            np.arctan2(a[:, 0], a[:, 1]) % (2 * np.pi),
            np.arctan2(-c[:, 1], c[:, 2]),
            np.arctan2(c[:, 0], c[:, 2]),
            np.arctan2(flat, c[:, 2]),
        ],
        axis=1,
    )
    safe = np.where(flat > _LEVEL, flat, 1.0)[:, None]
    leaning = (c[:, :1] * by_c[:, 0] + c[:, 1:2] * by_c[:, 1]) / safe
    leaning[flat <= _LEVEL] = 0.0
    derivative = np.stack(
        [
            _turn(a[:, 0], a[:, 1], by_a[:, 0], by_a[:, 1]),
            _turn(-c[:, 1], c[:, 2], -by_c[:, 1], by_c[:, 2]),
            _turn(c[:, 0], c[:, 2], by_c[:, 0], by_c[:, 2]),
            _turn(flat, c[:, 2], leaning, by_c[:, 2]),
        ],
        axis=1,
    )
    return Attitude(angles, derivative)


def _turn(y: Array, x: Array, by_y: Array, by_x: Array) -> Array:
    """Derivative (n, 3) of ``atan2(y, x)``; zero where both vanish."""
    square = x**2 + y**2
    safe = np.where(square > _LEVEL**2, square, np.inf)[:, None]
    out: Array = (x[:, None] * by_y - y[:, None] * by_x) / safe
    return out


def stations(
    adjustment: Adjustment, settings: ReportSettings, uncertainty: Uncertainty
) -> tuple[StationRow, ...]:
    """All scanner stations; ``uncertainty`` lists positions, stations after the points."""
    names = adjustment.layout.names["pose"]
    if not names:
        return ()
    state, first = adjustment.state, adjustment.layout.count("point")
    factor = adjustment.variance_factor(posterior=settings.posterior)
    covariance = adjustment.family_covariances("pose") * factor
    view = attitude(state.pose_r)
    sigma, spread = sigmas(covariance), view.sigma(covariance[:, 3:, 3:])
    places = places_of(adjustment, state.pose_t, covariance[:, :3, :3])
    pose = np.tile(np.eye(4), (len(names), 1, 1))
    pose[:, :3, :3], pose[:, :3, 3] = state.pose_r, state.pose_t
    return tuple(
        StationRow(
            name=name,
            world_from_scanner=matrix(pose[i]),
            covariance=matrix(covariance[i]),
            dof=uncertainty.dof(first + i),
            xyz=triple(state.pose_t[i]),
            sigma=triple(sigma[i, :3]),
            heading=float(view.angles[i, 0]),
            heading_sigma=number(spread[i, 0]),
            tilt_e=float(view.angles[i, 1]),
            tilt_e_sigma=number(spread[i, 1]),
            tilt_n=float(view.angles[i, 2]),
            tilt_n_sigma=number(spread[i, 2]),
            tilt=float(view.angles[i, 3]),
            tilt_sigma=number(spread[i, 3]),
            ellipse=uncertainty.ellipse(first + i),
            height_interval=uncertainty.height(first + i),
            **{key: coordinates[i] for key, coordinates in places.items()},
        )
        for i, name in enumerate(names)
    )


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter; its table has no rows without scanners."""
    yield Chapter("stations", "Stations", tables=(_table(head),), signed=True)


def _table(head: Head) -> ReportTable:
    """Scanner stations with attitude."""
    note = (
        f"Sigmas are {head.origin}. Heading is the azimuth of the scanner's x axis; the tilts "
        "turn its z axis about E and N; tilt is its angle with the vertical."
    )
    columns: list[Spec] = [
        head.columns.word("Station", "name"),
        *head.columns.axes("", "xyz", head.columns.metres),
        *head.columns.axes("σ ", "sigma", head.columns.mm),
        head.columns.angle("heading", attrgetter("heading"), full_circle=True),
        head.columns.small_angle("σ heading", attrgetter("heading_sigma")),
        head.columns.angle("tilt about E", attrgetter("tilt_e"), wide=True),
        head.columns.small_angle("σ", attrgetter("tilt_e_sigma"), wide=True),
        head.columns.angle("tilt about N", attrgetter("tilt_n"), wide=True),
        head.columns.small_angle("σ", attrgetter("tilt_n_sigma"), wide=True),
        head.columns.angle("tilt", attrgetter("tilt")),
        head.columns.small_angle("σ", attrgetter("tilt_sigma")),
        *head.columns.ellipse(wide=True),
    ]
    return build_table(
        "stations", "Stations", note, head.stations, columns, worst=_WORST, ends=_ends
    )


def _ends(station: StationRow) -> tuple[str, ...]:
    """The station itself."""
    return (station.name,)


SUBJECT = Subject("stations", _chapters)
