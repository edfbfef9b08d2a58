"""What a simulated scanner measures: noise, misalignments, footprints, determinism."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.stats import binom, chi2, norm

from tests.simulate.surfaces import distance_to_surface
from tribrach.errors import InputError
from tribrach.geometry.polar import polar_from_xyz, xyz_from_polar
from tribrach.geometry.pose import Pose
from tribrach.instruments.calibration import NIST
from tribrach.instruments.range_law import RangeLaw
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.simulate import scene as sc
from tribrach.simulate.falloff import FallOff
from tribrach.simulate.instruments import PHASE, PULSED
from tribrach.simulate.scanner import ScanGrid, Scanner, scan
from tribrach.simulate.setups import levelled, tilted

QUIET = ScanNoise(0, 0, 0, 0)
NOISY = ScanNoise(0.0012, 1e-5, 4e-5, 6e-5, 0.0035, 0.00025)


def room():
    return sc.Scene.of(
        [
            sc.rectangle((6, 0, 0), (-1, 0, 0), 20, 6, 0.6),
            sc.rectangle((-5, 0, 0), (1, 0, 0), 20, 6, 0.6),
            sc.rectangle((0, 7, 0), (0, -1, 0), 20, 6, 0.5),
            sc.rectangle((0, -7, 0), (0, 1, 0), 20, 6, 0.5),
            sc.ground((0, 0, -1.6), 30),
            sc.box((3, 2, -0.8), (1, 1, 1.6), 0.4, 0.3),
            sc.cylinder((-2, 3, 0), 0.2, 3, 0.3),
            sc.sphere((2, -3, 0.3), 0.2),
            sc.checkerboard((5.99, 0.5, 0.4), (-1, 0, 0), 0.5),
        ]
    )


def pose(seed=3):
    return tilted((0.2, -0.3, 0.1), 0.7, 0.2, np.random.default_rng(seed))


def all_of(blocks):
    blocks = list(blocks)
    names = ("xyz", "intensity", "row", "column", "truth", "primitive", "mixed")
    return {name: np.concatenate([getattr(b, name) for b in blocks]) for name in names}


GRID = ScanGrid.panorama((0.5, 2.3), 60_000)


def test_without_errors_points_lie_on_the_primitives():
    out = all_of(scan(room(), pose(), Scanner(QUIET, intensity=0), GRID, 1))
    world = pose() @ out["xyz"]
    assert len(world) > 35_000
    assert not out["mixed"].any()
    assert np.abs(world - out["truth"]).max() < 1e-9
    assert distance_to_surface(room(), out["primitive"], world).max() < 1e-9
    angles = GRID.angles(out["row"].astype(int), out["column"].astype(int))
    h, v = polar_from_xyz(out["xyz"])[:, 1:].T
    assert np.abs(np.exp(1j * h) - np.exp(1j * angles[:, 0])).max() < 1e-12
    assert np.abs(v - angles[:, 1]).max() < 1e-12


@pytest.mark.parametrize("faces", ["front", "dome"])
def test_calibration_undoes_misalignments(faces):
    parameters = {"x2": 3e-3, "x3": 1e-3, "x5z": 2e-4, "x6": 1e-4, "x10": 2e-3, "x1n": 1e-3}
    scanner = Scanner(QUIET, intensity=0, parameters=parameters, faces=faces)
    out = all_of(scan(room(), pose(), scanner, GRID, 1))
    polar = polar_from_xyz(out["xyz"])
    chosen = NIST.select(tuple(parameters))
    behind = (faces == "dome") & (polar[:, 1] % (2 * np.pi) >= np.pi)
    values = np.tile(list(parameters.values()), (len(polar), 1))
    delta = chosen.delta(polar, np.where(behind, -1.0, 1.0), values)
    # a beam on a border whose correction depends on which side it falls has no single answer
    off = np.abs(pose() @ xyz_from_polar(polar + delta) - out["truth"]).max(axis=1)
    assert np.quantile(off, 0.999) < 1e-9
    assert np.quantile(np.abs(pose() @ out["xyz"] - out["truth"]).max(axis=1), 0.5) > 1e-3


def test_errors_have_the_stated_sigmas():
    """Chi-square of errors along and across the beam, footprint included, at 99.9 %."""
    out = all_of(scan(room(), pose(), Scanner(NOISY), GRID, 5))
    use = ~out["mixed"]
    measured = polar_from_xyz(out["xyz"][use])
    true = polar_from_xyz(pose().inverse @ out["truth"][use])
    r, v = measured[:, 0], measured[:, 2]
    error = measured - true
    error[:, 1] = np.angle(np.exp(1j * error[:, 1])) * np.sin(v)
    place = NOISY.beam_diameter(r) / r / 4
    sigma = np.stack(
        [
            NOISY.range_sigma(r),
            np.hypot(NOISY.horizontal * np.sin(v), place),
            np.hypot(NOISY.vertical, place),
        ],
        axis=1,
    )
    n = len(r)
    for k in range(3):
        total = float(((error[:, k] / sigma[:, k]) ** 2).sum())
        # places in a footprint spread less than normal ones, so that the normal limits are wide
        assert chi2.ppf(0.0005, n) < total < chi2.ppf(0.9995, n)
    correlation = np.corrcoef((error / sigma).T) - np.eye(3)
    assert np.abs(correlation).max() < 4 / np.sqrt(n)


def test_range_noise_grows_with_the_incidence_where_asked():
    wall = sc.Scene.of([sc.rectangle((5, 0, 0), (-1, 0, 0), 40, 40, 0.5)])
    grid = ScanGrid.window((-1.2, 1.2), (1.4, 1.7), 0.002)
    level = Pose(np.eye(3), np.zeros(3))
    scanner = Scanner(ScanNoise(0.001, 0, 0, 0), incidence=True)
    out = all_of(scan(wall, level, scanner, grid, 2))
    r = np.linalg.norm(out["xyz"], axis=1)
    cosine = 5 / np.linalg.norm(out["truth"], axis=1)
    normal = (r - np.linalg.norm(out["truth"], axis=1)) * cosine / 0.001
    n = len(r)
    assert chi2.ppf(0.0005, n) < (normal**2).sum() < chi2.ppf(0.9995, n)


def test_intensity_is_reflectance_times_cosine():
    wall = sc.Scene.of([sc.rectangle((5, 0, 0), (-1, 0, 0), 40, 40, 0.5)])
    level, grid = Pose(np.eye(3), np.zeros(3)), ScanGrid.window((-1.0, 1.0), (1.3, 1.8), 0.005)
    out = all_of(scan(wall, level, Scanner(QUIET, intensity=0), grid, 2))
    cosine = out["xyz"][:, 0] / np.linalg.norm(out["xyz"], axis=1)
    assert np.abs(out["intensity"] - 0.5 * cosine).max() < 1e-6
    noisy = all_of(scan(wall, level, Scanner(QUIET, intensity=0.02), grid, 2))
    spread = (noisy["intensity"] - 0.5 * cosine) / 0.02
    assert chi2.ppf(0.0005, len(spread)) < (spread**2).sum() < chi2.ppf(0.9995, len(spread))


def test_speckle_is_a_share_of_the_light():
    clear, rough = (Scanner(QUIET, intensity=0, weakest=-1, speckle=s) for s in (0, 0.05))
    still, out = (all_of(scan(room(), pose(), s, GRID, 1)) for s in (clear, rough))
    assert np.array_equal(out["xyz"], still["xyz"])
    use = (still["intensity"] > 0.02) & (still["intensity"] < 0.75)
    share = (out["intensity"] / still["intensity"] - 1)[use]
    low, high = chi2.ppf([5e-4, 0.9995], use.sum()) / use.sum()
    assert low < np.mean(share**2) / 0.05**2 < high
    dark = still["intensity"][use] < 0.3
    assert share[dark].std() == pytest.approx(share[~dark].std(), rel=0.05)


def wall_far_away(length):
    """A wall of the reflectance 0.5 across the beam, and directions to its middle."""
    wall = sc.Scene.of([sc.rectangle((length, 0, 0), (-1, 0, 0), 60, 60, 0.5)])
    half = 0.5 / length
    grid = ScanGrid.window((-half, half), (np.pi / 2 - half, np.pi / 2 + half), half / 60)
    return wall, grid


def test_light_falls_off_with_the_range_and_close_to_the_instrument():
    fall_off, level = FallOff(blind=0.4, focus=3.0), Pose(np.eye(3), np.zeros(3))

    def of_paper(length):
        return (1 - np.exp(-(((length - 0.4) / 3.0) ** 2))) / length**2

    ranges = np.array([0.6, 1.0, 2.5, 10.0, 40.0, 80.0])
    most = minimize_scalar(lambda x: -of_paper(x), bounds=(0.5, 9.0), method="bounded").x
    assert fall_off.best == pytest.approx(most, rel=1e-4)
    assert np.allclose(fall_off.at(ranges), of_paper(ranges) / of_paper(most), rtol=1e-8)
    assert fall_off.at(np.array([0.0, 0.3, 0.4, np.inf])).tolist() == [0, 0, 0, 0]
    assert fall_off.at(ranges).argmax() == 2
    assert fall_off.at(ranges)[4] / fall_off.at(ranges)[5] == pytest.approx(4, rel=1e-6)
    scanner = Scanner(QUIET, intensity=0, weakest=0, fall_off=fall_off)
    for length in ranges[1:]:
        out = all_of(scan(wall_far_away(length)[0], level, scanner, wall_far_away(length)[1], 2))
        away = np.linalg.norm(out["xyz"], axis=1)
        light = 0.5 * (length / away) * of_paper(away) / of_paper(most)
        assert np.abs(out["intensity"] / light - 1).max() < 1e-6
    with pytest.raises(InputError, match="falls off from"):
        FallOff(-1.0, 3.0)


@pytest.mark.parametrize("over", [-1.0, 0.0, 0.5, 2.0])
def test_weak_echoes_are_lost_with_the_probability_of_the_noise(over):
    """Light over the threshold by some sigmas of the detector and of speckle together."""
    fall_off, level, length = FallOff(0.3, 6.0), Pose(np.eye(3), np.zeros(3)), 60.0
    wall, grid = wall_far_away(length)
    light = 0.5 * float(fall_off.at(np.array([length]))[0])
    detector, speckle = 0.2 * light, 0.1
    sigma = np.hypot(detector, speckle * light)
    scanner = Scanner(
        QUIET,
        intensity=detector,
        speckle=speckle,
        fall_off=fall_off,
        weakest=light - over * sigma,
    )
    out = all_of(scan(wall, level, scanner, grid, 2))
    low, high = binom.ppf([5e-4, 0.9995], len(grid), norm.cdf(over))
    assert low <= len(out["xyz"]) <= high


@pytest.mark.parametrize(("near", "far"), [(0.6, 0.1), (0.1, 0.6)])
def test_of_surfaces_far_apart_the_stronger_echo_counts(near, far):
    step = sc.Scene.of(
        [
            sc.rectangle((10, 5, 0), (-1, 0, 0), 10, 40, near),
            sc.rectangle((12, 0, 0), (-1, 0, 0), 40, 40, far),
        ]
    )
    level, noise = Pose(np.eye(3), np.zeros(3)), ScanNoise(0, 0, 0, 0, 0.02, 0.0)
    grid = ScanGrid.window((-0.002, 0.002), (np.pi / 2 - 0.02, np.pi / 2 + 0.02), 0.0001)
    told = {"intensity": 0, "weakest": 0, "lost": 0.0, "beams": 61}
    mean = all_of(scan(step, level, Scanner(noise, **told), grid, 2))
    one = all_of(scan(step, level, Scanner(noise, **told, separated="strongest"), grid, 2))
    near_enough = all_of(
        scan(step, level, Scanner(noise, **told, separated="strongest", separable=3.0), grid, 2)
    )
    assert np.array_equal(mean["xyz"], near_enough["xyz"])
    mixed = one["mixed"]
    assert np.array_equal(mixed, mean["mixed"])
    depth, between = one["xyz"][mixed, 0], mean["xyz"][mixed, 0]
    assert ((np.abs(depth - 10) < 1e-2) | (np.abs(depth - 12) < 1e-2)).all()
    assert ((between > 10.1) & (between < 11.9)).mean() > 0.7
    # six times the light in reflectance wins on the larger part of the footprints
    brighter = np.abs(depth - (10 if near > far else 12)) < 1e-2
    assert 0.7 < brighter.mean() < 0.95
    # the light is that of the part of the footprint that is measured
    assert (one["intensity"][mixed] <= mean["intensity"][mixed] + 1e-7).all()


def test_what_is_off_leaves_the_scan_as_it_is():
    bare = Scanner(NOISY, lost=0.0, weakest=-1.0)
    plain = all_of(scan(room(), pose(), bare, GRID, 5))
    off = replace(bare, speckle=0.0, separated="strongest", separable=99.0)
    again = all_of(scan(room(), pose(), off, GRID, 5))
    assert all(np.array_equal(again[name], plain[name]) for name in plain)
    # neither does light that falls off move a point that still comes back
    dark = replace(bare, fall_off=FallOff(0.3, 6.0))
    fallen = all_of(scan(room(), pose(), dark, GRID, 5))
    alone = ~(plain["mixed"] | fallen["mixed"])
    assert np.array_equal(fallen["row"], plain["row"])
    assert np.array_equal(fallen["xyz"][alone], plain["xyz"][alone])


@pytest.mark.parametrize(
    ("instrument", "granted"),
    [(PULSED, [(0.08, 120), (0.18, 180), (0.34, 270)]), (PHASE, [(0.02, 50)])],
)
def test_instruments_see_as_far_as_their_data_sheets_say(instrument, granted):
    for reflectance, length in granted:
        light = instrument.received(np.array([reflectance]), np.array([float(length)]))
        assert light[0] / instrument.weakest == pytest.approx(1.0, abs=0.2)
    # speckle and not the detector is the noise of boards, white or black, within 25 m
    black = instrument.received(np.array([0.08]), np.array([25.0]))[0]
    assert instrument.intensity < 0.3 * instrument.speckle * black


def test_edges_blur_over_the_footprint():
    """Intensity across a straight edge is the share of a disc, ranges at a jump lie between."""
    board = sc.Scene.of(
        [
            sc.checkerboard((10, 0, 0), (-1, 0, 0), 2.0),
            sc.rectangle((12, 0, 0), (-1, 0, 0), 40, 40, 0.5),
        ]
    )
    level = Pose(np.eye(3), np.zeros(3))
    scanner = Scanner(ScanNoise(0, 0, 0, 0, 0.02, 0.0), intensity=0, beams=200, lost=0.0)
    grid = ScanGrid.window((-0.12, 0.12), (np.pi / 2 - 0.052, np.pi / 2 - 0.048), 0.0002)
    out = all_of(scan(board, level, scanner, grid, 2))
    y, light = 10 * out["xyz"][:, 1] / out["xyz"][:, 0], out["intensity"].astype(float)
    near = np.abs(y) < 0.03
    u = np.clip(y[near] / 0.01, -1, 1)
    share = 0.5 + (u * np.sqrt(1 - u**2) + np.arcsin(u)) / np.pi
    cosine = out["xyz"][near, 0] / np.linalg.norm(out["xyz"][near], axis=1)
    bright, dark = light[near].max(), light[near].min()
    sign = 1 if light[near][np.argmax(y[near])] > 0.5 else -1
    expected = 0.08 + 0.77 * (share if sign > 0 else 1 - share)
    assert (round(bright, 2), round(dark, 2)) == (0.85, 0.08)
    assert np.abs(light[near] / cosine - expected).max() < 0.02
    mixed = out["mixed"]
    depth = out["xyz"][mixed, 0]
    assert mixed.sum() > 100
    assert ((depth > 9.99) & (depth < 12.01)).all()
    assert ((depth > 10.3) & (depth < 11.7)).mean() > 0.3
    at_border = np.abs(np.abs(out["truth"][mixed, 1] / out["truth"][mixed, 0] * 10) - 1.0)
    assert at_border.max() < 0.0101


def test_wide_mixed_pixels_get_lost():
    scene, level = room(), Pose(np.eye(3), np.zeros(3))
    noise = ScanNoise(0, 0, 0, 0, 0.02, 0.001)
    counts = []
    for lost in (0.0, 1.0):
        out = all_of(scan(scene, level, Scanner(noise, separable=0.1, lost=lost), GRID, 2))
        counts.append((len(out["xyz"]), int(out["mixed"].sum())))
    assert counts[0][0] > counts[1][0]
    assert counts[0][1] > counts[1][1] > 0


def test_the_same_seed_gives_the_same_scan():
    first, again, other = (
        all_of(scan(room(), pose(), Scanner(NOISY), GRID, seed)) for seed in (1, 1, 2)
    )
    assert all(np.array_equal(first[name], again[name]) for name in first)
    assert not np.array_equal(first["xyz"][:1000], other["xyz"][:1000])


def test_a_window_of_a_mask_sees_what_the_whole_sees():
    scene, grid = room(), ScanGrid.window((-0.3, 0.4), (1.2, 1.8), 0.004)
    mask = np.zeros((grid.rows, grid.columns), dtype=bool)
    mask[40:90, 60:120] = True
    scanner = Scanner(QUIET, intensity=0)
    whole = all_of(scan(scene, pose(), scanner, grid, 1))
    part = all_of(scan(scene, pose(), scanner, grid, 1, mask))
    inside = mask[whole["row"], whole["column"]]
    assert inside.sum() == len(part["xyz"]) == 50 * 60
    assert np.array_equal(whole["xyz"][inside], part["xyz"])


def test_levelled_stations_lean_by_their_sigma():
    rng, sigma = np.random.default_rng(8), 2e-5
    up = np.array([levelled((1, 2, 3), 0.3 * k, sigma, rng).rotation.T[:, 2] for k in range(2000)])
    total = float(((up[:, :2] / sigma) ** 2).sum())
    assert chi2.ppf(0.0005, 4000) < total < chi2.ppf(0.9995, 4000)
    heading = levelled((0, 0, 0), 0.4, 0.0, rng).rotation
    assert np.allclose(heading @ [1, 0, 0], [np.cos(0.4), np.sin(0.4), 0])


def test_a_law_of_the_noise_scales_the_errors_that_are_drawn_anyway():
    """Nothing else is drawn: directions, light and places stay, range errors follow the light."""
    plain = Scanner(replace(NOISY, range_scale=0.0), speckle=0.05)
    law = RangeLaw(2e-4, -0.5, 3e-4, 1e-6, 1.0)
    lawful = replace(plain, noise=replace(plain.noise, law=law))
    grid = ScanGrid.panorama((0.5, 2.3), 20_000)
    first, second = (all_of(scan(room(), pose(), s, grid, 1)) for s in (plain, lawful))
    for name in ("intensity", "row", "column", "truth", "mixed"):
        assert (first[name] == second[name]).all()
    away = np.linalg.norm(first["truth"] - pose().translation, axis=1)
    errors = (np.linalg.norm(one["xyz"], axis=1) - away for one in (first, second))
    straight, changed = (error[~first["mixed"]] for error in errors)
    # the noise of the detector is in the intensity and not in the light
    large = np.abs(straight) > 1e-4
    expected = law.sigma(first["intensity"][~first["mixed"]]) / NOISY.range
    assert np.median(changed[large] / straight[large] / expected[large]) == pytest.approx(
        1, rel=0.01
    )
    constant = replace(
        plain, noise=replace(plain.noise, law=RangeLaw(0.0, -1.0, 0.0012, 1e-6, 1.0))
    )
    third = all_of(scan(room(), pose(), constant, grid, 1))
    assert np.abs(third["xyz"] - first["xyz"]).max() < 1e-12
