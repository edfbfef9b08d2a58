"""Scanners over known marks with backsights: the adjusted covariance is the closed form."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tests.cloud.known_setup import KnownSetup
from tribrach.errors import InputError
from tribrach.instruments.precision import pointing_sigma
from tribrach.job.opened import open_job
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.contributions import by_category, contributions
from tribrach.project import Project
from tribrach.units import SEC

#: occupied mark, backsight and another one; height of scanner and prism over them
A, B, C = np.array([100.0, 200.0, 50.0]), np.array([120.0, 235.0, 56.0]), np.array([80.0, 190, 49])
HI, HT = 1.562, 1.5
UP = np.array([0.0, 0.0, 1.0])
MARK, CENTRING, HEIGHT, TILT, MAGNIFICATION = 0.0015, 0.0005, 0.001, 20.0, 30.0
#: of the scanner's x axis, counter-clockwise from east [rad]
HEADING = 0.7

PROJECT = """
[instruments.scanner]
range_mm = 1.2
scan_angle_arcsec = 8.0
centring_mm = 0.5
height_mm = 1.0
levelling_arcsec = 20.0
magnification = 30.0

[[points]]
file = "control.csv"

[[observations]]
file = "{observations}"
instrument = "scanner"

[stations.S1]
levelled = true
instrument = "scanner"
occupies = "A"
height_m = 1.562
backsights = [{backsights}]
"""


def horizontal(target: np.ndarray) -> float:
    """Angle in the scanner frame [rad]."""
    east, north, _ = target - A
    return float(np.arctan2(north, east) - HEADING)


def sight(name: str, target: np.ndarray, more: str = "") -> str:
    angle = np.degrees(horizontal(target))
    return f'{{ to = "{name}", horizontal_deg = {angle:.9f}, height_target_m = {HT}{more} }}'


def written(folder: Path, *backsights: str, targets: str = "", edit: str = "") -> Project:
    """The project; observations are targets of the scan or, without any, one far-off line."""
    rows = [f"{n},{x[0]},{x[1]},{x[2]},1.5,1.5,1.5" for n, x in (("A", A), ("B", B), ("C", C))]
    head = "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm"
    (folder / "control.csv").write_text("\n".join([head, *rows, ""]))
    (folder / "line.csv").write_text("from,to,distance_m,sigma_distance_mm\nB,C,60.6,500\n")
    (folder / "targets.csv").write_text(
        f"station,target,x_m,y_m,z_m,sigma_x_mm,sigma_y_mm,sigma_z_mm\n{targets}"
    )
    file = "targets.csv" if targets else "line.csv"
    text = PROJECT.format(observations=file, backsights=", ".join(backsights))
    path = folder / "p.toml"
    path.write_text(text.replace(*edit.split("->")) if edit else text)
    return Project.load(path)


def closed(pointings: int = 1) -> KnownSetup:
    """The same by the formulas of the budget."""
    line = B + UP * HT - A - UP * HI
    flat = float(np.hypot(*line[:2]))
    return KnownSetup(
        MARK**2 * np.eye(3), MARK, CENTRING, HEIGHT, TILT * SEC, flat,
        float(np.arctan2(flat, line[2])), MAGNIFICATION, pointings,
    )  # fmt: skip


def adjusted(project: Project) -> Adjustment:
    return adjust(open_job(project).network())


@pytest.mark.parametrize("pointings", [1, 4])
def test_covariance_is_the_closed_form(tmp_path: Path, pointings: int) -> None:
    found = adjusted(written(tmp_path, sight("B", B, f", pointings = {pointings}")))
    covariance, expected = found.covariance("S1"), closed(pointings).covariance
    assert np.sqrt(np.diag(covariance)) == pytest.approx(np.sqrt(np.diag(expected)), rel=2e-3)
    # what the closed form leaves out: the mark's error across the line turns the heading too
    across = np.array([-(B - A)[1], (B - A)[0]]) / np.hypot(*(B - A)[:2])
    shared = (MARK**2 + CENTRING**2) / closed().length
    assert covariance[:2, 5] @ across == pytest.approx(-shared, rel=1e-3)
    state = found.state
    assert state.pose_t[0] == pytest.approx(A + UP * HI, abs=1e-6)
    heading = np.arctan2(state.pose_r[0][1, 0], state.pose_r[0][0, 0])
    assert heading == pytest.approx(HEADING, abs=1e-8)


def test_shares_have_their_names(tmp_path: Path) -> None:
    found = adjusted(written(tmp_path, sight("B", B)))
    shares = by_category(contributions(found, "S1"))
    assert set(shares) >= {"control", "centring", "backsight", "levelling"}
    setup, heading = closed(), closed().heading
    assert np.sqrt(shares["backsight"][5, 5]) == pytest.approx(pointing_sigma(30.0), rel=1e-3)
    assert np.sqrt(shares["control"][5, 5]) == pytest.approx(
        heading["backsight position"], rel=1e-3
    )
    assert np.sqrt(shares["centring"][5, 5]) == pytest.approx(
        heading["backsight centring"], rel=1e-3
    )
    assert np.sqrt(shares["levelling"][5, 5]) == pytest.approx(
        heading["backsight trunnion"], rel=2e-3
    )
    assert shares["levelling"][3, 3] == pytest.approx(setup.tilt**2, rel=1e-3)
    total = np.sum(list(shares.values()), axis=0)
    assert total == pytest.approx(found.covariance("S1"), rel=1e-9, abs=1e-18)


def test_two_backsights_and_targets_in_one_network(tmp_path: Path) -> None:
    """A second backsight and a resection make the heading better, never worse."""
    one = adjusted(written(tmp_path, sight("B", B)))
    two = adjusted(written(tmp_path, sight("B", B), sight("C", C)))
    turn = np.array([[np.cos(HEADING), np.sin(HEADING), 0], [-np.sin(HEADING), np.cos(HEADING), 0],
                     [0, 0, 1]])  # fmt: skip
    rows = []
    for name, x in (("B", B), ("C", C)):
        local = turn @ (x - A - UP * HI)
        rows.append(f"S1,{name},{local[0]:.6f},{local[1]:.6f},{local[2]:.6f},1,1,1\n")
    mixed = adjusted(written(tmp_path, sight("B", B), targets="".join(rows)))
    assert (two.dof, mixed.dof) == (one.dof + 1, 6)
    for better in (two, mixed):
        scale = np.array([1e3] * 3 + [1e5] * 3)
        gain = np.outer(scale, scale) * (one.covariance("S1") - better.covariance("S1"))
        assert np.linalg.eigvalsh(gain)[0] > -1e-6
        assert better.covariance("S1")[5, 5] < 0.8 * one.covariance("S1")[5, 5]


@pytest.mark.parametrize("trials", [60, pytest.param(150, marks=pytest.mark.slow)])
def test_monte_carlo_of_the_set_up(tmp_path: Path, trials: int) -> None:
    """Errors drawn where they arise: the pose scatters as its covariance says."""
    rng = np.random.default_rng(3)
    project = written(tmp_path, sight("B", B))
    network = open_job(project).network()
    state = adjust(network).state
    poses = []
    for _ in range(trials):
        drawn = []
        for o in network.observations:
            noise = np.stack([rng.multivariate_normal(np.zeros(o.rows), c) for c in o.covariance])
            drawn.append(replace(o, values=o.predict(state) + noise))
        found = adjust(replace(network, observations=tuple(drawn)))
        turn = found.state.pose_r[0] @ state.pose_r[0].T
        poses.append([*(found.state.pose_t[0] - state.pose_t[0]), turn[2, 1], turn[0, 2],
                      turn[1, 0]])  # fmt: skip
    error = np.array(poses)
    covariance = adjust(network).covariance("S1")
    square = np.einsum("ni,ij,nj->", error, np.linalg.inv(covariance), error)
    low, high = chi2.ppf([0.001, 0.999], 6 * trials)
    assert low < square < high


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        ("centring_mm = 0.5->", "how well the instrument of S1 is centred"),
        ("height_mm = 1.0->", "its height measured is not given"),
        ("magnification = 30.0->", "how well the telescope of S1 points"),
        ('levelled = true\ninstrument = "scanner"->levelled = true\ninstrument = "other"',
         "instrument other is not defined"),
    ],
)  # fmt: skip
def test_what_is_missing_is_named(tmp_path: Path, edit: str, words: str) -> None:
    project = written(tmp_path, sight("B", B), edit=edit)
    with pytest.raises(InputError, match=words) as caught:
        open_job(project).network()
    assert "p.toml" in str(caught.value)


def test_a_backsight_with_its_own_sigma(tmp_path: Path) -> None:
    sharp = sight("B", B, ", sigma_arcsec = 0.1")
    found = adjusted(written(tmp_path, sharp, edit="magnification = 30.0->"))
    parts = closed().heading
    rest = np.sqrt(sum(s**2 for name, s in parts.items() if name != "backsight pointing"))
    heading = np.sqrt(found.covariance("S1")[5, 5])
    assert heading == pytest.approx(np.hypot(rest, 0.1 * SEC), rel=1e-3)


def test_a_decision_holds_for_where_a_scanner_is_first_put(tmp_path: Path) -> None:
    """B is known by two vectors, one of them wrong by 12 m, stated as good, and switched off."""
    project = written(tmp_path, sight("B", B))
    control = (tmp_path / "control.csv").read_text().splitlines()
    (tmp_path / "control.csv").write_text("\n".join(r for r in control if r[:2] != "B,") + "\n")
    right, wrong = B - A, B - A + (0, 12, 0)
    rows = [f"A,B,{v[0]},{v[1]},{v[2]},1,1,1" for v in (right, wrong)]
    head = "from,to,de_m,dn_m,du_m,sigma_de_mm,sigma_dn_mm,sigma_du_mm"
    (tmp_path / "line.csv").write_text("\n".join([head, *rows, ""]))
    (tmp_path / "edits.toml").write_text(
        '[[edit]]\nobservation = "line.csv:3"\nuse = "off"\nreason = "antenna of C"\n'
    )
    network = open_job(project).network()
    heading = np.arctan2(network.start.pose_r[0][1, 0], network.start.pose_r[0][0, 0])
    assert heading == pytest.approx(HEADING, abs=1e-6)
    (tmp_path / "edits.toml").unlink()
    network = open_job(project).network()
    heading = np.arctan2(network.start.pose_r[0][1, 0], network.start.pose_r[0][0, 0])
    assert abs(heading - HEADING) > 0.01
