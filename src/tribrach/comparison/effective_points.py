"""Counts how many of n points are independent when their beam footprints overlap.

Neighbours that share a part of their footprints see partly the same surface through partly the same
light; their correlation is taken as the common share of two discs of diameter ``delta`` at distance
``s``: ``r(u) = 2/pi (acos u - u sqrt(1 - u^2))``, ``u = s / delta``. The mean of n points on a
square lattice of pitch p then has the variance ``sigma^2 f / n`` with ``f = sum r`` over the
lattice: 1 while the pitch exceeds the beam, ``pi delta^2 / (4 p^2)`` for dense scans (the integral
of r over the plane is the area of the disc). ``N_eff = n / f`` (method section 9.2). It is
cautious: noise of the timing itself is new with every pulse. Metres.
"""

from __future__ import annotations

import numpy as np

from tribrach._types import Array
from tribrach.cloud.placement import Placement
from tribrach.errors import InputError

__all__ = ["beam_areas", "effective_number", "overlap_factor", "overlap_share"]

#: beams wider than this many pitches take the integral, right to 0.3 % there
_DENSE = 6.0
#: no incidence is taken as flatter than this cosine, 84 degrees
_FLATTEST = 0.1


def overlap_share(u: Array) -> Array:
    """Common share (n,) of two discs at ``u`` diameters from each other; zero beyond 1."""
    inside = np.clip(u, 0.0, 1.0)
    share: Array = 2 / np.pi * (np.arccos(inside) - inside * np.sqrt(1 - inside**2))
    return share


def _lattice_sums(ratio: Array) -> Array:
    """Sum of the shares over a square lattice, for beams of so many pitches."""
    reach = np.arange(-int(_DENSE), int(_DENSE) + 1)
    distance = np.hypot(*np.meshgrid(reach, reach)).ravel()
    sums: Array = overlap_share(distance / ratio[:, None]).sum(axis=1)
    return sums


#: beams of so many pitches, and the sums of their shares, between which is interpolated
_RATIOS = np.linspace(1.0, _DENSE, 501)
_SUMS = _lattice_sums(_RATIOS)


def overlap_factor(ratio: Array) -> Array:
    """Factor f (n,) on the variance of a mean, for beams of ``ratio`` (n,) lattice pitches."""
    table = np.interp(ratio, _RATIOS, _SUMS)
    factor: Array = np.where(ratio > _DENSE, np.pi / 4 * ratio**2, table)
    return factor


def effective_number(count: Array, area: float, footprint: Array) -> Array:
    """Count the independent points among evenly spread ones, at least one.

    Parameters
    ----------
    count : array (m,)
        Points.
    area
        Area of the patch that they lie on [m^2].
    footprint : array (m,)
        Area of the beam on the same surface, that across the beam over the cosine of the
        incidence angle [m^2].

    Returns
    -------
    array (m,)
        Independent points.
    """
    ratio = np.sqrt(4 / np.pi * footprint * count / area)
    number: Array = np.where(count > 0, np.maximum(count / overlap_factor(ratio), 1.0), 0.0)
    return np.minimum(number, count)


def beam_areas(core: Array, normals: Array, placement: Placement) -> Array:
    """Compute the area of the beam on the surface: ``pi/4 d^2 / cos I``.

    d is the beam's diameter at the range from the station (method section 5.2).

    Parameters
    ----------
    core, normals : array (m, 3)
        Points and their unit normals.
    placement
        Where the scan stands.

    Returns
    -------
    array (m,)
        Areas [m^2].

    Raises
    ------
    InputError
        The scan's origin is not known.
    """
    if placement.noise is None:
        raise InputError(f"scan {placement.station} has no known origin, so no beams")
    beam = core - placement.pose.translation
    length = np.maximum(np.linalg.norm(beam, axis=1), 1e-9)
    cosine = np.abs(np.einsum("mi,mi->m", beam, normals)) / length
    across = np.pi / 4 * placement.noise.beam_diameter(length) ** 2
    area: Array = across / np.clip(cosine, _FLATTEST, 1.0)
    return area
