"""A hall of walls in panels of several reflectances, scanned with a law of the noise of ranges."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.targets.scenes import directions
from tribrach.geometry.polar import xyz_from_polar
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.scan.scan import Field

LOW, HIGH = np.array([-19.0, -12.0, -1.7]), np.array([14.0, 31.0, 6.5])
REFLECTANCES = np.array([0.06, 0.12, 0.2, 0.35, 0.5, 0.8])
#: intensity of a white surface, straight on, at this range [m]
WHITE, AT = 30_000.0, 5.0
#: side of a panel [m]
PANEL = 3.0
#: where the scanner stands, its heading, and targets around it (range [m], H, V [deg])
PLACE, HEADING = np.array([10.0, 20.0, 5.0]), np.radians(30.0)
TARGETS = {"P": (10, 20, 90), "Q": (12, 110, 80), "R": (9, 200, 95), "T": (14, 290, 70)}

PROJECT = """\
[instruments.A]
{figures}
levelling_arcsec = 0.1
[stations.S1]
levelled = true
[[points]]
file = "points.csv"
role = "fixed"
[[observations]]
file = "targets.csv"
instrument = "A"
[[scans]]
file = "S1.las"
instrument = "A"
origin = "scanner"
[cloud]
format = "las"
{cloud}
"""


@dataclass(frozen=True)
class Truth:
    """What points (n, 3) would be without noise, in the scanner frame, and how they were seen."""

    xyz: np.ndarray
    normal: np.ndarray
    range: np.ndarray
    cosine: np.ndarray
    intensity: np.ndarray


def scanned(
    path: Path, noise: ScanNoise, seed: int, step: float = 0.006, *, incidence: bool = True
) -> Truth:
    """Write the scan of the hall; where its points should be.

    incidence : is the noise of ranges divided by the cosine?
    """
    rng = np.random.default_rng(seed)
    rays, _, _ = directions((-3.1, 3.1), (0.5, 2.3), step)
    with np.errstate(divide="ignore"):
        away = np.where(rays > 0, HIGH, LOW) / np.where(rays == 0, 1e-15, rays)
    wall, length = away.argmin(axis=1), away.min(axis=1)
    xyz = rays * length[:, None]
    normal = np.zeros_like(rays)
    normal[np.arange(len(rays)), wall] = -np.sign(rays[np.arange(len(rays)), wall])
    cosine = np.abs(np.einsum("ni,ni->n", normal, rays))
    beside = np.floor(xyz / PANEL).astype(int)
    beside[np.arange(len(rays)), wall] = 7 * wall
    panel = (beside * [5, 11, 17]).sum(axis=1) % len(REFLECTANCES)
    light = np.rint(WHITE * REFLECTANCES[panel] * cosine * (AT / length) ** 2)
    light = np.clip(light * (1 + 0.02 * rng.normal(size=len(light))), 1, 65_535).round()
    across = np.hypot(noise.horizontal, noise.beam_angle(length))
    polar = np.stack([length, np.arctan2(rays[:, 1], rays[:, 0]), np.arccos(rays[:, 2])], axis=1)
    errors = rng.normal(size=polar.shape)
    errors[:, 0] *= noise.range_sigma(length, cosine if incidence else 1.0, light)
    errors[:, 1] *= across / np.sin(polar[:, 2])
    errors[:, 2] *= across
    header = CloudHeader(path.stem, (Field("intensity", "float32"),), 1e-5)
    with create(path, header) as writer:
        writer.write(xyz_from_polar(polar + errors), {"intensity": light.astype(np.float32)})
    return Truth(xyz, normal, length, cosine, light)


def project(folder: Path, figures: str, cloud: str = "") -> Path:
    """A project of the scan, whose station is known to hundredths of a millimetre."""
    rows, seen = ["point,x_m,y_m,z_m"], []
    for name, (r, h, v) in TARGETS.items():
        seen.append(f"S1,{name},{r},{h},{v},0.01,0.1,0.1")
        turned, v = np.radians(h) + HEADING, np.radians(v)
        at = [np.sin(v) * np.cos(turned), np.sin(v) * np.sin(turned), np.cos(v)]
        rows.append(",".join([name, *(f"{x:.7f}" for x in r * np.array(at) + PLACE)]))
    (folder / "points.csv").write_text("\n".join(rows) + "\n")
    head = "station,target,range_m,horizontal_deg,zenith_deg,sigma_range_mm,"
    head += "sigma_horizontal_arcsec,sigma_zenith_arcsec"
    (folder / "targets.csv").write_text("\n".join([head, *seen]) + "\n")
    path = folder / "job.toml"
    path.write_text(PROJECT.format(figures=figures, cloud=cloud))
    return path
