"""Self-calibration against the truth of simulated networks: unbiased, honest, what it detects."""

import numpy as np
import pytest
from scipy.stats import chi2

from tests.network.lab import STATIONS, TRUTH, lab, measured, misaligned
from tribrach.calibration.calibrated import StationModel, calibrate_survey
from tribrach.calibration.datum_effects import datum_effects
from tribrach.calibration.estimability import propose
from tribrach.calibration.remedies import Addition, enlarged, remedies
from tribrach.calibration.self_calibration import CalibrationOptions, calibrate, without
from tribrach.errors import InputError, RankDefect
from tribrach.instruments.calibration import HIGH_END, NIST, PAPER_EIGHT, PAPER_EIGHT_ELEVATION
from tribrach.network.adjustment import adjust
from tribrach.network.network import Datum, Network
from tribrach.network.start.start_values import find_start
from tribrach.network.survey import Survey
from tribrach.observations.scanner import TargetCentres
from tribrach.simulate.twins.newcastle_lab import MISALIGNMENTS
from tribrach.units import SEC

PHYSICAL = ("x10", "x2", "x3", "x4", "x6")


def standardised(network: Network, truth: dict[str, float], seeds: int) -> np.ndarray:
    """Errors over stated sigmas (seeds, k) of all parameters."""
    out = []
    for seed in range(seeds):
        a = adjust(measured(network, truth, seed))
        names = a.layout.names["scalar"]
        columns = np.concatenate([a.columns(name) for name in names])
        sigma = np.sqrt(np.diag(a.covariance_columns(columns, columns)))
        true = np.array([truth[name.split("(")[0]] for name in names])
        out.append((a.state.scalars - true) / sigma)
    return np.array(out)


def check(z: np.ndarray, pooled: float, coverage: float) -> None:
    """Unbiased, sample spread as stated within its own chi-square bounds, coverage."""
    seeds, k = z.shape
    assert np.abs(z.mean(axis=0)).max() * np.sqrt(seeds) < 4.0
    low, high = chi2.ppf([0.0005 / k, 1 - 0.0005 / k], seeds) / seeds
    spread = (z**2).mean(axis=0)
    assert ((spread > low) & (spread < high)).all(), spread
    assert np.sqrt(spread.mean()) == pytest.approx(1.0, abs=pooled)
    assert (np.abs(z) < 1.96).mean() == pytest.approx(0.95, abs=coverage)


@pytest.mark.slow
@pytest.mark.parametrize("ceiling", [True, False])
def test_full_model_is_unbiased_with_the_stated_sigmas(ceiling: bool) -> None:
    """200 seeds of the 16 estimable parameters, two faces, with and without ceiling targets."""
    check(standardised(lab(tuple(TRUTH), ceiling=ceiling), TRUTH, 200), pooled=0.05, coverage=0.02)


def test_physical_set_is_unbiased_with_the_stated_sigmas() -> None:
    """The thin version: 24 seeds of five parameters."""
    z = standardised(lab(PHYSICAL), dict(MISALIGNMENTS), 24)
    check(z, pooled=0.25, coverage=0.08)


def sigmas(network: Network) -> dict[str, float]:
    found = propose(network, network.start, network.start.layout.names["scalar"])
    return {n.split("(")[0]: float(s) for n, s in zip(found.names, found.sigma, strict=True)}


def room_targets() -> np.ndarray:
    """60 targets on the walls, floor and ceiling of 10 x 8 x 5.5 m."""
    rng = np.random.default_rng(16)
    x = rng.uniform([-5, -4, -1.7], [5, 4, 3.8], (60, 3))
    side, high = np.arange(60) % 3, np.arange(60) // 3 % 2
    bounds = np.array([[-5, -4, -1.7], [5, 4, 3.8]])
    x[np.arange(60), side] = bounds[high, side]
    return x


def room(faces: tuple[float, ...], parameters: tuple[str, ...], count: int = 2) -> Network:
    """The room of method table 4.2: r 0.4 mm, angles 3 arc seconds."""
    places = [(-1.5, -0.8, 0.0), (1.8, 1.2, 0.1), (-0.5, 1.9, -0.1), (1.1, -1.7, 0.05)]
    stations = {
        f"S{j}": (np.array(places[j]), np.array([0.01, -0.02, 1.3 * j])) for j in range(count)
    }
    return lab(
        parameters,
        faces=faces,
        sigma=(0.0004, 3 * SEC),
        stations=stations,
        targets=room_targets(),
    )


def test_table_of_what_is_estimable_when() -> None:
    """Sigmas of method table 4.2 within a factor of three: its room, other targets and stations."""
    everything = tuple(p for p in NIST.parameters if p not in ("x5n", "x5z"))
    table = {
        ((1.0,), 2): {"x10": 0.62e-3, "x2": 0.63e-3, "x3": 0.70e-3, "x4": 69 * SEC, "x6": 21 * SEC},
        ((1.0, -1.0), 2): {
            "x10": 0.10e-3,
            "x2": 0.025e-3,
            "x3": 0.016e-3,
            "x4": 0.51 * SEC,
            "x6": 0.46 * SEC,
        },
        ((1.0, -1.0), 4): {
            "x10": 0.07e-3,
            "x2": 0.016e-3,
            "x3": 0.009e-3,
            "x4": 0.34 * SEC,
            "x6": 0.23 * SEC,
        },
    }
    for (faces, count), expected in table.items():
        found = sigmas(room(faces, everything, count))
        for name, sigma in expected.items():
            assert 1 / 3 < found[name] / sigma < 3.0, (faces, count, name, found[name] / sigma)


def test_two_faces_beat_everything() -> None:
    one, two = sigmas(room((1.0,), PHYSICAL)), sigmas(room((1.0, -1.0), PHYSICAL))
    assert two["x4"] < one["x4"] / 10
    assert two["x6"] < one["x6"] / 5
    assert all(two[name] < one[name] for name in PHYSICAL)


def test_a_single_station_says_what_would_help() -> None:
    network = lab(NIST.parameters, faces=(1.0,), stations={"S1": STATIONS["S1"]})
    with pytest.raises(RankDefect) as caught:
        calibrate(network)
    text = "\n".join(caught.value.sentences)
    assert "the back face of every target would make estimable" in text
    assert "another station with another heading would make estimable" in text
    assert "x10(scanner) is to be left out" in text


def test_what_cannot_be_separated_is_left_out_on_request() -> None:
    network = measured(lab(NIST.parameters), TRUTH, 1)
    found = calibrate(network, CalibrationOptions(reduce=True))
    assert found.dropped == ("x5n(scanner)", "x5z(scanner)")
    assert len(found.parameters) == 16
    hardly = {item.name for item in found.proposal.hardly}
    assert "x12a(scanner)" in hardly
    reasons = {item.name: item.why for item in found.proposal.left}
    assert "x9n(scanner)" in reasons["x5n(scanner)"]
    assert "x7(scanner)" in reasons["x5z(scanner)"]


def test_everything_is_found_and_nothing_else_is_called_for() -> None:
    found = calibrate(measured(lab(PHYSICAL), dict(MISALIGNMENTS), 3))
    for p in found.parameters:
        assert abs(p.value - MISALIGNMENTS[p.name.split("(")[0]]) < 4 * p.sigma
    assert all(p.significant for p in found.parameters)
    assert not any(o.missing for o in found.tests.omitted)
    assert found.tests.gain is not None
    assert found.tests.gain.p < 1e-6
    assert found.tests.stations_differ is not None
    assert found.tests.stations_differ.p > 1e-4


def test_a_missing_parameter_is_called_for() -> None:
    """The mirror's tilt is left out: the residuals ask for it, with its size."""
    kept = tuple(p for p in PHYSICAL if p != "x6")
    network = lab_without(kept, dict(MISALIGNMENTS), 5)
    found = calibrate(network)
    missing = {o.name: o for o in found.tests.omitted if o.missing}
    assert "x6" in missing
    strongest = max(missing.values(), key=lambda o: abs(o.w))
    assert strongest.name in ("x6", "x3")  # nearly the same effect at equal ranges
    assert missing["x6"].value == pytest.approx(MISALIGNMENTS["x6"], abs=0.5 * MISALIGNMENTS["x6"])


def lab_without(kept: tuple[str, ...], truth: dict[str, float], seed: int) -> Network:
    return misaligned(lab(kept), truth, seed)


def test_elevation_in_place_of_zenith_angles_is_detected() -> None:
    """The paper's five with the wrong meaning of the angle leave residuals that fail the tests."""
    names = ("a1", "a3", "a4", "a5")
    wrong = lab(names, model=PAPER_EIGHT_ELEVATION)
    found = calibrate(misaligned(wrong, dict(MISALIGNMENTS), 9))
    assert sum(o.missing for o in found.tests.omitted) >= 2
    right = lab(("a1", "a2", "a3", "a4", "a5"), model=PAPER_EIGHT)
    good = calibrate(misaligned(right, dict(MISALIGNMENTS), 9))
    assert not any(o.missing for o in good.tests.omitted)
    assert good.adjustment.vtpv < found.adjustment.vtpv - 100


def test_with_elevation_a2_cannot_be_separated() -> None:
    with pytest.raises(RankDefect, match="a2"):
        calibrate(lab(("a1", "a2"), model=PAPER_EIGHT_ELEVATION, faces=(1.0,)))


def test_nothing_is_found_where_nothing_is() -> None:
    """500 t-tests at 0.1 %: at most a few false ones; the limit is that of the tests."""
    network = lab(PHYSICAL)
    z = np.abs(standardised(network, dict.fromkeys(PHYSICAL, 0.0), 30))
    assert (z > 3.29).sum() <= 2
    assert (z > 1.96).mean() == pytest.approx(0.05, abs=0.06)


def test_sets_of_stations_that_differ_are_noticed() -> None:
    network = lab(PHYSICAL)
    drawn = measured(network, dict(MISALIGNMENTS), 2)
    table = drawn.observations[0]
    at_second = table.station == 1
    table.values[at_second, 2] -= table.face[at_second] * 20 * SEC  # another vertical index there
    found = calibrate(drawn)
    assert found.tests.stations_differ is not None
    assert found.tests.stations_differ.p < 1e-10


def test_sigmas_of_parameters_are_the_same_in_every_datum() -> None:
    found = calibrate(measured(lab(HIGH_END), dict(MISALIGNMENTS), 4))
    effects = datum_effects(found.adjustment, found.names)
    assert [d.datum for d in effects] == ["as adjusted", "station S1 held"]
    np.testing.assert_allclose(effects[1].parameters, effects[0].parameters, rtol=1e-6)
    np.testing.assert_allclose(effects[1].distances, effects[0].distances, rtol=1e-6)
    assert (effects[1].stations[0] == 0).all()
    assert effects[1].of_points.mean() > effects[0].of_points.mean()
    held = adjust(found.adjustment.network.with_datum(Datum("fixed", ("S1",))))
    own = np.sqrt([held.covariance(name)[0, 0] for name in found.names])
    np.testing.assert_allclose(own, effects[0].parameters, rtol=1e-5)
    second = np.sqrt(np.diag(held.covariance("S2")))
    np.testing.assert_allclose(second, effects[1].stations[1], rtol=1e-4)


def test_correlations_are_those_of_the_covariance() -> None:
    found = calibrate(measured(lab(PHYSICAL), dict(MISALIGNMENTS), 4))
    a, c = found.adjustment, found.rho
    block = np.array([[a.covariance(i, j)[0, 0] for j in found.names] for i in found.names])
    size = np.sqrt(np.diag(block))
    np.testing.assert_allclose(c.within, block / np.outer(size, size), atol=1e-9)
    pose, point = a.covariance("S2"), a.covariance("T7")
    cross = a.covariance(found.names[1], "S2")[0] / size[1] / np.sqrt(np.diag(pose))
    np.testing.assert_allclose(c.orientation[1, 6:], cross, atol=1e-9)
    near = a.covariance(found.names[1], "T7")[0] / size[1] / np.sqrt(np.diag(point))
    np.testing.assert_allclose(c.points[1, 21:24], near, atol=1e-9)
    assert c.strongest_by_point[1, 7] == pytest.approx(np.abs(near).max())


def test_without_parameters_there_is_nothing_to_calibrate() -> None:
    network = lab(("x10",))
    free = network.free.copy()
    free[-1] = False
    with pytest.raises(InputError, match="no calibration parameters"):
        calibrate(Network(**{**vars(network), "free": free}))


def test_a_posteriori_sigmas_are_scaled() -> None:
    network = measured(lab(PHYSICAL), dict(MISALIGNMENTS), 6)
    prior, posterior = calibrate(network), calibrate(network, CalibrationOptions(posterior=True))
    ratio = posterior.parameters[0].sigma / prior.parameters[0].sigma
    assert ratio == pytest.approx(np.sqrt(prior.adjustment.posterior_factor))
    assert "a posteriori" in posterior.sigma_origin


def test_of_parameters_that_share_an_effect_one_is_proposed() -> None:
    """One face without ceiling: none of a pair is significant by itself, both together are."""
    network = measured(lab(("x10", "x2"), ceiling=False, faces=(1.0,)), {"x10": 4e-3, "x2": 0.0}, 1)
    found = calibrate(network)
    assert not any(p.significant for p in found.parameters)
    assert found.proposed == ("x10(scanner)",)
    alone = adjust(without(found.adjustment.network, ["x2(scanner)"]))
    assert alone.state.scalars[0] > 3.29 * np.sqrt(alone.covariance("x10(scanner)")[0, 0])


def test_remedies_promise_what_they_give() -> None:
    """Sigmas that are predicted for the back face are those of a network that has it."""
    front, both = room((1.0,), PHYSICAL), room((1.0, -1.0), PHYSICAL)
    names = front.start.layout.names["scalar"]
    tried = {r.what: r.proposal for r in remedies(front, front.start, names, 0.95)}
    back = tried["the back face of every target"]
    actual = propose(both, both.start, names)
    np.testing.assert_allclose(back.sigma, actual.sigma, rtol=1e-6)
    known = tried["a known length between two targets"]
    assert known.sigma[0] < propose(front, front.start, names).sigma[0]


def test_remedies_leave_stations_that_are_targets_where_they_were() -> None:
    """Further points come before the stations in the list of positions."""
    survey = Survey()
    places = {"S1": (0.0, 0.0, 0.0), "S2": (6.0, 1.0, 0.2)}
    rng = np.random.default_rng(3)
    x = rng.uniform([-5, -5, -1], [9, 6, 3], (12, 3))
    for name, place in places.items():
        survey.station(name, translation=place, rotation=np.eye(3))
        others = [n for n in places if n != name]
        seen = np.vstack([x, [places[n] for n in others]]) - place
        survey.add(
            TargetCentres,
            values=seen,
            sigma=0.001,
            station=name,
            target=[*(f"T{i}" for i in range(12)), *others],
            source=[""] * len(seen),
        )
    given = StationModel(NIST.select(["x10", "x4"]), "scanner")
    calibrate_survey(survey, dict.fromkeys(places, given))
    survey.datum = Datum("free")
    network = survey.network()
    state = find_start(network)
    new = Addition(("further",), np.array([[1.0, 2.0, 3.0]]))
    grown, at = enlarged(network, state, new)
    for before, after in zip(network.observations, grown.observations, strict=True):
        np.testing.assert_allclose(after.predict(at), before.predict(state))
    names = network.start.layout.names["scalar"]
    for remedy in remedies(network, state, names, 0.95):
        assert np.isfinite(remedy.proposal.sigma).all()
