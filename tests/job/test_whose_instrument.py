"""Whose instrument: one rule for scans, stations and observations, and its contradictions."""

from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.job.opened import open_job
from tribrach.job.scans import open_scans
from tribrach.job.state import Remembered

HEAD = """[instruments.A]
range_mm = 1
scan_angle_arcsec = 10
[instruments.B]
range_mm = 5
scan_angle_arcsec = 50
levelling_arcsec = 3
"""


def written(folder: Path, text: str, *, head: str = HEAD) -> Path:
    """A project with a scan of a few points and a table of scanned targets."""
    rows = [f"{x} {y} 0.5" for x, y in np.random.default_rng(1).uniform(2, 5, (50, 2))]
    (folder / "S1.xyz").write_text("\n".join(rows) + "\n")
    (folder / "targets.csv").write_text(
        "station,target,range_m,horizontal_deg,zenith_deg\n"
        "S1,P,10,20,90\nS1,Q,12,110,80\nS1,R,9,200,95\n"
    )
    path = folder / "p.toml"
    path.write_text(head + text)
    return path


def lines(text: str, *words: str) -> list[int]:
    """1-based lines of a project on which these words stand for the first time."""
    whole = (HEAD + text).splitlines()
    return [next(k for k, line in enumerate(whole, 1) if word in line) for word in words]


SCAN = """[[scans]]
file = "S1.xyz"
station = "S1"
origin = "scanner"
instrument = "A"
"""
UNNAMED = SCAN.replace('station = "S1"\n', "")
STATION = """[stations.S1]
instrument = "B"
"""
READINGS = """[[observations]]
file = "targets.csv"
instrument = "A"
"""


@pytest.mark.parametrize(
    ("entry", "section"), [(SCAN, "[[scans]]"), (READINGS, "[[observations]]")]
)
def test_two_instruments_at_one_station_are_refused(
    tmp_path: Path, entry: str, section: str
) -> None:
    text = entry + STATION
    first, second = lines(text, 'instrument = "B"', 'instrument = "A"')
    with pytest.raises(InputError) as error:
        open_job(written(tmp_path, text))
    assert error.value.what == (
        f"station S1 has two instruments: [stations.S1], line {first}, names B and {section}, "
        f"line {second}, names A"
    )
    assert (error.value.line, error.value.file) == (first, tmp_path / "p.toml")


def test_a_scan_whose_file_names_its_station(tmp_path: Path) -> None:
    """The name of the station is known only when the scan is opened."""
    job = open_job(written(tmp_path, UNNAMED + STATION))
    with pytest.raises(InputError, match="station S1 has two instruments"):
        open_scans(job, Remembered(tmp_path))


@pytest.mark.parametrize(
    ("text", "instrument"),
    [
        (SCAN, "A"),
        (UNNAMED, "A"),
        (SCAN.replace('instrument = "A"\n', "") + STATION, "B"),
        (SCAN.replace('instrument = "A"\n', ""), None),
    ],
)
def test_the_noise_of_a_scan_is_that_of_its_station(
    tmp_path: Path, text: str, instrument: str | None
) -> None:
    job = open_job(written(tmp_path, text))
    (scan,) = open_scans(job, Remembered(tmp_path))
    assert job.instruments.of_station("S1") == instrument
    assert scan.noise == (None if instrument is None else noise(job.project, instrument))


def noise(project, name: str) -> ScanNoise | None:  # type: ignore[no-untyped-def]
    found: ScanNoise | None = project.instruments[name].noise()
    return found


def test_readings_have_the_sigmas_of_their_station(tmp_path: Path) -> None:
    """A table that names no instrument takes that of the station that it was read from."""
    bare = READINGS.replace('instrument = "A"\n', "")
    job = open_job(written(tmp_path, bare + STATION))
    (table,) = [t for t in job.survey.tables() if t.kind.kind == "scanner_polar"]
    sigma = np.sqrt(np.asarray(table.columns["covariance"])[:, 0, 0])
    np.testing.assert_allclose(sigma, 0.005)


def test_a_scanner_beside_a_total_station_needs_no_name(tmp_path: Path) -> None:
    head = "[instruments.TS]\ndirection_arcsec = 1\n[instruments.B]" + HEAD.partition("s.B]")[2]
    job = open_job(written(tmp_path, SCAN.replace('instrument = "A"\n', ""), head=head))
    assert job.instruments.of_station("S1") == "B"
    (scan,) = open_scans(job, Remembered(tmp_path))
    assert scan.noise == job.project.instruments["B"].noise()


def test_an_instrument_that_is_not_defined(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="instrument C is not defined") as error:
        open_job(written(tmp_path, SCAN.replace('"A"', '"C"')))
    assert error.value.line == lines(SCAN, "instrument = ")[0]
