"""Leica SKI-ASCII and Trimble TDEF: figures by hand, and the DynaML that another program made."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError, RefusalCollector, Refusals
from tribrach.io.gnss.ski import read_ski
from tribrach.io.gnss.tdef import read_tdef
from tribrach.io.survey.dynadjust import dynaml
from tribrach.io.survey.formats import format_of, read_files
from tribrach.network.adjustment import adjust
from tribrach.network.network import Datum
from tribrach.observations.base import Use

SKI = """\
@%Unit:                m
@%Coordinate type:     Cartesian
@%Reference ellipsoid: WGS 1984
@#North Tower       4157100.0000    671200.0000   4774700.0000            MEAS    0.004  12
@&   0.50000   0.000004000000   0.0   0.0   0.000008   0.0   0.000012
@E    0.00400000   0.00300000   0.10000000   0.00500000
@+B 1               4157200.0000    671300.0000   4774600.0000
@-North Tower          -100.0010       -99.9990       100.0020
@=   0.50000   0.000004000000   0.000001000000  -0.000001000000   0.000008   0.000002   0.000012
@:          1.735          0.000
@;          1.590          0.000
@*02.03.2009 09:21:45
@#North Tower       4157100.0010    671200.0010   4774700.0010            REF   12
@#C                 4157000.0000    671100.0000   4774800.0000            MEAS    0.004  12
@+B 1               4157200.0000    671300.0000   4774600.0000
@-C                    -200.0000      -200.0000       200.0000
@=   1.00000   0.000004   0.0   0.0   0.000008   0.0   0.000012
"""
TDEF = """\
[General]
Source=Trimble Business Center
GPSVectors=MarkToMark
CoordinateUnits=meters
AngularUnits=degrees
MissingValue=?
Separator=:

[Stations]
Station=2:?:P 1:37.500000000S:144.250000000E:100.0:?:?:?
Station=2:?:Q:37.500000000N:144.250000000W:100.0:?:?:?
Station=2:?:R:?:?:?:?:?:?

[GPS]
Vector=1:?:P 1:Q:{values}1.2e-005:1.8:0.1:x:?:0.01:?:{date}:E:a:b:Float:L2
Vector=1:?:Q:R:{values}1.2e-005:1.8:0.1:x:?:0.01:?:{date}:D:a:b:Fixed:L2
"""
TDEF = TDEF.replace("{date}", "16 02 2020:22 50 34.0:17 02 2020:04 51 22.0")
TDEF = TDEF.replace("{values}", "1.5:-2.5:3.5:4e-6:1e-6:-1e-6:8e-6:2e-6:")
BLOCK = np.array([[4, 1, -1], [1, 8, 2], [-1, 2, 12]]) * 1e-6


def written(folder: Path, text: str, name: str = "v.asc") -> Path:
    (folder / name).write_text(text)
    return folder / name


def test_ski_ascii(tmp_path: Path) -> None:
    records = read_ski(written(tmp_path, SKI))
    assert records.start == ["B 1", "B 1"]
    assert records.end == ["North Tower", "C"]
    np.testing.assert_array_equal(records.vectors[0], [-100.001, -99.999, 100.002])
    np.testing.assert_allclose(records.blocks[0], BLOCK / 4, rtol=1e-12)
    assert records.vector_sources == ["v.asc:7", "v.asc:15"]
    # a reference coordinate over a measured one, and both over that of a baseline
    np.testing.assert_array_equal(
        records.approximate["North Tower"], [4157100.001, 671200.001, 4774700.001]
    )
    assert records.epoch == pytest.approx(2009 + 60 / 365, abs=1e-9)


def test_tdef(tmp_path: Path) -> None:
    path = written(tmp_path, TDEF)
    records = read_tdef(path)
    assert (records.start, records.end) == (["P 1", "Q"], ["Q", "R"])
    np.testing.assert_allclose(records.blocks[0], BLOCK, rtol=1e-12)
    assert list(records.approximate) == ["P 1", "Q"]
    # south and east, north and west: opposite ends of the Earth
    p, q = records.approximate["P 1"], records.approximate["Q"]
    np.testing.assert_allclose(p[[0, 1, 2]], q * [1, -1, -1], atol=1e-6)
    assert p[1] > 0 > p[2]
    assert "1 vectors are solutions without fixed ambiguities (P 1 Q)" in records.warnings[0]
    (vectors,) = (t for t in read_files([path]).tables() if t.kind.kind == "gnss_baseline")
    assert list(vectors.columns["use"]) == [Use.ACTIVE, Use.OFF]
    assert vectors.columns["reason"][1].startswith("disabled")
    assert records.epoch == pytest.approx(2020 + 46 / 366, abs=1e-9)


@pytest.mark.parametrize("name", ["v.asc", "v.txt", "v", "v.gps"])
def test_the_content_tells_the_format(tmp_path: Path, name: str) -> None:
    for text in (SKI, TDEF):
        assert format_of(written(tmp_path, text, name)) == "gnss"


BAD = {
    "feet": (SKI, "Unit:                m", "Unit: ft", 1, "lengths are in 'ft'"),
    "geodetic": (SKI, "Cartesian", "Geodetic", 2, "not Cartesian"),
    "no number": (SKI, "-99.9990", "-99.99x", 8, "no numbers"),
    "infinite": (SKI, "-99.9990", "inf", 8, "no numbers"),
    "no vector": (SKI, "@-North", "@?North", 7, "no vector"),
    "no covariance": (SKI, "@=   1.0", "@?   1.0", 15, "no covariance"),
    "not positive": (SKI, "@=   0.50000   0.000004", "@=   0.5 -0.000004", 9, "no covariance mat"),
    "short": (SKI, "@=   1.00000   0.000004   0.0", "@=   1.0", 17, "six cofactors"),
    "itself": (SKI, "@-C ", "@-B 1 ", 16, "begins and ends at B 1"),
    "antennas": (TDEF, "MarkToMark", "AntennaToAntenna", 3, "not between marks"),
    "survey feet": (TDEF, "=meters", "=USSurveyFeet", 4, "lengths are in"),
    "gons": (TDEF, "=degrees", "=gons", 5, "angles are in"),
    "no hemisphere": (TDEF, "37.500000000S", "-37.5", 10, "does not end with"),
    "latitude": (TDEF, "37.500000000S", "97.5S", 10, "no place on the Earth"),
    "short vector": (TDEF, "1.2e-005:1.8", "1.2e-005", 15, ""),
    "word": (TDEF, "1.5:-2.5", "1.5:two", 15, "no numbers"),
    "same ends": (TDEF, "P 1:Q:", "Q:Q:", 15, "begins and ends at Q"),
    "no matrix": (TDEF, ":4e-6:", ":-4e-6:", 15, "no covariance matrix"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_files(tmp_path: Path, case: str) -> None:
    text, old, new, line, words = BAD[case]
    path = written(tmp_path, text.replace(old, new, 1))
    if not words:  # the values behind the covariance are not needed
        assert len(read_tdef(path).vectors) == 2
        return
    with pytest.raises(InputError) as caught:
        read_files([path])
    assert f"v.asc:{line}: " in str(caught.value)
    assert words in str(caught.value)
    assert not isinstance(caught.value, Refusals)


@pytest.mark.parametrize("text", [SKI[: SKI.index("@#")], TDEF[: TDEF.index("[GPS]")]])
def test_a_file_without_vectors(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError, match="the file has no"):
        read_files([written(tmp_path, text)])


@pytest.mark.data
class TestThirdParty:
    """The same session of four marks as TDEF, and as the DynaML that SKI-ASCII became."""

    def folder(self, shared_data: Path) -> Path:
        return shared_data / "gnss" / "vectors"

    def dynaml(self, shared_data: Path) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Vectors and covariances of the DynaML file by their ends."""
        path = self.folder(shared_data) / "skiasciisample_msr.xml"
        clusters = dynaml.parse(path, RefusalCollector()).clusters
        names = [f"{c.entries[0].first} {c.entries[0].second}" for c in clusters]
        vectors = [np.array([float(v) for v in c.entries[0].values]) for c in clusters]
        blocks = [c.covariance() for c in clusters]
        return dict(zip(names, vectors, strict=True)), dict(zip(names, blocks, strict=True))

    def test_ski_ascii_becomes_the_same_dynaml(self, shared_data: Path, tmp_path: Path) -> None:
        vectors, blocks = self.dynaml(shared_data)
        lines = SKI.splitlines()[:3]
        for k, (ends, vector) in enumerate(vectors.items()):
            start, end = ends.split()
            sigma0 = 0.2 + 0.1 * k
            upper = blocks[ends][np.triu_indices(3)] / sigma0**2
            lines += [
                f"@#{end:<16}-4087000.0000 2922000.0000 -3919000.0000 MEAS 0.002 22",
                f"@+{start:<16}-4087000.0000 2922000.0000 -3919000.0000",
                f"@-{end:<16}" + "".join(f"{v:>15.3f}" for v in vector),
                f"@={sigma0:>10.5f}" + "".join(f"{v:>25.16e}" for v in upper),
                "@*17.02.2020 04:51:22",
            ]
        records = read_ski(written(tmp_path, "\n".join(lines)))
        for start, end, vector, block in zip(
            records.start, records.end, records.vectors, records.blocks, strict=True
        ):
            np.testing.assert_array_equal(vector, vectors[f"{start} {end}"])
            np.testing.assert_allclose(block, blocks[f"{start} {end}"], rtol=1e-12)

    def test_tdef_agrees_with_the_other_processing(self, shared_data: Path) -> None:
        """Two programs, one session: 18 mm at 21 km at the most, most of it in height."""
        vectors, _ = self.dynaml(shared_data)
        records = read_tdef(self.folder(shared_data) / "skiasciisample.asc")
        assert len(records.vectors) == len(vectors) == 3
        for start, end, vector in zip(records.start, records.end, records.vectors, strict=True):
            sign, ends = (
                (1, f"{start} {end}")
                if f"{start} {end}" in vectors
                else (
                    -1,
                    f"{end} {start}",
                )
            )
            assert np.linalg.norm(vector - sign * vectors[ends]) < 0.035

    def test_a_campaign_of_eleven_marks(self, shared_data: Path) -> None:
        survey = read_files([self.folder(shared_data) / "tdef_example.asc"])
        assert (len(survey.points), survey.tables()[0].n) == (11, 31)
        adjustment = adjust(survey.network().with_datum(Datum("free")))
        assert adjustment.dof == 3 * 31 - 3 * 11 + 3
        assert adjustment.sigma0_posterior < 2
