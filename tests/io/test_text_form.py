"""How a text is written is decided in one place: lists and scans are read alike, or asked about."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.io.scans.scan_files import whole
from tribrach.errors import InputError
from tribrach.io.point_list import read_point_list
from tribrach.io.scans.formats import read_scans

MARKS = st.sampled_from([";", "\t", "|", ",", " ", "   ", "; ", ", "])
HEADS = st.sampled_from(
    [
        ["Nr", "E", "N", "H"],
        ["Point id", "East (m)", "North (m)", "Height (m)"],
        ["point", "x", "y", "z"],
    ]
)
CODES = st.sampled_from([None, "wall", "wall left", "a;b, c", "100"])
PLACES = st.sampled_from([(691230.0, 5334560.0, 520.0), (1000.0, 2000.0, 100.0), (1.0, 2.0, 3.0)])
numbers = itertools.count()


@given(
    MARKS, st.sampled_from(".,"), st.sampled_from(["needed", "words", "all"]), HEADS, CODES, PLACES,
    st.integers(2, 40), st.booleans(), st.booleans(),
)  # fmt: skip
def test_lists_and_scans_are_read_alike(
    tmp_path_factory: pytest.TempPathFactory,
    mark: str,
    decimal: str,
    quotes: str,
    head: list[str],
    code: str | None,
    place: tuple[float, float, float],
    rows: int,
    closed: bool,
    comment: bool,
) -> None:
    """Mark by decimals by quotes by heads by columns of words: the truth, or a question."""
    xyz = np.round(np.random.default_rng(rows).uniform(0, 9, (rows, 3)) + place, 3)

    def cell(text: str, quoted: bool) -> str:
        needed = quoted or mark.strip(" ") in text or (not mark.strip(" ") and " " in text)
        return f'"{text}"' if needed else text

    def line(*cells: str, quoted: bool, number: bool = False) -> str:
        parts = [
            cell(text, quotes == "all" or (quoted and not (number and 0 < k < 4)))
            for k, text in enumerate(cells)
        ]
        return mark.join(parts) + (mark.strip(" ") if closed else "")

    words, last = quotes != "needed", [] if code is None else [code]
    text = [line(*head, *(["Code"] if last else []), quoted=words)]
    for k, row in enumerate(xyz):
        values = (f"{v:.3f}".replace(".", decimal) for v in row)
        text.append(line(f"P{k + 1}", *values, *last, quoted=words, number=True))
    of_list = tmp_path_factory.getbasetemp() / f"list{next(numbers)}.csv"
    of_list.write_text("\n".join(text) + "\n")
    of_scan = of_list.with_suffix(".txt")
    of_scan.write_text("\n".join(["//" + text[0] if comment else text[0], *text[1:]]) + "\n")
    # thousands and decimals look alike where nothing but three digits follows commas
    unclear = decimal == "," and place[0] == 1.0 and mark.strip() != ";"
    both = decimal == mark.strip()
    if head[1] != "x":  # axes of lists want their unit
        try:
            assert np.array_equal(read_point_list(of_list).xyz, xyz)
        except InputError:
            assert unclear or (both and quotes != "all")
    try:
        (scan,) = read_scans(of_scan)
        assert np.array_equal(whole(scan).xyz, xyz)
    except InputError:
        assert unclear or both
