"""Names equal but for case, spaces or Unicode form: a hint, and none for the innocent."""

import unicodedata
from pathlib import Path

import pytest

from tests.cli.test_bad_scans import RUN
from tribrach.cli import app
from tribrach.errors import AdjustmentError
from tribrach.io.survey.formats import read_files
from tribrach.network.adjustment import adjust
from tribrach.network.alike_names import alike_groups, look_alike
from tribrach.network.survey import observed_part

HEAD = "from,to,horizontal_distance_m,sigma_horizontal_distance_mm\n"
LIST = (
    "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm,role\n"
    "A,0,0,3,1,1,1,control\nB,100,0,3,1,1,1,control\nC,0,100,3,1,1,1,control\n"
)
MUELLER = "Müller"
DECOMPOSED = unicodedata.normalize("NFD", MUELLER)


def survey(folder: Path, sights: str, points: str = LIST):
    (folder / "sights.csv").write_text(HEAD + sights, encoding="utf-8")
    (folder / "list.csv").write_text(points, encoding="utf-8")
    return observed_part(read_files([folder / "sights.csv", folder / "list.csv"]))


def hints(sentences) -> list[str]:
    return [s for s in sentences if "differ only in" in s]


def test_groups() -> None:
    assert alike_groups(["P1", "p1", "P2", "A 1", "A  1", "x"]) == [("P1", "p1"), ("A 1", "A  1")]
    assert alike_groups([MUELLER, DECOMPOSED]) == [(MUELLER, DECOMPOSED)]
    assert look_alike(MUELLER, DECOMPOSED)
    assert not look_alike("P1", "p1")
    # a letter of another alphabet, and a digit, are other names
    assert alike_groups(["P1", "Р1", "PO", "P0"]) == []


def test_a_given_point_beside_an_observed_one(tmp_path: Path) -> None:
    """``c`` is sighted and ``C`` is in the list: the network loses a control point silently."""
    found = survey(
        tmp_path, "A,P,70.712,1\nB,P,70.710,1\nc,P,70.711,1\nA,c,100.001,1\nB,c,141.42,1\n"
    )
    (hint,) = hints(found.warnings)
    assert hint.startswith("Names C and c differ only in case, and the one is given and not")
    result = RUN.invoke(app, ["adjust", str(tmp_path / "sights.csv"), str(tmp_path / "list.csv")])
    assert result.exit_code == 0, result.output
    assert "Names C and c differ only in case" in " ".join(result.output.split())


def test_names_that_look_the_same(tmp_path: Path) -> None:
    """Both are observed: on the screen they are one name."""
    sights = "".join(
        f"{a},{name},{d},1\n"
        for name, distances in ((MUELLER, (70.7, 70.7, 70.7)), (DECOMPOSED, (70.71, 70.7, 70.7)))
        for a, d in zip("ABC", distances, strict=True)
    )
    (hint,) = hints(survey(tmp_path, sights).warnings)
    assert "differ only in the Unicode form of their characters" in hint


def test_two_points_that_are_both_known_are_left_alone(tmp_path: Path) -> None:
    first = "A,P,70.7,1\nB,P,70.7,1\nC,P,70.7,1\n"
    second = "A,p,50,1\nB,p,111.8,1\nC,p,111.8,1\n"
    assert hints(survey(tmp_path, first + second).warnings) == []
    # and so is a point of the list that nobody sighted beside one that is in the list as well
    further = LIST + "a,5,5,5,1,1,1,control\n"
    assert hints(survey(tmp_path, first, further).warnings) == []


def test_an_adjustment_that_fails_says_so(tmp_path: Path) -> None:
    """``p`` has two distances less than it takes, as they went to ``P``."""
    found = survey(tmp_path, "A,P,70.7,1\nB,P,70.7,1\nC,P,70.7,1\nA,p,70.7,1\n")
    with pytest.raises(AdjustmentError, match="Names P and p differ only in case: write them") as e:
        adjust(found.network())
    assert sum("differ only" in sentence for sentence in e.value.sentences) == 1
    # c is sighted once, and C, which would have held it, was left out
    found = survey(tmp_path, "A,P,70.7,1\nB,P,70.7,1\nc,P,70.7,1\n")
    with pytest.raises(AdjustmentError, match="Names C and c differ only in case, and the one"):
        adjust(found.network())
    result = RUN.invoke(app, ["adjust", str(tmp_path / "sights.csv"), str(tmp_path / "list.csv")])
    assert result.exit_code == 2
    assert "Names C and c differ only in case" in " ".join(result.output.split())
