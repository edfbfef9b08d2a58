"""Names that a spreadsheet would take for formulas, written and read again."""

import csv
from pathlib import Path

import numpy as np
import pytest

from tribrach.io.csv_rows import name_cell, read_rows
from tribrach.io.point_list import point_list_text, read_point_list

NAMES = ["=1+1", "+A", "-7", "@x", "'=A", "'A", " =A", "A", "=HYPERLINK(\"http://a\", 'b')"]


@pytest.mark.parametrize("name", NAMES)
def test_no_cell_begins_like_a_formula(name: str) -> None:
    assert name_cell(name).lstrip()[:1] not in set("=+-@")


def test_names_come_back(tmp_path: Path) -> None:
    names = [name.strip() for name in NAMES if name != "'=A"]
    path = tmp_path / "a.csv"
    path.write_text(point_list_text(names, np.zeros((len(names), 3)), None))
    written = [row[0] for row in csv.reader(path.read_text().splitlines())]
    assert not any(cell[0] in "=+-@" for cell in written)
    assert read_point_list(path).names == tuple(names)


def test_numbers_are_no_names(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("point,x,note\n'-A,-1.5,'twas\n")
    assert read_rows(path).cells[1] == ["-A", "-1.5", "'twas"]
