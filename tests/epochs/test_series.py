"""Cycles of a robotic total station: baseline, references that move, trends, jumps, resuming."""

import json
import re
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.epochs.simulated import NAMES, OPEN, Network
from tribrach.cli.commands import app
from tribrach.epochs.comparison import compare
from tribrach.epochs.differences import difference
from tribrach.epochs.series import SeriesFit, baseline, fit_series, fit_together
from tribrach.errors import InputError
from tribrach.io.readings_through_time import read_timed_readings

REFERENCES = {
    "R1": (60.0, 10.0, 2.0),
    "R2": (20.0, 80.0, 5.0),
    "R3": (-50.0, 60.0, -1.0),
    "R4": (-70.0, -30.0, 3.0),
    "R5": (10.0, -90.0, 0.0),
    "R6": (80.0, -50.0, 4.0),
}
PRISMS = {"P1": (30.0, 30.0, 8.0), "P2": (-20.0, 45.0, 6.0)}
START = datetime(2025, 3, 1, tzinfo=UTC)


def readings(folder: Path, count: int, name: str = "readings.csv", seed: int = 3) -> Path:
    """Cycles of four hours: R2 moves by 8 mm after 20, P1 creeps, P2 jumps after 30."""
    rng = np.random.default_rng(seed)
    rows = ["time,station,target,direction_gon,zenith_gon,slope_distance_m"]
    for k in range(60):
        turn = rng.uniform(0, 400)
        places = {n: np.array(p) for n, p in (REFERENCES | PRISMS).items()}
        if k >= 20:
            places["R2"] = places["R2"] + [0.008, 0, 0]
        places["P1"] = places["P1"] + [0, 1e-3 * k / 6, 0]
        if k >= 30:
            places["P2"] = places["P2"] + [0, 0, -0.006]
        for m, (target, xyz) in enumerate(places.items()):
            errors = rng.normal(0, [1.5e-4, 1.5e-4, 5e-4])
            missing = rng.random() < 0.05 and target != "R1"
            if k == 12:
                missing = m > 0  # one sight alone
            if missing or k >= count:
                continue
            east, north, up = xyz
            distance = float(np.linalg.norm(xyz))
            direction = (np.arctan2(east, north) / np.pi * 200 + turn + errors[0]) % 400
            zenith = np.arccos(up / distance) / np.pi * 200 + errors[1]
            time = (START + timedelta(hours=4 * k, seconds=10 * m)).isoformat()
            rows.append(
                f"{time},S,{target},{direction:.6f},{zenith:.6f},{distance + errors[2]:.6f}"
            )
    path = folder / name
    path.write_text("\n".join(rows) + "\n")
    return path


def control(folder: Path) -> Path:
    path = folder / "points.csv"
    rows = [f"{n},{e},{m},{u}" for n, (e, m, u) in REFERENCES.items()]
    path.write_text("point,e_m,n_m,u_m\n" + "\n".join(rows) + "\nS,0,0,0\n")
    return path


def called(folder: Path, table: Path, *further: str) -> dict[str, object]:
    out = folder / f"{table.stem}-{len(further)}.json"
    arguments = ["series", str(table), "--points", str(control(folder)), "--json", str(out)]
    options = ["--sigma-direction-arcsec", "0.49", "--sigma-zenith-arcsec", "0.49"]
    options += ["--sigma-distance-mm", "0.5", "--sigma-ppm", "0", "--overwrite"]
    result = CliRunner().invoke(app, [*arguments, *options, *further])
    assert result.exit_code == 0, result.output
    return dict(json.loads(out.read_text()))


def test_a_series_of_sixty_cycles(tmp_path: Path) -> None:
    """What was put in comes out: R2, the creep of P1, the jump of P2, the cycle of one sight."""
    table = readings(tmp_path, 60)
    alarms = tmp_path / "alarms.jsonl"
    found = called(tmp_path, table, "--alarms", str(alarms), "--html", str(tmp_path / "s.html"))
    cycles = found["cycles"]
    assert len(cycles) == 60
    assert [k for k, c in enumerate(cycles) if c["reason"]] == [12]
    named = [k for k, c in enumerate(cycles) if "R2" in c["moved"]]
    seen = [k for k in range(20, 60) if "R2" in cycles[k]["points"]]
    assert len(set(named) & set(seen)) >= 0.95 * len(seen)
    before = [c for k, c in enumerate(cycles) if k < 20 and not c["reason"]]
    assert sum(c["test"] > c["limit"] for c in before) <= 2
    fits = {(name, fit["axis"]): fit for name, axes in found["series"].items() for fit in axes}
    creep = fits["P1", "N"]
    assert creep["trend"]
    assert abs(creep["rate"] - 1e-3) < 4 * creep["rate_sigma"]
    (jump,) = fits["P2", "U"]["jumps"]
    assert jump["time"].startswith("2025-03-06T00")
    assert abs(jump["size"] + 0.006) < 4 * jump["sigma"]
    assert not fits["P2", "E"]["jumps"]
    lines = [json.loads(line) for line in alarms.read_text().splitlines()]
    assert {line["point"] for line in lines if line["alarm"] == "point moved"} == {"P1", "P2"}
    others = [x for x in lines if x["alarm"] == "reference moved" and x["point"] != "R2"]
    assert len(others) <= 3  # one test in a hundred for each of sixty cycles
    assert sum(line["alarm"] == "cycle not solved" for line in lines) == 1
    said = " ".join(found["sentences"])
    assert "P2 jumps by -6.0 mm along U between 2025-03-05 20:00 and 2025-03-06 00:00 UTC" in said
    assert "Cycle of 2025-03-03 00:00 UTC: the point R1 alone does not fix the datum" in said
    html = (tmp_path / "s.html").read_text()
    assert "Series of" in html
    # round dates along the charts, and no time that is written for machines
    assert {">1 Mar<", ">3 Mar<", ">2025, UTC<"} <= set(re.findall(">[^<>]+<", html))
    assert "00Z" not in html


def test_new_cycles_alone_are_solved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Forty-five cycles, then all sixty: old ones stay as they are, new ones are as in one call."""
    first = called(tmp_path, readings(tmp_path, 45, "first.csv"))
    earlier = tmp_path / "first-0.json"
    table = readings(tmp_path, 60, "all.csv")
    count = []
    from tribrach.questions.series import cycles as module

    solve = module._solved
    monkeypatch.setattr(module, "_solved", lambda *a: (count.append(1), solve(*a))[1])
    second = called(tmp_path, table, "--resume", str(earlier))
    assert len(count) == 15
    assert second["cycles"][:45] == first["cycles"]
    assert second["factor"] == first["factor"]
    refused = CliRunner().invoke(
        app,
        ["series", str(table), "--points", str(control(tmp_path)), "--resume", str(earlier)],
    )
    assert refused.exit_code == 2
    assert "another sigma direction" in refused.output.replace("\n", " ")


def test_the_baseline_of_equal_cycles_is_their_mean() -> None:
    """Of k equal networks, each anywhere, the covariance is that of one divided by k."""
    network, rng = Network.measured(), np.random.default_rng(4)
    cycles = [network.epoch(rng) for _ in range(5)]
    moved = [
        c if k == 0 else type(c)(c.label, c.names, c.xyz + 3.0 * k, c.covariance, OPEN)
        for k, c in enumerate(cycles)
    ]
    zero = baseline(moved, "zero")
    assert zero.names == NAMES
    np.testing.assert_allclose(zero.covariance, cycles[0].covariance / 5, atol=1e-12)
    # against the plain mean of the cycles as they lie: no displacement
    mean = np.mean([c.xyz for c in cycles], axis=0)
    plain = type(cycles[0])("mean", NAMES, mean, cycles[0].covariance / 5, OPEN)
    found = compare(difference(zero, plain))
    assert found.whole.statistic < 1e-3


def noise(kind: str, n: int, rng: np.random.Generator) -> np.ndarray:
    """A series of unit white noise, or of another kind of that size."""
    white = rng.normal(size=n)
    if kind.startswith("ar"):
        correlation = float(kind[2:])
        out = white.copy()
        for i in range(1, n):
            out[i] = correlation * out[i - 1] + np.sqrt(1 - correlation**2) * white[i]
        return out
    if kind == "white + ar0.95":
        return white + noise("ar0.95", n, rng)
    if kind == "white + flicker":
        frequency = np.fft.rfftfreq(4 * n)
        part = rng.normal(size=len(frequency)) + 1j * rng.normal(size=len(frequency))
        part[0] = 0
        part[1:] /= np.sqrt(frequency[1:])
        pink = np.fft.irfft(part)[:n]
        return white + pink / np.std(np.diff(pink))
    if kind == "pure walk":
        return np.cumsum(white)
    if kind == "white + walk":
        return white + 0.1 * np.cumsum(rng.normal(size=n))
    return white


KINDS = ("white", "ar0.5", "ar0.9", "white + ar0.95", "white + flicker", "white + walk")


def called_real(kind: str, n: int, runs: int) -> tuple[float, float, float]:
    """Shares of trends and jumps in noise, and the stated sigma of the rate over its scatter."""
    rng = np.random.default_rng(2)
    days = np.arange(n) / 6 + 0.5 / 6
    fits = [
        fit_series(days, 1e-3 * noise(kind, n, rng), np.full(n, 1e-3), "E") for _ in range(runs)
    ]
    rates = np.array([(f.rate, f.rate_sigma) for f in fits if f is not None])
    assert len(rates) == runs
    return (
        float(np.mean([f.trend for f in fits if f is not None])),
        float(np.mean([bool(f.jumps) for f in fits if f is not None])),
        float(np.sqrt(np.mean(rates[:, 1] ** 2)) / np.std(rates[:, 0])),
    )


@pytest.mark.parametrize("kind", KINDS)
def test_noise_of_any_colour_has_nothing_in_it(kind: str) -> None:
    """Few runs: with 1 % of false ones, three of forty come once in two thousand times."""
    trend, jump, _ = called_real(kind, 40, 40)
    assert trend <= 3 / 40
    assert jump <= 3 / 40


@pytest.mark.slow
@pytest.mark.parametrize("n", [12, 60, 120])
@pytest.mark.parametrize("kind", KINDS)
def test_rates_of_false_trends_and_jumps(kind: str, n: int) -> None:
    """Never far above the stated 1 % (binomial limit at 0.1 % for 300 runs: 3.3 %)."""
    trend, jump, ratio = called_real(kind, n, 300)
    print(f"{kind}, {n}: trend {100 * trend:.1f} %, jump {100 * jump:.1f} %, sigma {ratio:.2f}")
    assert trend <= 0.033
    assert jump <= 0.033
    # cautious where it is white or correlated, since nobody can see a small walk in so few values
    assert 0.75 < ratio < 2.2


def run_of(kinds: dict[str, int], n: int, seed: int) -> list[SeriesFit]:
    """So many series of each kind, fitted together."""
    rng, days = np.random.default_rng(seed), np.arange(n) / 6 + 0.5 / 6
    values = [1e-3 * noise(kind, n, rng) for kind, many in kinds.items() for _ in range(many)]
    fits = fit_together([(days, v, np.full(n, 1e-3), "E") for v in values])
    return [fit for fit in fits if fit is not None]


@pytest.mark.parametrize("kind", KINDS)
def test_runs_of_many_series_have_nothing_in_them(kind: str) -> None:
    """With 1 % of false runs, two of two come once in ten thousand times."""
    runs = [run_of({kind: 27}, 12, seed) for seed in range(2)]
    assert not all(any(fit.trend for fit in fits) for fits in runs)
    assert not all(any(fit.jumps for fit in fits) for fits in runs)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_runs_have_the_stated_rates_and_sigmas(kind: str) -> None:
    """Three of twenty runs come once in a thousand times; a scatter of 540 is known to 3 %."""
    runs = [run_of({kind: 27}, 60, seed) for seed in range(20)]
    assert sum(any(fit.trend for fit in fits) for fits in runs) <= 2
    assert sum(any(fit.jumps for fit in fits) for fits in runs) <= 2
    rates = np.array([(fit.rate, fit.rate_sigma) for fits in runs for fit in fits])
    ratio = float(np.sqrt(np.mean(rates[:, 1] ** 2)) / np.std(rates[:, 0]))
    print(f"{kind}: {ratio:.2f}")
    assert 0.8 / 1.1 < ratio < 1.25 * 1.1


def test_series_say_together_what_a_short_one_cannot() -> None:
    """Twelve values of white noise among others that are white, and among walks."""
    alone = run_of({"white": 1}, 12, 7)[0]
    white = run_of({"white": 27}, 12, 7)
    walks = run_of({"white": 1, "pure walk": 26}, 12, 7)
    assert white[0].rate_sigma < alone.rate_sigma < walks[0].rate_sigma
    assert white[0].noise["white"] > alone.noise["white"] > walks[0].noise["white"]
    assert white[0].noise["walk"] < alone.noise["walk"] < walks[0].noise["walk"]
    # it says that it does not know
    low, high = alone.rate_sigma_range
    assert high > 1.5 * low
    assert low < alone.rate_sigma < high


def test_four_fifths_of_detectable_trends_are_found() -> None:
    """White noise of sixty values, to each series the trend that is stated for it."""
    n, rng = 60, np.random.default_rng(8)
    days, stated = np.arange(n) / 6, np.full(n, 1e-3)
    values = [rng.normal(0, 1e-3, n) for _ in range(27)]
    still = fit_together([(days, v, stated, "E") for v in values])
    sizes = [fit.detectable for fit in still if fit is not None]
    moved = [(days, v + s * days, stated, "E") for v, s in zip(values, sizes, strict=True)]
    found = sum(fit.trend for fit in fit_together(moved) if fit is not None)
    # three sigmas of a binomial distribution
    assert abs(found - 0.8 * 27) <= 3 * np.sqrt(27 * 0.8 * 0.2)


def test_an_outlier_is_named() -> None:
    rng = np.random.default_rng(2)
    days = np.arange(60) / 6
    values = rng.normal(0, 1e-3, 60) + 2e-3 * np.cos(2 * np.pi * days)
    values[17] += 0.03
    fit = fit_series(days, values, np.full(60, 1e-3), "E")
    assert fit is not None
    assert days[17] * 86400 in fit.outliers
    assert fit.period
    assert fit.amplitude == pytest.approx(2e-3, abs=4 * fit.amplitude_sigma)
    assert fit_series(days[:5], values[:5], np.ones(5), "E") is None


HEAD = "time,station,target,direction_gon,zenith_gon,slope_distance_m"


@pytest.mark.parametrize(("offset", "refused"), [("", True), ("+02:00", False), ("Z", False)])
def test_an_hour_that_local_times_repeat_is_refused(
    tmp_path: Path, offset: str, refused: bool
) -> None:
    """Clocks are put back: 02:00 is there twice, and would be one cycle."""
    hours = ["01:00", "02:00", "02:00", "03:00"]
    late = {"+02:00": "+01:00"}.get(offset, offset)
    rows = [
        f"2025-10-26T{hour}:{s:02d}{offset if k < 2 else late},{station},P{s},1,90,5"
        for k, hour in enumerate(hours)
        for station in ("S", "T")
        for s in range(3)
    ]
    path = tmp_path / "a.csv"
    path.write_text("\n".join([HEAD, *rows]))
    if refused:
        with pytest.raises(InputError, match="summer time") as error:
            read_timed_readings(path)
        assert error.value.line == 14
    else:
        cycles = read_timed_readings(path).cycles(1800)
        assert len(cycles) == (3 if offset == "Z" else 4)
    day = path.read_text().replace("-10-", "-06-")
    path.write_text(day)
    assert len(read_timed_readings(path).seconds) == 24


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("time,station\n1,S\n", "no column target"),
        (f"{HEAD},x\n1,S,P,1,1,1,1\n", "unknown"),
        (f"{HEAD}\nnow,S,P,1,1,1\n", "time is 'now'"),
        (f"{HEAD}\n2025-03-01,S,P,a,1,1\n", "no number"),
        (f"{HEAD}\n2025-03-01,S,P,1,1,0\n", "not positive"),
        (f"{HEAD}\n2025-03-01,S,,1,1,5\n", "target is empty"),
    ],
)
def test_tables_that_are_none_are_refused(tmp_path: Path, text: str, what: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=what):
        read_timed_readings(path)


@pytest.mark.parametrize("value", [0.0, 5.0])
def test_values_that_are_all_alike_show_nothing(value: float) -> None:
    """Without scatter nothing is singular, and nothing is a trend, a period or a jump."""
    fit = fit_series(np.arange(30) / 4, np.full(30, value), np.full(30, 1e-3), "E")
    assert fit is not None
    assert not any((fit.trend, fit.period, fit.jumps, fit.outliers))
    assert 0 < fit.rate_sigma < 1e-3
