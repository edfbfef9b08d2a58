"""STAR*NET jobs against the listings of the program, and the small files of its imitator."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from tribrach.io.survey.formats import format_of, read
from tribrach.job.opened import open_job
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.facts import facts_of
from tribrach.network.roles import datum_sentence
from tribrach.network.side_shots import SideShots, compute
from tribrach.network.survey import observed_part
from tribrach.questions.plan.design import plan_project

pytestmark = pytest.mark.data

#: the listing of the job of vectors was made with these factors at two vectors; in the data file
#: that lies beside it they have been set to 1 since
FACTORS_OF_THE_LISTING = {19: ".GPS FACTOR 1.2 VERT 1", 24: ".GPS FACTOR 1.2 VERT 1"}


@pytest.fixture(scope="module")
def folder(shared_data) -> Path:
    """Where the jobs are."""
    return shared_data / "networks" / "starnet"


def table(folder: Path, name: str, title: str, numbers: int) -> dict[str, list[float]]:
    """Rows of a table of a listing: a name and so many numbers."""
    lines = (folder / name).read_text(encoding="latin-1").splitlines()
    first = next(k for k, line in enumerate(lines) if line.strip().startswith(title))
    rows: dict[str, list[float]] = {}
    for line in lines[first + 1 :]:
        words = line.split()
        try:
            row = [float(word) for word in words[1 : numbers + 1]]
        except ValueError:
            row = []
        if len(row) == numbers:
            rows[words[0]] = row
        elif rows:
            return rows
    return rows


def check(adjustment: Adjustment, folder: Path, listing: str, mm: float, percent: float) -> None:
    """Coordinates and sigmas in the grid against those of a listing."""
    places = table(folder, listing, "Adjusted Coordinates (Meters)", 3)
    sigmas = table(folder, listing, "Station Coordinate Standard Deviations (Meters)", 3)
    grid, layout = adjustment.network.reference.grid, adjustment.layout
    assert set(places) == set(sigmas) == set(layout.names["point"])
    assert grid is not None
    for name, (north, east, height) in places.items():
        x = adjustment.state.points[layout.index("point", name)]
        found = grid.from_work(x[None])[0]
        np.testing.assert_allclose(found, [east, north, height], atol=mm * 1e-3, err_msg=name)
        if sigmas[name][0] > 0:
            jacobian = grid.jacobian(x)
            matrix = jacobian @ adjustment.covariance(name) @ jacobian.T
            got = np.sqrt(np.diag(matrix))[[1, 0, 2]]
            np.testing.assert_allclose(got, sigmas[name], rtol=percent / 100, err_msg=name)


def test_campus_survey_of_everything(folder):
    """506 directions, distances and zenith angles, 60 levelled lines, 12 vectors, EPSG:2953."""
    names = [f"industry_case_combined_{what}put.txt" for what in ("in", "out")]
    survey = read([folder / name for name in names])
    assert survey.reference.crs == "EPSG:2953"
    adjustment = adjust(observed_part(survey).network())
    assert adjustment.n_unknowns == 313
    assert adjustment.dof == 1302
    assert round(adjustment.sigma0_posterior, 3) == 0.980
    assert adjustment.iterations <= 6
    check(adjustment, folder, names[1], 0.1, 0.2)


def test_side_shots_of_the_campus_survey(folder):
    """13 shots to a chimney and a meridian mark, which take no part in the network."""
    names = [f"industry_case_combined_{what}put.txt" for what in ("in", "out")]
    adjustment = adjust(observed_part(read([folder / name for name in names])).network())
    computed, left_out = compute(adjustment, *facts_of(adjustment.network.facts, SideShots))
    assert not left_out
    grid = adjustment.network.reference.grid
    assert grid is not None
    found = [(shot.name, *grid.from_work(shot.xyz[None])[0]) for shot in computed]
    lines = (folder / names[1]).read_text(encoding="latin-1").splitlines()
    first = next(k for k, line in enumerate(lines) if "Sideshot Coordinates Computed" in line)
    rows = [line.split() for line in lines[first : first + 30]]
    listed = [row for row in rows if row[:1] in (["Chimney"], ["Meridian"])]
    assert len(listed) == len(found) == 13
    for (name, east, north, height), row in zip(found, listed, strict=True):
        assert name == row[0]
        expected = [float(word) for word in row[1:4]]
        np.testing.assert_allclose([north, east, height], expected, atol=1e-4)


def test_campus_survey_of_vectors_alone(folder, tmp_path):
    """With the factors that the listing was made with: 1.225, coordinates to 0.1 mm."""
    lines = (folder / "industry_case_gnss_input.txt").read_text().splitlines()
    for number, text in FACTORS_OF_THE_LISTING.items():
        assert lines[number - 1] == ".GPS FACTOR 1 VERT 1"
        lines[number - 1] = text
    data = tmp_path / "vectors.gps"
    data.write_text("\n".join(lines))
    listing = "industry_case_gnss_output.txt"
    adjustment = adjust(read([data, folder / listing]).network())
    assert adjustment.dof == 27
    assert adjustment.sigma0_posterior == pytest.approx(1.225, abs=1.2e-3)
    check(adjustment, folder, listing, 0.1, 0.2)


def test_campus_survey_of_vectors_as_it_was_kept(folder):
    """Two vectors weigh 1.2 times more than in the listing: 1.230, plan within 0.13 mm."""
    names = [f"industry_case_gnss_{what}put.txt" for what in ("in", "out")]
    adjustment = adjust(read([folder / name for name in names]).network())
    assert round(adjustment.sigma0_posterior, 3) == 1.230
    check(adjustment, folder, names[1], 0.13, 10)


def test_campus_survey_of_levels_alone(folder):
    names = [f"industry_case_leveling_{what}put.txt" for what in ("in", "out")]
    adjustment = adjust(observed_part(read([folder / name for name in names])).network())
    assert (adjustment.n_unknowns, adjustment.dof) == (11, 49)
    assert round(adjustment.sigma0_posterior, 3) == 0.905
    rows = table(folder, names[1], "Adjusted Elevations and Error Propagation", 2)
    assert len(rows) == 12
    assert datum_sentence(adjustment) == "Control: OOP held without error."
    for name, (height, sigma) in rows.items():
        index = adjustment.layout.index("point", name)
        assert adjustment.state.points[index, 2] == pytest.approx(height, abs=0.6e-4)
        got = np.sqrt(adjustment.covariance(name)[2, 2])
        assert got == pytest.approx(sigma, abs=0.6e-6)


def planned_as_listed(folder: Path, listing: str) -> str:
    """The data of a pre-analysis: given points, and the sets of directions that the listing has.

    The data file that lies beside it has further sets and levels, which came to it afterwards.
    """
    data = (folder / "camp_design_preanalysis_input.dat").read_text().splitlines()
    lines = [line for line in data if line.split()[:1] in (["C"], ["B"])]
    printed = (folder / listing).read_text(encoding="latin-1").splitlines()
    first = next(k for k, line in enumerate(printed) if "Measured Direction Obs" in line)
    for line in printed[first + 3 :]:
        words = line.split()
        if words[:1] == ["Number"]:
            break
        if words[:1] == ["Set"]:
            lines.append("DE")
            opened = False
        elif len(words) == 5:
            lines += [] if opened else [f"DB {words[0]}"]
            lines.append(f"DM {words[1]}")
            opened = True
    first = lines.index("DE")
    return "\n".join([*lines[:first], *lines[first + 1 :], "DE"])


def test_pre_analysis(folder, tmp_path):
    """Sigmas and ellipses of 43 points that nobody has measured yet, by ``[plan]``."""
    listing = "camp_design_preanalysis_output.lst"
    (tmp_path / "camp.dat").write_text(planned_as_listed(folder, listing))
    shutil.copy(folder / "camp_design_preanalysis.snproj", tmp_path / "camp.snproj")
    (tmp_path / "camp.toml").write_text('[plan]\nobservations = ["camp.dat"]\n')
    job = open_job(tmp_path / "camp.toml")
    adjustment = plan_project(job).adjustment
    counts = {o.kind: len(o) for o in adjustment.network.observations}
    assert counts["direction"] == counts["slope_distance"] == counts["zenith"] == 244
    sigmas = table(folder, listing, "Station Coordinate Standard Deviations (Meters)", 3)
    ellipses = table(folder, listing, "Station Coordinate Error Ellipses (Meters)", 2)
    grid, layout = job.network().reference.grid, adjustment.layout
    assert len(sigmas) == 45
    for name, values in sigmas.items():
        if name == "FRDN":  # held, and observed by nothing
            continue
        jacobian = grid.jacobian(adjustment.state.points[layout.index("point", name)])
        matrix = jacobian @ adjustment.covariance(name) @ jacobian.T
        got = np.sqrt(np.maximum(np.diag(matrix), 0))
        np.testing.assert_allclose(got, values, rtol=2e-3, atol=0.6e-6, err_msg=name)
        axes = np.sqrt(np.linalg.eigvalsh(matrix[:2, :2])[::-1] * 5.991465)
        np.testing.assert_allclose(axes, ellipses[name], rtol=2e-3, err_msg=name)


#: redundancy of each small file: values less coordinates and orientations
SMALL = {
    "ts_a_angles": 2,
    "ts_b_bearings": 2,
    "ts_bm_bearing_measurements": 6,
    "ts_d_distances": 2,
    "ts_direction_sets_db_dn_dm_de": 11,
    "ts_dv_distance_vertical": 5,
    "ts_m_measurements": 6,
    "ts_rotation_plan": 2,
    "ts_sideshots_ss": 1,
    "ts_traverse_tb_t_te": 3,
    "ts_triangulation_trilateration_2d": 18,
    "ts_v_verticals_delta": 3,
}


@pytest.mark.parametrize("name", SMALL)
def test_a_file_of_each_data_type(folder, name):
    """They are told by their lines and adjust, near the coordinates that they give."""
    path = folder / f"{name}.dat"
    assert format_of(path) == "starnet"
    survey = observed_part(read(path))
    adjustment = adjust(survey.network())
    assert adjustment.dof == SMALL[name]
    for point, given in survey.points.items():
        near = adjustment.state.points[adjustment.layout.index("point", point)]
        known = np.isfinite(given.xyz)
        far = 30 if "plan" in name or "2d" in name else 1
        np.testing.assert_allclose(near[known], given.xyz[known], atol=far)


def test_bearings_of_a_plan_are_turned(folder):
    """Every bearing grows by ten degrees: the point is 100 m away at 100 degrees."""
    adjustment = adjust(observed_part(read(folder / "ts_rotation_plan.dat")).network())
    found = adjustment.state.points[adjustment.layout.index("point", "B")]
    turned = np.radians(100)
    expected = [5000 + 100 * np.sin(turned), 5000 + 100 * np.cos(turned)]
    np.testing.assert_allclose(found[:2], expected, atol=1e-6)


def test_height_differences_of_one_point_have_their_mean(folder):
    """Four rises of one sigma to a point that is held in plan."""
    adjustment = adjust(observed_part(read(folder / "ts_v_verticals_delta.dat")).network())
    found = adjustment.state.points[adjustment.layout.index("point", "UH")]
    mean = np.mean([100 + 0.198, 100.5 - 0.307, 99.7 + 0.506, 100 + 0.204])
    np.testing.assert_allclose(found, [5110.8, 5092.4, mean], atol=1e-9)
