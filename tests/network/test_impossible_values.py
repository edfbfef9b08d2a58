"""Numbers that no survey has, and points in one place: a sentence, before anything overflows."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tribrach.calibration import minimum_norm
from tribrach.errors import InputError, NotConverged
from tribrach.io.survey.formats import read_files
from tribrach.io.totalstation.recorder import Recorder
from tribrach.io.totalstation.text import angle
from tribrach.network.adjustment import adjust
from tribrach.network.survey import Survey, observed_part
from tribrach.observations.sights import Directions, Distances, SlopeDistances, ZenithAngles
from tribrach.units import GON

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


def directions(tmp_path: Path, *gon: float) -> Survey:
    """Directions of a CSV file, and what makes a network of them."""
    rows = "".join(f"A,T{k},{value!r},10\n" for k, value in enumerate(gon))
    path = tmp_path / "tps.csv"
    path.write_text(f"from,to,direction_gon,sigma_arcsec\n{rows}")
    return read_files([path])


@pytest.mark.parametrize("gon", [2e11, 800.001, -1234.5])
def test_an_angle_beyond_two_circles_is_refused_with_its_line(tmp_path: Path, gon: float) -> None:
    with pytest.raises(InputError, match=r"tps.csv:3: direction: .* gon .*more than 2 circles"):
        directions(tmp_path, 12.5, gon)


def test_a_sum_that_was_not_reduced_to_the_circle_counts_and_is_told(tmp_path: Path) -> None:
    (warning,) = directions(tmp_path, 400.0, 412.5, -399.0).warnings
    assert "tps.csv:3: the direction of 412.5 gon is more than a circle" in warning
    assert "counts as 12.5 gon" in warning


def test_the_same_from_python() -> None:
    survey, ends = Survey(), {"start": ["A", "A"], "end": ["B", "C"], "source": ["a:1", "a:2"]}
    survey.add(Directions, values=[0.1, 6.28], sigma=1e-5, orientation=["o"] * 2, **ends)
    assert survey.warnings == []
    with pytest.raises(InputError, match=r"a:2: direction: 900 gon"):
        survey.add(Directions, values=[0, 900 * GON], sigma=1e-5, orientation=["o"] * 2, **ends)


@pytest.mark.parametrize(
    ("reading", "good"), [(399.9999, True), (400.5, True), (800.5, False), (2e8, False)]
)
def test_no_instrument_reads_more_than_its_circle(
    tmp_path: Path, reading: float, good: bool
) -> None:
    """A sight of a raw file that does is left out and told with its line."""
    recorder = Recorder(tmp_path / "job.gsi", "GSI")
    if good:
        recorder.shot(1, "T1", direction=reading * GON)
    else:
        with pytest.raises(ValueError, match="more than 2 circles"):
            recorder.shot(1, "T1", direction=reading * GON)
        with pytest.raises(ValueError, match="more than 2 circles"):
            angle(str(reading), "gon")
