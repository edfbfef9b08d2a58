"""Areas on a surface whose overlap neighbouring points share, for effective numbers.

How many of the points on an area count as independent is the instrument's affair
(:mod:`tribrach.instruments.neighbours`, method section 5.7); here is how large its discs are on a
surface. Metres.
"""

from __future__ import annotations

import numpy as np

from tribrach._types import Array
from tribrach.cloud.placement import Placement
from tribrach.errors import InputError
from tribrach.instruments.neighbours import SharedNoise

#: no incidence is taken as flatter than this cosine, 84 degrees
_FLATTEST = 0.1


def beam_areas(core: Array, normals: Array, placement: Placement) -> Array:
    """Compute the area on the surface that points share: ``pi/4 w^2 / cos I``.

    w is the diameter at the range from the station: the beam's (method section 5.2) unless the
    instrument has another one (method section 5.7).
    """
    shared = _shared(placement)
    beam = core - placement.pose.translation
    length = np.maximum(np.linalg.norm(beam, axis=1), 1e-9)
    cosine = np.abs(np.einsum("mi,mi->m", beam, normals)) / length
    across = np.pi / 4 * shared.diameter(length) ** 2
    area: Array = across / np.clip(cosine, _FLATTEST, 1.0)
    return area


def shared_share(placement: Placement) -> float:
    """Share of their range variance that points of one footprint share, 1 unless it is known."""
    return _shared(placement).share


def _shared(placement: Placement) -> SharedNoise:
    """What neighbouring points of a scan share."""
    if placement.noise is None:
        raise InputError(f"scan {placement.station} has no known origin, so no beams")
    return placement.noise.shared
