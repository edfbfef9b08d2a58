"""The chapter on GNSS: loops of textbook and real networks, sessions from RINEX, files of a run.

Truth: Ghilani 2010 chapter 17 (AC-32), closures added up by hand, DynAdjust's own adjustment, the
published coordinates of a permanent station.
"""

import json
from pathlib import Path

import numpy as np
import pytest
from pyproj import Transformer
from scipy.stats import chi2
from typer.testing import CliRunner

from tests.gnss.test_baseline import minutes
from tests.io.survey.gnss_samples import ADJUSTED, GIVEN, VECTORS, write_csv, write_gvx
from tests.network.networks import trilateration
from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.geodesy.projection import ProjectedGrid
from tribrach.geodesy.site import EllipsoidSite
from tribrach.gnss.engine import engines
from tribrach.job.gnss_loops import baselines_of, loops_of
from tribrach.job.opened import open_job
from tribrach.network.adjustment import adjust
from tribrach.network.network import Datum
from tribrach.report.chapters.gnss import gnss_chapter

RUN = CliRunner()
GHILANI = """
title = "Ghilani, chapter 17"
[site]
frame = "ITRF2014"
epoch = 2010.0
[[points]]
file = "control.csv"
role = "fixed"
[[observations]]
file = "{file}"
"""


def ghilani(folder: Path, file: str) -> Path:
    rows = [f"{name},{x},{y},{z}" for name, (x, y, z) in GIVEN.items()]
    (folder / "control.csv").write_text(
        "\n".join(["point,ecef_x_m,ecef_y_m,ecef_z_m", *rows]) + "\n"
    )
    write_csv(folder / "v.csv")
    write_gvx(folder / "v.gvx")
    (folder / "p.toml").write_text(GHILANI.format(file=file))
    return folder / "p.toml"


@pytest.mark.parametrize("file", ["v.csv", "v.gvx"])
def test_network_of_ghilani_in_a_project(tmp_path: Path, file: str) -> None:
    """AC-32: coordinates, redundancy and sigma0 in ECEF of the project's frame."""
    adjustment = adjust(open_job(ghilani(tmp_path, file)).network())
    site, layout = adjustment.network.site, adjustment.layout
    for name, xyz in ADJUSTED.items():
        x = adjustment.state.points[layout.index("point", name)]
        np.testing.assert_allclose(site.to_ecef(x[None])[0], xyz, atol=1e-4)  # type: ignore[attr-defined]
    assert adjustment.dof == 27
    assert adjustment.sigma0_posterior == pytest.approx(0.7075, abs=5e-4)


def test_closures_of_ghilani_by_hand(tmp_path: Path) -> None:
    adjustment = adjust(open_job(ghilani(tmp_path, "v.csv")).network())
    found = baselines_of(adjustment)
    assert found is not None
    loops = loops_of(found)
    # 13 baselines between 6 points
    assert sum(loop.independent for loop in loops) == 8
    given = {(a, b): np.array(words, dtype=float) for a, b, *words in VECTORS}
    for loop in loops:
        names = [found.names[k] for k in loop.points]
        walk = list(zip(names, [*names[1:], names[0]], strict=True))
        if len(walk) == 2:  # A to F and back by its repetition
            walk = [walk[0], walk[0][::-1]]
        total, covariance = np.zeros(3), np.zeros((3, 3))
        for a, b in walk:
            sign, row = (1, given[a, b]) if (a, b) in given else (-1, given[b, a])
            total += sign * row[:3]
            covariance += row[3:][[0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(3, 3)
        assert loop.size == pytest.approx(np.linalg.norm(total), abs=1e-9)
        statistic = total @ np.linalg.solve(covariance, total)
        assert loop.statistic == pytest.approx(statistic, rel=1e-6)
        assert loop.passes == (statistic < chi2.ppf(0.95, 3))
    repeated = [loop for loop in loops if len(loop.walk) == 2]
    sums = sorted(loop.size for loop in repeated)
    by_hand = [np.linalg.norm([1e-4, -0.0107, 0.0110]), np.linalg.norm([0.0054, -0.0057, 0.0079])]
    np.testing.assert_allclose(sums, sorted(by_hand), atol=1e-9)


def test_report_of_a_run(tmp_path: Path) -> None:
    result = RUN.invoke(app, ["run", str(ghilani(tmp_path, "v.csv"))])
    assert result.exit_code == 0, result.output
    found = json.loads((tmp_path / "out" / "result.json").read_text())
    for name, xyz in ADJUSTED.items():
        np.testing.assert_allclose(found["points"][name]["ecef"], xyz, atol=1e-4)
        # the same uncertainty in any direction
        traces = [np.trace(found["points"][name][k]) for k in ("covariance", "ecef_covariance")]
        assert traces[0] == pytest.approx(traces[1], rel=1e-9)
    data = found["gnss"]
    assert (data["frame"], data["epoch"]) == ("ITRF2014", 2010.0)
    largest = max(data["loops"], key=lambda loop: loop["size"])
    text = " ".join((tmp_path / "out" / "report.txt").read_text().split())
    assert f"the largest closure is {1e3 * largest['size']:.1f} mm" in text
    assert f"({largest['ppm']:.2f} ppm of" in text
    assert "8 minimal loops" in text
    assert "Coordinates are in ITRF2014 at epoch 2010.00." in text
    page = (tmp_path / "out" / "report.html").read_text()
    assert 'id="gnss-map"' in page
    assert "GNSS loops" in page


def test_projected_coordinates_come_back(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text(
        "point,easting_m,northing_m,height_m,role\nA,512345.678,5401234.567,312.345,fixed\n"
        "B,512845.0,5401734.0,320.0,approximate\n"
    )
    (tmp_path / "v.csv").write_text(
        "from,to,dx_m,dy_m,dz_m,sigma_dx_mm,sigma_dy_mm,sigma_dz_mm\n"
        "A,B,-350.0,520.0,330.0,3,3,3\nB,A,350.001,-520.0,-330.0,3,3,3\n"
    )
    (tmp_path / "p.toml").write_text(
        '[site]\ncrs = "EPSG:25832"\ngeoid_height_m = 48.2\n[[points]]\nfile = "p.csv"\n'
        '[[observations]]\nfile = "v.csv"\n'
    )
    out = tmp_path / "r.json"
    result = RUN.invoke(app, ["adjust", str(tmp_path / "p.toml"), "--json", str(out)])
    assert result.exit_code == 0, result.output
    points = json.loads(out.read_text())["points"]
    np.testing.assert_allclose(points["A"]["projected"], [512345.678, 5401234.567, 312.345])
    # the adjusted vector in ECEF is the mean of both, whatever the projection does
    vector = np.subtract(points["B"]["ecef"], points["A"]["ecef"])
    np.testing.assert_allclose(vector, [-350.0005, 520, 330], atol=1e-6)


def test_a_site_is_centred_on_geographic_points(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text(
        "point,latitude_deg,longitude_deg,height_m,role\nA,37.87,32.5,1020.0,fixed\n"
        "B,37.88,32.52,1030.0,approximate\n"
    )
    (tmp_path / "p.toml").write_text(
        '[site]\nframe = "ITRF96"\nepoch = 2005.0\n[[points]]\nfile = "p.csv"\n'
        '[[observations]]\nfile = "v.csv"\n'
    )
    (tmp_path / "v.csv").write_text(
        "from,to,dx_m,dy_m,dz_m,sigma_dx_mm,sigma_dy_mm,sigma_dz_mm\nA,B,1,2,3,3,3,3\n"
    )
    network = open_job(tmp_path / "p.toml").network()
    site = network.site
    assert isinstance(site, EllipsoidSite)
    np.testing.assert_allclose(
        np.degrees([site.latitude, site.longitude]), [37.875, 32.51], atol=1e-5
    )
    geodetic = site.geodetic(network.start.points)
    np.testing.assert_allclose(geodetic[0], [*np.radians([37.87, 32.5]), 1020.0], atol=1e-8)


@pytest.mark.parametrize("columns", ["geographic", "geocentric"])
def test_a_projected_site_is_centred_on_points_of_any_kind(tmp_path: Path, columns: str) -> None:
    """Control of a GNSS network seldom comes in the projection of the clouds."""
    place = np.array([[48.0, 9.5, 300.0], [48.004, 9.506, 310.0]])
    if columns == "geographic":
        head, rows = "latitude_deg,longitude_deg,height_m", place
    else:
        turned = Transformer.from_crs("EPSG:4979", "EPSG:4978").transform(*place.T)
        head, rows = "ecef_x_m,ecef_y_m,ecef_z_m", np.stack(turned, axis=1)
    lines = [f"{n},{a:.6f},{b:.6f},{c:.6f},fixed" for n, (a, b, c) in zip("AB", rows, strict=True)]
    (tmp_path / "p.csv").write_text("\n".join([f"point,{head},role", *lines, ""]))
    (tmp_path / "v.csv").write_text(
        "from,to,dx_m,dy_m,dz_m,sigma_dx_mm,sigma_dy_mm,sigma_dz_mm\nA,C,1,2,3,3,3,3\n"
        "B,C,100,-200,300,3,3,3\n"
    )
    (tmp_path / "p.toml").write_text(
        '[site]\ncrs = "EPSG:32632"\n[[points]]\nfile = "p.csv"\n[[observations]]\nfile = "v.csv"\n'
    )
    network = open_job(tmp_path / "p.toml").network()
    site = network.site
    assert isinstance(site, EllipsoidSite)
    assert np.degrees([site.latitude, site.longitude]) == pytest.approx([48.002, 9.503], abs=2e-4)
    assert np.abs(network.start.points[:2]).max() < 600
    grid = network.reference.grid
    plan = Transformer.from_crs("EPSG:4979", "EPSG:32632").transform(*place.T)
    found = grid.from_work(network.start.points[:2])
    np.testing.assert_allclose(found, np.stack(plan, axis=1), atol=2e-4)


def test_points_outside_of_a_grid_are_refused() -> None:
    with pytest.raises(InputError, match=r"longitude -170\.0000 is outside the grid EPSG:3035"):
        ProjectedGrid("EPSG:3035", 0.0, 0.0).plan(
            float(np.radians(-52.0)), float(np.radians(-170.0))
        )


def test_adjust_takes_a_project(tmp_path: Path) -> None:
    path, out = ghilani(tmp_path, "v.csv"), tmp_path / "r.json"
    result = RUN.invoke(app, ["adjust", str(path), "--json", str(out), "--vce"])
    assert result.exit_code == 0, result.output
    data = json.loads(out.read_text())
    assert data["title"] == "Ghilani, chapter 17"
    assert data["reference"] == {
        "crs": None,
        "frame": "ITRF2014",
        "epoch": 2010.0,
        "heights": "ellipsoidal",
    }
    assert len(data["gnss"]["loops"]) == 9
    with_scans = tmp_path / "s.toml"
    with_scans.write_text(path.read_text() + '[[scans]]\nfile = "a.e57"\n')
    result = RUN.invoke(app, ["adjust", str(with_scans)])
    assert result.exit_code == 2
    assert "use tribrach run" in result.output


def test_a_blunder_in_a_baseline_is_named(tmp_path: Path) -> None:
    path = ghilani(tmp_path, "v.csv")
    table = tmp_path / "v.csv"
    table.write_text(table.read_text().replace("-1837.7459", "-1838.0459"))
    adjustment = adjust(open_job(path).network())
    made = gnss_chapter(adjustment)
    assert made is not None
    warnings = [warning.text for warning in made.warnings]
    assert warnings
    assert all("D" in text and "E" in text for text in warnings[:1])
    said = float(warnings[0].split(" mm")[0].split()[-1])
    assert said == pytest.approx(300, abs=30)


def test_networks_without_baselines_have_no_chapter() -> None:
    assert gnss_chapter(adjust(trilateration(Datum("free")).network())) is None


@pytest.mark.data
def test_network_of_dynadjust(shared_data: Path, tmp_path: Path) -> None:
    """DynAdjust states sigma0 squared 1.169 with 288; loops of correlated clusters."""
    there = shared_data / "networks" / "dynadjust"
    (tmp_path / "p.toml").write_text(
        f'[[observations]]\nfiles = ["{there}/gnss-network.stn", "{there}/gnss-network.msr"]\n'
    )
    adjustment = adjust(open_job(tmp_path / "p.toml").network())
    assert adjustment.dof == 288
    assert adjustment.sigma0_posterior**2 == pytest.approx(1.169, abs=5e-4)
    found = baselines_of(adjustment)
    assert found is not None
    loops = [loop for loop in loops_of(found) if loop.independent]
    points = len(np.unique(np.concatenate([found.start, found.end])))
    assert len(loops) == len(found) - points + 1
    failing = sum(not loop.passes for loop in loops)
    # most of them close at 5 %
    assert failing < 0.15 * len(loops)


RINEX = """
title = "Two permanent stations"
[site]
frame = "ITRF2000"
epoch = 2005.25
[[points]]
file = "control.csv"
[gnss]
navigation = ["{there}/30400920.05n"]
[[gnss.sessions]]
name = "092"
receivers = [
  {{ point = "3040", file = "{there}/30400920.05o" }},
  {{ point = "0759", file = "{there}/07590920.05o" }},
]
"""


@pytest.mark.data
@pytest.mark.skipif(not engines(), reason="RTKLIB is not installed")
def test_from_rinex_to_the_report(shared_data: Path, tmp_path: Path) -> None:
    there = shared_data / "gnss" / "geonet_0759_3040"
    (tmp_path / "p.toml").write_text(RINEX.format(there=there))
    (tmp_path / "control.csv").write_text(
        "point,ecef_x_m,ecef_y_m,ecef_z_m,sigma_e_mm,sigma_n_mm,sigma_u_mm,role\n"
        "3040,-3978241.958,3382840.234,3649900.853,,,,fixed\n"
        "0759,-3976219.1874,3382371.6055,3652511.1446,,,,approximate\n"
    )
    result = RUN.invoke(app, ["run", str(tmp_path / "p.toml")])
    # one baseline has no redundancy, and the command says so
    assert result.exit_code == 2
    assert "no redundancy" in result.output
    data = json.loads((tmp_path / "out" / "result.json").read_text())
    (baseline,) = data["gnss"]["baselines"]
    assert baseline["fixed_share"] == 1
    assert baseline["epochs"] == 115
    network = open_job(tmp_path / "p.toml").network()
    site = network.site
    found = site.to_ecef(np.array([data["points"]["0759"]["xyz"]]))[0]  # type: ignore[attr-defined]
    np.testing.assert_allclose(found, [-3976219.1874, 3382371.6055, 3652511.1446], atol=0.015)
    text = " ".join((tmp_path / "out" / "report.txt").read_text().split())
    assert "1 session gave 1 independent baseline" in text
    assert "in 100 % of 115 epochs" in text
    assert "close no loop: nothing checks them" in text
    assert "ITRF2000 at epoch 2005.25" in text


@pytest.mark.data
@pytest.mark.skipif(not engines(), reason="RTKLIB is not installed")
def test_two_sessions_check_each_other(shared_data: Path, tmp_path: Path) -> None:
    """Two half hours of the same receivers: a repeated baseline is a loop of two."""
    there = shared_data / "gnss" / "geonet_0759_3040"
    sessions = ""
    for name, first, last in (("one", 0, 28), ("two", 28, 57)):
        for point in ("3040", "0759"):
            minutes(there / f"{point}0920.05o", tmp_path / f"{name}_{point}.05o", first, last)
        receivers = ", ".join(
            f'{{ point = "{point}", file = "{name}_{point}.05o" }}' for point in ("3040", "0759")
        )
        sessions += f'[[gnss.sessions]]\nname = "{name}"\nreceivers = [{receivers}]\n'
    head = RINEX.split("[[gnss.sessions]]")[0].format(there=there)
    (tmp_path / "p.toml").write_text(head + sessions)
    (tmp_path / "control.csv").write_text(
        "point,ecef_x_m,ecef_y_m,ecef_z_m,role\n3040,-3978241.958,3382840.234,3649900.853,fixed\n"
    )
    result = RUN.invoke(app, ["run", str(tmp_path / "p.toml")])
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "out" / "result.json").read_text())
    assert data["sigma0"]["dof"] == 3
    (loop,) = data["gnss"]["loops"]
    assert loop["points"] == ["3040", "0759"]
    assert loop["passes"]
    assert 0 < loop["size"] < 0.02
    truth = [-3976219.1874, 3382371.6055, 3652511.1446]
    np.testing.assert_allclose(data["points"]["0759"]["ecef"], truth, atol=0.015)
    assert data["reference"] == {
        "crs": None,
        "frame": "ITRF2000",
        "epoch": 2005.25,
        "heights": "ellipsoidal",
    }
    text = " ".join((tmp_path / "out" / "report.txt").read_text().split())
    assert "2 sessions gave 2 independent baselines" in text
    assert "1 minimal loop: the largest closure is" in text
