"""How alike the plans of scans are: which pairs of many scans are worth registering.

Every scan has a signature, the plan of its walls. Two plans are laid on each other at all headings
and shifts; how much of them falls together at the best is their likeness, from 0 to 1. It proposes
nothing and judges nothing: it says in which order pairs are tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from tribrach._types import Array, Progress
from tribrach.registration.clouds.prepared import PreparedScan


@dataclass(frozen=True)
class LikenessGates:
    """How coarse the plans are that are laid on each other (by hand: test_proposals)."""

    cells: int = 96  #: cells of a plan along an edge
    least_cell_m: float = 0.4  #: their least size [m]
    headings: int = 72  #: headings that are tried around the circle
    wall_sine: float = 0.5  #: normals of walls lie below this sine of the slope
    #: a plan reaches out to this share of its edge, so that shifted plans do not wrap around
    reach_share: float = 0.25


GATES = LikenessGates()

_Plans = NDArray[np.complex64]


@dataclass(frozen=True, eq=False)
class Walls:
    """Pieces of surface that a plan is made of."""

    #: (n, 3), their places [m] and unit normals, in the frame of their station
    center: Array
    normal: Array
    area: Array  #: (n,), their areas [m^2]
    radius: float  #: how far the station sees [m]

    @classmethod
    def of(cls, scan: PreparedScan) -> Walls:
        """The coarse surfels of a scan."""
        s = scan.coarse.surfels
        return cls(s.center, s.normal, s.area, scan.radius)


def likeness(scans: Sequence[Walls], progress: Progress = lambda what, done, total: None) -> Array:
    """Likeness (n, n) of the plans of all scans, 0 to 1; 0 on the diagonal and without walls.

    The normalised correlation of method section 2.11 at its best heading and shift, by fast Fourier
    transforms of all headings at once. Scans are taken as upright; the likeness of ones that lean
    says little, and their pairs are tried later.
    """
    out = np.zeros((len(scans), len(scans)))
    if len(scans) < 2:
        return out
    radius = float(np.median([scan.radius for scan in scans]))
    cell = max(GATES.least_cell_m, radius / (GATES.reach_share * GATES.cells))
    turns = 2 * np.pi * np.arange(GATES.headings) / GATES.headings
    still: list[_Plans] = []
    for number, scan in enumerate(scans):
        progress("plans of scans", number, len(scans))
        plan = _plan(scan, 0.0, cell)
        if number:
            turned = np.stack([_plan(scan, turn, cell) for turn in turns])
            moved = fft.fft2(_normalised(turned))
            for other, base in enumerate(still):
                best = float(fft.ifft2(moved * base).real.max())
                out[number, other] = out[other, number] = max(best, 0.0)
        still.append(np.conj(fft.fft2(_normalised(_blurred(plan)[None])))[0])
    progress("plans of scans", len(scans), len(scans))
    return out


def _plan(s: Walls, heading: float, cell: float) -> _Plans:
    """The plan (n, n) of walls turned by a heading: horizontal normals as complex numbers."""
    cells = GATES.cells
    wall = np.abs(s.normal[:, 2]) < GATES.wall_sine
    turn = np.exp(1j * heading)
    at = (s.center[wall, 0] + 1j * s.center[wall, 1]) * turn
    normal = (s.normal[wall, 0] + 1j * s.normal[wall, 1]) * turn * s.area[wall]
    near = np.abs(at) < GATES.reach_share * cells * cell
    at, normal = at[near], normal[near]
    row, column = (np.floor(x / cell).astype(np.int64) % cells for x in (at.imag, at.real))
    place = row * cells + column
    size = cells * cells
    plan = np.bincount(place, normal.real, size) + 1j * np.bincount(place, normal.imag, size)
    # high walls count more than low ones, but not as much more as they are higher
    plan = plan / np.sqrt(np.maximum(np.abs(plan), 1e-12))
    return plan.astype(np.complex64).reshape(cells, cells)


def _blurred(plan: _Plans) -> _Plans:
    """The plan with every cell also in its neighbours, by half."""
    for axis in (0, 1):
        plan = 0.5 * plan + 0.25 * (np.roll(plan, 1, axis) + np.roll(plan, -1, axis))
    return plan.astype(np.complex64)


def _normalised(plans: _Plans) -> _Plans:
    """Plans (k, n, n) of length one; ones without walls stay zero."""
    size = np.sqrt((np.abs(plans) ** 2).sum(axis=(1, 2), keepdims=True))
    return np.asarray(plans / np.maximum(size, 1e-12), dtype=np.complex64)
