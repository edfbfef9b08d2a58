"""Scanners as they are built: what light does in them besides the noise of their points.

An instrument is a :class:`~tribrach.simulate.scanner.Scanner` of its class, whose noise the user of
it replaces by that of the model at hand (``replace(PULSED, noise=...)``). Method section 5.6.

Where the figures come from
---------------------------
``speckle``
    Light of a rough surface interferes with itself: the contrast of laser light on a detector that
    sees M speckles is ``1 / sqrt(M)`` (Goodman 2007), 2 to 10 % for terrestrial scanners. On the
    real boards of the tests, scanned by a pulsed scanner at 5 to 22 m, white print scatters by 4 to
    5 % of its light.
``weakest``
    The strength of the farthest echo that a data sheet grants to a reflectance: 8, 18 and 34 % at
    120, 180 and 270 m for a pulsed scanner (Leica ScanStation P40), three echoes of about the same
    strength; 2 % at 50 m for one that compares phases (FARO Focus S 150).
``intensity``
    The noise of the detector, a fifth of the weakest echo: with a threshold of five sigmas noise
    alone passes for an echo once in a few million beams, and an echo at the threshold is lost as
    often as not.
``fall_off``
    Ranges of most light from 2 to 6 m are published for terrestrial scanners (Kaasalainen et al.
    2011; Fang et al. 2015).
``separable``
    A pulse of 2 ns tells surfaces apart that are 0.3 m from each other in range, half its length,
    and the stronger echo counts. Comparing phases gives one range, a mean of both; what is far from
    either is filtered out for the larger part.
"""

from __future__ import annotations

import numpy as np

from tribrach.instruments.scan_noise import ScanNoise
from tribrach.simulate.falloff import FallOff
from tribrach.simulate.scanner import Scanner
from tribrach.units import SEC

#: the weakest echo over the noise of the detector
_THRESHOLD = 5.0


def _weakest(fall_off: FallOff, reflectance: float, length: float) -> float:
    """Strength of the echo of a reflectance at a range [m]."""
    return reflectance * float(fall_off.at(np.array([length]))[0])


_PULSED_FALL_OFF = FallOff(blind=0.3, focus=6.0)
_PHASE_FALL_OFF = FallOff(blind=0.3, focus=3.0)
_PULSED_WEAKEST = _weakest(_PULSED_FALL_OFF, 0.18, 180.0)
_PHASE_WEAKEST = _weakest(_PHASE_FALL_OFF, 0.02, 50.0)

#: measures the time of pulses
PULSED = Scanner(
    ScanNoise(0.0012, 1e-5, 8 * SEC, 8 * SEC, 0.0035, 0.00023),
    intensity=_PULSED_WEAKEST / _THRESHOLD,
    speckle=0.05,
    fall_off=_PULSED_FALL_OFF,
    weakest=_PULSED_WEAKEST,
    farthest=270.0,
    separable=0.3,
    separated="strongest",
    lost=0.0,
)

#: compares phases of modulated light
PHASE = Scanner(
    ScanNoise(0.001, 1e-5, 10 * SEC, 10 * SEC, 0.00225, 0.00019),
    intensity=_PHASE_WEAKEST / _THRESHOLD,
    speckle=0.05,
    fall_off=_PHASE_FALL_OFF,
    weakest=_PHASE_WEAKEST,
    nearest=0.6,
    farthest=150.0,
    separable=0.3,
    separated="mean",
    lost=0.7,
)
