"""Terrestrial networks under leaning plumb lines: what astronomy says, simulated without the code.

Truth: geocentric coordinates and astronomic latitude and longitude of every station. Axes at a
station are those of its astronomic place (Torge and Müller 2012), and
everything is read along them.
"""

from pathlib import Path

import numpy as np
import pytest
from pyproj import Transformer

from tests.geodesy.test_geoid_grid import write_gtx
from tribrach.geodesy.plumb import PlumbField, PlumbLines
from tribrach.geodesy.site import EllipsoidSite, FlatSite
from tribrach.job.opened import open_job
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.survey import Survey
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.sights import Azimuths, Directions, SlopeDistances, ZenithAngles
from tribrach.observations.unknowns import Layout, State
from tribrach.units import SEC

ORIGIN = EllipsoidSite(0.81, 0.2, 500.0)
#: E, N, U of the marks [m]
MARKS = {
    "A": (0.0, 0.0, 0.0), "B": (900.0, 100.0, 60.0), "C": (700.0, 1200.0, -40.0),
    "D": (-300.0, 800.0, 250.0), "E": (250.0, 500.0, 30.0),
}  # fmt: skip


def zenith_frame(latitude: float, longitude: float) -> np.ndarray:
    """East, north, zenith in geocentric axes: zenith from the angles, east from the pole."""
    up = np.array(
        [
            np.cos(latitude) * np.cos(longitude),
            np.cos(latitude) * np.sin(longitude),
            np.sin(latitude),
        ]
    )
    east = np.cross([0.0, 0.0, 1.0], up)
    east /= np.linalg.norm(east)
    return np.stack([east, np.cross(up, east), up])


class Field:
    """Marks with plumb lines of their own, and what instruments on them read."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.ecef = {n: ORIGIN.to_ecef(np.array([x]))[0] for n, x in MARKS.items()}
        self.lean = {n: rng.uniform(-40, 40, 2) * SEC for n in MARKS}
        self.axes = {}
        back = Transformer.from_crs("EPSG:4936", "EPSG:4937")
        for name, xyz in self.ecef.items():
            latitude, longitude, _ = back.transform(*xyz)
            latitude, longitude = np.radians([latitude, longitude])
            xi, eta = self.lean[name]
            self.axes[name] = zenith_frame(latitude + xi, longitude + eta / np.cos(latitude))
        self.hi = {n: rng.uniform(1.4, 1.8) for n in MARKS}
        self.ht = {n: rng.uniform(1.2, 2.2) for n in MARKS}

    def sight(self, a: str, b: str) -> np.ndarray:
        """From the instrument over ``a`` to the target over ``b`` in the axes of ``a``."""
        start = self.ecef[a] + self.hi[a] * self.axes[a][2]
        end = self.ecef[b] + self.ht[b] * self.axes[b][2]
        return self.axes[a] @ (end - start)

    def survey(self, held: tuple[str, ...]) -> Survey:
        survey = Survey(site=ORIGIN)
        rng = np.random.default_rng(1)
        for name, xyz in MARKS.items():
            role = "fixed" if name in held else "approximate"
            rough = np.array(xyz) + (0.0 if name in held else rng.normal(0, 0.05, 3))
            survey.point(name, rough, role=role, free=[name not in held] * 3)
        for a in MARKS:
            ends = [b for b in MARKS if b != a]
            u = np.array([self.sight(a, b) for b in ends])
            common = {
                "start": [a] * len(ends),
                "end": ends,
                "height_instrument": self.hi[a],
                "height_target": np.array([self.ht[b] for b in ends]),
            }
            azimuth = np.arctan2(u[:, 0], u[:, 1])
            zenith = np.arctan2(np.hypot(u[:, 0], u[:, 1]), u[:, 2])
            survey.add(
                Directions, values=azimuth - 0.7, sigma=SEC, orientation=[f"o {a}"] * 4, **common
            )
            survey.add(ZenithAngles, values=zenith, sigma=SEC, **common)
            survey.add(SlopeDistances, values=np.linalg.norm(u, axis=1), sigma=0.001, **common)
        return survey

    def error(self, adjustment: Adjustment) -> float:
        """Largest error of a coordinate [m]."""
        names = adjustment.layout.names["point"]
        true = np.array([MARKS[name] for name in names])
        return float(np.abs(adjustment.state.points - true).max())


def test_a_network_under_leaning_plumb_lines_finds_the_truth() -> None:
    """Every station with its own 40 arcsec: exact with them; without, wrong and refused."""
    field = Field(3)
    survey = field.survey(("A", "C"))
    with_none = adjust(survey.network())
    assert field.error(with_none) > 0.02
    assert with_none.sigma0_posterior > 5
    survey.deflections = {name: tuple(lean) for name, lean in field.lean.items()}
    found = adjust(survey.network())
    assert field.error(found) < 1e-6
    assert found.sigma0_posterior < 1e-4


def test_astronomic_azimuths_feel_laplace_and_geodetic_ones_do_not() -> None:
    """Torge and Müller: A = a + eta tan(phi) + (xi sin A - eta cos A) cot z, to second order."""
    field = Field(5)
    layout = Layout(points=list(MARKS))
    state = State.blank(layout)
    state.points[:] = list(MARKS.values())
    a, b = layout.position_index("A"), layout.position_index("D")
    own = np.array([field.lean[name] for name in layout.names["point"]])
    lines = PlumbLines(PlumbField(), own)
    options = {"values": [[0.0]] * 2, "covariance": [[[1.0]]] * 2}
    azimuths = Azimuths(
        start=[a, a], end=[b, b], astronomic=[1.0, 0.0], site=ORIGIN, plumb=lines, **options
    )
    astronomic, geodetic = azimuths.predict(state)[:, 0]
    u = Azimuths(start=[a, a], end=[b, b], site=ORIGIN, **options).sight(state)[0]
    xi, eta = field.lean["A"]
    cot = u[2] / np.hypot(u[0], u[1])
    laplace = eta * np.tan(0.81) + (xi * np.sin(geodetic) - eta * np.cos(geodetic)) * cot
    assert geodetic == pytest.approx(np.arctan2(u[0], u[1]), abs=1e-15)
    assert astronomic - geodetic == pytest.approx(laplace, abs=3e-8)
    assert abs(laplace) > 5 * SEC
    field.hi["A"] = field.ht["D"] = 0.0
    truth = field.sight("A", "D")
    assert astronomic == pytest.approx(np.arctan2(truth[0], truth[1]), abs=1e-12)
    # and the zenith angle by the deflection along the line: z' = z - xi cos A - eta sin A
    zeniths = ZenithAngles(start=[a, a], end=[b, b], site=ORIGIN, plumb=lines, **options)
    plain = ZenithAngles(start=[a, a], end=[b, b], site=ORIGIN, **options)
    along = xi * np.cos(geodetic) + eta * np.sin(geodetic)
    assert zeniths.predict(state) - plain.predict(state) == pytest.approx(-along, abs=5e-8)


def test_a_flat_site_may_lean() -> None:
    """One deflection against a Cartesian frame: a tilt, and no turn of the north."""
    lean = np.array([[20.0, -35.0]]) * SEC
    (axes,) = FlatSite().leaning(np.zeros((1, 3)), lean)
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-15)
    assert axes[2] == pytest.approx([*lean[0, ::-1], 1.0], abs=3e-8)
    assert axes[1, 0] == pytest.approx(0.0, abs=1e-7)


def test_levelling_follows_the_geoid() -> None:
    """Known geoid heights, else the deflection: -(xi dN + eta dE), as astronomic levelling."""
    survey = Survey(site=ORIGIN)
    survey.point("A", MARKS["A"], role="fixed", free=[False] * 3)
    survey.point("B", (*MARKS["B"][:2], 0.0), role="approximate", free=[False, False, True])
    survey.add(HeightDifferences, values=[1.0], sigma=0.001, start=["A"], end=["B"])
    plain = adjust(survey.network()).state.points[1, 2]
    survey.deflections = {"A": (10 * SEC, -4 * SEC), "B": (12 * SEC, -2 * SEC)}
    leaning = adjust(survey.network()).state.points[1, 2]
    # B is 900 m to the east and 100 m to the north
    assert leaning - plain == pytest.approx(-(11 * 100 - 3 * 900) * SEC, abs=2e-5)
    survey.undulations = {"A": 45.0, "B": 45.25}
    known = adjust(survey.network()).state.points[1, 2]
    assert known - plain == pytest.approx(0.25, abs=2e-5)


PROJECT = """\
[site]
latitude_deg = 37.87
longitude_deg = 32.5
height_m = 1000.0
{site}
[[points]]
file = "control.csv"
[[observations]]
file = "sights.csv"
"""


def write(folder: Path, site: str) -> Path:
    """A total station on A, 2 km to the north of which stands B, 2 km to the east C."""
    (folder / "control.csv").write_text(
        "point,e_m,n_m,u_m,role\nA,0,0,0,fixed\nB,0,2000,0,approximate\nC,2000,0,0,approximate\n"
    )
    (folder / "sights.csv").write_text(
        "from,to,zenith_deg,slope_distance_m,azimuth_deg,sigma_zenith_arcsec,"
        "sigma_distance_mm,sigma_azimuth_arcsec\n"
        "A,B,90,2000,0,1,1,1\nA,C,90,2000,90,1,1,1\n"
    )
    path = folder / "p.toml"
    path.write_text(PROJECT.format(site=site))
    return path


def heights(path: Path) -> np.ndarray:
    network = open_job(path).network()
    state = adjust(network).state
    names = network.start.layout.names["point"]
    return np.array([state.points[names.index(name), 2] for name in "BC"])


def test_the_project_gives_constants_and_grids(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """10 and -4 arcsec are 97 and -39 mm over 2 km; the same slope of a grid in its own folder."""
    (tmp_path / "grids").mkdir()
    path = write(tmp_path, "")
    plain = heights(path)
    constant = heights(write(tmp_path, "deflection = { xi_arcsec = 10, eta_arcsec = -4 }"))
    assert constant - plain == pytest.approx([-2000 * 10 * SEC, 2000 * 4 * SEC], abs=1e-4)
    # arcs of a degree at 37.87 N are 110.998 and 87.991 km; the geoid falls where the line leans
    slopes = -10 * SEC * 110_998, 4 * SEC * 87_991
    write_gtx(tmp_path / "grids" / "g.gtx", *slopes)
    write(tmp_path, 'deflection = { grid = "grids/g.gtx", sigma_arcsec = 0 }')
    # as the command does from the folder of the project
    monkeypatch.chdir(tmp_path)
    curvature = 0.1713 * SEC * np.sin(2 * np.radians(37.87)) * 2000
    found = heights(Path("p.toml"))
    assert found - plain == pytest.approx([-2000 * 10 * SEC - curvature, 2000 * 4 * SEC], abs=4e-4)


def test_the_error_of_the_deflection_is_shared(tmp_path: Path) -> None:
    """5 arcsec common to both sights are 48 mm in either height, and turn nothing else."""
    path = write(tmp_path, "deflection = { xi_arcsec = 10, sigma_arcsec = 5 }")
    adjustment = adjust(open_job(path).network())
    sigma = [np.sqrt(adjustment.covariance(name)[2, 2]) for name in "BC"]
    assert sigma == pytest.approx([2000 * np.hypot(5, 1) * SEC] * 2, rel=1e-3)
