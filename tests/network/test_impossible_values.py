"""Numbers that no survey has, and points in one place: a sentence, before anything overflows."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tribrach.calibration import minimum_norm
from tribrach.errors import InputError, NotConverged
from tribrach.io.survey.formats import read_files
from tribrach.network.adjustment import adjust
from tribrach.network.observed_part import observed_part
from tribrach.network.survey import Survey
from tribrach.observations.sights import Distances, SlopeDistances, ZenithAngles

FIXED = (False, False, False)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (np.nan, "distance is not a number"),
        (-np.inf, "not a number"),
        (1e300, "is 1e\\+300, beyond"),
    ],
)
def test_measured(value: float, words: str) -> None:
    with pytest.raises(InputError, match=f"net.csv:7: .*{words}"):
        Survey().add(
            Distances,
            values=[10.0, value],
            sigma=0.001,
            start=["A", "A"],
            end=["B", "C"],
            source=["net.csv:6", "net.csv:7"],
        )


@pytest.mark.parametrize("sigma", [0.0, -1.0, np.nan, np.inf, 1e-200, 1e200])
def test_sigmas(sigma: float) -> None:
    """Their squares must neither vanish nor overflow, whichever way they are given."""
    columns: dict[str, Any] = {"start": ["A"], "end": ["B"], "source": ["net.csv:6"]}
    with pytest.raises(InputError, match=r"net.csv:6: sigma of distance is"):
        Survey().add(Distances, values=[10.0], sigma=sigma, **columns)
    with pytest.raises(InputError, match=r"net.csv:6: (sigma|covariance) of distance is"):
        Survey().add(Distances, values=[10.0], covariance=[[[sigma * abs(sigma)]]], **columns)


def test_heights_and_coordinates() -> None:
    with pytest.raises(InputError, match=r"net.csv:2: height target of zenith is -2\.14748e\+09 m"):
        Survey().add(
            ZenithAngles,
            values=[1.5, 1.5],
            sigma=1e-5,
            start=["A", "A"],
            end=["B", "C"],
            height_instrument=1.6,
            height_target=[1.3, -2147483649.0],
            source=["net.csv:1", "net.csv:2"],
        )
    with pytest.raises(InputError, match=r"P has a coordinate of 1e\+200 m"):
        Survey().point("P", (0.0, -1e200, np.nan))


def test_points_in_one_place_have_no_direction() -> None:
    survey = Survey()
    survey.point("A", (5.0, 5.0, 1.0), free=FIXED, role="control")
    survey.point("B", (5.0, 5.0, 1.0), free=(True, False, False))
    survey.point("C", (15.0, 5.0, 1.0), free=(True, False, False))
    survey.add(SlopeDistances, values=[10.0], sigma=0.001, start=["A"], end=["C"])
    survey.add(
        SlopeDistances,
        values=[4.0],
        sigma=0.001,
        start=["A"],
        end=["B"],
        source=["net.csv:9"],
    )
    with pytest.raises(NotConverged, match=r"slope distance A -> B \(net.csv:9\)"):
        adjust(survey.network())


@pytest.mark.parametrize("cell", ["1e308", "-1e200", "1_0", "inf", "nan", "0x10"])
@pytest.mark.parametrize("column", ["height_difference_m", "sigma_height_difference_mm"])
def test_cells_of_tables(tmp_path: Path, column: str, cell: str) -> None:
    path = tmp_path / "net.csv"
    other = "sigma_height_difference_mm" if column[0] == "h" else "height_difference_m"
    path.write_text(f"from,to,{column},{other}\nA,B,1,1\nB,C,{cell},1\n")
    with pytest.raises(InputError, match=f"net.csv:3: {column} is '?{cell}"):
        read_files([path])


def test_a_matrix_that_cannot_be_inverted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rounding may leave nothing to be inverted where a reading is far off."""

    def singular(matrix: object) -> None:
        raise np.linalg.LinAlgError("Singular matrix")

    (tmp_path / "net.csv").write_text(
        "from,to,height_difference_m,sigma_height_difference_mm\nA,B,1,1\nB,C,1,1\nC,A,-2,1\n"
    )
    network = observed_part(read_files([tmp_path / "net.csv"])).network()
    monkeypatch.setattr(np.linalg, "inv", singular)
    with pytest.raises(NotConverged, match=r"cannot be inverted\n.* height difference"):
        minimum_norm.adjust_minimum_norm(network)
