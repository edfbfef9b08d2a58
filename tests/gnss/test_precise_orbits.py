"""Precise orbits: SP3 files of every version, what the engine makes of them, what cannot work.

Truth: satellite positions by IS-GPS-200, computed for the tests; the baseline by broadcast orbits.
"""

import gzip
import json
import re
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.gnss.baseline import Processing, compute_baseline, doubts_of_length
from tribrach.gnss.engine import engines
from tribrach.gnss.orbits import check_precise
from tribrach.io.gnss.observation_file import read_observations
from tribrach.io.gnss.orbit_files import read_orbits
from tribrach.io.gnss.precise_file import joined, read_sp3, sp3_text

from .rinex_samples import navigation, rinex_2
from .sp3_samples import KEYS, broadcast, position, sp3
from .test_baseline import ANTEX, BASE_3040, ROVER_0759, antenna_of_antex, geonet, needs_engine

#: elements of an orbit such as those of GPS, the same for all but their node and anomaly
ORBIT = dict.fromkeys(KEYS, 0.0) | {
    "roota": 5153.6, "e": 0.01, "i0": 0.96, "toe": 518400.0, "af0": 1.5e-5, "af1": 2e-12,
}  # fmt: skip
SKY = {f"G{k:02d}": [ORBIT | {"node": 0.9 * k, "m0": 1.7 * k}] for k in range(1, 9)}
START = datetime(2005, 4, 1, 22, 0)


def read(folder: Path, text: str, name: str = "a.sp3"):  # type: ignore[no-untyped-def]
    (folder / name).write_text(text)
    return read_sp3(folder / name, text.encode())


@pytest.mark.parametrize("version", ["a", "c"])
def test_positions_and_clocks_are_read(tmp_path: Path, version: str) -> None:
    found = read(tmp_path, sp3(SKY, START, 12, 900.0, version=version))
    assert found.satellites == tuple(SKY)
    assert np.diff(found.times) == pytest.approx(900.0)
    assert found.times[0] == (START - datetime(1980, 1, 6)).total_seconds()
    for k, name in enumerate(SKY):
        xyz, clock = position(SKY[name][0], float(found.times[5] % 604800))
        assert found.xyz[5, k] == pytest.approx(xyz, abs=6e-4)
        assert found.clocks[5, k] == pytest.approx(clock, abs=6e-13)


def test_more_than_the_engine_can_read(tmp_path: Path) -> None:
    """SP3-d with 88 satellites, velocities, correlations, remarks: written again as SP3-c."""
    found = read(tmp_path, sp3(SKY, START, 12, 900.0, version="d", further=80))
    assert len(found.satellites) == 88
    text = sp3_text(found, SKY)
    lines = text.decode().splitlines()
    assert next(k for k, line in enumerate(lines) if line.startswith("*")) == 22
    assert lines[2][3:6] == "  8"
    assert lines[12][9:12] == "GPS"
    assert max(len(line) for line in lines) <= 60
    again = read(tmp_path, text.decode(), "b.sp3")
    assert again.satellites == tuple(SKY)
    chosen = [found.satellites.index(name) for name in SKY]
    assert np.array_equal(again.xyz, found.xyz[:, chosen])
    assert again.clocks == pytest.approx(found.clocks[:, chosen], abs=1e-15)


def test_days_are_put_together(tmp_path: Path) -> None:
    whole = read(tmp_path, sp3(SKY, START, 20, 900.0))
    first = read(tmp_path, sp3(SKY, START, 12, 900.0))
    second = read(tmp_path, sp3(SKY, datetime(2005, 4, 2, 0, 45), 9, 900.0))
    both = joined([second, first])
    assert np.array_equal(both.times, whole.times)
    assert np.array_equal(both.xyz, whole.xyz)


def test_missing_satellites_and_clocks_are_missing(tmp_path: Path) -> None:
    text = sp3(SKY, START, 12, 900.0)
    line = next(row for row in text.splitlines() if row.startswith("PG03"))
    nothing = f"PG03{0.0:14.6f}{0.0:14.6f}{0.0:14.6f}{999999.999999:14.6f}"
    found = read(tmp_path, text.replace(line, nothing, 1))
    assert np.isnan(found.xyz[0, 2]).all()
    assert np.isnan(found.clocks[0, 2])
    assert np.isfinite(found.xyz).sum() == 3 * (12 * 8 - 1)
    assert b"PG03      0.000000      0.000000      0.000000 999999.999999" in sp3_text(found, SKY)


def test_times_of_other_systems(tmp_path: Path) -> None:
    here = read(tmp_path, sp3(SKY, START, 12, 900.0))
    there = read(tmp_path, sp3(SKY, START, 12, 900.0, system="BDT"))
    assert there.times - here.times == pytest.approx(14.0)
    with pytest.raises(InputError, match="are in UTC, which is not read"):
        read(tmp_path, sp3(SKY, START, 12, 900.0, system="UTC"))


BROKEN = {
    "cut": (lambda t: t[: len(t) // 2 - 20], "SP3 file"),
    "without its end": (lambda t: t.replace("EOF", ""), "ends before its last line"),
    "no epochs": (lambda t: t[: t.index("*  ")], "no epochs"),
    "no number": (lambda t: re.sub(r"(PG02 {2,}-?\d+)\.", r"\1x", t, count=1), r"sp3:25: .*no num"),
    "a strange line": (lambda t: t.replace("PG04", "Q?04", 1), r"sp3:27: .*damaged"),
    "no such day": (lambda t: t.replace("*  2005  4  1", "*  2005  4 31", 1), "does not exist"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_files_are_refused(tmp_path: Path, case: str) -> None:
    breaking, words = BROKEN[case]
    with pytest.raises(InputError, match=words):
        read(tmp_path, breaking(sp3(SKY, START, 12, 900.0)))


def test_files_that_do_not_go_together(tmp_path: Path) -> None:
    nav, obs = tmp_path / "a.nav", tmp_path / "a.obs"
    nav.write_text(navigation())
    obs.write_text(rinex_2())
    file = read_observations(obs)
    day = tmp_path / "a.sp3.gz"
    day.write_bytes(gzip.compress(sp3(SKY, START, 20, 900.0).encode()))
    orbits = read_orbits([day, nav])
    assert len(orbits.broadcast) == 1
    assert orbits.names == ("a.sp3.gz",)
    assert orbits.precise is not None
    check_precise(orbits.precise, file, file)
    clocks = tmp_path / "a.clk"
    clocks.write_text("     3.00           CLOCK DATA".ljust(60) + "RINEX VERSION / TYPE\n")
    with pytest.raises(InputError, match=r"a\.clk: .*satellite clocks, which cancel"):
        read_orbits([nav, day, clocks])
    with pytest.raises(InputError, match="precise orbits alone do not suffice"):
        read_orbits([day])

    def refused(text: str, words: str) -> None:
        with pytest.raises(InputError, match=words):
            check_precise(read(tmp_path, text), file, file)

    refused(sp3(SKY, START, 10, 900.0), "10 epochs of precise orbits are too few")
    refused(sp3(SKY, START, 20, 1800.0), "30 minutes apart")
    later = datetime(2005, 4, 2, 0, 0, 30)
    refused(sp3(SKY, later, 20, 900.0), r"\(2005-04-02 00:00:30 to .* do not cover the session")
    few = {name: SKY[name] for name in ("G01", "G02", "G08")}
    refused(sp3(few, START, 20, 900.0), "have 2 of the satellites that both receivers observed")


def test_long_baselines_say_what_is_left_out() -> None:
    assert not doubts_of_length("A to B", 15e3, precise=False, satellites=False)
    said = [
        doubts_of_length("A to B", 50e3, precise=precise, satellites=satellites)[0]
        for precise, satellites in ((False, False), (True, False), (True, True))
    ]
    assert "over 50 km errors of broadcast orbits, ionosphere and troposphere" in said[0]
    assert "phase centres of satellites" in said[1]
    assert "errors of ionosphere and troposphere add up" in said[2]


@pytest.fixture(scope="module")
def session(shared_data: Path) -> tuple[Path, Path, list[Path]]:
    return geonet(shared_data)


@needs_engine
@pytest.mark.data
@pytest.mark.parametrize(
    "keys",
    [
        {"first": datetime(2005, 4, 1, 23, 15)},
        {"first": datetime(2005, 4, 1, 22, 30), "epochs": 17, "step": 900.0, "version": "a"},
        {"first": datetime(2005, 4, 1, 23, 15), "version": "d", "further": 80},
    ],
)
def test_the_baseline_is_that_of_the_same_orbits(
    session: tuple[Path, Path, list[Path]], tmp_path: Path, keys: dict[str, object]
) -> None:
    base, rover, orbits = session
    path = tmp_path / "day #1.sp3"
    path.write_text(sp3(broadcast(orbits[0]), **keys))  # type: ignore[arg-type]
    plain = compute_baseline(base, rover, orbits, BASE_3040)
    assert plain.orbits == ()
    for engine in engines():
        wish = Processing(engine=engine)
        found = compute_baseline(base, rover, [path, *orbits], BASE_3040, wish)
        # broadcast orbits change their elements within the hour, this file does not
        np.testing.assert_allclose(found.rover, plain.rover, atol=1e-3)
        np.testing.assert_allclose(found.rover, ROVER_0759, atol=0.015)
        assert found.fixed_share == 1
        assert found.epochs == 115
        assert found.orbits == ("day #1.sp3",)


@needs_engine
@pytest.mark.data
def test_the_orbits_of_the_file_are_used(
    session: tuple[Path, Path, list[Path]], tmp_path: Path
) -> None:
    """Orbits turned about the Earth's axis by 1e-5 turn the baseline of 3 km by centimetres."""
    base, rover, orbits = session
    path = tmp_path / "a.sp3"
    sky, start = broadcast(orbits[0]), datetime(2005, 4, 1, 23, 15)
    plain = compute_baseline(base, rover, orbits, BASE_3040)
    path.write_text(sp3(sky, start, turned=1e-5))
    turned = compute_baseline(base, rover, [*orbits, path], BASE_3040)
    expected = 1e-5 * np.cross([0, 0, 1], plain.vector)
    assert turned.vector - plain.vector == pytest.approx(expected, abs=0.012)
    assert np.linalg.norm(turned.vector - plain.vector) > 0.015
    # orbits 100 m too far out, and phase centres of satellites that take it back
    path.write_text(sp3(sky, start, moved=100.0))
    out = compute_baseline(base, rover, [*orbits, path], BASE_3040)
    away = np.linalg.norm(out.vector - plain.vector)
    assert away > 0.002
    antex = tmp_path / "sky.atx"
    receiver = antenna_of_antex("TRM29659.00     NONE", 0.0)
    satellites = [
        antenna_of_antex(f"BLOCK IIA           {name}", 100_000.0) for name in sorted(sky)
    ]
    antex.write_text(ANTEX + receiver + "".join(satellites))
    back = compute_baseline(base, rover, [*orbits, path], BASE_3040, Processing(antex=antex))
    assert np.linalg.norm(back.vector - plain.vector) < 0.2 * away


@needs_engine
@pytest.mark.data
def test_precise_orbits_in_a_project(
    session: tuple[Path, Path, list[Path]], tmp_path: Path
) -> None:
    base, rover, orbits = session
    path = tmp_path / "igs.sp3"
    path.write_text(sp3(broadcast(orbits[0]), datetime(2005, 4, 1, 23, 15)))
    (tmp_path / "control.csv").write_text(
        "point,ecef_x_m,ecef_y_m,ecef_z_m,role\n3040,-3978241.958,3382840.234,3649900.853,fixed\n"
    )
    (tmp_path / "p.toml").write_text(
        f'[site]\nframe = "ITRF2000"\nepoch = 2005.25\n[[points]]\nfile = "control.csv"\n'
        f'[gnss]\nnavigation = ["{orbits[0]}"]\n[[gnss.sessions]]\nnavigation = ["igs.sp3"]\n'
        f'receivers = [{{ point = "3040", file = "{base}" }}, '
        f'{{ point = "0759", file = "{rover}" }}]\n'
    )
    result = CliRunner().invoke(app, ["run", str(tmp_path / "p.toml")])
    # one baseline has no redundancy, and the command says so
    assert result.exit_code == 2, result.output
    data = json.loads((tmp_path / "out" / "result.json").read_text())
    (baseline,) = data["gnss"]["baselines"]
    assert baseline["precise_orbits"] == ["igs.sp3"]
    np.testing.assert_allclose(baseline["rover_ecef"], ROVER_0759, atol=0.015)
    text = " ".join((tmp_path / "out" / "report.txt").read_text().split())
    assert "Orbits of 1 are precise ones (igs.sp3)." in text
    where = ",".join(map(str, BASE_3040))
    call = ["baseline", str(base), str(rover), str(orbits[0]), str(path), "--base-xyz", where]
    result = CliRunner().invoke(app, call)
    assert result.exit_code == 0, result.output
    assert "orbits: precise ones of igs.sp3" in result.output
