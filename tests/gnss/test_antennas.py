"""Phase centres by type and dome: fabricated files, and the whole file of the IGS."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.gnss.antennas import AntennaSetup, BaselineAntennas
from tribrach.gnss.baseline import Processing, compute_baseline
from tribrach.io.gnss.antex_file import read_antex

from .test_baseline import ANTEX, antenna_of_antex, needs_engine
from .test_pieces import PANA, pana


def written(folder: Path, *antennas: str, name: str = "some.atx") -> Path:
    path = folder / name
    text = ANTEX + "".join(antennas)
    path.write_bytes(gzip.compress(text.encode()) if name.endswith("gz") else text.encode())
    return path


def test_type_and_dome_then_type_without_dome(tmp_path: Path) -> None:
    one = antenna_of_antex("MAKER_A         NONE", 10.0)
    two = antenna_of_antex("MAKER_A         DOME", 20.0)
    for name in ("some.atx", "some.atx.gz"):
        file = read_antex(written(tmp_path, one, two, name=name))
        assert not file.has_satellites
        for asked, found, other in (
            ("MAKER_A         DOME", "MAKER_A         DOME", ""),
            ("MAKER_A", "MAKER_A         NONE", ""),
            ("MAKER_A         TENT", "MAKER_A         NONE", "TENT"),
        ):
            antenna = file.receiver_antenna(asked)
            assert (antenna.name, antenna.other_dome) == (found, other)
            assert antenna.frequencies == ("G01", "G02")


def test_an_antenna_that_is_not_there_names_the_domes_that_are(tmp_path: Path) -> None:
    file = read_antex(written(tmp_path, antenna_of_antex("MAKER_A         DOME", 20.0)))
    with pytest.raises(InputError, match="MAKER_A TENT is not in the ANTEX file; it has it with"):
        file.receiver_antenna("MAKER_A TENT")
    with pytest.raises(InputError, match="MAKER_B is not in the ANTEX file; give"):
        file.receiver_antenna("MAKER_B")
    with pytest.raises(InputError, match=r"\(no type\) is not in"):
        file.receiver_antenna("")


def test_the_mean_of_a_type_goes_before_a_single_antenna(tmp_path: Path) -> None:
    single = antenna_of_antex("MAKER_A         NONE", 30.0)
    # a serial number begins in column 21
    single = "\n".join(
        f"{'MAKER_A         NONE7':60s}TYPE / SERIAL NO" if "TYPE / SERIAL" in line else line
        for line in single.split("\n")
    )
    file = read_antex(written(tmp_path, single, antenna_of_antex("MAKER_A         NONE", 10.0)))
    content = file.of_baseline((file.receiver_antenna("MAKER_A"),), satellites=False).decode()
    assert content.startswith(ANTEX)
    assert content.count("START OF ANTENNA") == 1
    assert "     10.00" in content
    assert "     30.00" not in content


def test_a_file_that_ends_within_an_antenna(tmp_path: Path) -> None:
    cut = antenna_of_antex("MAKER_A         NONE", 10.0)[:-90]
    path = written(tmp_path, cut)
    with pytest.raises(InputError, match="ends within an antenna"):
        read_antex(path).receiver_antenna("MAKER_A")
    path = written(tmp_path, cut, antenna_of_antex("MAKER_B         NONE", 10.0))
    with pytest.raises(InputError, match="ends within an antenna"):
        read_antex(path).receiver_antenna("MAKER_A")


def test_warnings_of_domes_and_frequencies(tmp_path: Path) -> None:
    antex = read_antex(written(tmp_path, antenna_of_antex("MAKER_A         NONE", 10.0)))
    exact, other = AntennaSetup("MAKER_A NONE"), AntennaSetup("MAKER_A TENT")
    assert BaselineAntennas(exact, exact, antex).warnings(2) == []
    (text,) = BaselineAntennas(exact, other, antex).warnings(2)
    assert "with the dome TENT: those without a dome (NONE) are taken" in text
    (text,) = BaselineAntennas(exact, exact, antex).warnings(3)
    assert "for G01, G02 only" in text
    (text,) = BaselineAntennas(exact, other).warnings(2)
    assert "no ANTEX file is given" in text


@needs_engine
@pytest.mark.data
def test_the_whole_file_of_the_igs(shared_data: Path) -> None:
    """Two antennas whose centres on L1 are 64.91 and 58.32 mm above their reference points.

    The difference of 6.6 mm is in the height without them; the variations with elevation, which
    differ by a millimetre, take part of it back.
    """
    path = shared_data / "gnss" / "products" / "igs14.atx.gz"
    antex = read_antex(path)
    assert antex.has_satellites
    assert len(antex.places) == 708
    two = tuple(antex.receiver_antenna(name) for name in ("TRM57971.00 NONE", "LEIAS10 NONE"))
    assert len(antex.of_baseline(two, satellites=False)) < 150_000
    files = pana(shared_data, "230913", "256")
    plain = compute_baseline(*files, PANA, Processing(frequencies=1, pieces=False))
    known = compute_baseline(*files, PANA, Processing(frequencies=1, antex=path, pieces=False))
    up = np.array(PANA) / np.linalg.norm(PANA)
    lower = float((known.rover - plain.rover) @ up)
    assert lower == pytest.approx(-0.0066, abs=0.002)
    assert any("no ANTEX file" in text for text in plain.warnings)
    assert not any("ANTEX" in text or "phase centres" in text for text in known.warnings)
