"""Precise and broadcast orbits with lines lost, doubled or changed are refused with their line."""

import random
import re
from datetime import datetime
from pathlib import Path

import pytest

from tribrach.errors import InputError
from tribrach.io.gnss.navigation_file import read_navigation
from tribrach.io.gnss.orbit_files import read_orbits
from tribrach.io.gnss.precise_file import PreciseOrbits, read_sp3

from .rinex_samples import navigation
from .sp3_samples import sp3
from .test_precise_orbits import SKY, START

TEXT = sp3(SKY, START, 20, 900.0)
LINES = TEXT.splitlines(keepends=True)
EPOCHS = [k for k, line in enumerate(LINES) if line.startswith("*")]
#: lines of an epoch
BLOCK = len(SKY) + 1


def read(folder: Path, text: str) -> PreciseOrbits:
    path = folder / "a.sp3"
    path.write_text(text)
    return read_sp3(path, text.encode())


def refused(folder: Path, lines: list[str]) -> tuple[str, int | None]:
    with pytest.raises(InputError, match=r"a\.sp3:\d+: ") as caught:
        read(folder, "".join(lines))
    return str(caught.value), caught.value.line


@pytest.mark.parametrize("step", [60.0, 300.0, 900.0, 1800.0])
@pytest.mark.parametrize("version", ["a", "c", "d"])
def test_whole_files_are_read(version: str, step: float, tmp_path: Path) -> None:
    further = 3 if version == "d" else 0
    assert (
        len(read(tmp_path, sp3(SKY, START, 20, step, version=version, further=further)).times) == 20
    )


def test_an_epoch_is_missing(tmp_path: Path) -> None:
    for k in (0, 7, 18):
        lines = LINES[: EPOCHS[k]] + LINES[EPOCHS[k] + BLOCK :]
        words, line = refused(tmp_path, lines)
        assert "has 19 epochs and its header promises 20" in words
        assert line == (EPOCHS[k] if k else EPOCHS[0]) + 1
    # where the header knows it, nothing is wrong
    lines = [LINES[0].replace("     20 ORBIT", "     19 ORBIT"), *LINES[1 : EPOCHS[7]]]
    assert len(read(tmp_path, "".join(lines + LINES[EPOCHS[8] :])).times) == 19


def test_an_epoch_is_there_twice_or_elsewhere(tmp_path: Path) -> None:
    block = LINES[EPOCHS[5] : EPOCHS[6]]
    words, line = refused(tmp_path, LINES[: EPOCHS[6]] + block + LINES[EPOCHS[6] :])
    assert "has an epoch 0 s after the one before, and its header says every 900 s" in words
    assert line == EPOCHS[6] + 1
    words, _ = refused(tmp_path, LINES[: EPOCHS[9]] + block + LINES[EPOCHS[9] :])
    assert "an epoch -2700 s after the one before" in words
    late = LINES[EPOCHS[4]].replace("23  0  0.0", "23  0 10.0")
    words, line = refused(tmp_path, [*LINES[: EPOCHS[4]], late, *LINES[EPOCHS[4] + 1 :]])
    assert "has an epoch 910 s after the one before" in words
    assert line == EPOCHS[4] + 1


def test_lines_of_epochs_and_satellites(tmp_path: Path) -> None:
    k = EPOCHS[3] + 4
    words, line = refused(tmp_path, LINES[:k] + LINES[k + 1 :])
    assert "has no line of G04 at this epoch, as its header says" in words
    assert line == EPOCHS[3] + 1
    words, line = refused(tmp_path, LINES[: k + 1] + LINES[k:])
    assert "has G04 twice at one epoch" in words
    assert line == k + 2
    words, _ = refused(tmp_path, LINES[: EPOCHS[3]] + LINES[EPOCHS[3] + 1 :])
    assert "19 epochs" in words or "twice" in words
    words, _ = refused(tmp_path, [line.replace("PG04", "PG31") for line in LINES])
    assert "has G31 at this epoch and not in its header" in words


@pytest.mark.parametrize("seed", range(40))
def test_a_coordinate_ten_times_too_large(seed: int, tmp_path: Path) -> None:
    """Wherever it is, the line that is named is that one; small ones are not seen."""
    rng = random.Random(seed)
    k = rng.choice(EPOCHS) + rng.randrange(1, BLOCK)
    axis = rng.randrange(3)
    cells = [LINES[k][4 + 14 * a : 18 + 14 * a] for a in range(4)]
    value = float(cells[axis])
    if abs(value) < 60:
        pytest.skip("it makes less than 540 km, which may hide at an end")
    cells[axis] = f"{10 * value:14.6f}"
    changed = LINES[k][:4] + "".join(cells) + "\n"
    words, line = refused(tmp_path, [*LINES[:k], changed, *LINES[k + 1 :]])
    assert line == k + 1, words
    assert re.search(r"from the centre of the Earth|km beside its orbit", words)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("     20 ORBIT", "     2x ORBIT"),
        ("     20 ORBIT", "        ORBIT"),
        ("   900.00000000", "     0.00000000"),
        ("   900.00000000", "         1e-308"),
        ("   900.00000000", "    9x.00000000"),
        ("+    8   G01", "+   80   G01"),
        ("+    8   G01G02", "+    8   G01G01"),
    ],
)
def test_headers_that_say_nothing(old: str, new: str, tmp_path: Path) -> None:
    assert old in TEXT
    with pytest.raises(InputError, match=r"a\.sp3:1: the header of the SP3 file is damaged"):
        read(tmp_path, TEXT.replace(old, new, 1))


def _navigation_3(systems: str) -> str:
    """Records of some systems of RINEX 3, of eight lines, or of four."""
    head = (
        "     3.04           N: GNSS NAV DATA    M: MIXED            RINEX VERSION / TYPE\n"
        + " " * 60
        + "END OF HEADER\n"
    )
    four = "".join(f"{x:19.12e}" for x in (1.5, -2.25e-3, 1e-9, 0.125))
    lines = []
    for k, system in enumerate(systems):
        lines.append(f"{system}{k + 1:02d} 2020 04 02 00 00 00" + four[:57])
        lines += ["    " + four] * (3 if system in "RS" else 7)
    return head + "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    "text", [navigation(2, 4), _navigation_3("GGRREECCSS"), _navigation_3("R")], ids=["2", "3", "R"]
)
def test_every_cut_within_a_record_is_seen(text: str, tmp_path: Path) -> None:
    """A file that ends where a record ends is another whole file."""
    path = tmp_path / "a.nav"
    path.write_text(text)
    count = len(read_navigation(path).times)
    begin = text.index("END OF HEADER\n") + len("END OF HEADER\n")
    marks = re.finditer(r"^([GRECS]\d\d 2020| ?\d+ 05  4)", text[begin:], re.M)
    ends = {begin + mark.start() for mark in marks} | {len(text)}
    whole = {end - k for end in ends for k in (0, 1)}
    for cut in range(begin + 1, len(text)):
        path.write_text(text[:cut])
        try:
            assert len(read_navigation(path).times) <= count
        except InputError as error:
            said = error
        else:
            kept = text[:cut].rstrip()
            # spare numbers may be left out of the last line of the first record of its system
            assert {cut, len(kept)} & whole or (len(kept.splitlines()[-1]) - 4) % 19 in (0, 18)
            continue
        assert cut not in whole - {begin}
        assert said.line is not None or "no orbits" in str(said)


def test_lines_of_records(tmp_path: Path) -> None:
    lines = navigation(2, 4).splitlines(keepends=True)
    path = tmp_path / "a.nav"
    for broken, words, line in (
        (lines[:13] + lines[14:], "has 7 lines in a record of G where 8 belong", 17),
        (lines[:13] + lines[12:], "has 9 lines in a record of G where 8 belong", 19),
        ([*lines[:13], lines[13][:40] + "\n", *lines[14:]], "has 2 numbers in a line", 14),
        ([*lines[:13], lines[13][9:], *lines[14:]], "numbers", 14),
    ):
        path.write_text("".join(broken))
        with pytest.raises(InputError, match=words) as caught:
            read_navigation(path)
        assert caught.value.line == line


@pytest.mark.data
def test_real_orbits_are_whole(shared_data: Path, tmp_path: Path) -> None:
    gnss = shared_data / "gnss"
    broadcast = gnss / "geonet_0759_3040" / "07590920.05n"
    orbits = read_orbits([gnss / "products" / "esa15253.sp3.gz", broadcast])
    assert orbits.precise is not None
    assert len(orbits.precise.times) == 96
    assert orbits.precise.times[0] == (datetime(2009, 4, 1) - datetime(1980, 1, 6)).total_seconds()
    for folder in ("rgp_pana_ignf/230910", "rgp_pana_ignf/230913", "spirent_2km"):
        files = [
            p for p in (gnss / folder).iterdir() if re.search(r"\.23n(\.gz)?$", p.name.lower())
        ]
        assert files
        for path in files:
            assert len(read_navigation(path).times) > 10
