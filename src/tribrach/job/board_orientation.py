"""What the centres of a board have in common in all sightings of like orientation.

The centre of a board that is seen at an angle is off by some tenths of a millimetre, by an amount
that repeats whenever the board is seen so, and that is another where it is seen otherwise. Neither
the residuals of a fit nor repeated scans show it (method section 8.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from tribrach._types import Array
from tribrach.geometry.pose import Pose
from tribrach.network.survey import Survey
from tribrach.observations.declaration import Category
from tribrach.targets.detection import Detection


@dataclass(frozen=True)
class OrientationGates:
    """How errors of boards depend on orientation and on the density of points.

    Errors of 0.3 to 0.8 mm are published for a scanner at 28 points per degree, of less than 0.3 mm
    at 109, and of up to 0.5 mm for another at 30 and 90, in one coordinate and over angles to both
    sides (Muralikrishnan et al. 2025). Two sigmas of 0.4 mm at 28 points per degree, falling with
    the root of the density, are 0.8, 0.45 and 0.4 mm at 28, 90 and 109.
    """

    #: density that the setting of the project is for [points per degree]
    points_per_degree: float = 28.0
    #: errors of directions of sight that differ by this are alike by ``exp(-1/2)``; chosen, for the
    #: published ones change over some tens of degrees [rad]
    alike_rad: float = float(np.radians(20.0))


GATES = OrientationGates()


@dataclass(frozen=True, eq=False)
class BoardSighting:
    """One observation of a board."""

    #: its place in the survey: number of the table and of the observation in it
    table: int
    item: int
    target: str  #: name of the board
    detection: Detection  #: what was found
    pose: Pose  #: of the scanner, world from scanner, approximate
    #: (3, 3), derivatives of the observed values by the place of the centre in the scanner frame
    by_place: Array

    @property
    def toward(self) -> Array:
        """Unit vector (3,), world, from the board to the scanner."""
        center = np.asarray(self.detection.center)
        away: Array = -(self.pose.rotation @ center) / np.linalg.norm(center)
        return away


def orientation_covariance(toward: Array, density: Array, sigma: float) -> Array:
    """Covariance (m, m) of one coordinate of a board's centre in several sightings [m^2].

    It is ``s_i s_j exp(-d_ij^2 / (2 a^2))`` with ``s = sigma sqrt(28 / density)`` and the chord d
    between two directions to scanners; density in points per degree, sigma at 28 of them.
    """
    size = sigma * np.sqrt(GATES.points_per_degree / density)
    chord = ((toward[:, None] - toward) ** 2).sum(axis=2)
    alike: Array = np.outer(size, size) * np.exp(-0.5 * chord / GATES.alike_rad**2)
    return alike


def correlate_boards(survey: Survey, sightings: Sequence[BoardSighting], sigma: float) -> None:
    """Add to the covariances of a survey what boards have in common by their orientation.

    ``sigma`` is that of each coordinate at 28 points per degree [m]; nothing is done for 0.
    """
    if sigma <= 0:
        return
    by_name: dict[str, list[BoardSighting]] = {}
    for one in sightings:
        by_name.setdefault(one.target, []).append(one)
    for name, group in by_name.items():
        density = [
            one.detection.facts.get("points_per_degree", GATES.points_per_degree) for one in group
        ]
        alike = orientation_covariance(
            np.array([one.toward for one in group]), np.array(density), sigma
        )
        # the board stands still, so its errors are alike in the frame of the world
        turn = block_diag(*(one.by_place @ one.pose.rotation.T for one in group))
        common = turn @ np.kron(alike, np.eye(3)) @ turn.T
        own = block_diag(
            *(survey.tables()[one.table].columns["covariance"][one.item] for one in group)
        )
        common = (common + common.T) / 2
        survey.correlate(
            np.repeat([one.table for one in group], 3),
            np.repeat([one.item for one in group], 3),
            np.tile(np.arange(3), len(group)),
            own + common,
            f"board {name}",
            (common, Category.ORIENTATION),
        )
