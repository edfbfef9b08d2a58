"""GVX, SINEX and solutions of RTKLIB: textbook coordinates, matrices, figures by hand."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.geodesy.epochs import Motion, Realisation
from tribrach.geodesy.site import EllipsoidSite, ecef_from_geodetic
from tribrach.instruments.gnss_solutions import sigma_factor
from tribrach.io.gnss.files import GnssContext, read
from tribrach.io.gnss.gvx import read_gvx
from tribrach.io.gnss.rtklib_pos import read_rtklib
from tribrach.io.gnss.sinex import read_sinex
from tribrach.io.survey.formats import read_files
from tribrach.job.opened import open_job
from tribrach.network.adjustment import adjust
from tribrach.network.network import Datum

from .gnss_samples import ADJUSTED, GIVEN, write_gvx, write_sinex

KONYA = ecef_from_geodetic(*np.radians([37.87, 32.5]), np.float64(1020.0))


def test_network_of_ghilani_as_gvx(tmp_path: Path) -> None:
    """AC-32 through another program's file, a work frame of its own and a fixed datum."""
    survey = read_files([write_gvx(tmp_path / "g.gvx")])
    assert survey.reference.frame == "ITRF2014"
    assert survey.reference.epoch == 2010.0
    site = survey.site
    assert isinstance(site, EllipsoidSite)
    for name, xyz in GIVEN.items():
        survey.points[name].xyz = site.from_ecef(np.array([xyz]))[0]
    network = survey.network().with_datum(Datum("fixed", ("A", "B")))
    adjustment = adjust(network)
    for name, xyz in ADJUSTED.items():
        index = network.start.layout.index("point", name)
        found = site.to_ecef(adjustment.state.points[index][None])[0]
        np.testing.assert_allclose(found, xyz, atol=1e-4)
    assert adjustment.dof == 27
    assert adjustment.sigma0_posterior == pytest.approx(0.7075, abs=5e-4)


@pytest.mark.data
def test_files_with_different_work_frames_are_refused(shared_data: Path, tmp_path: Path) -> None:
    there = shared_data / "networks" / "dynadjust"
    files = [there / "gnss-network.stn", there / "gnss-network.msr", write_gvx(tmp_path / "g.gvx")]
    with pytest.raises(InputError, match="different work frames"):
        read_files(files)


def test_gvx_with_the_suffix_xml(tmp_path: Path) -> None:
    assert len(read_files([write_gvx(tmp_path / "g.xml")]).points) == 6


BROKEN_GVX: dict[str, tuple[str, str, str]] = {
    "feet": ("meters", "us survey feet", "only metres"),
    "no number": ("<DX>11644.2232", "<DX>x", "no number"),
    "infinite": ("<DX>11644.2232", "<DX>inf", "no number"),
    "correlation": ("<PXY>-", "<PXY>-9", "no covariance matrix"),
    "missing": ("<PXY>", "<QXY>", "cannot be read"),
    "point": ("<INITIAL_POINT_ID>0", "<INITIAL_POINT_ID>99", "point 99 is not in the file"),
    "twice": ("<NAME>B</NAME>", "<NAME>A</NAME>", "two points are named A"),
    "entity": ('<?xml version="1.0"?>', '<!DOCTYPE g [<!ENTITY a "b">]>', "entities"),
}


@pytest.mark.parametrize("case", BROKEN_GVX)
def test_broken_gvx(tmp_path: Path, case: str) -> None:
    old, new, words = BROKEN_GVX[case]
    path = write_gvx(tmp_path / "g.gvx")
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=words):
        read_gvx(path)


def covariance_of(n: int, seed: int = 3) -> np.ndarray:
    roots = np.random.default_rng(seed).normal(size=(n, n)) * 1e-3
    return roots @ roots.T + 1e-6 * np.eye(n)


@pytest.mark.parametrize("kind", ["COVA", "CORR", "INFO"])
@pytest.mark.parametrize("triangle", ["L", "U"])
def test_sinex(tmp_path: Path, kind: str, triangle: str) -> None:
    xyz = KONYA + np.array([[0.0, 0, 0], [100, 200, 300]])
    covariance = covariance_of(6)
    path = write_sinex(
        tmp_path / "a.snx", ["KNYA", "KNY2"], xyz, covariance, kind=kind, triangle=triangle
    )
    records = read_sinex(path)
    assert records.positions == ["KNYA", "KNY2"]
    np.testing.assert_allclose(records.xyz, xyz, atol=1e-6)
    np.testing.assert_allclose(records.covariance, covariance, rtol=1e-6, atol=1e-12)
    # day 92 of 2005, noon
    assert records.epoch == pytest.approx(2005 + 91.5 / 365)


def test_sinex_in_a_network(tmp_path: Path) -> None:
    """Two correlated positions adjust to themselves with their covariance."""
    xyz = KONYA + np.array([[0.0, 0, 0], [100, 200, 300]])
    covariance = covariance_of(6)
    path = write_sinex(tmp_path / "a.snx", ["KNYA", "KNY2"], xyz, covariance)
    adjustment = adjust(read([path]).network())
    site = adjustment.network.site
    assert isinstance(site, EllipsoidSite)
    np.testing.assert_allclose(site.to_ecef(adjustment.state.points), xyz, atol=1e-6)
    turn = np.kron(np.eye(2), site.w_from_ecef)
    found = np.block(
        [[adjustment.covariance(a, b) for b in ("KNYA", "KNY2")] for a in ("KNYA", "KNY2")]
    )
    np.testing.assert_allclose(found, turn @ covariance @ turn.T, rtol=1e-5, atol=1e-11)


def test_velocities_of_sinex_carry_to_the_epoch_of_the_job(tmp_path: Path) -> None:
    velocity = np.array([[-0.0148, -0.0012, 0.0094]])
    covariance = covariance_of(6) * np.outer([1, 1, 1, 0.1, 0.1, 0.1], [1, 1, 1, 0.1, 0.1, 0.1])
    path = write_sinex(
        tmp_path / "a.snx", ["KNYA"], KONYA[None], covariance, epoch="05:001:00000",
        velocity=velocity,
    )  # fmt: skip
    job = GnssContext(job=Realisation("ITRF2014", 2025.0), frame="ITRF2014")
    survey = read([path], job)
    site = survey.site
    assert isinstance(site, EllipsoidSite)
    adjustment = adjust(survey.network())
    found = site.to_ecef(adjustment.state.points)[0]
    np.testing.assert_allclose(found, KONYA + 20 * velocity[0], atol=1e-6)
    move = np.hstack([np.eye(3), 20 * np.eye(3)])
    expected = site.w_from_ecef @ move @ covariance @ move.T @ site.w_from_ecef.T
    np.testing.assert_allclose(adjustment.covariance("KNYA", "KNYA"), expected, rtol=1e-6)


def test_other_epochs_without_motion_are_refused(tmp_path: Path) -> None:
    path = write_sinex(tmp_path / "a.snx", ["KNYA"], KONYA[None], covariance_of(3))
    job = GnssContext(job=Realisation("ITRF2014", 2026.9), frame="ITRF96")
    with pytest.raises(InputError, match=r"a.snx: coordinates in ITRF96 at 2005.25 and ITRF2014"):
        read([path], job)
    moved = read([path], GnssContext(job=job.job, frame="ITRF96", motion=Motion(plate="EURA")))
    site = moved.site
    assert isinstance(site, EllipsoidSite)
    shift = site.to_ecef(adjust(moved.network()).state.points)[0] - KONYA
    assert 0.4 < np.linalg.norm(shift) < 0.8


def test_two_files_of_other_epochs_are_refused(tmp_path: Path) -> None:
    one = write_sinex(tmp_path / "a.snx", ["KNYA"], KONYA[None], covariance_of(3))
    two = write_sinex(
        tmp_path / "b.snx", ["KNY2"], KONYA[None] + 9, covariance_of(3), epoch="20:001:00000"
    )
    with pytest.raises(InputError, match=r"b.snx.*not to be mixed"):
        read([one, two], GnssContext(frame="ITRF2014"))


BROKEN_SINEX: dict[str, tuple[Callable[[str], str], str]] = {
    "kind": (lambda t: t[5:], "does not start with %=SNX"),
    "no stations": (lambda t: t.replace("STAX", "XPO "), "no station coordinates"),
    "twice": (lambda t: t.replace("STAY", "STAX"), "2 parameters STAX"),
    "malformed": (lambda t: t.replace(" m    2 ", " "), "estimate is malformed"),
    "matrix": (lambda t: t.replace("\n     3     1 ", "\n     3    11 "), "matrix is malformed"),
    "cut": (lambda t: t[: t.index("-SOLUTION/MATRIX")], "has no end"),
    "type": (lambda t: t.replace("L COVA", "L XXXX"), "XXXX"),
    "singular": (lambda t: t.replace("+SOLUTION/MATRIX_ESTIMATE L COVA", "+X"), ""),
}


@pytest.mark.parametrize("case", [c for c in BROKEN_SINEX if c != "singular"])
def test_broken_sinex(tmp_path: Path, case: str) -> None:
    breaking, words = BROKEN_SINEX[case]
    path = write_sinex(tmp_path / "a.snx", ["KNYA"], KONYA[None], covariance_of(3))
    path.write_text(breaking(path.read_text()))
    with pytest.raises(InputError, match=words):
        read_sinex(path)


HEAD = """\
% program   : RTKLIB ver.2.4.3
% pos mode  : {mode}
% ref pos   :  {ref}
%
% {columns}
"""
XYZ = "(x/y/z-ecef=WGS84,Q=1:fix,2:float)\n%  GPST  x-ecef(m) y-ecef(m) z-ecef(m) Q ns sdx sdy sdz"
LLH = "(lat/lon/height=WGS84/ellipsoidal)\n%  GPST  latitude(deg) longitude(deg) height(m) Q ns sdn"
ENU = "(e/n/u-baseline=WGS84)\n%  GPST  e-baseline(m) n-baseline(m) u-baseline(m) Q ns sde sdn sdu"
BASE = KONYA + np.array([100.0, 50.0, -20.0])


def pos(path: Path, columns: str, rows: list[str], mode: str = "Static") -> Path:
    ref = " ".join(f"{v:.4f}" for v in BASE)
    head = HEAD.format(mode=mode, ref=ref, columns=columns)
    path.write_text(head + "\n".join(rows) + "\n")
    return path


def row(values: np.ndarray, quality: int, roots: str, second: int = 0, digits: int = 4) -> str:
    numbers = " ".join(f"{v:.{digits}f}" for v in values)
    return f"2005/04/02 00:00:{second:06.3f} {numbers} {quality} 8 {roots} 0.00 9.9"


def test_signed_roots_of_geocentric_positions(tmp_path: Path) -> None:
    path = pos(
        tmp_path / "P7.pos", XYZ, [row(KONYA, 1, "0.0040 0.0050 0.0060 -0.0030 0.0020 -0.0010")]
    )
    records = read_rtklib(path)
    assert records.positions == ["P7"]
    expected = [[16, -9, -1], [-9, 25, 4], [-1, 4, 36]]
    np.testing.assert_allclose(records.covariance * 1e6, expected, rtol=1e-9)


def test_signed_roots_along_north_east_up(tmp_path: Path) -> None:
    """sdn, sde, sdu, sdne, sdeu, sdun at a place where the axes are those of ECEF."""
    # latitude 0, longitude 0: up is x, east is y, north is z
    values = np.array([0.0, 0.0, 50.0])
    path = pos(
        tmp_path / "P.pos", LLH, [row(values, 1, "0.0040 0.0050 0.0060 -0.0030 0.0020 -0.0010")]
    )
    records = read_rtklib(path, factor=2)
    np.testing.assert_allclose(records.xyz[0], [6378137 + 50, 0, 0], atol=1e-6)
    # x is up, y is east, z is north: uu, ee, nn = 36, 25, 16; eu 4, un -1, ne -9
    expected = np.array([[36, 4, -1], [4, 25, -9], [-1, -9, 16]]) * 4
    np.testing.assert_allclose(records.covariance * 1e6, expected, rtol=1e-6, atol=1e-3)


def test_baselines_in_east_north_up(tmp_path: Path) -> None:
    vector = np.array([30.0, -40.0, 5.0])
    path = pos(
        tmp_path / "P.pos", ENU, [row(vector, 1, "0.0040 0.0050 0.0060 -0.0030 0.0020 -0.0010")]
    )
    records = read_rtklib(path, point="P", base="B")
    axes = EllipsoidSite.centred(BASE[None]).w_from_ecef
    assert (records.start, records.end) == (["B"], ["P"])
    np.testing.assert_allclose(axes @ records.vectors[0], vector, atol=1e-9)
    # sde, sdn, sdu, sden, sdnu, sdue
    expected = [[16, -9, -1], [-9, 25, 4], [-1, 4, 36]]
    np.testing.assert_allclose(axes @ records.blocks[0] @ axes.T * 1e6, expected, rtol=1e-9)
    with pytest.raises(InputError, match="base is not named"):
        read_rtklib(path)


def test_a_vector_from_the_base_of_the_header(tmp_path: Path) -> None:
    path = pos(tmp_path / "P.pos", XYZ, [row(KONYA, 1, "0.004 0.004 0.004 0 0 0")])
    records = read_rtklib(path, base="B")
    np.testing.assert_allclose(records.vectors[0], KONYA - BASE, atol=1e-3)


def test_static_sessions_and_kinematic_epochs(tmp_path: Path) -> None:
    roots = "0.0040 0.0040 0.0040 0.0000 0.0000 0.0000"
    shifts = np.array([0.0, 0.003, -0.003, 0.004])
    rows = [row(KONYA + d, 1 if k else 2, roots, second=k) for k, d in enumerate(shifts)]
    still = read_rtklib(pos(tmp_path / "a.pos", XYZ, rows), factor=1)
    # one of the last two epochs, which have seen the session and are equally good
    np.testing.assert_allclose(still.xyz[0], KONYA - 0.003, atol=1e-4)
    np.testing.assert_allclose(np.diag(still.covariance), 16e-6)
    assert not still.warnings
    moving = read_rtklib(pos(tmp_path / "b.pos", XYZ, rows, "Kinematic"))
    # the mean of the three fixed epochs, which are correlated over minutes
    np.testing.assert_allclose(moving.xyz[0], KONYA + 0.004 / 3, atol=1e-4)
    expected = 16e-6 / 3 * sigma_factor(1.0, 3) ** 2
    np.testing.assert_allclose(np.diag(moving.covariance), expected, rtol=1e-6)
    # nearly the variance of a single one
    assert expected == pytest.approx(16e-6, rel=0.02)


def test_a_static_file_that_lost_its_integers_is_float(tmp_path: Path) -> None:
    """Ten of thirty epochs are fixed, in the middle: the end is float and scatters by 6 mm."""
    narrow = "0.0010 0.0010 0.0010 0.0000 0.0000 0.0000"
    wide = "0.0020 0.0020 0.0020 0.0000 0.0000 0.0000"
    rows = []
    for k in range(30):
        fixed, away = 10 <= k < 20, 0.0 if k == 29 else 0.006 * (-1) ** k
        roots = narrow if fixed else wide if k < 29 else "0.0019 0.0019 0.0019 0 0 0"
        rows.append(row(KONYA + np.array([away, 0.0, 0.0]), 1 if fixed else 2, roots, second=k))
    found = read_rtklib(pos(tmp_path / "a.pos", XYZ, rows), factor=1)
    assert "the solution is float: 0 % of the last 10 epochs" in found.warnings[0]
    np.testing.assert_allclose(found.xyz[0], KONYA, atol=1e-4)
    # what the file states, and nine of ten epochs 6 mm away along X
    expected = np.array([3.61e-6 + 0.9 * 36e-6, 3.61e-6, 3.61e-6])
    np.testing.assert_allclose(np.diag(found.covariance), expected, rtol=0.02)


def test_moving_epochs_that_jump_say_so_by_their_scatter(tmp_path: Path) -> None:
    """Two of fifty epochs are fixed, 60 mm apart with 4 mm each; their mean is no 3 mm."""
    roots = "0.0040 0.0040 0.0040 0.0000 0.0000 0.0000"
    shifts = {10: 0.03, 30: -0.03}
    rows = [
        row(KONYA + shifts.get(k, 0.0), 1 if k in shifts else 2, roots, second=k) for k in range(50)
    ]
    found = read_rtklib(pos(tmp_path / "a.pos", XYZ, rows, "Kinematic"), factor=1)
    assert "only 4 % of the epochs are fixed, fewer than 50 %" in found.warnings[0]
    np.testing.assert_allclose(found.xyz[0], KONYA, atol=1e-4)
    # variance of a mean of two from their own scatter: 2 * 30^2 / 1 / 2 mm^2
    np.testing.assert_allclose(np.diag(found.covariance), 900e-6, rtol=1e-3)


BROKEN_POS = {
    "columns": ([row(KONYA, 1, "0.004 0.004")], XYZ, "thirteen numbers"),
    "words": (["2005/04/02 00:00:00 x y z 1 8 1 1 1 0 0 0 0 0"], XYZ, "thirteen numbers"),
    "infinite": ([row(KONYA, 1, "inf 0.004 0.004 0 0 0")], XYZ, "not a number"),
    "matrix": ([row(KONYA, 1, "0.004 0.004 0.004 0.009 0 0")], XYZ, "no covariance matrix"),
    "no header": ([row(KONYA, 1, "0.004 0.004 0.004 0 0 0")], "", "no solution file"),
    "no epochs": ([], XYZ, "no epochs"),
    "degrees": ([], "latitude(d'\") longitude(d'\")", "decimal"),
}


@pytest.mark.parametrize("case", BROKEN_POS)
def test_broken_solutions(tmp_path: Path, case: str) -> None:
    rows, columns, words = BROKEN_POS[case]
    with pytest.raises(InputError, match=words):
        read_rtklib(pos(tmp_path / "a.pos", columns, rows))


def test_code_solutions_are_named(tmp_path: Path) -> None:
    path = pos(tmp_path / "P.pos", XYZ, [row(KONYA, 5, "1.0 1.0 2.0 0 0 0")])
    assert "code solutions" in read_rtklib(path).warnings[0]


def test_chosen_stations_of_sinex_with_a_factor(tmp_path: Path) -> None:
    """Some stations with their part of the whole matrix, standard deviations three times larger."""
    names = ["AAAA", "BBBB", "CCCC", "DDDD"]
    xyz = KONYA + np.array([[0.0, 0, 0], [100, 200, 300], [-50, 10, 7], [900, -30, 4]])
    covariance = covariance_of(12)
    path = write_sinex(tmp_path / "a.snx", names, xyz, covariance)
    (tmp_path / "job.toml").write_text(
        '[site]\nframe = "ITRF2014"\nepoch = 2005.25\nlatitude_deg = 37.9\nlongitude_deg = 32.5\n'
        '[[observations]]\nfile = "a.snx"\nstations = ["DDDD", "BBBB"]\nsigma_factor = 3.0\n'
        'frame = "ITRF2014"\nepoch = 2005.25\n'
    )
    adjustment = adjust(open_job(tmp_path / "job.toml").network())
    assert sorted(adjustment.layout.names["point"]) == ["BBBB", "DDDD"]
    site = adjustment.network.site
    assert isinstance(site, EllipsoidSite)
    wanted = np.r_[3:6, 9:12]
    turn = np.kron(np.eye(2), site.w_from_ecef)
    found = np.block(
        [[adjustment.covariance(a, b) for b in ("BBBB", "DDDD")] for a in ("BBBB", "DDDD")]
    )
    expected = 9 * turn @ covariance[np.ix_(wanted, wanted)] @ turn.T
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-10)
    assert read_sinex(path).warnings == []
    with pytest.raises(InputError, match="no coordinates of station ZZZZ; choose among AAAA, BBBB"):
        read_sinex(path, chosen=["ZZZZ"])


def test_sinex_without_a_matrix_says_so(tmp_path: Path) -> None:
    path = write_sinex(tmp_path / "a.snx", ["KNYA"], KONYA[None], covariance_of(3))
    head = path.read_text().split("+SOLUTION/MATRIX_ESTIMATE")[0]
    path.write_text(head + "%ENDSNX\n")
    records = read_sinex(path)
    assert np.count_nonzero(records.covariance) == 3
    assert any("has no covariance matrix" in warning for warning in read([path]).warnings)


def test_stations_are_chosen_from_sinex_alone(tmp_path: Path) -> None:
    context = GnssContext(stations=("A",))
    with pytest.raises(InputError, match="from SINEX files only"):
        read([write_gvx(tmp_path / "g.gvx")], context)
