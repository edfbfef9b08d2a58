"""The raw file of a simulated total station, as the reader and the reduction understand it."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tribrach.geodesy.site import FlatSite
from tribrach.instruments.precision import Precision
from tribrach.io.survey import totalstation
from tribrach.io.survey.totalstation import ReducedFile, reduce_file
from tribrach.io.totalstation.formats import read
from tribrach.network.adjustment import adjust
from tribrach.simulate.raw_readings import STILL, InstrumentDay, gsi
from tribrach.simulate.surveying import EARTH, true_sights
from tribrach.simulate.twins import campus
from tribrach.units import SEC

STATION = Precision(direction=3 * SEC, zenith=3 * SEC, distance=0.0015, scale=2e-6,
                    centring=0.0003, height=0.0005)  # fmt: skip
QUIET = Precision(direction=1e-12, zenith=1e-12, distance=1e-12)
PRISMS = dict.fromkeys(campus.NAMES, campus.HEIGHT_TARGET)


def reduced(folder: Path, precision: Precision, day: InstrumentDay, seed: int) -> ReducedFile:
    places = dict(zip(campus.NAMES, campus.traverse(), strict=True))
    text = gsi(places, campus.lines(), campus.HEIGHT_INSTRUMENT, PRISMS, precision,
               np.random.default_rng(seed), day)  # fmt: skip
    path = folder / "raw.gsi"
    path.write_text(text)
    return reduce_file(read(path))


def truth() -> dict[tuple[str, str], tuple[float, float, float]]:
    places = dict(zip(campus.NAMES, campus.traverse(), strict=True))
    lines = campus.lines()
    sights = true_sights(places, lines, campus.HEIGHT_INSTRUMENT, PRISMS, STATION.refraction)
    return dict(zip(lines, zip(*(x.tolist() for x in sights), strict=True), strict=True))


def errors(found: ReducedFile) -> dict[str, np.ndarray]:
    """Means less the truth [rad, m], directions less the mean of their set-up."""
    true, out = truth(), {}
    for k, name in enumerate(("directions", "zeniths", "distances")):
        means = getattr(found.reduction, name)
        ends = zip(found.station[means.setup], found.target[means.target], strict=True)
        off = means.value - np.array([true[pair][k] for pair in ends])
        if name == "directions":
            for setup in np.unique(means.setup):
                mine = means.setup == setup
                turned = np.angle(np.exp(1j * (off[mine] - off[mine][0])))
                off[mine] = turned - turned.mean()
        out[name] = off
    return out


def test_without_noise_the_means_are_the_truth(tmp_path: Path) -> None:
    """Words of 0.1 mm and 1e-5 gon: nothing but rounding is left, and the axis errors are found."""
    found = reduced(tmp_path, QUIET, InstrumentDay(9 * SEC, -5 * SEC, 3, 0.0, 0.0), 1)
    assert len(found.raw.setups) == 5
    assert found.raw.setups.height == pytest.approx(list(campus.HEIGHT_INSTRUMENT.values()))
    assert len(found.raw.shots) == len(campus.lines()) * 6
    assert set(found.height) == {campus.HEIGHT_TARGET}
    assert not found.raw.unknown
    assert not found.raw.problems
    off = errors(found)
    assert np.abs(off["directions"]).max() < 2e-7
    assert np.abs(off["zeniths"]).max() < 2e-7
    assert np.abs(off["distances"]).max() < 6e-5
    axes = found.reduction.axes
    assert axes.collimation == pytest.approx(9 * SEC, abs=0.05 * SEC)
    assert axes.index == pytest.approx(-5 * SEC, abs=0.05 * SEC)


def test_means_scatter_as_the_instrument_says(tmp_path: Path) -> None:
    """Forty days: readings over the root of their number, and both ends of every sight."""
    square = {"directions": 0.0, "zeniths": 0.0, "distances": 0.0}
    dof = dict.fromkeys(square, 0)
    for seed in range(40):
        found = reduced(tmp_path, STATION, STILL, seed)
        far = {p: x[2] for p, x in truth().items()}
        for name, off in errors(found).items():
            means = getattr(found.reduction, name)
            ends = zip(found.station[means.setup], found.target[means.target], strict=True)
            length = np.array([far[pair] for pair in ends])
            of = {"directions": STATION.of_directions, "zeniths": STATION.of_zeniths,
                  "distances": STATION.of_distances}[name]  # fmt: skip
            sigma = of(length, means.readings.astype(float))
            assert sigma is not None
            assert set(means.readings.tolist()) == {4}
            if name == "directions":
                for setup in np.unique(means.setup):
                    mine = means.setup == setup
                    weight = 1 / sigma[mine] ** 2
                    centred = off[mine] - np.average(off[mine], weights=weight)
                    square[name] += float((centred**2 * weight).sum())
                    dof[name] += int(mine.sum()) - 1
            else:
                square[name] += float(((off / sigma) ** 2).sum())
                dof[name] += len(off)
    for name, n in dof.items():
        low, high = chi2.ppf([0.0005, 0.9995], n)
        assert low < square[name] < high, name


def test_days_with_a_tripod_that_turns_and_hidden_targets_fit_as_stated(tmp_path: Path) -> None:
    """Sixty free networks from raw files of three sets: their sums of squares are chi-square."""
    places = dict(zip(campus.NAMES, campus.traverse(), strict=True))
    lines = [(a, b) for a in campus.NAMES for b in campus.NAMES if a != b]
    path = tmp_path / "raw.gsi"
    square, dof, missing = 0.0, 0, 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        day = InstrumentDay(sets=3, twist=10 * SEC, missing=0.25)
        text = gsi(places, lines, campus.HEIGHT_INSTRUMENT, PRISMS, STATION, rng, day)
        path.write_text(text)
        missing += 6 * len(lines) + 5 - len(text.splitlines())
        adjustment = adjust(totalstation.read([path], STATION, site=FlatSite(EARTH)).network())
        square, dof = square + adjustment.vtpv, dof + adjustment.dof
    assert missing > 60 * 0.1 * 6 * len(lines)
    low, high = chi2.ppf([0.0005, 0.9995], dof)
    assert low < square < high
