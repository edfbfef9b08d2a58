"""The tilt of a scanner drifts during a scan: it is found by time, and points lose it."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tribrach.errors import InputError
from tribrach.geometry.rotation import exp
from tribrach.instruments.correction import Correction
from tribrach.instruments.tilt_drift import Sweep, drift_model, drift_names
from tribrach.io.scans.formats import read_scans
from tribrach.job.opened import open_job
from tribrach.network.adjustment import adjust
from tribrach.project import Project
from tribrach.scan.prepared import sweep_of
from tribrach.units import SEC

STATIONS, DRIFT, START, SEEN = 60, 20.0, 35.0, 16
HEAD = """\
datum = "fixed:T0,T1,T2"
[instruments.scanner]
range_mm = 0.5
scan_angle_arcsec = 3.0
levelling_arcsec = 3.0
[[points]]
file = "points.csv"
role = "fixed"
[[observations]]
file = "targets.csv"
instrument = "scanner"
"""


def directions(h: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), np.cos(v)], axis=-1)


def as_read(u: np.ndarray, through: np.ndarray, drift: np.ndarray) -> np.ndarray:
    """Points (n, 3) as a scanner reads them that tilts by (through - 1/2) drift (2,) [rad]."""
    tilt = np.zeros((len(u), 3))
    tilt[:, :2] = (through - 0.5)[:, None] * drift
    return np.einsum("nji,nj->ni", exp(tilt), u)


def through_of(u: np.ndarray) -> np.ndarray:
    """Share of a scan of half a turn, clockwise from START, that was over."""
    h = np.degrees(np.arctan2(u[:, 1], u[:, 0]))
    share: np.ndarray = ((START - h) % 180) / 180
    return share


def test_a_drift_is_found_with_its_sigma(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    angle = rng.uniform(0, 2 * np.pi, 40)
    marks = np.stack([40 * np.cos(angle), 40 * np.sin(angle), rng.uniform(-8, 20, 40)], axis=1)
    points = [f"T{k},{x},{y},{z}" for k, (x, y, z) in enumerate(marks)]
    (tmp_path / "points.csv").write_text("\n".join(["point,e_m,n_m,u_m", *points]))
    rows, text, drifts = ["station,target,range_m,horizontal_deg,zenith_deg"], HEAD, []
    for k in range(STATIONS):
        turn, place = exp(np.array([0, 0, rng.uniform(-3, 3)])), rng.uniform(-8, 8, 3)
        turn = exp(np.array([*rng.normal(0, 3, 2), 0]) * SEC) @ turn
        axis = rng.uniform(0, 2 * np.pi)
        drifts.append(DRIFT * np.array([np.cos(axis), np.sin(axis)]))
        chosen = rng.choice(40, SEEN, replace=False)
        u = (marks[chosen] - place) @ turn
        u = as_read(u, through_of(u), drifts[-1] * SEC)
        r = np.linalg.norm(u, axis=1) + rng.normal(0, 0.5e-3, SEEN)
        h, v = np.arctan2(u[:, 1], u[:, 0]), np.arccos(u[:, 2] / np.linalg.norm(u, axis=1))
        h, v = np.degrees(np.stack([h, v]) + rng.normal(0, 3 * SEC, (2, SEEN)))
        rows += [
            f"S{k},T{c},{a:.7f},{b:.8f},{d:.8f}" for c, a, b, d in zip(chosen, r, h, v, strict=True)
        ]
        text += f'[stations.S{k}]\nlevelled = true\ninstrument = "scanner"\n'
        text += f"tilt_drift_arcsec = 30.0\nsweep_start_deg = {START}\nsweep_deg = -180.0\n"
    (tmp_path / "targets.csv").write_text("\n".join(rows))
    (tmp_path / "job.toml").write_text(text)
    adjustment = adjust(open_job(Project.load(tmp_path / "job.toml")).network())
    chosen = [
        adjustment.layout.index("scalar", f"tilt_{a}1of1(S{k})")
        for k in range(STATIONS)
        for a in "xy"
    ]
    found = adjustment.state.scalars[chosen] / SEC
    sigma = np.sqrt(adjustment.family_covariances("scalar")[chosen, 0, 0]) / SEC
    w = (found - np.concatenate(drifts)) / sigma
    assert 1.0 < np.median(sigma) < 6.0
    assert chi2.ppf(0.01, len(w)) < w @ w < chi2.ppf(0.99, len(w))
    assert np.abs(w).max() < 4


@pytest.mark.parametrize("pieces", [1, 3])
def test_points_lose_the_drift(pieces: int) -> None:
    rng = np.random.default_rng(2)
    u = 20 * directions(rng.uniform(-np.pi, np.pi, 300), rng.uniform(0.3, 2.5, 300))
    drift = np.array([30.0, -15.0]) * SEC
    model = drift_model(Sweep(np.radians(START), -np.pi), drift_names(pieces))
    # each piece adds its share
    values = np.tile(drift / pieces, pieces)
    read = as_read(u, through_of(u), drift)
    assert np.abs(read - u).max() > 1e-3
    np.testing.assert_allclose(Correction(model, values).corrected(read), u, atol=2e-6)


@pytest.mark.parametrize(("start", "turn"), [(35.0, -180.0), (-20.0, 360.0), (100.0, 70.0)])
def test_the_order_of_points_says_how_the_head_turned(
    start: float, turn: float, tmp_path: Path
) -> None:
    through = np.repeat((np.arange(360) + 0.5) / 360, 8)
    h = np.radians(start + turn * through)
    v = np.tile(np.linspace(0.4, 2.2, 8), 360)
    if abs(turn) <= 180:
        h += np.where(np.arange(len(h)) % 2, np.pi, 0.0)  # the mirror looks behind as well
    np.savetxt(tmp_path / "S.xyz", 10 * directions(h, v), fmt="%.6f")
    (scan,) = read_scans(tmp_path / "S.xyz")
    sweep = sweep_of(scan)
    np.testing.assert_allclose(sweep.progress(h), through, atol=6e-3)
    assert abs(sweep.turn) == pytest.approx(np.radians(abs(turn)), rel=5e-3)


@pytest.mark.parametrize(
    ("keys", "what"),
    [
        ("tilt_drift_arcsec = 9\nsweep_deg = 180", "sweep_start_deg"),
        ("tilt_drift_arcsec = 9\nsweep_start_deg = 0\nsweep_deg = 0", "not zero"),
        ("tilt_drift_arcsec = 9", "0 scans"),
        ("tilt_drift_arcsec = 9\nsweep_start_deg = 0\nsweep_deg = 9\n[calibration]", "calibrated"),
    ],
)
def test_a_drift_without_a_time_is_refused(keys: str, what: str, tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("point,e_m,n_m,u_m\nA,0,0,0\nB,9,0,0\nC,0,9,3\n")
    table = "station,target,x_m,y_m,z_m\nS,A,5,5,0\nS,B,3,4,0\nS,C,1,2,3\n"
    (tmp_path / "targets.csv").write_text(table)
    text = HEAD.replace("T0,T1,T2", "A,B,C") + f"[stations.S]\n{keys}\n"
    (tmp_path / "job.toml").write_text(text)
    with pytest.raises(InputError, match=what):
        open_job(Project.load(tmp_path / "job.toml")).network()
