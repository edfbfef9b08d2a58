"""Predicted against observed by class: right predictions stand, wrong ones fall where they are."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.comparison.test_predicted import prediction
from tribrach.comparison.compared import CloudComparison
from tribrach.comparison.predicted_classes import predicted_classes
from tribrach.comparison.results import SiteResult
from tribrach.comparison.sites import Geometry
from tribrach.report.comparison import comparison_pictures, comparison_tables

DOF = 400


def sites(seed: int, steep: float = 1.0, count: int = 60) -> list[SiteResult]:
    """Sites whose scatter is as predicted, times a factor where clouds were seen beyond 45°."""
    rng = np.random.default_rng(seed)
    out = []
    for k in range(count):
        noise, scatter, seen = [], [], []
        for _ in range(2):
            slant, sigma = rng.uniform(0, np.radians(80)), rng.uniform(0.001, 0.004)
            factor = steep if slant > np.radians(45) else 1.0
            noise.append(sigma)
            scatter.append(factor * sigma * float(np.sqrt(rng.chisquare(DOF) / DOF)))
            seen.append(Geometry(rng.uniform(3, 60), slant))
        one = prediction(noise=tuple(noise), scatter=tuple(scatter), dof=(DOF, DOF))
        one = replace(one, offset=float(rng.normal(0, one.offset_sigma)))
        light = rng.uniform(100, 4000, 2)
        out.append(
            SiteResult(str(k), 1000, seen[1], seen[0], prediction=one,
                       light_a=light[0], light_b=light[1])
        )  # fmt: skip
    return out


def test_what_is_as_predicted_is_so_in_every_class() -> None:
    found = predicted_classes(sites(1))
    assert [c.by for c in found] == ["intensity"] * 4 + ["range"] * 5 + ["incidence"] * 4
    for by in ("intensity", "range", "incidence"):
        assert sum(c.clouds for c in found if c.by == by) == 120
        assert sum(c.dof for c in found if c.by == by) == 120 * DOF
    for one in found:
        assert one.verdict == "as predicted"
        assert one.limits[0] < one.ratio < one.limits[1]
        assert one.offset == pytest.approx(one.offset_sigma, rel=0.5)


def test_limits_hold_as_often_as_they_say() -> None:
    """1300 classes: 95 % limits hold one in 93 to 97 %."""
    held = [
        one.limits[0] < 1 < one.limits[1] for k in range(100) for one in predicted_classes(sites(k))
    ]
    assert len(held) >= 1200
    assert 0.93 < np.mean(held) < 0.97


def test_a_wrong_model_falls_in_its_own_classes() -> None:
    found = predicted_classes(sites(2, steep=1.3))
    verdicts = {round(np.degrees(c.high)): c.verdict for c in found if c.by == "incidence"}
    assert [verdicts[k] for k in sorted(verdicts)] == [
        "as predicted", "as predicted", "scatter more than predicted", "scatter more than predicted"
    ]  # fmt: skip


def whole(some: Sequence[SiteResult]) -> CloudComparison:
    return CloudComparison("A", "B", 0.2, tuple(some))


def test_the_table_says_it_and_is_left_out_without_predictions() -> None:
    some = sites(3, count=8)
    names = [table.name for table in comparison_tables(whole(some))]
    assert names[-1] == "predicted-classes"
    unlit = [replace(s, light_a=None, light_b=None, prediction=None) for s in some]
    assert "predicted-classes" not in [table.name for table in comparison_tables(whole(unlit))]
    # predictions are for a surface that stood still
    moved = [table.name for table in comparison_tables(whole(some), moved=True)]
    assert moved == [name for name in names if not name.startswith("predicted")]
    (first, *_) = predicted_classes([replace(s, light_a=None, light_b=None) for s in some])
    assert first.by == "range"


def test_the_band_about_predictions_stays_in_its_panel() -> None:
    """Beyond it, it would be drawn over what stands above, on paper on the page before."""
    pictures = {one.name: one for one in comparison_pictures(whole(sites(3)))}
    drawing = pictures["predicted-observed"].drawing
    (panel,) = drawing.marks
    paths = {dict(mark.attributes)["class"]: mark for mark in panel.inner if mark.tag == "path"}
    places = re.findall(r"[ML]?([\d.-]+) ([\d.-]+)", dict(paths["area s0"].attributes)["d"])
    top = float(re.match(r"M[\d.]+ ([\d.]+)V", dict(paths["axis"].attributes)["d"])[1])
    assert len(places) == 4
    assert min(float(y) for _, y in places) >= top
