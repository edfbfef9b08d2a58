"""Two antennas on a scanner, and compasses: headings of levelled stations without any target."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tribrach.errors import InputError
from tribrach.geometry.rotation import exp, log
from tribrach.job.opened import open_job
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.project import Project

PAIRS, SINGLES, BASE = 150, 40, 2.0
#: of each antenna in plan, so that a pair 2 m apart gives a heading to 0.05 degrees [mm]
PLAN = np.radians(0.05) * BASE / np.sqrt(2) * 1e3
COMPASS, DECLINATION = 0.8, 3.2
ARMS = np.array([[-BASE / 2, 0.0, 0.4], [BASE / 2, 0.0, 0.4]])
HEAD = f"""\
[instruments.gnss]
gnss_plan_mm = {PLAN}
gnss_up_mm = 3.0
[instruments.scanner]
range_mm = 2.0
scan_angle_arcsec = 10.0
levelling_arcsec = 5.0
compass_deg = {COMPASS}
compass_common_deg = 5.0
[lever_arms.left]
x_m = {ARMS[0, 0]}
y_m = 0.0
z_m = 0.4
sigma_mm = 0.0
[lever_arms.right]
x_m = {ARMS[1, 0]}
y_m = 0.0
z_m = 0.4
sigma_mm = 0.0
[[observations]]
file = "gnss.csv"
instrument = "gnss"
"""


def turn(azimuth: float) -> np.ndarray:
    """Rotation of an upright scanner whose x axis has an azimuth [rad]."""
    rotation: np.ndarray = exp(np.array([0.0, 0.0, np.pi / 2 - azimuth]))
    return rotation


def write(folder: Path, rng: np.random.Generator) -> tuple[Path, np.ndarray]:
    """Stations with two antennas or one, and what their compasses show; the azimuths [rad]."""
    n = PAIRS + SINGLES
    azimuth = rng.uniform(-np.pi, np.pi, n)
    shown = np.degrees(azimuth) - DECLINATION + rng.normal(0, COMPASS, n)
    text, rows, headings = HEAD, ["gnss,lever_arm,e_m,n_m,u_m"], ["station,axis,heading_deg"]
    noise = np.array([PLAN, PLAN, 3.0]) * 1e-3
    for k in range(n):
        place = np.array([30.0 * k, 7.0 * (k % 9), 0.1 * k])
        names = ("left", "right") if k < PAIRS else ("left",)
        for arm, name in zip(ARMS, names, strict=False):
            e, north, u = place + turn(azimuth[k]) @ arm + rng.normal(0, noise)
            rows.append(f"S{k},{name if k < PAIRS else ''},{e:.6f},{north:.6f},{u:.6f}")
        text += f'[stations.S{k}]\nlevelled = true\ninstrument = "scanner"\n'
        text += f"lever_arm = {list(names)}\n"
        if k >= PAIRS and k % 2:
            text += f'heading_deg = {shown[k] - 90:.6f}\nheading_axis = "y"\n'
        elif k >= PAIRS - SINGLES:
            headings.append(f"S{k},x,{shown[k]:.6f}")
    text += '[[observations]]\nfile = "headings.csv"\ninstrument = "scanner"\n'
    (folder / "gnss.csv").write_text("\n".join(rows) + "\n")
    (folder / "headings.csv").write_text("\n".join(headings) + "\n")
    (folder / "job.toml").write_text(text)
    return folder / "job.toml", azimuth


def turns(adjustment: Adjustment, azimuth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Errors and sigmas of the headings of all stations [deg]."""
    error, sigma = [], []
    for k, true in enumerate(azimuth):
        found = adjustment.stations[f"S{k}"]
        error.append(log(found.world_from_scanner[:3, :3] @ turn(true).T)[2])
        sigma.append(np.sqrt(found.covariance[5, 5]))
    return np.degrees(error), np.degrees(sigma)


def test_two_antennas_and_compasses_give_headings_as_good_as_they_say(tmp_path: Path) -> None:
    path, azimuth = write(tmp_path, np.random.default_rng(11))
    adjustment = adjust(open_job(Project.load(path)).network())
    error, sigma = turns(adjustment, azimuth)
    alone = slice(0, PAIRS - SINGLES)
    np.testing.assert_allclose(sigma[alone], 0.05, rtol=1e-3)
    assert np.sqrt(np.mean(error[alone] ** 2)) == pytest.approx(0.05, rel=0.15)
    # one antenna leaves the heading to the compass, whose declination the pairs tell
    offset = adjustment.layout.index("scalar", "heading offset of scanner")
    found = np.degrees(adjustment.state.scalars[offset])
    stated = COMPASS / np.sqrt(SINGLES)
    assert abs(found - DECLINATION) < 3 * stated
    single = slice(PAIRS, None)
    np.testing.assert_allclose(sigma[single], np.hypot(COMPASS, stated), rtol=0.01)
    for part, count in ((alone, PAIRS - SINGLES), (single, SINGLES)):
        square = np.sum((error[part] / sigma[part]) ** 2)
        assert chi2.ppf(0.01, count) < square < chi2.ppf(0.99, count)


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("compass_deg", "magnification", "sigma_heading"),
        (",left,", ",,", "several antennas"),
        (",left,", ",top,", "no such lever arm"),
        (",x,", ",z,", "neither x nor y"),
        ("heading_axis", "sigma_heading_arcsec", "sigma_heading_arcsec"),
    ],
)
def test_headings_that_nothing_decides_are_refused(
    old: str, new: str, what: str, tmp_path: Path
) -> None:
    write(tmp_path, np.random.default_rng(1))
    for name in ("job.toml", "gnss.csv", "headings.csv"):
        text = (tmp_path / name).read_text()
        (tmp_path / name).write_text(text.replace(old, new))
    with pytest.raises(InputError, match=what):
        open_job(Project.load(tmp_path / "job.toml")).network()
