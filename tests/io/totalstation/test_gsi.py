"""Leica GSI: words of both sizes, units, blocks."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tribrach.errors import InputError
from tribrach.io.totalstation import gsi
from tribrach.units import GON


def read(tmp_path, *lines):
    path = tmp_path / "job.gsi"
    path.write_text("\r\n".join(lines) + "\r\n")
    return gsi.read(path)


WORD = st.builds(
    gsi.Word,
    st.sampled_from(["21", "22", "31", "51", "81", "87"]),
    st.sampled_from(["....", "..10", ".322", "..00", "...6"]),
    st.sampled_from("+-"),
    st.integers(0, 99_999_999).map("{:08d}".format),
)


def format_word(word: gsi.Word, size: int) -> str:
    """A word as it stands in a file, without the blank after it; size 8 or 16."""
    return f"{word.index[:2]}{word.information}{word.sign}{word.data.rjust(size, '0')}"


@given(st.lists(WORD, min_size=1, max_size=6))
def test_words_round_trip_in_8(words):
    line = " ".join(format_word(word, 8) for word in words) + " "
    assert gsi.parse_words(line) == words


@given(st.lists(WORD, min_size=1, max_size=6), st.text("ABCXYZ0123456789", min_size=1, max_size=16))
def test_words_round_trip_in_16(words, name):
    first = gsi.Word("11", "0001", "+", name.rjust(16, "0"))
    line = "*" + " ".join(format_word(word, 16) for word in [first, *words]) + " "
    parsed = gsi.parse_words(line)
    assert parsed[0] == first
    assert parsed[0].text == (name.lstrip("0") or "0")
    for word, wide in zip(words, parsed[1:], strict=True):
        assert (wide.index, wide.information, wide.sign) == (
            word.index, word.information, word.sign
        )  # fmt: skip
        assert wide.data == word.data.rjust(16, "0")


@given(st.text(max_size=200))
def test_any_text_parses(text):
    for word in gsi.parse_words(text):
        assert len(word.information) == 4


@pytest.mark.parametrize(
    ("index", "unit", "data", "expected"),
    [
        ("21", "2", "12345678", 123.45678 * GON),
        ("21", "3", "12345678", math.radians(123.45678)),
        ("21", "4", "12334567", math.radians(123 + 34 / 60 + 56.7 / 3600)),
        ("21", "5", "16000000", math.pi / 2),
        ("31", "0", "00012345", 12.345),
        ("31", "1", "00012345", 12.345 * 0.3048),
        ("31", "6", "00012345", 1.2345),
        ("31", "7", "00012345", 1.2345 * 0.3048),
        ("31", "8", "00012345", 0.12345),
    ],
)
def test_units(index, unit, data, expected):
    word = gsi.Word(index, f"..0{unit}"[-4:], "+", data)
    assert word.value == pytest.approx(expected, rel=1e-12)
    assert gsi.Word(index, f"..0{unit}", "-", data).value == pytest.approx(-expected, rel=1e-12)


def test_a_unit_that_cannot_be():
    with pytest.raises(ValueError, match="unit '2'"):
        _ = gsi.Word("31", "..02", "+", "00012345").value


def test_set_up_and_both_faces(tmp_path):
    raw = read(
        tmp_path,
        "110001+0000ST01 84..40+00519659 85..40+00465244 86..40-00000588 88..10+00001350 ",
        "110002+000000P1 21.322+12345670 22.322+08812340 31..00+00012345 51..1.+0012-034 "
        "87..10+00001500 71....+000TREE1 ",
        "110003+000000P1 21.322+32346330 22.322+31188060 31..00+00012345 51..1.+0012-034 "
        "87..10+00001500 ",
    )
    assert raw.setups.station.tolist() == ["ST01"]
    assert raw.setups.height.tolist() == [1.35]
    shots = raw.shots
    assert shots.target.tolist() == ["P1", "P1"]
    assert shots.face.tolist() == [1, 2]
    np.testing.assert_allclose(shots.direction / GON, [123.4567, 323.4633], atol=1e-9)
    np.testing.assert_allclose(shots.zenith / GON, [88.1234, 311.8806], atol=1e-9)
    assert shots.distance.tolist() == [12.345] * 2
    assert shots.height.tolist() == [1.5] * 2
    assert shots.ppm.tolist() == [12.0] * 2
    assert shots.prism.tolist() == [-0.034] * 2
    assert shots.applied.all()
    assert shots.code.tolist() == ["TREE1", ""]
    assert shots.line.tolist() == [2, 3]
    np.testing.assert_allclose(raw.points.xyz, [[519.659, 465.244, -0.588]])
    assert raw.points.given.all()


def test_a_set_up_written_twice_is_one(tmp_path):
    station = "110001+0000ST01 84..40+00519659 85..40+00465244 86..40-00000588 88..10+00001350 "
    sight = "110002+000000P1 21.322+12345670 22.322+08812340 31..00+00012345 "
    raw = read(tmp_path, station, station, sight, station, sight)
    assert len(raw.setups) == 2
    assert raw.shots.setup.tolist() == [0, 1]


def test_codes_as_set_ups(tmp_path):
    code = "*410001+0000000000000021 42....+000000000000BP04 43....+0000000000001538 "
    sight = "*110002+000000000000BP03 21.322+0000000016901313 22.322+0000000009955914 "
    raw = read(tmp_path, code, sight)
    assert raw.setups.station.tolist() == ["BP04"]
    assert raw.setups.height.tolist() == [1.538]
    assert "Code 21 is taken as a set-up" in raw.notes[0]


def test_codes_that_are_something_else(tmp_path):
    """Heights that no instrument has, or two codes: not set-ups, but counted."""
    sight = "110002+000000P1 21.322+12345670 22.322+08812340 31..00+00012345 "
    low = "410001+00000021 42....+00000ABC 43....+00000010 "
    raw = read(tmp_path, low, sight)
    assert raw.setups.station.tolist() == [""]
    assert raw.unknown == {"code block": 1}
    assert raw.notes == ("One set-up has no station in the file and is named after it.",)


def test_missing_values_and_unknown_words(tmp_path):
    raw = read(
        tmp_path,
        "*110001+00000000000000P1 21.322+0000000016901313 31..00+00000000000----- "
        "95....+0000000000000001 ",
        "no block at all",
    )
    assert np.isnan(raw.shots.distance).all()
    assert np.isnan(raw.shots.zenith).all()
    assert raw.unknown == {"word 95": 1, "line that is no block": 1}


def test_a_bad_value_is_left_out_with_its_line(tmp_path):
    good = "110002+000000P1 21.322+12345670 22.322+08812340 31..00+00012345 "
    bad = "110003+000000P1 21.324+12399670 22.322+08812340 31..00+00012345 "
    raw = read(tmp_path, good, bad)
    assert len(raw.shots) == 1
    assert raw.problems[0].line == 2
    assert "more than 60 minutes" in raw.problems[0].what
    assert "1 records left out" in raw.summary()


def test_files_of_levels_are_refused(tmp_path):
    line = "*110003+000000000000000G 32...8+0000000001824936 331.08+0000000000159977 "
    with pytest.raises(InputError, match="staff readings of a level"):
        read(tmp_path, line)


def test_truncated(tmp_path):
    with pytest.raises(InputError, match="no sight and no coordinates"):
        read(tmp_path, "110001+0000")
