"""Baselines from RINEX: real receivers, a hardware simulator, and what cannot work.

Truth: the exact coordinates of the simulation, and those of the permanent station published with
the data of RTKLIB; the two engines check each other.
"""

import gzip
import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.gnss import engine as engine_module
from tribrach.gnss.antennas import AntennaSetup
from tribrach.gnss.baseline import Processing, compute_baseline
from tribrach.gnss.engine import engines, run_engine
from tribrach.instruments.gnss_solutions import sigma_factor

from .rinex_samples import navigation, rinex_2

RUN = CliRunner()
BASE_3040 = (-3978241.958, 3382840.234, 3649900.853)
ROVER_0759 = np.array([-3976219.1874, 3382371.6055, 3652511.1446])
SPIRENT_BASE = (4157177.06580187, 671230.476590636, 4774767.03105544)
SPIRENT_ROVER = np.array([4156857.1195929, 673209.028774142, 4774767.03105544])
needs_engine = pytest.mark.skipif(not engines(), reason="RTKLIB is not installed")


def geonet(folder: Path) -> tuple[Path, Path, list[Path]]:
    there = folder / "gnss" / "geonet_0759_3040"
    return there / "30400920.05o", there / "07590920.05o", [there / "30400920.05n"]


def spirent(folder: Path) -> tuple[Path, Path, list[Path]]:
    there = folder / "gnss" / "spirent_2km"
    orbits = sorted(there.glob("RINEX_*"))
    return there / "base.obs.gz", there / "rover_2km_east.obs.gz", orbits


@needs_engine
@pytest.mark.data
@pytest.mark.parametrize("engine", ["pyrtklib", "rnx2rtkp"])
def test_real_receivers(shared_data: Path, engine: str) -> None:
    if engine not in engines():
        pytest.skip(f"{engine} is not installed")
    found = compute_baseline(*geonet(shared_data), BASE_3040, Processing(engine=engine))  # type: ignore[arg-type]
    assert found.ambiguities == "fixed"
    assert found.fixed_share == 1
    assert found.epochs == 115
    error = found.rover - ROVER_0759
    assert np.abs(error).max() < 0.015
    assert error @ np.linalg.solve(found.covariance, error) < chi2.ppf(0.999, 3)
    assert 0.001 < np.sqrt(np.diag(found.covariance)).max() < 0.01


@needs_engine
@pytest.mark.data
def test_simulated_receivers(shared_data: Path) -> None:
    found = compute_baseline(*spirent(shared_data), SPIRENT_BASE, Processing(atmosphere=False))
    assert found.ambiguities == "fixed"
    assert found.fixed_share == 1
    # Galileo states an accuracy of 25 m and the message F/NAV, which the engine would not take
    assert set(found.systems) == {"G", "E"}
    # phases of the simulator agree within a millimetre
    assert found.residual is not None
    assert 0.0001 < found.residual < 0.003
    # epochs of these files promise satellites that they do not list
    assert found.epochs == found.epochs_common == 601
    assert any("counted anew" in text for text in found.warnings)
    error = found.rover - SPIRENT_ROVER
    assert np.abs(error).max() < 0.0005
    assert error @ np.linalg.solve(found.covariance, error) < chi2.ppf(0.95, 3)


@needs_engine
@pytest.mark.data
def test_hatanaka_files_give_the_same_baseline(shared_data: Path, tmp_path: Path) -> None:
    hatanaka = pytest.importorskip("hatanaka")
    base, rover, orbits = geonet(shared_data)
    packed = []
    for path in (base, rover):
        packed.append(tmp_path / f"{path.stem}.05d.gz")
        packed[-1].write_bytes(gzip.compress(hatanaka.rnx2crx(path.read_bytes())))
    one = compute_baseline(base, rover, orbits, BASE_3040)
    two = compute_baseline(*packed, orbits, BASE_3040)
    np.testing.assert_allclose(one.rover, two.rover, atol=1.1e-4)
    assert two.epochs == 115


@pytest.mark.data
def test_engines_agree(shared_data: Path) -> None:
    if len(engines()) < 2:
        pytest.skip("only one engine is installed")
    for files, base, air in (
        (geonet(shared_data), BASE_3040, True),
        (spirent(shared_data), SPIRENT_BASE, False),
    ):
        one, two = (
            compute_baseline(*files, base, Processing(engine=name, atmosphere=air))
            for name in engines()
        )
        np.testing.assert_allclose(one.rover, two.rover, atol=2e-4)
        np.testing.assert_allclose(np.diag(one.covariance), np.diag(two.covariance), rtol=0.1)
        assert one.epochs == two.epochs


@needs_engine
@pytest.mark.data
def test_antenna_heights_go_from_the_antennas_to_the_marks(shared_data: Path) -> None:
    files = geonet(shared_data)
    plain = compute_baseline(*files, BASE_3040)
    raised = compute_baseline(
        *files,
        BASE_3040,
        base_antenna=AntennaSetup(height=1.2),
        rover_antenna=AntennaSetup(height=1.5),
    )
    up = ROVER_0759 / np.linalg.norm(ROVER_0759)
    moved = (raised.rover - plain.rover) @ up
    # a rover mark 1.5 m under its antenna, seen from a base whose antenna is 1.2 m up
    assert moved == pytest.approx(-0.3, abs=2e-3)


def minutes(source: Path, target: Path, first: int, last: int) -> Path:
    """The epochs of some minutes of an hour, without the remarks between them."""
    text = source.read_text()
    start = text.index("\n", text.index("END OF HEADER")) + 1
    records = re.split(r"(?m)^(?= 05  4  2 |  {26}4  1)", text[start:])
    kept = [r for r in records if r[:9] == " 05  4  2" and first <= int(r[13:15]) < last]
    target.write_text(text[:start] + "".join(kept))
    return target


@needs_engine
@pytest.mark.data
def test_scatter_of_short_sessions_is_as_stated(shared_data: Path, tmp_path: Path) -> None:
    """Five sessions of ten minutes: formal sigmas are too small, the scaled ones are not."""
    base, rover, orbits = geonet(shared_data)
    scaled, formal = 0.0, 0.0
    for k in range(0, 50, 10):
        files = [minutes(p, tmp_path / p.name, k, k + 10) for p in (base, rover)]
        found = compute_baseline(*files, orbits, BASE_3040)
        # a clock that is 3 ms late puts an epoch into the minute before
        assert found.epochs == found.epochs_common >= 19
        error = found.rover - ROVER_0759
        scaled += error @ np.linalg.solve(found.covariance, error)
        formal += error @ np.linalg.solve(found.formal, error)
    assert scaled < chi2.ppf(0.95, 15)
    assert formal > chi2.ppf(0.95, 15)


@needs_engine
@pytest.mark.data
def test_only_common_epochs_are_combined(shared_data: Path, tmp_path: Path) -> None:
    """A base that measures half as often gives half as many epochs, and the interval says so."""
    base, rover, orbits = geonet(shared_data)
    text = base.read_text()
    start = text.index("\n", text.index("END OF HEADER")) + 1
    records = re.split(r"(?m)^(?= 05  4  2 |  {26}4  1)", text[start:])
    epochs = [r for r in records if r[:9] == " 05  4  2"]
    thin = tmp_path / "thin.05o"
    thin.write_text(text[:start] + "".join(epochs[::2]))
    found = compute_baseline(thin, rover, orbits, BASE_3040)
    assert found.epochs_common == 60
    assert 50 <= found.epochs <= 60
    assert found.interval == 60
    assert found.ambiguities == "fixed"
    np.testing.assert_allclose(found.rover, ROVER_0759, atol=0.015)


ANTEX = """\
     1.4            M                                       ANTEX VERSION / SYST
A                                                           PCV TYPE / REFANT
                                                            END OF HEADER
"""


def antenna_of_antex(name: str, up: float) -> str:
    """An antenna whose phase centres are ``up`` [mm] over its reference point, on L1 and L2."""
    lines = [
        (name, "TYPE / SERIAL NO"),
        ("     0.0", "DAZI"),
        ("     0.0  90.0  90.0", "ZEN1 / ZEN2 / DZEN"),
    ]
    for k in (1, 2):
        lines += [
            (f"   G{k:02d}", "START OF FREQUENCY"),
            (f"{0.0:10.2f}{0.0:10.2f}{up:10.2f}", "NORTH / EAST / UP"),
        ]
        noazi = "   NOAZI" + f"{0.0:8.2f}" * 2
        lines += [(noazi, ""), (f"   G{k:02d}", "END OF FREQUENCY")]
    body = "".join(f"{text:60s}{label}\n" for text, label in lines)
    return f"{'':60s}START OF ANTENNA\n{body}{'':60s}END OF ANTENNA\n"


@needs_engine
@pytest.mark.data
def test_phase_centres_of_an_antex_file(shared_data: Path, tmp_path: Path) -> None:
    files = geonet(shared_data)
    plain = compute_baseline(*files, BASE_3040)
    antex = tmp_path / "igs #1.atx"
    antex.write_text(
        ANTEX
        + antenna_of_antex("TRM29659.00     NONE", 0.0)
        + antenna_of_antex("HIGHANTENNA     NONE", 100.0)
    )
    wish = Processing(antex=antex)
    high = AntennaSetup("HIGHANTENNA     NONE")
    found = compute_baseline(*files, BASE_3040, wish, rover_antenna=high)
    up = ROVER_0759 / np.linalg.norm(ROVER_0759)
    assert (found.rover - plain.rover) @ up == pytest.approx(-0.1, abs=2e-3)
    assert not found.warnings
    other = AntennaSetup("OTHERANTENNA")
    with pytest.raises(InputError, match="OTHERANTENNA is not in the ANTEX file"):
        compute_baseline(*files, BASE_3040, wish, rover_antenna=other)
    different = compute_baseline(*files, BASE_3040, rover_antenna=other)
    assert "phase centres may differ" in different.warnings[0]


@needs_engine
@pytest.mark.data
def test_command_and_its_json(shared_data: Path, tmp_path: Path) -> None:
    base, rover, orbits = geonet(shared_data)
    out = tmp_path / "b.json"
    where = ",".join(map(str, BASE_3040))
    call = ["baseline", str(base), str(rover), str(orbits[0]), "--base-xyz", where]
    result = RUN.invoke(app, [*call, "--json", str(out)])
    assert result.exit_code == 0, result.output
    assert "fixed ambiguities" in result.output
    data = json.loads(out.read_text())
    np.testing.assert_allclose(data["rover_ecef"], ROVER_0759, atol=0.015)
    difference = np.subtract(data["rover_ecef"], BASE_3040)
    np.testing.assert_allclose(data["baseline"], difference, atol=1e-9)
    assert np.linalg.eigvalsh(data["covariance"]).min() > 0
    assert data["fixed_share"] == 1
    assert data["epochs"] == 115
    given = RUN.invoke(app, [*call, "--json", str(out), "--sigma-factor", "2", "--quiet"])
    assert given.exit_code == 0
    ratio = np.divide(json.loads(out.read_text())["covariance"], data["covariance_formal"])
    np.testing.assert_allclose(ratio, 4)


@needs_engine
@pytest.mark.data
def test_exchanged_receivers_are_noticed(shared_data: Path) -> None:
    base, rover, orbits = geonet(shared_data)
    with pytest.raises(InputError, match="are they right, or are base and rover exchanged"):
        compute_baseline(rover, base, orbits, BASE_3040)
    high = np.array(BASE_3040) * (1 + 200 / 6.37e6)
    found = compute_baseline(base, rover, orbits, high)
    assert "19" in found.warnings[0] or "20" in found.warnings[0]
    assert "m from the position in the header" in found.warnings[0]
    assert not compute_baseline(base, rover, orbits, BASE_3040).warnings


@needs_engine
@pytest.mark.data
def test_float_solutions_say_so(shared_data: Path) -> None:
    # a threshold that no ratio reaches
    found = compute_baseline(*geonet(shared_data), BASE_3040, Processing(ratio=1e6))
    assert found.ambiguities == "float"
    assert found.fixed_share == 0
    assert any("float" in text for text in found.warnings)


def wrong(folder: Path) -> dict[str, tuple[list[str], str]]:
    """Calls that cannot work, with words of the sentence each must end in."""

    def file(name: str, data: str | bytes) -> str:
        (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)
        return str(folder / name)

    good, nav = file("good.obs", rinex_2()), file("good.nav", navigation())
    other_day = rinex_2().replace(" 05  4  2", " 05  4  3")
    others = rinex_2(satellites=("G11", "G12", "G13", "G14"))
    packed = gzip.compress(rinex_2().encode())
    rover = file("rover.obs", rinex_2().replace("20000000.123", "20000321.987"))
    return {
        "empty": ([good, file("empty.obs", ""), nav], "empty"),
        "truncated": ([good, file("short.obs", rinex_2()[:-30]), nav], "ends within the epoch"),
        "truncated gzip": ([good, file("short.gz", packed[:-9]), nav], "end too soon"),
        "corrupt": ([good, file("bad.obs", rinex_2().replace("98765", "9?765")), nav], "damaged"),
        "wrong day": ([good, file("day.obs", other_day), nav], "no time in common"),
        "no common satellite": ([good, file("sats.obs", others), nav], "no satellite in common"),
        "orbits of another day": ([good, good, file("day.nav", navigation(day=20))], "orbits"),
        "no orbits": ([good, good, good], "not navigation data"),
        "nothing to compute": ([good, rover, nav], "no baseline from"),
        "no file": ([good, str(folder / "none.obs"), nav], "cannot be read"),
    }


@needs_engine
def test_what_cannot_work_ends_in_a_sentence(tmp_path: Path) -> None:
    for case, (files, words) in wrong(tmp_path).items():
        out = tmp_path / "b.json"
        call = ["baseline", *files, "--base-xyz", "4157177.1,671230.5,4774767.0"]
        result = RUN.invoke(app, [*call, "--json", str(out)])
        assert result.exit_code == 2, (case, result.output)
        assert words in result.output.replace("\n", " "), (case, result.output)
        assert "Traceback" not in result.output
        assert not out.exists()


@pytest.mark.parametrize("where", ["1,2", "a,b,c", "1,2,3"])
def test_base_coordinates_that_are_none(tmp_path: Path, where: str) -> None:
    files = wrong(tmp_path)["nothing to compute"][0]
    result = RUN.invoke(app, ["baseline", *files, "--base-xyz", where])
    assert result.exit_code == 2
    assert "metres" in result.output


def test_an_engine_that_is_missing_slow_or_crashes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "rnx2rtkp"
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    with pytest.raises(InputError, match="not installed"):
        run_engine({}, [], tmp_path, engine="rnx2rtkp")
    for script, words in (
        ("sleep 60", "was not ready after 1 s"),
        ("kill -SEGV $$", "crashed"),
        ("exit 7", "status 7"),
    ):
        program.write_text(f"#!/bin/sh\n{script}\n")
        program.chmod(0o755)
        with pytest.raises(InputError, match=words):
            run_engine({}, [], tmp_path, engine="rnx2rtkp", seconds=1)
    monkeypatch.setattr(engine_module, "engines", tuple)
    with pytest.raises(InputError, match="need RTKLIB"):
        run_engine({}, [], tmp_path)


def test_factor_of_sigmas_is_that_of_correlated_epochs() -> None:
    """Against the sum over the covariance matrix of the epochs."""
    for interval, n in ((1.0, 50), (30.0, 120), (300.0, 24), (1.0, 1200)):
        lag = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) * interval
        direct = np.sqrt(np.exp(-lag / 300).sum() / n)
        assert sigma_factor(interval, n) == pytest.approx(direct, rel=1e-9)
    assert sigma_factor(0.0, 1) == 1
