"""Lists of coordinates as spreadsheets, collectors and offices leave them."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tribrach.errors import InputError
from tribrach.io.csv_rows import ListForm
from tribrach.io.decimals import Exact, decimal_of, plain
from tribrach.io.point_list import PointList, read_point_list
from tribrach.io.survey.csv.file import read_table
from tribrach.io.survey.formats import read

#: point, easting, northing, height of the lists below
POINTS = [("A1", 4567123.125, 5300456.5, 512.25), ("A2", 4567200.0, 5300400.75, 498.5)]


def written(folder: Path, data: str | bytes, name: str = "list.csv") -> Path:
    path = folder / name
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def the_points(read: PointList) -> bool:
    return read.names == ("A1", "A2") and np.array_equal(read.xyz, [row[1:] for row in POINTS])


def text(head: list[str], separator: str, comma: bool) -> str:
    rows = [[name, *(f"{v:.3f}" for v in xyz)] for name, *xyz in POINTS]
    if comma:
        rows = [[cell.replace(".", ",") for cell in row] for row in rows]
    return "\r\n".join(separator.join(row) for row in [head, *rows]) + "\r\n"


HEADS = [
    ["Punkt", "Rechtswert", "Hochwert", "Höhe"],
    ["Pkt.-Nr.", "Ostwert [m]", "Nordwert [m]", "Höhe [m]"],
    ["Nr", "E", "N", "H"],
    ["Point", "Easting", "Northing", "Elevation"],
    ["Id", "EAST", "NORTH", "Z"],
    ["Point", "Est", "Nord", "Altitude"],
    ["Punto", "Este", "Norte", "Cota"],
    ["Punto", "Est", "Nord", "Quota"],
    ["Ponto", "Este", "Norte", "Cota"],
    ["Punt", "Oost", "Noord", "Hoogte"],
    ["Nazwa", "E", "N", "Wysokość"],
]


@pytest.mark.parametrize("separator", [";", "\t", "|", "   "])
@pytest.mark.parametrize("comma", [False, True])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le"])
def test_any_writing_of_one_list(
    tmp_path: Path, separator: str, comma: bool, encoding: str
) -> None:
    head = ["Punktnummer", "Rechtswert", "Hochwert", "Höhe"]
    data = text(head, separator, comma).encode(encoding)
    table = read_table(written(tmp_path, data))
    assert the_points(read_point_list(table.path))
    said = " ".join(table.remarks)
    assert "Rechtswert is easting" in said
    assert ("comma" in said) == comma
    assert ("Windows-1252" in said) == (encoding == "cp1252")


@pytest.mark.parametrize("head", [*HEADS[:-1], ["Punkt", "E", "N", "Wysokość"]])
def test_heads_of_many_languages(tmp_path: Path, head: list[str]) -> None:
    assert the_points(read_point_list(written(tmp_path, text(head, ";", True))))


def test_columns_may_stand_in_any_order_and_others_are_left_out(tmp_path: Path) -> None:
    data = "Datum;Hochwert;Rechtswert;Bemerkung;Nr\n1.2.;2;1;alt;P\n"
    table = read_table(written(tmp_path, data))
    assert table.number("e").tolist() == [1.0]
    assert table.number("n").tolist() == [2.0]
    assert table.words["comment"] == ["alt"]
    assert "columns that are left out: Datum" in table.remarks


def test_sigmas_with_units_in_the_head(tmp_path: Path) -> None:
    data = "Nr;E;N;H;sE [mm];s_N (mm);σ_H (m)\nA;1;2;3;4;5;0,006\n"
    table = read_table(written(tmp_path, data))
    assert np.allclose(table.columns("sigma_e", "sigma_n", "sigma_u"), [[0.004, 0.005, 0.006]])


def test_units_of_heads_count(tmp_path: Path) -> None:
    table = read_table(written(tmp_path, "Point,East (ft),North (ft),Elev (ft)\nA,10,20,30\n"))
    assert np.allclose(table.columns("e", "n", "u"), [[3.048, 6.096, 9.144]])


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ("Nr;Y;X;Z\nA;1;2;3\n", "columns X and Y: does X point east or north .Y before X is usual"),
        ("Nr;X;Y\nA;1;2\n", 'columns = { point = "Nr", easting = "X", northing = "Y" }'),
        ("Nr;E;N;H;sE\nA;1;2;3;4\n", "column sE is a standard deviation without a unit"),
        ("Nr;E;N;H;sigm east [mm]\nA;1;2;3;4\n", "nearly the head of a standard deviation"),
        ("Nr;E [ft];N;H\nA;1;2;3\n", "columns H, N have no unit, and others are in ft"),
        ("A1;4567123,1;5300456,2;512,3\nA2;1,1;2,2;3,3\n", "the list has no header: A1"),
        ("Nr\tE\tN\nA\t1,234\t5,678\n", "1,234 may be a number with decimals or one in thousands"),
        ("Nr;E;N;H\nA;1,5;2,5;3,5\nB;1.25;2,5;3,5\n", "'1.25'; write decimals with a comma"),
        ("Nr;E;N;H\nA;1,5;2,5;3,5\nB;1;2;5.302\n", "'5.302'; write decimals with a comma"),
        ("Nr,E,N,H\nA,1,5,2,5,3,5\n", "the row has 7 cells, the header has 4"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an old Excel file"),
        (b"PK\x03\x04nothing", "the spreadsheet cannot be read"),
        (b"Nr;E;N\nA\x81;1;2\n", "neither UTF-8 nor Windows-1252"),
        (b"Nr;E;N\n\x02\xff;1;2\n", "the file is not text"),
        (b"\xff\xfeN\x00r", "there are no rows|UTF-16"),
    ],
)
def test_what_is_not_plain_is_asked(tmp_path: Path, data: str | bytes, words: str) -> None:
    with pytest.raises(InputError, match=words.replace("(", r"\(")):
        read_table(written(tmp_path, data))


def test_a_project_answers_the_questions(tmp_path: Path) -> None:
    path = written(tmp_path, "Nr;Y;X;Z;q\nA;1;2;3;9\n")
    form = ListForm({"point": "nr", "easting": "Y", "northing": "X", "sigma_e_mm": 5})
    table = read_table(path, form)
    assert np.allclose(table.columns("e", "n", "u", "sigma_e"), [[1, 2, 3, 0.009]])
    bare = written(tmp_path, "A 1,234 5,678\nB 2,345 6,789\n", "bare.txt")
    form = ListForm({"point": 1, "easting": 2, "northing": 3}, decimal=",", separator="blank")
    assert read_table(bare, form).columns("e", "n").tolist() == [[1.234, 5.678], [2.345, 6.789]]
    with pytest.raises(InputError, match="Rechtwert as easting, which is no column; did you mean"):
        read_table(
            written(tmp_path, "Nr;Rechtswert;H\nA;1;2\n"), ListForm({"easting": "Rechtwert"})
        )
    with pytest.raises(InputError, match="column 7 as point, and there are 2"):
        read_table(written(tmp_path, "a;b\n1;2\n"), ListForm({"point": 7}))


def test_titles_empty_rows_and_empty_columns_are_passed_over(tmp_path: Path) -> None:
    data = "Koordinatenliste;;;;\n;;;;\nNr;E;N;H;\nA;1;2;3;\n;;;;\nB;4;5;6;\n"
    table = read_table(written(tmp_path, data))
    assert table.words["point"] == ["A", "B"]
    assert table.lines == [4, 6]
    assert any("titles above the header in line 3" in text for text in table.remarks)


def book(folder: Path, sheets: dict[str, list[list[object]]], name: str = "list.xlsx") -> Path:
    workbook = openpyxl.Workbook()
    workbook.remove(workbook.active)
    for title, rows in sheets.items():
        sheet = workbook.create_sheet(title)
        for row in rows:
            sheet.append(row)
    path = folder / name
    workbook.save(path)
    return path


def with_part(path: Path, name: str, changed: Callable[[bytes], bytes]) -> None:
    """Change a part of a packed file, or add it."""
    with zipfile.ZipFile(path) as packed:
        parts = {part: packed.read(part) for part in packed.namelist()}
    parts[name] = changed(parts.get(name, b""))
    with zipfile.ZipFile(path, "w") as packed:
        for part, data in parts.items():
            packed.writestr(part, data)


def test_spreadsheets(tmp_path: Path) -> None:
    head = ["Punkt", "Rechtswert", "Hochwert", "Höhe"]
    numbers = book(tmp_path, {"Tabelle1": [head, *map(list, POINTS)], "Tabelle2": []})
    assert the_points(read_point_list(numbers))
    words = [[name, *(f"{v:.3f}".replace(".", ",") for v in xyz)] for name, *xyz in POINTS]
    assert the_points(read_point_list(book(tmp_path, {"a": [["Liste"], [], head, *words]})))
    mixed = [words[0], list(POINTS[1])]
    assert the_points(read_point_list(book(tmp_path, {"a": [head, *mixed]})))
    named = book(tmp_path, {"a": [head, [7, 1, 2, 3]], "b": [head, [8, 1, 2, 3]]})
    with pytest.raises(InputError, match="the sheets a, b hold lists; say which one is meant"):
        read_table(named)
    assert read_table(named, ListForm(sheet="b")).words["point"] == ["8"]
    with pytest.raises(InputError, match="there is no sheet c; its sheets are a, b"):
        read_table(named, ListForm(sheet="c"))
    formula = book(tmp_path, {"a": [head, ["A", "=1+1", 2, 3]]})
    with pytest.raises(InputError, match=r"list.xlsx:2: cell B2 holds a formula and no value"):
        read_table(formula)


def test_leading_zeros_that_a_format_shows_are_kept(tmp_path: Path) -> None:
    workbook = openpyxl.Workbook()
    sheet = workbook.active
    sheet.append(["Nr", "E", "N", "H"])
    sheet.append([71, 1.5, 2.5, 3.5])
    sheet["A2"].number_format = "0000"
    workbook.save(tmp_path / "a.xlsx")
    assert read_table(tmp_path / "a.xlsx").words["point"] == ["0071"]


@pytest.mark.parametrize(
    "xml",
    [
        b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><a>&x;</a>',
        b"<!-- <a> -->" + b" " * 5000 + b'<!DOCTYPE a [<!ENTITY x "y">]><a>&x;</a>',
        '<?xml version="1.0" encoding="utf-16"?><a/>'.encode("utf-16"),
    ],
)
def test_no_entity_is_read(tmp_path: Path, xml: bytes) -> None:
    path = book(tmp_path, {"a": [["Nr", "E", "N"], ["A", 1, 2]]})
    with_part(path, "xl/sharedStrings.xml", lambda _: xml)
    with pytest.raises(InputError, match="document type or an encoding"):
        read_table(path)


def test_a_damaged_style_is_refused_and_nothing_else_is_said(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = book(tmp_path, {"a": [["Nr", "E", "N"], ["A", 1, 2]]})
    with_part(path, "xl/styles.xml", lambda xml: xml.replace(b"<xf ", b"xf ", 1))
    with pytest.raises(InputError, match="the spreadsheet cannot be read"):
        read_table(path)
    assert capfd.readouterr() == ("", "")


def test_what_unpacks_without_end_is_refused(tmp_path: Path) -> None:
    path = book(tmp_path, {"a": [["Nr", "E", "N"], ["A", 1, 2]]})
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("xl/media/big.bin", b"\0" * 30_000_000)
    with pytest.raises(InputError, match="unpacks to"):
        read_table(path)


@given(
    st.floats(-1e8, 1e8, allow_nan=False),
    st.integers(0, 6),
    st.sampled_from(["/.", ",/.", "'/.", " /.", "/,", "./,", " /,"]),
)
def test_a_number_comes_back_from_any_writing(value: float, digits: int, marks: str) -> None:
    apart, decimal = marks.split("/")
    english = f"{value:,.{digits}f}"
    wanted = float(english.replace(",", ""))
    cell = english.replace(",", "t").replace(".", "d").replace("t", apart).replace("d", decimal)
    lone = digits == 0 and cell.count(apart) == 1 and apart in (",", ".") if apart else False
    read = plain(cell, "," if decimal == "," else ".")
    if lone:
        # one mark before three digits is not guessed
        with pytest.raises(ValueError, match="could not convert"):
            float(read)
    else:
        assert float(read) == wanted, cell


@given(st.lists(st.floats(-1e7, 1e7, allow_nan=False), min_size=2, max_size=20), st.integers(1, 5))
def test_the_mark_of_decimals_is_found(values: list[float], digits: int) -> None:
    path, lines = Path("a"), list(range(len(values)))
    point = [f"{v:.{digits}f}" for v in values]
    assert decimal_of(path, [point], lines, None, ";")[0] == "."
    comma = [cell.replace(".", ",") for cell in point]
    assert decimal_of(path, [comma], lines, None, ";")[0] == ","
    exact = [Exact(cell) for cell in point]
    assert decimal_of(path, [comma, exact], lines, None, "")[0] == "," if digits != 3 else True


@given(st.binary(max_size=300))
def test_any_bytes_give_a_table_or_a_sentence(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.csv"
    path.write_bytes(b"Nr;E;N\n" + data)
    with suppress(InputError):
        read_table(path)


@pytest.mark.parametrize("odd", ["\x0b", "\x0c", "\x85", "\u2028", "\u2029", "\x1e"])
def test_nothing_but_line_ends_ends_a_line(tmp_path: Path, odd: str) -> None:
    rows = [f"{name};{e};{n};{u};wall{odd}left" for name, e, n, u in POINTS]
    head = f"# of the{odd} office\npoint;e_m;n_m;u_m;code"
    path = written(tmp_path, "\n".join([head, *rows]))
    assert the_points(read_point_list(path))
    assert read_table(path).lines == [3, 4]


def test_letters_of_dos_break_no_lines(tmp_path: Path) -> None:
    """The byte of an a with grave in code page 850 is a line end of its own in Unicode."""
    data = "C A 0 0 0 ! !\n# relev\xe9 \x85 la gare\nC B 10 0 0 ! !\nC C 0 10 0\n"
    data += "D A-C 10.0 0.002 'l\x85 C\nD B-C 14.142 0.002\n"
    survey = read(written(tmp_path, data.encode("latin-1"), "a.dat"))
    (distances,) = survey.network().observations
    assert [*distances.source] == ["a.dat:5", "a.dat:6"]


def test_roles_in_other_languages(tmp_path: Path) -> None:
    """A role is never left out: it says what is held."""
    rows = "Punkt;Rechtswert;Hochwert;Rolle\nA;1,000;2,000;fest\nB;3,000;4,000;\n"
    points = read([written(tmp_path, rows)]).points
    assert [points[n].free.any() for n in "AB"] == [True, True]
    assert [points[n].free[:2].any() for n in "AB"] == [False, True]


@pytest.mark.parametrize(
    ("text", "cure"),
    [
        ("point,e_m,n_m,sigma_mm\nA,1,2,3\n", "sigma_e_mm"),
        ("from,to,de_m,dn_m,du_m,sigma_e_mm\nA,B,1,2,3,4\n", "sigma_de_mm"),
    ],
)
def test_a_sigma_that_has_no_meaning_is_not_to_be_removed(
    tmp_path: Path, text: str, cure: str
) -> None:
    with pytest.raises(InputError, match=cure) as caught:
        read_table(written(tmp_path, text))
    assert "remove" not in str(caught.value)
