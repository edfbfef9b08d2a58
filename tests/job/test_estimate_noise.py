"""What an instrument file states across the beam: what scans determine, else what was stated."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.instruments.beam import Beam
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.scans.formats import read_scans
from tribrach.project.instrument import Instrument
from tribrach.project.instrument_file import instrument_file_text
from tribrach.questions.noise.chapters import findings_of
from tribrach.questions.noise.estimate import (
    NoiseEstimate,
    ScanPatches,
    _stated_across,
    estimate_noise,
)
from tribrach.report.findings import Finding
from tribrach.scan.noise_law import fit_noise
from tribrach.scan.observed_noise import ObservedNoise
from tribrach.scan.prepared import seen_from
from tribrach.units import SEC

TRUTH = ScanNoise(0.002, 10e-6, 8 * SEC, 8 * SEC, 0.0035, 0.23e-3)
DOUBLE = replace(TRUTH, beam_exit=0.009, beam_divergence=0.6e-3)


def ground(seed: int, noise: ScanNoise = TRUTH, patches: int = 3000) -> ObservedNoise:
    """Ground at 3 to 6 m under 47 to 72 degrees and a few patches seen straight.

    1/cos and tan of the incidence differ little there, so that ranges and angles hardly part.
    """
    rng = np.random.default_rng(seed)
    count, patch = 27, np.repeat(np.arange(patches), 27)
    slant = np.radians(rng.uniform(47, 72, patches))
    slant[:20] = np.radians(rng.uniform(2, 20, 20))
    turn = rng.uniform(0, 2 * np.pi, patches)
    slope = np.tan(slant)[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    empty = ObservedNoise(
        residual=np.zeros(patches * count),
        redundancy=np.full(patches * count, 1 - 3 / count),
        intensity=np.full(patches * count, np.nan),
        range=rng.uniform(3, 6, patches)[patch],
        cosine=np.cos(slant)[patch],
        slope=slope[patch],
        patch=patch,
        row=np.tile(np.arange(count), patches),
        column=patch,
        pitch=np.full((patches, 2), 1e-3),
    )
    table = np.column_stack([np.ones(count), rng.normal(size=(count, 2))])
    keep = np.eye(count) - table @ np.linalg.pinv(table)
    errors = (rng.standard_normal((patches, count)) @ keep).ravel()
    return replace(
        empty,
        residual=np.sqrt(empty.stated(noise)) * errors,
        redundancy=np.tile(np.diag(keep), patches),
    )


def estimated(seed: int, stated: ScanNoise | None, noise: ScanNoise = TRUTH) -> NoiseEstimate:
    """An estimate from such ground."""
    fitted = fit_noise(ground(seed, noise))
    scan = ScanPatches("S1.laz", 3000, 81_000, 3000, 0, 0, True, 0.0, "a scale")
    across = None if stated is None else _stated_across(fitted, stated)
    by = "" if stated is None else "the project for scanner"
    return NoiseEstimate((scan,), fitted, None, stated, by, (), across)


def found(estimate: NoiseEstimate) -> dict[str, Finding]:
    """What is said of an estimate, by key."""
    return {one.key: one for one in findings_of(estimate)}


def written(estimate: NoiseEstimate) -> ScanNoise | None:
    """The noise of the instrument file."""
    text = instrument_file_text(estimate.instrument | estimate.carried(), estimate.source)
    return Instrument.model_validate(tomllib.loads(text)["instrument"]).noise()


def test_what_is_not_determined_is_left_out_and_said() -> None:
    estimate = estimated(10_001, None)
    assert not estimate.across_known
    assert set(estimate.instrument) == {"range_mm", "range_ppm"}
    assert written(estimate) is None
    assert found(estimate)["left_out"].warns


def test_a_file_beside_what_is_stated_is_whole_and_as_good() -> None:
    """Variances of points at 3 to 30 m under 0 to 70 degrees, over the true ones."""
    estimate = estimated(10_001, TRUTH)
    found = written(estimate)
    assert found is not None
    assert found.beam == TRUTH.beam
    rho, slant = (g.ravel() for g in np.meshgrid([3.0, 6.0, 15.0, 30.0], np.radians([0, 40, 70])))
    sigmas = []
    for noise in (found, TRUTH):
        across = (np.tan(slant) * rho) ** 2 * (noise.beam_angle(rho) ** 2 + noise.horizontal**2)
        sigmas.append(np.sqrt(noise.range_sigma(rho, np.cos(slant)) ** 2 + across))
        sigmas.append(rho * np.hypot(noise.beam_angle(rho), noise.horizontal))
    assert sigmas[0] == pytest.approx(sigmas[2], rel=0.1)
    assert sigmas[1] == pytest.approx(sigmas[3], rel=0.1)


def test_a_cone_and_an_accuracy_are_carried_over() -> None:
    stated = replace(TRUTH, beam_exit=0.002, systematic=6 * SEC, beam_cone=True)
    estimate = estimated(10_002, stated, replace(stated, systematic=0.0))
    found = written(estimate)
    assert found is not None
    assert found.beam == stated.beam
    if "scan_angle_arcsec" in estimate.carried():
        assert found.systematic == pytest.approx(6 * SEC, rel=1e-4)


def test_the_true_footprint_is_not_accused() -> None:
    """Thirty draws: one in a thousand may be beyond the limit; twice the footprint always is."""
    tests = [estimated(10_100 + k, TRUTH).across for k in range(30)]
    assert sum(one.contradicted for one in tests if one is not None) == 0
    innocent = estimated(10_100, TRUTH)
    assert not found(innocent)["footprint"].warns
    guilty = estimated(10_100, DOUBLE)
    assert found(guilty)["footprint"].warns
    # what is stated stays, as the scans do not tell what to put in its place
    kept = written(guilty)
    assert kept is not None
    assert kept.beam.diameter(np.array([5.0])) == pytest.approx(
        Beam(0.009, 0.6e-3).diameter(np.array([5.0]))
    )
    assert "beam_exit_mm" in guilty.carried()


def test_only_what_is_to_be_done_or_doubted_has_a_mark() -> None:
    told = found(estimated(10_001, TRUTH))
    assert "range" in told
    assert not [one for one in told.values() if one.warns]
    less = found(estimated(10_001, replace(TRUTH, range=0.004)))["beside_stated"]
    assert less.warns
    assert less.words.values["ratio"].values["factor"] < 1 / 1.15


def test_the_cause_of_too_few_patches_comes_first(tmp_path: Path) -> None:
    path = tmp_path / "slope.xyz"
    rng = np.random.default_rng(1)
    np.savetxt(path, rng.uniform(20, 30, (2000, 3)), fmt="%.4f")
    (one,) = read_scans(path)
    lost = replace(one, origin="unknown")
    with pytest.raises(InputError, match=r"^it is not known where the scanner stood") as caught:
        estimate_noise([lost])
    assert "--origin X Y Z" in caught.value.cure
    with pytest.raises(InputError) as caught:
        estimate_noise([seen_from(lost, (0.0, 0.0, 0.0))])
    assert "whether --origin is where the scanner stood" in caught.value.cure
