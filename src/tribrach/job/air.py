"""The air that scans were read in: the scale of their ranges, and what is not known of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tribrach.instruments.atmosphere import Air, first_velocity_ppm
from tribrach.instruments.common_errors import CommonErrors
from tribrach.project import Project
from tribrach.project.instrument import Instrument
from tribrach.project.sections import ScanFile
from tribrach.scan.scan import Scan

#: entries of headers, and what makes degrees Celsius, hectopascals and percent of them
_HEADER = {
    "temperature_c": ("temperature [C]", 1.0),
    "pressure_hpa": ("atmospheric pressure [Pa]", 0.01),
    "humidity_percent": ("relative humidity [%]", 1.0),
}
#: steps over which the scale is differentiated [K, hPa]
_STEPS = (1.0, 1.0)


@dataclass(frozen=True)
class RangeAir:
    """What the air does to the ranges of a scan."""

    #: ranges become ``1 + scale`` times as long, and the sigma of that
    scale: float = 0.0
    sigma: float = 0.0

    def shared(self, common: CommonErrors | None, owner: str) -> CommonErrors | None:
        """Common errors with the sigma of the air in that of the scale of the ranges."""
        if not self.sigma:
            return common
        common = common or CommonErrors(owner)
        return replace(common, range_scale=float(np.hypot(common.range_scale, self.sigma)))


def air_of(
    project: Project, k: int, entry: ScanFile, scan: Scan, instrument: str | None
) -> RangeAir:
    """The air of a scan, from its entry or from the header of its file."""
    given = {name: getattr(entry, name) for name in _HEADER}
    if entry.air == "header":
        for name, (title, unit) in _HEADER.items():
            if given[name] is None and title in scan.facts:
                given[name] = float(scan.facts[title]) * unit
        if given["temperature_c"] is None or given["pressure_hpa"] is None:
            raise project.error(
                ("scans", k, "air"),
                f"the header of {scan.name} has no temperature and pressure",
                "give temperature_c and pressure_hpa",
            )
    temperature, pressure = given["temperature_c"], given["pressure_hpa"]
    if temperature is None or pressure is None:
        return RangeAir()
    own = Instrument() if instrument is None else project.instruments[instrument]
    reference = Air(
        own.reference_temperature_c, own.reference_pressure_hpa, own.reference_humidity_percent
    )
    humidity = given["humidity_percent"]

    def ppm(warmer: float = 0.0, higher: float = 0.0) -> float:
        return float(
            first_velocity_ppm(
                temperature + warmer,
                pressure + higher,
                np.nan if humidity is None else humidity,
                reference=reference,
                wavelength_um=own.wavelength_um,
            )
        )

    sigma = np.hypot(
        (ppm(warmer=_STEPS[0]) - ppm()) * entry.sigma_temperature_c / _STEPS[0],
        (ppm(higher=_STEPS[1]) - ppm()) * entry.sigma_pressure_hpa / _STEPS[1],
    )
    return RangeAir(1e-6 * ppm(), 1e-6 * float(sigma))
