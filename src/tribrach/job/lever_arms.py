"""Antennas and prisms on scanners: their lever arms as unknowns with what is known of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.io.lever_arm_file import read_lever_arm
from tribrach.network.survey import Survey
from tribrach.observations.control import VectorComponentPriors, VectorPriors
from tribrach.observations.gnss import MountedPoints
from tribrach.project import Project
from tribrach.project.sections import LeverArm, StationSection
from tribrach.units import MM


@dataclass(frozen=True)
class KnownLeverArm:
    """A lever arm known before the adjustment, in the scanner frame."""

    vector: Array  #: from the scanner to the antenna, (3,) [m]
    covariance: Array  #: (3, 3) [m^2], zero for a component that is held
    source: str  #: where it comes from


def lever_arms_of(project: Project) -> dict[str, tuple[str, ...]]:
    """Find which lever arms each station carries."""
    for name, station in project.stations.items():
        for arm in station.lever_arm:
            if arm not in project.lever_arms:
                raise project.error(
                    ("stations", name, "lever_arm"),
                    f"lever arm {arm} is not defined",
                    f"add a section [lever_arms.{arm}]",
                )
    return {name: station.lever_arm for name, station in project.stations.items()}


def add_lever_arms(survey: Survey, arms: Mapping[str, KnownLeverArm]) -> None:
    """Add lever arms to a survey, as vectors with what is known of them."""
    for name, arm in arms.items():
        vector, covariance, source = arm.vector, arm.covariance, arm.source
        free = np.diag(covariance) > 0
        survey.vectors[name] = (vector, free)
        if free.all():
            survey.add(
                VectorPriors,
                values=[vector],
                covariance=[covariance],
                vector=[name],
                source=[source],
            )
            continue
        axes = np.flatnonzero(free)
        if len(axes) == 0:
            continue
        table = survey.add(
            VectorComponentPriors,
            values=vector[axes],
            sigma=np.sqrt(np.diag(covariance)[axes]),
            vector=[name] * len(axes),
            axis=axes.astype(float),
            source=[source] * len(axes),
        )
        if len(axes) == 2 and covariance[axes[0], axes[1]] != 0:
            both = covariance[np.ix_(axes, axes)]
            survey.correlate([table, table], [0, 1], [0, 0], both, source)


def known_lever_arm(name: str, arm: LeverArm, folder: Path) -> KnownLeverArm:
    """Find what a section or its file says of a lever arm."""
    if arm.file is not None:
        known = read_lever_arm(folder / arm.file)
        return KnownLeverArm(known.vector, known.covariance, arm.file)
    sigmas = (arm.sigma_x_mm, arm.sigma_y_mm, arm.sigma_z_mm)
    sigma = np.array([s if s is not None else arm.sigma_mm for s in sigmas], dtype=float) * MM
    vector = np.array([arm.x_m, arm.y_m, arm.z_m], dtype=float)
    return KnownLeverArm(vector, np.diag(sigma**2), f"lever arm {name}")


def add_antenna_stations(survey: Survey, stations: Mapping[str, StationSection]) -> None:
    """Add the stations that antennas and compasses place without any scan."""
    for name, station in stations.items():
        arms = len(station.lever_arm)
        turned = arms > 1 or (arms and station.heading_deg is not None)
        if name not in survey.stations and (arms > 2 or (station.levelled and turned)):
            survey.station(name, source=f"station {name}")


def add_mounted_points(
    survey: Survey, stations: Mapping[str, StationSection], arms: Mapping[str, LeverArm]
) -> None:
    """Tie points on scanners to their stations by lever arms."""
    for name, station in stations.items():
        for point, arm in zip(station.mounted_point, station.lever_arm, strict=False):
            survey.add(
                MountedPoints,
                values=np.zeros((1, 3)),
                sigma=max(arms[arm].mounting_mm, 0.01) * MM,
                station=[name],
                point=[point],
                lever_arm=[arm],
                source=[f"station {name}"],
            )
