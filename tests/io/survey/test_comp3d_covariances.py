"""Covariances between weighted coordinates of a Comp3D project, against closed forms and CSV."""

from pathlib import Path

import numpy as np
import pytest

from tests.io.survey.test_comp3d import PROJECT
from tribrach.errors import InputError
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.io.survey.comp3d import reader as comp3d
from tribrach.io.survey.comp3d.assembly import grid_axes
from tribrach.io.survey.csv import tables as csv_tables
from tribrach.io.survey.csv.matrix import read_matrix
from tribrach.io.survey.csv.reader import Context
from tribrach.network.adjustment import Adjustment, adjust

NAMES = [f"{point}_{axis}" for point in "AB" for axis in "xyz"]
POINTS = "1 A 1000 2000 100 1 1 1\n1 B 1300 2400 130 1 1 1\n"
#: hardly an observation: the coordinates keep the covariance that they were given
LOOSE = "3 A B 500.9 10\n"


def random_covariance(n: int = 6, seed: int = 4) -> np.ndarray:
    """Millimetres with strong correlations [m^2]."""
    root = np.random.default_rng(seed).normal(size=(n, n))
    return 1e-6 * (root @ root.T + 0.5 * np.eye(n))


def exported(names: list[str], matrix: np.ndarray) -> str:
    """As Comp3D writes it: tabulators, also at the end of a line, and a first cell of its own."""
    rows = [[name, *map(repr, row)] for name, row in zip(names, matrix.tolist(), strict=True)]
    return "".join("\t".join([*row, "\n"]) for row in [["param", *names], *rows])


def project(folder: Path, points: str, observations: str, covariances: str, **change: str) -> Path:
    text = PROJECT.replace('"coord_cov_file": ""', '"coord_cov_file": "c.csv"')
    for old, new in change.items():
        text = text.replace(f'"{old}": false', f'"{old}": {new}')
    for name, content in (
        ("net.cor", points),
        ("net.obs", observations),
        ("c.csv", covariances),
        ("net.comp", text),
    ):
        (folder / name).write_text(content)
    return folder / "net.comp"


def joint(adjustment: Adjustment, names: str = "AB") -> np.ndarray:
    return np.block([[adjustment.covariance(a, b) for b in names] for a in names])


def axes_of(adjustment: Adjustment, name: str) -> np.ndarray:
    """East and north of the grid and up at a point, as rows."""
    state = adjustment.state
    x = state.points[adjustment.layout.index("point", name)]
    return grid_axes(x, adjustment.network.site)


def test_covariances_come_back_along_the_axes_of_the_points(tmp_path: Path) -> None:
    given = random_covariance()
    survey = comp3d.read(project(tmp_path, POINTS, LOOSE, exported(NAMES, given)))
    assert not survey.warnings
    adjustment = adjust(survey.network())
    turn = np.kron(np.eye(2), np.eye(3))
    turn[:3, :3], turn[3:, 3:] = axes_of(adjustment, "A"), axes_of(adjustment, "B")
    found = turn @ joint(adjustment) @ turn.T
    np.testing.assert_allclose(found, given, rtol=2e-6, atol=1e-13)


def test_difference_of_two_correlated_points(tmp_path: Path) -> None:
    """Height difference of control, by the file alone: C_aa + C_bb - 2 C_ab."""
    rho, s = 0.99, 0.010
    matrix = s**2 * np.kron([[1, rho], [rho, 1]], np.eye(3))
    points = POINTS + "0 P 1010 2000 101\n"
    levelled = "4 A P 1.000 0.001\n4 B P -29.0 0.001\n9 A P 10 0.01 0.01\n15 A P 0 0.01\n"
    survey = comp3d.read(project(tmp_path, points, levelled, exported(NAMES, matrix)))
    adjustment = adjust(survey.network())
    axes = axes_of(adjustment, "A")[2], axes_of(adjustment, "B")[2]
    found = joint(adjustment)
    up = np.concatenate([axes[0], -axes[1]])
    prior, measured = 2 * s**2 * (1 - rho), 2 * 0.001**2
    # the misclosure of 0 m is shared by the weights of both ways
    expected = 1 / (1 / prior + 1 / measured)
    assert up @ found @ up == pytest.approx(expected, rel=1e-6)


def test_misclosure_goes_where_the_covariance_says(tmp_path: Path) -> None:
    """Of a rise that contradicts control, control takes D/(D + m) of it, D of the difference."""
    rho, s = 0.9, 0.010
    matrix = s**2 * np.kron([[1, rho], [rho, 1]], np.eye(3))
    survey = comp3d.read(project(tmp_path, POINTS, "4 A B 30.008 0.003\n", exported(NAMES, matrix)))
    adjustment = adjust(survey.network())
    site = adjustment.network.site
    height = site.height(adjustment.state.points)
    names = list(adjustment.layout.names["point"])
    rise = height[names.index("B")] - height[names.index("A")]
    d = 2 * s**2 * (1 - rho)
    assert rise == pytest.approx(30 + 0.008 * d / (d + 0.003**2), abs=1e-8)


def test_same_result_as_a_matrix_of_csv_control(tmp_path: Path) -> None:
    """The same control by the CSV way, in the work frame, under the same sights."""
    given = random_covariance(9)
    names = [f"{point}_{axis}" for point in "ABC" for axis in "xyz"]
    points = POINTS + "1 C 1010 2390 90 1 1 1\n0 P 1100 2200 110\n"
    places = {"A": (1000, 2000, 100), "B": (1300, 2400, 130), "C": (1010, 2390, 90)}
    sights = "".join(
        f"3 {n} P {np.linalg.norm(np.subtract(x, (1100, 2200, 110))) + 0.003 * k:.4f} 0.002\n"
        for k, (n, x) in enumerate(places.items())
    )
    sights += "3 A B 500.905 0.002\n3 B C 292.95 0.02\n"
    survey = comp3d.read(project(tmp_path, points, sights, exported(names, given)))
    ours = adjust(survey.network())
    at = {name: survey.points[name].xyz for name in "ABC"}
    turn = np.zeros((9, 9))
    for k, x in enumerate(at.values()):
        turn[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = grid_axes(x, survey.site).T
    (tmp_path / "points.csv").write_text(
        "point,e_m,n_m,u_m\n"
        + "".join(f"{n},{','.join(repr(float(v)) for v in x)}\n" for n, x in at.items())
    )
    csv_names = [n[:-1] + "enu"["xyz".index(n[-1])] for n in names]
    turned = turn @ given @ turn.T
    rows = [[n, *map(repr, r)] for n, r in zip(csv_names, turned.tolist(), strict=True)]
    (tmp_path / "m.csv").write_text(
        "".join(",".join(row) + "\n" for row in [["covariance_m2", *csv_names], *rows])
    )
    context = Context(frame=WorkFrame(survey.site), matrix=read_matrix(tmp_path / "m.csv"))
    other = csv_tables.read(tmp_path / "points.csv", context)
    # the sights alone, with control without weight
    free = "".join("0" + line[1:] + "\n" for line in points.splitlines())
    (tmp_path / "net.cor").write_text(free)
    (tmp_path / "net.comp").write_text(PROJECT)
    sighted = comp3d.read(tmp_path / "net.comp")
    for name in "ABC":
        del sighted.points[name]
    other.merge(sighted)
    theirs = adjust(other.network())
    assert ours.vtpv == pytest.approx(theirs.vtpv, rel=1e-9)
    assert ours.vtpv > 0.1
    for name in "ABCP":
        i, j = (a.layout.index("point", name) for a in (ours, theirs))
        np.testing.assert_allclose(ours.state.points[i], theirs.state.points[j], atol=1e-9)
    np.testing.assert_allclose(joint(ours, "ABCP"), joint(theirs, "ABCP"), rtol=1e-6, atol=1e-13)


def test_points_in_part_and_other_unknowns(tmp_path: Path) -> None:
    """Plan alone of A, height alone of B; rows of free points and orientations are passed over."""
    points = "2 A 1000 2000 100 1 1 1\n1 B 1300 2400 130 1 1 0.002\n0 P 1010 2000 101\n"
    names = ["P_x", "A_x", "station A_g0", "A_y", "B_y", "A_z", "B_x"]
    given = random_covariance(7, 2)
    given[2] *= 1e9
    given[:, 2] *= 1e9
    observations = "3 A B 500.9 10\n4 A B 30 10\n3 A P 10.05 10\n14 A P 10 5\n15 A P 0 5\n"
    survey = comp3d.read(project(tmp_path, points, observations, exported(names, given)))
    (warning,) = survey.warnings
    assert warning.startswith("c.csv has no covariances of 1 weighted coordinates (B_z):")
    adjustment = adjust(survey.network())
    a, b = axes_of(adjustment, "A"), axes_of(adjustment, "B")
    turn = np.zeros((5, 6))
    turn[:2, :3], turn[2:, 3:] = a[:2], b
    found = turn @ joint(adjustment) @ turn.T
    order = [1, 3, 6, 4]
    np.testing.assert_allclose(found[:4, :4], given[np.ix_(order, order)], rtol=1e-4, atol=1e-11)
    assert found[4, 4] == pytest.approx(0.002**2, rel=1e-4)
    np.testing.assert_allclose(found[4, :4], 0, atol=1e-11)


def test_inner_constraints_have_no_use_for_covariances(tmp_path: Path) -> None:
    text = exported(NAMES, random_covariance())
    path = project(tmp_path, POINTS, LOOSE, text, internal_constraints="true")
    assert any("are not used: with inner constraints" in w for w in comp3d.read(path).warnings)


@pytest.mark.parametrize(
    ("names", "factor", "sentence"),
    [
        (NAMES, -1.0, "not symmetric and positive definite"),
        ([n.replace("A", "C").replace("B", "D") for n in NAMES], 1.0, "of no coordinate that"),
        (["A_x", "A_x", *NAMES[2:]], 1.0, "a coordinate is named twice"),
    ],
)
def test_bad_matrices(tmp_path: Path, names: list[str], factor: float, sentence: str) -> None:
    path = project(tmp_path, POINTS, LOOSE, exported(names, factor * random_covariance()))
    with pytest.raises(InputError, match=sentence) as caught:
        comp3d.read(path)
    assert "c.csv" in str(caught.value)
