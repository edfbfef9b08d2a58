"""PTS: blocks of counted lines with three, four, six or seven values."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.io.scans.scan_files import lines, same, whole, written
from tribrach.errors import InputError
from tribrach.io.scans.formats import read_scans

FINITE = st.floats(-1e7, 1e7, allow_subnormal=False)
POINTS = st.lists(
    st.tuples(FINITE, FINITE, FINITE, st.integers(-2048, 2047), *[st.integers(0, 255)] * 3),
    min_size=1,
    max_size=30,
)


@settings(max_examples=40, deadline=None)
@given(
    POINTS, st.sampled_from([3, 4, 6, 7]), st.integers(1, 40), st.sampled_from([" ", "\t", "  "])
)
def test_numbers_come_back_to_the_last_bit(
    rows: list[tuple[float, ...]], width: int, size: int, blank: str
) -> None:
    chosen = {3: [0, 1, 2], 4: [0, 1, 2, 3], 6: [0, 1, 2, 4, 5, 6], 7: list(range(7))}[width]
    table = np.array(rows, dtype=float)
    text = lines(str(len(rows)), table[:, chosen]).replace(" ", blank)
    with tempfile.TemporaryDirectory() as folder:
        (scan,) = read_scans(written(Path(folder), "a.pts", text))
        got = whole(scan, size)
    assert np.array_equal(got.xyz, table[:, :3])
    if width in (4, 7):
        assert np.array_equal(got.values["intensity"], table[:, 3])
        assert (scan.fields[0].low, scan.fields[0].high) == (-2048, 2047)
    if width in (6, 7):
        for k, name in enumerate(("red", "green", "blue")):
            assert np.array_equal(got.values[name], 257 * table[:, 4 + k])


def test_blocks_and_start(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    a, b = rng.normal(0, 9, (400, 3)), rng.normal(0, 9, (300, 4)) + 500
    first, second = read_scans(written(tmp_path, "a.pts", lines("400", a, "300", b)))
    assert (first.name, first.origin) == ("a", "assumed")
    assert (second.name, second.origin) == ("a-2", "unknown")
    assert np.array_equal(whole(first, 7).xyz, a)
    assert np.array_equal(whole(second, 7, start=123).xyz, b[123:, :3])
    same(whole(second, 1000, start=123), whole(second, 11, start=123))
    assert len(whole(second, 10, start=300)) == 0


def test_points_that_are_no_numbers_are_dropped_and_counted(tmp_path: Path) -> None:
    text = "5\n1 2 3 4\nnan 1 2 3\n1 -inf 2 3\n-nan(ind) 1 1 1\n4 5 6 7\n"
    (scan,) = read_scans(written(tmp_path, "a.pts", text))
    got = whole(scan)
    assert got.dropped == 3
    assert np.array_equal(got.xyz, [[1, 2, 3], [4, 5, 6]])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("4\n1 2 3\n4 5 6\n", "states 4 points and the file holds 2"),
        ("1\n1 2 3\n4 5 6\n7 8 9\n", r"a\.pts:3: the block before has more points"),
        ("1 2 3 4 5 6 7 x\n", "number of points belongs in the first line"),
        ("2\n1 2\n3 4\n", r"a\.pts:2: points have 2 values; 3, 4, 6 or 7"),
        ("99999999999999999999\n1 2 3\n", "states 99999999999999999999 points"),
        ("\n \n", "empty"),
    ],
)
def test_counts_must_fit(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_scans(written(tmp_path, "a.pts", text))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("1 2 3", "has 3 values where 4 are expected"),
        ("1 2 3 4 5", "has 5 values where 4 are expected"),
        ("1 2 3 4_0", "'4_0' is no number"),
        ("1 2 3 0x1", "'0x1' is no number"),
    ],
)
def test_a_malformed_line_is_named(tmp_path: Path, line: str, words: str) -> None:
    good = "1 2 3 4\n"
    (scan,) = read_scans(written(tmp_path, "a.pts", f"52\n{50 * good}\n{line}\n{good}"))
    with pytest.raises(InputError, match=rf"a\.pts:53.*{words}"):
        whole(scan, 10)


def test_colours_beyond_their_range_are_refused(tmp_path: Path) -> None:
    text = "5000\n" + 4999 * "1 2 3 4 5 6 7\n" + "1 2 3 4 5 6 70000\n"
    (scan,) = read_scans(written(tmp_path, "a.pts", text))
    with pytest.raises(InputError, match="column blue"):
        whole(scan)


@pytest.mark.data
def test_real_ones(shared_data: Path) -> None:
    folder = shared_data / "scans/formats/pdal_tiny"
    (scan,) = read_scans(folder / "autzen.pts")
    got = whole(scan)
    assert np.array_equal(got.xyz[0], [636110.300003, 849345.050003, 512.139999])
    assert [int(got.values[k][0]) for k in ("intensity", "red")] == [-1613, 52 * 257]
    assert len(whole(read_scans(folder / "site_56_8.pts")[0])) == 8
    assert len(whole(read_scans(folder / "test.pts")[0])) == 19
    (bunny,) = read_scans(folder / "bunny_8.pts")  # states 8, holds 9
    assert (len(whole(bunny)), len(bunny.warnings)) == (9, 1)


@pytest.mark.parametrize("stated", [2, 3, 4])
def test_a_count_that_is_off_by_one_is_told(tmp_path: Path, stated: int) -> None:
    (scan,) = read_scans(written(tmp_path, "a.pts", f"{stated}\n1 2 3\n4 5 6\n7 8 9\n"))
    assert whole(scan).xyz.tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    assert len(scan.warnings) == (stated != 3)
