"""Everything that a file says wrong is told in one run, by file and line, and nothing else."""

import pickle
from pathlib import Path

import numpy as np
import pytest

from tests.io.survey.dynadjust_files import Gnss, Line, Network, Station, write_dna, write_xml
from tests.io.survey.gama_files import document
from tests.io.survey.riscan_files import Rsp, Scan
from tests.io.survey.riscan_files import write as write_riscan
from tribrach.errors import InputError, NoStartValues, RefusalCollector, Refusals
from tribrach.io.survey.dynadjust import reader as dynadjust
from tribrach.io.survey.formats import read_files
from tribrach.project import Project


def refusals(*paths: Path) -> list[tuple[str, int | None, str]]:
    """File, line and sentence of everything that a reading refuses."""
    with pytest.raises(InputError) as caught:
        read_files(paths)
    error = caught.value
    parts = error.errors if isinstance(error, Refusals) else (error,)
    return [(Path(str(part.file)).name, part.line, part.what) for part in parts]


def lines(*paths: Path) -> list[int | None]:
    return [line for _, line, _ in refusals(*paths)]


def written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder / name


def collected(refusal: InputError | None, last: Exception | None = None) -> None:
    """A block in which one record is refused and that something else may end."""
    with RefusalCollector() as refused:
        with refused.record():
            if refusal is not None:
                raise refusal
        if last is not None:
            raise last


class TestCollector:
    def test_one_refusal_stays_as_it_is(self) -> None:
        with pytest.raises(InputError) as caught:
            collected(InputError("x is wrong", file="a", line=3, cure="correct it"))
        assert str(caught.value) == "a:3: x is wrong; correct it."
        assert type(caught.value) is InputError

    def test_several_are_listed_by_line_and_bounded(self) -> None:
        refused = RefusalCollector()
        for line in range(50, 0, -1):
            refused.add(InputError(f"x{line}", file="a", line=line))
        error = refused.error()
        assert isinstance(error, Refusals)
        assert (error.count, len(error.errors), error.line) == (50, 20, 31)
        words = str(error).splitlines()
        assert words[0] == "50 records are refused:"
        assert words[1] == "  - a:31: x31."
        assert words[-1] == "  - and 30 more."
        assert len(words) == 22

    def test_one_cause_is_one_sentence(self) -> None:
        refused = RefusalCollector()
        for line in (4, 2, 9):
            refused.add(InputError("no sigma", file="a", line=line, cure="add it"))
        refused.add(InputError("no sigma", file="b", line=1, cure="add it"))
        assert str(refused.error()).splitlines() == [
            "4 records are refused:",
            "  - a:2 (and 2 more lines): no sigma; add it.",
            "  - b:1: no sigma; add it.",
        ]

    def test_the_same_sentence_counts_once_and_lists_add_up(self) -> None:
        inner, outer = RefusalCollector(), RefusalCollector()
        for line in (1, 2, 2):
            inner.add(InputError("x", file="a", line=line))
        outer.add(inner.error())
        outer.add(InputError("x", file="a", line=1))
        outer.add(InputError("y", file="b", line=9))
        assert outer.count == 3
        error = outer.error()
        assert [(e.file, e.line) for e in error.errors] == [("a", 1), ("a", 2), ("b", 9)]

    def test_what_fails_on_the_rest_of_a_file_is_not_told(self) -> None:
        with pytest.raises(InputError, match="x is wrong"):
            collected(InputError("x is wrong"), NoStartValues("P is observed by nothing"))

    def test_other_exceptions_pass(self) -> None:
        with pytest.raises(ZeroDivisionError):
            collected(InputError("x is wrong"), ZeroDivisionError())
        with pytest.raises(NoStartValues):
            collected(None, NoStartValues("P is observed by nothing"))

    def test_refusals_are_pickled(self) -> None:
        error = Refusals([InputError("x", file="a", line=1), InputError("y")], 7)
        again = pickle.loads(pickle.dumps(error))
        assert str(again) == str(error)
        assert (again.count, again.errors[0].line) == (7, 1)


def test_gama(tmp_path: Path) -> None:
    body = (
        '<point id="A" x="0" y="0" fix="xy"/>\n'  # 6
        '<point id="B" x="100" y="zero" fix="xy"/>\n'  # 7
        '<point id="P" adj="yx"/>\n'  # 8
        '<obs from="A">\n'
        '<distance to="B" val="-100" stdev="1"/>\n'  # 10
        '<distance to="P" val="50" sigma="1"/>\n'  # 11
        '<distance to="P" val="50" stdev="1"/>\n'
        '<bearing to="P" val="50"/>\n'  # 13
        '<cov-mat dim="9" band="0">1</cov-mat>\n'  # not told: the cluster is not whole
        "</obs>\n"
        '<height-differences><dh from="A" to="P" val="x" stdev="1"/></height-differences>'  # 16
    )
    assert lines(written(tmp_path, "net.gkf", document(body, 'angles="left-handed"'))) == [
        7,
        8,
        10,
        11,
        13,
        16,
    ]


def test_several_files_in_one_run(tmp_path: Path) -> None:
    first = written(tmp_path, "a.csv", "point,e_m,n_m,u_m\nA,1,2,x\nB,1,2,3\nC,1,2,inf\n")
    second = written(tmp_path, "b.csv", "from,to,slope_distance_m\nA,B,7\n")
    found = refusals(first, tmp_path / "none.csv", second)
    assert [(name, line) for name, line, _ in found] == [("none.csv", None)]
    found = refusals(first, second)
    assert [(name, line) for name, line, _ in found] == [("a.csv", 2), ("a.csv", 4), ("b.csv", 2)]


def test_csv_tables(tmp_path: Path) -> None:
    head = "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm,role,use\n"
    rows = [
        "A,0,0,0,1,1,1,control,on",
        "B,0,0,0,1,1,1,kontrol,on",  # 3
        "C,0,0,0,1,1,1,control,maybe",  # 4
        ",0,0,0,1,1,1,control,on",  # 5
        "D,0,0,0,1,,1,control,on",  # 6
        "A,0,0,0,1,1,1,control,on",  # 7: twice
        "E,,,,1,1,1,control,on",  # 8
        "F,0,0,0,1,1,1,control,on",
    ]
    path = written(tmp_path, "points.csv", head + "\n".join(rows) + "\n")
    assert lines(path) == [3, 4, 5, 6, 7, 8]
    cells = written(tmp_path, "cells.csv", head + "A,x,0,0,0,1,1,,\nB,0,y,0,1,1,-1,,\n")
    assert lines(cells) == [2, 2, 3, 3]
    columns = written(tmp_path, "columns.csv", "gnss,e,n_feet,quality\nA,1,2,3\n")
    assert lines(columns) == [1, 1, 1]
    short = written(tmp_path, "short.csv", "point,e_m,n_m\nA,1\nB,1,2\nC,1,2,3\n")
    assert lines(short) == [2, 4]
    sights = written(
        tmp_path,
        "sights.csv",
        "from,to,slope_distance_m,sigma_slope_distance_mm,direction_gon,sigma_direction_cc\n"
        "A,B,-5,1,10,3\nA,,5,1,10,3\nA,C,5,,10,3\nA,D,5,1,10,\n",
    )
    assert lines(sights) == [2, 3, 4, 5]


@pytest.mark.parametrize("write", [write_dna, write_xml])
def test_dynadjust(tmp_path: Path, write) -> None:
    stations = [Station(n, ["-4e6", "2.8e6", "-4e6"]) for n in "ABC"]
    sights = [Line("S", ("A", "B"), 10.0 * k, 0.01) for k in range(1, 5)]
    sights[1] = Line("S", ("A", "Q"), 10.0, 0.01)
    sights[3] = Line("S", ("Z", "B"), 10.0, 0.01)
    paths = write(Network(stations, sights), tmp_path)
    with pytest.raises(Refusals) as caught:
        dynadjust.read(paths)
    assert [error.what[:11] for error in caught.value.errors] == ["station Q i", "station Z i"]
    text = paths[1].read_text().replace("20.0000", "20.0x00").replace("10.0000", "1o.0000")
    paths[1].write_text(text)
    with pytest.raises(InputError) as one:
        dynadjust.read(paths)
    assert "not a number" in str(one.value)
    stations[1] = Station("B", ["-4e6", "2.8e6", "north"])
    stations[2] = Station("C", ["-4e6", "east", "-4e6"])
    paths = write(Network(stations, [Line("S", ("A", "B"), 10.0, 0.01)]), tmp_path)
    with pytest.raises(Refusals) as caught:
        dynadjust.read(paths)
    assert [error.what.split(" ")[:4] for error in caught.value.errors] == [
        ["Z", "of", "station", "B"],
        ["Y", "of", "station", "C"],
    ]


def test_a_dna_cluster_that_is_refused_takes_no_others_with_it(tmp_path: Path) -> None:
    """The lines of its entries are skipped, and the measurements behind it are looked at."""
    stations = [Station(n, ["-4e6", "2.8e6", "-4e6"]) for n in "ABC"]
    c = 1e-6 * np.eye(6)
    values = [["1.0", "2.0", "3.0"], ["4.0", "5.0", "6.0"]]
    cluster = Gnss("X", [("A", "B"), ("A", "C")], values, c)
    broken = Gnss("X", [("A", "B"), ("A", "C")], values, c)
    last = Line("S", ("A", "B"), 77.0, 0.01)
    paths = write_dna(Network(stations, [broken, cluster, last]), tmp_path)
    text = paths[1].read_text().replace("1.0000000000000e-06", "1.0000000000000x-06", 1)
    paths[1].write_text(text.replace("77.0000", "77.oooo"))
    with pytest.raises(Refusals) as caught:
        dynadjust.read(paths)
    assert [error.what.split(" is ")[0] for error in caught.value.errors] == [
        "a variance",
        "the value",
    ]


def test_riscan(tmp_path: Path) -> None:
    fine, bare = ((1.0, 2.0, 3.0), (0.004, 0.002, 0.002)), ((3.0, 2.0, 1.0), None)
    scans = [Scan("S1", {"a": fine, "b": bare}), Scan("S2", {"a": bare, "b": fine})]
    path = write_riscan(Rsp(scans), tmp_path / "project.rsp")
    assert [what for _, _, what in refusals(path)] == [
        "reflector b has no accuracy above zero",
        "reflector a has no accuracy above zero",
    ]


def test_comp3d(tmp_path: Path) -> None:
    cor = "1 A 0 0 0 0.1 0.1 0.1\n1 B 10 0 0\n7 C x 0 0 1 1 1\n0 D 5 5 0\n"
    obs = "3 A D 7.07 0.01\n3 A A 1 0.01\n99 A D 1 1\n3 B D -5 0.01\n"
    found = refusals(written(tmp_path, "n.cor", cor), written(tmp_path, "n.obs", obs))
    assert [(name, line) for name, line, _ in found] == [
        ("n.cor", 2),
        ("n.cor", 3),
        ("n.obs", 2),
        ("n.obs", 3),
        ("n.obs", 4),
    ]


def test_project(tmp_path: Path) -> None:
    text = (
        "title = 3\n"
        "[site]\nlatitude_deg = 'north'\n"
        "[[points]]\nfile = 'points.csv'\nrole = 'king'\n"
        "[[scans]]\nfile = 'a.e57'\norigin = [1, 'x']\n"
        "[[observations]]\nfiel = 'sights.csv'\n"
    )
    with pytest.raises(Refusals) as caught:
        Project.load(written(tmp_path, "job.toml", text))
    assert [error.line for error in caught.value.errors] == [1, 3, 6, 9, 11]
