"""The still picture of the clouds: what is where, seen by its pixels and by its own projection."""

import base64
import io
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.workbench.twins import write
from tribrach import pipeline
from tribrach.questions.run.folder import write as write_results
from tribrach.report.content import Report
from tribrach.report.still_picture import _View, still_picture


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Report]:
    made: dict[str, Report] = {}

    def of(kind: str) -> Report:
        if kind not in made:
            folder = tmp_path_factory.mktemp(kind)
            made[kind] = pipeline.run(write(folder, kind), folder / "out")
        return made[kind]

    return of


def pixels(content: Report) -> np.ndarray:
    shown = still_picture(content)
    assert shown is not None
    (image,) = (one for one in shown.drawing.marks if one.tag == "image")
    data = base64.b64decode(dict(image.attributes)["href"].split(",")[1])
    assert len(data) < 120_000
    return np.asarray(Image.open(io.BytesIO(data)), dtype=float)


def test_clouds_stations_and_points_are_in_it(report: Callable[[str], Report]) -> None:
    # between the points is nothing, so that a dark page stays dark
    drawn = (pixels(report("work"))[:, :, 3] > 0).mean()
    assert 0.003 < drawn < 0.95
    shown = still_picture(report("work"))
    sorts = Counter(dict(one.attributes).get("class") for one in shown.drawing.marks)
    assert sorts["station"] == len(report("work").stations)
    assert sorts["ellipse"] == len(report("work").points)
    caption = shown.caption
    assert "9,000 points" in caption
    assert "95 % ellipsoids" in caption


def test_a_geocentric_job_looks_like_the_local_one(report: Callable[[str], Report]) -> None:
    """Up is up: most pixels are drawn in both, where a cloud on its side would share few."""
    one, two = (pixels(report(kind))[:, :, 3] > 0 for kind in ("work", "ecef"))
    assert (one & two).sum() > 0.7 * max(one.sum(), two.sum())


def test_up_is_up_and_right_is_right_of_the_eye() -> None:
    """From the south-west the north-west is on the left, and what is higher stands higher."""
    rng = np.random.default_rng(1)
    view = _View(rng.uniform(-10, 10, (500, 3)), np.eye(3))
    west, south, top, low = view(
        np.array([[-5.0, 5.0, 0.0], [5.0, -5.0, 0.0], [0.0, 0.0, 5.0], [0.0, 0.0, -5.0]])
    )
    assert west[0] < south[0]
    assert top[1] < low[1]
    near, far = view(np.array([[-5.0, -5.0, 0.0], [5.0, 5.0, 0.0]]))
    assert near[2] > far[2]
    # the outline of a ball is a circle of its radius
    half = view.outline(4.0 * np.eye(3))
    assert np.linalg.norm(half, axis=1) == pytest.approx(2.0 * view.scale)


def test_points_beside_the_clouds_are_in_the_picture_and_far_ones_do_not_shrink_it() -> None:
    rng = np.random.default_rng(2)
    cloud = rng.uniform(-10, 10, (500, 3))
    alone = _View(cloud, np.eye(3))
    near, far = np.array([[-20.0, -20.0, 0.0]]), np.array([[-90.0, -90.0, 0.0]])
    assert not 8 < alone(near)[0, 1] < 472
    with_near, with_far = _View(cloud, np.eye(3), near), _View(cloud, np.eye(3), far)
    assert 8 < with_near(near)[0, 1] < 472
    assert with_far.scale == alone.scale


def test_the_page_names_the_command(report: Callable[[str], Report], tmp_path: Path) -> None:
    content = report("work")
    write_results(content, tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert 'id="still"' in page
    assert "tribrach view ." in page
