"""Systems that take part: Galileo records that RTKLIB would leave out, and reasons of idle ones."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tribrach.gnss.baseline import Processing, compute_baseline
from tribrach.gnss.dry_air import delay_differences, displacement
from tribrach.gnss.fixed_phases import sight_lines
from tribrach.gnss.orbits import idle_systems
from tribrach.io.gnss.navigation_file import read_navigation
from tribrach.io.gnss.observation_file import read_observations
from tribrach.io.gnss.orbit_files import galileo_records
from tribrach.io.gnss.solution_file import PhaseResiduals

from .rinex_samples import navigation, rinex_2
from .test_baseline import SPIRENT_BASE, SPIRENT_ROVER, needs_engine, spirent


def record(name: str, source: float, sisa: float, week: float = 2244.0) -> str:
    """A Galileo record whose other numbers are those of their places."""
    numbers = [[float(4 * k + j) for j in range(4)] for k in range(7)]
    numbers[4][1:3] = [source, week]
    numbers[5][0] = sisa
    lines = [f"{name} 2023 01 08 10 00 00" + "".join(f"{v:19.12E}" for v in (1e-4, 1e-11, 0.0))]
    lines += ["    " + "".join(f"{v:19.12E}" for v in row) for row in numbers[:6]]
    lines.append("    " + f"{numbers[6][0]:19.12E}")
    return "\n".join(lines).replace("E+", "D+").replace("E-", "D-") + "\n"


HEAD = (
    "     3.04           N: NAVIGATION DATA  E: GALILEO          RINEX VERSION / TYPE\n"
    f"{'':60s}END OF HEADER\n"
)


def values(text: bytes, k: int) -> tuple[int, float]:
    """Data sources and accuracy of the k-th record."""
    lines = text.decode().split("\n")[2 + 8 * k :]
    source, accuracy = lines[5][23:42], lines[6][4:23]
    return int(float(source.replace("D", "E"))), float(accuracy.replace("D", "E"))


def test_records_that_the_engine_would_leave_out(tmp_path: Path) -> None:
    text = HEAD + "".join(
        [
            record("E01", 263, 25.0),  # F/NAV clocks, coarse
            record("E02", 517, 3.12),  # I/NAV: stays as it is
            record("E03", 258, 3.12),  # F/NAV beside I/NAV of the same satellite: stays
            record("E03", 517, 3.12),
            record("E04", 0, -1.0),  # no source; no accuracy predicted: that is kept
        ]
    )
    found = galileo_records(text.encode())
    assert found.coarse == ("E01",)
    assert found.accuracy == 25
    assert [values(found.text, k) for k in range(5)] == [
        (519, 6.0), (517, 3.12), (258, 3.12), (517, 3.12), (512, -1.0),
    ]  # fmt: skip
    # all else is as it was
    assert len(found.text) == len(text)
    before, after = text.split("\n"), found.text.decode().split("\n")
    changed = [k for k, (a, b) in enumerate(zip(before, after, strict=True)) if a != b]
    assert changed == [2 + 5, 2 + 6, 2 + 32 + 5]
    path = tmp_path / "e.rnx"
    path.write_bytes(found.text)
    assert set(read_navigation(path).satellites) == {"E01", "E02", "E03", "E04"}


def test_other_navigation_files_stay_as_they_are() -> None:
    text = navigation().encode()
    assert galileo_records(text).text == text
    crlf = HEAD.replace("\n", "\r\n").encode()
    assert galileo_records(crlf).text == crlf


@needs_engine
@pytest.mark.data
def test_galileo_of_a_simulator_that_states_25_m(shared_data: Path) -> None:
    base, rover, orbits = spirent(shared_data)
    wish = Processing(systems="E", atmosphere=False, pieces=False)
    found = compute_baseline(base, rover, orbits, SPIRENT_BASE, wish)
    assert found.systems == "E"
    assert found.ambiguities == "fixed"
    assert np.abs(found.rover - SPIRENT_ROVER).max() < 0.0005
    assert any("state an accuracy of 25 m" in w and "by 2.5 mm" in w for w in found.warnings)
    assert found.idle == ("GPS (G): not among the systems asked for (E)",)
    # without the navigation file of Galileo
    gps = [path for path in orbits if path.suffix == ".23N"]
    alone = compute_baseline(base, rover, gps, SPIRENT_BASE, replace(wish, systems="GE"))
    (text,) = alone.idle
    assert text.startswith("Galileo (E): no navigation message for E03, E05, E09")


def test_reasons_of_systems_without_part(tmp_path: Path) -> None:
    files = []
    for k, satellites in enumerate(
        (
            ("G11", "G12", "G13", "G14", "R01", "R02", "E05", "S20", "C06"),
            ("G11", "G12", "G13", "G14", "R01", "R02", "E07", "C06"),
        )
    ):
        path = tmp_path / f"{k}.obs"
        path.write_text(rinex_2(satellites=satellites))
        files.append(read_observations(path))
    path = tmp_path / "a.nav"
    path.write_text(navigation(satellites=14))
    orbits = [read_navigation(path)]
    used = ["G11", "G12", "G13", "G14"]
    found = idle_systems(*files, orbits, "GECS", used)
    assert found == [
        "GLONASS (R): not among the systems asked for (GECS)",
        "Galileo (E): the receivers have no satellite of it in common",
        "BeiDou (C): no navigation message for C06 at the time of the session",
        "SBAS (S): only in 0.obs",
    ]
    gps = [replace(file, satellites=frozenset(used)) for file in files]
    (text,) = idle_systems(*gps, orbits, "G", [])
    assert "the engine used none" in text


def test_air_that_is_taken_out_of_a_baseline() -> None:
    """Delays of a known displacement give it back, whatever is common to all of them."""
    base = np.array(SPIRENT_BASE)
    rover = np.array(SPIRENT_ROVER)
    rng = np.random.default_rng(31)
    n = 60
    azimuth, elevation = rng.uniform(0, 2 * np.pi, n), rng.uniform(0.3, 1.4, n)
    phases = PhaseResiduals(
        np.repeat(1e9 + np.arange(6.0), 10),
        np.array([f"G{k % 10 + 1:02d}" for k in range(n)]),
        np.ones(n, dtype=np.int64),
        azimuth,
        elevation,
        np.zeros(n),
    )
    delay = delay_differences(phases, base, rover)
    # the derivative of 2.3 m/sin e by the angle that the zenith turns over 2 km
    turn = 2004.25 / 6.38e6
    assert np.abs(delay).max() < 2.3 * turn * 1.5 / np.sin(elevation.min()) ** 2
    # the same delays with both receivers at one place cancel
    assert np.abs(delay_differences(phases, rover, rover)).max() < 1e-12
    away = displacement(phases, delay, rover)
    # a common part of all delays is a clock
    np.testing.assert_allclose(displacement(phases, delay + 7.0, rover), away, atol=1e-12)
    # delays that are exactly those of a displacement give it back, with the sign of a cure
    given = np.array([0.001, -0.002, 0.003])
    made = -sight_lines(phases, rover) @ given + 0.5
    np.testing.assert_allclose(displacement(phases, made, rover), given, atol=1e-12)
