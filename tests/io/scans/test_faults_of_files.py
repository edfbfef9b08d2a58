"""Sound files of others that were misread, each with what is right."""

from pathlib import Path

import laspy
import numpy as np
import pytest
from typer.testing import CliRunner

from tests.io.scans.scan_files import whole
from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.io.scans.formats import read_scans
from tribrach.io.scans.info import describe
from tribrach.io.scans.reading import as_told
from tribrach.scan.no_return import find_no_return


@pytest.fixture
def faults(shared_data: Path) -> Path:
    folder = shared_data / "faults" / "scans2"
    if not folder.is_dir():
        pytest.skip(f"there is no {folder}")
    return folder


def test_feet(faults: Path) -> None:
    earlier, later = (
        read_scans(faults / "03-feet" / f"{name}.las")[0] for name in ("earlier", "later")
    )
    one, two = whole(earlier, 30000).xyz, whole(later, 30000).xyz
    assert np.ptp(one, axis=0)[:2] == pytest.approx([10.05, 10.05], abs=0.01)
    assert two[:, 2].mean() - one[:, 2].mean() == pytest.approx(0.1 * 1200 / 3937, abs=5e-5)


def test_millimetres(faults: Path) -> None:
    (stated,) = read_scans(faults / "17-millimetres" / "m.ply")
    assert np.ptp(whole(stated, 40000).xyz, axis=0).max() == pytest.approx(18.0, abs=0.01)
    (silent,) = read_scans(faults / "17-millimetres" / "m.xyz")
    doubt = find_no_return(silent).doubt
    assert doubt is not None
    assert doubt.key == "steep"


def test_each_axis_has_its_step(faults: Path, tmp_path: Path) -> None:
    (scan,) = read_scans(faults / "16-stairs" / "s.las")
    assert describe(scan).axes == (0.0625, 0.5, 0.001)
    rng = np.random.default_rng(1)
    for digits, axes in (((3, 3, 3), None), ((3, 1, 3), (0.001, 0.1, 0.001))):
        columns = [rng.uniform(-9, 9, 500).round(digit) for digit in digits]
        np.savetxt(tmp_path / "a.xyz", np.column_stack(columns), fmt="%.3f")
        assert describe(read_scans(tmp_path / "a.xyz")[0]).axes == axes


def converted(source: Path, destination: Path) -> int:
    """The exit code of `convert`."""
    return CliRunner().invoke(app, ["convert", str(source), str(destination), "-q"]).exit_code


def test_e57_is_written_in_metres(faults: Path, tmp_path: Path) -> None:
    assert converted(faults / "03-feet" / "earlier.las", tmp_path / "x.e57") == 0
    (scan,) = read_scans(tmp_path / "x.e57")
    assert np.ptp(whole(scan, 30000).xyz, axis=0)[:2] == pytest.approx([10.05, 10.05], abs=0.01)
    assert not any("metres" in warning for warning in scan.warnings)


def test_degrees(faults: Path, tmp_path: Path) -> None:
    source = faults / "04-degrees" / "d.las"
    assert converted(source, tmp_path / "d.laz") == 0
    one, two = laspy.read(source), laspy.read(tmp_path / "d.laz")
    assert np.array_equal(one.X, two.X)
    assert np.array_equal(one.header.scales, two.header.scales)
    assert converted(source, tmp_path / "d.e57") == 2
    # cells of COPC are cubes
    assert converted(source, tmp_path / "d.copc.laz") == 2


@pytest.mark.parametrize("suffix", [".laz", ".e57", ".ply", ".copc.laz"])
def test_extra_bytes_without_a_description(faults: Path, tmp_path: Path, suffix: str) -> None:
    source = faults / "09-extra-bytes" / "e.las"
    assert converted(source, tmp_path / f"e{suffix}") == 0
    (one,), (two,) = read_scans(source), read_scans(tmp_path / f"e{suffix}")
    given, found = whole(one, 10000), whole(two, 10000)
    extra = [name for name in given.values if name.startswith("ExtraBytes")]
    assert len(extra) == 4
    assert all(sorted(found.values[n]) == sorted(given.values[n]) for n in extra)


@pytest.mark.parametrize("suffix", [".laz", ".e57", ".copc.laz"])
def test_coordinates_of_the_size_of_utm(shared_data: Path, tmp_path: Path, suffix: str) -> None:
    source = shared_data / "faults" / "algorithms" / "12-utm-ply-not-convertible" / "u.ply"
    if not source.is_file():
        pytest.skip(f"there is no {source}")
    assert converted(source, tmp_path / f"u{suffix}") == 0
    (one,), (two,) = read_scans(source), read_scans(tmp_path / f"u{suffix}")
    given, found = whole(one).xyz, whole(two).xyz
    order = np.lexsort(given.T), np.lexsort(found.T)
    assert np.abs(given[order[0]] - found[order[1]]).max() < 0.6e-4


@pytest.mark.parametrize("name", ["unit", "db", "const"])
def test_intensities_that_16_bits_do_not_hold(shared_data: Path, tmp_path: Path, name: str) -> None:
    folder = shared_data / "faults" / "algorithms" / "16-intensity-destroyed-in-laz"
    if not folder.is_dir():
        pytest.skip(f"there is no {folder}")
    assert converted(folder / f"{name}.ply", tmp_path / "a.laz") == 0
    (one,), (two,) = read_scans(folder / f"{name}.ply"), read_scans(tmp_path / "a.laz")
    given, found = (whole(scan, 3000).values["intensity"] for scan in (one, two))
    assert np.array_equal(given, found, equal_nan=True)


#: the hall that text files of the collection show [m]
HALL = np.array([[691234.0, 5334567.0, 520.0], [691252.0, 5334578.0, 524.2]])


def shows_the_hall(path: Path, **told: str) -> bool:
    with as_told(**told):
        (scan,) = read_scans(path)
    xyz = whole(scan).xyz
    return bool(np.abs(np.stack([xyz.min(axis=0), xyz.max(axis=0)]) - HALL).max() < 0.01)


@pytest.mark.parametrize("name", ["blanks.txt", "tabs.txt"])
def test_decimal_commas(faults: Path, name: str) -> None:
    assert shows_the_hall(faults / "05-decimal-comma" / name)


@pytest.mark.parametrize("name", ["id.txt", "named.csv"])
def test_numbers_and_codes_of_points(faults: Path, name: str) -> None:
    assert shows_the_hall(faults / "06-point-number" / name)


def test_columns_without_names_are_asked_for(faults: Path) -> None:
    source = faults / "06-point-number" / "code.csv"
    with pytest.raises(InputError, match="--columns"):
        read_scans(source)
    assert shows_the_hall(source, columns="number y x z code")


@pytest.mark.parametrize(
    ("name", "field"), [("f.pts", "Volume density (r=0.01)"), ("q.txt", "M3C2 distance")]
)
def test_names_with_blanks(faults: Path, name: str, field: str) -> None:
    (scan,) = read_scans(faults / "08-field-names" / name)
    assert field in scan.names
    assert len(whole(scan)) == scan.records


def test_padded_pcd(faults: Path) -> None:
    (scan,) = read_scans(faults / "07-padded-pcd" / "p.pcd")
    assert scan.records == 36_000
    assert describe(scan).figures.points == pytest.approx(27_000, abs=100)


def test_newer_items_of_laz(faults: Path) -> None:
    with pytest.raises(InputError, match="newer version"):
        read_scans(faults / "10-laz-items-4" / "v4.laz")


def test_nan_in_the_matrix_of_ptx(faults: Path) -> None:
    with pytest.raises(InputError, match="nan") as caught:
        read_scans(faults / "19-ptx-words" / "nan.ptx")
    assert "more points" not in str(caught.value)


def test_copc_with_chunks_of_any_size(faults: Path) -> None:
    (scan,) = read_scans(faults / "20-copc-chunk-zero" / "c.copc.laz")
    assert len(whole(scan)) == 30
