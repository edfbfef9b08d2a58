"""Errors of centring that sights share: sigmas against errors of many surveys of one site."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from tribrach.geodesy.site import FlatSite
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.instruments.precision import Precision
from tribrach.io.survey.csv.file import read_table
from tribrach.io.survey.csv.reader import Context
from tribrach.io.survey.csv.tables import survey_of
from tribrach.network.adjustment import adjust
from tribrach.network.blunders.snooping import snoop
from tribrach.network.occupations import by_sight
from tribrach.network.quality import assess
from tribrach.observations.control import Centrings
from tribrach.simulate.surveying import EARTH, eccentricities, refraction, sights, true_sights
from tribrach.units import SEC

FINE = Precision(
    direction=1 * SEC, zenith=1 * SEC, distance=1e-3, scale=1e-6, centring=1e-3, height=1e-3
)
RUNS = 300


def around(count):
    """A mark with targets around it, 40 to 120 m away, and sights to them."""
    azimuth = 2 * np.pi * np.arange(count) / count + 0.3
    length = np.linspace(40, 120, count)
    xyz = np.stack([length * np.sin(azimuth), length * np.cos(azimuth), 0.1 * length], axis=1)
    places = {"S": np.zeros(3)} | {f"T{k}": x for k, x in enumerate(xyz)}
    return places, [("S", f"T{k}") for k in range(count)], [f"T{k}" for k in range(count)]


def traverse():
    """Four marks between two pairs of control points, seen from both of their neighbours."""
    xyz = [(-80, 60, 2), (0, 0, 0), (70, 25, 3), (130, -15, 5), (210, 10, 4), (270, 70, 8)]
    places = {f"P{k}": np.array(x, dtype=float) for k, x in enumerate(xyz)}
    lines = [(f"P{k}", f"P{j}") for k in range(1, 5) for j in (k - 1, k + 1)]
    return places, lines, ["P0", "P1", "P4", "P5"]


def network_of(tmp_path, places, lines, control, precision):
    """What the table of sights becomes, with held control."""
    path = tmp_path / "sights.csv"
    path.write_text(sights(places, lines, {}, {}, precision, np.random.default_rng(1)))
    context = Context(precision=precision, frame=WorkFrame(FlatSite(EARTH)))
    survey = survey_of(read_table(path), context)
    for name, x in places.items():
        held = (name not in control,) * 3
        survey.point(name, x, free=held, role="free" if held[0] else "control")
    return survey.network()


def surveyed(network, places, lines, precision, rng):
    """The network with the readings of another day: set up, centred and read anew."""
    eccentric = eccentricities(lines, precision, rng)
    true = true_sights(places, lines, {}, {}, refraction(lines, precision, rng), eccentric)
    turn = {start: rng.uniform(0, 2 * np.pi) for start, _ in lines}
    own = (
        np.full(len(lines), precision.direction),
        np.full(len(lines), precision.zenith),
        precision.distance + precision.scale * true[2],
    )
    read = dict(zip(("direction", "zenith", "slope_distance"), true, strict=True))
    read["direction"] = read["direction"] - [turn[start] for start, _ in lines]
    tables = []
    for o in network.observations:
        if o.kind in read:
            k = tuple(read).index(o.kind)
            values = read[o.kind] + own[k] * rng.normal(size=len(lines))
            o = replace(o, values=values[:, None])
        tables.append(o)
    return replace(network, observations=tuple(tables))


def errors(tmp_path, site, precision, runs=RUNS, seed=3):
    """Errors (runs, 3k) of the free points, their covariance, and mean of vtpv over redundancy."""
    places, lines, control = site
    network = network_of(tmp_path, places, lines, control, precision)
    free = [name for name in places if name not in control]
    rng = np.random.default_rng(seed)
    off, square = [], []
    for _ in range(runs):
        adjustment = adjust(surveyed(network, places, lines, precision, rng))
        off.append(np.concatenate([adjustment.points[n].xyz - places[n] for n in free]))
        square.append(adjustment.vtpv / adjustment.dof)
    columns = np.concatenate([adjustment.columns(n) for n in free])
    return np.array(off), adjustment.covariance_columns(columns, columns), np.mean(square)


@pytest.mark.parametrize("count", [4, pytest.param(8, marks=pytest.mark.slow), 16])
def test_a_mark_is_never_better_than_its_centring(tmp_path, count):
    off, covariance, square = errors(tmp_path, around(count), FINE)
    stated = np.sqrt(np.diag(covariance))
    ratio = stated / np.sqrt((off**2).mean(axis=0))
    assert (stated > 1e-3).all()
    # 300 runs: the root of a mean square scatters by 4 %
    np.testing.assert_allclose(ratio, 1, atol=0.12)
    assert square == pytest.approx(1, abs=0.08)


@pytest.mark.parametrize("per", ["setup", "mark", "sight"])
def test_traverses_on_tripods_and_by_forced_centring(tmp_path, per):
    precision = replace(FINE, centring_per=per)
    off, covariance, square = errors(tmp_path, traverse(), precision)
    whole = np.einsum("ni,ij,nj->n", off, np.linalg.inv(covariance), off)
    n = off.size
    assert chi2.ppf(0.001, n) < whole.sum() < chi2.ppf(0.999, n)
    assert square == pytest.approx(1, abs=0.1)


def test_one_tripod_over_a_mark_is_one_error(tmp_path):
    places, lines, control = traverse()
    sigma = {}
    for per in ("mark", "sight"):
        precision = replace(FINE, centring_per=per)
        network = network_of(tmp_path, places, lines, control, precision)
        sigma[per] = adjust(network).points["P2"].sigma[:2]
    assert (sigma["mark"] > 1e-3).all()
    assert (sigma["sight"] < sigma["mark"]).all()


def test_one_sight_of_an_end_needs_no_vector(tmp_path):
    places, lines, control = around(6)
    network = network_of(tmp_path, places, lines, control, FINE)
    assert network.start.layout.names["vector"] == ("centring at S (sights.csv)",)
    bare = network_of(tmp_path, places, lines, control, replace(FINE, centring=0.0, height=0.0))
    assert not bare.start.layout.names["vector"]
    assert adjust(bare).dof == adjust(network).dof


def test_an_instrument_beside_its_mark_is_named(tmp_path):
    places, lines, control = around(8)
    held = [*control, "S"]
    network = network_of(tmp_path, places, lines, held, FINE)
    places = places | {"S": np.array([0.025, 0.0, 0.0])}
    read = surveyed(network, places, lines, FINE, np.random.default_rng(5))
    cleaned, log = snoop(read)
    table = next(k for k, o in enumerate(read.observations) if isinstance(o, Centrings))
    assert log.removed == ((table, 0),)
    assert cleaned.network.observations[table].use[0] != 0
    assert assess(cleaned).global_test.passed


def test_other_programs_get_the_sigmas_of_single_sights(tmp_path):
    places, lines, control = around(6)
    shared = by_sight(network_of(tmp_path, places, lines, control, FINE))
    single = network_of(tmp_path, places, lines, control, replace(FINE, centring_per="sight"))
    assert {o.kind for o in shared.observations} == {o.kind for o in single.observations}
    for one, other in zip(shared.observations, single.observations, strict=True):
        # the levels of sigmas that know nothing of steep sights
        np.testing.assert_allclose(one.sigma, other.sigma, rtol=0.02)
    assert adjust(shared).dof == adjust(single).dof


@pytest.mark.parametrize("length", [300.0, 500.0, 800.0])
def test_air_that_long_sights_share_is_in_the_height(tmp_path, length):
    places, lines, control = around(4)
    places = {n: x * length / np.hypot(*x[:2]) if x.any() else x for n, x in places.items()}
    calm = Precision(direction=1 * SEC, zenith=0.7 * SEC, distance=1e-3, scale=1e-6)
    site = places, lines, control
    off, covariance, square = errors(tmp_path, site, replace(calm, refraction_sigma=0.1))
    ratio = np.sqrt(covariance[2, 2] / (off[:, 2] ** 2).mean())
    # 300 runs: the root of a mean square scatters by 4 %
    assert ratio == pytest.approx(1, abs=0.12)
    assert square == pytest.approx(1, abs=0.15)
    without = errors(tmp_path, site, calm, runs=1)[1]
    assert covariance[2, 2] > 2 * without[2, 2]


def test_short_sights_leave_refraction_alone(tmp_path):
    places, lines, control = around(4)
    bent = replace(FINE, refraction_sigma=0.1)
    assert not [
        o.kind
        for o in network_of(tmp_path, places, lines, control, bent).observations
        if o.kind == "refraction_change"
    ]
