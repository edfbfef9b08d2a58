"""Text of points is not guessed: many lines tell how it is written, or the user is asked."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from tests.io.scans.scan_files import whole, written
from tribrach.errors import InputError
from tribrach.io.csv_rows import ListForm
from tribrach.io.point_list import read_point_list
from tribrach.io.scans.formats import read_scans
from tribrach.io.scans.info import describe
from tribrach.io.scans.reading import as_told
from tribrach.io.survey.csv.file import read_table
from tribrach.scan.scan import Scan

XYZ = np.round(
    np.random.default_rng(5).uniform([691_230, 5_334_560, 520], [691_250, 5_334_580, 524], (60, 3)),
    3,
)


def text(rows: np.ndarray, mark: str, decimal: str = ".", digits: int = 3) -> str:
    lines = (mark.join(f"{v:.{digits}f}".replace(".", decimal) for v in row) for row in rows)
    return "\n".join(lines) + "\n"


def scan_of(folder: Path, content: str, name: str = "a.txt") -> Scan:
    (scan,) = read_scans(written(folder, name, content))
    return scan


@pytest.mark.parametrize("mark", [" ", "   ", "\t", ";", "; ", "|", ", ", ",", " ; "])
@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("head", ["", "X{0}Y{0}Z\n", '"X"{0}"Y"{0}"Z"\n', "//X{0}Y{0}Z\n60\n"])
def test_marks_and_decimals(tmp_path: Path, mark: str, decimal: str, head: str) -> None:
    content = head.format(mark) + text(XYZ, mark, decimal)
    if decimal == "," and "," in mark:
        with pytest.raises(InputError, match="commas"):
            scan_of(tmp_path, content)
        return
    assert np.array_equal(whole(scan_of(tmp_path, content)).xyz, XYZ)


@pytest.mark.parametrize("mark", [" ", ";", "\t"])
@pytest.mark.parametrize("marks", [".,", ",.", ".'", ",'"])
def test_thousands(tmp_path: Path, mark: str, marks: str) -> None:
    swapped = str.maketrans(".,", marks)
    content = "\n".join(mark.join(f"{v:,.3f}".translate(swapped) for v in row) for row in XYZ)
    assert np.array_equal(whole(scan_of(tmp_path, content)).xyz, XYZ)


def test_exponents_of_fortran(tmp_path: Path) -> None:
    content = "\n".join(" ".join(f"{v:.10e}".replace("e", "D") for v in row) for row in XYZ)
    assert np.array_equal(whole(scan_of(tmp_path, content)).xyz, XYZ)


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
@pytest.mark.parametrize(
    "head", ["", "Punktnummer;Rechtswert;Hochwert;Höhe;Code\n", "Matricule;Est;Nord;Élévation;x1\n"]
)
def test_names_before_decimal_commas(tmp_path: Path, head: str, encoding: str) -> None:
    rows = text(XYZ, ";", ",").splitlines()
    content = head + "".join(f"P{k};{row};Hütte\n" for k, row in enumerate(rows))
    (scan,) = read_scans(written(tmp_path, "a.csv", content.encode(encoding)))
    assert np.array_equal(whole(scan, 7).xyz, XYZ)
    assert scan.names == ()


@pytest.mark.parametrize("head", ["lon,lat,h\n", "Longitude,Latitude,Altitude [m]\n", ""])
def test_degrees_are_told_by_their_names_or_doubted(tmp_path: Path, head: str) -> None:
    small = np.column_stack([11.5 + XYZ[:, 0] % 20 / 1e7, 48 + XYZ[:, 1] % 20 / 1e7, XYZ[:, 2]])
    if not head:
        small[:, 2] = 520
    (scan,) = read_scans(written(tmp_path, "a.csv", head + text(small, ",", digits=9)))
    assert (scan.unit.factors is None) == bool(head)
    assert any("degrees" in said for said in describe(scan).sentences)


def test_three_digits_after_each_comma_are_asked_for(tmp_path: Path) -> None:
    near = np.round(np.random.default_rng(1).uniform(1, 9, (50, 3)), 3)
    content = text(near, " ", ",")
    with pytest.raises(InputError, match="decimals or thousands") as caught:
        scan_of(tmp_path, content)
    assert "--decimal" in str(caught.value)
    with as_told(decimal="comma"):
        assert np.array_equal(whole(scan_of(tmp_path, content)).xyz, near)
    with as_told(decimal="point"):
        assert np.allclose(whole(scan_of(tmp_path, content)).xyz, 1e3 * near, rtol=1e-12)


@pytest.mark.parametrize("mark", [" ", ",", ";", "\t"])
def test_a_column_that_counts_is_no_coordinate(tmp_path: Path, mark: str) -> None:
    rows = [f"{k + 1}{mark}{line}" for k, line in enumerate(text(XYZ, mark).splitlines())]
    scan = scan_of(tmp_path, "\n".join(rows))
    assert np.array_equal(whole(scan).xyz, XYZ)
    assert scan.names == ("number",)


def test_a_raster_has_no_running_numbers(tmp_path: Path) -> None:
    rows = [f"{x} {y} {0.1 * x:.1f} 7" for y in range(5) for x in range(1, 40)]
    scan = scan_of(tmp_path, "\n".join(rows))
    assert scan.names == ("intensity",)
    assert np.ptp(whole(scan).xyz[:, 1]) == 4


@pytest.mark.parametrize(
    "order", [[1, 0, 2], [2, 1, 0], [0, 2, 1]], ids=["northing first", "height first", "y last"]
)
def test_columns_in_another_order_are_asked_for(tmp_path: Path, order: list[int]) -> None:
    rows = [f"{k + 1},{line},wall" for k, line in enumerate(text(XYZ[:, order], ",").splitlines())]
    with pytest.raises(InputError) as caught:
        scan_of(tmp_path, "\n".join(rows))
    assert "--columns" in str(caught.value)
    named = "n " + " ".join("xyz"[k] for k in order) + " code"
    with as_told(columns=named):
        scan = scan_of(tmp_path, "\n".join(rows))
    assert np.array_equal(whole(scan).xyz, XYZ)


def test_geocentric_coordinates_are_no_heights(tmp_path: Path) -> None:
    middle = np.array([4.16e6, 8.6e5, 4.74e6])
    rows = np.round(np.random.default_rng(3).normal(0, 9, (40, 3)) + middle, 3)
    assert np.array_equal(whole(scan_of(tmp_path, text(rows, " "))).xyz, rows)


@pytest.mark.parametrize(
    "head",
    [
        "Point,Northing (m),Easting (m),Elevation (m),Code",
        "Nr,Hochwert,Rechtswert,Hoehe,Code",
        "name,y,x,z,description of it",
        '"Point","Y","X","Z","Code"',
    ],
)
def test_codes_are_passed_over(tmp_path: Path, head: str) -> None:
    codes = ("GRD", "wall corner", "12", "")
    rows = [
        f"{k},{line},{codes[k % 4]}"
        for k, line in enumerate(text(XYZ[:, [1, 0, 2]], ",").splitlines())
    ]
    scan = scan_of(tmp_path, "\n".join([head, *rows]), "a.csv")
    assert np.array_equal(whole(scan, 7).xyz, XYZ)
    assert len(scan.names) == 1
    assert len(scan.warnings) == 1


@pytest.mark.parametrize("mark", [",", ";", "\t"])
@pytest.mark.parametrize("quote", ['"', ""])
def test_names_with_blanks(tmp_path: Path, mark: str, quote: str) -> None:
    names = ["X", "Y", "Z", "M3C2 distance", "Roughness (0.1)", "significant change"]
    head = mark.join(f"{quote}{name}{quote}" for name in names)
    rows = np.hstack([XYZ, np.round(np.random.default_rng(2).normal(size=(60, 3)), 3)])
    for comment in ("", "//", "# "):
        scan = scan_of(tmp_path, f"{comment}{head}\n{text(rows, mark)}")
        assert scan.names == tuple(names[3:])
        assert np.array_equal(whole(scan).xyz, XYZ)


def test_missing_values_stay_in_their_column(tmp_path: Path) -> None:
    rows = [
        f"{a:.3f},{b:.3f},{c:.3f},,5" if k % 2 else f"{a:.3f},{b:.3f},{c:.3f},4,5"
        for k, (a, b, c) in enumerate(XYZ)
    ]
    scan = scan_of(tmp_path, "x,y,z,p,q\n" + "\n".join(rows))
    got = whole(scan)
    assert np.isnan(got.values["p"][1::2]).all()
    assert (got.values["p"][::2] == 4).all()
    assert (got.values["q"] == 5).all()


@pytest.mark.parametrize(
    ("head", "metres"),
    [
        ("X [mm] Y [mm] Z [mm]", 1e-3),
        ("x_ft y_ft z_ft", 0.3048),
        ("# units: cm\nx y z", 1e-2),
        ("x y z", 1.0),
        ("x_m y_m z_m", 1.0),
    ],
)
def test_units_of_columns_and_comments(tmp_path: Path, head: str, metres: float) -> None:
    mark = "," if "[" in head else " "
    content = f"{head.replace(' ', mark) if mark == ',' else head}\n{text(XYZ, mark)}"
    if mark == ",":
        content = content.replace(",[", " [")
    assert np.allclose(whole(scan_of(tmp_path, content)).xyz, XYZ * metres, rtol=1e-14)


def test_a_unit_that_the_user_gives(tmp_path: Path) -> None:
    with as_told(unit="mm"):
        scan = scan_of(tmp_path, text(XYZ, " "))
    assert np.allclose(whole(scan).xyz, XYZ * 1e-3, rtol=1e-14)
    with pytest.raises(InputError), as_told(unit="furlong"):
        pass


@pytest.mark.parametrize(("mark", "decimal"), [(" ", ","), (";", ","), (",", "."), ("\t", ",")])
def test_formats_of_blanks_take_other_marks(tmp_path: Path, mark: str, decimal: str) -> None:
    near = np.round(np.random.default_rng(1).uniform(1, 9, (60, 3)), 4)
    rows = [line + mark + "0" for line in text(near, mark, decimal, 4).splitlines()]
    scan = scan_of(tmp_path, "\n".join(["60", *rows]), "a.pts")
    assert np.array_equal(whole(scan).xyz, near)
    head = ["10", "6", "0 0 0", "1 0 0", "0 1 0", "0 0 1"]
    head += ["1 0 0 0", "0 1 0 0", "0 0 1 0", "0 0 0 1"]
    scan = scan_of(tmp_path, "\n".join([*head, *rows]), "a.ptx")
    assert np.array_equal(whole(scan).xyz, near)


@pytest.mark.parametrize(
    ("mark", "decimal", "thousands", "quote"),
    [
        *((",", d, t, '"') for d, t in (",.", ".,", ", ", (",", ""))),
        *((";", d, t, "") for d, t in (",.", ".,", ". ", ".\u2019", ",\xa0")),
        *(("\t", d, t, "") for d, t in (".\xa0", ",\u202f", ",'")),
        (",", ".", "\u2019", ""), (" ", ".", "\xa0", ""),
    ],
)  # fmt: skip
def test_thousands_and_quotes(
    tmp_path: Path, mark: str, decimal: str, thousands: str, quote: str
) -> None:
    """Scans and lists take numbers as spreadsheets of many countries write them."""
    signs = str.maketrans({",": thousands, ".": decimal})
    rows = [[f"{quote}{f'{v:,.3f}'.translate(signs)}{quote}" for v in row] for row in XYZ]
    lines = [mark.join([f"P{k}", *row, f"{quote}wall{quote}"]) for k, row in enumerate(rows)]
    content = "\n".join([mark.join(["point", "e", "n", "h", "code"]), *lines, ""])
    assert np.array_equal(whole(scan_of(tmp_path, content)).xyz, XYZ)
    assert np.array_equal(read_point_list(tmp_path / "a.txt").xyz, XYZ)


def test_numbers_of_points_are_no_eastings(tmp_path: Path) -> None:
    near = np.round(XYZ % 50, 3)
    lines = text(near, " ").splitlines()
    by_fives = "\n".join(f"{5 * k} {line}" for k, line in enumerate(lines))
    assert np.array_equal(whole(scan_of(tmp_path, by_fives)).xyz, near)
    order = np.random.default_rng(1).permutation(len(lines))
    with pytest.raises(InputError, match="numbers of points"):
        scan_of(tmp_path, "\n".join(f"{k} {line}" for k, line in zip(order, lines, strict=True)))


def test_lists_without_heads_have_no_two_commas(tmp_path: Path) -> None:
    form = ListForm(columns={"point": 1, "easting": 2, "northing": 3, "height": 4})
    lines = [f"P{k},{line}" for k, line in enumerate(text(XYZ, ",").splitlines())]
    table = read_table(written(tmp_path, "a.csv", "\n".join(lines)), form)
    assert np.array_equal(table.columns("e", "n", "u"), XYZ)
    with pytest.raises(InputError, match="commas"):
        read_table(written(tmp_path, "a.csv", "\n".join(lines).replace(".", ",")), form)


def test_y_before_x_is_doubted(tmp_path: Path) -> None:
    swapped = text(XYZ[:, [1, 0, 2]], ";")
    swapped = text(XYZ[:, [1, 0, 2]], ";")
    # y is east and x north
    with pytest.raises(InputError, match="northing"):
        scan_of(tmp_path, "y;x;h\n" + text(XYZ, ";"))
    assert len(scan_of(tmp_path, "y;x;h\n" + text(XYZ % 100, ";")).warnings) == 1
    assert len(scan_of(tmp_path, swapped).warnings) == 1
    scan = scan_of(tmp_path, "Northing;Easting;h\n" + swapped)
    assert np.array_equal(whole(scan).xyz, XYZ)
    assert not scan.warnings
    for head in ("y x h\n", ""):
        for row in ("", "nan nan nan\n", "1 2 nan\n"):
            with suppress(InputError):
                scan_of(tmp_path, head + row)
