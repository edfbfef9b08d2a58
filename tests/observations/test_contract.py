"""The contract of every observation kind: its Jacobian is the derivative of its prediction.

Each kind's analytic Jacobian, whitened, is compared with central differences through the
manifold update of the state, at states drawn by hypothesis, on flat and ellipsoidal sites.
"""

import importlib
import inspect
import pkgutil
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

import tribrach.observations as package
from tests.observations.examples import BUILDERS, LAYOUT, SITES, build, draw_state
from tribrach.errors import InputError
from tribrach.geometry import rotation
from tribrach.network.assembly import inverse_cholesky
from tribrach.observations.base import Observations, norm
from tribrach.observations.declaration import (
    Category,
    CsvColumns,
    End,
    KindFacts,
    ObservedAxes,
    Repetition,
    Role,
    StartTie,
)
from tribrach.observations.poses import RelativePoses, RotationComponents
from tribrach.observations.registry import kind_named
from tribrach.observations.registry import kinds as registered
from tribrach.observations.ties import (
    Faces,
    Fixes,
    Lengths,
    Links,
    Rays,
    Rises,
    ScannerShots,
    TieCollector,
    TieTable,
    Vectors,
    Zeniths,
)
from tribrach.observations.unknowns import FAMILIES, State


def kinds() -> list[type[Observations]]:
    """Every concrete kind in the package."""
    found = {}
    for module in pkgutil.iter_modules(package.__path__):
        names = vars(importlib.import_module(f"{package.__name__}.{module.name}"))
        for value in names.values():
            if not (inspect.isclass(value) and issubclass(value, Observations)):
                continue
            if not inspect.isabstract(value) and hasattr(value, "kind"):
                found[value.kind] = value
    return [found[name] for name in sorted(found)]


KINDS = kinds()


def dense(observations: Observations, state: State) -> np.ndarray:
    """Jacobian (n, rows, size) from the blocks."""
    n, rows = observations.values.shape
    out = np.zeros((n, rows, LAYOUT.size + 1))
    for block in observations.jacobian(state):
        columns = np.broadcast_to(block.columns, (n, block.columns.shape[1]))
        values = np.broadcast_to(block.values, (n, rows, columns.shape[1]))
        for k in range(columns.shape[1]):
            np.add.at(
                out,
                (np.arange(n)[:, None], np.arange(rows), columns[:, k][:, None]),
                values[:, :, k],
            )
    return out[:, :, :-1]


def numeric(observations: Observations, state: State) -> np.ndarray:
    """Fourth-order central differences of the prediction through the manifold update."""
    out = np.zeros((*observations.values.shape, LAYOUT.size))
    here = observations.misclosure(state)
    for column in range(LAYOUT.size):
        # small against the closest sight and against the distance from a pole
        step = 1e-3 if LAYOUT.describe(column)[0] in ("point", "vector") else 1e-4
        if "height" in observations.kind or observations.kind in ("latitude", "longitude"):
            step *= 1000  # these come out of numbers of Earth size and are nearly linear
        for factor, weight in ((2, -1 / 12), (1, 2 / 3), (-1, -2 / 3), (-2, 1 / 12)):
            delta = np.zeros(LAYOUT.size)
            delta[column] = factor * step
            change = here - observations.misclosure(state.retract(delta))
            for row in observations.angular:
                change[:, row] = np.remainder(change[:, row] + np.pi, 2 * np.pi) - np.pi
            out[:, :, column] += weight * change / step
    return out


def at_truth(kind: type[Observations], seed: int, site_number: int) -> tuple[Observations, State]:
    """Observations whose values are those of the state."""
    rng = np.random.default_rng(seed)
    state = draw_state(rng)
    if kind.kind == "inclination":  # an inclinometer that lies on its side measures nothing
        tilt = rotation.exp(rng.uniform(-0.5, 0.5, state.pose_t.shape))
        state = replace(state, pose_r=tilt @ rotation.exp(np.outer([1.0, 2.0, -3.0], [0, 0, 1])))
    observations = build(kind, rng, SITES[site_number])
    turning = isinstance(observations, RelativePoses | RotationComponents)
    if turning and norm(observations._turn(state)).max() > 3.0:
        reject()  # a rotation vector jumps at half a turn
    try:
        return replace(observations, values=observations.predict(state)), state
    except InputError:
        reject()  # a target that no scanner can measure


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: k.kind)
def test_every_kind_has_an_example(kind: type[Observations]) -> None:
    assert kind.kind in BUILDERS, f"add {kind.kind} to examples.py"


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: k.kind)
@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 10**6), site=st.integers(0, len(SITES) - 1))
def test_jacobian_is_the_derivative(kind: type[Observations], seed: int, site: int) -> None:
    observations, state = at_truth(kind, seed, site)
    white = inverse_cholesky(observations.covariance)
    analytic = white @ dense(observations, state)
    truth = white @ numeric(observations, state)
    size = np.abs(truth).max(axis=(1, 2), keepdims=True)
    assert np.abs((analytic - truth) / size).max() < 1e-6


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: k.kind)
@settings(max_examples=3, deadline=None)
@given(seed=st.integers(0, 10**6), site=st.integers(0, len(SITES) - 1))
def test_misclosure_is_observed_minus_computed(
    kind: type[Observations], seed: int, site: int
) -> None:
    observations, state = at_truth(kind, seed, site)
    assert np.abs(observations.misclosure(state)).max() < 1e-9
    shifted = replace(observations, values=observations.values + 1e-3)
    assert np.allclose(shifted.misclosure(state), 1e-3, atol=1e-9)
    # a full turn more is the same angle
    turned = observations.values.copy()
    turned[:, list(kind.angular)] += 2 * np.pi
    assert np.abs(replace(observations, values=turned).misclosure(state)).max() < 1e-9


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: k.kind)
def test_every_observation_has_ends_with_names(kind: type[Observations]) -> None:
    observations = build(kind, np.random.default_rng(3), SITES[0])
    ends = observations.ends(LAYOUT)
    assert len(ends) == len(observations)
    assert all(isinstance(a, str) and a and isinstance(b, str) for a, b in ends)
    assert list(zip(*(c.tolist() for c in observations.end_names(LAYOUT)), strict=True)) == ends
    assert len(kind.components) == len(kind.units)


def test_the_registry_finds_every_kind() -> None:
    assert sorted(kind.kind for kind in registered()) == [kind.kind for kind in KINDS]
    assert all(kind_named(kind.kind) is kind for kind in KINDS)


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: k.kind)
def test_every_kind_answers_every_question(kind: type[Observations]) -> None:
    facts = vars(kind)["facts"]  # its own, not inherited from another kind
    assert isinstance(facts, KindFacts)
    assert facts.title
    assert facts.computed
    assert isinstance(facts.role, Role)
    assert isinstance(facts.category, Category)
    assert isinstance(facts.budget(True), Category)
    assert isinstance(facts.axes, ObservedAxes)
    assert isinstance(facts.repeats, Repetition)
    assert isinstance(facts.start, StartTie)
    assert all(isinstance(columns, CsvColumns) for columns in facts.csv)
    assert set(kind.units) <= {"m", "rad", "1"}
    # what nobody reads cannot be read again
    assert facts.role is Role.READING or facts.repeats is Repetition.NEVER
    assert not facts.full_circle or kind.units == ("rad",)


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: k.kind)
def test_index_fields_say_what_they_refer_to(kind: type[Observations]) -> None:
    references = kind.references()
    named = [reference for reference in references if reference.end is not None]
    assert named
    sides = {reference.end for reference in named}
    assert sides in ({End.AT}, {End.FROM, End.TO})
    assert not any(reference.optional for reference in named)
    for reference in references:
        assert reference.family in (*FAMILIES, "position")
        # an unknown that is no end has a name of its own in the report
        calibrating = reference.family == "scalar" and reference.end is None
        assert not calibrating or reference.means
        assert reference.unit in ("", "m", "rad", "1")


#: table that each kind of tie fills
TIE_TABLES: dict[StartTie, type[TieTable]] = {
    StartTie.RAY: Rays,
    StartTie.LENGTH: Lengths,
    StartTie.RISE: Rises,
    StartTie.ZENITH: Zeniths,
    StartTie.VECTOR: Vectors,
    StartTie.SHOT: ScannerShots,
    StartTie.LINK: Links,
    StartTie.FACE: Faces,
    StartTie.FIX: Fixes,
}


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: k.kind)
def test_start_ties_are_what_the_kind_says(kind: type[Observations]) -> None:
    rng = np.random.default_rng(5)
    state, observations = draw_state(rng), build(kind, rng, SITES[0])
    ties = TieCollector(state, SITES[0], state.vectors)
    observations.start_ties(np.arange(len(observations)), ties)
    filled = {table for table, parts in ties.parts.items() if len(parts) > 1}
    filled |= {Rays} if ties.north else set()
    filled |= {ScannerShots} if ties.in_frames else set()
    levelled = bool(np.isfinite(ties.levelling).any())
    assert levelled == (kind.facts.start is StartTie.LEVELLING)
    headed = bool(np.isfinite(ties.heading).any())
    assert headed == (kind.facts.start is StartTie.HEADING)
    if kind.facts.start in TIE_TABLES:
        # three points at least make a plane
        assert TIE_TABLES[kind.facts.start] in filled or kind.kind == "point_on_plane"
    else:
        assert not filled


def test_a_kind_without_facts_is_none() -> None:
    with pytest.raises(TypeError, match="declares no facts"):
        type("Forgotten", (registered()[0],), {"kind": "forgotten"})


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: k.kind)
def test_a_required_end_must_be_there(kind: type[Observations]) -> None:
    observations = build(kind, np.random.default_rng(4), SITES[0])
    reference = next(r for r in kind.references() if not r.optional)
    index = getattr(observations, reference.name).copy()
    index[2] = -1
    with pytest.raises(InputError, match=f"has no {reference.name}"):
        replace(observations, **{reference.name: index})
