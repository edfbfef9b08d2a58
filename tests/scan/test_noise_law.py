"""Laws of the noise come back from simulated scans, and rough surfaces do not leak in."""

from dataclasses import replace

import numpy as np
import pytest

from tests.scan.noisy_scenes import hall, simulated
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.instruments.range_law import RangeLaw
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.scan import noise_law
from tribrach.scan.noise_law import fit_noise, held_noise, noise_classes
from tribrach.scan.observed_noise import ObservedNoise, joined
from tribrach.simulate.instruments import PHASE, PULSED
from tribrach.simulate.scanner import ScanGrid, scan
from tribrach.units import SEC

#: one that compares phases, one that measures pulses, one whose noise grows by ten as light fades
LAWS = {
    "phase": (PHASE, RangeLaw(3e-5, -0.6, 2e-4, 1e-5, 1.0)),
    "pulsed": (PULSED, RangeLaw(2.5e-4, -0.4, 1.5e-3, 1e-5, 1.0)),
    "steep": (PULSED, RangeLaw(2e-5, -1.0, 5e-4, 1e-5, 1.0)),
}


def lawful(name):
    """A scanner with a law of the noise, and the law."""
    scanner, law = LAWS[name]
    return replace(scanner, noise=replace(scanner.noise, law=law)), law


def made(seed=1, patches=600, law=None, sigma=0.002, light=(0.02, 0.8), across=0.0):
    """Patches drawn by the very model: normal residuals that lost three of 30 dimensions."""
    rng = np.random.default_rng(seed)
    count, patch = 30, np.repeat(np.arange(patches), 30)
    intensity = np.exp(rng.uniform(*np.log(light), patches))
    length, slant = rng.uniform(3, 40, patches), np.arccos(rng.uniform(0.35, 1, patches))
    slope = np.tan(slant)[:, None] * _unit(rng.uniform(0, 2 * np.pi, patches))
    along = np.full(patches, sigma) if law is None else law.sigma(intensity)
    whole = np.sqrt(along**2 + (np.tan(slant) * length * across) ** 2)
    errors = rng.standard_normal((patches, count))
    table = np.column_stack([np.ones(count), rng.normal(size=(count, 2))])
    keep = np.eye(count) - table @ np.linalg.pinv(table)
    return ObservedNoise(
        residual=(whole[:, None] * (errors @ keep)).ravel(),
        redundancy=np.tile(np.diag(keep), patches),
        intensity=intensity[patch],
        range=length[patch],
        cosine=np.cos(slant)[patch],
        slope=slope[patch],
        patch=patch,
        row=np.tile(np.arange(count), patches),
        column=patch,
        pitch=np.full((patches, 2), 1e-3),
    )


def _unit(angle):
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


@pytest.mark.parametrize("name", LAWS)
def test_a_law_comes_back_from_a_scan_with_clutter(name):
    """A hall with leaves, pillars and spheres, speckle and mixed pixels: sigma within 5 %."""
    scanner, law = lawful(name)
    observed = simulated(scanner, 21, points=120_000)
    found = fit_noise(observed)
    light = np.quantile(found.smooth.intensity, np.linspace(0.01, 0.99, 9))
    assert found.law.sigma(light) == pytest.approx(law.sigma(light), rel=0.05)
    # the place across the beam: footprint at the exit, angles with the divergence
    beam, noise = scanner.noise.beam, scanner.noise
    assert found.place == pytest.approx(beam.exit / 4, abs=max(0.05e-3, 4 * found.place_sigma))
    across = np.hypot(noise.horizontal, beam.divergence / 4)
    bounds = np.maximum(0.1 * across, 4 * found.angle_sigmas)
    assert (np.abs(np.array([found.horizontal, found.vertical]) - across) < bounds).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", LAWS)
def test_three_laws_come_back_within_five_percent(name):
    """Six halls for each law, two scans of each: sigma and figures, with what their sigmas say."""
    scanner, law = lawful(name)
    ratios, figures, scores = [], [], []
    for seed in range(100, 106):
        found = fit_noise(joined([simulated(scanner, seed), simulated(scanner, seed + 50)]))
        light = np.quantile(found.smooth.intensity, np.linspace(0.01, 0.99, 21))
        ratios.append(found.law.sigma(light) / law.sigma(light))
        figures.append([found.law.a / law.a, found.law.b / law.b, found.law.c / law.c])
        scores.append((np.array(ratios[-1]) - 1) * law.sigma(light) / found.law_sigma(light))
        smooth = found.smooth
        for one in noise_classes(smooth, smooth.stated(found.noise()), "intensity"):
            assert 0.9 < one.chi2_dof < 1.1
    worst = np.abs(np.array(ratios) - 1).max()
    print(f"{name}: sigma worst {worst:.2%}, figures {np.round(figures, 3).tolist()}")
    print(f"RMS of errors over stated sigmas {np.sqrt(np.mean(np.square(scores))):.2f}")
    assert worst < 0.05
    assert np.abs(np.mean(figures, axis=0) - 1).max() < 0.05


def errors_by_class(name, seed, points):
    """Mean squares of range errors over the law's sigmas in eight classes of intensity.

    The law is from one hall and the points from another, all that are no mixed pixels, weaker than
    any patch or not; their errors are known.
    """
    scanner, _ = lawful(name)
    law = fit_noise(simulated(scanner, seed, points)).law
    pose, grid = Pose(np.eye(3), np.zeros(3)), ScanGrid.panorama((0.4, 2.5), points)
    parts = list(scan(hall(seed + 1000), pose, scanner, grid, seed + 1))
    xyz, truth, light, mixed = (
        np.concatenate([getattr(part, key) for part in parts])
        for key in ("xyz", "truth", "intensity", "mixed")
    )
    error = (np.linalg.norm(xyz, axis=1) - np.linalg.norm(truth, axis=1))[~mixed]
    light = light[~mixed]
    ends = np.quantile(light, np.linspace(0, 1, 9))[1:-1]
    number = np.searchsorted(ends, light)
    square = (error / law.sigma(light)) ** 2
    return np.bincount(number, square) / np.bincount(number)


def test_points_of_another_scan_are_as_noisy_as_the_law_says():
    assert np.abs(errors_by_class("steep", 41, 120_000) - 1).max() < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("name", LAWS)
def test_points_of_other_scans_are_as_noisy_as_the_laws_say(name):
    """Three pairs of halls for each law, eight classes of intensity."""
    found = np.array([errors_by_class(name, seed, 300_000) for seed in (200, 201, 202)])
    print(f"{name}: chi2/dof by class {found.round(3).tolist()}")
    assert np.abs(found - 1).max() < 0.1


def test_errors_are_as_large_as_their_covariance_says():
    """Forty draws of the very model: errors of sigma, of the angles, over what is stated."""
    law = RangeLaw(4e-5, -0.7, 5e-4, 1e-5, 1.0)
    light = np.array([0.03, 0.1, 0.5])
    scores, angles = [], []
    for seed in range(40):
        found = fit_noise(made(seed, 1500, law, across=20 * SEC))
        scores.append((found.law.sigma(light) - law.sigma(light)) / found.law_sigma(light))
        off = np.array([found.horizontal, found.vertical]) - 20 * SEC
        angles.append(off / found.angle_sigmas)
    # the RMS of forty normal variables is 1 +- 0.11
    assert (np.abs(np.sqrt(np.mean(np.square(scores), axis=0)) - 1) < 0.4).all()
    assert np.abs(np.sqrt(np.mean(np.square(angles), axis=0)) - 1).max() < 0.4


def test_rough_surfaces_are_set_aside():
    """Two patches of five are rough by twice to six times the noise: sigma stays within 3 %."""
    law = RangeLaw(4e-5, -0.7, 5e-4, 1e-5, 1.0)
    observed = made(5, 2000, law)
    rng = np.random.default_rng(6)
    rough = np.where(rng.random(2000) < 0.4, rng.uniform(2.0, 6.0, 2000), 1.0)
    residual = observed.residual * rough[observed.patch]
    found = fit_noise(replace(observed, residual=residual))
    light = np.array([0.03, 0.1, 0.3, 0.7])
    assert found.law.sigma(light) == pytest.approx(law.sigma(light), rel=0.03)
    assert not found.kept[rough > 2.5].any()
    assert found.kept[rough == 1].mean() > 0.98


def test_without_intensity_the_law_is_one_of_the_range():
    observed = made(7, 2000)
    length = observed.range
    residual = observed.residual * (0.001 + 50e-6 * length) / 0.002 / observed.cosine
    nothing = np.full(len(observed), np.nan)
    found = fit_noise(replace(observed, residual=residual, intensity=nothing))
    assert found.law is None
    assert "no intensities" in found.why
    assert found.range == pytest.approx(0.001, rel=0.06)
    assert found.range_scale == pytest.approx(50e-6, rel=0.06)
    assert found.noise().law is None


def test_intensity_without_effect_is_no_law():
    found = fit_noise(made(8, 800))
    assert found.law is None
    assert "does not change" in found.why
    zero = made(8, 800)
    found = fit_noise(replace(zero, intensity=zero.intensity - 0.1))
    assert "below zero" in found.why


def test_decibels_stretched_over_16_bits_have_a_law_too():
    """40 decibels over 65535 steps: a power describes the noise within 3 % of the variance."""
    law = RangeLaw(2e-5, -1.0, 5e-4, 1e-5, 1.0)
    observed = made(11, 4000, law)
    stretched = 65535 * (10 * np.log10(observed.intensity) + 40) / 40
    found = fit_noise(replace(observed, intensity=stretched))
    light = np.array([0.03, 0.08, 0.2, 0.6])
    there = 65535 * (10 * np.log10(light) + 40) / 40
    assert found.law.sigma(there) == pytest.approx(law.sigma(light), rel=0.04)
    smooth = found.smooth
    for one in noise_classes(smooth, smooth.stated(found.noise()), "intensity"):
        assert 0.93 < one.chi2_dof < 1.07


def test_what_range_and_incidence_still_do_is_measured():
    law = RangeLaw(4e-5, -0.7, 5e-4, 1e-5, 1.0)
    observed = made(9, 3000, law)
    found = fit_noise(observed)
    assert abs(found.by_range.t) < 4
    assert abs(found.by_incidence.t) < 4
    # 10 % more noise at twice the range
    grown = observed.residual * (observed.range / 10) ** np.log2(1.1)
    found = fit_noise(replace(observed, residual=grown))
    # the noise of angles takes a part of it
    assert 0.05 < found.by_range.change < 0.12
    assert found.by_range.t > 5


def test_classes_hold_what_is_stated():
    law = RangeLaw(4e-5, -0.7, 5e-4, 1e-5, 1.0)
    observed = made(10, 2000, law)
    noise = ScanNoise(0.002, 0, 0, 0, law=law)
    for by in ("intensity", "range", "incidence"):
        classes = noise_classes(observed, observed.stated(noise), by)
        assert sum(one.patches for one in classes) == 2000
        assert sum(one.points for one in classes) == len(observed)
        assert all(0.9 < one.chi2_dof < 1.1 for one in classes)
        assert all(one.observed == pytest.approx(one.stated, rel=0.1) for one in classes)
    double = noise_classes(observed, 4 * observed.stated(noise), "range")
    assert all(0.22 < one.chi2_dof < 0.28 for one in double)
    nothing = replace(observed, intensity=np.full(len(observed), np.nan))
    assert noise_classes(nothing, nothing.stated(noise), "intensity") == []


def test_the_factor_is_observed_over_stated_in_the_same_weights():
    """Every other patch is stated three times as noisy: plain means would have another ratio."""
    observed = made(10, 2000, RangeLaw(4e-5, -0.7, 5e-4, 1e-5, 1.0))
    stated = observed.stated(ScanNoise(0.002, 0, 0, 0)) * np.where(observed.patch % 2, 9.0, 1.0)
    (one,) = noise_classes(observed, stated, "range", 1)
    weights = observed.redundancy / stated
    assert one.weighted == pytest.approx(np.sqrt(observed.redundancy.sum() / weights.sum()))
    squares = (observed.residual**2 / stated).sum() / weights.sum()
    assert one.weighted_observed == pytest.approx(np.sqrt(squares))
    assert one.weighted_observed / one.weighted == pytest.approx(one.factor, rel=1e-12)
    # plain means of squares have another ratio: they follow the points of large sigmas
    assert abs(one.observed / one.stated / one.factor - 1) > 0.1


def test_a_footprint_of_the_sheet_is_no_noise_of_angles():
    scanner, _ = lawful("pulsed")
    found = fit_noise(simulated(scanner, 22, points=100_000, leaves=50))
    held = held_noise(found, scanner.noise.beam)
    assert held.cost - found.cost < 5  # the footprint is not contradicted
    noise = held.noise()
    assert noise.beam == scanner.noise.beam
    assert noise.horizontal == pytest.approx(8 * SEC, abs=5 * SEC)
    light = np.geomspace(0.01, 0.5, 5)
    assert noise.law.sigma(light) == pytest.approx(found.law.sigma(light), rel=0.02)


@pytest.mark.parametrize("start", [(0.5, -0.4, 0.3), (0.0, -0.5, 0.9), (0.0, -2.5, 1.2)])
def test_the_search_leaves_a_law_without_intensity(start):
    # a step may end where the factor is zero and its exponent tells nothing
    _, law = lawful("pulsed")
    patches = noise_law._Patches.of(made(4, 600, law))
    model = noise_law._of_intensity(patches.scale, 1.0, -0.4)
    all_of_them = np.ones(600, dtype=bool)
    best = noise_law._solve(patches, model, all_of_them, patches.scale)
    other = noise_law._solve(
        patches, replace(model, start=np.array(start)), all_of_them, patches.scale
    )
    assert best.parameters[0] > 0
    assert other.cost == pytest.approx(best.cost, abs=1e-3)


def test_too_few_patches_tell_nothing():
    with pytest.raises(InputError, match="12 planar patches, too few"):
        fit_noise(made(1, 12))


#: noise of ranges [m] by intensity, range [m] and cosine of the incidence
FORMS = {
    "power": lambda light, length, cosine: 4e-5 * light**-0.7 + 5e-4,
    "hump": lambda light, length, cosine: (
        1e-3 + 3e-3 * np.exp(-((np.log(light / 0.1) / 0.35) ** 2))
    ),
    "break": lambda light, length, cosine: np.where(length < 15, 1e-3, 4e-3),
    "bright": lambda light, length, cosine: 1e-3 + 1e-2 * np.maximum(light - 0.4, 0.0),
    "slanted": lambda light, length, cosine: 1e-3 / cosine**2,
    "none": lambda light, length, cosine: np.full(len(light), 1e-3),
}


def formed(name, seed, patches=3000):
    """Patches with noise of a form, every fifth of them rough; true sigmas of the points."""
    observed, rng = made(seed, patches), np.random.default_rng(seed + 1000)
    true = FORMS[name](observed.intensity, observed.range, observed.cosine)
    rough = np.where(rng.random(patches) < 0.2, rng.uniform(2.0, 6.0, patches), 1.0)
    return replace(
        observed, residual=observed.residual / 0.002 * true * rough[observed.patch]
    ), true


@pytest.mark.parametrize("name", FORMS)
def test_a_law_of_any_form_is_right_in_every_class_or_refused(name):
    recovered = {"power", "hump", "bright", "none"}
    for seed in (31, 32, 33):
        observed, true = formed(name, seed)
        found = fit_noise(observed)
        stated = np.sqrt(observed.stated(found.noise()))
        if found.contradicted:
            worst = found.contradicted[0]
            assert worst.by == {"break": "range", "slanted": "incidence"}[name]
            continue
        assert name in recovered
        light = observed.mean(observed.intensity)
        share = np.log(observed.mean(stated / true))
        parts = np.array_split(share[np.argsort(light)], 16)
        assert max(abs(np.mean(part)) for part in parts) < np.log(1.1)
        assert (found.law is not None and bool(found.law.knots)) == (name in ("hump", "bright"))


def test_patches_are_not_called_rough_where_no_intensity_tells():
    """A law of the intensity without intensities: most patches have more than the smoothest."""
    observed, _ = formed("power", 34)
    assert fit_noise(observed).noisier == 0
    blind = replace(observed, intensity=np.full(len(observed), np.nan))
    assert fit_noise(blind).noisier > 1.2
    plain = made(35, 2000)
    assert fit_noise(replace(plain, intensity=np.full(len(plain), np.nan))).noisier == 0


def test_laws_that_hold_are_not_contradicted():
    """Twenty draws of three forms, a fifth of the patches rough: all limits hold at 95 %."""
    for name in ("power", "none"):
        assert sum(bool(fit_noise(formed(name, 50 + k)[0]).contradicted) for k in range(10)) <= 1


def test_the_incidence_is_estimated_where_no_intensity_tells():
    observed = replace(made(41, 3000), intensity=np.full(3000 * 30, np.nan))
    found = fit_noise(observed)
    assert found.incidence == pytest.approx(0.0, abs=0.1)
    assert found.range == pytest.approx(0.002, rel=0.03)
    slanted = fit_noise(replace(observed, residual=observed.residual / observed.cosine))
    assert slanted.incidence == 1
    assert slanted.noise().range_sigma(np.array([9.0]), 0.5) == pytest.approx(0.004, rel=0.05)


def test_zeros_in_the_intensities_do_not_lose_the_law():
    law = RangeLaw(4e-5, -0.7, 5e-4, 1e-5, 1.0)
    observed = made(42, 2000, law)
    zero = np.where(observed.patch % 10 == 0, 0.0, observed.intensity)
    found = fit_noise(replace(observed, intensity=zero))
    light = np.array([0.03, 0.1, 0.5])
    assert found.law.sigma(light) == pytest.approx(law.sigma(light), rel=0.05)
    most = np.where(observed.patch % 10 < 6, 0.0, observed.intensity)
    assert "zero" in fit_noise(replace(observed, intensity=most)).why
