"""Files of the NGS program ADJUST: against its listings, and a small job of our own."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import tribrach as tb
from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geodesy.site import EllipsoidSite
from tribrach.io.survey import formats, ngs
from tribrach.network.facts import Reference

#: dof and sum of squares of each adjustment of the listings, as printed. ADJUST holds values by
#: tiny sigmas; what they add to its sum (listed as 0.1) is what the sum lacks
_LISTED = {
    "hf": (111, 110.997),
    "hc": (129, 148.503),
    "vf": (111, 111.002),
    "vc": (115, 238.331 + 0.1),
}
#: an adjusted position: name, scaled sigmas north, east, up, and X, Y, Z
_POSITION = re.compile(
    r"\n0 +\d+ +\d+ (.{30}) .*\n.*\n +SCALED SIGMAS \(M\.\) +([\d.]+) +([\d.]+) +([\d.]+)\n"
    r".*\n +X = +(\S+) +Y = +(\S+) +Z = +(\S+)"
)


@pytest.fixture(scope="module")
def canyon(shared_data: Path) -> Path:
    folder = shared_data / "gnss" / "ngs_grand_canyon"
    if not folder.is_dir():
        pytest.skip("the Grand Canyon network is not there")
    return folder


def _files(canyon: Path, name: str, folder: Path) -> list[Path]:
    options = canyon / f"afile{name}"
    if name == "hf":  # ADJUST finds the factors itself; they are those that it lists
        text = options.read_text().replace("VVHU", "VS  23.618   5.243")
        options = folder / "afilehf"
        options.write_text(text)
    return [canyon / "gfile", canyon / "bfile", options]


def _ecef(adjustment: tb.Adjustment, name: str) -> tuple[Array, Array]:
    """Geocentric coordinates, and sigmas north, east, up at the place."""
    site = adjustment.network.site
    assert isinstance(site, EllipsoidSite)
    point = adjustment.points[name]
    east, north, up = site.axes(point.xyz[None])[0].T
    axes = np.array([north, east, up])
    covariance = axes @ adjustment.covariance(name, name) @ axes.T
    return site.to_ecef(point.xyz[None])[0], np.sqrt(np.diag(covariance).clip(0))


@pytest.mark.parametrize("name", _LISTED)
def test_adjustments_agree_with_their_listings(canyon: Path, name: str, tmp_path: Path) -> None:
    adjustment = tb.adjust(_files(canyon, name, tmp_path))
    dof, squares = _LISTED[name]
    assert adjustment.dof == dof
    # the factors are listed to a thousandth of some 5: 0.02 %; what held values add to 0.05
    assert adjustment.sigma0_posterior**2 * dof == pytest.approx(squares, rel=2e-4)
    listing = (canyon / f"adj{name}.out").read_text()
    positions = _POSITION.findall(listing[listing.index("\n0ADJUSTED POSITIONS") :])
    assert len(positions) == 14
    for title, *figures in positions:
        listed = np.array([float(figure) for figure in figures])
        ecef, sigma = _ecef(adjustment, title.strip())
        # both are rounded: 0.05 mm of coordinates, 0.5 mm of sigmas
        assert np.abs(ecef - listed[3:]).max() < 1e-4
        assert np.abs(sigma * adjustment.sigma0_posterior - listed[:3]).max() < 6e-4


def test_vectors_keep_their_sigmas_where_factors_are_to_be_estimated(canyon: Path) -> None:
    adjustment = tb.adjust([canyon / "gfile", canyon / "bfile", canyon / "afilehf"])
    assert adjustment.dof == 111
    # the bound of the other sums; the cause of the 3e-5 that are left is not known
    assert adjustment.sigma0_posterior**2 * 111 == pytest.approx(43352.147, rel=2e-4)
    assert any("VVHU" in str(text) for text in adjustment.warnings)
    off = [one for one in adjustment.observations if one.state == "off"]
    assert [one.source for one in off] == ["gfile:43"] * len(off) != []


def test_reference_is_that_of_the_coordinates(canyon: Path) -> None:
    survey = formats.read([canyon / "gfile", canyon / "bfile"])
    assert survey.reference == Reference(frame="NAD83(2011)", epoch=2010.0)


_B = """\
000010*AA*HZTLOBS OURS  OUR OWN
000020*80*0001PILLAR EAST                   40000000000N105000000000W       AZAA
000030*86*0001  1600000K  N88                1580000A41A
000040*80*0002PILLAR WEST                   40000000000N105010000000W       AZAA
000050*86*0002  1620000K  N88                1600000A41A
"""
_G = """\
AXX2024 1 12024 1 1
B2024 1 1 0 02024 1 12359 2 ours          OURS    2 2 1 2OURS  2024 1 1IFDDPF
C00010002{x1:11d}   20{y1:11d}   30{z1:11d}   40 W1111AABYSC1111ADSVW
F00010002{x2:13d}   20{y2:13d}   30{z2:13d}   40 W1111AABYSC1111ADSVW
D  1  2  5000000  4  5  5000000  1  4  2500000
"""
_A = """\
**  ours
CC        0001  0.20  0.30  0.50            40000000000N105000000000W1580000E
DD3
MM3YY
VS   2.000   3.000
"""


def _written(folder: Path, g: str = _G, b: str = _B, a: str = _A) -> list[Path]:
    """The files of a vector measured twice, one of them 4 mm longer in X."""
    site = EllipsoidSite(np.radians(40.0), np.radians(-105.0), 1580.0)
    far = EllipsoidSite(np.radians(40.0), np.radians(-105 - 1 / 60), 1600.0)
    zero = np.zeros((1, 3))
    x, y, z = np.rint((far.to_ecef(zero) - site.to_ecef(zero))[0] * 1e4).astype(int)
    g = g.format(x1=x, y1=y, z1=z, x2=x + 40, y2=y, z2=z)
    paths = [folder / name for name in ("job.g", "job.b", "job.a")]
    for path, text in zip(paths, (g, b, a), strict=True):
        path.write_text(text)
    return paths


def test_a_small_job_has_the_covariance_that_follows_by_hand(tmp_path: Path) -> None:
    paths = _written(tmp_path)
    assert all(ngs.recognised(path) and formats.format_of(path) == "ngs" for path in paths)
    adjustment = tb.adjust(paths)
    assert adjustment.dof == 3
    control, _ = _ecef(adjustment, "PILLAR EAST")
    end, _ = _ecef(adjustment, "PILLAR WEST")
    first = EllipsoidSite(np.radians(40.0), np.radians(-105.0), 1580.0)
    assert np.abs(control - first.to_ecef(np.zeros((1, 3)))[0]).max() < 1e-6
    assert adjustment.covariance("PILLAR EAST", "PILLAR EAST")[2, 2] == pytest.approx(0.005**2)
    # a session whose vectors are correlated by 0.25 in X: the mean has (1 + 0.25) / 2
    rotation = first.w_from_ecef
    sigma = np.diag([0.002, 0.003, 0.004])
    own = sigma @ np.array([[1, 0.5, 0], [0.5, 1, 0], [0, 0, 1]]) @ sigma
    cross = np.zeros((3, 3))
    cross[0, 0] = 0.25 * 0.002**2
    stretch = np.diag([2.0, 2.0, 3.0]) @ rotation  # near enough in the local axes of the midpoint
    joint = np.block([[own, cross], [cross, own]])
    design = np.vstack([np.eye(3), np.eye(3)])
    maps = np.kron(np.eye(2), stretch)
    joint = maps @ joint @ maps.T
    expected = np.linalg.inv(design.T @ np.linalg.inv(joint) @ design)
    relative = adjustment.difference("PILLAR EAST", "PILLAR WEST").covariance
    assert np.abs(relative - expected).max() < 1e-3 * np.abs(expected).max()
    assert np.linalg.norm(end - control) == pytest.approx(1422.8, abs=5.0)


def test_orthometric_heights_are_held_with_the_geoid_height_of_the_b_file(tmp_path: Path) -> None:
    a = "CC        0001                                                       1600010 \nDD3\n"
    a += "CC        0001                              40000000000N105000000000W\n"
    paths = _written(tmp_path, a=a)
    adjustment = tb.adjust(paths)
    site = adjustment.network.site
    assert isinstance(site, EllipsoidSite)
    assert site.height(adjustment.points["PILLAR EAST"].xyz[None])[0] == pytest.approx(1580.01)
    assert adjustment.dof == 3


@pytest.mark.parametrize(
    ("part", "old", "new", "said"),
    [
        (0, " 2 2 1 2OURS", " 299 1 2OURS", "frame of code 99"),
        (0, "2359 2 ours", "2359 3 ours", "says 3 vectors and has 2"),
        (0, "  5000000  4", " 15000000  4", "is 1.5"),
        (0, "D  1", "E  1", "'E'"),
        (1, "*80*0002", "*80*0003", "0002 has no record"),
        (1, "*86*0001", "*20*0001", "terrestrial"),
        (2, "DD3", "DD2", "DD2"),
        (2, "  0.20", " -0.20", "below zero"),
        (2, "CC        0001", "CC        0009", "0009 has no record"),
        (2, "VS   2.000", "VS   x.000", "factor"),
    ],
)
def test_what_cannot_be_read_is_refused(
    tmp_path: Path, part: int, old: str, new: str, said: str
) -> None:
    texts: list[str] = [_G, _B, _A]
    assert old in texts[part]
    texts[part] = texts[part].replace(old, new, 1)
    with pytest.raises(InputError, match=re.escape(said)):
        formats.read(_written(tmp_path, *texts))


@pytest.mark.parametrize("given", [(0,), (1, 2)])
def test_a_missing_file_is_asked_for(tmp_path: Path, given: Sequence[int]) -> None:
    paths = _written(tmp_path)
    with pytest.raises(InputError, match=r"give the [GB]-file"):
        formats.read([paths[k] for k in given])
