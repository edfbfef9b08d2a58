"""Lists with more points than were observed: the others are named and left out."""

from pathlib import Path

import pytest

from tests.cli.test_bad_scans import RUN
from tribrach.cli import app
from tribrach.io.survey.formats import read_files
from tribrach.network.adjustment import adjust
from tribrach.network.survey import observed_part

SIGHTS = (
    "from,to,horizontal_distance_m,sigma_horizontal_distance_mm\n"
    "A,P,70.712,1\nB,P,70.710,1\nC,P,70.711,1\nD,P,70.711,1\n"
)
LIST = (
    "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm,role\n"
    "A,0,0,3,1,1,1,control\nB,100,0,3,1,1,1,control\nC,0,100,3,,,,fixed\nD,100,100,3,,,,fixed\n"
)
FURTHER = (
    "W,1,2,3,1,1,1,control\nX,1,2,4,,,,fixed\nY,1,2,5,,,,approximate\nZ,1,2,6,1,1,1,check\n"
    "P,50,50,,1,1,,check\n"
)


@pytest.fixture
def files(tmp_path: Path) -> list[Path]:
    out = [tmp_path / "sights.csv", tmp_path / "list.csv"]
    out[0].write_text(SIGHTS)
    out[1].write_text(LIST + FURTHER)
    return out


def test_nothing_else_changes(files: list[Path]) -> None:
    """Coordinates, sigmas and redundancy are those of the list without the other points."""
    got = adjust(observed_part(read_files(files)).network())
    assert got.network.start.layout.names["point"] == ("A", "B", "C", "D", "P")
    assert got.warnings[0] == "Points W, X, Y, Z are given and observed by nothing: left out."
    files[1].write_text(
        LIST.replace(",3,1,1,1", ",,1,1,").replace(",3,,,,", ",,,,,") + "P,50,50,,1,1,,check\n"
    )
    alone = adjust(observed_part(read_files(files)).network())
    assert not any("left out" in sentence for sentence in alone.warnings)
    assert got.dof == alone.dof
    for name in "AP":
        assert got.covariance(name) == pytest.approx(alone.covariance(name), abs=1e-15)


def test_the_command_says_so(files: list[Path]) -> None:
    result = RUN.invoke(app, ["adjust", *map(str, files)])
    assert result.exit_code == 0, result.output
    assert "Points W, X, Y, Z are given and observed by nothing: left out" in result.output
    job = files[0].with_name("job.toml")
    job.write_text('[[points]]\nfile = "list.csv"\n[[observations]]\nfile = "sights.csv"\n')
    result = RUN.invoke(app, ["run", str(job)])
    assert result.exit_code == 0, result.output
    assert "Points W, X, Y, Z are given" in result.output


def test_a_list_alone_stays(files: list[Path]) -> None:
    survey = read_files(files[1:])
    assert observed_part(survey) is survey
