"""Reactions of hard constraints against the adjustment without them."""

import numpy as np
import pytest

from tests.network.networks import trilateration
from tribrach.network.adjustment import adjust
from tribrach.network.network import Datum
from tribrach.network.reactions import constraint_reactions
from tribrach.observations.control import Coordinate
from tribrach.observations.sights import SlopeDistances


def test_the_gap_is_what_the_observations_alone_would_miss() -> None:
    free = adjust(trilateration(Datum("free")).network())
    i, j = (free.layout.index("point", name) for name in ("1", "P"))
    chord = free.state.points[j] - free.state.points[i]
    length = np.linalg.norm(chord)
    unit = chord / length
    block = free.covariance("1") + free.covariance("P")
    block = block - free.covariance("1", "P") - free.covariance("P", "1")
    survey = trilateration(Datum("free"))
    survey.add(SlopeDistances, values=[length + 0.02], hard=True, start=["1"], end=["P"])
    reactions = constraint_reactions(adjust(survey.network()))
    assert abs(reactions.gap[0]) == pytest.approx(0.02, rel=1e-3)
    assert reactions.sigma[0] == pytest.approx(np.sqrt(unit @ block @ unit), rel=1e-3)
    (said,) = reactions.sentences(critical=1.0)
    assert said.startswith("the constraint slope distance 1 -> P is contradicted")
    assert f"by -20.00 mm with a sigma of {1e3 * reactions.sigma[0]:.2f} mm, " in said


def test_a_constraint_that_only_fixes_the_datum_has_no_reaction() -> None:
    survey = trilateration(Datum("control"))
    for name, axis, value in (("1", 0, 170.71), ("1", 1, 270.71), ("2", 0, 100.0)):
        survey.add(Coordinate, values=[value], hard=True, position=[name], axis=[axis])
    adjustment = adjust(survey.network())
    assert adjustment.dof == 1
    reactions = constraint_reactions(adjustment)
    assert np.isnan(reactions.test).all()
    assert reactions.sentences() == []
