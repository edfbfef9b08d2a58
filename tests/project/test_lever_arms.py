"""Antennas and prisms on scanners, and the plumb line, from a project file to adjusted stations."""

from pathlib import Path

import numpy as np
import pytest

import tribrach as tb
from tests.geodesy.test_geoid_grid import write_gtx
from tribrach.errors import InputError
from tribrach.geodesy.site import EllipsoidSite
from tribrach.geometry import rotation
from tribrach.io.lever_arm_file import LeverArmResult, lever_arm_text, read_lever_arm
from tribrach.job.opened import open_job
from tribrach.network.adjustment import Adjustment
from tribrach.observations.scanner import Inclinations
from tribrach.units import SEC

ARM = np.array([0.012, -0.004, 0.329])
PLACE = np.array([5.0, 7.0, 1.6])
TURN = rotation.exp(np.array([[0.03, -0.02, 0.7]]))[0]
TARGETS = {"A": (12.0, 3.0, 2.0), "B": (-4.0, 15.0, 1.0), "C": (2.0, -9.0, 4.0), "D": (9, 14, 0.5)}


def table(path: Path, head: str, rows: list[tuple[object, ...]]) -> None:
    lines = [head, *(",".join(str(cell) for cell in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")


def write(
    folder: Path, lever_arm: str, *, station: str = "", site: str = "", more: str = ""
) -> Path:
    """One station that sees four control points and carries an antenna; noise-free."""
    control = [(n, *xyz, 1, 1, 1) for n, xyz in TARGETS.items()]
    table(folder / "control.csv", "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm", control)
    seen = [("S", n, *(TURN.T @ (np.array(xyz) - PLACE)), 1, 1, 1) for n, xyz in TARGETS.items()]
    head = "station,target,x_m,y_m,z_m,sigma_x_mm,sigma_y_mm,sigma_z_mm"
    table(folder / "targets.csv", head, seen)
    antenna = ("S", *(PLACE + TURN @ ARM), 2, 2, 3)
    table(folder / "gnss.csv", "gnss,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm", [antenna])
    text = f"""
    [site]
    kind = "flat"
    {site}
    [stations.S]
    lever_arm = "antenna"
    {station}
    [lever_arms.antenna]
    {lever_arm}
    [[points]]
    file = "control.csv"
    [[observations]]
    file = "targets.csv"
    [[observations]]
    file = "gnss.csv"
    """
    path = folder / "project.toml"
    path.write_text("\n".join(line.strip() for line in text.splitlines()))
    return path


def adjusted(path: Path) -> Adjustment:
    return tb.adjust(open_job(path).network())


def arm_of(adjustment: Adjustment) -> tuple[np.ndarray, np.ndarray]:
    covariance = adjustment.family_covariances("vector")[0]
    return adjustment.state.vectors[0], np.sqrt(np.diag(covariance))


def test_a_lever_arm_is_found_by_its_targets(tmp_path: Path) -> None:
    """Hardly anything known before: the arm is R^T (X - t), known as well as station and GNSS."""
    found = adjusted(write(tmp_path, "x_m=0\ny_m=0\nz_m=0.3\nsigma_mm=1e5"))
    arm, sigma = arm_of(found)
    assert arm == pytest.approx(ARM, abs=1e-7)
    # four targets of sigma root 2 mm around the station, and the antenna itself
    assert sigma[:2] == pytest.approx([2.1e-3, 2.1e-3], rel=0.1)
    assert sigma[2] > 3.0e-3


def test_components_may_be_held(tmp_path: Path) -> None:
    """The choice of the published calibration: x and y zero, only z unknown."""
    text = "x_m=0\ny_m=0\nz_m=0.3\nsigma_x_mm=0\nsigma_y_mm=0\nsigma_z_mm=1000"
    found = adjusted(write(tmp_path, text))
    arm, sigma = arm_of(found)
    assert arm[:2].tolist() == [0.0, 0.0]
    assert sigma[:2].tolist() == [0.0, 0.0]
    free = adjusted(write(tmp_path, "x_m=0\ny_m=0\nz_m=0.3\nsigma_mm=1e5"))
    # fewer unknowns, as many observations less: two held components are no observations
    assert found.dof == free.dof
    assert len(found.residuals) == len(free.residuals) - 2


def test_a_lever_arm_goes_from_one_project_to_the_next(tmp_path: Path) -> None:
    covariance = np.array([[4.0, 1.0, 0.5], [1.0, 9.0, -2.0], [0.5, -2.0, 16.0]]) * 1e-6
    arm = LeverArmResult("antenna", ARM, covariance, ("S1",), "2026-01-01", "control", "a priori")
    (tmp_path / "antenna.toml").write_text(lever_arm_text(arm))
    back = read_lever_arm(tmp_path / "antenna.toml")
    assert np.array_equal(back.vector, ARM)
    assert np.array_equal(back.covariance, covariance)
    assert back.stations == ("S1",)
    found = adjusted(write(tmp_path, 'file = "antenna.toml"'))
    prior = np.linalg.inv(covariance)
    alone = adjusted(write(tmp_path, "x_m=0.012\ny_m=-0.004\nz_m=0.329\nsigma_mm=1e5"))
    expected = np.linalg.inv(prior + np.linalg.inv(alone.family_covariances("vector")[0]))
    np.testing.assert_allclose(found.family_covariances("vector")[0], expected, rtol=1e-4)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("schema = 1", "schema = 7"), "schema 7 is not known"),
        (("x_m = 0.012", "x_m = nan"), "x_m"),
        (("x_m = 0.012", "speed = 0.012"), "x_m"),
        (("  [4e-06,", "  [-4e-06,"), "not symmetric and positive"),
        (("1e-06, 5e-07]", "3e-06, 5e-07]"), "not symmetric and positive"),
        (("schema", "schema schema"), "not TOML"),
    ],
)
def test_wrong_files_are_sentences(tmp_path: Path, change: tuple[str, str], words: str) -> None:
    covariance = np.array([[4.0, 1.0, 0.5], [1.0, 9.0, -2.0], [0.5, -2.0, 16.0]]) * 1e-6
    text = lever_arm_text(LeverArmResult("antenna", ARM, covariance))
    assert change[0] in text
    path = tmp_path / "antenna.toml"
    path.write_text(text.replace(change[0], change[1], 1))
    with pytest.raises(InputError, match=words):
        read_lever_arm(path)


def test_an_antenna_that_others_measure_to(tmp_path: Path) -> None:
    """A point on the scanner with control coordinates places it as a position of it would."""
    held = "x_m=0.012\ny_m=-0.004\nz_m=0.329\nsigma_mm=2\nmounting_mm=0.01"
    direct = adjusted(write(tmp_path, held))
    antenna = ("AN", *(PLACE + TURN @ ARM), 2, 2, 3)
    other = write(tmp_path, held, station='mounted_point = "AN"')
    table(tmp_path / "gnss.csv", "gnss,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm", [antenna])
    mounted = adjusted(other)
    assert "AN" in mounted.layout.names["point"]
    np.testing.assert_allclose(mounted.covariance("S"), direct.covariance("S"), rtol=1e-3)


@pytest.mark.parametrize(
    ("arm", "station", "words"),
    [
        ("x_m=0\ny_m=0\nsigma_mm=1", "", "x_m, y_m and z_m, or a file"),
        ("x_m=0\ny_m=0\nz_m=0\nsigma_x_mm=1", "", "needs sigma_mm"),
        ('file="a.toml"\nsigma_mm=1', "", "a file or numbers, not both"),
    ],
)
def test_incomplete_sections_are_refused(
    tmp_path: Path, arm: str, station: str, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        adjusted(write(tmp_path, arm, station=station))


def test_a_mounted_point_without_a_lever_arm_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, "x_m=0\ny_m=0\nz_m=0\nsigma_mm=1", station='mounted_point = "AN"')
    path.write_text(path.read_text().replace('lever_arm = "antenna"', ""))
    with pytest.raises(InputError, match="no lever arm says where each"):
        adjusted(path)


LEVELLED = "levelled = true\nlevelling_arcsec = 2"


def test_a_deflection_tilts_what_is_levelled(tmp_path: Path) -> None:
    """10 arcsec move a point 30 m away by 1.5 mm (method section 7.5)."""
    held = "x_m=0.012\ny_m=-0.004\nz_m=0.329\nsigma_mm=2"
    plain = adjusted(write(tmp_path, held, station=LEVELLED))
    deflection = "deflection = { xi_arcsec = 10, eta_arcsec = -4, sigma_arcsec = 0 }"
    leaning = adjusted(write(tmp_path, held, station=LEVELLED, site=deflection))
    up = np.array([-4 * SEC, 10 * SEC, 1.0])
    kinds = {o.kind: o for o in leaning.network.observations}
    predicted = kinds["inclination"].predict(leaning.state)
    q = leaning.state.pose_r[0].T @ up
    np.testing.assert_allclose(predicted[0], q[:2] / q[2], atol=1e-12)
    # the tilt is known by the compensator (2 arcsec) better than by the targets (some 20)
    turned = rotation.log((leaning.state.pose_r[0] @ plain.state.pose_r[0].T)[None])[0]
    assert np.hypot(*turned[:2]) / SEC == pytest.approx(np.hypot(10, 4), rel=0.05)


def test_an_unknown_deflection_is_common_to_all_stations(tmp_path: Path) -> None:
    """Without other hold on the tilt its sigma is that of compensator and deflection together."""
    held = "x_m=0.012\ny_m=-0.004\nz_m=0.329\nsigma_mm=2"
    path = write(tmp_path, held, station=LEVELLED, site="deflection = { sigma_arcsec = 10 }")
    # only one control point is left: with the antenna it gives position and heading
    table(
        tmp_path / "control.csv",
        "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm",
        [("A", *TARGETS["A"], 100, 100, 100)],
    )
    found = adjusted(path)
    tilt = np.sqrt(np.diag(found.covariance("S"))[3:5])
    np.testing.assert_allclose(tilt, np.hypot(2, 10) * SEC, rtol=0.01)


def test_a_geoid_grid_gives_the_deflection(tmp_path: Path) -> None:
    write_gtx(tmp_path / "g.gtx", 110.998 / 2 * 0.1, 0.0)
    held = "x_m=0.012\ny_m=-0.004\nz_m=0.329\nsigma_mm=2"
    grid = 'deflection = { grid = "g.gtx", sigma_arcsec = 1.5 }'
    path = write(tmp_path, held, station=LEVELLED, site=grid)
    with pytest.raises(InputError, match="the site is flat"):
        adjusted(path)
    text = path.read_text().replace(
        'kind = "flat"', 'kind = "geodetic"\nlatitude_deg = 37.87\nlongitude_deg = 32.5'
    )
    path.write_text(text)
    found = open_job(path).network()
    (levelled,) = [o for o in found.observations if isinstance(o, Inclinations)]
    station = np.array([found.start.layout.count("point")])
    (lean,) = levelled.plumb.deflection(found.site, station, np.zeros((1, 3)))
    assert lean / SEC == pytest.approx([-10.31, 0.0], abs=0.02)


def test_vectors_of_a_session_place_a_scanner_by_its_antenna(tmp_path: Path) -> None:
    """From a fixed base by geocentric vectors to the antenna and two targets: one scan is placed.

    The same vectors, turned into the work frame at an antenna with a lever arm, give the pose.
    """
    frame = EllipsoidSite(float(np.radians(37.87)), float(np.radians(32.5)), 1020.0)
    base = np.array([-300.0, 120.0, -4.0])
    places = {"AN": PLACE + TURN @ ARM, "A": TARGETS["A"], "B": TARGETS["B"]}
    table(tmp_path / "base.csv", "point,e_m,n_m,u_m,role", [("KNYA", *base, "fixed")])
    rows = [
        ("KNYA", name, *((np.array(xyz) - base) @ frame.w_from_ecef), 2, 2, 3)
        for name, xyz in places.items()
    ]
    head = "from,to,dx_m,dy_m,dz_m,sigma_dx_mm,sigma_dy_mm,sigma_dz_mm"
    table(tmp_path / "vectors.csv", head, rows)
    seen = [("S", n, *(TURN.T @ (np.array(xyz) - PLACE)), 1, 1, 1) for n, xyz in TARGETS.items()]
    head = "station,target,x_m,y_m,z_m,sigma_x_mm,sigma_y_mm,sigma_z_mm"
    table(tmp_path / "targets.csv", head, seen)
    path = tmp_path / "project.toml"
    path.write_text(
        """
        [site]
        latitude_deg = 37.87
        longitude_deg = 32.5
        height_m = 1020.0
        [stations.S]
        lever_arm = "antenna"
        mounted_point = "AN"
        [lever_arms.antenna]
        x_m = 0.012
        y_m = -0.004
        z_m = 0.329
        sigma_mm = 2.0
        [[points]]
        file = "base.csv"
        [[observations]]
        file = "vectors.csv"
        [[observations]]
        file = "targets.csv"
        """.replace("        ", "")
    )
    found = adjusted(path)
    assert found.state.pose_t[0] == pytest.approx(PLACE, abs=1e-6)
    np.testing.assert_allclose(found.state.pose_r[0], TURN, atol=1e-7)
    assert found.dof == 3  # nine vector components and a prior of three; pose, arm, two targets
    d = found.state.points[found.layout.index("point", "D")]
    assert d == pytest.approx(TARGETS["D"], abs=1e-5)
    # the antenna stands near the line of both targets: what lies beside it is weak in height
    sigma = np.sqrt(np.diag(found.covariance("D")))
    assert sigma[:2].max() < 0.006 < sigma[2]
