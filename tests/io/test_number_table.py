"""Columns of numbers: titles with units, and sentences with the line of what is wrong."""

from pathlib import Path

import pytest

from tribrach.errors import InputError
from tribrach.io.number_table import read_numbers


def written(folder: Path, text: str | bytes) -> Path:
    path = folder / "t.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


@pytest.mark.parametrize("title", ["range", "range_m", "Range [m]", "range (m)", "RANGE(m)"])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_titles(tmp_path: Path, title: str, separator: str) -> None:
    text = f"# remark\nsite{separator}{title}\n\nA{separator}1.5\nB{separator}-2e1\n"
    table = read_numbers(written(tmp_path, text), ["range"])
    assert table.values["range"].tolist() == [1.5, -20.0]
    assert table.units["range"] == ("m" if "m" in title.lower().replace("range", "") else "")
    assert len(table) == 2


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("range\n", "no rows"),
        ("rnge\n1\n", "no column range; did you mean rnge"),
        ("range_m,range_ft\n1,2\n", "both are range"),
        ("range,x\n1,2\n3\n", "t.csv:3: the row has 1 cells"),
        ("range;x\n1,5;2\n2.5;2\n3.5;2\n", "write decimals with a point"),
        ("range\tx\n1,500\t2\n", "1,500 may be a number with decimals or one in thousands"),
        ("range,x\n,2\n", "t.csv:2: range is empty"),
        ("range,x\nnan,2\n", "not a number"),
        ("range,x\ninf,2\n", "not a number"),
        ("range,x\n1e308,2\n", "t.csv:2: range is 1e308, too large to be fitted"),
        (b"range,x\n\xff,2\n", "t.csv:2: range is 'ÿ', not a number"),
        (b"range,x\n\x00,2\n", "not text"),
        ('range,x\n"1\n2",2\n', "several lines"),
    ],
)
def test_wrong_files(tmp_path: Path, text: str | bytes, words: str) -> None:
    with pytest.raises(InputError, match=words.replace("(", r"\(")):
        read_numbers(written(tmp_path, text), ["range"])


def test_absent_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_numbers(tmp_path / "none.csv", ["range"])
