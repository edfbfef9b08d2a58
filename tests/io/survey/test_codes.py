"""Codes and descriptions of points on their way from raw files to results and other programs."""

import io
from pathlib import Path

import openpyxl
import pytest
from lxml import etree

from tribrach.io.delivery.content import delivered_network
from tribrach.io.delivery.formats import delivered
from tribrach.io.survey.exported import export
from tribrach.io.survey.formats import read_files
from tribrach.network.facts import PointCodes, codes_of
from tribrach.network.network import Network
from tribrach.network.survey import observed_part
from tribrach.report.json_result import network as result_of
from tribrach.solution import AdjustmentSettings, adjust_network

GSI = """\
*110001+00000000000000S1 84..10+0000000000000000 85..10+0000000000000000 86..10+0000000000000000 \
88..10+0000000000001500
*110002+00000000000000T1 21.102+0000000000000000 22.102+0000000009000000 31..00+0000000000050000 \
71....+000000000000TREE 87..10+0000000000001500
*110003+00000000000000T2 21.102+0000000010000000 22.102+0000000009000000 31..00+0000000000040000 \
71....+000000000000WALL 87..10+0000000000001500
"""
RW5 = """\
JB,NMtest,DT01-01-2020,TM10:00:00
MO,AD0,UN1,SF1.00000000,EC0,EO0.0,AU0
SP,PN1,N 100.0,E 200.0,EL10.0,--BM 7
OC,OP1,N 100.0,E 200.0,EL10.0,--BM 7
BK,OP1,BP2,BS0.0000,BC0.0000
LS,HI1.500,HR1.500
BD,OP1,FP2,AR0.0000,ZE90.0000,SD50.000,--IRON PIN
SS,OP1,FP3,AR90.0000,ZE90.0000,SD40.000,--TREE #4
SS,OP1,FP4,AR120.0000,ZE90.0000,SD40.000,--EDGE--LEFT
"""
CSV = """\
point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm,code
1,200,100,10,1,1,1,BM
2,200,150,10,1,1,1,
"""


def codes(network: Network) -> dict[str, str]:
    return dict(codes_of(network.facts))


def test_the_code_given_most_often_is_the_code_of_the_point() -> None:
    facts = [
        PointCodes((("P", "TREE"), ("P", "OAK"), ("Q", " a \x07 b "))),
        PointCodes((("P", "OAK"),)),
    ]
    assert codes_of(facts) == {"P": "OAK", "Q": "a b"}


def test_codes_reach_the_result(tmp_path: Path) -> None:
    (tmp_path / "a.gsi").write_text(GSI)
    network = observed_part(read_files([tmp_path / "a.gsi"])).network()
    assert codes(network) == {"T1": "TREE", "T2": "WALL"}
    points = result_of(adjust_network(network, AdjustmentSettings()))["points"]
    assert {n: p.get("code") for n, p in points.items()} == {
        "S1": None, "T1": "TREE", "T2": "WALL",
    }  # fmt: skip


def test_codes_of_carlson_and_of_tables_reach_starnet_and_gama(tmp_path: Path) -> None:
    (tmp_path / "a.rw5").write_text(RW5)
    network = observed_part(read_files([tmp_path / "a.rw5"])).network()
    assert codes(network) == {"1": "BM 7", "2": "IRON PIN", "3": "TREE #4", "4": "EDGE--LEFT"}
    text = export(network, "starnet").text
    (tmp_path / "a.dat").write_text(text)
    assert "'IRON PIN" in text
    again = observed_part(read_files([tmp_path / "a.dat"])).network()
    # a number sign begins a comment there
    assert codes(again) == codes(network) | {"3": "TREE 4"}
    root = etree.fromstring(export(network, "gkf").text.encode())
    said = [node.text.strip() for node in root.iter(etree.Comment)]
    assert said == ["BM 7", "IRON PIN", "TREE #4", "EDGE  LEFT"]
    (tmp_path / "points.csv").write_text(CSV)
    assert codes_of(read_files([tmp_path / "points.csv"]).facts) == {"1": "BM"}


def test_codes_of_raw_files_reach_every_format(tmp_path: Path) -> None:
    (tmp_path / "a.rw5").write_text(RW5)
    network = observed_part(read_files([tmp_path / "a.rw5"])).network()
    made = delivered_network(result_of(adjust_network(network, AdjustmentSettings())))
    for format in ("dxf", "landxml", "gpkg", "csv", "list"):
        data = delivered(made, format)
        for code in ("BM 7", "IRON PIN", "TREE #4", "EDGE--LEFT"):
            assert code.encode() in data, (format, code)
    book = openpyxl.load_workbook(io.BytesIO(delivered(made, "xlsx")))["points"]
    assert {"BM 7", "IRON PIN", "TREE #4"} <= {cell.value for cell in book["C"]}


@pytest.mark.parametrize(
    ("folder", "expected"), [("sdr", "TREE"), ("jobxml", "TREE"), ("nikon", "FENCE")]
)
def test_codes_of_recorders(folder: str, expected: str) -> None:
    seeds = sorted((Path(__file__).parents[3] / "fuzz" / "seeds" / folder).iterdir())
    assert codes_of(read_files(seeds[:1]).facts)["P"] == expected
