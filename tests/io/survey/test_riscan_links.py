"""RiSCAN PRO: reflectors that are linked to control, and grids that are not Cartesian."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.io.survey.riscan_files import Rsp, Scan, write
from tribrach.io.survey.riscan import reader as riscan
from tribrach.io.survey.riscan.reader import grid_scale
from tribrach.network.adjustment import adjust

ACCURACY = (0.004, 0.003, 0.003)
#: of control: three of 4 mm and the last one higher up
CONTROL = {
    "CP1": (120.0, 30.0, 1.0),
    "CP2": (100.0, -80.0, 4.0),
    "CP3": (-60.0, 90.0, 2.0),
    "CP4": (-110.0, -50.0, 5.0),
    "CP5": (30.0, 140.0, 9.0),
}
SIGMA = (0.004, 0.004, 0.004)
PLACES = {"S1": (0.0, 0.0, 1.5), "S2": (40.0, 60.0, 1.7)}
TURN = {"S1": 20.0, "S2": -130.0}


def sop(station: str) -> np.ndarray:
    out = np.eye(4)
    out[:3, :3] = Rotation.from_euler("zx", [TURN[station], 2.0], degrees=True).as_matrix()
    out[:3, 3] = PLACES[station]
    return out


def seen(station: str, rename=lambda name: name, noise: float = 0.0, seed: int = 0) -> dict:
    """All control points in the scanner frame."""
    pose, generator = sop(station), np.random.default_rng(seed)
    return {
        rename(name): (
            pose[:3, :3].T @ (np.array(x) - pose[:3, 3]) + noise * generator.normal(size=3),
            ACCURACY,
        )
        for name, x in CONTROL.items()
    }


def control(scale: float = 1.0, shift=(0.0, 0.0, 0.0), noise: float = 0.0, seed: int = 9) -> dict:
    """Control points of a grid with a scale in plan."""
    generator = np.random.default_rng(seed)
    factor = np.array([scale, scale, 1.0])
    return {
        name: (np.array(x) * factor + shift + noise * generator.normal(size=3), SIGMA)
        for name, x in CONTROL.items()
    }


@pytest.fixture
def read(tmp_path):
    """Write a project and read it."""
    return lambda project: riscan.read(write(project, tmp_path / "project.rsp"))


def as_reflector(name: str) -> str:
    return name.replace("CP", "tp00")


def test_links_name_control(read) -> None:
    """Reflectors that are numbered otherwise at each position, linked to control by three ways."""
    direct = {as_reflector(name): f"/test/TPL (GLCS)/{name}" for name in CONTROL}
    over = {
        f"r{k}": f"/test/SCANS/S1/TPL (SOCS)/{as_reflector(name)}" for k, name in enumerate(CONTROL)
    }
    order = {name: f"r{k}" for k, name in enumerate(CONTROL)}
    scans = [
        Scan("S1", seen("S1", as_reflector), sop("S1"), links=direct),
        Scan("S2", seen("S2", order.__getitem__), sop("S2"), links=over),
    ]
    survey = read(Rsp(scans, glcs=control()))
    assert survey.datum.kind == "control"
    assert set(survey.points) == set(CONTROL)
    adjustment = adjust(survey.network())
    assert adjustment.vtpv < 1e-9
    # two stations of six unknowns and five points; 2 x 15 readings and 15 coordinates
    assert adjustment.dof == 2 * 15 + 15 - 2 * 6 - 15


def test_links_that_lead_nowhere_or_meet_are_said(read) -> None:
    links = {
        "tp001": "/test/TPL (GLCS)/CP1",
        "tp002": "/test/TPL (GLCS)/CP1",
        "tp003": "/test/TPL (GLCS)/CP9",
        "tp004": "/test/SCANS/S1/TPL (SOCS)/tp004",
        "tp005": "nowhere",
    }
    scans = [Scan("S1", seen("S1", as_reflector), sop("S1"), links=links)]
    survey = read(Rsp(scans, glcs=control()))
    said = [w.split(": ", 1)[1] for w in survey.warnings if "linked" in w]
    assert said == [
        "reflector tp002 of S1 is linked to CP1, as another reflector of that position is; it "
        "keeps its name",
        "reflector tp003 of S1 is linked to /test/TPL (GLCS)/CP9, which is not in the project; it "
        "keeps its name",
        "reflector tp004 of S1 is linked to /test/SCANS/S1/TPL (SOCS)/tp004, which is not in the "
        "project; it keeps its name",
        "reflector tp005 of S1 is linked to nowhere, which is not in the project; it keeps its "
        "name",
    ]


def test_a_map_projection_is_said_first(read) -> None:
    """UTM at its central meridian: -400 ppm, in plan."""
    scans = [Scan(n, seen(n), sop(n)) for n in PLACES]
    grid = control(0.9996, shift=(500000.0, 5300000.0, 0.0))
    survey = read(Rsp(scans, glcs=grid, crs="WGS 84 / UTM zone 33N"))
    first = survey.warnings[0]
    assert first.startswith("control fits the measured distances with a scale of -399.")
    assert "its grid (WGS 84 / UTM zone 33N) is not Cartesian" in first
    # by hand: five points some 110 m out, reflectors of 3.4 mm and control of 4 mm
    found = grid_scale(
        [{n: (v, np.eye(3) * 0.0034**2) for n, (v, _) in seen("S1").items()}],
        {n: (v, np.array(s)) for n, (v, s) in grid.items()},
    )
    xyz = np.array(list(CONTROL.values()))
    radius = np.sqrt(np.square(xyz - xyz.mean(axis=0)).sum())
    assert found.sigma == pytest.approx(np.hypot(0.0034, 0.004) / radius, rel=1e-9)
    assert found.scale * 1e6 == pytest.approx(-400, abs=2)


@pytest.mark.parametrize("case", ["true", "blunder", "two points"])
def test_no_grid_is_accused_of_what_it_did_not(read, case: str) -> None:
    given = control(shift=(5000.0, 3000.0, 100.0))
    if case == "blunder":  # 8 cm in one point: a similarity does not explain it
        given["CP1"] = (given["CP1"][0] + np.array([0.08, 0.02, 0.0]), SIGMA)
    if case == "two points":
        given = {name: given[name] for name in ("CP1", "CP2")}
    survey = read(Rsp([Scan(n, seen(n), sop(n)) for n in PLACES], glcs=given))
    assert not any("not Cartesian" in warning for warning in survey.warnings)


def test_rates_of_both_words() -> None:
    """Once in a thousand without a scale; with 120 ppm almost always."""
    told = {0.0: 0, 120e-6: 0}
    for scale in told:
        for seed in range(400):
            targets = {
                n: (v, np.eye(3) * 0.0034**2)
                for n, (v, _) in seen("S1", noise=0.0034, seed=seed).items()
            }
            given = control(1 + scale, noise=0.004, seed=10000 + seed)
            found = grid_scale([targets], {n: (v, np.array(s)) for n, (v, s) in given.items()})
            told[scale] += found.told
    assert told[0.0] <= 3
    assert told[120e-6] >= 390
