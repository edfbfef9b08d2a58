"""Decisions by hand hold in what was measured of marks alone, before targets are named."""

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.job.edits import decided_marks
from tribrach.job.name_targets import known_points, marks_are_open
from tribrach.network.survey import Survey
from tribrach.observations.control import Coordinates
from tribrach.observations.gnss import GnssBaselines
from tribrach.project.edits import Edits, ObservationEdit, RoleEdit

A, C, P = np.array([0.0, 0, 0]), np.array([100.0, 0, 0]), np.array([50.0, 40, 5])


def role(point: str, what: str) -> Edits:
    return Edits.model_validate({"role": [{"point": point, "role": what, "reason": "pillar"}]})


def survey(form: str = "table") -> Survey:
    """Control A, check C, and P measured from both; coordinates in a table or with the point."""
    out = Survey()
    for name, xyz, what in (("A", A, "control"), ("C", C, "check")):
        if form == "table":
            out.point(name, xyz, role=what)
            out.add(
                Coordinates,
                values=[xyz],
                sigma=1e-3,
                position=[name],
                group="control",
                use=[0 if what == "control" else 1],
            )
        else:
            out.point(name, xyz, role=what, covariance=np.eye(3) * 1e-6)
    out.add(
        GnssBaselines,
        values=[P - A, P - C],
        sigma=[[1e-3] * 3, [2e-3] * 3],
        start=["A", "C"],
        end=["P", "P"],
        source=["v:1", "v:2"],
    )
    return out


@pytest.mark.parametrize("form", ["table", "point"])
def test_a_check_point_becomes_control(form: str) -> None:
    before = known_points(survey(form))
    after = known_points(survey(form), role("C", "control"))
    np.testing.assert_allclose(after["P"][0], P, atol=1e-9)
    # two independent ways, each of control and vector
    a, c = 1e-6 + 1e-6, 1e-6 + 4e-6
    assert before["P"][1] == pytest.approx(np.sqrt(a), rel=1e-6)
    assert after["P"][1] == pytest.approx(np.sqrt(a * c / (a + c)), rel=1e-6)


def test_what_a_file_switched_off_comes_back() -> None:
    one = survey()
    one.tables()[-1].columns["use"] = np.array([2, 0])
    edits = Edits(edit=(ObservationEdit(observation="v:1", use="active", reason="seen again"),))
    assert np.sqrt(2e-6) == pytest.approx(known_points(one, edits)["P"][1], rel=1e-6)
    assert "P" not in known_points(one)


@pytest.mark.parametrize("form", ["table", "point"])
def test_marks_that_a_decision_leaves_open_are_looked_for_where_they_were(form: str) -> None:
    freed = role("A", "free")
    np.testing.assert_allclose(known_points(survey(form), freed)["P"][0], P, atol=1e-9)
    assert marks_are_open(survey(form), freed)
    assert not marks_are_open(survey(form), Edits())
    both = Edits(role=(*freed.role, *role("C", "control").role))
    assert not marks_are_open(survey(form), both)
    np.testing.assert_allclose(known_points(survey(form), both)["P"][0], P, atol=1e-9)


def test_held_coordinates_are_released() -> None:
    one = Survey()
    one.point("A", A, role="fixed", free=(False,) * 3)
    one.point("C", C, role="fixed", free=(False,) * 3)
    one.add(GnssBaselines, values=[P - A, P - C], sigma=1e-3, start=["A", "C"], end="P")
    edits = Edits(role=(RoleEdit(point="C", role="check", reason="pillar"),))
    part = decided_marks(one, edits)
    assert part.points["C"].free.all()
    assert not part.points["A"].free.any()
    assert known_points(one, edits)["P"][1] == pytest.approx(1e-3, rel=1e-6)
    assert known_points(one)["P"][1] == pytest.approx(1e-3 / np.sqrt(2), rel=1e-6)


def test_what_cannot_be_done_is_said_and_what_is_elsewhere_is_passed_over() -> None:
    with pytest.raises(InputError, match="role 1: point P has no given coordinates that could be"):
        known_points(survey(), role("P", "control"))
    other = Edits(
        edit=(ObservationEdit(observation="target_centre:S1:P::1", use="off", reason="wet"),),
        role=(RoleEdit(point="Z", role="check", reason="pillar"),),
    )
    np.testing.assert_allclose(known_points(survey(), other)["P"][0], P, atol=1e-9)
