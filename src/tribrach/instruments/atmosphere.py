"""Refractive index of air and the first velocity correction of distances.

Group refractivity of light and near infrared in the closed form that the IAG recommends (IUGG 1999,
resolution 3; Rueger, Report of the ad-hoc working party on refractive indices, 1999), good to 1
ppm; vapour pressure by the Magnus formula over water (Sonntag 1990).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tribrach._types import Array

ZERO_CELSIUS = 273.15


@dataclass(frozen=True)
class Air:
    """Air along a sight."""

    temperature_c: float = 12.0  #: degrees Celsius
    pressure_hpa: float = 1013.25  #: at the instrument [hPa]
    humidity_percent: float = 60.0  #: relative humidity


#: the air for which most instruments give distances without a correction
REFERENCE = Air()


def vapour_pressure_hpa(temperature_c: ArrayLike, humidity_percent: ArrayLike) -> Array:
    """Partial pressure of water vapour [hPa], by the Magnus formula of Sonntag."""
    t = np.asarray(temperature_c, dtype=float)
    saturated = 6.112 * np.exp(17.62 * t / (243.12 + t))
    vapour: Array = np.asarray(humidity_percent) / 100 * saturated
    return vapour


def refractivity(
    temperature_c: ArrayLike,
    pressure_hpa: ArrayLike,
    humidity_percent: ArrayLike,
    wavelength_um: float,
) -> Array:
    """Group refractivity ``N = (n - 1) 1e6`` of air.

    ``N = 273.15/1013.25 N_g p/T - 11.27 e/T`` with ``N_g = 287.6155 + 4.88660/L^2 + 0.06800/L^4``
    for dry air at 0 deg C, 1013.25 hPa and 0.0375 % of CO2.

    ``wavelength_um``: wavelength L [micrometres].
    """
    kelvin = np.asarray(temperature_c, dtype=float) + ZERO_CELSIUS
    dry = 287.6155 + 4.88660 / wavelength_um**2 + 0.06800 / wavelength_um**4
    vapour = vapour_pressure_hpa(temperature_c, humidity_percent)
    pressure = np.asarray(pressure_hpa, dtype=float)
    result: Array = (ZERO_CELSIUS / 1013.25 * dry * pressure - 11.27 * vapour) / kelvin
    return result


def first_velocity_ppm(
    temperature_c: ArrayLike,
    pressure_hpa: ArrayLike,
    humidity_percent: ArrayLike = 60.0,
    *,
    reference: Air = REFERENCE,
    wavelength_um: float = 0.658,
) -> Array:
    """Correction of a distance for the air it was measured in [1e-6].

    It is added to a distance that the instrument computed for its reference air, and is the
    refractivity of the reference less the true one (Rueger, "Electronic Distance Measurement",
    first velocity correction).

    ``humidity_percent``: relative humidity; NaN takes that of the reference, which matters 0.3 ppm
    at 12 deg C; ``wavelength_um``: wavelength of the light [micrometres].
    """
    humidity = np.asarray(humidity_percent, dtype=float)
    humidity = np.where(np.isnan(humidity), reference.humidity_percent, humidity)
    there = refractivity(
        reference.temperature_c, reference.pressure_hpa, reference.humidity_percent, wavelength_um
    )
    here = refractivity(temperature_c, pressure_hpa, humidity, wavelength_um)
    return there - here
