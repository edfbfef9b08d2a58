"""Data sheets: every figure with a source, names found and refused, projects that use them."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.io.instrument_sheets import find_sheet, sheets
from tribrach.network.adjustment import adjust
from tribrach.network.survey import Survey
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles
from tribrach.pipeline import run
from tribrach.project import Project
from tribrach.project.instrument import Instrument
from tribrach.units import GON, SEC

PROJECT = """
[[observations]]
file = "o.csv"

[instruments.scanner]
{lines}
"""


def project(folder: Path, lines: str) -> Project:
    path = folder / "p.toml"
    path.write_text(PROJECT.format(lines=lines))
    return Project.load(path)


def test_every_figure_has_a_source_and_a_known_key() -> None:
    names = [sheet.name for sheet in sheets()]
    assert len(names) == len(set(names))
    scanners = [s for s in sheets() if "range_mm" in s.values]
    assert len(scanners) >= 9
    assert sum("distance_mm" in s.values for s in sheets()) >= 6
    for sheet in sheets():
        assert sheet.values.keys() <= Instrument.model_fields.keys(), sheet.name
        assert sheet.status in {"read", "quoted"}
        assert sheet.kind
        for figure in sheet.figures:
            assert figure.value > 0, (sheet.name, figure.key)
            assert len(figure.source) > 10
            # a maker's sheet is cited with its maker, or the figure is a default and says so
            assert figure.source.startswith("default") or "," in figure.source


@pytest.mark.parametrize("sheet", sheets(), ids=lambda s: s.name)
def test_sheets_are_complete(sheet) -> None:  # type: ignore[no-untyped-def]
    if "scann" in sheet.kind:
        beam = {"range_mm", "scan_angle_arcsec", "beam_exit_mm", "beam_divergence_mrad"}
        assert beam <= sheet.values.keys()
        assert Instrument(sheet=sheet.name).noise() is not None
    if "station" in sheet.kind:
        both_faces = {"direction_both_faces_arcsec", "zenith_both_faces_arcsec"}
        assert both_faces | {"distance_mm"} <= sheet.values.keys()
        assert {sheet.figure(key).standard for key in both_faces} <= {"ISO 17123-3", "DIN 18723"}
    if sheet.kind == "GNSS":
        assert {"gnss_plan_mm", "gnss_up_mm", "gnss_common_share"} <= sheet.values.keys()
    if "rod" in sheet.kind:
        assert {"rod_mm", "bubble_arcmin"} <= sheet.values.keys()
    # a compensator that nobody publishes is left out: a station then asks for its sigma
    level = sheet.figure("levelling_arcsec")
    assert level is None or level.published


def test_the_tilt_sensor_of_a_scanner_is_no_compensator() -> None:
    assert Instrument(sheet="Leica RTC360").precision().tilt == pytest.approx(180 * SEC)


def test_one_reading_has_root_two_of_both_faces() -> None:
    """The sheet's figure is that of the mean of both faces, whichever way it is typed."""
    for instrument in (
        Instrument(sheet="Trimble S7"),
        Instrument(direction_both_faces_arcsec=2, zenith_both_faces_arcsec=2),
    ):
        precision = instrument.precision()
        nowhere = np.array([np.nan])
        for sigma in (precision.of_directions, precision.of_zeniths):
            assert sigma(nowhere, np.array([1.0])) == pytest.approx(np.sqrt(2) * 2 * SEC)
            assert sigma(nowhere, np.array([2.0])) == pytest.approx(2 * SEC)
    # what is typed as one reading is one reading, beside a sheet too
    typed = Instrument.model_validate({"sheet": "Trimble S7", "direction_arcsec": 2.0})
    assert typed.precision().direction == pytest.approx(2 * SEC)
    assert typed.precision().zenith == pytest.approx(np.sqrt(2) * 2 * SEC)
    assert "direction_both_faces_arcsec" not in {figure.key for figure in typed.figures()}


def test_an_angle_is_given_by_one_of_its_keys(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="mean of both: give one of them"):
        project(tmp_path, "zenith_arcsec = 3\nzenith_both_faces_arcsec = 2")


def cut(value: float, digits: int = 5) -> float:
    return float(np.floor(value * 10**digits) / 10**digits)


@pytest.mark.parametrize(
    ("length", "up", "plan", "space"),
    [(150.0, 0.00201, 0.00237, 0.00311), (7000.0, 0.09263, 0.09663, 0.13386)],
)
def test_published_point_qualities(length, up, plan, space) -> None:  # type: ignore[no-untyped-def]
    """One face of a 2", 1 mm + 1.5 ppm instrument, V 83 gon (Leica Captivate reference manual).

    The maker rounds or cuts its figures.
    """
    instrument = Instrument.model_validate(
        {"sheet": "Leica TS16", "direction_both_faces_arcsec": 2, "zenith_both_faces_arcsec": 2}
    )
    precision = instrument.precision()
    survey = Survey()
    survey.point("S", (0, 0, 0), free=(False,) * 3, role="fixed")
    z, one, sight = np.array([83 * GON]), np.ones(1), {"start": ["S"], "end": ["P"]}
    # the circle is oriented without error
    survey.scalars["circle"] = (0.0, False)
    direction = {"orientation": ["circle"], **sight}
    survey.add(
        Directions,
        values=[210 * GON],
        sigma=precision.of_directions(np.array([length]), one),
        **direction,
    )
    survey.add(
        ZenithAngles,
        values=z,
        sigma=precision.of_zeniths(np.array([length]), one),
        refraction=0.0,
        **sight,
    )
    survey.add(
        SlopeDistances,
        values=[length],
        sigma=precision.of_distances(np.array([length]), one),
        **sight,
    )
    adjustment = adjust(survey.network())
    c = adjustment.covariance("P", "P")
    found = np.sqrt([c[2, 2], c[0, 0] + c[1, 1], np.trace(c)])
    for value, published in zip(found, (up, plan, space), strict=True):
        assert published in (round(float(value), 5), cut(float(value)))


def test_scanner_angles_have_noise_and_a_systematic_part() -> None:
    """A maker's accuracy is both together; means of points and of sets make the noise smaller."""
    sheet = Instrument(sheet="Z+F IMAGER 5016")
    noise, precision = sheet.noise(), sheet.precision()
    assert noise is not None
    assert noise.horizontal == pytest.approx(4 * SEC)
    assert np.hypot(noise.horizontal, noise.systematic) == pytest.approx(14.4 * SEC)
    assert noise.random.systematic == 0
    assert precision.of_scan_angle() == pytest.approx(14.4 * SEC)
    assert precision.of_scan_angle(1e12) == pytest.approx(noise.systematic)
    # one figure alone is noise, as a user types it
    alone = Instrument(range_mm=1.0, scan_angle_arcsec=8.0)
    assert alone.precision().of_scan_angle() == pytest.approx(8 * SEC)
    assert alone.noise() is not None
    assert alone.noise().systematic == 0  # type: ignore[union-attr]
    for each in sheets():
        if "scan_angle_accuracy_arcsec" in each.values:
            assert each.values["scan_angle_arcsec"] < each.values["scan_angle_accuracy_arcsec"]


def test_the_scanning_total_station_of_the_facades() -> None:
    sheet = find_sheet("topcon gtl 1000")
    assert sheet.name == "Topcon GTL-1000"
    noise = Instrument(sheet="Topcon GTL-1000").noise()
    assert noise is not None
    # distance accuracy of scans 4, 6 and 8 mm at 10, 20 and 30 m
    assert noise.range_sigma(np.array([10.0, 20.0, 30.0])) == pytest.approx([4e-3, 6e-3, 8e-3])
    # AC-54: the beam's share at 20 m
    at = np.array([20.0])
    assert noise.beam_angle(at) * at == pytest.approx([1.803e-3], abs=1e-6)
    beam = [f for f in sheet.figures if f.key.startswith("beam")]
    assert not any(figure.published for figure in beam)


def test_single_figures_are_overridden(tmp_path: Path) -> None:
    instrument = project(
        tmp_path, 'sheet = "Leica ScanStation P50"\nrange_mm = 0.8\nsource = "field check"'
    ).instruments["scanner"]
    noise = instrument.noise()
    assert noise is not None
    assert noise.range == pytest.approx(0.8e-3)
    assert noise.range_scale == pytest.approx(10e-6)
    assert np.hypot(noise.horizontal, noise.systematic) == pytest.approx(8 * SEC)
    sources = {figure.key: figure.source for figure in instrument.figures()}
    assert sources["range_mm"] == "field check"
    assert "P50 data sheet" in sources["scan_angle_accuracy_arcsec"]


def test_unknown_sheets_are_refused_with_the_nearest(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"p\.toml:6: .*P-50.*Leica ScanStation P50") as caught:
        project(tmp_path, 'sheet = "Leica Scan Station P-50x"')
    assert "\n" not in str(caught.value)


def test_names_far_from_any_sheet_list_all() -> None:
    with pytest.raises(InputError, match="there are Topcon GTL-1000, Leica"):
        find_sheet("qqqq")


def test_the_report_prints_sheets_and_sources(tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_text(
        "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm\nA,0,0,0,1,1,1\nB,100,0,0,1,1,1\n"
    )
    (tmp_path / "o.csv").write_text("from,to,slope_distance_m\nA,B,100.002\n")
    path = tmp_path / "p.toml"
    path.write_text(
        '[[points]]\nfile = "c.csv"\n[[observations]]\nfile = "o.csv"\ninstrument = "total"\n'
        '[instruments.total]\nsheet = "Topcon GTL-1000"\ncentring_mm = 0.5\n'
    )
    content = run(Project.load(path))
    text = (tmp_path / "out" / "report.txt").read_text()
    assert "Instruments" in text
    assert "Topcon GTL-1000" in text
    assert "distance accuracy of scans 4, 6 and 8 mm" in text
    html = (tmp_path / "out" / "report.html").read_text()
    assert "GTL-1000 brochure" in html
    by_key = {figure.key: figure for figure in content.chapter("instruments").data}
    assert by_key["centring_mm"].source == "project file"
    assert by_key["beam_exit_mm"].published is False
    assert by_key["direction_both_faces_arcsec"].standard == "ISO 17123-3"
    assert "mean of both faces" in text
    distance = next(o for o in content.observations if o.kind == "slope_distance")
    assert distance.sigma == pytest.approx(np.hypot(1e-3 + 2e-4, np.sqrt(2) * 0.5e-3), rel=1e-5)
