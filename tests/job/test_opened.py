"""Opening a project reads every survey file once, and a run opens none of them again."""

import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.demo_twin import few_boards
from tests.io.survey.test_totalstation import POINTS, TRUTH, gsi
from tests.job.lit_rooms import project
from tribrach import pipeline
from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.gnss.engine import engines
from tribrach.io.calibration_file import Calibration, calibration_text
from tribrach.io.lever_arm_file import LeverArmResult, lever_arm_text
from tribrach.io.twins import write_twin
from tribrach.job.opened import open_job
from tribrach.project import Project

#: names of the files that were opened, while somebody listens
OPENED: list[str] = []
LISTENING: list[bool] = []


def _listen(event: str, arguments: tuple[object, ...]) -> None:
    """Note what any part of Python opens; an audit hook stays until the end."""
    if event == "open" and LISTENING and isinstance(arguments[0], str):
        OPENED.append(arguments[0])


@pytest.fixture(scope="module", autouse=True)
def _hook() -> None:
    sys.addaudithook(_listen)


@contextmanager
def opened(folder: Path) -> Iterator[Counter[str]]:
    """How often each file of a folder is opened within the block, by its name in the folder."""
    count: Counter[str] = Counter()
    OPENED.clear()
    LISTENING.append(True)
    try:
        yield count
    finally:
        LISTENING.pop()
    paths = (Path(name) for name in OPENED)
    count.update(str(p.relative_to(folder)) for p in paths if p.is_relative_to(folder))


def run(path: Path) -> Counter[str]:
    """Files of a project that a run opens, without those that it writes."""
    with opened(path.parent) as count:
        result = CliRunner().invoke(app, ["run", str(path), "-q"])
    assert result.exit_code in (0, 2), result.output
    return Counter({name: n for name, n in count.items() if not name.startswith("out")})


def test_a_run_with_targets_and_planes_opens_each_survey_file_once(tmp_path: Path) -> None:
    path = write_twin(few_boards("hanoi-facade", 20_000, 1), tmp_path / "demo")
    text = path.read_text()
    assert "[registration]" not in text
    path.write_text(text + '\n[registration]\nby = ["targets", "planes"]\n')
    count = run(path)
    # the truth is no survey: it is checked before scans are read, and used at the end
    assert {n for name, n in count.items() if name.startswith("truth")} <= {1, 2}
    assert "truth/truth.json" in count
    others = ("scans", "truth")
    survey = {name: n for name, n in count.items() if not name.startswith(others)}
    written = {p.name for p in path.parent.glob("*.csv")}
    assert path.name in survey
    assert written <= survey.keys() | {"sites.csv"}
    assert set(survey.values()) == {1}, survey


MIXED = """title = "Mixed"
[site]
latitude_deg = 52.5
longitude_deg = 13.4
deflection = { xi_arcsec = 4.0, eta_arcsec = -3.0 }
[instruments.TS]
direction_arcsec = 3
zenith_arcsec = 3
distance_mm = 1
distance_ppm = 1
levelling_mm_per_sqrt_km = 1.0
[instruments.scanner]
range_mm = 2
scan_angle_arcsec = 15
calibration = "scanner.toml"
[[points]]
file = "points.csv"
[[points]]
file = "more.csv"
role = "approximate"
[[observations]]
file = "monday/field.gsi"
instrument = "TS"
[[observations]]
file = "tuesday/field.gsi"
instrument = "TS"
[[observations]]
file = "vectors.csv"
[[observations]]
file = "levels.csv"
instrument = "TS"
[[observations]]
file = "targets.csv"
instrument = "scanner"
[lever_arms.top]
file = "top.toml"
[stations.S1]
lever_arm = "top"
mounted_point = "ROVER"
"""


def mixed(folder: Path) -> Path:
    """Raw files, GNSS vectors, levels, scanned targets and a lever arm in one network."""
    for day in ("monday", "tuesday"):
        (folder / day).mkdir()
        gsi(folder / day, given=())
    (folder / "points.csv").write_text(POINTS)
    (folder / "more.csv").write_text("point,e_m,n_m,u_m\nC,60,70,9\n")
    (folder / "vectors.csv").write_text(
        "from,to,de_m,dn_m,du_m,sigma_de_mm,sigma_dn_mm,sigma_du_mm\n"
        "A,B,80.001,4.999,2.002,3,3,6\nA,ROVER,10,10,2.3,3,3,6\n"
    )
    (folder / "levels.csv").write_text("from,to,height_difference_m,sigma_mm\nA,B,2.0005,0.5\n")
    rows = ["station,target,x_m,y_m,z_m,sigma_x_mm,sigma_y_mm,sigma_z_mm"]
    for name, place in TRUTH.items():
        x, y, z = np.subtract(place, (10.0, 10.0, 12.0))
        rows.append(f"S1,{name},{x},{y},{z},3,3,3")
    (folder / "targets.csv").write_text("\n".join(rows) + "\n")
    known = Calibration(
        "scanner", "", "nist", ("x4",), np.array([1e-5]), np.array([[1e-10]]), sigma_origin="a"
    )
    (folder / "scanner.toml").write_text(calibration_text(known))
    arm = LeverArmResult("top", np.array([0.0, 0.0, 0.3]), 1e-6 * np.eye(3), sigma_origin="a")
    (folder / "top.toml").write_text(lever_arm_text(arm))
    path = folder / "mixed.toml"
    path.write_text(MIXED)
    return path


def test_a_run_with_raw_files_vectors_and_tables_opens_each_once(tmp_path: Path) -> None:
    count = run(mixed(tmp_path))
    assert set(count.values()) == {1}, count
    assert {"monday/field.gsi", "tuesday/field.gsi", "vectors.csv", "points.csv"} <= count.keys()


def test_a_job_puts_the_same_survey_together_as_often_as_it_is_asked(tmp_path: Path) -> None:
    job = open_job(mixed(tmp_path))
    with opened(tmp_path) as count:
        one, two = job.network(), job.network()
        changed = job.changed(stations={}, lever_arms={})
        bare = changed.surveyed()
    assert not count
    assert np.array_equal(one.start.points, two.start.points, equal_nan=True)
    assert [len(o) for o in one.observations] == [len(o) for o in two.observations]
    assert not bare.vectors
    assert job.survey.vectors


RINEX = """
[site]
frame = "ITRF2014"
epoch = 2021.2
[[points]]
file = "control.csv"
[gnss]
navigation = ["brdc0920.05n"]
[[gnss.sessions]]
receivers = [
  { point = "3040", file = "30400920.05o" },
  { point = "0759", file = "07590920.05o" },
]
"""


@pytest.mark.data
@pytest.mark.skipif(not engines(), reason="RTKLIB is not installed")
def test_receivers_are_opened_once_and_by_the_engine(shared_data: Path, tmp_path: Path) -> None:
    there = shared_data / "gnss" / "geonet_0759_3040"
    names = [p for p in there.iterdir() if p.suffix in (".05o", ".05n")]
    for name in names:
        (tmp_path / name.name).write_bytes(name.read_bytes())
    orbits = [p.name for p in names if p.suffix == ".05n"]
    (tmp_path / "p.toml").write_text(RINEX.replace("brdc0920.05n", orbits[0]))
    (tmp_path / "control.csv").write_text(
        "point,ecef_x_m,ecef_y_m,ecef_z_m,sigma_e_mm,sigma_n_mm,sigma_u_mm,role\n"
        "3040,-3978241.958,3382840.234,3649900.853,,,,fixed\n"
    )
    count = run(tmp_path / "p.toml")
    # the reader looks at headers and orbits once, the engine takes the same files once more
    assert {n for name, n in count.items() if not name.startswith(("3040", "0759"))} == {1}, count
    assert max(count.values()) == 2, count


def test_a_compensator_without_sigma_is_said_before_a_scan_is_opened(tmp_path: Path) -> None:
    path = project(tmp_path, "range_mm = 1.5\nscan_angle_arcsec = 8.0")
    path.write_text(path.read_text().replace("levelling_arcsec = 0.1\n", ""))
    (tmp_path / "S1.las").write_bytes(b"no scan at all")
    with pytest.raises(InputError, match="sigma of the compensator of S1 is not given") as refused:
        pipeline.run(Project.load(path))
    assert "levelling_arcsec" in str(refused.value)
    assert (refused.value.file, refused.value.line) == (path, 4)
