"""The hydrostatic delay that the engine always computes with, taken out where there is no air.

RTKLIB has no option for it: whatever the model of the troposphere, the ranges of a baseline get the
hydrostatic delay of the standard atmosphere (Saastamoinen) at both receivers. Over a baseline b the
delays differ because satellites stand b/R higher at one end. In simulated data without air this
makes a baseline too short by up to a part in a million: 1.5 mm over 2 km.

The difference of the delays ``t_j`` of the satellites is known from their directions, and what it
does to the coordinates is the least-squares solution of ``-e_j dx + c = t_j`` with the weights of
the engine, a clock c for each epoch, system and frequency. Mapping function: Black and Eisner
(1984), J. Geophys. Res. 89; zenith delay: Davis et al. (1985), Radio Science 20:1593. Method
section 2.7.
"""

from __future__ import annotations

import numpy as np

from tribrach._types import Array
from tribrach.geodesy.site import EllipsoidSite
from tribrach.gnss.fixed_phases import phase_variance, sight_lines, signal_groups
from tribrach.io.gnss.solution_file import PhaseResiduals

#: share of the displacement that is not sure: directions to 0.1 degrees, mapping functions
UNSURE = 0.03
#: radius of the orbits of navigation satellites [m]: GPS, and systems that are farther
_ORBIT = 26.56e6
_ORBITS = {"G": _ORBIT, "R": 25.51e6, "E": 29.60e6, "C": 27.91e6, "J": 42.16e6}


def zenith_delay(place: Array) -> float:
    """Hydrostatic delay in zenith [m] of the standard atmosphere at a place (3,), ECEF [m]."""
    latitude, _, height = EllipsoidSite.centred(place[None]).geodetic(np.zeros((1, 3)))[0]
    pressure = 1013.25 * (1 - 2.2557e-5 * max(float(height), 0.0)) ** 5.2568
    gravity = 1 - 0.00266 * np.cos(2 * latitude) - 0.00028 * float(height) / 1e3
    return float(0.0022768 * pressure / gravity)


def mapped(sine: Array) -> Array:
    """Delay in units of that in zenith (n,) for sines of elevations (n,)."""
    out: Array = 1.001 / np.sqrt(0.002001 + sine**2)
    return out


def delay_differences(phases: PhaseResiduals, base: Array, rover: Array) -> Array:
    """Hydrostatic delay at the rover minus at the base (n,) [m]; both places ECEF (3,) [m]."""
    toward = sight_lines(phases, rover)
    orbit = np.array([_ORBITS.get(name[0], _ORBIT) for name in phases.satellites.tolist()])
    sine: Array = np.sin(phases.elevation)
    radius = float(np.linalg.norm(rover))
    distance = np.sqrt(orbit**2 - radius**2 * (1 - sine**2)) - radius * sine
    from_base = distance[:, None] * toward + (rover - base)
    up = EllipsoidSite.centred(base[None]).w_from_ecef[2]
    seen = from_base @ up / np.linalg.norm(from_base, axis=1)
    return np.asarray(zenith_delay(rover) * mapped(sine) - zenith_delay(base) * mapped(seen))


def displacement(phases: PhaseResiduals, delay: Array, rover: Array) -> Array:
    """Shift (3,) [m] that corrects a rover with fixed ambiguities for the delays (n,) [m]."""
    group = signal_groups(phases)
    weight = 1 / phase_variance(phases.elevation)
    table = np.column_stack([-sight_lines(phases, rover), delay])
    total = np.bincount(group, weight)
    sums = [np.bincount(group, weight * table[:, k]) for k in range(4)]
    mean = np.stack(sums, axis=1) / total[:, None]
    centred = (table - mean[group]) * np.sqrt(weight)[:, None]
    return np.asarray(np.linalg.lstsq(centred[:, :3], centred[:, 3], rcond=None)[0], dtype=float)
