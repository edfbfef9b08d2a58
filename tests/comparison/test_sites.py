"""Test sites: which points are in them, how scanners see them, tables that name them."""

from pathlib import Path

import numpy as np
import pytest

from tests.comparison.clouds import in_memory
from tribrach.comparison.sites import ComparisonSite, Geometry, cut, seen_from
from tribrach.errors import InputError
from tribrach.io.site_table import read_sites

RNG = np.random.default_rng(1)
POINTS = RNG.uniform(0, 10, (5000, 3))
BALL = ComparisonSite.ball("ball", (5.0, 5.0, 5.0), 2.0)
BOX = ComparisonSite("box", (1.0, 2.0, 3.0), (2.0, 4.0, 6.0))


@pytest.mark.parametrize("margin", [0.0, 0.5])
def test_points_inside(margin: float) -> None:
    ball = np.linalg.norm(POINTS - 5, axis=1) <= 2 + margin
    assert (BALL.inside(POINTS, margin) == ball).all()
    low, high = np.array(BOX.low) - margin, np.array(BOX.high) + margin
    box = (np.clip(POINTS, low, high) == POINTS).all(axis=1)
    assert (BOX.inside(POINTS, margin) == box).all()
    assert 0 < box.sum() < ball.sum()


def test_a_stream_is_cut_in_one_pass(tmp_path: Path) -> None:
    far = ComparisonSite.ball("far", (500.0, 0.0, 0.0), 1.0)
    heard: list[int] = []
    spool = cut(in_memory(POINTS), [BALL, far, BOX], tmp_path, 0.25, heard.append)
    assert (spool.points(0) == POINTS[BALL.inside(POINTS, 0.25)]).all()
    assert (spool.points(2) == POINTS[BOX.inside(POINTS, 0.25)]).all()
    assert spool.counts[1] == 0
    assert heard == [5000]


def test_range_and_incidence() -> None:
    places = np.array([[0.0, 10.0, 0.0], [10.0, 10.0, 0.0], [3.0, 10.0, 1.0]])
    normals = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [np.nan] * 3])
    seen = seen_from(np.zeros(3), places, normals)
    assert seen == Geometry(
        pytest.approx((10 + np.sqrt(200) + np.sqrt(110)) / 3), pytest.approx(np.pi / 8)
    )
    assert seen_from(np.zeros(3), places, np.full((3, 3), np.nan)) == Geometry(
        pytest.approx(11.55, abs=0.01), None
    )
    assert seen_from(np.zeros(3), np.empty((0, 3)), np.empty((0, 3))) is None


def test_tables(tmp_path: Path) -> None:
    path = tmp_path / "sites.csv"
    path.write_text("# façade\nName,x,y,z,radius,note\nW1,1,2,3.5,0.5,left\n\nW 2,-4,5,6,1,right\n")
    one, two = read_sites(path)
    assert one == ComparisonSite.ball("W1", (1.0, 2.0, 3.5), 0.5)
    assert (two.name, two.radius, two.center.tolist()) == ("W 2", 1.0, [-4.0, 5.0, 6.0])
    path.write_text("\ufeffname;xmin;ymin;zmin;xmax;ymax;zmax\nA;1;2;3;2;4;6\n", encoding="utf-8")
    assert read_sites(path) == [ComparisonSite("A", BOX.low, BOX.high)]


@pytest.mark.parametrize(
    ("text", "words", "line"),
    [
        ("name,x,y,z,radius\nA,1,2,3,0\n", "the radius is 0", 2),
        ("name,x,y,z,radius\nA,1,2,3,-1\n", "the radius is -1", 2),
        ("name,x,y,z,radius\n# c\nA,1,2,abc,1\n", "z is 'abc', not a number", 3),
        ("name,x,y,z,radius\nA,1,2,nan,1\n", "z is 'nan', not a number", 2),
        ("name,x,y,z,radius\nA,1,2,,1\n", "z is '', not a number", 2),
        ("name,x,y,z,radius\nA,1,2,3\n", "the row has 4 cells, the header has 5", 2),
        ("name,x,y,z,radius\nA,1,2,3,1\nA,1,2,3,1\n", "there is a site 'A' above", 3),
        ("name,x,y,z,radius\n ,1,2,3,1\n", "the site has no name", 2),
        ("name,x,x,y,z,radius\nA,1,1,2,3,1\n", "the column 'x' is there twice", 1),
        ("name,x,y,z\nA,1,2,3\n", "the columns do not say what the sites are", 1),
        ("x,y,z,radius\n1,2,3,1\n", "the columns do not say what the sites are", 1),
        (
            "name,x,y,z,radius,xmin,ymin,zmin,xmax,ymax,zmax\n",
            "there are no rows under the header",
            1,
        ),
        (
            "name,x,y,z,radius,xmin,ymin,zmin,xmax,ymax,zmax\nA,1,1,1,1,1,1,1,2,2,2\n",
            "the columns are those of balls and of boxes",
            1,
        ),
        ("name,xmin,ymin,zmin,xmax,ymax,zmax\nA,1,2,3,2,1,4\n", "ymin is not below ymax", 2),
        ("", "empty", None),
        ("name,x,y,z,radius\0\n", "not text", None),
    ],
)
def test_what_is_no_table(tmp_path: Path, text: str, words: str, line: int | None) -> None:
    path = tmp_path / "sites.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        read_sites(path)
    assert caught.value.file == path
    assert caught.value.line == line


def test_names_of_another_encoding(tmp_path: Path) -> None:
    path = tmp_path / "sites.csv"
    path.write_bytes(b"name,x,y,z,radius\nT\xfcr,1,2,3,1\n")
    assert read_sites(path)[0].name == "Tür"


def test_no_table_at_all(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="read"):
        read_sites(tmp_path / "absent.csv")
