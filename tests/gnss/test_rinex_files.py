"""Reading RINEX: what a file holds, and a sentence for every way it can be wrong."""

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.io.gnss.navigation_file import read_navigation
from tribrach.io.gnss.observation_file import read_observations

from .rinex_samples import HEADER_2, VALUES, navigation, rinex_2, rinex_3


def written(folder: Path, text: str | bytes, name: str = "a.obs") -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


@pytest.mark.parametrize("write", [rinex_2, rinex_3])
@pytest.mark.parametrize("count", [4, 12, 13, 25])
def test_epochs_and_satellites(tmp_path: Path, write: Callable[..., str], count: int) -> None:
    names = tuple(f"G{k:02d}" for k in range(1, count + 1))
    file = read_observations(written(tmp_path, write(4, names)))
    assert file.satellites == set(names)
    # 2005-04-02 is day 9218 after 1980-01-06
    np.testing.assert_allclose(file.times, 9218 * 86400 + np.array([0, 30, 60, 90.0]))
    assert file.interval == 30


def test_header_of_a_station(tmp_path: Path) -> None:
    file = read_observations(written(tmp_path, rinex_2()))
    assert file.marker == "ABCD"
    assert file.antenna == "TRM29659.00     NONE"
    assert file.delta.tolist() == [1.2345, 0.001, 0.002]
    assert file.approximate.tolist() == [4157177.0658, 671230.4766, 4774767.0311]


def test_line_ends_of_windows(tmp_path: Path) -> None:
    text = rinex_2(2, tuple(f"G{k:02d}" for k in range(1, 15)))
    file = read_observations(written(tmp_path, text.replace("\n", "\r\n")))
    assert len(file.times) == 2
    assert len(file.satellites) == 14


def test_event_lines_and_blank_measurements(tmp_path: Path) -> None:
    text = rinex_2(2)
    first, second = text.index("\n 05"), text.rindex("\n 05")
    event = f"\n{'':28}4  1\n{'A NEW REMARK':60}COMMENT"
    text = text[:second] + event + text[second:]
    # a satellite without any measurement leaves an empty line
    text = text[: text.rindex("\n", 0, len(text) - 1)] + "\n\n"
    file = read_observations(written(tmp_path, text))
    assert first < second
    assert len(file.times) == 2


def test_packed_files_are_the_same(tmp_path: Path) -> None:
    text = rinex_2().encode()
    plain = read_observations(written(tmp_path, text))
    packed = read_observations(written(tmp_path, gzip.compress(text), "a.obs.gz"))
    assert packed.text == plain.text


def test_hatanaka_files_are_the_same(tmp_path: Path) -> None:
    hatanaka = pytest.importorskip("hatanaka")
    text = rinex_3().encode()
    plain = read_observations(written(tmp_path, text))
    compact = hatanaka.rnx2crx(text)
    for name, data in (("a.crx", compact), ("a.crx.gz", gzip.compress(compact))):
        packed = read_observations(written(tmp_path, data, name))
        assert packed.satellites == plain.satellites
        np.testing.assert_array_equal(packed.times, plain.times)


def test_epochs_that_promise_too_many_satellites(tmp_path: Path) -> None:
    text = rinex_3(4)
    second = text.index("> 2005", text.index("> 2005") + 5)
    gap = text.index("G03", second)
    file = read_observations(written(tmp_path, text[:gap] + text[text.index("\n", gap) + 1 :]))
    assert file.recounted == 1
    assert file.text[second : second + 60].splitlines()[0].endswith(b"  0  3")
    assert len(file.times) == 4


BROKEN = {
    "empty": (lambda t: "", "the file is empty"),
    "no RINEX": (lambda t: "x" * 500, "no RINEX file"),
    "no end of header": (lambda t: t[:200], "header has no end"),
    "only a header": (lambda t: t[: t.index("END OF HEADER") + 14], "no epochs"),
    "cut in an epoch": (lambda t: t[: len(t) - 70], "ends within the epoch"),
    "cut in a number": (lambda t: t[:-6], "ends within the epoch"),
    "zero bytes": (lambda t: t[:-200] + "\0" * 20 + t[-180:], "damaged"),
    "words": (lambda t: t.replace("123456.789", "12345x.789"), "damaged"),
    "version": (lambda t: "     9.99" + t[9:], "version 9.99 is not read"),
    "date": (lambda t: t.replace(" 05  4  2", " 05 13 40").replace("05 04 02", "05 13 40"), "date"),
}


@pytest.mark.parametrize("write", [rinex_2, rinex_3])
@pytest.mark.parametrize("case", BROKEN)
def test_broken_files_are_refused(tmp_path: Path, write: Callable[..., str], case: str) -> None:
    breaking, words = BROKEN[case]
    path = written(tmp_path, breaking(write()))
    with pytest.raises(InputError, match=words) as caught:
        read_observations(path)
    assert "a.obs" in str(caught.value)
    assert str(caught.value).count("\n") == 0


def test_a_missing_line_of_rinex_2_is_refused(tmp_path: Path) -> None:
    lines = rinex_2(3).splitlines(keepends=True)
    del lines[HEADER_2.count("\n") + 2]
    with pytest.raises(InputError, match="lines are missing in the epoch 05 4 2 0 0 0"):
        read_observations(written(tmp_path, "".join(lines)))


def test_damaged_packings_are_refused(tmp_path: Path) -> None:
    packed = gzip.compress(rinex_2().encode())
    for data in (packed[:-20], packed[:40] + b"\xff" * 30 + packed[70:]):
        with pytest.raises(InputError, match="the packed data are damaged or end too soon"):
            read_observations(written(tmp_path, data, "a.gz"))


def test_files_of_the_wrong_kind_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not observations"):
        read_observations(written(tmp_path, navigation()))
    with pytest.raises(InputError, match="not navigation data"):
        read_navigation(written(tmp_path, rinex_2()))
    with pytest.raises(InputError, match="no orbits"):
        read_navigation(written(tmp_path, navigation(satellites=0)))
    with pytest.raises(InputError, match="cannot be read"):
        read_observations(tmp_path / "nowhere.obs")


def test_orbits(tmp_path: Path) -> None:
    file = read_navigation(written(tmp_path, navigation(3, 6)))
    assert list(file.satellites) == [f"G{k:02d}" for k in range(1, 7)]
    np.testing.assert_array_equal(file.times, 9219 * 86400)


def test_broken_orbits_are_refused(tmp_path: Path) -> None:
    text = navigation()
    lines = text.splitlines(keepends=True)
    for broken, words in (
        ("".join(lines[:-3]), "ends within a record"),
        (text.replace("0.000000000000D+00", "0.0000#0000000D+00", 1), "damaged"),
        (text.replace(" 05  4  2", " 05 14  2", 1), "date that does not exist"),
    ):
        with pytest.raises(InputError, match=words):
            read_navigation(written(tmp_path, broken, "a.nav"))


def test_measurements_of_several_lines(tmp_path: Path) -> None:
    """Seven types of observation take two lines per satellite."""
    values = [f"{k * 1000.0:14.3f}  " for k in range(1, 8)]
    two = "".join(values[:5]).rstrip() + "\n" + "".join(values[5:]).rstrip()
    text = rinex_2().replace(VALUES, two)
    types = "     7    L1    C1    L2    P2    D1    S1    S2                  # / TYPES OF OBSERV"
    old = "     4    L1    C1    L2    P2                              # / TYPES OF OBSERV"
    file = read_observations(written(tmp_path, text.replace(old, types)))
    assert len(file.times) == 3
    with pytest.raises(InputError, match="belongs to no epoch"):
        read_observations(written(tmp_path, text))
