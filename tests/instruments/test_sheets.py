"""Data sheets: every figure with a source, names found and refused, projects that use them."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.io.instrument_sheets import find_sheet, sheets
from tribrach.pipeline import run
from tribrach.project import Project
from tribrach.project.instrument import Instrument
from tribrach.units import SEC

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
        assert {"direction_arcsec", "zenith_arcsec", "distance_mm"} <= sheet.values.keys()
    if sheet.kind == "GNSS":
        assert {"gnss_plan_mm", "gnss_up_mm", "gnss_common_share"} <= sheet.values.keys()
    elif "rod" in sheet.kind:
        assert {"rod_mm", "bubble_arcmin"} <= sheet.values.keys()
    else:
        assert "levelling_arcsec" in sheet.values


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
    assert noise.horizontal == pytest.approx(8 * SEC)
    sources = {figure.key: figure.source for figure in instrument.figures()}
    assert sources["range_mm"] == "field check"
    assert "P50 data sheet" in sources["scan_angle_arcsec"]


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
    distance = next(o for o in content.observations if o.kind == "slope_distance")
    assert distance.sigma == pytest.approx(np.hypot(1e-3 + 2e-4, np.sqrt(2) * 0.5e-3), rel=1e-5)
