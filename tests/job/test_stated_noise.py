"""Stated against observed noise: right and wrong sheets are told apart, class by class."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import pytest

from tests.job.lit_rooms import HEADING, PLACE, Truth, project, scanned
from tribrach.instruments.range_law import RangeLaw
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.scans.formats import read_scans
from tribrach.job.stated_noise import StatedNoise, _shown, _Source
from tribrach.pipeline import run
from tribrach.project import Project
from tribrach.project.instrument_file import instrument_file_text
from tribrach.report.content import Report
from tribrach.scan import noise_law
from tribrach.scan.noise_law import NoiseClass, fit_noise, held_noise
from tribrach.scan.observed_noise import observed_noise
from tribrach.units import SEC

SHEET = ScanNoise(0.0015, 1e-5, 8 * SEC, 8 * SEC, 3.5e-3, 0.23e-3)
LAW = RangeLaw(0.06, -0.5, 0.0004, 15.0, 60_000.0)
KEYS = """\
range_mm = {mm}
range_ppm = 10.0
scan_angle_arcsec = 8.0
beam_exit_mm = 3.5
beam_divergence_mrad = 0.23
"""


def reported(
    folder: Path,
    noise: ScanNoise,
    figures: str,
    seed: int,
    *,
    incidence: bool = True,
    stated: bool = True,
) -> tuple[Report, StatedNoise]:
    """A run of the hall; incidence : of the noise that there is; stated : of that of clouds."""
    scanned(folder / "S1.las", noise, seed, step=0.008, incidence=incidence)
    cloud = f"write = false\nincidence = {str(stated).lower()}"
    report = run(Project.load(project(folder, figures, cloud)))
    assert report.job.placed is not None
    (found,) = report.job.placed.noise
    return report, found


def said(folder: Path) -> str:
    """The report without its line ends."""
    return " ".join((folder / "out" / "report.txt").read_text().split())


def along_beam(truth: Truth, noise: ScanNoise) -> np.ndarray:
    """Variances (n,) along the beam: of the range, and of the angles over the slope."""
    slope = 1 / truth.cosine**2 - 1
    across = noise.horizontal**2 + noise.beam_angle(truth.range) ** 2
    along = noise.range_sigma(truth.range, truth.cosine, truth.intensity) ** 2
    return np.asarray(along + slope * truth.range**2 * across)


def test_a_sheet_that_is_right_is_told_so_in_every_class(tmp_path: Path) -> None:
    report, found = reported(tmp_path, SHEET, KEYS.format(mm=1.5), 10_001)
    assert found.whole is not None
    assert found.smooth > 500
    assert found.whole.factor == pytest.approx(1.0, abs=0.02)
    everything = [found.whole, *(one for some in found.classes.values() for one in some)]
    assert {found.verdict(one) for one in everything} == {"as stated"}
    assert found.farthest is None
    assert "it is as the project ([instruments.A]) states it" in said(tmp_path)
    assert found.neighbours is not None
    assert (found.neighbours.share, found.neighbours.stated) == (0.0, None)
    assert "show nothing that neighbours share: correlation" in said(tmp_path)
    told = said(tmp_path)
    assert "from column to column. The project does not state what they share: a mean" in told
    assert not any("noise" in warning for warning in report.warnings)


def test_noise_without_incidence_is_held_against_that_of_clouds_without_it(tmp_path: Path) -> None:
    """A range noise that does not grow with the incidence is no contradiction to such clouds."""
    report, found = reported(
        tmp_path, SHEET, KEYS.format(mm=1.5), 10_007, incidence=False, stated=False
    )
    everything = [found.whole, *(one for some in found.classes.values() for one in some)]
    assert {found.verdict(one) for one in everything if one is not None} == {"as stated"}
    assert not any("noise" in warning for warning in report.warnings)


def test_clouds_that_want_the_incidence_are_told_so(tmp_path: Path) -> None:
    report, found = reported(tmp_path, SHEET, KEYS.format(mm=3.0), 10_008, stated=False)
    assert found.whole is not None
    assert found.slanted is not None
    assert found.whole.factor / found.slanted.factor > 1.05
    report, found = reported(
        tmp_path, replace(SHEET, range=0.004), KEYS.format(mm=4.0), 10_009, stated=False
    )
    assert found.verdict(found.whole) == "more than stated"
    assert any("with incidence = true in [cloud]" in warning for warning in report.warnings)
    assert "the noise of ranges grows with the incidence, and" in said(tmp_path)


@pytest.mark.parametrize(("mm", "word"), [(0.75, "little"), (4.0, "much")])
def test_a_sheet_that_is_wrong_is_contradicted_with_its_factor(
    tmp_path: Path, mm: float, word: str
) -> None:
    truth = scanned(tmp_path / "S1.las", SHEET, 10_002, step=0.008)
    report, found = reported(tmp_path, SHEET, KEYS.format(mm=mm), 10_002)
    whole = [along_beam(truth, replace(SHEET, range=r)) for r in (SHEET.range, mm / 1000)]
    factor = np.sqrt(np.mean((whole[0] / whole[1])[truth.cosine > 0.3]))
    assert found.whole is not None
    ends = found.interval(found.whole)
    assert ends is not None
    assert ends[0] < found.whole.factor < ends[1]
    assert found.whole.factor == pytest.approx(factor, rel=0.06)
    sentence = f"states too {word} noise of single points"
    assert any(sentence in warning for warning in report.warnings)
    data = json.loads((tmp_path / "out" / "result.json").read_text())["observed_noise"]
    assert data[0]["classes"][0]["factor"] == pytest.approx(found.whole.factor)
    for row in data[0]["classes"]:
        assert row["observed"] / row["stated"] == pytest.approx(row["factor"])


def test_a_sheet_that_a_law_contradicts_is_shown_where_it_is_worst(tmp_path: Path) -> None:
    report, found = reported(tmp_path, replace(SHEET, law=LAW), KEYS.format(mm=1.5), 10_003)
    worst = found.farthest
    assert worst is not None
    assert found.law is not None
    dark, *_, bright = found.classes["intensity"]
    assert found.verdict(dark) == "more than stated"
    assert found.verdict(bright) == "less than stated"
    middle = np.sqrt(bright.low * bright.high)
    assert found.law.sigma(middle) == pytest.approx(LAW.sigma(middle), rel=0.05)
    assert "The noise of A departs most from what is stated at" in said(tmp_path)
    assert any("departs most" in warning for warning in report.warnings)
    assert "What these scans show of A is a law of intensity" in said(tmp_path)


def test_a_second_run_remembers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _, found = reported(tmp_path, SHEET, KEYS.format(mm=1.5), 10_004)
    monkeypatch.setattr("tribrach.job.stated_noise._observed", lambda *_: pytest.fail("again"))
    again = run(Project.load(tmp_path / "job.toml"))
    assert again.job.placed is not None
    assert again.job.placed.noise == [found]


def test_intervals_hold_as_often_as_they_say() -> None:
    """Monte Carlo of 2000 instruments of 200 patches: 95 % intervals hold in 93.5 to 96.5 %."""
    rng = np.random.default_rng(10_005)
    held = 0
    for _ in range(2000):
        free = rng.integers(20, 60, 200).astype(float)
        squares = rng.chisquare(free)
        mean = squares.sum() / free.sum()
        one = NoiseClass(0, 1, 200, 8000, 1.0, 1.0, 1.0, float(mean), effective_of(squares, free))
        ends = one.interval()
        assert ends is not None
        held += ends[0] <= 1 <= ends[1]
    assert 0.935 < held / 2000 < 0.965


def effective_of(squares: np.ndarray, free: np.ndarray) -> float:
    return noise_law._effective(squares, free)


@pytest.mark.parametrize(
    ("seeds", "step"),
    [([1], 0.006), pytest.param(range(2, 12), 0.004, marks=pytest.mark.slow)],
)
def test_sigmas_of_clouds_from_learned_laws_hold(
    tmp_path: Path, seeds: Sequence[int], step: float
) -> None:
    """From the scan its law, with the law the cloud, and the cloud against the true surface.

    Squared distances from the true walls over the variances that the cloud states along their
    normals have a mean of 0.9 to 1.1 in every class of intensity, range and incidence, with the
    weak light that the law is continued to.
    """
    sums: dict[str, np.ndarray] = {}
    for seed in seeds:
        truth = scanned(tmp_path / "S1.las", replace(SHEET, law=LAW), seed, step)
        (scan,) = read_scans(tmp_path / "S1.las")
        fitted = fit_noise(observed_noise(replace(scan, origin="stated")))
        learned = held_noise(fitted, SHEET.beam).noise()
        assert learned.law is not None
        text = instrument_file_text(figures_of(learned), "this very scan")
        (tmp_path / "a.toml").write_text(text)
        figures = 'file = "a.toml"'
        run(Project.load(project(tmp_path, figures, "correlations = true")), overwrite=True)
        squares = against_walls(tmp_path / "out" / "clouds" / "S1.las", truth)
        within = (truth.intensity >= learned.law.weakest) & (truth.intensity <= learned.law.high)
        assert within.mean() > 0.98
        for by, values, edges in classes(truth):
            number = np.where(within, np.digitize(values, edges), len(edges) + 1)
            bins = len(edges) + 2
            both = np.array(
                [np.bincount(number, w, bins) for w in (squares, np.ones(len(squares)))]
            )
            both = both[:, :-1]
            sums[by] = sums.get(by, 0) + both
    for by, (total, count) in sums.items():
        told = count > 1000
        assert told.sum() >= 4, by
        ratio = total[told] / count[told]
        assert ((ratio > 0.9) & (ratio < 1.1)).all(), (by, ratio.round(3), count)


def figures_of(noise: ScanNoise) -> dict[str, float | str | tuple[float, ...]]:
    assert noise.law is not None
    law = noise.law
    return {
        "range_mm": 1e3 * noise.range,
        "range_ppm": 1e6 * noise.range_scale,
        "scan_angle_arcsec": np.sqrt((noise.horizontal**2 + noise.vertical**2) / 2) / SEC,
        "beam_exit_mm": 1e3 * noise.beam_exit,
        "beam_divergence_mrad": 1e3 * noise.beam_divergence,
        "range_law_a_mm": 1e3 * law.a,
        "range_law_b": law.b,
        "range_law_c_mm": 1e3 * law.c,
        "range_law_from": law.low,
        "range_law_to": law.high,
        "range_law_at": law.knots,
        "range_law_times": law.factors,
    }


def against_walls(cloud: Path, truth: Truth) -> np.ndarray:
    """Squared distances (n,) of points from the true walls, over their stated variances."""
    las = laspy.read(cloud)
    turn = np.array(
        [[np.cos(HEADING), -np.sin(HEADING), 0], [np.sin(HEADING), np.cos(HEADING), 0], [0, 0, 1]]
    )
    normal = truth.normal @ turn.T
    off = np.einsum("ni,ni->n", las.xyz - truth.xyz @ turn.T - PLACE, normal)
    sigma = np.stack([las[f"sigma_{a}"] for a in "xyz"], axis=1).astype(float)
    matrix = np.einsum("ni,nj->nij", sigma, sigma)
    for name, i, j in (("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2)):
        matrix[:, i, j] *= las[f"correlation_{name}"]
        matrix[:, j, i] *= las[f"correlation_{name}"]
    return np.asarray(off**2 / np.einsum("ni,nij,nj->n", normal, matrix, normal))


def classes(truth: Truth) -> list[tuple[str, np.ndarray, list[float]]]:
    return [
        ("intensity", truth.intensity, [50.0, 100, 300, 600, 1000, 2000, 4000, 8000]),
        ("range", truth.range, [5.0, 8, 12, 18, 25]),
        ("incidence", np.degrees(np.arccos(truth.cosine)), [15.0, 30, 45, 60, 75]),
    ]


def test_a_hump_of_the_noise_is_seen_and_learned(tmp_path: Path) -> None:
    """Three times the noise around one intensity: not as stated, and right with what is learned."""
    hump = RangeLaw(0.0, 0.0, 0.0015, 5.0, 60_000.0, (400.0, 1000.0, 2500.0), (1.0, 3.0, 1.0))
    _, found = reported(
        tmp_path, replace(SHEET, law=hump), KEYS.format(mm=1.5), 10_010, stated=False
    )
    assert found.whole is not None
    assert found.verdict(found.whole) == "more than stated"
    (scan,) = read_scans(tmp_path / "S1.las")
    observed = observed_noise(replace(scan, origin="stated"))
    learned = held_noise(fit_noise(observed), SHEET.beam)
    assert learned.law is not None
    assert not learned.contradicted
    light = np.array([200.0, 1000.0, 5000.0])
    assert learned.law.sigma(light) == pytest.approx(hump.sigma(light), rel=0.1)
    text = instrument_file_text(figures_of(learned.noise()), "this very scan")
    (tmp_path / "a.toml").write_text(text)
    report = run(Project.load(project(tmp_path, 'file = "a.toml"')), overwrite=True)
    assert report.job.placed is not None
    (again,) = report.job.placed.noise
    assert again.whole is not None
    assert again.verdict(again.whole) == "as stated"


def test_smooth_patches_alone_are_not_as_stated(tmp_path: Path) -> None:
    """A class whose every patch is far too noisy was set aside as rough and said nothing."""
    scanned(tmp_path / "S1.las", SHEET, 10_011, step=0.008)
    (scan,) = read_scans(tmp_path / "S1.las")
    observed = observed_noise(replace(scan, origin="stated"))
    far = observed.mean(observed.range) > np.quantile(observed.mean(observed.range), 0.7)
    worse = replace(observed, residual=observed.residual * np.where(far, 5.0, 1.0)[observed.patch])
    source = _Source("A", "the project", ("S1",), SHEET)
    found = _shown(source, worse, incidence=True)
    assert found.whole is not None
    assert found.verdict(found.whole) not in ("as stated", "undecided")
    assert found.beyond
    assert found.beyond[0].factor == pytest.approx(5.0, rel=0.15)
    assert found.every is not None
    assert found.every > 1.5
    assert not _shown(source, observed, incidence=True).beyond
