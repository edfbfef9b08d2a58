"""Heights of instruments and targets as unknowns of the sights made with them."""

from pathlib import Path

import numpy as np
import pytest

import tribrach as tb
from tribrach.errors import InputError, RankDefect
from tribrach.job.opened import open_job
from tribrach.network.adjustment import adjust

#: angle of a second [rad]
SEC = np.pi / 648000
#: heights over the mark 4001 and over the targets
HI, HT = 1.534, 1.3
#: E, N, U of the known points [m]
KNOWN = {
    "4001": (0.0, 0.0, 0.0),
    "A": (100.0, 0.0, 1.534),
    "B": (0.0, 100.0, 1.534),
    "C": (-100.0, 0.0, 1.534),
    "D": (0.0, -100.0, 1.534),
}


def write_job(
    folder: Path, sights: str, points: str = "", sections: str = "", role: str = "fixed"
) -> Path:
    """A project of one CSV of sights among the known points."""
    rows = [f"{name},{e},{n},{u}" for name, (e, n, u) in KNOWN.items() if name != "4001"]
    (folder / "points.csv").write_text("point,e_m,n_m,u_m\n" + "\n".join(rows) + "\n" + points)
    (folder / "sights.csv").write_text(sights)
    project = folder / "job.toml"
    project.write_text(
        f'[[points]]\nfile = "points.csv"\nrole = "{role}"\n'
        f'[[observations]]\nfile = "sights.csv"\n{sections}'
    )
    return project


def horizontal(extra: str = "", cells: str = "") -> str:
    """Horizontal sights of 100 m to the four points, 1 arc second each."""
    head = f"from,to,zenith_gon,sigma_zenith_arcsec,height_instrument_m{extra}\n"
    rows = [f"4001,{name},100.0,1.0,1.5{cells}" for name in "ABCD"]
    return head + "\n".join(rows) + "\n"


def height_of(adjustment: tb.Adjustment, name: str) -> tuple[float, float]:
    """An unknown and its sigma."""
    index = adjustment.layout.index("scalar", name)
    covariance = adjustment.family_covariances("scalar")
    return float(adjustment.state.scalars[index]), float(np.sqrt(covariance[index, 0, 0]))


def test_unknown_height_is_the_mean_of_its_sights(tmp_path: Path) -> None:
    """Over a known mark n horizontal sights give the height to s sigma_z / sqrt(n)."""
    sights = horizontal(",height_instrument_of", ",tripod")
    project = write_job(tmp_path, sights, "4001,0,0,0\n")
    result = adjust(open_job(project).network())
    height, sigma = height_of(result, "height of instrument tripod (sights.csv)")
    assert height == pytest.approx(1.534, abs=1e-9)
    assert sigma == pytest.approx(100 * SEC / 2, rel=1e-6)
    assert result.dof == 3


def test_measured_height_is_weighed_with_its_sights(tmp_path: Path) -> None:
    """A tape's 1.500 m with its sigma and four sights make a weighted mean."""
    sights = horizontal(",sigma_height_instrument_mm", ",0.5")
    project = write_job(tmp_path, sights, "4001,0,0,0\n")
    result = adjust(open_job(project).network())
    height, sigma = height_of(result, "height of instrument at 4001 (sights.csv)")
    tape, level = 1 / 0.5e-3**2, 4 / (100 * SEC) ** 2
    assert height == pytest.approx((1.5 * tape + 1.534 * level) / (tape + level), abs=2e-8)
    assert sigma == pytest.approx((tape + level) ** -0.5, rel=1e-4)


def test_section_does_the_same_for_any_file(tmp_path: Path) -> None:
    """``[[heights]]`` names the set-up; the value of the section replaces that of the file."""
    section = '[[heights]]\ninstrument_at = "4001"\nheight_m = 1.5005\nsigma_mm = 0.5\n'
    project = write_job(tmp_path, horizontal(), "4001,0,0,0\n", section)
    result = adjust(open_job(project).network())
    height, _ = height_of(result, "height of instrument at 4001")
    tape, level = 1 / 0.5e-3**2, 4 / (100 * SEC) ** 2
    assert height == pytest.approx((1.5005 * tape + 1.534 * level) / (tape + level), abs=2e-8)


def test_target_height_shared_by_two_set_ups(tmp_path: Path) -> None:
    """A pole that nobody measured is one unknown in the sights of two set-ups, with distances."""
    u = np.array([30.0, 40.0, HT - HI])
    v = np.array([-60.0, 80.0, HT - HI - 2.0])
    rows = []
    for name, x in (("4001", u), ("4002", v)):
        flat, slope = np.hypot(x[0], x[1]), np.linalg.norm(x)
        zenith = np.arctan2(flat, x[2]) * 200 / np.pi
        azimuth = np.arctan2(x[0], x[1]) * 200 / np.pi % 400
        rows.append(f"{name},T,{azimuth:.12f},{zenith:.12f},{slope:.12f},{HI},pole,1,1,1")
    head = (
        "from,to,azimuth_gon,zenith_gon,slope_distance_m,height_instrument_m,height_target_of,"
        "sigma_azimuth_arcsec,sigma_zenith_arcsec,sigma_slope_distance_mm\n"
    )
    level = "from,to,height_difference_m,sigma_height_difference_mm\n4001,T,0,0.1\n"
    (tmp_path / "level.csv").write_text(level)
    known = "4001,0,0,0\n4002,90,-40,2\n"
    section = '[[observations]]\nfile = "level.csv"\n'
    project = write_job(tmp_path, head + "\n".join(rows) + "\n", known, section)
    result = adjust(open_job(project).network())
    height, _ = height_of(result, "height of target pole (sights.csv)")
    assert height == pytest.approx(HT, abs=1e-7)
    place = result.state.points[result.layout.index("point", "T")]
    assert place == pytest.approx([30, 40, 0], abs=1e-7)


def test_what_cannot_be_separated_is_said(tmp_path: Path) -> None:
    """Sights from a free mark alone see the sum of its height and that of the instrument."""
    rows = [f"4001,{name},{100.0 * k},100.0,100.0,tripod,1,1,1" for k, name in enumerate("BADC")]
    head = (
        "from,to,direction_gon,zenith_gon,slope_distance_m,height_instrument_of,"
        "sigma_direction_arcsec,sigma_zenith_arcsec,sigma_slope_distance_mm\n"
    )
    project = write_job(tmp_path, head + "\n".join(rows) + "\n")
    with pytest.raises(RankDefect) as caught:
        adjust(open_job(project).network())
    words = str(caught.value)
    assert "height of instrument tripod (sights.csv)" in words
    assert "U of point 4001" in words
    assert "by levelling, or by zenith angles" in words


def test_directions_alone_have_no_height(tmp_path: Path) -> None:
    """A section of which nothing depends is refused with its line."""
    sights = (
        "from,to,direction_gon,sigma_direction_arcsec\n4001,A,100,1\n4001,B,0,1\n4001,C,300,1\n"
    )
    section = '[[heights]]\ninstrument_at = "4001"\n'
    project = write_job(tmp_path, sights, sections=section)
    with pytest.raises(InputError, match="no zenith angle and no slope distance") as caught:
        open_job(project).network()
    assert caught.value.line == 6


def test_heights_that_differ_are_not_one(tmp_path: Path) -> None:
    """Two heights under one name are refused."""
    sights = horizontal(",height_instrument_of", ",tripod").replace(
        "A,100.0,1.0,1.5", "A,100.0,1.0,1.6"
    )
    project = write_job(tmp_path, sights, "4001,0,0,0\n")
    with pytest.raises(InputError, match=r"give heights from 1\.5000 to 1\.6000 m"):
        open_job(project).network()
