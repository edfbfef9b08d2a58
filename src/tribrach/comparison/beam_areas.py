"""How large is the beam on the surface at each core point?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach.cloud.placement import Placement
from tribrach.errors import InputError

__all__ = ["beam_areas"]

Array = NDArray[np.float64]

#: no incidence is taken as flatter than this cosine, 84 degrees
_FLATTEST = 0.1


def beam_areas(core: Array, normals: Array, placement: Placement) -> Array:
    """Areas (m,) [m^2] of the footprint at points (m, 3) with normals: ``pi/4 d^2 / cos I``.

    d is the beam's diameter at the range from the station (method section 5.2).

    Raises
    ------
    InputError : the scan's origin is not known.
    """
    if placement.noise is None:
        raise InputError(f"scan {placement.station} has no known origin, so no beams")
    beam = core - placement.pose.translation
    length = np.maximum(np.linalg.norm(beam, axis=1), 1e-9)
    cosine = np.abs(np.einsum("mi,mi->m", beam, normals)) / length
    across = np.pi / 4 * placement.noise.beam_diameter(length) ** 2
    area: Array = across / np.clip(cosine, _FLATTEST, 1.0)
    return area
