"""STAR*NET: what lines mean, told by other lines that mean the same, and what is refused."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies
from pyproj import Transformer

from tribrach.errors import InputError, Refusals
from tribrach.geodesy.site import ecef_from_geodetic, enu_rotation
from tribrach.io.survey.formats import format_of, read
from tribrach.io.survey.starnet.data import CODES
from tribrach.io.survey.starnet.recognition import DATA_TYPES, recognised
from tribrach.io.survey.starnet.settings import grid_of, read_settings
from tribrach.io.survey.starnet.text import angle_of, azimuth_of, data_line
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.survey import Survey, observed_part
from tribrach.units import SEC, format_angle

HERE = Path("job.dat")

CONTROL = """
.ORDER EN
C A 1000 2000 100 ! ! !
C B 1200 2100 103 ! ! !
C C 1100 2250 98 ! ! !
"""

PROJECT = """
[Adjustment]
adjustment_type                3D
linear_units                   Meters
angle_output_units             DMS
local_or_grid_adjustment       {grid}
coordinate_system_name         UTM83-19
coordinate_order               EN
index_of_refraction            0.0700000000
geoid_height                   0.000000
[Instrument]
distance_std_err               0.0010000000
edm_ppm                        1.5000000000
angle_std_err                  1.4140000000
direction_std_err              1.0000000000
azimuth_std_err                1.4140000000
zenith_std_err                 6.0000000000
instrument_centering_error     {centring}
target_centering_error         {centring}
vertical_centering_error       {vertical}
level_section_type             LENGTH
level_std_err                  0.000047434164903
[InstrumentLibrary]
instrument_name                S9
distance_std_err               0.0008000000
edm_ppm                        1.0000000000
zenith_std_err                 0.5000000000
[DataFileList]
1 "job.dat"
0 "other.dat"
"""


def line(text: str):
    """A line with data."""
    found = data_line(text, HERE, "job.dat", 1)
    assert found is not None
    return found


def survey(tmp_path: Path, text: str, project: str = "") -> Survey:
    """The survey of a data file, with a project beside it or not."""
    path = tmp_path / "job.dat"
    path.write_text(text)
    if project:
        (tmp_path / "job.snproj").write_text(project)
    return observed_part(read(path))


def project(grid: int = 0, centring: float = 0.0, vertical: float = 0.0) -> str:
    """A project file."""
    return PROJECT.format(grid=grid, centring=centring, vertical=vertical)


def solved(tmp_path: Path, text: str, settings: str = "") -> Adjustment:
    return adjust(survey(tmp_path, text, settings).network())


def place(adjustment: Adjustment, name: str) -> np.ndarray:
    return adjustment.state.points[adjustment.layout.index("point", name)]


def refusal(tmp_path: Path, text: str, settings: str = "") -> str:
    with pytest.raises(InputError) as caught:
        survey(tmp_path, text, settings)
    return str(caught.value)


# Words.

WORDS = (
    *("A-B", "A-B-C", "A", "12-30-10", "100", "0.01", "!", "*", "&", "1.5/1.6", "?", "x", "-5"),
    *("1/2/3", "N10E", "nan", "1e400"),
)


@given(strategies.floats(-6.28, 6.28), strategies.integers(0, 6))
def test_angles_in_degrees_are_read_as_they_are_written(angle, digits):
    text = format_angle(angle, "dms", digits)
    assert angle_of(text, "it", line("A x")) == pytest.approx(angle, abs=0.51 * 10.0**-digits * SEC)


@given(strategies.integers(0, 359), strategies.integers(0, 59), strategies.integers(0, 5999))
def test_packed_angles_are_the_same_as_others(degrees, minutes, hundredths):
    seconds = f"{hundredths / 100:05.2f}"
    packed = f"{degrees}.{minutes:02d}{seconds.replace('.', '')}"
    dashed = f"{degrees}-{minutes}-{seconds}"
    there = line("A x")
    assert angle_of(packed, "it", there) == pytest.approx(angle_of(dashed, "it", there), abs=1e-13)


@given(strategies.floats(0, 89.99), strategies.sampled_from(["NE", "SE", "SW", "NW"]))
def test_quadrants_are_azimuths(degrees, quadrant):
    text = format_angle(np.radians(degrees), "dms", 4)
    azimuth = azimuth_of(quadrant[0] + text + quadrant[1], "it", line("B x"))
    north, east = 1 - 2 * (quadrant[0] == "S"), 1 - 2 * (quadrant[1] == "W")
    turned = np.radians(degrees)
    there = [np.cos(azimuth), np.sin(azimuth)]
    np.testing.assert_allclose(there, [north * np.cos(turned), east * np.sin(turned)], atol=1e-8)


@given(strategies.text(max_size=60))
def test_any_line_is_read_or_refused_in_a_sentence(tmp_path_factory, text):
    """Nothing but an InputError with its line ever comes out."""
    path = tmp_path_factory.mktemp("any") / "job.dat"
    path.write_text(f"C A 0 0 0 ! ! !\nD A-B 10\n{text}\n", encoding="utf-8")
    with suppress(InputError):
        read(path, format="starnet")


@given(
    strategies.sampled_from(sorted(DATA_TYPES)),
    strategies.lists(
        strategies.sampled_from(
            [
                "A-B",
                "A-B-C",
                "A",
                "12-30-10",
                "100",
                "0.01",
                "!",
                "*",
                "&",
                "1.5/1.6",
                "?",
                "x",
                "-5",
                "1/2/3",
                "N10E",
                "nan",
                "1e400",
            ]
        ),
        max_size=8,
    ),
)
def test_any_words_of_a_data_type_are_read_or_refused(tmp_path_factory, code, words):
    path = tmp_path_factory.mktemp("words") / "job.dat"
    path.write_text(f"{code} {' '.join(words)}\n", encoding="utf-8")
    with suppress(InputError):
        read(path, format="starnet")


def test_every_data_type_has_its_method():
    assert set(CODES) == DATA_TYPES


def test_comments_and_descriptions_are_no_words():
    found = line("M A-B-C 10-20-30 5.5 'the corner # of the wall")
    assert found.words == ("A-B-C", "10-20-30", "5.5")
    assert data_line("   # nothing", HERE, "job.dat", 3) is None


def test_data_are_known_by_their_lines(tmp_path):
    path = tmp_path / "job.txt"
    path.write_text("# a job\n.ORDER EN\nC A 1 2 3\nD A-B 5\n")
    assert format_of(path) == "starnet"
    path.write_text("1 2 3\n4 5 6\n")
    assert not recognised(path)
    path.write_text("# nothing but a comment\n")
    assert not recognised(path)


# Records that mean the same.

SIGHTS = """
D A-P 111.80340
V A-P 92-03-50.1
A A-B-P 36-52-11.6
"""
WHOLE = "M A-B-P 36-52-11.6 111.80340 92-03-50.1\n"
#: to the same point, which is at 1109.93 1980.01 95.97
FURTHER = "DV B-P 150.1969 92-40-53\nDV C-P 270.1771 90-25-47\n"


@pytest.mark.parametrize(
    "text",
    [
        WHOLE,
        "DV A-P 111.80340 92-03-50.1\nA A-B-P 36-52-11.6\n",
        ".ORDER FromAtTo\nM B-A-P 36-52-11.6 111.80340 92-03-50.1\n",
        ".SEP +\nM A+B+P 36-52-11.6 111.80340 92-03-50.1\n.SEP\n",
        "M A B P 36-52-11.6 111.80340 92-03-50.1\n",
        "M A-B-P 36.52116 111.80340 92.03501\n",
        ".UNITS FeetUS\nM A-B-P 36-52-11.6 366.807988333333 92-03-50.1\n.UNITS\n",
        ".MULT 2\nM A-B-P 36-52-11.6 55.9017 92-03-50.1\n.MULT\n",
        ".u gons\nM A-B-P 40.966543209877 111.80340 102.293240740741\n.u\n",
        "M A-B-P -323-07-48.4 111.80340 92-03-50.1\n",
        "M A-B-P 36-52-11.6 111.80340 267-56-09.9\n",
        "TB B\nT A 36-52-11.6 111.80340 92-03-50.1\nTE P\n",
        "TB A B\nT P 36-52-11.6 111.80340 92-03-50.1\nTE P\n",
        "M A-B-P ? 111.80340 92-03-50.1\nA A-B-P 36-52-11.6\n",
        "M A-B-P 36-52-11.6 111.80340 92-03-50.1 & & &\n",
        "M A-B-P 36-52-11.6 111.80340 92-03-50.1 0/0 'described\n",
        ".DATA OFF\nthis is no data\n.DATA ON\n" + WHOLE,
    ],
)
def test_lines_that_mean_the_same(tmp_path, text):
    (tmp_path / "one").mkdir()
    (tmp_path / "other").mkdir()
    one = solved(tmp_path / "one", CONTROL + SIGHTS + FURTHER, project())
    other = solved(tmp_path / "other", CONTROL + text + FURTHER, project())
    assert one.dof == other.dof == 4
    np.testing.assert_allclose(place(other, "P"), place(one, "P"), atol=2e-6)
    np.testing.assert_allclose(other.covariance("P"), one.covariance("P"), rtol=1e-5, atol=1e-12)


def test_horizontal_distances_and_height_differences(tmp_path):
    text = CONTROL + ".DELTA ON\nM A-B-P 36-52-11.6 111.73 -4.02 & & 0.001 1.5/1.7\n"
    found = place(solved(tmp_path, text, project()), "P")
    turned = np.arctan2(200, 100) + np.radians(36 + 52 / 60 + 11.6 / 3600)
    expected = [1000 + 111.73 * np.sin(turned), 2000 + 111.73 * np.cos(turned), 100 - 4.02 - 0.2]
    np.testing.assert_allclose(found, expected, atol=1e-7)


@pytest.mark.parametrize(
    "text", ["M A-B-P 0-00-00 100 60-00-00\n", "D A-P 100\nV A-P 60-00-00\nA A-B-P 0-00-00\n"]
)
def test_a_scale_stretches_what_is_horizontal(tmp_path, text):
    """86.6 m of plan become 86.7; the height stays."""
    start = "C P 1100 2100 150\n"
    found = place(solved(tmp_path, CONTROL + start + ".SCALE 1.001\n" + text, project()), "P")
    # curvature and refraction lower the sight by half a millimetre; without a zenith angle in the
    # line the rise is that of the given coordinates
    length = 1.001 * 100 * np.sin(np.pi / 3)
    near = 1e-3 if text.startswith("M") else 5e-3
    assert np.hypot(*(found[:2] - [1000, 2000])) == pytest.approx(length, abs=near)
    assert found[2] == pytest.approx(150, abs=near)


def test_a_scale_of_horizontal_distances(tmp_path):
    text = ".2D\n.ORDER EN\nC A 0 0 ! !\n.SCALE 0.9996\nB A-P 90-00-00\nD A-P 1000\n"
    found = place(solved(tmp_path, text), "P")
    np.testing.assert_allclose(found[:2], [999.6, 0], atol=1e-6)


def test_sets_of_directions_have_an_orientation_each(tmp_path):
    sets = ""
    for zero in (0.0, 77.5):
        sets += "DB P\n"
        for name, azimuth in (("A", 225.0), ("B", 40.0), ("C", 330.0)):
            sets += f"DN {name} {format_angle(np.radians((azimuth - zero) % 360), 'dms', 2)}\n"
        sets += "DE\n"
    adjustment = solved(tmp_path, CONTROL + ".2D\n" + sets + "C P 1100 2100\n")
    assert len(adjustment.layout.names["scalar"]) == 2
    assert adjustment.dof == 6 - 2 - 2


def test_bearings_of_a_map(tmp_path):
    text = ".2D\n.ORDER EN\nC A 0 0 ! !\n.MAP ON\nTB\nT A N45-00-00E 100\nT P S45-00-00E 50\nTE Q\n"
    adjustment = solved(tmp_path, text + ".MAP OFF\nD A-Q 111.8033989 0.01\n")
    root = 2**0.5
    np.testing.assert_allclose(place(adjustment, "P")[:2], [100 / root, 100 / root], atol=1e-5)
    np.testing.assert_allclose(place(adjustment, "Q")[:2], [150 / root, 50 / root], atol=1e-5)


def test_fixed_free_and_default_standard_errors(tmp_path):
    fixed = "DV A-P 111.8 92-03-50 ! !\nA A-B-P 36-52-11.6 0.001\n"
    text = CONTROL + fixed + "DV B-P 115 89-30-00 * *\n"
    found = survey(tmp_path, text, project())
    tables = {(t.kind.kind, t.hard): t for t in found.tables()}
    assert ("slope_distance", True) in tables
    adjustment = adjust(found.network())
    assert adjustment.dof == 0
    distance = np.linalg.norm(place(adjustment, "P") - [1000, 2000, 100])
    assert distance == pytest.approx(111.8, abs=1e-9)


def test_coordinates_one_by_one(tmp_path):
    """Held, weighted and free components of one point."""
    text = """
.ORDER EN
C A 1000 2000 100 ! ! !
C P 1100.00 2000.02 101 ! 0.02 *
D A-P 100.00
B A-P 90-00-00 2
V A-P 90-00-00 2
"""
    adjustment = solved(tmp_path, text, project())
    found = place(adjustment, "P")
    assert found[0] == 1100.0
    assert adjustment.dof == 2
    assert 2000 < found[1] < 2000.02
    assert adjustment.covariance("P")[0, 0] == 0


def test_levels_are_weighted_by_their_length(tmp_path):
    """0.0015 m for a kilometre: twice the length has half the weight."""
    text = "E A 100 !\nL A-B 1.000 100\nL A-B 1.003 200\nL A-B 1.000 50 0.001\n"
    found = survey(tmp_path, text, project())
    table = next(t for t in found.tables() if t.kind.kind == "height_difference")
    sigma = np.sqrt(table.columns["covariance"][:, 0, 0])
    np.testing.assert_allclose(sigma, [0.0015 * 0.1**0.5, 0.0015 * 0.2**0.5, 0.001], rtol=1e-6)


# Standard errors.


@pytest.mark.parametrize(
    ("slope", "zenith", "expected"),
    [(100, 90, 15.77), (97.5, 89, 16.12), (80, 82, 19.02), (60, 74, 24.12), (50, 70, 28.06)],
)
def test_zenith_angles_grow_by_centring_as_the_program_prints(tmp_path, slope, zenith, expected):
    """Figures of a listing: zenith angles of 6 arcsec, heights of 5 mm at both ends."""
    text = CONTROL + f"DV A-P {slope} {zenith}-00-00\nB A-P 10-00-00\n"
    found = survey(tmp_path, text, project(vertical=0.005))
    table = next(t for t in found.tables() if t.kind.kind == "zenith")
    sigma = np.sqrt(table.columns["covariance"][0, 0, 0]) / SEC
    assert sigma == pytest.approx(expected, abs=0.006)


def test_centring_of_angles_by_the_triangle(tmp_path):
    """At a right angle the third side is the hypotenuse; by Monte Carlo over the three marks."""
    text = ".2D\n.ORDER EN\nC A 0 0\nC B 0 100 ! !\nC C 60 0 ! !\nA A-B-C 90-00-00\nD A-B 100\n"
    centring = 0.002
    found = survey(tmp_path, text, project(centring=centring).replace("3D", "2D", 1))
    table = next(t for t in found.tables() if t.kind.kind == "angle")
    sigma = np.sqrt(table.columns["covariance"][0, 0, 0])
    generator = np.random.default_rng(1)
    marks = np.array([[0, 0], [0, 100.0], [60.0, 0]])
    there = marks + generator.normal(0, centring, (40000, 3, 2))
    back, fore = there[:, 1] - there[:, 0], there[:, 2] - there[:, 0]
    turned = np.arctan2(fore[:, 0], fore[:, 1]) - np.arctan2(back[:, 0], back[:, 1])
    spread = np.hypot(np.std(turned), 1.414 * SEC)
    assert sigma == pytest.approx(spread, rel=0.015)


def test_explicit_standard_errors_are_taken_as_they_are(tmp_path):
    text = CONTROL + "DV A-P 50 90-00-00 0.004 5\n.ADDC ON\nDV A-P 50 90-00-00 0.004 5\n"
    found = survey(tmp_path, text + "B A-P 10-00-00\n", project(centring=0.003))
    table = next(t for t in found.tables() if t.kind.kind == "slope_distance")
    sigma = np.sqrt(table.columns["covariance"][:, 0, 0])
    np.testing.assert_allclose(sigma, [0.004, np.hypot(0.004, 0.003 * 2**0.5)], rtol=1e-9)


def test_constant_and_ppm_are_added_or_propagated(tmp_path):
    text = CONTROL + "D A-P 2000\n.EDM PROPAGATED\nD A-P 2000\n.INST S9\nD A-P 2000\n"
    found = survey(tmp_path, text + "V A-P 90-00-00\nB A-P 10-00-00\n", project())
    table = next(t for t in found.tables() if t.kind.kind == "slope_distance")
    sigma = np.sqrt(table.columns["covariance"][:, 0, 0])
    expected = [0.004, np.hypot(0.001, 0.003), np.hypot(0.0008, 0.002)]
    np.testing.assert_allclose(sigma, expected, rtol=1e-9)


# Grids.


def test_a_grid_job_agrees_with_its_projection(tmp_path):
    """A bearing, a distance and a zenith angle between points that PROJ places."""
    to_grid = Transformer.from_crs("EPSG:4269", "EPSG:26919", always_xy=True)
    geodetic = np.array([[-66.64, 45.95, 40.0], [-66.60, 45.96, 90.0]])
    east, north = to_grid.transform(*geodetic[:, :2].T)
    radians = np.radians(geodetic[:, :2])
    ecef = ecef_from_geodetic(radians[:, 1], radians[:, 0], geodetic[:, 2])
    slope = float(np.linalg.norm(ecef[1] - ecef[0]))
    bearing = np.arctan2(east[1] - east[0], north[1] - north[0])
    zenith = zenith_angle(ecef, radians[0], slope, 0.14)
    text = f"""
C A {east[0]:.6f} {north[0]:.6f} 40 ! ! !
C P {east[1] + 1:.3f} {north[1] - 1:.3f} 91
B A-P {format_angle(bearing, "dms", 6)}
DV A-P {slope:.6f} {format_angle(zenith, "dms", 6)}
"""
    adjustment = solved(tmp_path, text, project(grid=1))
    grid = adjustment.network.reference.grid
    found = grid.from_work(place(adjustment, "P")[None])[0]
    np.testing.assert_allclose(found, [east[1], north[1], 90.0], atol=1e-4)


def test_the_deflection_of_a_grid_job_leans_its_plumb_lines(tmp_path):
    """Angles along a zenith 30" south and 10" west of the normal; bearings and levels know none.

    Positive are north and east (STAR*NET reference manual, tutorial on a grid job).
    """
    north, east = np.radians(np.array([-30.0, -10.0]) / 3600)
    to_grid = Transformer.from_crs("EPSG:4269", "EPSG:26919", always_xy=True)
    geodetic = np.array([[-66.64, 45.95, 40.0], [-66.63, 45.955, 90.0], [-66.638, 45.951, 190.0]])
    grid = np.column_stack([*to_grid.transform(*geodetic[:, :2].T), geodetic[:, 2]])
    radians = np.radians(geodetic[:, :2])
    ecef = ecef_from_geodetic(radians[:, 1], radians[:, 0], geodetic[:, 2])
    longitude, latitude = radians[0]
    zenith_at = np.array([longitude + east / np.cos(latitude), latitude + north])
    slopes = np.linalg.norm(ecef - ecef[0], axis=1)
    axes = enu_rotation(zenith_at[1], zenith_at[0]) @ (ecef - ecef[0]).T
    turned = np.arctan2(axes[0, 2], axes[1, 2]) - np.arctan2(axes[0, 1], axes[1, 1])
    leaning = [
        format_angle(zenith_angle(ecef[[0, k]], zenith_at, slopes[k], 0.14), "dms", 6)
        for k in (1, 2)
    ]
    bearing = format_angle(np.arctan2(*(grid[1, :2] - grid[0, :2])), "dms", 6)
    text = f"""
C A {grid[0, 0]:.6f} {grid[0, 1]:.6f} 40 ! ! !
C P {grid[1, 0] + 1:.3f} {grid[1, 1] - 1:.3f} 91
C Q {grid[2, 0] + 1:.3f} {grid[2, 1] - 1:.3f} 191
B A-P {bearing}
A A-P-Q {format_angle(float(turned), "dms", 6)}
DV A-P {slopes[1]:.6f} {leaning[0]}
DV A-Q {slopes[2]:.6f} {leaning[1]}
L A-P 50.0 1
"""
    settings = project(grid=1).replace(
        "geoid_height ", "vert_defl_north -30.0\nvert_defl_east -10.0\ngeoid_height "
    )
    adjustment = solved(tmp_path, text, settings)
    assert adjustment.sigma0_posterior < 0.1
    known = adjustment.network.reference.grid
    for k, name in enumerate("PQ", start=1):
        found = known.from_work(place(adjustment, name)[None])[0]
        np.testing.assert_allclose(found, grid[k], atol=2e-4)
    # without it the level and the zenith angle contradict each other
    assert solved(tmp_path, text, project(grid=1)).sigma0_posterior > 2


def zenith_angle(ecef: np.ndarray, place: np.ndarray, slope: float, k: float) -> float:
    """Zenith angle from the first to the second point, bent by refraction."""
    longitude, latitude = place
    up = [np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude)]
    up = np.array([*up, np.sin(latitude)])
    radius = 6378137.0 * np.sqrt(1 - 0.00669438) / (1 - 0.00669438 * np.sin(latitude) ** 2)
    return float(np.arccos(up @ (ecef[1] - ecef[0]) / slope) - k * slope / (2 * radius))


def test_vectors_stretched_in_plan_and_height(tmp_path):
    """Along the axes of the place factors multiply standard errors by themselves."""
    text = """
C A 682000 5090000 40 ! ! !
C P 682500 5090400 60
.GPS WEIGHT COVARIANCE
.GPS FACTOR 2 VERT 3
G0 'first
G1 A-P 400 300 200
G2 1E-6 1E-6 1E-6
G3 0 0 0
.GPS FACTOR 1
.GPS WEIGHT STDERRCORRELATIONS
.GPS CENTERING 0.001
G1 A-P 400 300 200
G2 0.002 0.002 0.002
G3 0 0 0
"""
    found = survey(tmp_path, text, project(grid=1))
    table = next(t for t in found.tables() if t.kind.kind == "gnss_baseline")
    here = found.points["A"].xyz
    axes = found.site.axes(here[None])[0]
    first, second = (axes @ matrix @ axes.T for matrix in table.columns["covariance"])
    np.testing.assert_allclose(first, np.diag([4e-6, 4e-6, 9e-6]), atol=1e-12)
    np.testing.assert_allclose(second, np.eye(3) * 6e-6, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("UTM83-19", "EPSG:26919"),
        ("utm84-32", "EPSG:32632"),
        ("NewBrunswick83", "EPSG:2953"),
        ("MTM83-7", "EPSG:32187"),
        ("EPSG:25832", "EPSG:25832"),
        ("EPSG:4326", None),
        ("Elsewhere27", None),
    ],
)
def test_names_of_grids(name, expected):
    assert grid_of(name) == expected


# Files.


def test_a_project_brings_the_files_that_are_checked(tmp_path):
    (tmp_path / "job.dat").write_text(CONTROL + SIGHTS)
    (tmp_path / "other.dat").write_text("this is no data\n")
    path = tmp_path / "work.snproj"
    path.write_text(project())
    alone = read(path)
    beside = read(tmp_path / "job.dat")
    assert len(alone.tables()) == len(beside.tables()) == 3
    assert any("work.snproj" in warning for warning in beside.warnings)
    assert not any("work.snproj" in warning for warning in alone.warnings)
    assert read_settings(path).instruments["S9"].zenith == pytest.approx(0.5 * SEC)


def test_a_listing_beside_takes_the_place_of_the_project(tmp_path):
    heading = """
                   Summary of Files Used and Option Settings
                   =========================================
      STAR*NET Run Mode                   : Adjust with Error Propagation
      Type of Adjustment                  : 3D
      Project Units                       : FeetUS; DMS
      Coordinate System                   : LOCAL
      Input/Output Coordinate Order       : East-North

      Project Default Instrument
        Distances (Constant)              :    0.010000 FeetUS
        Distances (PPM)                   :    2.000000
        Zeniths                           :    7.000000 Seconds
        Centering Error Vertical          :    0.001000 FeetUS

                    Summary of Unadjusted Input Observations
        Distances (Constant)              :    9.000000 FeetUS
"""
    (tmp_path / "job.lst").write_text(heading)
    settings = read_settings(tmp_path / "job.lst")
    foot = 1200 / 3937
    assert settings.unit == pytest.approx(foot)
    assert settings.east_first
    assert settings.grid is None
    assert settings.default.distance == pytest.approx(0.01 * foot)
    assert settings.default.vertical == pytest.approx(0.001 * foot)
    assert settings.default.zenith == pytest.approx(7 * SEC)
    found = survey(tmp_path, "C A 1000 2000 100 ! ! !\nDV A-P 100 90-00-00\n")
    np.testing.assert_allclose(found.points["A"].xyz, np.array([1000, 2000, 100]) * foot)
    assert any("job.lst" in warning for warning in found.warnings)


def test_standard_errors_that_nobody_gave_are_told(tmp_path):
    found = survey(tmp_path, CONTROL + SIGHTS)
    assert any("There is no project file" in warning for warning in found.warnings)
    quiet = survey(tmp_path, CONTROL + "D A-P 5 0.01\nV A-P 90-00-00 5\nB A-P 10-00-00 5\n")
    assert not any("There is no project file" in warning for warning in quiet.warnings)


def test_included_files_stay_in_the_folder(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "more.dat").write_text(SIGHTS)
    found = survey(tmp_path, CONTROL + ".INCLUDE parts\\more.dat\n")
    assert len(found.tables()) == 3
    assert found.tables()[0].columns["source"][0].startswith("parts/more.dat:")
    (tmp_path / "outside.dat").write_text(SIGHTS)
    (tmp_path / "in").mkdir()
    sentence = refusal(tmp_path / "in", CONTROL + ".INCLUDE ../outside.dat\n" + SIGHTS)
    assert "outside the folder of the data" in sentence
    (tmp_path / "in" / "job.dat").write_text(".INCLUDE job.dat\n")
    with pytest.raises(InputError, match="file inside a file"):
        read(tmp_path / "in" / "job.dat")


def test_all_refusals_are_told_at_once(tmp_path):
    text = (
        CONTROL
        + """
D A-B ten
A A-B-C 12-61-10
X A-B 5
V A-C 90-00-00 0
.INST NONE
DN B 10-00-00
M A-B-P 10-00-00
D A-A 5
B A-B N95-00-00E
.PRISM 0.03
"""
    )
    path = tmp_path / "job.dat"
    path.write_text(text)
    with pytest.raises(Refusals) as caught:
        read(path)
    lines = [error.line for error in caught.value.errors]
    assert lines == list(range(7, 17))
    assert caught.value.count == 10


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("D A-B-C 5\n", "names 3 stations instead of 2"),
        ("C P 1\n", "has 1 coordinates instead of 3"),
        ("D A-B 5 0.01 0.02\n", "2 standard errors for 1 observation"),
        ("D A-B -5\n", "give it above zero"),
        ("A A-B-C 500-00-00\n", "beyond the circle"),
        ("L A-B 1.5\n", "neither length nor turns"),
        ("G2 1 1 1\n", "there is no vector"),
        ("G1 A-B 1 2 3\n", "the place of the job on the ellipsoid"),
        ("P Q 45-00-00 66-00-00 10\nD A-Q 5\n", "the job is local"),
        ("DB A\nDN B 0-00-00\n", "does not end"),
        ("TB A\nT B 0-00-00 10 90-00-00\n", "does not end"),
        (".UNITS furlongs\n", "the unit FURLONGS is not known"),
        ("DB A\nDM B\nDM C\nDE\n", "have no values: they are planned"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, text, sentence):
    assert sentence in refusal(tmp_path, CONTROL + text)


def test_a_missing_instrument_is_told_once(tmp_path):
    sentence = refusal(tmp_path, CONTROL + ".INST SX12\n" * 50 + SIGHTS)
    assert sentence.count("there is no instrument SX12") == 1
    assert "give the project file with the data" in sentence


def test_a_grid_that_is_not_known_is_refused_with_a_cure(tmp_path):
    text = project(grid=1).replace("UTM83-19", "TX83-4204")
    assert "write its EPSG code" in refusal(tmp_path, CONTROL + SIGHTS, text)


def test_a_point_written_twice_is_told(tmp_path):
    found = survey(tmp_path, CONTROL + SIGHTS + "C A 1000 2000.5 100 ! ! !\n")
    assert any("other coordinates than at" in warning for warning in found.warnings)
    assert found.points["A"].xyz[1] == 2000.5


def test_heights_that_nothing_tells_are_held_and_told(tmp_path):
    found = survey(tmp_path, CONTROL + "C P 1100 2100 101\nD A-P 141.43 0.01\nD B-P 100 0.01\n")
    assert any("No zenith angle, level or vector" in warning for warning in found.warnings)
    adjustment = adjust(found.network())
    assert place(adjustment, "P")[2] == 101
