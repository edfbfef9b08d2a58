"""Charts: what lies at an edge is drawn, and words do not cover what stands beside them."""

import base64
import io

import numpy as np
import pytest
from PIL import Image

from tribrach.report.charts import (
    LEVELS,
    SIGNED,
    TESTED,
    Chart,
    Drawing,
    DrawnMark,
    colour_bar,
    legend,
)
from tribrach.report.figures import Picture


def found(mark: DrawnMark, tag: str) -> list[DrawnMark]:
    inside = [one for inner in mark.inner for one in found(inner, tag)]
    return [mark, *inside] if mark.tag == tag else inside


def test_points_at_the_edges_of_a_panel_are_drawn() -> None:
    """A facade is the end of a plan: its points are the outermost."""
    chart = Chart((0.0, 10.0), (0.0, 5.0), ("x", "y"))
    x, y = np.array([0.0, 10.0, 5.0, 5.0]), np.array([2.5, 2.5, 0.0, 5.0])
    chart.spots(x, y, np.full((4, 3), 200.0))
    (image,) = found(chart.group(0, 0), "image")
    data = base64.b64decode(dict(image.attributes)["href"].split(",")[1])
    drawn = np.asarray(Image.open(io.BytesIO(data)))[:, :, 3] > 0
    assert drawn.sum() == 4 * 81
    assert drawn[0].any()
    assert drawn[-1].any()
    assert drawn[:, 0].any()
    assert drawn[:, -1].any()


@pytest.mark.parametrize(("scale", "ground"), [(LEVELS, True), (TESTED, False)])
def test_only_colours_that_begin_dark_have_a_ground(scale: np.ndarray, ground: bool) -> None:
    """It stands below the grid; on it the green of what was tested would not be seen."""
    chart = Chart((0.0, 10.0), (0.0, 5.0), ("x", "y"))
    chart.cloud(np.array([1.0, 9.0]), np.array([1.0, 4.0]), np.array([0.0, 1.0]), scale)
    first, *_ = chart.group(0, 0).inner
    assert (("class", "ground") in first.attributes) == ground


def test_words_of_a_legend_end_before_the_next_colour() -> None:
    entries = [("s0", "GNSS"), ("s1", "WWW"), ("s2", "targets of others"), ("s3", "end")]
    group, _ = legend(entries, 900.0)
    begins = [float(dict(one.attributes)["x"]) for one in found(group, "rect")]
    # capitals of a sans-serif of 12 pixels are up to 0.95 of it wide, others less than 0.6
    for (_, words), here, after in zip(entries, begins, begins[1:], strict=False):
        wide = sum(11.4 if c in "WM" else 9.4 if c.isupper() else 6.0 for c in words)
        # on paper letters may be a quarter larger
        assert here + 16 + 1.25 * wide < after


def test_colours_of_both_signs_are_turned_round_on_a_dark_page() -> None:
    chart = Chart((-0.5, 1.5), (-0.5, 0.5), ("", ""), names=["a", "b"], rows=["c"])
    chart.cells(np.array([[0.0, 0.9]]), -1.0, 1.0, 0.7)
    bar, _ = colour_bar(-1.0, 1.0, "correlation", 460.0, SIGNED)
    for group in (chart.group(0, 0), bar):
        (turned,) = [one for one in found(group, "g") if ("class", "signed") in one.attributes]
        assert found(turned, "rect")


@pytest.mark.parametrize(
    ("width", "height", "sort", "wide", "room"),
    [
        (1400.0, 270.0, "panorama", True, 131.0),
        (760.0, 486.0, "chart", False, 45.0 * 760 / 486),
        (900.0, 356.0, "chart", True, 49.0 * 900 / 356),
        (900.0, 690.0, "chart", True, 66.0 * 900 / 690),
        (960.0, 522.0, "still", True, 62.0 * 960 / 522),
        (1380.0, 266.0, "chart", True, 273.0),
    ],
)
def test_letters_can_be_read_on_paper(
    width: float, height: float, sort: str, wide: bool, room: float
) -> None:
    """Letters of 11 pixels are at least 4 pt high where the drawing takes so many millimetres."""
    drawing = Drawing(width, height, (), "words", sort)
    picture = Picture("one", "One", drawing, "caption", wide=wide)
    assert picture.letters >= 1
    high = 11 * picture.letters * room / width / (25.4 / 72)
    assert high > 4.2
    assert picture.letters < 1.6
    if high > 5.1:
        assert picture.letters == 1
