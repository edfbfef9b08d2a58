"""Small files that mutations found: each ended otherwise than by a sentence once."""

import io
import json
import re
import shutil
import warnings
import zipfile
from pathlib import Path

import laspy
import numpy as np
import pytest

from tribrach.cloud.shared_part import checked_covariance
from tribrach.errors import InputError, Refusals
from tribrach.instruments.reduction import axis_errors
from tribrach.io.arrays import read_joint_covariance, read_named
from tribrach.io.calibration_file import read_calibration
from tribrach.io.comparison_table import read_comparison
from tribrach.io.lever_arm_file import read_lever_arm
from tribrach.io.scans.e57 import _cartesian
from tribrach.io.scans.formats import read_scans
from tribrach.io.survey.formats import read
from tribrach.io.transformation_file import read_transformation
from tribrach.project import Project, toml_file
from tribrach.units import LARGEST, too_large

SEEDS = Path(__file__).parents[2] / "fuzz" / "seeds"


def refused(path: Path, read_it=lambda path: read(path).network()) -> str:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError) as caught:
        read_it(path)
    assert path.name in str(caught.value)
    return str(caught.value)


def seed(name: str, folder: Path, *changes: tuple[str, str]) -> Path:
    """A seed with changes, each of which must change something."""
    source = SEEDS / name
    text = source.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / source.name
    path.write_text(text)
    return path


def test_what_is_beyond_any_measurement() -> None:
    assert too_large([1.0, -LARGEST])
    assert too_large(float("inf"))
    assert not too_large([1.0, float("nan"), -LARGEST / 2])


def test_sentences_hold_on_one_line_and_steer_no_terminal() -> None:
    words = str(InputError("x is \x1b[31mred\x1b[0m\nand \u202eback", file="a\r.csv"))
    assert words == r"a\r.csv: x is \x1b[31mred\x1b[0m\nand \u202eback."
    long = str(InputError("x is " + "A" * 5000 + " and " + "b " * 3000, file="a"))
    assert len(long) < 2000
    assert long.startswith("a: x is AAA")
    both = Refusals([InputError("one"), InputError("two\n")], 2)
    assert str(both).count("\n") == 2


def test_cofactors_without_bounds(tmp_path: Path) -> None:
    path = tmp_path / "a.asc"
    whole = (SEEDS / "ski" / "a.asc").read_text().splitlines()
    line = next(k for k, text in enumerate(whole) if text.startswith("@="))
    whole[line] = "@= 1e300 " + " ".join(whole[line][2:].split()[1:])
    path.write_text("\n".join(whole))
    assert "is beyond any measurement" in refused(path)


@pytest.mark.parametrize("number", ["1e20", "1e300", "-1e13"])
@pytest.mark.parametrize("format", ["starnet", "gama", "comp3d"])
def test_numbers_beyond_any_measurement(format: str, number: str, tmp_path: Path) -> None:
    if format == "starnet":
        path = tmp_path / "a.dat"
        path.write_text(f"C A 0 0 0 ! ! !\nC B 100 0 0 ! ! !\nD A-C {number}\nD B-C 70\n")
    elif format == "gama":
        path = tmp_path / "a.gkf"
        path.write_text(
            '<?xml version="1.0"?><gama-local xmlns="http://www.gnu.org/software/gama/gama-local">'
            '<network><points-observations distance-stdev="5">'
            '<point id="A" x="0" y="0" fix="xy"/><point id="B" x="1" y="1" fix="xy"/>'
            f'<point id="C" adj="xy"/><obs from="A"><distance to="C" val="{number}"/></obs>'
            "</points-observations></network></gama-local>"
        )
    else:
        (tmp_path / "a.cor").write_text(f"1 A 1000 2000 {number} 1 1 1\n")
        path = tmp_path / "a.obs"
        path.write_text(f"3 A B {number} 0.001\n")
        with pytest.raises(InputError):
            read([tmp_path / "a.cor", path])
        return
    assert "beyond any measurement" in refused(path)


def test_powers_of_distances_without_bounds(tmp_path: Path) -> None:
    path = tmp_path / "a.gkf"
    path.write_text(
        '<?xml version="1.0"?><gama-local xmlns="http://www.gnu.org/software/gama/gama-local">'
        '<network><points-observations distance-stdev="5 3 100000"><point id="A" x="0" y="0" '
        'fix="xy"/><point id="C" adj="xy"/><obs from="A"><distance to="C" val="90000"/></obs>'
        "</points-observations></network></gama-local>"
    )
    assert "the exponent of distance-stdev is 100000" in refused(path)


def test_angles_of_hundreds_of_digits(tmp_path: Path) -> None:
    path = tmp_path / "a.dat"
    path.write_text(f"C A 0 0 0 ! ! !\nC B 9 0 0 ! ! !\nM B-A-C {'9' * 400}-10-10 10 90-00-00\n")
    assert "beyond the circle" in refused(path)


def test_thousands_of_scans_in_one_file_of_text(tmp_path: Path) -> None:
    path = tmp_path / "a.pts"
    path.write_text("1\n1 2 3 4\n" * 5000)
    assert "the file has more than 1000 scans" in refused(path, read_scans)


def test_a_comp3d_project_with_numbers_that_are_none(tmp_path: Path) -> None:
    for name in ("net.cor", "net.obs"):
        (tmp_path / name).write_bytes((SEEDS / "comp3d" / "a" / name).read_bytes())
    for old, new in (
        ('"refraction": 0.12', '"refraction": NaN'),
        ('"refraction": 0.12', '"refraction": 1e999'),
        ('"files_unit": 1', '"files_unit": ' + "1" * 5000),
        ('"use_proj": false', '"use_proj": true'),
    ):
        refused(seed("comp3d/a/net.comp", tmp_path, (old, new)))


def test_tables_of_ours_with_numbers_that_are_none(tmp_path: Path) -> None:
    arm = seed("lever-arm/a.toml", tmp_path, ("x_m = ", "x_m = 1e308 #"))
    assert "x_m is beyond any measurement" in refused(arm, read_lever_arm)
    (tmp_path / "b.toml").write_text("a = [[inf]]\n")
    assert "a is beyond any measurement" in refused(tmp_path / "b.toml", read_calibration)
    for dimension in ("4", "0", "-1"):
        path = seed(
            "transformation/a.json", tmp_path, ('"dimension": 2', f'"dimension": {dimension}')
        )
        assert "there is no transformation" in refused(path, read_transformation)


def _npz(folder: Path, inner: bytes, packing: int = zipfile.ZIP_DEFLATED) -> Path:
    path = folder / "a.npz"
    with zipfile.ZipFile(path, "w", packing) as archive:
        archive.writestr("xyz.npy", inner)
    return path


def test_sets_of_arrays(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    arrays = {
        "xyz": np.arange(6.0).reshape(2, 3),
        "names": np.array(["A", "B"]),
        "none": np.zeros(0),
    }
    np.savez_compressed(path, allow_pickle=False, **arrays)
    whole = path.read_bytes()
    found = read_named(path, "xyz")
    assert all(np.array_equal(found[name], values) for name, values in arrays.items())
    found["xyz"][0] = 7.0  # as those of numpy, they can be written to
    assert "has no array place" in refused(path, lambda path: read_named(path, "place"))
    inner = io.BytesIO()
    np.save(inner, np.arange(6.0))
    plain = inner.getvalue()
    for data in (
        plain.replace(b"(6,)", b"(9,)"),
        plain.replace(b"(6,), }", b"(4294967295,), }"),
        plain.replace(b"'<f8'", b"'|O8'"),
        plain.replace(b"False", b"{1: "),
        plain.replace(b"(6,)", b"(-6,)"),
        plain[:-1],
        plain[:20],
        b"",
    ):
        refused(_npz(tmp_path, data), read_named)
    for k in range(0, len(whole), 7):
        path.write_bytes(whole[:k] + bytes([whole[k] ^ 0xFF]) + whole[k + 1 :])
        try:
            read_named(path)
        except InputError:
            continue
    path.write_bytes(whole[:-30])
    refused(path, read_named)


def test_an_array_packed_a_thousandfold(tmp_path: Path) -> None:
    inner = io.BytesIO()
    np.save(inner, np.zeros(3_000_000))
    path = _npz(tmp_path, inner.getvalue(), zipfile.ZIP_BZIP2)
    assert path.stat().st_size < 2000
    refused(path, read_named)


def test_a_joint_covariance_with_a_header_of_other_things(tmp_path: Path) -> None:
    path = tmp_path / "poses.npy"
    text = b"{'descr': '<f8', 'fortran_order': False, 'shape': (12, 12), True: 1, }"
    head = text.ljust(117) + b"\n"
    path.write_bytes(b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head + bytes(1152))
    refused(path, lambda path: read_joint_covariance(path, 2))


def test_a_header_of_an_array_that_python_would_warn_of(tmp_path: Path) -> None:
    path = tmp_path / "poses.npy"
    head = b"{'descr': '\\,f8', 'fortran_order': False, 'shape': (12, 12)}".ljust(117) + b"\n"
    path.write_bytes(b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head + bytes(1152))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        refused(path, lambda path: read_joint_covariance(path, 2))


def test_a_line_of_a_solution_that_looks_like_a_comment(tmp_path: Path) -> None:
    path = tmp_path / "b.pos"
    path.write_text(
        "% program   : RTKLIB ver.2.4.3\n% pos mode  : Static\n"
        "% ref pos   :  4252568.4139 2709171.1615 3894669.541\n"
        "% (lat/lon/height=WGS84/ellipsoidal)\n"
        "%  GPST  latitude(deg) longitude(deg) height(m) Q ns sdn\n"
        "2005/04/02 00:00:00.000 # 0.0 50.0 1 8 0.004 0.005 0.006 -0.003 0.002 -0.001 0.00 9.9\n"
    )
    assert "no time and thirteen numbers" in refused(path)


def test_a_shift_beyond_any_measurement(tmp_path: Path) -> None:
    source = SEEDS / "transformation" / "a.json"
    data = json.loads(source.read_text())
    data["shift_at_centre"][0] = -1e308
    path = tmp_path / "a.json"
    path.write_text(json.dumps(data))
    assert "is beyond any measurement" in refused(path, read_transformation)


def test_a_sigma_of_a_height_that_is_not_given(tmp_path: Path) -> None:
    path = tmp_path / "a.dat"
    path.write_text("C A 0 0 0 ! ! !\nC B 100 0 * * 0.001\nD A-B 100\n")
    assert "B has a standard error of its height, and no height" in refused(path)


def test_a_name_of_a_file_that_none_can_have(tmp_path: Path) -> None:
    folder = tmp_path / "job"
    shutil.copytree(SEEDS / "comp3d" / "a", folder)
    path = folder / "net.comp"
    path.write_text(path.read_text().replace("net.cor", "net.c\0r"))
    with pytest.raises(InputError, match="no file can be named"):
        read(path)


@pytest.mark.parametrize("text", ['[output]\nfolder = "a\\u0000b"\n', '["a\\U00000000"]\n'])
def test_a_project_with_the_character_nul(text: str, tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text("# a job\n" + text)
    assert "a.toml:" in refused(path, Project.load)
    assert "holds the character NUL" in refused(path, Project.load)


def test_a_figure_of_a_comparison_beyond_any_measurement(tmp_path: Path) -> None:
    data = json.loads((SEEDS / "comparison" / "a.json").read_text())
    name = next(key for key, value in data["sites"][0].items() if isinstance(value, float))
    data["sites"][0][name] = -1e308
    path = tmp_path / "a.json"
    path.write_text(json.dumps(data))
    assert "is beyond any measurement" in refused(path, lambda path: read_comparison(path, [name]))


def test_a_date_of_a_vector_that_is_none(tmp_path: Path) -> None:
    text = (SEEDS / "tdef" / "a.asc").read_text()
    date = re.search(r"\b\d\d \d\d \d{4}\b", text)
    assert date is not None
    path = tmp_path / "a.asc"
    path.write_text(text.replace(date.group(), "51 02 2020"))
    assert "epoch '51.02.2020' is not a date" in refused(path, read)


def test_a_project_with_a_thousand_wrong_keys_looks_for_few_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.toml"
    path.write_text("[[points]]\nfile = 'a.csv'\nnothing = 1\n" * 1000)
    looked = []
    line_of = toml_file.line_of
    monkeypatch.setattr(
        toml_file, "line_of", lambda *given: looked.append(given) or line_of(*given)
    )
    assert refused(path, Project.load).startswith("1000 records are refused:")
    # each of them walks through the whole text
    assert len(looked) == 20


def test_a_sight_along_the_vertical_axis_in_both_faces() -> None:
    half = np.array([1e-5, 2e-5, 1.5e-5, 1e-5])
    zenith = np.array([0.0, 1.2, 1.5, 1.6])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        errors = axis_errors(half, half, zenith)
    assert errors.pairs == 3
    assert np.isnan(errors.residual_direction[0])


def test_an_infinite_angle_of_a_scan_is_no_point() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        xyz = _cartesian(np.array([[5.0, 0.0, 0.0], [5.0, np.inf, 0.0], [5.0, 0.0, -np.inf]]))
    assert np.isfinite(xyz).all(axis=1).tolist() == [True, False, False]


@pytest.mark.parametrize("number", [1e300, 1e13, -1e-6])
def test_a_joint_covariance_with_numbers_that_are_none(number: float) -> None:
    covariance = 1e-6 * np.eye(12)
    covariance[3, 3] = number
    with pytest.raises(InputError, match=r"beyond any measurement|negative variance"):
        checked_covariance(covariance, 12, "the poses")


def test_a_horizontal_distance_along_the_vertical_axis(tmp_path: Path) -> None:
    path = tmp_path / "a.rw5"
    path.write_text(
        "MO,AD0,UN1,SF1.00000000,EC0,EO0.0,AU0\nOC,OP104,N 600.0,E 300.0,EL5.0,--TPT.\n"
        "LS,HI5.330,HR5.690\nBK,OP104,BP103,BS45.3000,BC0.0000\n"
        "FD,OP104,FP105,AR189.1420,ZE89.2229,SD60.0\nSS,OP104,FP106,AL90.0000,ZE000,HD50.0\n"
    )
    said = " ".join(map(str, read(path).warnings))
    assert "a sight along the vertical axis has a horizontal distance" in said


def test_more_points_of_las_than_the_file_has_bytes_for(tmp_path: Path) -> None:
    """A few wrong bytes would reserve 450 MB for the first chunk."""
    path = tmp_path / "a.las"
    header = laspy.LasHeader(point_format=3, version="1.2")
    with laspy.open(path, "w", header=header) as file:
        file.write_points(laspy.ScaleAwarePointRecord.zeros(4, header=header))
    data = bytearray(path.read_bytes())
    data[107:111] = b"\xff" * 4
    path.write_bytes(data)
    told = refused(path, read_scans)
    assert "the header promises 4294967295 points of 34 bytes, and the file has 136 bytes" in told


def test_a_negative_variance_of_an_adjusted_coordinate(tmp_path: Path) -> None:
    path = seed("gama/b.xml", tmp_path, ("<flt>16.0</flt>", "<flt>-16.0</flt>"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "covariance matrix of the adjusted coordinates is singular" in refused(path)


@pytest.mark.parametrize("key", ["root_OBS_file", "root_COR_file", "coord_cov_file"])
@pytest.mark.parametrize("name", ["/dev/zero", "../net.obs", "a\\..\\..\\b.cor"])
def test_a_project_of_comp3d_names_files_elsewhere(tmp_path: Path, key: str, name: str) -> None:
    """One that never ends took all memory."""
    path = seed("comp3d/a/net.comp", tmp_path)
    for part in ("net.cor", "net.obs"):
        seed(f"comp3d/a/{part}", tmp_path)
    head, _, project = path.read_text().partition("{")
    whole = json.loads("{" + project)
    whole["config"][key] = name
    path.write_text(head + json.dumps(whole))
    assert "is outside the folder of the data" in refused(path)


def test_a_link_beside_the_data_that_leads_elsewhere(tmp_path: Path) -> None:
    path = seed("comp3d/a/net.comp", tmp_path)
    seed("comp3d/a/net.cor", tmp_path)
    (tmp_path / "net.obs").symlink_to("/dev/zero")
    assert "is outside the folder of the data" in refused(path)
