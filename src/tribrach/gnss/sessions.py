"""Baselines of sessions: which ones are independent, their computation and their correlation.

n receivers that observe together give n - 1 independent baselines; all others are combinations of
them and would pretend a check that they do not give (method section 2.7). The shortest ones are
taken: a minimum spanning tree, or a star around one station. Each baseline starts at a station
whose coordinates are known, given or just computed. If none is known, the header of the first file
gives them, with a warning: ten metres of error there turn and stretch a baseline by about one part
in a million.

Two baselines that share a receiver share its errors. The variances of n - 1 baselines leave one
number open in those of n receivers; taken are the receivers that are most alike (least scatter of
the logarithms). Where all are, the correlation is 1/2, the same as that of single differences
(Hofmann-Wellenhof, Lichtenegger and Wasle 2008, GNSS, section 6.3); over all baselines of the
session it is ``B^T diag(r) B`` with the incidence matrix B of the tree, scaled to ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar, nnls
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

from tribrach._types import Array, Progress
from tribrach.errors import InputError
from tribrach.gnss.antennas import AntennaSetup
from tribrach.gnss.baseline import Baseline, Processing, compute_baseline
from tribrach.gnss.session_part import SOURCE, RepeatedBaseline, repeated
from tribrach.io.gnss.observation_file import RinexObservations, read_observations
from tribrach.sentences import Sentence

#: of the variance of the worst baseline, that no receiver falls below
_LEAST = 1e-6


def independent_baselines(
    positions: Array, known: Sequence[int], *, star: int | None = None
) -> list[tuple[int, int]]:
    """The n - 1 baselines (from, to) of stations (n, 3) [m], from ``known`` ones or the first."""
    n = len(positions)
    root = star if star is not None else (known[0] if len(known) else 0)
    if star is not None:
        return [(star, k) for k in range(n) if k != star]
    if n < 2:
        return []
    # equal positions are still two stations
    apart = np.linalg.norm(positions[:, None] - positions[None], axis=2)
    distance = np.maximum(apart, 1e-3)
    tree = minimum_spanning_tree(distance)
    order, before = breadth_first_order(tree, root, directed=False)
    return [(int(before[k]), int(k)) for k in order[1:]]


def session_covariance(
    baselines: Sequence[tuple[int, int]] | Sequence[tuple[str, str]], covariance: Array
) -> Array:
    """Joint covariance (3m, 3m) [m^2] of m independent baselines (from, to) of one session."""
    m = len(baselines)
    names = {name: k for k, name in enumerate(dict.fromkeys(np.ravel(baselines).tolist()))}
    incidence = np.zeros((len(names), m))
    for k, (a, b) in enumerate(baselines):
        incidence[names[a], k], incidence[names[b], k] = -1.0, 1.0
    each = _of_receivers(incidence, np.trace(covariance, axis1=1, axis2=2))
    shared = incidence.T @ (each[:, None] * incidence)
    size = np.sqrt(np.diag(shared))
    correlation = shared / np.outer(size, size)
    values, axes = np.linalg.eigh(covariance)
    roots = np.einsum("nij,nj,nkj->nik", axes, np.sqrt(values), axes)
    joint: Array = np.einsum("aij,ab,bjk->aibk", roots, correlation, roots)
    return joint.reshape(3 * m, 3 * m)


def _of_receivers(incidence: Array, variance: Array) -> Array:
    """Variances (n,) of receivers that add to those of the baselines (n - 1,) of a tree, scaled."""
    variance = variance / variance.max()
    ends = np.abs(incidence.T)
    one = np.linalg.lstsq(ends, variance, rcond=None)[0]
    # what is added at one end is taken away at the other
    open_ = np.sign(np.linalg.svd(ends)[2][-1])
    low = float((-one[open_ > 0]).max(initial=-np.inf))
    high = float(one[open_ < 0].min(initial=np.inf))
    if not low < high:
        # no receivers explain all of them
        each = nnls(ends, variance)[0]
        return np.asarray(np.maximum(each, _LEAST))

    def scatter(step: float) -> float:
        return float(np.var(np.log(one + step * open_)))

    best = minimize_scalar(scatter, bounds=(low, high), options={"xatol": 1e-9})
    return np.asarray(one + float(best.x) * open_)


@dataclass(frozen=True)
class Occupation:
    """A receiver over a point."""

    point: str  #: name of the point
    file: Path  #: its RINEX observations
    antenna: str | None = None  #: IGS name with dome; None takes that of the file
    #: of the antenna reference point over the mark [m]; None takes that of the file
    height: float | None = None


@dataclass(frozen=True)
class ReceiverSession:
    """Receivers that observed together."""

    name: str  #: of the session
    occupations: tuple[Occupation, ...]  #: the receivers
    navigation: tuple[Path, ...]  #: files of orbits
    star: str | None = None  #: point from which all baselines are taken; None for the shortest ones


@dataclass(frozen=True)
class SessionResult:
    """Baselines of a session."""

    name: str  #: of the session
    baselines: tuple[Baseline, ...]  #: m baselines with names of points
    covariance: Array  #: (3m, 3m), of all baselines [m^2]
    warnings: tuple[str, ...] = ()  #: sentences


def run_sessions(
    sessions: Sequence[ReceiverSession],
    known: Mapping[str, Array],
    processing: Processing,
    progress: Progress = lambda what, done, total: None,
) -> tuple[SessionResult, ...]:
    """Baselines of all sessions in order; ``known`` ECEF (3,) [m], the most certain first."""
    places = dict(known)
    total = sum(len(session.occupations) - 1 for session in sessions)
    results: list[SessionResult] = []
    done = 0
    progress("GNSS baselines", 0, total)
    for session in sessions:
        step = partial(_step, progress, done, total)
        result = _run(session, places, processing, step, progress)
        for baseline in result.baselines:
            places.setdefault(baseline.names[1], baseline.rover)
        done += len(result.baselines)
        results.append(result)
    return tuple(results) if processing.session is not None else with_repeats(results)


def with_repeats(results: Sequence[SessionResult]) -> tuple[SessionResult, ...]:
    """Sessions whose constant parts are learned from fixed baselines that several of them have."""
    by_ends: dict[tuple[str, ...], list[Baseline]] = {}
    for result in results:
        for baseline in result.baselines:
            if baseline.ambiguities == "fixed" and baseline.session_part is not None:
                by_ends.setdefault(tuple(sorted(baseline.names)), []).append(baseline)
    sets = [found for found in by_ends.values() if len(found) > 1]
    if not sets:
        return tuple(results)
    plan, up = repeated([_repeats(found) for found in sets])
    count = sum(map(len, sets)) - len(sets)
    source = Sentence(
        "{SOURCE}, times {plan:2} and {up:2} by {count} repetitions of baselines",
        SOURCE=SOURCE,
        plan=plan,
        up=up,
        count=count,
    )
    out = []
    for result in results:
        new = []
        for baseline in result.baselines:
            part = baseline.session_part
            if part is not None:
                part = replace(part, plan=plan * part.plan, up=up * part.up, source=source)
            new.append(baseline.with_session(part))
        ends = [baseline.names for baseline in new]
        blocks = np.array([baseline.covariance for baseline in new])
        out.append(
            replace(result, baselines=tuple(new), covariance=session_covariance(ends, blocks))
        )
    return tuple(out)


def _repeats(found: Sequence[Baseline]) -> RepeatedBaseline:
    """Baselines of the same two points, all in the direction of the first."""
    first = found[0]
    assert first.session_part is not None
    vectors = [b.vector if b.names == first.names else -b.vector for b in found]
    own = np.array([b.own for b in found])
    return RepeatedBaseline(np.array(vectors), own, first.base, first.session_part)


def _step(progress: Progress, done: int, total: int, more: int) -> None:
    progress("GNSS baselines", done + more, total)


def _run(
    session: ReceiverSession,
    places: Mapping[str, Array],
    processing: Processing,
    step: Callable[[int], None],
    progress: Progress,
) -> SessionResult:
    """Baselines of one session, each from a point that is known or has just been computed."""
    files = [read_observations(o.file) for o in session.occupations]
    names = [o.point for o in session.occupations]
    own = dict(places)
    warnings = []
    if not any(name in own for name in names):
        first = next((k for k, f in enumerate(files) if np.isfinite(f.approximate).all()), None)
        if first is None:
            raise InputError(
                f"no point of session {session.name} has coordinates, and no header gives any",
                file=files[0].path,
                cure="give coordinates of a point of the session",
            )
        own[names[first]] = files[first].approximate
        warnings.append(
            f"session {session.name}: no point has coordinates; baselines start at those of the "
            f"header of {files[first].path.name}, and ten metres of error there are one part in a "
            "million of their length"
        )
    pairs = _pairs(session, files, own)
    baselines = []
    for k, (a, b) in enumerate(pairs):
        result = _baseline(session, files, a, b, own, processing, progress)
        own.setdefault(names[b], result.rover)
        baselines.append(result)
        step(k + 1)
    blocks = np.array([baseline.covariance for baseline in baselines])
    return SessionResult(
        session.name, tuple(baselines), session_covariance(pairs, blocks), tuple(warnings)
    )


def _pairs(
    session: ReceiverSession, files: Sequence[RinexObservations], own: Mapping[str, Array]
) -> list[tuple[int, int]]:
    """Indices (from, to) of the baselines to compute."""
    names = [o.point for o in session.occupations]
    near = np.array([own.get(n, f.approximate) for n, f in zip(names, files, strict=True)])
    missing = np.isnan(near).any(axis=1)
    near[missing] = near[~missing].mean(axis=0)
    # in the order of the coordinates: the surest come first
    known = [names.index(name) for name in own if name in names]
    star = None if session.star is None else names.index(session.star)
    if star is not None and names[star] not in own:
        raise InputError(
            f"the centre {session.star} of session {session.name} has no coordinates",
            cure="give its coordinates, or leave star out",
        )
    return independent_baselines(near, known, star=star)


def _baseline(
    session: ReceiverSession,
    files: Sequence[RinexObservations],
    a: int,
    b: int,
    own: Mapping[str, Array],
    processing: Processing,
    progress: Progress,
) -> Baseline:
    """The baseline between the receivers ``a`` and ``b`` of a session, with names of points."""
    ends = [session.occupations[k] for k in (a, b)]
    setups = []
    for occupation, file in zip(ends, (files[a], files[b]), strict=True):
        setup = AntennaSetup.of(file, height=occupation.height)
        setups.append(
            setup if occupation.antenna is None else replace(setup, type=occupation.antenna)
        )
    baseline = compute_baseline(
        ends[0].file,
        ends[1].file,
        session.navigation,
        own[ends[0].point],
        processing,
        base_antenna=setups[0],
        rover_antenna=setups[1],
        progress=progress,
    )
    return replace(baseline, names=(ends[0].point, ends[1].point))
