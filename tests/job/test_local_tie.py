"""Telescopes and rotation axes from files: invariant points, offsets, skews, tilts."""

import runpy
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

import tribrach as tb
from tests.observations.examples import SITES
from tribrach.errors import InputError
from tribrach.geometry import rotation
from tribrach.job.opened import open_job
from tribrach.network.adjustment import adjust
from tribrach.observations.telescopes import TelescopeTargets
from tribrach.observations.unknowns import Layout, State

EXAMPLE = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "10_local_tie.py"))
#: unknowns of the axes by name, and their truth [m, rad]
AXES = {
    "axis offset of VLBI": EXAMPLE["OFFSET"],
    "non-orthogonality of the axes of VLBI": EXAMPLE["SKEW"],
    "tilt to the east of the azimuth axis of VLBI": EXAMPLE["TILT_EAST"],
    "tilt to the north of the azimuth axis of VLBI": EXAMPLE["TILT_NORTH"],
}


def misfits(folder: Path, seeds: range) -> Iterator[tuple[float, float, float]]:
    """For each seed: chi-square of the invariant point, of the point and its axes, and vTPv."""
    for seed in seeds:
        a = tb.adjust(EXAMPLE["simulate"](folder, seed))
        assert a.dof == 2 * 3 * 216 + 3 * 12 + 3 * 216 + 2 * 18 + 12 - (
            3 * (216 + 4 + 1 + 12) + 4 + 1 + 4 + 36
        )
        layout = a.layout
        index = np.array([layout.index("scalar", name) for name in AXES])
        columns = np.concatenate(
            [
                layout.position_columns(np.array([layout.position_index("VLBI")]))[0],
                layout.columns("scalar", index)[:, 0],
            ]
        )
        off = np.concatenate(
            [
                a.points["VLBI"].xyz - EXAMPLE["INVARIANT_POINT"],
                a.state.scalars[index] - list(AXES.values()),
            ]
        )
        covariance = a.covariance_columns(columns, columns)
        point = off[:3] @ np.linalg.solve(covariance[:3, :3], off[:3])
        yield float(point), float(off @ np.linalg.solve(covariance, off)), a.vtpv


def check_chi_square(folder: Path, seeds: range) -> None:
    """Errors are as large as their covariances say, and so are the residuals."""
    point, all_of_it, residuals = np.sum(list(misfits(folder, seeds)), axis=0)
    dof = tb.adjust(folder / "local-tie.toml").dof
    for value, each in ((point, 3), (all_of_it, 7), (residuals, dof)):
        low, high = chi2.ppf([0.0005, 0.9995], each * len(seeds))
        assert low < value < high, (value, each * len(seeds))


def test_invariant_point_is_within_its_sigmas(tmp_path: Path) -> None:
    check_chi_square(tmp_path, range(5))


@pytest.mark.slow
def test_invariant_point_over_two_hundred_seeds(tmp_path: Path) -> None:
    check_chi_square(tmp_path, range(200))


def telescope(**columns: object) -> TelescopeTargets:
    """One target of one telescope in the layout below."""
    names = ("azimuth", "elevation", "tilt_east", "tilt_north", "axis_offset", "axis_skew")
    index = {name: [k] for k, name in enumerate(names)}
    return TelescopeTargets(
        values=np.zeros((1, 3)),
        covariance=np.eye(3)[None],
        reference=np.array([0]),
        point=np.array([1]),
        body=np.array([0]),
        **{name: np.array(k) for name, k in index.items()},
        **columns,
    )


LAYOUT = Layout(points=["X0", "X"], vectors=["p"], scalars=["A", "E", "a", "b", "e", "g"])


def state_of(scalars: list[float], body: tuple[float, float, float]) -> State:
    """A state of one telescope."""
    blank = State.blank(LAYOUT)
    return replace(
        blank,
        points=np.array([[1.0, 2, 3], [0, 0, 0]]),
        scalars=np.array(scalars),
        vectors=np.array([body], dtype=float),
    )


def arm(scalars: list[float], body: tuple[float, float, float]) -> np.ndarray:
    """Where the model carries a target, relative to the invariant point."""
    state = state_of(scalars, body)
    return -(telescope().predict(state)[0] + state.points[0])


def test_model_in_closed_form() -> None:
    """Looking east at the horizon, at the zenith, and with one deviation of the axes at a time."""
    east, up, right = np.pi / 2, np.pi / 2, (2.0, 0.0, 0.0)
    assert arm([east, 0, 0, 0, 0.5, 0], (0, 4, 1)) == pytest.approx([4.5, 0, 1])
    assert arm([0, up, 0, 0, 0.5, 0], (0, 4, 1)) == pytest.approx([0, -0.5, 4])
    c, s = 2 * np.cos(0.01), 2 * np.sin(0.01)
    assert arm([0, 0, 0, 0, 0, 0.01], right) == pytest.approx([c, 0, s])
    assert arm([np.pi, 0, 0, 0, 0, 0.01], right) == pytest.approx([-c, 0, s])
    # an axis that leans to the east by a carries what is above the elevation axis there
    assert arm([0, 0, 1e-4, 0, 0, 0], (0, 0, 10)) == pytest.approx([1e-3, 0, 10], abs=1e-7)
    assert arm([0, 0, 0, 1e-4, 0, 0], (0, 0, 10)) == pytest.approx([0, 1e-3, 10], abs=1e-7)


@pytest.mark.parametrize("site", SITES)
def test_jacobian_at_any_angle(site: object) -> None:
    """Central differences through all unknowns, at azimuths and elevations of any size."""
    rng = np.random.default_rng(8)
    for _ in range(5):
        scalars = [*rng.uniform(-3, 3, 2), *rng.uniform(-0.2, 0.2, 2), *rng.uniform(-1, 1, 2)]
        state = state_of(scalars, tuple(rng.uniform(-5, 5, 3)))
        o = telescope(site=site)
        dense = np.zeros((3, LAYOUT.size))
        for block in o.jacobian(state):
            dense[:, block.columns[0]] += block.values[0]
        step = 1e-5
        for column in range(LAYOUT.size):
            delta = np.zeros(LAYOUT.size)
            delta[column] = step
            ahead, behind = (o.predict(state.retract(sign * delta))[0] for sign in (1, -1))
            assert dense[:, column] == pytest.approx((ahead - behind) / (2 * step), abs=2e-8)


def nominal(folder: Path, tie: str = "") -> Path:
    """The example with angles that are near the truth and have no sigma, and further sections."""
    project: Path = EXAMPLE["simulate"](folder, 3)
    head, *rows = (folder / "telescope.csv").read_text().splitlines()
    short = []
    for row in rows:
        telescope, target, point, azimuth, elevation, sigma, *_ = row.split(",")
        near = f"{float(azimuth) + 40:.1f},{float(elevation) + 0.05:.1f}"
        short.append(f"{telescope},{target},{point},{near},{sigma}")
    names = head.split(",")[:6]
    (folder / "telescope.csv").write_text("\n".join([",".join(names), *short]) + "\n")
    project.write_text(project.read_text() + tie)
    return project


def test_without_circles_of_the_telescope(tmp_path: Path) -> None:
    """Angles without sigmas only start: the azimuth circle may be off by 40 degrees, and more."""
    read = tb.adjust(EXAMPLE["simulate"](tmp_path, 3)).points["VLBI"]
    free = tb.adjust(nominal(tmp_path)).points["VLBI"]
    assert free.xyz == pytest.approx(read.xyz, abs=1e-4)
    assert free.xyz == pytest.approx(EXAMPLE["INVARIANT_POINT"], abs=6e-4)


def test_what_is_known_of_the_axes(tmp_path: Path) -> None:
    """A held offset has no sigma, a wrong one fails the global test; an unknown name is refused."""
    tie = "[telescopes.VLBI]\noffset_m = {}\nsigma_offset_mm = 0\n"
    right = tb.adjust(nominal(tmp_path, tie.format(0.7123)))
    index = right.layout.index("scalar", "axis offset of VLBI")
    assert right.state.scalars[index] == 0.7123
    assert right.family_covariances("scalar")[index, 0, 0] == 0
    wrong = adjust(open_job(nominal(tmp_path, tie.format(0.7143))).network())
    assert wrong.sigma0_posterior > 1.1 > right.sigma0_posterior
    with pytest.raises(InputError, match="no target stands on the telescope VLBA"):
        tb.adjust(nominal(tmp_path, "[telescopes.VLBA]\noffset_m = 0\n"))


def turntable(folder: Path, direction: np.ndarray, column: str = "", cell: str = "") -> Path:
    """Three targets in seven positions about an axis through (10, 20, 5), given as control."""
    n = direction / np.linalg.norm(direction)
    points, rows = [], []
    for i, (along, radius) in enumerate(((0.0, 2.0), (1.5, 3.0), (-1.0, 1.0))):
        spoke = np.cross(n, [0.3, -0.5, 0.6])
        spoke *= radius / np.linalg.norm(spoke)
        for k in range(7):
            turned = rotation.exp(0.5 * k * n) @ spoke
            x = np.array([10.0, 20, 5]) + along * n + turned
            points.append(f"T{i}-{k},{x[0]:.9f},{x[1]:.9f},{x[2]:.9f},0.1,0.1,0.1")
            rows.append(f"ARP,T{i},T{i}-{k},0.1,0.1{cell}")
    head = "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm\n"
    (folder / "points.csv").write_text(head + "\n".join(points) + "\n")
    head = f"axis,target,point,sigma_radius_mm,sigma_plane_mm{column}\n"
    (folder / "circles.csv").write_text(head + "\n".join(rows) + "\n")
    project = folder / "axis.toml"
    project.write_text('[[points]]\nfile = "points.csv"\n[[observations]]\nfile = "circles.csv"\n')
    return project


def test_rotation_axis_from_circles(tmp_path: Path) -> None:
    """Centre of the first circle, direction, places and radii of an inclined axis."""
    a = tb.adjust(turntable(tmp_path, np.array([0.1, -0.2, 1.0])))
    values = dict(zip(a.layout.names["scalar"], a.state.scalars, strict=True))
    assert a.points["ARP"].xyz == pytest.approx([10, 20, 5], abs=1e-8)
    assert values["slope 1 of ARP"] == pytest.approx(0.1, abs=1e-8)
    assert values["slope 2 of ARP"] == pytest.approx(-0.2, abs=1e-8)
    assert values["radius of T1 about ARP"] == pytest.approx(3, abs=1e-8)
    size = np.sqrt(1.05)
    assert values["place of T1 about ARP"] * size == pytest.approx(1.5, abs=1e-8)
    assert a.dof == 3 * 21 + 2 * 21 - (3 * 21 + 3 + 2 + 2 + 3)


def test_horizontal_axis_and_its_foot(tmp_path: Path) -> None:
    """The word along says where the axis runs; the origin is the foot of a named point."""
    direction = np.array([1.0, 0.3, 0.05])
    with pytest.raises(InputError, match="does not run along up"):
        tb.adjust(turntable(tmp_path, direction))
    a = tb.adjust(turntable(tmp_path, direction, ",along,foot", ",east,T1-0"))
    n = direction / np.linalg.norm(direction)
    assert a.points["ARP"].xyz == pytest.approx(np.array([10, 20, 5]) + 1.5 * n, abs=1e-7)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("VLBI,T1,P1,0,10,0.1,p1", "point P1 stands in line 2 already"),
        ("VLBI,T1,P2,1,10,0.1,p1", "set p1 of VLBI has other angles in line 2"),
        ("VLBI,T1,P2,0,10,,p1", "there is no sigma"),
    ],
)
def test_impossible_tables(tmp_path: Path, row: str, words: str) -> None:
    file = tmp_path / "telescope.csv"
    head = "telescope,target,point,azimuth_deg,elevation_deg,sigma_mm,set\n"
    file.write_text(head + "VLBI,T1,P1,0,10,0.1,p1\n" + row + "\n")
    with pytest.raises(InputError, match=words) as caught:
        tb.adjust(file)
    assert caught.value.line == 3
