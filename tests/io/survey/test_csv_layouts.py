"""What kind of table a file is follows from its columns, not from the order of the kinds."""

import itertools
from pathlib import Path

import pytest

from tribrach.errors import InputError
from tribrach.io.survey.csv import file, tables
from tribrach.io.survey.csv.columns import COORDINATES, LAYOUTS, PLANNED, TableLayout, titled
from tribrach.io.survey.csv.file import read_table
from tribrach.io.survey.formats import read_files

#: of an offset from an alignment, whose keys are ends of a sight and a point of a list
OFFSETS = TableLayout("offsets", ("from", "to", "point"), ("from", "to", "point"), ("length",))


@pytest.mark.parametrize(
    ("a", "b"), list(itertools.combinations(LAYOUTS, 2)), ids=lambda one: one.name
)
def test_no_file_can_be_two_kinds_of_table(a: TableLayout, b: TableLayout) -> None:
    """A file that both kinds take is of the kind that needs more: the needs have to say which."""
    needs = set(a.needs), set(b.needs)
    both = all(map(a.knows, b.needs)) and all(map(b.knows, a.needs))
    assert not both or needs[0] < needs[1] or needs[1] < needs[0], (
        f"a file with {', '.join(sorted(needs[0] | needs[1]))} is a table of {a.name} and one of "
        f"{b.name}: let one of them need a column that the other does not know"
    )


@pytest.mark.parametrize("last", [False, True])
def test_a_new_kind_of_table_may_stand_anywhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, last: bool
) -> None:
    path = tmp_path / "table.csv"
    kinds = (*LAYOUTS, OFFSETS) if last else (OFFSETS, *LAYOUTS)
    monkeypatch.setattr(file, "LAYOUTS", kinds)
    for layout in kinds:
        columns = [titled(name) for name in (*layout.needs, "comment")]
        path.write_text(",".join(columns) + "\n" + "," * (len(columns) - 1) + "\n")
        assert read_table(path).layout is layout


def test_every_kind_of_table_has_a_reader() -> None:
    """Only planned observations are read by themselves."""
    assert set(LAYOUTS) - tables._READERS.keys() == {PLANNED}


def test_a_column_that_no_kind_takes_is_refused_by_the_nearest_kind(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("point,e_m,n_m,u_m,face\nA,1,2,3,1\n")
    with pytest.raises(InputError, match=f"column face .* table of {COORDINATES.name}"):
        read_table(path)


@pytest.mark.parametrize("column", ["height_instrument_of", "sigma_height_target_mm"])
def test_unknown_heights_of_levelled_rows_are_refused(tmp_path: Path, column: str) -> None:
    """A height that a height difference cannot use is not ignored without a word."""
    path = tmp_path / "levels.csv"
    path.write_text(f"from,to,height_difference_m,sigma_mm,{column}\nA,B,1,1,\nB,C,1,1,1.5\n")
    with pytest.raises(InputError, match="has no effect") as caught:
        read_files([path])
    assert caught.value.line == 3
