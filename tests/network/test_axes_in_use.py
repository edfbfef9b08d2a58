"""Levelling and plane networks: what nothing observes takes no part, and is said."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import NoStartValues
from tribrach.io.survey.formats import read_files
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.quality import assess
from tribrach.network.separability import confusable
from tribrach.network.survey import observed_part
from tribrach.project import parse_datum

LOOP = "from,to,height_difference_m,sigma_mm\nA,B,1.000,1\nB,C,2.000,1\nC,A,-3.003,1\n"
#: a square of 100 m with both diagonals; the rounding of these is 0.36 mm
SQUARE = (
    "from,to,horizontal_distance_m,sigma_horizontal_distance_mm\n"
    "A,B,100,1\nB,C,100,1\nC,D,100,1\nD,A,100,1\nA,C,141.421,1\nB,D,141.421,1\n"
)
CORNERS = {"A": (0, 0), "B": (100, 0), "C": (100, 100), "D": (0, 100)}


def adjusted(folder: Path, datum: str | None = None, **tables: str) -> Adjustment:
    """The network of CSV tables by their names."""
    for name, text in tables.items():
        (folder / f"{name}.csv").write_text(text)
    network = observed_part(read_files([folder / f"{name}.csv" for name in tables])).network()
    return adjust(network if datum is None else network.with_datum(parse_datum(datum)))


def heights(a: Adjustment) -> dict[str, float]:
    return {n: a.state.points[a.layout.index("point", n), 2] for n in "ABC"}


@pytest.mark.parametrize(
    "given",
    [
        "point,u_m,role\nA,10,fixed\n",
        "point,u_m,sigma_u_mm\nA,10,1\n",
        "point,e_m,n_m,u_m,role\nA,5,6,10,fixed\n",
        "point,e_m,n_m,u_m,role\nA,5,6,10,fixed\nB,7,8,,approximate\n",
    ],
)
def test_a_levelling_loop(tmp_path: Path, given: str) -> None:
    """A closure of 3 mm is shared by three lines of equal weight."""
    a = adjusted(tmp_path, loop=LOOP, given=given)
    assert a.dof == 1
    found = heights(a)
    assert [found[name] for name in "ABC"] == pytest.approx([10.0, 11.001, 13.002], abs=1e-9)
    assert any("plan take no part" in sentence for sentence in a.warnings)


def test_a_levelling_loop_without_a_height(tmp_path: Path) -> None:
    a = adjusted(tmp_path, "free", loop=LOOP)
    found = heights(a)
    assert found["B"] - found["A"] == pytest.approx(1.001, abs=1e-9)
    # three heights of a free network with equal weights: s^2 = 2/9 mm^2 by symmetry
    assert a.covariance("A")[2, 2] == pytest.approx(2 / 9 * 1e-6, rel=1e-6)


@pytest.mark.parametrize("up", ["", ",u_m"])
def test_a_trilateration(tmp_path: Path, up: str) -> None:
    """With heights given or not: nothing observes them."""
    height = ",55" if up else ""
    rows = "".join(f"{n},{e + 0.2},{x - 0.1}{height}\n" for n, (e, x) in CORNERS.items())
    a = adjusted(tmp_path, "free", square=SQUARE, given=f"point,e_m,n_m{up}\n{rows}")
    assert (a.dof, a.n_unknowns) == (1, 8)
    side = a.state.points[1, :2] - a.state.points[0, :2]
    assert np.hypot(*side) == pytest.approx(100.0, abs=2e-4)
    assert any("adjusted in plan" in sentence for sentence in a.warnings)


def test_a_mixed_network_is_not_cut(tmp_path: Path) -> None:
    """Where heights are observed at all, a point without one is refused."""
    lines = "from,to,height_difference_m,sigma_height_difference_mm\nA,B,1,1\n"
    rows = "".join(f"{n},{e},{x},5,fixed\n" for n, (e, x) in CORNERS.items() if n in "AB")
    given = f"point,e_m,n_m,u_m,role\n{rows}"
    with pytest.raises(NoStartValues, match="height of"):
        adjusted(tmp_path, square=SQUARE, lines=lines, given=given)


def test_what_cannot_be_told_apart_is_one_sentence(tmp_path: Path) -> None:
    """With one redundant value all tests are the same."""
    rows = "".join(f"{n},{e},{x}\n" for n, (e, x) in CORNERS.items())
    wrong = SQUARE.replace("A,C,141.421", "A,C,141.451")
    a = adjusted(tmp_path, "free", square=wrong, given=f"point,e_m,n_m\n{rows}")
    (sentence,) = confusable(a, assess(a))
    assert sentence.startswith("cannot tell which of 6 is wrong, horizontal distance A -> B (")
    assert "and 2 more: their test values are correlated by 1.00 or more" in sentence
