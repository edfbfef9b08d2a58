"""Simulated surveys of a yard with walls: a network of targets, its adjustment, scanned patches.

Three stations: S1 and S3 stand on one spot in two epochs, S2 elsewhere. What is drawn is what is
stated: control, targets, levels, one scale of the ranges for the scanner, and the noise of every
point. Metres and radians.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tribrach.cloud.shared_part import CloudPoints, SharedPart
from tribrach.geometry.polar import polar_from_xyz, xyz_from_polar
from tribrach.geometry.rotation import exp
from tribrach.instruments.common_errors import CommonErrors
from tribrach.instruments.precision import covariance_of_readings
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.scans.formats import read_scans
from tribrach.job.scans import StationScan
from tribrach.job.shared import shared_part
from tribrach.network.adjustment import adjust
from tribrach.network.survey import Survey
from tribrach.observations.control import Coordinates
from tribrach.observations.scanner import Inclinations, TargetCentres
from tribrach.units import SEC

Array = np.ndarray

TARGETS = np.array(
    [[2, 16, 1], [11, 18, 4], [20, 15, 2], [27, 6, 3], [24, -8, 1], [9, -11, 3], [-6, 3, 2]], float
)
STATIONS = {
    "S1": ((4.0, 3.0, 1.6), 0.4),
    "S2": ((16.0, 1.0, 1.7), 2.0),
    "S3": ((4.0, 3.0, 1.6), 1.1),
}
#: control is good and targets are not, so that stations, and patches of them, err each by itself
CONTROL, READING, LEVEL, SCALE = 5e-4, (1.2e-3, 15 * SEC, 15 * SEC), 8 * SEC, 10e-6
NOISE = ScanNoise(1.5e-3, 1e-5, 8 * SEC, 8 * SEC, 3e-3, 0.2e-3, shared_share=0.0)
#: middles and outward normals of patches that all stations see, metre by metre in between
PATCHES = (
    ((3.0, 19.0, 2.0), (0.0, -1.0, 0.0)), ((15.0, 19.0, 3.0), (0.0, -1.0, 0.0)),
    ((28.0, 12.0, 2.0), (-1.0, 0.0, 0.0)), ((28.0, -5.0, 3.0), (-1.0, 0.0, 0.0)),
    ((18.0, -12.0, 2.0), (0.0, 1.0, 0.0)), ((2.0, -12.0, 3.0), (0.0, 1.0, 0.0)),
    ((-8.0, -4.0, 2.0), (1.0, 0.0, 0.0)), ((-8.0, 9.0, 3.0), (1.0, 0.0, 0.0)),
    ((10.0, 6.0, 0.0), (0.0, 0.0, 1.0)), ((9.0, -5.0, 0.0), (0.0, 0.0, 1.0)),
)  # fmt: skip


@dataclass(frozen=True)
class Yard:
    """An adjusted survey with the errors that were drawn for it."""

    rng: np.random.Generator
    shared: SharedPart
    scale: float

    def scanned(self, station: str, surface: Array, normal: Array) -> CloudPoints:
        """True points (n, 3) of a surface as the station measures and the survey places them."""
        place, heading = STATIONS[station]
        rotation = exp(np.array([0.0, 0.0, heading]))
        local = (surface - place) @ rotation
        cosine = np.abs(local @ (normal @ rotation)) / np.linalg.norm(local, axis=1)
        measured = _read(self.rng, polar_from_xyz(local), self.scale, _sigmas(local, cosine))
        xyz = self.shared.scans[station].pose @ xyz_from_polar(measured)
        return self.shared.points(xyz, station, cosine=cosine)


def surveyed(seed: int, folder: Path) -> Yard:
    """Draw a survey, adjust it, and put together what its points share."""
    rng = np.random.default_rng(seed)
    survey, names = Survey(), [f"T{k}" for k in range(len(TARGETS))]
    for name, x in zip(names, TARGETS, strict=True):
        survey.point(name, x)
    given = TARGETS + CONTROL * rng.normal(size=TARGETS.shape)
    survey.add(Coordinates, values=given, sigma=CONTROL, position=names, group="control")
    scale, scans = SCALE * rng.normal(), []
    path = folder / "none.xyz"
    if not path.exists():
        path.write_text("1 1 1\n2 2 2\n")
    (scan,) = read_scans(path)
    for name, (place, heading) in STATIONS.items():
        local = (TARGETS - place) @ exp(np.array([0.0, 0.0, heading]))
        polar = polar_from_xyz(local)
        sigma = np.tile(READING, (len(local), 1))
        survey.station(name)
        survey.add(
            TargetCentres, values=xyz_from_polar(_read(rng, polar, scale, sigma)),
            covariance=covariance_of_readings(polar, sigma),
            station=[name] * len(names), target=names,
        )  # fmt: skip
        survey.add(
            Inclinations, values=LEVEL * rng.normal(size=(1, 2)), sigma=LEVEL, station=[name]
        )
        common = CommonErrors("scanner", SCALE)
        scans.append(_Placed(name, name, scan, NOISE, True, {}, common=common))
    return Yard(rng, shared_part(scans, adjust(survey.network())), scale)


class _Placed(StationScan):
    """A scan whose scanner is at zero of its points."""

    @property
    def origin_known(self) -> bool:
        return True


def _read(rng: np.random.Generator, polar: Array, scale: float, sigma: Array) -> Array:
    """Readings (n, 3) of true polar coordinates: true = measured + Delta, and noise."""
    measured = polar.copy()
    measured[:, 0] /= 1 + scale
    out: Array = measured + sigma * rng.normal(size=polar.shape)
    return out


def _sigmas(local: Array, cosine: Array) -> Array:
    """Standard deviations (n, 3) of ranges and angles of single points: encoders and footprint."""
    length = np.linalg.norm(local, axis=1)
    flat = np.hypot(local[:, 0], local[:, 1])
    spot = NOISE.beam_diameter(length) / 4
    across = np.hypot(NOISE.horizontal, spot / flat), np.hypot(NOISE.vertical, spot / length)
    return np.stack([NOISE.range_sigma(length, cosine), *across], axis=1)


def patch(rng: np.random.Generator, middle: Array, normal: Array, n: int, size: float) -> Array:
    """Points (n, 3) of a flat square about a place."""
    across = np.linalg.svd(np.asarray(normal)[None])[2][1:]
    uv = rng.uniform(-size / 2, size / 2, (n, 2))
    return np.asarray(middle) + uv @ across
