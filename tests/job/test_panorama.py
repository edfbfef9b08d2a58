"""Panoramas: where things are in them, what they keep, and how small they are."""

import io

import numpy as np
import pytest
from PIL import Image

from tribrach.geometry.polar import xyz_from_polar
from tribrach.job.panorama import HEIGHT, WIDTH, panorama
from tribrach.report.panoramas import panorama_file
from tribrach.scan.range_image import organise
from tribrach.targets.detection import Detection

STEP = 2 * np.pi / 3600
#: row and column of a bright patch in the grid
ROW, COLUMN = 900, 700


def _sphere(at):
    return Detection("sphere", "S1", at, 1e-8 * np.eye(3), 0.1, 0.0, 99, 99, 10.0, 0.0, 1.0)


@pytest.fixture(scope="module")
def scanned():
    """A sphere of points about the scanner with one bright patch, and its place."""
    rows, columns = np.mgrid[0:1400, 0:3600]
    h, v = STEP * columns.ravel(), 0.4 + STEP * rows.ravel()
    polar = np.column_stack([np.full(h.shape, 10.0), h, v])
    light = np.full(h.shape, 100.0, np.float32)
    light += np.random.default_rng(1).normal(0, 10, h.shape).astype(np.float32)
    light[(abs(rows - ROW) < 8).ravel() & (abs(columns - COLUMN) < 8).ravel()] = 255
    image = organise(xyz_from_polar(polar), rows.ravel(), columns.ravel())
    at = xyz_from_polar(np.array([[10.0, STEP * COLUMN, 0.4 + STEP * ROW]]))[0]
    return image, light, _sphere(at)


def test_marks_are_where_the_targets_are(scanned):
    view = panorama(scanned[0], scanned[1], [scanned[2]])
    assert view.grey.shape == (round(view.shape[1]), WIDTH)
    assert view.grey.shape[0] <= HEIGHT
    bright = np.argwhere(view.grey > 250)
    bright = bright[np.hypot(*(bright - view.marks[0, ::-1]).T) < 6]
    assert len(bright) >= 9
    np.testing.assert_allclose(bright.mean(axis=0), view.marks[0, ::-1], atol=0.6)


def test_pictures_of_pages_are_small_and_show_the_same(scanned):
    view = panorama(scanned[0], scanned[1], [scanned[2]])
    exact, small = panorama_file(view, "PNG"), panorama_file(view, "WEBP")
    assert small == panorama_file(view, "WEBP")
    assert len(small) < len(exact) / 4
    one, other = (np.array(Image.open(io.BytesIO(f)).convert("RGB"), float) for f in (exact, small))
    assert one.shape == other.shape == (*view.grey.shape, 3)
    assert abs(one - other).mean() < 6
    # the ring is red in both
    x, y = view.marks[0].astype(int)
    for picture in (one, other):
        around = picture[y - 9 : y + 10, x - 9 : x + 10]
        assert (around[..., 0] - around[..., 1] > 60).sum() > 20
