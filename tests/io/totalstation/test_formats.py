"""Formats by their content, and what is no raw file at all."""

import contextlib

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tribrach.errors import InputError
from tribrach.io.survey.formats import format_of
from tribrach.io.totalstation import formats

BEGINNINGS = {
    "Leica GSI": "110001+0000ST01 ",
    "Sokkia SDR": "00NMSDR33V04-01",
    "Nikon RAW": "CO,Nikon RAW data format V2.00",
    "Topcon GTS-7": "TopSURV v6.04(OnBoard)",
    "Topcon GTS-6": "_'110_(COVEK_)1.390_+111_ ?",
    "Carlson RW5": "JB,NMTEST,DT01-16-1998",
    "Autodesk field book": "UNIT METER DMS\nHORIZ ANGLE RIGHT",
    "Trimble M5": "For M5|Adr 00001|TI  KN STAT",
    "LandXML": '<?xml version="1.0"?>\n<LandXML xmlns="x">',
    "Trimble JobXML": '<?xml version="1.0"?>\n<JOBFile>',
}


def beginning(name: str) -> str:
    """How files of a format begin."""
    assert name in BEGINNINGS, f"BEGINNINGS has no {name}: add the first line of one of its files"
    return BEGINNINGS[name]


@pytest.mark.parametrize("name", formats.READERS)
def test_by_content_whatever_the_suffix(tmp_path, name):
    path = tmp_path / "field.book"
    path.write_text(beginning(name))
    assert formats.format_of(path) == name
    assert format_of(path) == "totalstation"
    assert formats._unread(beginning(name)) is None, f"{name} is read now: take it out of UNREAD"


@pytest.mark.parametrize("name", formats.READERS)
def test_a_beginning_alone_ends_with_a_sentence(tmp_path, name):
    path = tmp_path / "field.book"
    path.write_text(beginning(name))
    with pytest.raises(InputError):
        formats.read(path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("HEADER\n\tVERSION 1.20", "Leica IDX"),
        ("2=P100\n23=2112\n", "Geodimeter"),
        ("For R4|TR OR.COOR|", "Zeiss"),
        ("A,SET4C,13194,5802,5406,E0", "Sokkia SCR"),
    ],
)
def test_formats_that_are_known_and_not_read(tmp_path, text, words):
    path = tmp_path / "x.dat"
    path.write_text(text)
    with pytest.raises(InputError, match=f"{words}.* not read; export it as one of"):
        formats.read(path)


def test_no_raw_file(tmp_path):
    path = tmp_path / "x.dat"
    path.write_text("Dear diary")
    with pytest.raises(InputError, match="no raw file of a known total station"):
        formats.read(path)
    with pytest.raises(InputError, match="no such file"):
        formats.read(tmp_path / "none")
    with pytest.raises(InputError, match="belongs to no known format"):
        format_of(path)


def test_bytes_that_are_no_text(tmp_path):
    path = tmp_path / "x.gsi"
    path.write_bytes(b"110001+0000ST01 \x00\x01\x02")
    with pytest.raises(InputError, match="not text"):
        formats.read(path)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    name=st.sampled_from(sorted(formats.READERS)),
    rest=st.lists(
        st.text(st.characters(blacklist_categories=["Cs", "Cc"]), max_size=60), max_size=8
    ),
    cut=st.integers(0, 200),
)
def test_garbage_reads_or_ends_with_a_sentence(tmp_path, name, rest, cut):
    """Whatever follows a beginning, there is a result or an InputError."""
    path = tmp_path / "x"
    path.write_text("\n".join([beginning(name), *rest])[: len(beginning(name)) + cut])
    with contextlib.suppress(InputError):
        assert formats.read(path).understood
