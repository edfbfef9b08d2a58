"""All baselines of a session: chosen, computed one after the other, correlated.

Each baseline starts at a station whose coordinates are known, given or just computed. If none is
known, the header of the first file gives them, with a warning: ten metres of error there turn and
stretch a baseline by about one part in a million.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.gnss.antennas import AntennaSetup
from tribrach.gnss.baseline import Baseline, Processing, compute_baseline
from tribrach.gnss.observation_file import ObservationFile, read_observations
from tribrach.gnss.sessions import independent_baselines, session_covariance

__all__ = ["Occupation", "SessionResult", "SessionWish", "run_sessions"]

Array = NDArray[np.float64]
Progress = Callable[[str, int, int | None], None]


@dataclass(frozen=True)
class Occupation:
    """A receiver over a point; antenna and height [m] None as its file says."""

    point: str
    file: Path
    antenna: str | None = None
    height: float | None = None


@dataclass(frozen=True)
class SessionWish:
    """Receivers that observed together, their orbits, the centre of a star if there is one."""

    name: str
    occupations: tuple[Occupation, ...]
    navigation: tuple[Path, ...]
    star: str | None = None


@dataclass(frozen=True)
class SessionResult:
    """Baselines of a session with names of points, and their joint covariance (3m, 3m)."""

    name: str
    baselines: tuple[Baseline, ...]
    covariance: Array
    warnings: tuple[str, ...] = ()


def run_sessions(
    sessions: Sequence[SessionWish],
    known: Mapping[str, Array],
    processing: Processing,
    progress: Progress = lambda what, done, total: None,
) -> tuple[SessionResult, ...]:
    """Baselines of all sessions; known : ECEF (3,) of points by name, the surest first.

    Raises
    ------
    InputError : as :func:`~tribrach.gnss.baseline.compute_baseline`, with the session's name.
    """
    places = dict(known)
    total = sum(len(session.occupations) - 1 for session in sessions)
    results: list[SessionResult] = []
    done = 0
    progress("GNSS baselines", 0, total)
    for session in sessions:
        result = _run(session, places, processing, partial(_step, progress, done, total))
        for baseline in result.baselines:
            places.setdefault(baseline.names[1], baseline.rover)
        done += len(result.baselines)
        results.append(result)
    return tuple(results)


def _step(progress: Progress, done: int, total: int, more: int) -> None:
    progress("GNSS baselines", done + more, total)


def _run(
    session: SessionWish,
    places: Mapping[str, Array],
    processing: Processing,
    step: Callable[[int], None],
) -> SessionResult:
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
        found = _baseline(session, files, a, b, own, processing)
        own.setdefault(names[b], found.rover)
        baselines.append(found)
        step(k + 1)
    blocks = np.array([baseline.covariance for baseline in baselines])
    return SessionResult(
        session.name, tuple(baselines), session_covariance(pairs, blocks), tuple(warnings)
    )


def _pairs(
    session: SessionWish, files: Sequence[ObservationFile], own: Mapping[str, Array]
) -> list[tuple[int, int]]:
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
    session: SessionWish,
    files: Sequence[ObservationFile],
    a: int,
    b: int,
    own: Mapping[str, Array],
    processing: Processing,
) -> Baseline:
    ends = [session.occupations[k] for k in (a, b)]
    setups = []
    for occupation, file in zip(ends, (files[a], files[b]), strict=True):
        setup = AntennaSetup.of(file, height=occupation.height)
        setups.append(
            setup if occupation.antenna is None else replace(setup, type=occupation.antenna)
        )
    found = compute_baseline(
        ends[0].file,
        ends[1].file,
        session.navigation,
        own[ends[0].point],
        processing,
        base_antenna=setups[0],
        rover_antenna=setups[1],
    )
    return replace(found, names=(ends[0].point, ends[1].point))
