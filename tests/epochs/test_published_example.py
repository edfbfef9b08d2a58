"""A published levelled network of two epochs: readings as printed, results as printed.

Numerical example of section 1.1, pages 119 to 121, in the proceedings of the XXXIV international
symposium (Сборник с доклади от XXXIV Международен симпозиум), as they can be read at
viewer.joomag.com: four points, 0.8 mm for a kilometre of levelling, point 10 known to have moved
by 2.4 mm.
"""

import numpy as np
import pytest

from tribrach._types import Array
from tribrach.epochs.comparison import Settings, compare
from tribrach.job.epochs import EpochSettings, compare_epochs, epoch_of
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.network import Datum
from tribrach.network.survey import Survey, observed_part
from tribrach.observations.levelling import HeightDifferences

LINES = [("10", "11"), ("10", "12"), ("10", "13"), ("11", "12"), ("11", "13"), ("12", "13")]
#: lengths [m], and height differences of both epochs [m]: tables 1 and 2
LENGTHS = np.array([211.0, 60.0, 216.0, 169.0, 205.0, 68.0])
READINGS = (
    np.array([-0.3274, -0.1887, -0.4187, 0.1392, -0.0915, -0.2304]),
    np.array([-0.3250, -0.1861, -0.4163, 0.1394, -0.0916, -0.2306]),
)
#: adjusted height differences [m]: table 3
ADJUSTED = (
    np.array([-0.3276, -0.1886, -0.4190, 0.1390, -0.0914, -0.2304]),
    np.array([-0.3252, -0.1861, -0.4167, 0.1391, -0.0915, -0.2306]),
)
SIGMA = 0.8e-3 * np.sqrt(LENGTHS / 1000)


def adjusted(readings: Array) -> Adjustment:
    survey = Survey()
    for name, height in zip(("10", "11", "12", "13"), (100.0, 99.7, 99.8, 99.6), strict=True):
        survey.point(name, (0.0, 0.0, height), role="free")
    survey.add(
        HeightDifferences,
        values=readings,
        sigma=SIGMA,
        start=[a for a, _ in LINES],
        end=[b for _, b in LINES],
    )
    return adjust(observed_part(survey).network().with_datum(Datum("free")))


def by_hand(readings: Array) -> tuple[Array, Array]:
    """Heights of a free adjustment and their cofactors, in a few lines."""
    a = np.zeros((6, 4))
    for row, (start, end) in enumerate(LINES):
        a[row, int(start) - 10], a[row, int(end) - 10] = -1, 1
    p = np.diag(SIGMA**-2)
    q = np.linalg.pinv(a.T @ p @ a)
    return q @ a.T @ p @ readings, q


def test_adjusted_height_differences_as_printed() -> None:
    """To the printed tenth of a millimetre in the first epoch; the second is printed rougher.

    By hand as well, so that what is printed is seen to follow from the printed readings: of the
    second epoch three of six differ by up to 0.14 mm, ours as those by hand.
    """
    for readings, printed, rounding in zip(READINGS, ADJUSTED, (0.6e-4, 1.5e-4), strict=True):
        heights, _ = by_hand(readings)
        found = adjusted(readings).state.points[:, 2]
        for k, (start, end) in enumerate(LINES):
            i, j = int(start) - 10, int(end) - 10
            assert heights[j] - heights[i] == pytest.approx(printed[k], abs=rounding)
            assert found[j] - found[i] == pytest.approx(heights[j] - heights[i], abs=1e-9)


def test_point_10_moved_and_the_others_are_stable() -> None:
    """The verdicts of all methods of the example, and the statistics by hand."""
    one, two = (adjusted(readings) for readings in READINGS)
    found = compare_epochs(epoch_of(one, "1"), epoch_of(two, "2"), EpochSettings()).comparison
    (h1, q), (h2, _) = by_hand(READINGS[0]), by_hand(READINGS[1])
    d = h2 - h1
    weights = np.linalg.pinv(2 * q)
    assert found.search is not None
    assert found.search.before.statistic == pytest.approx(d @ weights @ d, rel=1e-6)
    assert found.search.before.dof == 3
    assert not found.search.before.passed
    assert found.moved == ("10",)
    assert found.stable == ("11", "12", "13")
    fall = (weights @ d)[0] ** 2 / weights[0, 0]
    left = d @ weights @ d - fall
    assert found.search.after.statistic == pytest.approx(left, abs=1e-4)
    assert found.search.after.passed
    assert not found.partners
    # the known displacement; 2.4, 2.6 and 2.4 mm against the three others, the nearest counts most
    point = found.displacements[0]
    assert abs(point.vector[0]) == pytest.approx(2.4e-3, abs=0.2e-3)
    assert point.statistic == pytest.approx(fall, rel=1e-4)
    assert point.length > 3 * point.detectable


def test_without_point_10_nothing_moved() -> None:
    """The readjustment with points 11, 12 and 13 alone shows no deformation."""
    one, two = (adjusted(readings) for readings in READINGS)
    first, second = epoch_of(one, "1"), epoch_of(two, "2")
    kept = EpochSettings(Settings(references=("11", "12", "13")))
    found = compare_epochs(first, second, kept).comparison
    assert found.search is not None
    assert found.search.before.passed
    assert found.moved == ("10",)
    assert compare(found.difference).moved == ("10",)
