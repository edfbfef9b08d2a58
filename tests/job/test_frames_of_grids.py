"""Positions and vectors of another frame on projected sites: carried in space, and said."""

from pathlib import Path

import numpy as np
import pytest
from pyproj import Transformer

from tribrach.errors import InputError
from tribrach.geodesy.frames import connected, transform
from tribrach.geodesy.site import EllipsoidSite
from tribrach.job.opened import open_job
from tribrach.network.facts import FrameChange, OverGeoid, facts_of
from tribrach.pipeline import run
from tribrach.project import Project

#: two marks in New Brunswick, EPSG:2953 (NAD83(CSRS)): easting, northing, ellipsoidal height [m]
MARKS = np.array([[2487601.211, 7437047.544, 117.93], [2489236.288, 7438481.055, 37.701]])
EPOCH = 2025.3
HEAD = "from,to,dx_m,dy_m,dz_m,sigma_dx_mm,sigma_dy_mm,sigma_dz_mm"


def in_itrf() -> np.ndarray:
    """ITRF2014 of the marks by PROJ alone: projection, NAD83(CSRS)v8, its published parameters."""
    to_nad83 = Transformer.from_pipeline(
        "+proj=pipeline +step +inv +proj=sterea +lat_0=46.5 +lon_0=-66.5 +k=0.999912 "
        "+x_0=2500000 +y_0=7500000 +ellps=GRS80 +step +proj=cart +ellps=GRS80"
    )
    nad83 = to_nad83.transform(*MARKS.T)
    to_itrf = Transformer.from_crs("EPSG:10412", "EPSG:7789")
    moved = to_itrf.transform(*nad83, np.full(2, EPOCH))
    return np.stack(moved[:3], axis=1)


def write(folder: Path, site: str, control: str, vectors: str, entry: str = "") -> Path:
    (folder / "control.csv").write_text(control)
    (folder / "vectors.csv").write_text(vectors)
    path = folder / "p.toml"
    path.write_text(
        f'[site]\n{site}\n[[points]]\nfile = "control.csv"\n[[observations]]\n'
        f'file = "vectors.csv"\n{entry}\n'
    )
    return path


def control_rows(rows: list[str]) -> str:
    return "\n".join(["point,easting_m,northing_m,height_m,role", *rows, ""])


FIRST = "A,2487601.211,7437047.544,117.93,fixed"


def test_a_vector_in_itrf_ends_at_the_grid_coordinates(tmp_path: Path) -> None:
    """0.14 ppm between ITRF2014 and NAD83(CSRS): 0.3 mm in 2.2 km, applied and said."""
    a, b = in_itrf()
    vectors = f"{HEAD}\n" + "A,B,{:.6f},{:.6f},{:.6f},1,1,1\n".format(*(b - a))
    rows = [FIRST, "B,2489236,7438481,38,approximate"]
    site = 'crs = "EPSG:2953"'
    ends = {}
    for name, entry in (("turned", f'frame = "ITRF2014"\nepoch = {EPOCH}'), ("as it is", "")):
        path = write(tmp_path, site, control_rows(rows), vectors, entry)
        report = run(Project.load(path))
        (point,) = [p for p in report.points if p.name == "B"]
        assert point.projected is not None
        ends[name] = np.array(point.projected)
        facts = facts_of(report.adjustment.network.facts, FrameChange)
        assert len(facts) == (1 if entry else 0)
    assert np.abs(ends["turned"] - MARKS[1]).max() < 1e-5
    assert 2e-4 < np.linalg.norm(ends["as it is"] - MARKS[1]) < 5e-4
    entry = f'frame = "ITRF2014"\nepoch = {EPOCH}'
    run(Project.load(write(tmp_path, site, control_rows(rows), vectors, entry)))
    text = " ".join((tmp_path / "out" / "report.txt").read_text().split())
    assert (
        "1 vector of vectors.csv is turned from ITRF2014 at 2025.30 to NAD83(CSRS): by 0.3" in text
    )


def test_positions_in_itrf_on_the_grid(tmp_path: Path) -> None:
    """1.8 m between the frames: geocentric control by its frame, of the file or of the site."""
    rows = [
        f"{n},{x:.6f},{y:.6f},{z:.6f},fixed" for n, (x, y, z) in zip("AB", in_itrf(), strict=True)
    ]
    control = "\n".join(["point,ecef_x_m,ecef_y_m,ecef_z_m,role", *rows, ""])
    vectors = f"{HEAD}\nA,C,100,200,300,1,1,1\nB,C,1,2,3,1,1,1\n"
    stated = f'\nframe = "ITRF2014"\nepoch = {EPOCH}'
    path = write(tmp_path, 'crs = "EPSG:2953"', control, vectors)
    path.write_text(path.read_text().replace('"control.csv"', f'"control.csv"{stated}'))
    of_file = open_job(path).network()
    of_site = open_job(write(tmp_path, f'crs = "EPSG:2953"{stated}', control, vectors)).network()
    for network in (of_file, of_site):
        assert network.reference.frame == "NAD83(CSRS)"
        found = network.reference.grid.from_work(network.start.points[:2])
        np.testing.assert_allclose(found, MARKS, atol=2e-5)
    (fact,) = facts_of(of_file.facts, FrameChange)
    assert fact.largest == pytest.approx(1.763, abs=0.02)


def test_control_in_the_grid_does_not_move_with_the_frame_of_the_site(tmp_path: Path) -> None:
    vectors = f"{HEAD}\nA,B,785,1233,745,1,1,1\n"
    rows = control_rows([FIRST, "B,2488813,7438154,82,approximate"])
    site = f'crs = "EPSG:2953"\nframe = "ITRF2014"\nepoch = {EPOCH}'
    network = open_job(write(tmp_path, site, rows, vectors)).network()
    found = network.reference.grid.from_work(network.start.points[:1])
    np.testing.assert_allclose(found, MARKS[:1], atol=1e-7)


def test_wgs84_grids_have_the_frame_that_the_site_names(tmp_path: Path) -> None:
    """WGS 84 has followed the ITRF: a grid of it works in any, and nothing is moved."""
    site = f'crs = "EPSG:32619"\nframe = "ITRF2014"\nepoch = {EPOCH}'
    rows = control_rows(["A,681000,5089000,100,fixed", "B,682000,5090000,100,approximate"])
    vectors = f"{HEAD}\nA,B,785,1233,745,1,1,1\n"
    network = open_job(write(tmp_path, site, rows, vectors)).network()
    assert network.reference.frame == "ITRF2014"
    assert [type(fact) for fact in network.facts] == [OverGeoid]


def test_an_unknown_datum_is_said(tmp_path: Path) -> None:
    site = (
        'crs = "+proj=sterea +lat_0=46.5 +lon_0=-66.5 +k=0.999912 +x_0=2500000 +y_0=7500000 '
        f'+ellps=GRS80 +type=crs"\nframe = "ITRF2014"\nepoch = {EPOCH}'
    )
    rows = control_rows([FIRST, "B,2488813,7438154,82,approximate"])
    job = open_job(write(tmp_path, site, rows, f"{HEAD}\nA,B,785,1233,745,1,1,1\n"))
    assert isinstance(job.frame.site, EllipsoidSite)
    (warning,) = [text for text in job.survey.warnings if "what datum" in text]
    assert "vectors in ITRF2014 at 2025.30 are taken as in it" in warning


def test_wgs84_and_the_itrf_are_one_and_regional_datums_are_not() -> None:
    """PROJ's own way from ITRF2014 to the ensemble in North America is 1.8 m off."""
    here = in_itrf()
    moved, accuracy = transform(here, "ITRF2014", "WGS 84", EPOCH)
    assert np.abs(moved - here).max() < 1e-3
    assert accuracy <= 0.02
    # an old datum through the one that EPSG ties it to, and its accuracy with it
    moved, accuracy = transform(here, "ITRF2014", "NAD83", EPOCH)
    assert np.linalg.norm(moved - here, axis=1) == pytest.approx(1.76, abs=0.02)
    assert accuracy == pytest.approx(1.0, abs=0.05)
    assert not connected("ETRS89", "GDA2020")
    with pytest.raises(InputError, match=r"no transformation from ETRS89.*give coordinates in GDA"):
        transform(here, "ETRS89", "GDA2020", EPOCH)
