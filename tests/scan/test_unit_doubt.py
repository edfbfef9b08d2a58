"""Coordinates that can be no metres are asked about, once, by every command that reads points."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.algorithms.clouds import room, write_ply
from tests.cli.test_bad_scans import RUN
from tribrach.cli import app
from tribrach.io.scans.formats import read_scans
from tribrach.scan.length_unit import METRES, LengthUnit
from tribrach.scan.unit_doubt import unit_doubt

RNG = np.random.default_rng(1)
ROOM = room(RNG, 2000)
#: a yard that is scanned from a tripod, with neither sky nor feet
FLAT = np.column_stack([RNG.uniform(-30, 30, (5000, 2)), np.full(5000, -1.7)])
FLAT = FLAT[np.hypot(*FLAT.T[:2]) > 2.4]


@pytest.mark.parametrize(
    ("xyz", "scale", "known", "key"),
    [
        (ROOM, 1.0, True, None),
        (ROOM, 1000.0, True, "steep"),
        (ROOM, 100.0, True, "tower"),
        (ROOM, 1000.0, False, "high"),
        (ROOM, 1e5, False, "wide"),
        (ROOM, 1e-5, False, "narrow"),
        (ROOM, (1 / 73000, 1 / 111000, 1.0), False, "slender"),
        (ROOM * [1, 1, 1.25], 1 / 0.3048, True, "feet"),
        (ROOM * [1, 1, 3], 1.0, True, None),
        (FLAT, 1.0, True, None),
        (FLAT, 1 / 0.3048, True, None),
        (FLAT, 100.0, True, "far"),
        (FLAT, 1 / 0.0254, True, "far"),
        (np.rint(200 * ROOM), 1.0, False, "coarse"),
    ],
)
def test_what_no_scan_in_metres_shows(
    tmp_path: Path, xyz: np.ndarray, scale: float, known: bool, key: str | None
) -> None:
    scan = read_scans(write_ply(tmp_path / "a.ply", xyz * scale))[0]
    scan = replace(scan, origin="stated" if known else "unknown")
    found = unit_doubt(scan, xyz * np.array(scale))
    assert (None if found is None else found.key) == key
    given = replace(scan, unit=replace(METRES, source="as given"))
    assert unit_doubt(given, xyz * np.array(scale)) is None
    degrees = replace(scan, unit=LengthUnit(("degree", "degree", "metre"), None))
    assert unit_doubt(degrees, xyz * np.array(scale)) is None


@pytest.mark.parametrize("command", ["info", "register", "compare", "complete", "noise", "targets"])
def test_every_command_asks_once(tmp_path: Path, command: str) -> None:
    files = [str(write_ply(tmp_path / f"{n}.ply", 1e3 * room(RNG, 2000))) for n in "ab"]
    if command == "targets":
        files = [files[0], "--sphere", "0.07"]
    told = RUN.invoke(app, [command, *files]).output.replace("\n", " ")
    # who stops at the first scan asks about no other
    assert told.count("are the coordinates metres?") == 1 + (command not in ("targets", "register"))
    told = RUN.invoke(app, [command, *files, "--unit", "mm"]).output
    assert "are the coordinates" not in told.replace("\n", " ")


@pytest.mark.parametrize("no_return", ["leave out", "keep"])
def test_projects_ask_too(tmp_path: Path, no_return: str) -> None:
    for name in "ab":
        write_ply(tmp_path / f"{name}.ply", 1e3 * room(RNG, 2000))
    told = RUN.invoke(app, ["init", str(tmp_path), "--yes"]).output.replace("\n", " ")
    assert told.count("are the coordinates metres?") == 2
    project = tmp_path / "project.toml"
    kept = f'[[scans]]\nno_return = "{no_return}"'
    project.write_text(project.read_text().replace("[[scans]]", kept))
    told = RUN.invoke(app, ["run", str(project), "-q"]).output.replace("\n", " ")
    assert told.count("are the coordinates metres?") == 2, told
