"""Series with curvature, a refraction of each cycle, blocked sights, faces, short baselines."""

from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from tests.epochs.test_series import START
from tribrach.io.readings_through_time import read_timed_readings
from tribrach.questions.series.command import alarm_lines
from tribrach.questions.series.cycles import Series, SeriesSettings, monitor
from tribrach.units import SEC

EARTH = 6371000.0
STATIONS = {"S1": (0.0, 0.0, 0.0), "S2": (500.0, 0.0, 12.0)}
REFERENCES = {
    "R1": (120.0, 260.0, 20.0),
    "R2": (-180.0, 90.0, 5.0),
    "R3": (430.0, -210.0, -8.0),
    "R4": (680.0, 190.0, 30.0),
    "R5": (250.0, -330.0, 14.0),
}
PRISMS = {"P1": (330.0, 240.0, 25.0), "P2": (260.0, 120.0, 9.0)}
OPTIONS = {"sigma_direction": 1.0 * SEC, "sigma_zenith": 1.0 * SEC, "sigma_distance": 1e-3}


def table(
    folder: Path, seed: int, *, size: float = 1.0, cycles: int = 20, blocked: bool = True,
    wild: bool = True, faces: bool = False, lost: frozenset[tuple[int, str]] = frozenset(),
) -> Path:  # fmt: skip
    """Nothing moves; from cycle 10 on S1 does not see P1 and R5; k is drawn for each cycle."""
    rng = np.random.default_rng(seed)
    rows = ["time,station,target,direction_gon,zenith_gon,slope_distance_m"]
    every = {n: size * np.array(p) for n, p in (STATIONS | REFERENCES | PRISMS).items()}
    for k in range(cycles):
        refraction = 0.13 + (0.1 * rng.normal() if wild else 0.0)
        for j, station in enumerate(STATIONS):
            turn = rng.uniform(0, 2 * np.pi)
            for face in (1, 2) if faces else (1,):
                for m, target in enumerate(every):
                    if target == station or (k, target) in lost:
                        continue
                    if blocked and k >= 10 and station == "S1" and target in ("P1", "R5"):
                        continue
                    e, n, u = every[target] - every[station]
                    flat = np.hypot(e, n)
                    slope = np.hypot(flat, u)
                    rise = u - flat**2 * (1 - refraction) / (2 * EARTH)
                    d, z = np.arctan2(e, n) + turn, np.arctan2(flat, rise)
                    # axis errors that the mean of two faces is free of
                    sign = 1 if face == 1 else -1
                    if faces:
                        d, z = d + sign * 8 * SEC, z + sign * 12 * SEC
                    if face == 2:
                        d, z = d + np.pi, 2 * np.pi - z
                    error = rng.normal(0, 1, 3) * [SEC, SEC, (1e-3 + 1e-6 * slope)]
                    time = (START + timedelta(hours=4 * k, seconds=100 * j + 2 * m)).isoformat()
                    rows.append(
                        f"{time},{station},{target},"
                        f"{(d + error[0]) % (2 * np.pi) / np.pi * 200:.7f},"
                        f"{(z + error[1]) / np.pi * 200:.7f},{slope + error[2]:.6f}"
                    )
    path = folder / "readings.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def found(path: Path, size: float = 1.0, **further: object) -> Series:
    settings = SeriesSettings(references=tuple(REFERENCES), **(OPTIONS | further))  # type: ignore[arg-type]
    places = {n: size * np.array(p) for n, p in (STATIONS | REFERENCES).items()}
    return monitor(read_timed_readings(path), places, settings)


def alarms(series: Series) -> list[str]:
    return alarm_lines(series, {cycle.key for cycle in series.cycles}, 5e-3).splitlines()


@pytest.mark.parametrize("size", [1.0, 0.3])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_blocked_sight_moves_nothing(tmp_path: Path, seed: int, size: float) -> None:
    """On sites of 500 m and of 150 m: no jump, no alarm, although half of a pair of sights ends."""
    series = found(table(tmp_path, seed, size=size), size)
    # by chance one comes in a year
    assert not alarms(series)
    for point in series.points:
        (up,) = (fit for fit in point.fits if fit.axis == "U")
        # it was 12.8 and 1.1 mm
        assert not [jump for jump in up.jumps if abs(jump.size) > 4e-3 * size]
    tests = np.array([c.test / c.dof for c in series.solved])
    assert 0.4 < tests.mean() < 1.4


def test_two_faces_of_a_cycle_count_as_two_and_lose_the_axis_errors(tmp_path: Path) -> None:
    """Means of faces: twice as precise in variance, free of index and collimation errors."""
    both = found(table(tmp_path, 5, faces=True, blocked=False))
    one = found(table(tmp_path, 5, blocked=False))
    sigma = [
        np.mean([p.sigma[0] for c in s.solved for n, p in c.points.items() if n == "P1"])
        for s in (both, one)
    ]
    assert sigma[0] / sigma[1] == pytest.approx(np.sqrt(0.5), rel=0.05)
    assert not alarms(both)


@pytest.mark.parametrize("baseline", [1, 3])
def test_a_baseline_of_few_cycles_and_a_reference_that_was_seen_once(
    tmp_path: Path, baseline: int
) -> None:
    """R4 is in one cycle alone, the fifth: it does not make that cycle the baseline of three."""
    lost = frozenset((k, "R4") for k in range(20) if k != 4)
    series = found(table(tmp_path, 7, blocked=False, lost=lost), baseline=baseline)
    assert not any(c.reason for c in series.cycles)
    assert max(series.seen.values()) == baseline
    compared = [c for c in series.cycles if c.points]
    assert len(compared) == (19 if baseline == 1 else 20)
    assert not alarms(series)


def test_an_eccentricity_of_each_cycle_is_in_the_sigmas(tmp_path: Path) -> None:
    path = table(tmp_path, 8, blocked=False)
    plain, beside = found(path, baseline=1), found(path, baseline=1, centring=2e-3, as_stated=True)
    point = [next(c for c in s.solved if c.points).points["P1"].sigma for s in (plain, beside)]
    assert point[1][0] > np.hypot(point[0][0], np.sqrt(2) * 1.9e-3)
