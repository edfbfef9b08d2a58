"""Every page that the program writes, small, with names of a caller's choice in all places."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from tests.comparison.test_completeness import GRID, patches, wall
from tests.instruments.field_surveys import STATIONS, readings
from tests.network.lab import lab, measured
from tests.report.hostile import Naming
from tests.scan.noisy_scenes import simulated
from tribrach.calibration.field_check import check_readings
from tribrach.calibration.self_calibration import CalibrationOptions, calibrate
from tribrach.comparison.regression import regress
from tribrach.comparison.results import M3C2Figures, SiteResult
from tribrach.comparison.sites import Geometry
from tribrach.epochs.comparison import compare
from tribrach.epochs.differences import Epoch, difference
from tribrach.geodesy.site import FlatSite
from tribrach.geometry import rotation
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.epoch_files import EpochDocument
from tribrach.io.number_table import NumberTable
from tribrach.job.epochs import ComparedEpochs
from tribrach.job.station_comparison import StationComparison
from tribrach.network.adjustment import adjust
from tribrach.network.quality import assess
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.observations.control import Coordinates
from tribrach.observations.scanner import TargetCentres
from tribrach.observations.sights import Directions, SlopeDistances
from tribrach.planning.prediction import Criterion, figures
from tribrach.questions.calibrate.chapters import answer_of as calibration_answer
from tribrach.questions.check.chapters import answer_of as check_answer
from tribrach.questions.compare.chapters import ComparedClouds
from tribrach.questions.compare.chapters import answer_of as comparison_answer
from tribrach.questions.complete.chapters import answer_of as complete_answer
from tribrach.questions.complete.completeness import assess_completeness
from tribrach.questions.epochs.chapters import answer_of as epochs_answer
from tribrach.questions.noise.chapters import answer_of as noise_answer
from tribrach.questions.noise.estimate import NoiseEstimate, ScanPatches
from tribrach.questions.plan.chapters import answer_of as plan_answer
from tribrach.questions.plan.chapters import gain_map
from tribrach.questions.plan.design import DesignResult
from tribrach.questions.register.chapters import answer_of as register_answer
from tribrach.questions.register.registration import RegisteredFiles
from tribrach.questions.regress.command import answer_of as regression_answer
from tribrach.questions.series.chapters import answer_of as series_answer
from tribrach.questions.series.cycles import Cycle, PointAt, Series, SeriesSettings
from tribrach.registration.clouds.graph import CloudEdge, consistent, network_of
from tribrach.registration.clouds.pair import CloudPair
from tribrach.registration.clouds.together import CloudGroup, CloudRegistration
from tribrach.registration.edges import edges
from tribrach.report import html
from tribrach.report.build import build
from tribrach.report.chapter import Chapter
from tribrach.report.chapters.comparisons import comparison_chapter
from tribrach.report.charts import Chart, beside, legend
from tribrach.report.content import Report
from tribrach.report.epochs import epochs_svg
from tribrach.report.figures import Picture
from tribrach.report.tables import ColumnHead, build_table, text_cell
from tribrach.report.warnings import Severity, warned
from tribrach.scan.noise_law import fit_noise
from tribrach.scan.observed_noise import ObservedNoise
from tribrach.simulate.instruments import PULSED

__all__ = ["PAGES", "network_report"]


def survey_of(name: Naming) -> Survey:
    """Two scanner stations and a total station on six targets, a check point among them."""
    rng = np.random.default_rng(5)
    truth = rng.uniform(-20, 20, (6, 3)) + np.array([1000, 2000, 50])
    targets = [name(i) for i in range(6)]
    survey = Survey()
    survey.title = name(20)
    for i, (target, x) in enumerate(zip(targets, truth, strict=True)):
        own = np.eye(3) * 1e-6 if i < 3 else None
        survey.point(target, x, covariance=own, source=f"{name(21)}:{i + 2}" if i < 3 else "")
    for k in range(2):
        t = np.array([1000.0 + 3 * k, 2001.0, 50.0])
        r = rotation.exp(np.array([0.02, -0.01, 0.4 + k]))
        survey.station(name(6 + k), translation=t, rotation=r)
        survey.add(
            TargetCentres,
            values=(truth - t) @ r + rng.normal(0, 1e-3, (6, 3)),
            sigma=np.full((6, 3), 1e-3),
            station=[name(6 + k)] * 6,
            target=targets,
            source=[f"{name(8 + k)}:{i + 1}" for i in range(6)],
            group=name(10),
        )
    chord = truth[1:] - truth[0]
    survey.add(
        Directions,
        values=np.arctan2(chord[:, 0], chord[:, 1]) - 0.5,
        sigma=1e-4,
        start=[targets[0]] * 5,
        end=targets[1:],
        orientation=[name(11)] * 5,
        source=[f"{name(12)}:{i + 2}" for i in range(5)],
        group=name(13),
    )
    survey.add(
        SlopeDistances,
        values=[float(np.linalg.norm(chord[2])) + 0.5],
        sigma=1e-3,
        start=[targets[0]],
        end=[targets[3]],
        source=[name(12)],
    )
    survey.add(
        Coordinates,
        values=[truth[4] + [0.01, 0, 0]],
        sigma=1e-3,
        position=[targets[4]],
        source=[name(21)],
        use=np.array([Use.CHECK], dtype=np.int8),
    )
    return survey


def network_report(name: Naming) -> Report:
    """The report of an adjustment with warnings, facts, a chapter, and a comparison."""
    network = survey_of(name).network()
    k = [o.kind for o in network.observations].index("slope_distance")
    adjustment = adjust(network.switched([(k, 0)], Use.OFF, name(14)))
    content = build(
        adjustment,
        assess(adjustment),
        date="2026-01-01",
        title=name(20),
        facts={name(15): name(16)},
        warnings=warned(Severity.INPUT, [name(17)]),
    )
    chart = Chart((0.0, 1.0), (0.0, 1.0), (name(86), name(87)), title=name(22), names=[name(88)])
    chart.place(0.2, 0.5, name(89), "station")
    chart.line((0.0, 1.0), (0.0, 1.0), words=name(90))
    drawing = beside([[chart]], name(91), legend([("s0", name(92))], 400.0))
    heads = [(ColumnHead(name(23), name(24), numeric=False), text_cell)]
    table = build_table("words", name(25), name(26), [name(27 + i) for i in range(24)], heads)
    chapter = Chapter(
        "own", name(60), (name(61),), (Picture("own-map", name(62), drawing, name(63)),), (table,)
    )
    compared = StationComparison.of(name(64), name(65), 0.2, sites_of(name), None, [name(66)])
    return replace(content, chapters=(*content.chapters, chapter, comparison_chapter(compared)))


def sites_of(name: Naming) -> list[SiteResult]:
    """Sites with geometry and distances along normals that have something to say."""
    return [
        SiteResult(
            name(70 + k),
            100 + k,
            Geometry(10.0 + k, 0.3),
            Geometry(12.0, 0.4),
            m3c2=M3C2Figures(
                9, 1e-3, 2e-3, 4e-3, 4e-3, 0.1, 0.05, 0.1, (f"few points {name(80)}",)
            ),
        )
        for k in range(6)
    ]


def _report(name: Naming) -> str:
    return html.render(network_report(name))


def _comparison(name: Naming) -> str:
    found = ComparedClouds(name(0), name(1), 0.2, tuple(sites_of(name)))
    return comparison_answer((name(0), name(1)), found).page()


def _completeness(name: Naming) -> str:
    stations = {
        name(k): patches(wall(3 * k, 3 * k + 4, 0.05), 0.003 + 0.003 * (k > 1)) for k in range(4)
    }
    return complete_answer(name(9), assess_completeness(GRID, stations, required=0.005)).page()


def _check(name: Naming) -> str:
    stations = {name(k): x for k, x in enumerate(STATIONS.values())}
    given = readings(
        np.random.default_rng(3),
        {"x10": 0.02},
        stations=stations,
        series=(name(4), name(5), name(6)),
    )
    targets = np.array([name(10 + int(t[1:])) for t in given.target], dtype=object)
    return check_answer(check_readings(replace(given, target=targets), name(7))).page()


def _calibration(name: Naming) -> str:
    poses = [
        (np.zeros(3), np.array([0.012, -0.008, 0.2])),
        (np.array([1.2, 2.0, 0.05]), np.array([-0.01, 0.014, -1.1])),
    ]
    stations = {name(k): pose for k, pose in enumerate(poses)}
    network = measured(lab(("x10", "x2"), stations=stations), {}, 3)
    calibration = calibrate(network, CalibrationOptions())
    return calibration_answer(name(7), calibration, [name(8), name(9)]).page()


def _regression(name: Naming) -> str:
    rng = np.random.default_rng(1)
    columns = {name(k): rng.uniform(1, 2, 16) for k in range(4)}
    names = list(columns)
    found = regress(columns, names[:2], names[2:], {names[0]: name(5)})
    table = NumberTable(Path("table.csv"), columns, {names[0]: name(5)})
    return regression_answer(name(6), table, found).page()


def _plan(name: Naming) -> str:
    adjustment = adjust(survey_of(name).network())
    criterion = Criterion("sigma")
    after = figures(adjustment, criterion)
    plan = DesignResult(
        name(20), criterion, None, adjustment.network, adjustment, None, after, warnings=(name(30),)
    )
    places = np.random.default_rng(2).uniform(0, 9, (5, 3))
    gain = gain_map(places, places[:, 0], [name(31)], places[:1], places[1:2], "mm")
    answer = plan_answer(plan)
    gain = replace(gain, title=name(32), caption=name(33))
    return replace(answer, pictures=(*answer.pictures, gain)).page()


def _registration(name: Naming) -> str:
    stations = [name(k) for k in range(4)]
    rng = np.random.default_rng(4)
    poses = {s: Pose(rotation.exp(rng.normal(0, 0.5, 3)), rng.normal(0, 9, 3)) for s in stations}
    covariance = np.diag([4e-6] * 3 + [1e-8] * 3)
    joined = [
        CloudEdge(a, b, poses[a].inverse @ poses[b], covariance)
        for a, b in combinations(stations[:3], 2)
    ]
    consistency = consistent(joined)
    adjustment = adjust(network_of(stations[:3], consistency.used))
    group = CloudGroup(
        {s: poses[s] for s in stations[:3]},
        dict.fromkeys(stations[:3], covariance),
        adjustment,
        edges(adjustment),
        {},
    )
    alone = CloudGroup({stations[3]: poses[stations[3]]}, {}, None, (), {})
    pairs = [CloudPair(e.first, e.second, _fit(e), (), (name(10),)) for e in joined]
    refused = f"{stations[0]} and {stations[3]} do not overlap"
    pairs.append(CloudPair(stations[0], stations[3], None, (), (refused,)))
    found = CloudRegistration(pairs, consistency, [group, alone], (name(11), refused))
    scans: Any = {
        s: SimpleNamespace(path=Path(s.replace("/", "|")), no_return=None, remarks=[])
        for s in stations
    }
    return register_answer(RegisteredFiles(scans, dict.fromkeys(stations, 9), found)).page()


def _fit(edge: CloudEdge) -> Any:
    """What the page asks of a fit."""
    return SimpleNamespace(
        pose=edge.pose,
        alignment=SimpleNamespace(rms=1e-3, gate=15e-3, matches=range(90)),
        precision=SimpleNamespace(
            effective=30.0, local=edge.covariance, covariance=edge.covariance, rank=6
        ),
        verdict=SimpleNamespace(overlap=(0.5, 0.6), agree=0.9),
        origin="plans",
    )


@cache
def _patches() -> ObservedNoise:
    return simulated(PULSED, 7, points=60_000, leaves=20)


def _noise(name: Naming) -> str:
    found = _patches()
    whole = ScanPatches(name(1), 40, 9000, 60, 3, 2, True, 1e-4, "intensities of the file")
    others = [replace(whole, source=name(2)), replace(whole, source=name(3), remark="it is empty")]
    stated = ScanNoise(1e-3, 0.0, 4e-5, 4e-5, 3.5e-3, 2e-4)
    estimate = NoiseEstimate(
        (whole, *others), fit_noise(found), None, stated, f"the project for {name(4)}", ()
    )
    return noise_answer(estimate).page()


def _epochs(name: Naming) -> tuple[ComparedEpochs, ...]:
    rng = np.random.default_rng(6)
    names = tuple(name(k) for k in range(6))
    xyz = rng.uniform(0, 100, (6, 3))
    first = Epoch(name(7), names, xyz, 1e-6 * np.eye(18))
    shift = rng.normal(0, 1e-3, (6, 3)) + np.outer([0, 0, 0, 0, 0, 1], [0.02, 0, 0])
    second = Epoch(name(8), names, xyz + shift, first.covariance, first.motions)
    return (ComparedEpochs(compare(difference(first, second)), (name(9),)),)


def _epochs_page(name: Naming) -> str:
    return epochs_answer(_epochs(name)).page()


def _series_page(name: Naming) -> str:
    rng = np.random.default_rng(6)
    names = [name(k) for k in range(4)]
    zero = Epoch("zero", tuple(names), rng.uniform(0, 9, (4, 3)), 1e-6 * np.eye(12))
    points = [
        {n: PointAt(tuple(rng.normal(0, 1e-3, 3)), (1e-3,) * 3, 2.0, 9.0, "moved") for n in names}
        for _ in range(12)
    ]
    cycles = [
        Cycle(str(k), 1.7e9 + 14400 * k, 4, "", 30.0, 9, 20.0, (names[0],), True, at)
        for k, at in enumerate(points)
    ]
    cycles.append(Cycle("x", 1.8e9, 1, name(5)))
    kept = EpochDocument.of(zero, FlatSite(), "zero")
    found = Series(SeriesSettings(tuple(names)), kept, 2.0, tuple(cycles))
    return series_answer(found, name(6)).page()


def _epochs_svg(name: Naming) -> str:
    drawn = epochs_svg(_epochs(name)[0])
    assert drawn is not None
    return drawn


#: every function that makes a page, by its module below ``tribrach.report`` and its name
PAGES = {
    "html.render": _report,
    "questions.compare": _comparison,
    "questions.complete": _completeness,
    "questions.check": _check,
    "questions.calibrate": _calibration,
    "questions.regress": _regression,
    "questions.plan": _plan,
    "questions.register": _registration,
    "questions.noise": _noise,
    "questions.epochs": _epochs_page,
    "epochs.epochs_svg": _epochs_svg,
    "questions.series": _series_page,
}
