import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.geometry.polar import polar_from_xyz, xyz_from_polar
from tribrach.scan.range_image import organise

COLUMNS, ROWS = 300, 120


def room(jitter=2e-5, columns=COLUMNS, rows=ROWS):
    """A full-circle scan of a box room: points, rows, columns."""
    rng = np.random.default_rng(1)
    column, row = np.meshgrid(np.arange(columns), np.arange(rows))
    h = (column.ravel() + 0.3) * 2 * np.pi / columns
    v = np.linspace(0.15, 2.6, rows)[row.ravel()]
    h, v = h + rng.normal(0, jitter, h.size), v + rng.normal(0, jitter, h.size)
    d = xyz_from_polar(np.stack([np.ones_like(h), h, v], axis=1))
    with np.errstate(divide="ignore"):
        r = np.min(np.where(d > 0, [6.0, 5.0, 1.2], [-6.0, -5.0, -1.8]) / d, axis=1)
    return d * r[:, None], row.ravel(), column.ravel()


def assert_looks_where_it_says(image, xyz, share=0.97):
    """Every pixel's point lies within 1.1 steps of the pixel's direction, and its range fits."""
    row, column = np.nonzero(image.index >= 0)
    polar = polar_from_xyz(xyz[image.index[row, column]])
    off_h = np.angle(np.exp(1j * (polar[:, 1] - image.h(column)))) / image.step_h
    off_v = (polar[:, 2] - image.v(row)) / image.step_v
    assert np.mean((np.abs(off_h) < 1.1) & (np.abs(off_v) < 1.1)) >= share
    np.testing.assert_allclose(image.range[row, column], polar[:, 0], rtol=1e-6)
    assert np.isnan(image.range[image.index < 0]).all()


@pytest.mark.parametrize("turned", ["as is", "rows", "columns", "both", "swapped", "shifted"])
def test_grid_in_any_orientation(turned):
    xyz, row, column = room()
    row = ROWS - 1 - row if turned in ("rows", "both") else row
    column = COLUMNS - 1 - column if turned in ("columns", "both") else column
    column = (column + 77) % COLUMNS + 5 if turned == "shifted" else column
    row, column = (column, row) if turned == "swapped" else (row, column)
    image = organise(xyz, row, column)
    assert image.gridded
    assert image.wraps
    assert image.shape == (ROWS, COLUMNS)
    assert (image.index >= 0).all()
    assert_looks_where_it_says(image, xyz, 1.0)


def test_back_face_lies_beside_the_front_face():
    xyz, row, column = room()
    back = column >= COLUMNS // 2
    image = organise(xyz, np.where(back, 300 - row, row), column % (COLUMNS // 2))
    assert image.gridded
    assert image.wraps
    assert image.shape[1] == COLUMNS
    assert (image.index >= 0).sum() > 0.99 * len(xyz)
    assert_looks_where_it_says(image, xyz, 1.0)


def test_grid_that_is_no_grid_of_directions_is_not_used():
    xyz, row, column = room()
    order = np.random.default_rng(3).permutation(len(xyz))
    image = organise(xyz, row[order], column[order])
    assert not image.gridded
    assert_looks_where_it_says(image, xyz)


def test_lost_grid_is_found_from_the_points():
    xyz, _, _ = room()
    order = np.random.default_rng(2).permutation(len(xyz))
    image = organise(xyz[order])
    assert image.step_h == pytest.approx(2 * np.pi / COLUMNS, rel=0.02)
    assert image.step_v == pytest.approx(2.45 / (ROWS - 1), rel=0.02)
    assert (image.index >= 0).sum() > 0.95 * len(xyz)
    assert np.isfinite(image.filled()).mean() > 0.98
    assert_looks_where_it_says(image, xyz[order])


def test_lost_grid_between_the_pixels_is_met_in_their_centres():
    """Columns that lie half a step beside -pi would fall into either of two pixels by chance."""
    columns = 301
    column, row = np.meshgrid(np.arange(columns), np.arange(ROWS))
    polar = np.stack([np.full(column.size, 5.0), column.ravel(), row.ravel()], axis=1)
    polar[:, 1:] *= 2 * np.pi / columns
    polar[:, 2] += 0.2
    polar[:, 2] += np.random.default_rng(4).normal(0, 2e-3, column.size)
    polar = polar[polar[:, 2] < 2.6]
    image = organise(xyz_from_polar(polar))
    assert (image.index >= 0).sum() > 0.95 * len(polar)


def test_thinned_cloud_gets_pixels_of_its_own_spacing():
    xyz, _, _ = room()
    keep = np.random.default_rng(2).permutation(len(xyz))[: len(xyz) // 10]
    image = organise(xyz[keep])
    assert 0.4 < (image.index >= 0).mean() < 0.9


def test_sector_across_the_cut_of_h_stays_in_one_piece():
    xyz, _, _ = room()
    h = np.arctan2(xyz[:, 1], xyz[:, 0])
    sector = xyz[np.abs(h) > np.pi - 0.3]
    image = organise(sector)
    assert not image.wraps
    assert image.shape[1] * image.step_h == pytest.approx(0.6, abs=0.1)
    assert_looks_where_it_says(image, sector)


def test_nearest_return_counts_and_invalid_points_do_not():
    xyz, row, column = room()
    twice = np.concatenate([2 * xyz, xyz, np.full((3, 3), np.nan), np.zeros((2, 3))])
    fill = np.zeros(5, dtype=int)
    image = organise(twice, np.r_[row, row, fill], np.r_[column, column, fill])
    assert image.index.min() >= len(xyz)
    assert image.index.max() < 2 * len(xyz)
    binned = organise(twice)
    assert binned.index.max() < 2 * len(xyz)


def test_holes_are_closed_on_surfaces_and_not_across_edges():
    xyz, row, column = room()
    lost = (row == 60) & (column % 7 == 0)
    image = organise(xyz[~lost], row[~lost], column[~lost])
    hole = image.index < 0
    assert hole.sum() == lost.sum()
    assert np.isfinite(image.filled()[hole]).mean() > 0.8
    assert np.isfinite(image.filled()[~hole]).all()
    stepped = xyz * np.where((column < 35) | (row < 60), 1.0, 2.0)[:, None]
    kept = ~((row == 60) & (column == 35))
    image = organise(stepped[kept], row[kept], column[kept])
    assert np.isnan(image.filled()).sum() == 1


def test_absurd_row_numbers_allocate_nothing():
    xyz, row, column = room()
    image = organise(xyz, row * 1_000_003, column * 999_983)
    assert image.shape[0] * image.shape[1] <= 4_000_000


def test_points_without_directions_are_refused():
    with pytest.raises(InputError, match="two points"):
        organise(np.zeros((5, 3)))
    with pytest.raises(InputError, match="two points"):
        organise(np.ones((1, 3)))
    with pytest.raises(InputError, match="direction"):
        organise(np.full((9, 3), np.nan))
