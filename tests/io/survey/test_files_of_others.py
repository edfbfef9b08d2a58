"""Files as other programs leave them: rounded seconds, face two, transmission marks, suffixes."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.gnss.rinex_samples import rinex_2
from tribrach.errors import InputError
from tribrach.io.gnss.observation_file import read_observations
from tribrach.io.survey.comp3d.text import comp3d_lines
from tribrach.io.survey.formats import format_of, read_files
from tribrach.io.survey.starnet.recognition import recognised
from tribrach.io.totalstation import formats as raw_formats
from tribrach.job.folder import look_through
from tribrach.network.adjustment import adjust
from tribrach.units import carried_angles, parse_angle


@pytest.fixture(scope="module")
def faults(shared_data: Path) -> Path:
    """The networks of others that were refused or read wrongly."""
    folder = shared_data / "faults" / "networks2"
    if not folder.is_dir():
        pytest.skip(f"third-party data are not in {folder}")
    return folder


# rounded seconds


@given(st.integers(0, 359), st.integers(0, 60), st.booleans())
def test_sixty_seconds_are_carried(degrees: int, minutes: int, negative: bool) -> None:
    sign = "-" if negative else ""
    with carried_angles() as carried:
        value = parse_angle(f"{sign}{degrees}-{minutes:02d}-60", "dms")
    expected = math.radians(degrees + (minutes + 1) / 60)
    assert value == pytest.approx(-expected if negative else expected, abs=1e-12)
    assert len(carried) == 1


def test_more_than_sixty_are_refused() -> None:
    for text in ("35-44-60.1", "35-61-00", "35-44-75"):
        with pytest.raises(ValueError, match="more than 60"):
            parse_angle(text, "dms")


FORMS = {
    "net.gkf": (
        '<gama-local><network axes-xy="en"><points-observations direction-stdev="5">'
        '<point id="A" x="0" y="0" fix="xy"/><point id="B" x="100" y="0" fix="xy"/>'
        '<point id="P" adj="xy"/><obs from="A"><direction to="B" val="10-00-00"/>'
        '<direction to="P" val="54-59-60"/><distance to="P" val="50" stdev="5"/></obs>'
        "</points-observations></network></gama-local>",
        1,
    ),
    "net.dat": (
        ".2D\n.ORDER EN ATFROMTO\nC A 0 0 ! !\nC B 100 0 ! !\nC P 35.355 35.355\n"
        "A A-B-P 314-59-60 5\nD A-P 50.0 0.005\n",
        1,
    ),
    "net.csv": (
        "at,from,to,angle_dms,sigma_angle_arcsec\nA,B,P,314-59-60,5\nA,B,Q,314-60-00,5\n",
        2,
    ),
}


@pytest.mark.parametrize("name", FORMS)
def test_every_reader_carries_and_says_so(tmp_path: Path, name: str) -> None:
    text, count = FORMS[name]
    path = tmp_path / name
    path.write_text(text)
    survey = read_files([path])
    said = [w for w in survey.warnings if "60" in w and "carried" in w]
    assert len(said) == 1
    assert f"{count} angle" in said[0]


def test_sixty_seconds_of_others(faults: Path) -> None:
    survey = read_files([faults / "11-sixty-seconds" / "net.gkf"])
    direction = next(o for o in survey.network().observations if o.kind == "direction")
    np.testing.assert_allclose(
        direction.values[:, 0], np.radians([35.75, 80.75]), rtol=0, atol=1e-12
    )


# readings of face two


def spatial(zeniths: list[str], matrix: str = "") -> str:
    sights = "".join(f'<z-angle to="P" val="{z}"/>' for z in zeniths)
    return (
        '<gama-local><network axes-xy="en"><points-observations direction-stdev="5" '
        'zenith-angle-stdev="5"><point id="A" x="0" y="0" z="0" fix="xyz"/>'
        '<point id="P" x="30" y="40" fix="xy" adj="z"/>'
        f'<obs from="A">{sights}{matrix}</obs></points-observations></network></gama-local>'
    )


@given(st.floats(40, 160))
def test_zeniths_of_face_two_are_those_of_face_one(
    tmp_path_factory: pytest.TempPathFactory, zenith: float
) -> None:
    path = tmp_path_factory.mktemp("gama") / "net.gkf"
    path.write_text(spatial([f"{zenith:.6f}", f"{400 - zenith:.6f}"]))
    survey = read_files([path])
    values = survey.network().observations[0].values
    assert abs(values[0, 0] - values[1, 0]) < 1e-9
    assert len([w for w in survey.warnings if "face two" in w]) == 1


def test_covariances_of_face_two_change_their_sign(tmp_path: Path) -> None:
    path = tmp_path / "net.gkf"
    matrix = '<cov-mat dim="2" band="1">9 4 16</cov-mat>'
    path.write_text(spatial(["90", "310"], matrix))
    turned = adjust(read_files([path]).network()).points["P"].sigma[2]
    path.write_text(spatial(["90", "90"], matrix.replace(" 4 ", " -4 ")))
    assert turned == pytest.approx(adjust(read_files([path]).network()).points["P"].sigma[2])


def test_plan_of_a_file_with_face_two(faults: Path) -> None:
    adjustment = adjust(read_files([faults / "10-face-two-zenith" / "net.gkf"]).network())
    assert adjustment.dof == 98
    assert math.sqrt(adjustment.posterior_factor) == pytest.approx(0.644, abs=6e-4)


# results without a namespace


def test_results_without_a_namespace(faults: Path, tmp_path: Path) -> None:
    old = faults / "12-gama-result-no-namespace" / "epoch_a.xml"
    new = tmp_path / "epoch_a.xml"
    new.write_text(
        old.read_text().replace(
            "<gama-local-adjustment version",
            '<gama-local-adjustment xmlns="http://www.gnu.org/software/gama/gama-local-adjustment" '
            "version",
        )
    )
    first, second = (read_files([path]) for path in (old, new))
    assert first.points.keys() == second.points.keys()
    assert len(first.points) > 5
    for name, point in first.points.items():
        np.testing.assert_array_equal(point.xyz, second.points[name].xyz)


# marks of a transmission


MARKS = ("", "<STX>", "STX", "\x02", "[SOH]", "\ufeff<STX>", "\n\n<STX>", "Job of 3 May\n<STX>")
SDR = (
    "00NMSDR33 V04-04.02     01-JAN-08 00:00 111111\n"
    "02TP" + "1".rjust(16) + "".join(f"{x:.3f}".ljust(16) for x in (100.0, 200.0, 10.0, 1.5)) + "\n"
    "09F1" + "1".rjust(16) + "2".rjust(16)
    + "".join(f"{x:.4f}".ljust(16) for x in (50.0, 90.0, 45.0)) + "\n"
)  # fmt: skip


@pytest.mark.parametrize("mark", MARKS)
def test_a_mark_before_the_header_of_sdr(tmp_path: Path, mark: str) -> None:
    path = tmp_path / "job.sdr"
    path.write_text(f"{mark}\n{SDR}" if mark not in ("", "\x02") else mark + SDR)
    assert format_of(path) == "totalstation"
    raw = raw_formats.read(path)
    assert raw.shots.target.tolist() == ["2"]
    assert raw.shots.distance.tolist() == [50.0]


@pytest.mark.parametrize("mark", MARKS[:-1])
def test_a_mark_before_gsi(tmp_path: Path, mark: str) -> None:
    path = tmp_path / "job.gsi"
    line = "110002+000000P1 21.322+12345670 22.322+08812340 31..00+00012345 \n"
    path.write_text(f"{mark}\n{line}" if mark not in ("", "\x02") else mark + line)
    assert raw_formats.read(path).shots.target.tolist() == ["P1"]


def test_sdr_of_others(faults: Path, tmp_path: Path) -> None:
    marked = faults / "13-sdr-transmission-mark" / "job.sdr"
    plain = tmp_path / "job.sdr"
    plain.write_text(marked.read_text(encoding="utf-8-sig").replace("<STX>\n", ""))
    first, second = raw_formats.read(marked), raw_formats.read(plain)
    assert len(first.shots) == len(second.shots) > 5
    np.testing.assert_array_equal(first.shots.distance, second.shots.distance)


# suffixes that promise another content


@pytest.mark.parametrize("suffix", [".sdr", ".gsi", ".m5", ".jxl", ".rw5", ".obs", ".cor"])
def test_a_suffix_of_other_content_is_told_with_the_line(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"lines{suffix}"
    path.write_text("\n# 103-04-09023 103-04-09022 04.11.2019 11.21 431.63 5.30169\n")
    with pytest.raises(InputError) as refused:
        format_of(path)
    assert refused.value.line == 2
    assert "103-04-09023" in refused.value.what


def test_rinex_is_not_comp3d(tmp_path: Path) -> None:
    path = tmp_path / "site.obs"
    path.write_text(rinex_2())
    with pytest.raises(InputError, match="RINEX"):
        format_of(path)


def test_raw_files_with_the_suffix_of_comp3d(tmp_path: Path) -> None:
    path = tmp_path / "job.obs"
    path.write_text(SDR)
    assert format_of(path) == "totalstation"


def test_levelling_lines_of_others(faults: Path) -> None:
    with pytest.raises(InputError) as refused:
        format_of(faults / "21-obs-suffix" / "lines.obs")
    assert refused.value.line == 1
    assert "103-04-09023" in refused.value.what


def test_files_of_comp3d_are_theirs(shared_data: Path) -> None:
    files = [f for s in ("obs", "cor") for f in shared_data.glob(f"networks/comp3d/*/*.{s}")]
    assert len(files) > 5
    assert all(map(comp3d_lines, files))


# positions of RINEX


@pytest.mark.parametrize("shift", range(-2, 5))
def test_shifted_positions_of_rinex(tmp_path: Path, shift: int) -> None:
    plain = tmp_path / "plain.obs"
    plain.write_text(rinex_2())
    lines = rinex_2().splitlines()
    for k in (4, 5):
        text = lines[k][:60].rstrip()
        text = " " * shift + text if shift > 0 else text[-shift:]
        lines[k] = text.ljust(60) + lines[k][60:]
    path = tmp_path / "a.obs"
    path.write_text("\n".join(lines) + "\n")
    right, read = read_observations(plain), read_observations(path)
    np.testing.assert_array_equal(read.approximate, right.approximate)
    np.testing.assert_array_equal(read.delta, right.delta)
    # the engine reads columns
    assert read.text.split() == right.text.split()
    columns = [float(read.text.splitlines()[4][k : k + 14]) for k in (0, 14, 28)]
    assert columns == right.approximate.tolist()


def test_a_position_that_nobody_needs(tmp_path: Path) -> None:
    path = tmp_path / "a.obs"
    path.write_text(rinex_2().replace("  4157177.0658", "  unknown     "))
    assert np.isnan(read_observations(path).approximate).all()


def test_an_antenna_that_is_no_number_is_told_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "a.obs"
    path.write_text(rinex_2().replace("        1.2345", "        1.23x5"))
    with pytest.raises(InputError) as refused:
        read_observations(path)
    assert refused.value.line == 6


def test_a_shifted_position_of_others(faults: Path) -> None:
    read = read_observations(faults / "15-rinex-position-shifted" / "site.10o")
    assert read.approximate.tolist() == [4789028.4701, 176610.0133, 4195017.031]
    assert read.delta.tolist() == [0.903, 0.0, 0.0]


# lists of points

#: names of points, nearly all of which are data types of STAR*NET as well
NAMES = ["A", "B", "C", "D", "E", "P", "M", "L", "V", "T", "SS", "DB", "DN", "I", "G1", "P7"]


def listed(names: list[str], separator: str = " ", comma: str = ".") -> str:
    rows = [(name, 100.5 + 50 * k, 200.25 + 3 * k, 10.125 + k) for k, name in enumerate(names)]
    return "".join(
        separator.join([name, *(f"{x:.3f}".replace(".", comma) for x in xyz)]) + "\n"
        for name, *xyz in rows
    )


@given(st.lists(st.sampled_from(NAMES), unique=True, min_size=2))
def test_points_named_like_data_types_are_a_list(
    tmp_path_factory: pytest.TempPathFactory, names: list[str]
) -> None:
    path = tmp_path_factory.mktemp("list") / "control.txt"
    path.write_text(listed(names))
    assert not recognised(path)


def test_data_of_starnet_stay_theirs(tmp_path: Path) -> None:
    path = tmp_path / "net.txt"
    path.write_text("C 1 100.0 200.0\nC 2 300.0 200.0\nC 3 250.0 90.0\nD 1-2 200.0\n")
    assert recognised(path)
    path.write_text("C 1 100.0 200.0 ! !\nA 1-2-3 90-00-00\nD 1-2 200.0\n")
    assert recognised(path)


@pytest.mark.parametrize("row", range(4))
def test_one_decimal_comma_is_told_with_its_line(tmp_path: Path, row: int) -> None:
    lines = listed(["P101", "P102", "P103", "P104"]).splitlines()
    lines[row] = lines[row].replace(".", ",", 1)
    (tmp_path / "control.txt").write_text("\n".join(lines) + "\n")
    (found,) = look_through(tmp_path)
    assert found.kind == "not understood"
    assert "no format" not in found.words
    if row:
        assert f"line {row + 1}" in found.words


@pytest.mark.parametrize(
    ("folder", "words"),
    [("27-list-decimal-comma", "150,000"), ("28-list-named-A-B-C", "3 points")],
)
def test_lists_of_others(faults: Path, tmp_path: Path, folder: str, words: str) -> None:
    shutil.copy(faults / folder / "control.txt", tmp_path / "control.txt")
    (found,) = look_through(tmp_path)
    assert words in found.words


def test_face_two_in_tables_and_starnet(tmp_path: Path) -> None:
    """Zenith angles of face two count alike wherever they stand, with one note."""
    points = tmp_path / "points.csv"
    points.write_text("point,easting_m,northing_m,height_m,role\nA,0,0,0,fixed\nB,100,0,0,fixed\n")
    sights = tmp_path / "sights.csv"
    sights.write_text(
        "from,to,direction_gon,zenith_gon,slope_distance_m,sigma_direction_arcsec,"
        "sigma_zenith_arcsec,sigma_slope_distance_mm\n"
        "A,B,100,100,100,5,5,3\nA,P,50,310,71.5,5,5,3\nB,A,300,300,100,5,5,3\n"
    )
    job = tmp_path / "job.dat"
    job.write_text(
        ".UNITS METERS DMS\n.ORDER EN ATFROMTO\n.3D\nC A 0 0 0 ! ! !\nC B 100 0 0 ! ! !\n"
        "DB A\nDM B 90-00-00 100 90-00-00\nDM P 45-00-00 71.5 279-00-00\nDE\n"
    )
    for paths in ([points, sights], [job]):
        survey = read_files(paths)
        zeniths = next(t for t in survey.tables() if t.kind.kind == "zenith")
        values = np.asarray(zeniths.columns["values"])
        assert (values < np.pi).all()
        assert values.min() == pytest.approx(np.radians(81.0))
        assert sum("face two" in text for text in survey.warnings) == 1
