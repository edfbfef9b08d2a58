"""Results of GNU Gama as control with full covariance: axes, matrices, two epochs."""

from pathlib import Path

import numpy as np
import pytest

from tests.io.survey.gama_files import FILE_AXES
from tribrach.errors import InputError
from tribrach.io.survey.formats import read_files
from tribrach.network.adjustment import adjust
from tribrach.network.survey import observed_part

#: of P and Q in x and y, and one orientation [mm^2, cc^2]
MATRIX = np.array(
    [
        [16.0, 3.0, 5.0, 1.0, 2.0],
        [3.0, 9.0, 1.0, 4.0, 1.0],
        [5.0, 1.0, 25.0, 2.0, 3.0],
        [1.0, 4.0, 2.0, 12.0, 1.0],
        [2.0, 1.0, 3.0, 1.0, 40.0],
    ]
)
PLACES = {"A": (100.0, 200.0), "P": (183.0, 171.0), "Q": (161.0, 262.0)}


def document(axes: str = "en", matrix: np.ndarray = MATRIX, band: int | None = None) -> str:
    """A result with A fixed, P and Q adjusted, in the file's own axes."""
    to_file = FILE_AXES[axes][0]
    xy = {name: to_file(*place) for name, place in PLACES.items()}

    def point(name: str, x: str = "x", y: str = "y") -> str:
        a, b = xy[name]
        return f"<point> <id>{name}</id> <{x}>{a}</{x}> <{y}>{b}</{y}> </point>\n"

    width = len(matrix) - 1 if band is None else band
    numbers = [
        f"<flt>{matrix[i, j]}</flt>"
        for i in range(len(matrix))
        for j in range(i, min(i + width, len(matrix) - 1) + 1)
    ]
    return (
        '<?xml version="1.0"?>\n<gama-local-adjustment '
        'xmlns="http://www.gnu.org/software/gama/gama-local-adjustment">\n'
        "<description>two  new\npoints</description>\n"
        f'<network-general-parameters axes-xy="{axes}" angles="left-handed"/>\n'
        f"<coordinates>\n<fixed>{point('A')}</fixed>\n<approximate></approximate>\n"
        f"<adjusted>{point('P')}{point('Q', 'X', 'Y')}</adjusted>\n"
        f"<cov-mat><dim>{len(matrix)}</dim> <band>{width}</band>\n{' '.join(numbers)}</cov-mat>\n"
        "</coordinates>\n</gama-local-adjustment>\n"
    )


def read(folder: Path, text: str, *more: Path):
    path = folder / "result.xml"
    path.write_text(text)
    return read_files([path, *more])


@pytest.mark.parametrize("axes", FILE_AXES)
def test_coordinates_and_covariance_in_all_axes(tmp_path: Path, axes: str) -> None:
    survey = observed_part(read(tmp_path, document(axes)))
    assert survey.title == "two new points"
    adjustment = adjust(survey.network())
    for name, place in PLACES.items():
        np.testing.assert_allclose(survey.points[name].xyz[:2], place, atol=1e-9)
    found = adjustment.covariance("P", "Q")
    # x and y of the file along E and N, with the sign of the axis
    turn = np.array([FILE_AXES[axes][0](1.0, 0.0), FILE_AXES[axes][0](0.0, 1.0)])
    cross = turn @ MATRIX[:2, 2:4] @ turn.T * 1e-6
    np.testing.assert_allclose(found[:2, :2], cross, rtol=1e-9, atol=1e-15)
    own = turn @ MATRIX[:2, :2] @ turn.T * 1e-6
    np.testing.assert_allclose(adjustment.covariance("P", "P")[:2, :2], own, rtol=1e-9)
    assert np.abs(adjustment.covariance("A", "A")).max() < 1e-20


def test_control_of_another_job(tmp_path: Path) -> None:
    """Generalised least squares by hand: a distance between two correlated points."""
    length = 93.63
    sights = tmp_path / "sights.csv"
    sights.write_text(
        f"from,to,horizontal_distance_m,sigma_horizontal_distance_mm\nP,Q,{length},2\n"
    )
    adjustment = adjust(observed_part(read(tmp_path, document("en"), sights)).network())
    a, b = np.array(PLACES["P"]), np.array(PLACES["Q"])
    unit = (b - a) / np.linalg.norm(b - a)
    row = np.concatenate([-unit, unit])
    c = MATRIX[:4, :4] * 1e-6
    gain = c @ row / (row @ c @ row + 2e-3**2)
    shift = gain * (length - np.linalg.norm(b - a))
    points = dict(zip(adjustment.layout.names["point"], adjustment.state.points, strict=True))
    moved = np.concatenate([points["P"][:2] - a, points["Q"][:2] - b])
    np.testing.assert_allclose(moved, shift, atol=1e-6)
    expected = c - np.outer(gain, row @ c)
    found = adjustment.covariance("Q", "Q")[:2, :2]
    np.testing.assert_allclose(found, expected[2:, 2:], rtol=1e-3)
    assert adjustment.dof == 1


BAD = {
    "no coordinates": ("coordinates>", "other>", "has 0 elements <coordinates>"),
    "no matrix": ("cov-mat>", "cov>", "has 0 elements <cov-mat>"),
    "no name": ("<id>P</id>", "<id> </id>", "a point has no <id>"),
    "no number": ("<x>183.0</x>", "<x>183,0</x>", "not a number: '183,0'"),
    "infinite": ("<x>183.0</x>", "<x>inf</x>", "not a finite number"),
    "twice": ("<id>Q</id>", "<id>P</id>", "point P is defined twice"),
    "short": ("<flt>40.0</flt>", "", "has 14 elements instead of 15"),
    "small": ("<dim>5</dim>", "<dim>3</dim>", "dimension 3 and band 4 for 4 coordinates"),
    "axes": ('axes-xy="en"', 'axes-xy="xy"', "axes-xy is 'xy'"),
    "none": ("<adjusted>", "<adjusted></adjusted><x>", "there are no adjusted coordinates"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_results(tmp_path: Path, case: str) -> None:
    old, new, words = BAD[case]
    text = document().replace(old, new)
    if case == "none":
        text = text.replace("</adjusted>\n<cov", "</x>\n<cov")
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert words in str(caught.value)
    assert "result.xml" in str(caught.value)


def test_results_whose_covariance_does_not_hold(tmp_path: Path) -> None:
    singular = np.ones((5, 5))
    with pytest.raises(InputError, match="singular, as that of a free network"):
        read(tmp_path, document(matrix=singular))
    with pytest.raises(InputError, match="only 2 bands of 3"):
        read(tmp_path, document(band=2))


@pytest.mark.data
def test_shifts_between_two_epochs(shared_data: Path) -> None:
    """Shifts of seven points and their 14 x 14 covariance, as gama-local-deformation has them."""
    folder = shared_data / "networks" / "gama" / "deformation"
    epochs = [
        adjust(observed_part(read_files([folder / f"data-{k}.xml"])).network()) for k in (1, 2)
    ]
    lines = (folder / "data-1-2.txt").read_text().splitlines()
    rows = [words for line in lines if len(words := line.split()) == 10 and words[0].isalpha()]
    names = [words[0] for words in rows]
    assert names == list("dfghijl")

    def of(adjustment, name: str) -> np.ndarray:
        index = adjustment.layout.names["point"].index(name)
        return adjustment.state.points[index][:2]

    for words in rows:
        shift = of(epochs[1], words[0]) - of(epochs[0], words[0])
        np.testing.assert_allclose(shift, [float(w) for w in words[4:6]], atol=6e-6)
    start = lines.index("14 13") + 2
    upper = [[float(w) for w in line.split()] for line in lines[start : start + 14]]
    expected = np.zeros((14, 14))
    for i, numbers in enumerate(upper):
        expected[i, i:] = expected[i:, i] = numbers
    found = np.block(
        [[sum(e.covariance(a, b)[:2, :2] for e in epochs) for b in names] for a in names]
    )
    np.testing.assert_allclose(found * 1e6, expected, atol=6e-5)
