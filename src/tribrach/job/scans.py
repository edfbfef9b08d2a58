"""The scans of a project, each with its station and its instrument."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.instruments.atmosphere import Air, first_velocity_ppm
from tribrach.instruments.calibration import CalibrationModel
from tribrach.instruments.common_errors import COMMON, CommonErrors
from tribrach.instruments.correction import Correction, Faces
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.calibration_file import Calibration
from tribrach.io.number_table import read_numbers
from tribrach.io.scans.facts import START
from tribrach.job.scan_entries import scans_of_entry
from tribrach.job.state import Remembered
from tribrach.observations.scanner import ScannerPolar
from tribrach.project import Project
from tribrach.project.instrument import Instrument
from tribrach.project.sections import ScanFile
from tribrach.scan.no_return import find_no_return
from tribrach.scan.prepared import corrected_scan, seen_from, sides
from tribrach.scan.scan import NoReturn, Scan

#: entries of headers, and what makes degrees Celsius, hectopascals and percent of them
_HEADER = {
    "temperature_c": ("temperature [C]", 1.0),
    "pressure_hpa": ("atmospheric pressure [Pa]", 0.01),
    "humidity_percent": ("relative humidity [%]", 1.0),
}
_HUMID = "humidity_percent"
#: beginning of the time of GPS [s since 1970]; a reading holds so long beyond the table [s]
_GPS_ZERO, _HOLDS = 315964800.0, 1800.0
#: steps over which the scale is differentiated [K, hPa]
_STEPS = (1.0, 1.0)


@dataclass(frozen=True)
class RangeAir:
    """Correction of the ranges of a scan for the air."""

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
    elif entry.air is not None:
        read = _read_through_time(project, k, entry.air, _began(project, k, entry, scan))
        given |= {name: value for name, value in read.items() if given[name] is None}
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


def _began(project: Project, k: int, entry: ScanFile, scan: Scan) -> float:
    """When a scan began [s since 1970]: the project says so, or the header."""
    if entry.time is not None:
        when = entry.time
        return (when if when.tzinfo else when.replace(tzinfo=UTC)).timestamp()
    if START not in scan.facts:
        raise project.error(
            ("scans", k, "air"),
            f"nothing says when {scan.name} began, so that {entry.air} says nothing of its air",
            "add time, such as time = 2025-03-01T00:02:58Z",
        )
    # leap seconds make no weather
    return _GPS_ZERO + float(scan.facts[START])


def _read_through_time(project: Project, k: int, name: str, when: float) -> dict[str, float]:
    """The air at a time, between the readings of a table."""
    path = project.folder / name
    table = read_numbers(path, ("temperature_c", "pressure_hpa"), optional=(_HUMID,), timed=True)
    order = np.argsort(table.values["time"], kind="stable")
    times = table.values["time"][order]
    if not times[0] - _HOLDS <= when <= times[-1] + _HOLDS:
        shown = [
            f"{datetime.fromtimestamp(t, UTC):%Y-%m-%d %H:%M}" for t in (when, *times[[0, -1]])
        ]
        raise project.error(
            ("scans", k, "air"),
            f"the scan began at {shown[0]} UTC, and the readings of {name} are from {shown[1]} to "
            f"{shown[2]}",
            "correct time, or the times of the table",
        )
    return {
        key: float(np.interp(when, times, values[order]))
        for key, values in table.values.items()
        if key != "time"
    }


if TYPE_CHECKING:
    from tribrach.job.opened import Job
    from tribrach.network.adjustment import Adjustment
    from tribrach.project import Project
    from tribrach.project.sections import ScanFile

# Calibrations of the scanners behind scans: known before the adjustment, adjusted after it.


def known_correction(calibration: Calibration, faces: Faces, scale: float = 0.0) -> Correction:
    """The correction that a calibration file describes, and the scale of the air."""
    return Correction(calibration.columns(), calibration.values, faces, scale)


def as_adjusted(scans: Sequence[StationScan], adjustment: Adjustment) -> list[StationScan]:
    """The scans, corrected with the parameters that the network gives their stations."""
    out = []
    for scan in scans:
        calibrated = calibration_of(scan.station, adjustment)
        if calibrated is None:
            out.append(scan)
            continue
        model, index = calibrated
        correction = Correction(model, adjustment.state.scalars[index], scan.faces, scan.air)
        out.append(replace(scan, scan=corrected_scan(scan.scan, correction)))
    return out


def calibration_of(
    station: str, adjustment: Adjustment
) -> tuple[CalibrationModel, NDArray[np.int64]] | None:
    """Model and scalars (k,) of a station's observations; None if they have none."""
    layout = adjustment.layout
    if not layout.has("pose", station):
        return None
    number = layout.index("pose", station)
    for o in adjustment.network.observations:
        if isinstance(o, ScannerPolar) and o.model is not None:
            rows = np.flatnonzero(o.station == number)
            if len(rows) and o.parameters.shape[1]:
                return o.model, o.parameters[rows[0]]
    return None


def calibration_sentences(scans: Sequence[StationScan], adjustment: Adjustment) -> list[str]:
    """Which scans were corrected, with parameters from where."""
    out = []
    for scan in scans:
        calibrated = calibration_of(scan.station, adjustment)
        if calibrated is None and scan.known is None:
            continue
        names = calibrated[0].parameters if calibrated is not None else ()
        if calibrated is None and scan.known is not None:
            names = scan.known.parameters
        origin = (
            "adjusted with the network" if calibrated is not None else "of the calibration file"
        )
        out.append(f"Scan {scan.name} is corrected by {', '.join(names)}, {origin}.")
    return out


#: range for which the noise of fits is taken [m]
_USUAL = 15.0


@dataclass(frozen=True)
class MeasuredScan:
    """The points of a scan and their noise: all that targets, planes and clouds are made of."""

    name: str  #: of the scan in the results, unique in the project
    station: str  #: where it was taken
    scan: Scan  #: its points
    noise: ScanNoise | None  #: of its single points, None if no instrument says

    @property
    def origin_known(self) -> bool:
        """True if the scanner is at (0, 0, 0) of the points."""
        return self.scan.origin != "unknown"

    @property
    def fit_sigmas(self) -> dict[str, float]:
        """Sigmas of single points for fits, range [m] and angle [rad].

        What is left out fits take from the points: both without an instrument, that of ranges
        where its noise has a law, since what is fitted has an intensity of its own.
        """
        if self.noise is None:
            return {}
        spot = float(self.noise.beam_angle(np.array([_USUAL]))[0])
        angle = {"sigma_angle": float(np.hypot(self.noise.vertical, spot))}
        if self.noise.law is not None:
            return angle
        return {"sigma_range": self.noise.range + self.noise.range_scale * _USUAL} | angle


@dataclass(frozen=True)
class StationScan(MeasuredScan):
    """A scan with its station, its instrument and what corrects it."""

    levelled: bool  #: was the scanner levelled?
    #: approximate centres (3,) [m] in the scanner frame of the targets that the user named
    names: Mapping[str, tuple[float, float, float]]
    #: calibration of the scanner from a file, by which the points are corrected
    known: Calibration | None = None
    faces: Faces = "front"  #: which face measured a point
    #: what all points of the station have in common besides, None where nothing is said
    common: CommonErrors | None = None
    air: float = 0.0  #: what ranges are scaled by for the air they were read in
    #: beams without return are to be left out, and it is not known yet which these are
    unscreened: bool = False

    def screened(self, found: NoReturn) -> StationScan:
        """Leave out beams without return, as they were found in the file."""
        return replace(self, scan=self.scan.screened(found), unscreened=False)

    @property
    def measured(self) -> MeasuredScan:
        """The points and their noise alone."""
        return MeasuredScan(self.name, self.station, self.scan, self.noise)


def open_scans(job: Job, state: Remembered) -> list[StationScan]:
    """The headers of all scans of a job, in its order.

    Points are read only where the faces of a scan are to be told from them; beams without return
    are not looked for in other scans.
    """
    scans: list[StationScan] = []
    for k, entry in enumerate(job.project.scans):
        scans += _open(job, k, entry, state)
    at = Counter(scan.station for scan in scans)
    scans = [s if at[s.station] == 1 else _several(s) for s in scans]
    names: set[str] = set()
    for scan in scans:
        if scan.name in names:
            raise InputError(
                f"two scans have the name {scan.name}",
                file=scan.scan.path,
                cure="give each file a station of its own in [[scans]]",
            )
        names.add(scan.name)
    return scans


def _several(scan: StationScan) -> StationScan:
    """A scan at a station with several, named after both."""
    if scan.scan.name == scan.station:
        return scan
    if scan.scan.face is not None and scan.scan.name.startswith(f"{scan.station} "):
        return replace(scan, name=scan.scan.name)
    return replace(scan, name=f"{scan.station} {scan.scan.name}")


def _open(job: Job, k: int, entry: ScanFile, state: Remembered) -> list[StationScan]:
    """The scans of one entry."""
    scans = scans_of_entry(job.project, k, entry)
    members = []
    for scan in (_from_origin(entry, scan) for scan in scans):
        station = entry.station or scan.name
        unscreened = entry.no_return == "leave out"
        if not unscreened:  # what speaks against metres is asked all the same
            scan = replace(_screened(scan, state), no_return=None)
        if unscreened and entry.face == "order":
            # the faces are told from the points
            scan, unscreened = _screened(scan, state), False
        if entry.instrument is not None:
            job.instruments.learn([station], entry.instrument, ("scans", k, "instrument"))
        if entry.face != "order":
            faces: tuple[Faces, ...] = (entry.face,)
            parts: tuple[Scan, ...] = (scan,)
        else:
            faces, parts = ("front", "back"), sides(scan)
        for part, face in zip(parts, faces, strict=True):
            member = _at_station(job, k, entry, part, station, face)
            members.append(replace(member, unscreened=unscreened))
    return members


def _screened(scan: Scan, state: Remembered) -> Scan:
    """A scan without its beams without return; they are sought in every file once."""
    key, product = state.key(find_no_return, scan), f"beams-{scan.source}"
    return scan.screened(state.once(product, key, NoReturn, lambda: find_no_return(scan)))


def _from_origin(entry: ScanFile, scan: Scan) -> Scan:
    """A scan whose scanner is at zero, as far as the project says so."""
    if entry.origin == "scanner":
        return replace(scan, origin="stated")
    return scan if entry.origin is None else seen_from(scan, entry.origin)


def _at_station(
    job: Job, k: int, entry: ScanFile, scan: Scan, station: str, face: Faces
) -> StationScan:
    """A scan with what the project says about its station."""
    section = job.project.stations.get(station)
    instrument = job.instruments.of_station(station)
    known = None if instrument is None else job.calibrations.known.get(instrument)
    air = air_of(job.project, k, entry, scan, instrument)
    if known is not None:
        scan = corrected_scan(scan, known_correction(known, face, air.scale))
    elif air.scale:
        nothing = Correction(COMMON.select([]), np.zeros(0), face, air.scale)
        scan = corrected_scan(scan, nothing)
    return StationScan(
        name=station,
        station=station,
        scan=scan,
        noise=job.instruments.noise(instrument),
        levelled=section is not None and section.levelled,
        names=entry.names,
        known=known,
        faces=face,
        common=air.shared(job.instruments.common(instrument), instrument or station),
        air=air.scale,
    )
