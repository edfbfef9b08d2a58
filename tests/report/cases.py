"""Small adjusted networks whose numbers are known in closed form."""

from dataclasses import replace

import numpy as np

from tribrach.geometry import rotation
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.network import Datum, Network
from tribrach.network.quality import assess
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.observations.control import Coordinates
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.scanner import TargetCentres
from tribrach.observations.sights import Directions, SlopeDistances
from tribrach.report.build import build
from tribrach.report.content import Report

#: names that would run as markup if a report did not escape them
EVIL = "<script>alert(1)</script>"


def levelling(**options: object) -> Report:
    """A - B - C - A levelled with sigma 1 mm each and a misclosure of 3 mm; A is held.

    Each line takes a third of the misclosure: v = -1 mm (sign of the sum), r = 1/3, |w| = sqrt 3,
    sigma of B and C sqrt(2/3) mm, sigma0 a posteriori sqrt 3.
    """
    survey = Survey()
    survey.point("A", (np.nan, np.nan, 10.0), free=(False, False, False))
    for name in "BC":
        survey.point(name, free=(False, False, True))
    survey.add(
        HeightDifferences,
        values=[1.001, 1.001, -1.999],
        sigma=1e-3,
        start=["A", "B", "C"],
        end=["B", "C", "A"],
        source=["loop.csv:2", "loop.csv:3", "loop.csv:4"],
    )
    adjustment = adjust(survey.network())
    return build(adjustment, assess(adjustment), date="2026-01-01", **options)  # type: ignore[arg-type]


def levelled_without_residuals(readings: int) -> Adjustment:
    """B read from A so many times with a rise of exactly zero: every residual is zero."""
    survey = Survey()
    survey.point("A", (np.nan, np.nan, 0.0), free=(False, False, False))
    survey.point("B", free=(False, False, True))
    survey.add(
        HeightDifferences,
        values=[0.0] * readings,
        sigma=1e-3,
        start=["A"] * readings,
        end=["B"] * readings,
    )
    return adjust(survey.network())


def mean_of_two() -> Report:
    """P given twice as weighted control (1 mm, 3 mm apart in E) and once as a check point.

    The mean has sigma 1/sqrt 2 mm, so a check point of sigma 1 mm differs with sqrt(1.5) mm.
    """
    survey = Survey()
    survey.point("P")
    values = [[100.0, 200.0, 5.0], [100.003, 200.0, 5.0], [100.0015, 200.0100, 5.0]]
    survey.add(
        Coordinates,
        values=values,
        sigma=1e-3,
        position=["P", "P", "P"],
        source=[f"control.csv:{k}" for k in (2, 3, 4)],
        use=np.array([Use.ACTIVE, Use.ACTIVE, Use.CHECK], dtype=np.int8),
        group="control",
    )
    adjustment = adjust(survey.network())
    return build(adjustment, assess(adjustment), date="2026-01-01")


def scanner(evil: bool = False, *, free: bool = False) -> Adjustment:
    """Two scanner stations and a total-station direction set on six targets, one of them off."""
    rng = np.random.default_rng(5)
    truth = rng.uniform(-20, 20, (6, 3)) + np.array([1000, 2000, 50])
    names = [EVIL if evil and i == 0 else f"T{i}" for i in range(6)]
    survey = Survey(datum=Datum("free") if free else Datum())
    for i, (name, x) in enumerate(zip(names, truth, strict=True)):
        own = np.eye(3) * 1e-6 if i < 3 else None
        survey.point(name, x, covariance=own, source=f"control.csv:{i + 2}" if i < 3 else "")
    for k in range(2):
        t = np.array([1000.0 + 3 * k, 2001.0, 50.0])
        r = rotation.exp(np.array([0.02, -0.01, 0.4 + k]))
        survey.station(f"S{k}", translation=t, rotation=r)
        survey.add(
            TargetCentres,
            values=(truth - t) @ r + rng.normal(0, 1e-3, (6, 3)),
            sigma=np.full((6, 3), 1e-3),
            station=[f"S{k}"] * 6,
            target=names,
            source=[f"scan{k}.txt:{i + 1}" for i in range(6)],
        )
    chord = truth[1:] - truth[0]
    survey.add(
        Directions,
        values=np.arctan2(chord[:, 0], chord[:, 1]) - 0.5,
        sigma=1e-4,
        start=[names[0]] * 5,
        end=names[1:],
        orientation=["circle T0"] * 5,
        source=[f"tps.csv:{i + 2}" for i in range(5)],
    )
    survey.add(
        SlopeDistances,
        values=[float(np.linalg.norm(chord[2])) + 0.5],
        sigma=1e-3,
        start=[names[0]],
        end=[names[3]],
        source=["tps.csv:9"],
    )
    network = survey.network()
    distances = [o.kind for o in network.observations].index("slope_distance")
    network = network.switched([(distances, 0)], Use.OFF, 'prism <moved> & "back"')
    return adjust(_titled(network))


def _titled(network: Network) -> Network:
    return replace(network, title=f"Site {EVIL}")


def scanner_content(evil: bool = False, **options: object) -> Report:
    """Content of the scanner network."""
    adjustment = scanner(evil)
    return build(adjustment, assess(adjustment), date="2026-01-01", **options)  # type: ignore[arg-type]
