"""The sigma of the geoid in the covariances of heights."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

from tests.geodesy.test_geoid_grid import write_gtx
from tribrach.errors import InputError
from tribrach.job.opened import open_job
from tribrach.network.adjustment import adjust
from tribrach.observations.control import Coordinates
from tribrach.project import Project
from tribrach.sentences import PLAIN

POINTS = """\
point,easting_m,northing_m,height_m,sigma_e_mm,sigma_n_mm,sigma_u_mm
A,456000,4191000,1000,2,2,3
B,466000,4191000,1010,2,2,3
C,456000,4201000,1020,2,2,3
P,461000,4196000,1005,2,2,5000
"""
#: a line of levels from A over P to B, and to C
LEVELS = """\
from,to,height_difference_m,sigma_mm
A,P,5.0,2
P,B,5.0,2
P,C,15.0,2
"""


def project(folder: Path, site: str) -> Path:
    """Three heights over a geoid, ten kilometres apart, and one that is levelled between them."""
    write_gtx(folder / "g.gtx", 0.5, -0.5)
    write_gtx(folder / "s.gtx", 0.0, 0.0)
    (folder / "points.csv").write_text(POINTS)
    (folder / "levels.csv").write_text(LEVELS)
    path = folder / "job.toml"
    path.write_text(
        f'title = "Levels"\n[site]\ncrs = "EPSG:32636"\n{site}\n'
        "[instruments.level]\nlevelling_mm_per_sqrt_km = 1.0\n"
        '[[points]]\nfile = "points.csv"\n'
        '[[observations]]\nfile = "levels.csv"\ninstrument = "level"\n'
    )
    return path


def heights(path: Path) -> np.ndarray:
    """The covariance (3, 3) of given heights [m^2] along their verticals."""
    survey = open_job(Project.load(path)).survey
    (joint,) = survey.network().joint
    x = np.array([survey.points[name].xyz for name in "ABC"])
    up = survey.site.axes(x)[:, 2]
    turn = np.zeros((3, 12))
    for k in range(3):
        turn[k, 3 * k : 3 * k + 3] = up[k]
    return turn @ joint.covariance @ turn.T


def test_neighbours_share_the_error_of_the_geoid(tmp_path: Path) -> None:
    site = 'geoid_grid = "g.gtx"\ngeoid_sigma_mm = 20\ngeoid_correlation_km = 25'
    found = 1e6 * heights(project(tmp_path, site))
    apart = np.array([[0, 10, 10], [10, 0, 10 * np.sqrt(2)], [10, 10 * np.sqrt(2), 0]])
    expected = 400 * np.exp(-apart / 25) + 9 * np.eye(3)
    np.testing.assert_allclose(found, expected, rtol=1e-3)


def test_a_grid_of_sigmas_and_one_geoid_height(tmp_path: Path) -> None:
    # 36 m everywhere is no sigma that anybody states, and easy to see
    site = 'geoid_height_m = 30\ngeoid_sigma_grid = "s.gtx"\ngeoid_correlation_km = 1e9'
    found = heights(project(tmp_path, site))
    np.testing.assert_allclose(found, np.full((3, 3), 36.0**2), rtol=1e-4)


@pytest.mark.parametrize("surveys", [150, pytest.param(400, marks=pytest.mark.slow)])
def test_heights_hold_their_stated_interval(tmp_path: Path, surveys: int) -> None:
    """Surveys whose heights have the error of the geoid: 95 % hold the true height."""
    site = 'geoid_grid = "g.gtx"\ngeoid_sigma_mm = 20\ngeoid_correlation_km = 25'
    survey = open_job(Project.load(project(tmp_path, site))).survey
    tables = survey.tables()
    (control,) = [t for t in tables if t.kind is Coordinates]
    network = survey.network()
    (joint,) = network.joint
    truth = adjust(network)
    rng = np.random.default_rng(7)
    root = np.linalg.cholesky(joint.covariance)
    true = {name: truth.points[name].xyz for name in "PABC"}
    up = survey.site.axes(np.array([true["P"]]))[0, 2]
    levels = next(t for t in tables if t is not control)
    given, read = control.columns["values"], levels.columns["values"]
    # values that fit the adjusted places without error
    exact = np.array([true[str(name)] for name in control.columns["position"]])
    inside = 0
    base = read.copy()
    fitted = {(r.start, r.end): r.value + r.residual for r in truth.results().observations}
    ends = zip(levels.columns["start"], levels.columns["end"], strict=True)
    base[:, 0] = [fitted[str(a), str(b)] for a, b in ends]
    for _ in range(surveys):
        given[:] = exact + (root @ rng.normal(size=12)).reshape(4, 3)
        read[:] = base + rng.normal(size=base.shape) * np.sqrt(levels.columns["covariance"][:, 0])
        place = adjust(survey.network()).points["P"]
        error = up @ (place.xyz - true["P"])
        inside += abs(error) <= 1.96 * np.sqrt(up @ place.covariance @ up)
    low, high = binom.interval(0.999, surveys, 0.95)
    assert low <= inside <= high
    # most of it is the geoid's: without it the interval would be a fifth as wide
    assert np.sqrt(up @ place.covariance @ up) > 0.012


def test_the_error_budget_has_it_and_the_report_says_it(tmp_path: Path) -> None:
    from tribrach.questions.adjust.adjusted import adjust_job

    site = 'geoid_grid = "g.gtx"\ngeoid_sigma_mm = 20'
    content = adjust_job(open_job(Project.load(project(tmp_path, site))))
    chapter = content.chapter("georeferencing")
    assert chapter is not None
    assert any("20 mm" in PLAIN.words(sentence) for sentence in chapter.sentences)


@pytest.mark.parametrize(
    ("site", "what"),
    [
        ("geoid_sigma_mm = 20", "needs geoid_grid or geoid_height_m"),
        ('geoid_height_m = 3\ngeoid_sigma_mm = 2\ngeoid_sigma_grid = "s.gtx"', "either geoid_s"),
        ('geoid_height_m = 3\ngeoid_sigma_grid = "no.gtx"', "not there"),
        ("geoid_height_m = 3\ngeoid_sigma_mm = -2", "geoid_sigma_mm"),
    ],
)
def test_what_makes_no_sense_is_refused(site: str, what: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=what):
        open_job(Project.load(project(tmp_path, site)))


def test_the_grid_that_a_system_asks_for_is_named(tmp_path: Path) -> None:
    path = project(tmp_path, "")
    path.write_text(path.read_text().replace("EPSG:32636", "EPSG:25832+7837"))
    with pytest.raises(InputError, match=r"de_bkg_gcg2016\.tif"):
        open_job(Project.load(path))
