"""Every command that reads scans, given bad ones: a sentence, status 2, nothing half-written."""

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.cli.scan_jobs import project
from tribrach.cli import app
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.e57_pages import PAGE, PAYLOAD, paged, read_header, read_xml

RUN = CliRunner()
XYZ = np.random.default_rng(0).uniform(-9, 9, (3000, 3))
FORMATS = (".las", ".laz", ".copc.laz", ".ply", ".e57", ".pcd", ".pts", ".ptx")
MANY = 10**15


def good(path: Path, xyz: np.ndarray = XYZ) -> Path:
    """A scan in the format of its name."""
    rows = "\n".join(" ".join(map(repr, row)) for row in xyz.tolist())
    n = len(xyz)
    match path.suffix:
        case ".pcd":
            head = f"VERSION .7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {n}\n"
            text = f"{head}HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA binary\n"
            path.write_bytes(text.encode() + xyz.tobytes())
        case ".pts":
            path.write_text(f"{n}\n{rows}\n")
        case ".ptx":
            pose = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
            path.write_text(f"{n}\n1\n{pose}" + rows.replace("\n", " 0.5\n") + " 0.5\n" * (n > 0))
        case ".ply":
            head = f"ply\nformat binary_little_endian 1.0\nelement vertex {n}\n"
            head += "".join(f"property double {a}\n" for a in "xyz") + "end_header\n"
            path.write_bytes(head.encode() + xyz.tobytes())
        case ".xyz":
            path.write_text(rows + "\n")
        case _:
            with create(path, CloudHeader(path.stem, (), 1e-5)) as writer:
                if n:
                    writer.write(xyz, {})
    return path


def truncated(path: Path) -> None:
    data = good(path).read_bytes()
    path.write_bytes(data[: 2 * len(data) // 3])


def wrong_page(path: Path) -> None:
    """A bit of a page of points has flipped."""
    data = bytearray(good(path).read_bytes())
    data[9 * PAGE + 7] ^= 4
    path.write_bytes(data)


def wrong_page_of_xml(path: Path) -> None:
    data = bytearray(good(path).read_bytes())
    data[-PAGE + 300] ^= 4
    path.write_bytes(data)


def absurd(path: Path) -> None:
    """The header states a million times a thousand million points."""
    data = good(path).read_bytes()
    n = str(len(XYZ)).encode()
    many = str(MANY).encode()
    match path.suffix:
        case ".las" | ".laz":
            changed = bytearray(data)
            struct.pack_into("<Q", changed, 247, MANY)
            data = bytes(changed)
        case ".e57":
            with path.open("rb") as file:
                header = read_header(file, path)
                text = read_xml(file, header, path)
            text = text.replace(b'recordCount="' + n, b'recordCount="' + many)
            logical = b"".join(data[k : k + PAYLOAD] for k in range(0, len(data), PAGE))
            body = logical[: header.xml_start] + text
            pages = -(-len(body) // PAYLOAD)
            new = type(header)(header.version, pages * PAGE, header.xml_offset, len(text))
            data = paged(new.to_bytes() + body[48:])
        case ".pcd":
            data = data.replace(b"WIDTH " + n, b"WIDTH " + many)
            data = data.replace(b"POINTS " + n, b"POINTS " + many)
        case ".ply":
            data = data.replace(b"element vertex " + n, b"element vertex " + many)
        case _:
            data = data.replace(n, many, 1)
    assert many in data or path.suffix in (".las", ".laz", ".e57")
    path.write_bytes(data)


def no_points(path: Path) -> None:
    good(path, np.zeros((0, 3)))


def no_numbers(path: Path) -> None:
    good(path, np.resize([np.nan, np.inf, -np.inf], (3000, 3)))


def end(*arguments: object) -> str:
    """What is said on standard error by a command that must end with status 2."""
    result = RUN.invoke(app, [str(a) for a in arguments])
    assert isinstance(result.exception, SystemExit | None), result.exception
    assert result.exit_code == 2, (arguments, result.output)
    assert "Traceback" not in result.output
    said = result.stderr.strip()
    assert said.startswith("tribrach: ")
    assert "\n" not in said
    return said


def arguments_of(command: str, bad: Path) -> tuple[object, ...]:
    match command:
        case "convert":
            other = ".ply" if bad.suffix in (".las", ".laz") else ".laz"
            return "convert", bad, bad.parent / f"new{other}"
        case "targets":
            return "targets", bad, "--sphere", 0.1, "--json", bad.parent / "new.json"
        case "run":
            return "run", project(bad.parent, bad.name)
        case _:
            return command, bad


def refused(command: str, bad: Path) -> str:
    """A command on a bad file: what it says; nothing is left but what a run remembers."""
    arguments = arguments_of(command, bad)
    before = set(bad.parent.rglob("*"))
    said = end(*arguments)
    assert bad.name in said
    new = [p for p in set(bad.parent.rglob("*")) - before if p.is_file()]
    assert not [p for p in new if ".tribrach" not in p.parts or p.name.endswith(".part")]
    return said


COMMANDS = ("info", "convert", "targets", "run")


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("damage", [truncated, absurd])
def test_damaged_files(tmp_path: Path, suffix: str, damage: Callable[[Path], None]) -> None:
    path = tmp_path / f"bad{suffix}"
    damage(path)
    for command in COMMANDS:
        refused(command, path)


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("damage", [wrong_page, wrong_page_of_xml])
def test_wrong_checksums(tmp_path: Path, command: str, damage: Callable[[Path], None]) -> None:
    path = tmp_path / "bad.e57"
    damage(path)
    assert "damaged" in refused(command, path)


@pytest.mark.parametrize("suffix", FORMATS)
def test_no_points(tmp_path: Path, suffix: str) -> None:
    """Nothing to find and nothing to place; there is no harm in saying what the file is."""
    path = tmp_path / f"bad{suffix}"
    no_points(path)
    for command in ("targets", "run"):
        assert "point" in refused(command, path)
    result = RUN.invoke(app, ["info", str(path)])
    assert result.exit_code in (0, 2), result.output
    assert "point" in result.output + result.stderr


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".pts", ".ptx", ".xyz"])
def test_no_finite_coordinates(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"bad{suffix}"
    no_numbers(path)
    for command in ("targets", "run"):
        assert "point" in refused(command, path)
    result = RUN.invoke(app, ["info", str(path)])
    assert result.exit_code in (0, 2), result.output
    assert "point" in result.output + result.stderr


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".pts", ".ptx", ".xyz"])
def test_some_coordinates_are_not_finite(tmp_path: Path, suffix: str) -> None:
    """They are no points: counted, and in no file that is written."""
    xyz = XYZ.copy()
    xyz[::10, 0], xyz[1::10, 1], xyz[2::10, 2] = np.nan, np.inf, -np.inf
    path = good(tmp_path / f"odd{suffix}", xyz)
    said = " ".join(RUN.invoke(app, ["info", str(path)]).stdout.split())
    assert "900 hold no point" in said
    new = tmp_path / "new.las"
    result = RUN.invoke(app, ["convert", str(path), str(new)])
    assert result.exit_code == 0, result.output
    assert "2100 points" in result.stdout


@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0, 1e300])
@pytest.mark.parametrize("place", [131, 155])
def test_scales_and_offsets_that_are_no_numbers(tmp_path: Path, value: float, place: int) -> None:
    """Scale (131) and offset (155) of x in the header of LAS."""
    path = good(tmp_path / "bad.las")
    data = bytearray(path.read_bytes())
    struct.pack_into("<d", data, place, value)
    path.write_bytes(data)
    if place == 155 and value == 0.0:
        return
    for command in COMMANDS:
        refused(command, path)
