"""Tables of the reduction of raw files: numbers as they were reduced, nothing where nothing was."""

import numpy as np
import pytest

from tribrach.io.survey.totalstation import survey_of
from tribrach.io.totalstation.recorder import Recorder
from tribrach.report.chapters.reductions import reductions
from tribrach.report.columns import ColumnSet
from tribrach.report.numbers import Style
from tribrach.units import GON

COLLIMATION, INDEX = 0.0015 * GON, -0.0008 * GON


@pytest.fixture
def chapter(tmp_path):
    """Two sets in both faces to three targets, a closed horizon in the first half-set."""
    recorder = Recorder(tmp_path / "field.raw", "test")
    recorder.instrument = "T2"
    recorder.setup(1, "S", height=1.5)
    targets = [("A", 0.0), ("B", 1.0), ("C", 2.5)]
    line = 2
    for _ in range(2):
        for face, order in ((1, [*targets, targets[0]]), (2, targets[::-1])):
            sign = 1 if face == 1 else -1
            for k, (target, direction) in enumerate(order):
                h = direction + sign * COLLIMATION + (np.pi if face == 2 else 0) + (k == 3) * 1e-5
                zenith = np.pi / 2 if face == 1 else 1.5 * np.pi
                recorder.shot(
                    line, target, direction=h % (2 * np.pi), zenith=zenith + INDEX, distance=30.0
                )
                line += 1
    return reductions(survey_of([recorder.finish()]).facts)


def test_axis_errors_and_rounds(chapter):
    (day,) = chapter.days
    assert (day.instrument, day.setups, day.sights, day.pairs) == ("T2", 1, 14, 6)
    # the closing sight is part of the mean of its face
    assert day.collimation == pytest.approx(COLLIMATION, abs=2e-6)
    assert day.index == pytest.approx(INDEX, abs=1e-12)
    (setup,) = chapter.rounds
    assert (setup.station, setup.targets, setup.sets, setup.dof) == ("S", 3, 2, 2)
    assert setup.sigma_direction == pytest.approx(0.0, abs=1e-12)
    assert [c.target for c in chapter.closures] == ["A", "A"]
    assert chapter.closures[0].difference == pytest.approx(1e-5, abs=1e-12)
    assert len(chapter.sets) == 6


def test_tables(chapter):
    tables = {t.name: t for t in chapter.tables(ColumnSet(Style("gon")))}
    assert set(tables) == {"axes", "rounds", "sets", "closures"}
    heads = [c.head for c in tables["axes"].columns]
    row = dict(zip(heads, [c.text for c in tables["axes"].rows[0].cells], strict=True))
    assert row["File"] == "field.raw"
    assert row["index"] == "-0.80"
    assert len(tables["sets"].rows) == 6
    assert len(chapter.tables(ColumnSet(Style("deg")))[2].first(2).rows) == 2


def test_no_raw_files():
    assert reductions(()) is None
