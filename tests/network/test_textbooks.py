"""Networks of the textbooks, with the figures the books print (AC-22 to AC-35, AC-38).

Numbers are quoted from the books named at each test.
"""

import numpy as np
import pytest

from tests.network.networks import trilateration
from tribrach.geodesy.site import FlatSite
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.blunders.robust import adjust_robust, weight_function
from tribrach.network.blunders.snooping import snoop
from tribrach.network.network import Datum
from tribrach.network.quality import assess
from tribrach.network.significance import noncentrality, sidak, tau_critical, w_critical
from tribrach.network.survey import Survey
from tribrach.network.variance_components import estimate_components
from tribrach.observations.gnss import GnssBaselines
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.scanner import TargetCentres
from tribrach.observations.sights import (
    Angles,
    Azimuths,
    Directions,
    HorizontalDistances,
    SlopeDistances,
    ZenithAngles,
)
from tribrach.units import GON, SEC, parse_angle

PLAN = (True, True, False)
HELD = (False, False, False)


def dms(text: str) -> float:
    return parse_angle(text, "dms")


def at(adjustment: Adjustment, name: str) -> np.ndarray:
    return adjustment.state.points[adjustment.layout.index("point", name)]


def sigma(adjustment: Adjustment, name: str) -> np.ndarray:
    factor = adjustment.posterior_factor
    return np.sqrt(np.diag(adjustment.covariance(name)) * factor)


def plan(fixed: dict, free: dict) -> Survey:
    survey = Survey()
    for name, (e, n) in fixed.items():
        survey.point(name, (e, n, 0.0), free=HELD, role="control")
    for name, (e, n) in free.items():
        survey.point(name, (e, n, 0.0), free=PLAN)
    return survey


def distances(survey: Survey, rows: list[tuple[str, str, float, float]]) -> None:
    start, end, value, s = zip(*rows, strict=True)
    survey.add(HorizontalDistances, values=value, sigma=s, start=start, end=end)


def angles(survey: Survey, rows: list[tuple[str, str, str, float, float]]) -> None:
    """Station, backsight, foresight, value [rad], sigma [rad]."""
    start, back, fore, value, s = zip(*rows, strict=True)
    survey.add(Angles, values=value, sigma=s, start=start, end=back, foresight=fore)


def levels(survey: Survey, rows: list[tuple[str, str, float, float]]) -> None:
    start, end, value, s = zip(*rows, strict=True)
    survey.add(HeightDifferences, values=value, sigma=s, start=start, end=end)


def test_levelling_of_ghilani() -> None:
    """AC-22: Adjustment Computations (2010), example 12.6."""
    survey = Survey()
    survey.point("A", (0, 0, 437.596), free=HELD, role="control")
    for name in "BCD":
        survey.point(name, (0, 0, np.nan), free=(False, False, True))
    rows = [("A", "B", 10.509, 0.006), ("B", "C", 5.360, 0.004), ("C", "D", -8.523, 0.005)]
    rows += [("D", "A", -7.348, 0.003), ("B", "D", -3.167, 0.004), ("A", "C", 15.881, 0.012)]
    levels(survey, rows)
    adjustment = adjust(survey.network())
    heights = [at(adjustment, name)[2] for name in "BCD"]
    assert heights == pytest.approx([448.1087, 453.4685, 444.9436], abs=5e-5)
    assert adjustment.sigma0_posterior == pytest.approx(0.6512, abs=5e-5)
    assert sigma(adjustment, "B")[2] == pytest.approx(0.00230, abs=5e-6)


def test_free_levelling_of_niemeier() -> None:
    """AC-23: Ausgleichungsrechnung (2008), p. 153, datum 1, 3, 5."""
    survey = Survey(datum=Datum("free", ("1", "3", "5")))
    start = (68.927, 60.712, 63.193, 56.286, 44.324, 67.228)
    for name, height in zip("123456", start, strict=True):
        survey.point(name, (0, 0, height), free=(False, False, True))
    lines = [(1, 2, -8.206, 621.118), (1, 3, -5.734, 1204.819), (2, 3, 2.481, 450.450)]
    lines += [(2, 4, -4.433, 800), (3, 4, -6.909, 1000), (3, 5, -18.872, 1098.901)]
    lines += [(3, 6, 4.035, 440.529), (4, 5, -11.962, 719.424), (5, 6, 22.904, 833.333)]
    levels(survey, [(str(a), str(b), dh, 1e-3 * np.sqrt(s / 1000)) for a, b, dh, s in lines])
    adjustment = adjust(survey.network())
    expected = [68.9249, 60.7167, 63.1952, 56.2852, 44.3240, 67.2294]
    assert [at(adjustment, n)[2] for n in "123456"] == pytest.approx(expected, abs=5e-5)
    assert adjustment.sigma0_posterior == pytest.approx(3.394, abs=5e-4)


def test_trilateration_of_ghilani() -> None:
    """AC-24: example 14.5."""
    fixed = {"Badger": (2410000, 390000), "Bucky": (2411820, 386881.222)}
    free = {"Wisconsin": (2415776, 391043), "Campus": (2416898, 387602)}
    survey = plan(fixed, free)
    rows = [("Badger", "Wisconsin", 5870.302), ("Badger", "Campus", 7297.588)]
    rows += [("Wisconsin", "Campus", 3616.434), ("Wisconsin", "Bucky", 5742.878)]
    rows += [("Campus", "Bucky", 5123.760)]
    distances(survey, [(*row, 0.01) for row in rows])
    adjustment = adjust(survey.network())
    assert at(adjustment, "Wisconsin")[:2] == pytest.approx((2415776.9044, 391043.2945), abs=5e-5)
    assert at(adjustment, "Campus")[:2] == pytest.approx((2416892.6955, 387603.2551), abs=5e-5)


def test_resection_by_angles_of_ghilani() -> None:
    """AC-25: example 15.5."""
    fixed = {"P": (1303.599, 1458.615), "Q": (1636.436, 1310.468)}
    fixed |= {"R": (1503.395, 888.362), "S": (1506.262, 785.061)}
    survey = plan(fixed, {"U": (1000, 1000)})
    rows = [
        ("U", "P", "Q", 33.88056, 5),
        ("U", "Q", "R", 42.78735, 6),
        ("U", "R", "S", 11.66574, 6),
    ]
    angles(survey, [(a, b, c, v * GON, s * SEC) for a, b, c, v, s in rows])
    adjustment = adjust(survey.network())
    # the angles are quoted to 0.01 mgon, 0.05 mm at this distance
    assert at(adjustment, "U")[:2] == pytest.approx((999.9989, 1000.0253), abs=1e-4)
    assert adjustment.sigma0_posterior == pytest.approx(0.603, abs=2e-3)


def test_traverse_of_ghilani() -> None:
    """AC-26: example 16.1."""
    fixed = {"Q": (1000, 800), "R": (1000, 1000), "S": (1223, 1186.5), "T": (1400, 1186.5)}
    survey = plan(fixed, {"U": (1173.2, 1100.0)})
    distances(survey, [("R", "U", 200.00, 0.05), ("U", "S", 100.00, 0.08)])
    rows = [
        ("R", "Q", "U", "240-00-00"),
        ("U", "R", "S", "150-00-00"),
        ("S", "U", "T", "240-01-00"),
    ]
    angles(survey, [(a, b, c, dms(v), 30 * SEC) for a, b, c, v in rows])
    adjustment = adjust(survey.network())
    assert at(adjustment, "U")[:2] == pytest.approx((1173.0886, 1099.9872), abs=5e-5)
    assert adjustment.sigma0_posterior == pytest.approx(1.8187, abs=5e-5)
    assert sigma(adjustment, "U")[:2] == pytest.approx((0.0419, 0.0526), abs=5e-5)


def quadrilateral() -> Survey:
    """Example 16.2; triples are angles at the middle letter."""
    free = {"R": (1003.06, 2640.01), "S": (2323.07, 2638.47), "T": (2661.75, 1096.07)}
    survey = plan({"Q": (1000, 1000)}, free)
    rows = [("QRS", "38-48-50.7", 4.0), ("QST", "47-46-12.4", 4.0), ("QTR", "273-24-56.5", 4.4)]
    rows += [("RQS", "269-57-33.4", 4.7), ("SRT", "257-32-56.8", 4.7), ("TSQ", "279-04-31.2", 4.5)]
    rows += [("RST", "42-52-51.0", 4.3), ("RSQ", "90-02-26.7", 4.5), ("SQR", "51-08-45.0", 4.3)]
    rows += [("STQ", "51-18-16.2", 4.0), ("TRS", "34-40-05.7", 4.0)]
    angles(survey, [(t[0], t[1], t[2], dms(v), s * SEC) for t, v, s in rows])
    sides = [("QR", 1640.016, 0.026), ("RS", 1320.001, 0.024), ("ST", 1579.123, 0.025)]
    sides += [("TQ", 1664.524, 0.026), ("QS", 2105.962, 0.029), ("RT", 2266.035, 0.030)]
    distances(survey, [(p[0], p[1], v, s) for p, v, s in sides])
    survey.add(Azimuths, values=[dms("0-06-24.5")], sigma=0.001 * SEC, start=["Q"], end=["R"])
    return survey


def test_quadrilateral_of_ghilani() -> None:
    """AC-27, AC-28: example 16.2."""
    adjustment = adjust(quadrilateral().network())
    expected = {"R": (1003.0572, 2640.0051), "S": (2323.0626, 2638.4742)}
    expected |= {"T": (2661.7386, 1096.0867)}
    for name, xy in expected.items():
        assert at(adjustment, name)[:2] == pytest.approx(xy, abs=1.5e-4)
    assert adjustment.dof == 12
    assert adjustment.sigma0_posterior == pytest.approx(0.3526, abs=1e-4)
    assert assess(adjustment).redundancy.sum() == pytest.approx(12, abs=1e-6)


def test_blunder_of_ghilani() -> None:
    """AC-29: a twelfth angle has the largest w, 5.201, and an error of 23.38 arcsec."""
    survey = quadrilateral()
    table = survey.add(
        Angles,
        values=[dms("46-15-02")],
        sigma=4 * SEC,
        start=["T"],
        end=["Q"],
        foresight=["R"],
        source=["blunder"],
    )
    assert table >= 0
    adjustment = adjust(survey.network())
    quality = assess(adjustment)
    worst = int(np.nanargmax(np.abs(quality.w)))
    rows = adjustment.rows
    source = adjustment.network.observations[rows.table[worst]].source[rows.item[worst]]
    assert source == "blunder"
    assert abs(quality.w[worst]) == pytest.approx(5.201, abs=2e-3)
    assert abs(quality.gross_error[worst]) / SEC == pytest.approx(23.38, abs=0.02)


def niemeier() -> Survey:
    """Niemeier p. 156: directions 0.5 mgon, distances 5 mm."""
    fixed = {"104": (40686.792, 26816.143), "106": (41932.838, 28872.552)}
    fixed |= {"113": (42242.231, 27492.007), "280": (40350.846, 28835.979)}
    survey = plan(fixed, {"Z108": (40759.4, 27816.1), "Z110": (41373.0, 27904.0)})
    readings = [("Z108", "280", 370.6444), ("Z108", "104", 199.5131), ("Z108", "113", 108.5994)]
    readings += [("Z110", "106", 35.4146), ("Z110", "Z108", 292.9943)]
    readings += [("Z110", "104", 237.8763), ("Z110", "113", 130.2278)]
    start, end, value = zip(*readings, strict=True)
    survey.add(
        Directions,
        values=np.array(value) * GON,
        sigma=0.5e-3 * GON,
        start=start,
        end=end,
        orientation=[f"o {name}" for name in start],
    )
    sides = [("Z108", "280", 1098.643), ("Z108", "104", 1002.598), ("Z108", "113", 1517.862)]
    sides += [("Z110", "106", 1118.689), ("Z110", "Z108", 619.905), ("Z110", "104", 1286.215)]
    sides += [("Z110", "113", 961.911)]
    distances(survey, [(*side, 0.005) for side in sides])
    return survey


def test_directions_and_distances_of_niemeier_with_variance_components() -> None:
    """AC-30."""
    network = niemeier().network()
    adjustment = adjust(network)
    assert at(adjustment, "Z108")[:2] == pytest.approx((40759.3769, 27816.1166), abs=5e-5)
    assert at(adjustment, "Z110")[:2] == pytest.approx((41373.0193, 27904.0042), abs=5e-5)
    assert adjustment.sigma0_posterior == pytest.approx(0.9664, abs=5e-5)
    found = estimate_components(network, minimum_redundancy=1, alpha=None).components
    factors = {c.group: (c.sigma_factor, c.redundancy) for c in found}
    assert 0.5 * factors["direction"][0] == pytest.approx(0.454, abs=1e-3)
    assert 5 * factors["horizontal_distance"][0] == pytest.approx(5.09, abs=5e-3)
    assert factors["direction"][1] == pytest.approx(3.62, abs=5e-3)
    assert factors["horizontal_distance"][1] == pytest.approx(4.38, abs=5e-3)


def test_groups_with_little_redundancy_keep_their_sigmas() -> None:
    components = estimate_components(niemeier().network(), alpha=None).components
    assert all(c.sigma_factor == 1.0 and "below 5" in c.note for c in components)


def test_gnss_network_of_ghilani() -> None:
    """AC-32: chapter 17, baselines with covariances in metres squared."""
    rows = """
    A C 11644.2232 3601.2165 3399.2550 9.884e-4 -9.580e-6 9.520e-6 9.377e-4 -9.520e-6 9.827e-4
    A E -5321.7164 3634.0754 3173.6652 2.158e-4 -2.100e-6 2.160e-6 1.919e-4 -2.100e-6 2.005e-4
    B C 3960.5442 -6681.2467 -7279.0148 2.305e-4 -2.230e-6 2.070e-6 2.546e-4 -2.230e-6 2.252e-4
    B D -11167.6076 -394.5204 -907.9593 2.700e-4 -2.750e-6 2.850e-6 2.721e-4 -2.720e-6 2.670e-4
    D C 15128.1647 -6286.7054 -6371.0583 1.461e-4 -1.430e-6 1.340e-6 1.614e-4 -1.440e-6 1.308e-4
    D E -1837.7459 -6253.8534 -6596.6697 1.231e-4 -1.190e-6 1.220e-6 1.277e-4 -1.210e-6 1.283e-4
    F A -1116.4523 -4596.1610 -4355.9062 7.475e-5 -7.900e-7 8.800e-7 6.593e-5 -8.100e-7 7.616e-5
    F C 10527.7852 -994.9377 -956.6246 2.567e-4 -2.250e-6 2.400e-6 2.163e-4 -2.270e-6 2.397e-4
    F E -6438.1364 -962.0694 -1182.2305 9.442e-5 -9.200e-7 1.040e-6 9.959e-5 -8.900e-7 8.826e-5
    F D -4600.3787 5291.7785 5414.4311 9.330e-5 -9.900e-7 9.000e-7 9.875e-5 -9.900e-7 1.204e-4
    F B 6567.2311 5686.2926 6322.3917 6.643e-5 -6.500e-7 6.900e-7 7.465e-5 -6.400e-7 6.048e-5
    B F -6567.2310 -5686.3033 -6322.3807 5.512e-5 -6.300e-7 6.100e-7 7.472e-5 -6.300e-7 6.629e-5
    A F 1116.4577 4596.1553 4355.9141 6.619e-5 -8.000e-7 9.000e-7 8.108e-5 -8.200e-7 9.376e-5
    """
    words = [line.split() for line in rows.strip().splitlines()]
    numbers = np.array([w[2:] for w in words], dtype=float)
    cov = numbers[:, [3, 4, 5, 4, 6, 7, 5, 7, 8]].reshape(-1, 3, 3)
    survey = Survey()
    survey.point("A", (402.35087, -4652995.30109, 4349760.77753), free=HELD, role="control")
    survey.point("B", (8086.03178, -4642712.84739, 4360439.08326), free=HELD, role="control")
    survey.add(
        GnssBaselines,
        values=numbers[:, :3],
        covariance=cov,
        start=[w[0] for w in words],
        end=[w[1] for w in words],
    )
    adjustment = adjust(survey.network())
    expected = {"C": (12046.5808, -4649394.0826, 4353160.0644)}
    expected |= {"D": (-3081.5831, -4643107.3692, 4359531.1233)}
    expected |= {"E": (-4919.3391, -4649361.2199, 4352934.4548)}
    expected |= {"F": (1518.8012, -4648399.1453, 4354116.6914)}
    for name, xyz in expected.items():
        assert at(adjustment, name) == pytest.approx(xyz, abs=1e-4)
    assert adjustment.dof == 27
    assert adjustment.sigma0_posterior == pytest.approx(0.7075, abs=5e-4)


def test_free_station_of_baumann() -> None:
    """AC-33: Vermessungskunde (1995), 23.3.4."""
    survey = Survey()
    survey.point("1", (1000, 1201.171, 108.680), free=HELD, role="control")
    survey.point("2", (1371.217, 1072.895, 111.974), free=HELD, role="control")
    survey.point("3", (1016.437, 952.352, 117.312), free=HELD, role="control")
    survey.point("N")
    ends = {"start": ["N"] * 3, "end": ["1", "2", "3"]}
    ends |= {"height_instrument": 1.600, "height_target": np.array([1.572, 1.650, 1.588])}
    s = [223.6428, 190.2878, 205.1894]
    survey.add(SlopeDistances, values=s, sigma=0.005, **ends)
    z = np.array([95.9015, 94.0450, 92.8390]) * GON
    survey.add(ZenithAngles, values=z, sigma=2.5e-3 * GON, **ends)
    r = np.array([0, 160.1838, 320.7884]) * GON
    survey.add(Directions, values=r, sigma=2e-3 * GON, orientation=["o"] * 3, **ends)
    adjustment = adjust(survey.network())
    assert at(adjustment, "N") == pytest.approx((1181.7645, 1071.6795, 94.2598), abs=5e-5)
    assert adjustment.state.scalars[0] % (2 * np.pi) / GON == pytest.approx(339.4087, abs=5e-5)
    assert adjustment.sigma0_posterior == pytest.approx(1.1396, abs=5e-5)
    assert sigma(adjustment, "N") * 1e3 == pytest.approx((3.48, 3.96, 5.26), abs=5e-3)


def test_mixed_point_of_caspary() -> None:
    """AC-34: Fehlertolerante Auswertung (2013); four distances, a zenith angle, a GNSS vector."""
    survey = Survey()
    given = {"1": (4000, -10000, 1600), "2": (3000, 11000, 1500), "3": (700, -700, 800)}
    given |= {"4": (0, 0, 700)}
    for name, x in given.items():
        survey.point(name, x, free=HELD, role="control")
    survey.point("N", (5000, 2000, 1800))
    rows = [("1", 12043.305, 0.0375), ("2", 9224.404, 0.0294), ("3", 5174.910, 0.0185)]
    rows += [("4", 5496.402, 0.0198)]
    start, value, s = zip(*rows, strict=True)
    survey.add(SlopeDistances, values=value, sigma=s, start=start, end=["N"] * 4)
    survey.add(ZenithAngles, values=[87.1726 * GON], sigma=0.3e-3 * GON, start=["4"], end=["N"])
    vector = {"values": [[5000.02, 1999.98, 1099.94]], "sigma": [[0.016, 0.016, 0.062]]}
    survey.add(GnssBaselines, start=["4"], end=["N"], **vector)
    adjustment = adjust(survey.network())
    assert at(adjustment, "N") == pytest.approx((5000.0148, 1999.9923, 1799.9868), abs=5e-4)
    assert adjustment.sigma0_posterior == pytest.approx(1.481, abs=5e-3)


def test_spatial_intersection_of_wolf() -> None:
    """AC-35: Ausgleichungsrechnung II (1979), p. 87; elevations become zenith angles."""
    survey = Survey()
    given = {"1": (1200, 900, 900), "2": (900, 600, 900), "3": (600, 900, 900)}
    given |= {"4": (900, 1200, 900)}
    for name, x in given.items():
        survey.point(name, x, free=HELD, role="control")
    survey.point("N", (900, 900, 1300))
    ends = {"start": list("1234"), "end": ["N"] * 4}
    survey.add(SlopeDistances, values=[499.99, 500, 500.01, 500.02], sigma=0.01, **ends)
    elevation = np.array([59.03327, 59.03330, 59.03333, 59.03336])
    z = (100 - elevation) * GON
    survey.add(ZenithAngles, values=z, sigma=12.73e-3 * GON, **ends)
    adjustment = adjust(survey.network())
    assert at(adjustment, "N") == pytest.approx((900.0164, 899.9836, 1300.0062), abs=1.5e-4)


def test_conformal_transformation_weighted_on_both_sides() -> None:
    """AC-36: Ghilani chapter 18 ; X = s M^T x + T with the sigmas of both systems."""
    rows = """
    1 1094.883 820.085 109.821 7 8 5 10037.81 5262.09 772.04 5 6 5
    2 503.891 1598.698 117.685 11 8 9 10956.68 5128.17 783.00 4 6 9
    3 2349.343 207.658 151.387 6 5 7 8780.08 4840.29 782.62 2 4 2
    4 1395.320 1348.853 215.261 5 8 9 10185.80 4700.21 851.32 3 5 3
    """
    words = [line.split() for line in rows.strip().splitlines()]
    names = [w[0] for w in words]
    numbers = np.array([w[1:] for w in words], dtype=float)
    survey = Survey()
    for name, row in zip(names, numbers, strict=True):
        survey.point(name, row[6:9], covariance=np.diag((row[9:12] / 100) ** 2))
    survey.station("model")
    survey.add(
        TargetCentres,
        values=numbers[:, :3],
        sigma=numbers[:, 3:6] / 1000,
        station=["model"] * 4,
        target=names,
        scale=["scale"] * 4,
    )
    adjustment = adjust(survey.network())
    assert 1 / (1 + adjustment.state.scalars[0]) == pytest.approx(0.949955, abs=5e-7)
    assert adjustment.state.pose_t[0] == pytest.approx((10233.8542, 6549.9641, 720.8663), abs=5e-4)
    assert adjustment.dof == 5
    assert adjustment.sigma0_posterior == pytest.approx(1.288, abs=5e-4)


def test_blunders_of_blankenbach_and_willert() -> None:
    """AC-38: AVN 2009; two of eight distances are wrong, found in two steps."""
    rows = {"51": (-8.62, 27.42, 10.29, 8.20), "37": (-4.95, 27.30, 10.04, 3.85)}
    rows |= {"31": (-4.85, 20.69, 10.51, 4.35), "102": (0.52, 22.59, 9.77, 3.51)}
    rows |= {"331": (-6.12, 25.48, 10.92, 3.98), "35": (0.45, 27.39, 10.75, 4.37)}
    rows |= {"103": (0.61, 17.19, 9.71, 8.17), "101": (-7.88, 22.45, 10.16, 5.73)}
    survey = Survey()
    survey.point("MS", (-2.3, 24.3, 9.5))
    for name, row in rows.items():
        survey.point(name, row[:3], free=HELD, role="control")
    values = [row[3] for row in rows.values()]
    survey.add(SlopeDistances, values=values, sigma=0.05, start=["MS"] * 8, end=list(rows))
    network = survey.network()
    assert at(adjust(network), "MS") == pytest.approx((-2.3042, 24.3101, 9.5248), abs=1e-4)
    cleaned, log = snoop(network)
    assert [step.observation.split()[-1] for step in log.steps] == ["51", "103"]
    expected = (-2.5077, 24.3202, 9.7753)
    assert at(cleaned, "MS") == pytest.approx(expected, abs=1e-4)
    assert cleaned.sigma0_posterior == pytest.approx(0.613, abs=5e-4)
    off = cleaned.network.observations[0]
    assert all("snooping" in reason for reason in off.reason[off.use == 2])
    robust = adjust_robust(network, "igg3")
    assert at(robust.adjustment, "MS") == pytest.approx(expected, abs=2e-4)
    assert (robust.weights < 1e-3).sum() == 2


def test_strang_and_borre_in_two_datums() -> None:
    """AC-31 in another datum has the same sigma0."""
    network = trilateration(Datum("free")).network()
    free = adjust(network)
    other = adjust(network.with_datum(Datum("free", ("1", "2"))))
    assert free.sigma0_posterior == pytest.approx(other.sigma0_posterior, rel=1e-9)


def test_constants_of_the_tests() -> None:
    """AC-37."""
    assert noncentrality() == pytest.approx(4.1321, abs=5e-5)
    assert w_critical() == pytest.approx(3.2905, abs=5e-5)
    assert noncentrality() ** 2 == pytest.approx(17.075, abs=5e-4)
    assert tau_critical(10, 0.05) == pytest.approx(1.9039, abs=5e-5)
    assert tau_critical(10, 0.01) == pytest.approx(2.3236, abs=5e-5)
    assert tau_critical(10, 1e-12) <= np.sqrt(10)
    assert sidak(0.05, 1) == pytest.approx(0.05)


def test_weight_functions() -> None:
    """Method 3.5: values at 0.5, 1.5, 2.5, 4.5."""
    v = np.array([0.5, 1.5, 2.5, 4.5])
    assert weight_function("igg3", v) == pytest.approx((1, 1, 0.216, 0), abs=5e-4)
    assert weight_function("huber", v) == pytest.approx((1, 0.897, 0.538, 0.299), abs=5e-4)


def test_curvature_and_refraction() -> None:
    """Method 2.3: s = 1000 m, z = 88 deg, k = 0.13 gives 34.9677 m."""
    survey = Survey(site=FlatSite(6371000.0))
    survey.point("S", (0, 0, 0), free=HELD, role="control")
    survey.point("T", (0, 999, 34))
    ends = {"start": ["S"], "end": ["T"]}
    survey.add(SlopeDistances, values=[1000.0], sigma=0.001, **ends)
    survey.add(ZenithAngles, values=[np.radians(88)], sigma=1e-6, refraction=0.13, **ends)
    survey.add(Azimuths, values=[0.0], sigma=1e-6, **ends)
    assert at(adjust(survey.network()), "T")[2] == pytest.approx(34.9677, abs=5e-4)
