"""Targets on rods over marks: what the table says, what the instrument says, what is wrong."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.instruments.precision import Precision
from tribrach.io.survey.csv.reader import Context
from tribrach.io.survey.csv.tables import read
from tribrach.job.name_targets import known_points
from tribrach.network.adjustment import adjust
from tribrach.network.survey import Survey
from tribrach.observations.control import Offsets
from tribrach.observations.gnss import GnssPositions

ROD = Context(precision=Precision(rod=0.0005, bubble=np.radians(8 / 60), eccentricity=0.001))


def table(folder: Path, text: str) -> Path:
    path = folder / "rods.csv"
    path.write_text(text)
    return path


def offsets(survey: Survey) -> Offsets:
    (found,) = [o for o in survey.network().observations if isinstance(o, Offsets)]
    return found


def test_the_instrument_gives_what_the_table_does_not(tmp_path: Path) -> None:
    """A bubble of 8 arc minutes leans a rod by 2.33 mm per metre."""
    found = offsets(read(table(tmp_path, "mark,target,rod_m\nM1,P1,2\nM2,P2,1\n"), ROD))
    assert found.values == pytest.approx(np.array([[0, 0, 2.0], [0, 0, 1.0]]))
    sigma = found.sigma
    assert sigma[:, 2] == pytest.approx(0.0005)
    assert sigma[1, 0] == pytest.approx(np.hypot(0.002327, 0.001), abs=1e-6)
    assert sigma[0, 1] == pytest.approx(np.hypot(2 * 0.002327, 0.001), abs=2e-6)


def test_the_table_goes_first(tmp_path: Path) -> None:
    text = "mark,target,rod_mm,sigma_rod_mm,bubble_arcmin,eccentricity_mm\nM1,P1,1500,2,4,0\n"
    found = offsets(read(table(tmp_path, text), ROD))
    assert found.values[0, 2] == pytest.approx(1.5)
    expected = (1.5 * np.radians(4 / 60), 1.5 * np.radians(4 / 60), 0.002)
    assert found.sigma[0] == pytest.approx(expected)


def test_a_target_stands_over_its_mark(tmp_path: Path) -> None:
    """Position and covariance of the target: GNSS of the mark, and rod and bubble on top of it."""
    survey = read(table(tmp_path, "mark,target,rod_m\nM1,P1,2\n"), ROD)
    survey.add(
        GnssPositions,
        values=[[10.0, 20.0, 102.0]],
        sigma=[[0.02, 0.02, 0.05]],
        position=["M1"],
        antenna_height=[2.0],
    )
    adjustment = adjust(survey.network())
    layout = adjustment.layout
    assert adjustment.state.points[layout.index("point", "P1")] == pytest.approx([10, 20, 102])
    c = adjustment.covariance("P1")
    plan = 0.02**2 + (2 * np.radians(8 / 60)) ** 2 + 0.001**2
    assert np.diag(c) == pytest.approx([plan, plan, 0.05**2 + 0.0005**2], rel=1e-9)
    # the mark is no target that a scan could show
    assert set(known_points(survey)) == {"P1"}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("mark,target,rod_m\nM1,P1,-2\n", r"rods\.csv:2: the rod is -2 m long"),
        ("mark,target,rod_m\nM1,M1,2\n", "mark and target are both M1"),
        ("mark,target,rod_m\nM1,,2\n", "target is empty"),
        ("mark,target,rod_m\nM1,P1,\n", "rod_m is empty"),
        ("mark,target,rod\nM1,P1,2\n", "column rod has no unit"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read(table(tmp_path, text), ROD)


def test_sigmas_must_be_there(tmp_path: Path) -> None:
    path = table(tmp_path, "mark,target,rod_m\nM1,P1,2\n")
    with pytest.raises(InputError, match="there is no sigma_rod"):
        read(path)
    with pytest.raises(InputError, match="there is no bubble"):
        read(path, Context(precision=Precision(rod=0.001)))
    with pytest.raises(InputError, match="neither bubble nor eccentricity"):
        read(path, Context(precision=Precision(rod=0.001, bubble=0.0, eccentricity=0.0)))
