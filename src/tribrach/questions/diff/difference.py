"""Two results of one job: what moved, which sigmas changed, which observations changed state.

A shift is called moved only after a test against the covariance of the difference. Two results are
seldom independent: they share observations, so that their covariances do not add up. What is known
of the difference depends on which measurements they share (method section 11.7).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_type_hints

import numpy as np

from tribrach._types import Array
from tribrach.answers import Number, Result
from tribrach.errors import InputError
from tribrach.geometry import rotation
from tribrach.network.significance import sidak
from tribrach.statistics import chi2

Common = Literal["same", "nested", "disjoint", "overlapping", "model", "datum"]
Key = tuple[str, str]

#: to what coordinates are exact [m]: rounding, the last iteration, other points of linearisation
_EXACT = 1e-6
#: variance of a difference over that of the place below which a direction cannot be tested:
#: covariances from other points of linearisation agree no better
_SHARE = 1e-3
#: sigma of a difference over what coordinates are exact to, below which it cannot be tested
_ABOVE = 3.0


@dataclass(frozen=True)
class Sigma0Change(Result):
    """Sigma of unit weight of both."""

    posterior: tuple[float | None, float | None]
    dof: tuple[int, int]
    accepted: tuple[bool | None, bool | None]


@dataclass(frozen=True)
class PlaceChange(Result, also=("moved",)):
    """A point or station that both have."""

    name: str
    what: Literal["point", "station"]
    shift: tuple[Number, Number, Number]  #: second minus first along E, N, U [m]
    length: float  #: of the shift [m]
    turn: Number  #: of a station [rad]
    #: root of the sum of the variances of the coordinates, first and second [m]
    sigma: tuple[Number, Number]
    #: the same of the shift, at most where the covariance of both is not known; null where no
    #: measurement differs
    difference_sigma: Number = math.nan
    #: squared shift in the metric of its covariance, a lower bound where that is an upper one
    test: Number = math.nan
    limit: Number = math.nan
    #: directions in which the shift can be tested; 0 where it cannot be told, null where nothing
    #: is tested
    freedom: int | None = None

    @property
    def moved(self) -> bool:
        """Is the test beyond its limit?"""
        return self.test > self.limit

    @property
    def tested(self) -> bool:
        """Is there a test?"""
        return math.isfinite(self.test)


@dataclass(frozen=True)
class ObservationChange(Result):
    """An observed value that is not the same in both."""

    id: str
    component: str
    kind: str
    from_: str
    to: str
    change: Literal["state", "value", "sigma", "only in the first", "only in the second"]
    #: state in both, "" where it is absent
    states: tuple[str, str]
    reason: str
    w: tuple[float | None, float | None]

    @property
    def told(self) -> str:
        """The change in words."""
        return " to ".join(self.states) if self.change == "state" else self.change


@dataclass(frozen=True)
class ResultDifference(Result):
    """What differs between two results."""

    first: str
    second: str
    #: how the measurements of both belong together
    common: Common
    sigma0: Sigma0Change
    places: tuple[PlaceChange, ...]
    #: points and stations of one of them alone
    only_first: tuple[str, ...]
    only_second: tuple[str, ...]
    observations: tuple[ObservationChange, ...]
    #: what was changed by hand in one of them alone
    edits_only_first: tuple[dict[str, str], ...]
    edits_only_second: tuple[dict[str, str], ...]


#: what an observation has where it is in the other result alone
_ABSENT: Mapping[str, Any] = {"state": "", "w": None}
#: kinds of changes in the order in which they are told
_ORDER = get_args(get_type_hints(ObservationChange)["change"])


@dataclass(frozen=True)
class _Result:
    """The parts of a result that are compared."""

    data: Mapping[str, Any]
    active: Mapping[Key, tuple[float, float]]
    rows: Mapping[Key, Mapping[str, Any]]
    factor: float

    @classmethod
    def of(cls, data: Mapping[str, Any], name: str) -> _Result:
        """Take it out of the keys of the file."""
        try:
            rows: dict[Key, Mapping[str, Any]] = {
                (row["id"], row["component"]): row for row in data["observations"]
            }
            active = {
                key: (float(row["value"]), float(row["sigma"]))
                for key, row in rows.items()
                if row["state"] == "active"
            }
            sigma0 = data["sigma0"]
            factor = 1.0
            if sigma0["covariances"] == "posterior" and sigma0["posterior"]:
                factor = (float(sigma0["posterior"]) / float(sigma0["prior"])) ** 2
            for key in ("points", "stations", "calibrations", "planes", "lever_arms", "edits"):
                len(data[key])
            str(data["datum"]["statement"])
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(
                f"this result lacks what is compared ({error})", file=name,
                cure="run the project again",
            ) from error  # fmt: skip
        return cls(data, active, rows, factor)


def difference(
    first: Mapping[str, Any],
    second: Mapping[str, Any],
    names: tuple[str, str] = ("first", "second"),
    *,
    confidence: float = 0.95,
) -> ResultDifference:
    """What differs between two results, second minus first, given as keys of ``result.json``.

    ``confidence`` is that of all tests together: the share of clean pairs of results in which
    nothing is called moved.
    """
    a, b = _Result.of(first, names[0]), _Result.of(second, names[1])
    common = _common(a, b)
    try:
        places = _places(a, b, common, confidence)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError(
            f"coordinates or covariances of these results cannot be read ({error})",
            file=names[1], cure="run both projects again",
        ) from error  # fmt: skip
    one, other = a.data["sigma0"], b.data["sigma0"]
    inside = [{*r.data["points"], *_posed(r)} for r in (a, b)]
    edits = a.data["edits"], b.data["edits"]
    return ResultDifference(
        *names,
        common,
        Sigma0Change(
            (one["posterior"], other["posterior"]),
            (one["dof"], other["dof"]),
            (one["global_test"]["accepted"], other["global_test"]["accepted"]),
        ),
        tuple(places),
        tuple(sorted(inside[0] - inside[1])),
        tuple(sorted(inside[1] - inside[0])),
        tuple(_observations(a, b)),
        tuple(e for e in edits[0] if e not in edits[1]),
        tuple(e for e in edits[1] if e not in edits[0]),
    )


def _common(a: _Result, b: _Result) -> Common:
    """How the measurements of both belong together."""
    for key in ("kind", "names"):
        if a.data["datum"][key] != b.data["datum"][key]:
            return "datum"
    shared = {
        key
        for key in a.active.keys() & b.active.keys()
        if all(map(_alike, a.active[key], b.active[key]))
    }
    unknowns = [
        {name: set(r.data[name]) for name in ("calibrations", "planes", "lever_arms")}
        for r in (a, b)
    ]
    alike = unknowns[0] == unknowns[1]
    only = len(a.active) - len(shared), len(b.active) - len(shared)
    if not shared:
        return "disjoint"
    if not alike:
        return "model"
    if only == (0, 0):
        return "same"
    return "nested" if 0 in only else "overlapping"


def _alike(one: float, other: float) -> bool:
    """True for one number written twice."""
    return math.isclose(one, other, rel_tol=1e-12)


def _posed(result: _Result) -> list[str]:
    """Names of the stations with a pose."""
    return [n for n, s in result.data["stations"].items() if s["world_from_scanner"] is not None]


def _places(a: _Result, b: _Result, common: Common, confidence: float) -> list[PlaceChange]:
    """Points and stations that both have, the most significant first."""
    names: list[tuple[Literal["point", "station"], str]]
    names = [("point", name) for name in a.data["points"] if name in b.data["points"]]
    other = set(_posed(b))
    names += [("station", name) for name in _posed(a) if name in other]
    alpha = sidak(1 - confidence, len(names))
    changes = [_place(a, b, what, name, common, alpha) for what, name in names]
    return sorted(changes, key=lambda c: (-np.nan_to_num(c.test / c.limit), -c.length))


def _place(
    a: _Result,
    b: _Result,
    what: Literal["point", "station"],
    name: str,
    common: Common,
    alpha: float,
) -> PlaceChange:
    """One of them."""
    one, other = (_xyz(r, what, name) for r in (a, b))
    covariances = [_covariance(r, what, name) for r in (a, b)]
    known = np.isfinite(one) & np.isfinite(other)
    shift = np.where(known, other - one, np.nan)
    turn = math.nan
    if what == "station":
        poses = [np.array(r.data["stations"][name]["world_from_scanner"], float) for r in (a, b)]
        turn = float(np.linalg.norm(rotation.log(poses[1][:3, :3] @ poses[0][:3, :3].T)))
    metric = _of_difference(a, b, covariances, common)
    tested: dict[str, Any] = {}
    if metric is not None and known.any():
        at = np.ix_(known, known)
        inner = metric[at]
        whole = max(
            (c[at] / r.factor for c, r in zip(covariances, (a, b), strict=True)),
            key=lambda c: float(np.trace(c)),
        )
        found, freedom = _statistic(shift[known], inner, whole)
        if common == "nested" and found > _most(a, b):
            freedom = 0
        tested = {"difference_sigma": _spread(inner, 0.0), "freedom": freedom}
        if freedom:
            tested |= {"test": found, "limit": float(chi2.ppf(1 - alpha, freedom))}
    east, north, up = shift.tolist()
    return PlaceChange(
        name,
        what,
        (east, north, up),
        float(np.sqrt(np.nansum(shift**2))),
        turn,
        (_spread(covariances[0]), _spread(covariances[1])),
        **tested,
    )


def _spread(covariance: Array, least: float = math.nan) -> float:
    """Root of the sum of the variances; where there is none the least."""
    total = float(np.trace(covariance))
    return math.sqrt(total) if total > 0 else least


def _xyz(result: _Result, what: str, name: str) -> Array:
    """Coordinates [m], NaN where there are none."""
    if what == "point":
        values = result.data["points"][name]["xyz"]
    else:
        values = [row[3] for row in result.data["stations"][name]["world_from_scanner"][:3]]
    return np.array([np.nan if v is None else float(v) for v in values])


def _covariance(result: _Result, what: str, name: str) -> Array:
    """Covariance (3, 3) of the place [m^2] as the file states it, zero where it is held."""
    rows = result.data["points" if what == "point" else "stations"][name]["covariance"]
    matrix = np.array([[0.0 if v is None else float(v) for v in row] for row in rows])
    if matrix.shape not in ((3, 3), (6, 6)):
        raise ValueError(f"the covariance of {name} has {matrix.shape} elements")
    return matrix[:3, :3]


def _of_difference(
    a: _Result, b: _Result, covariances: Sequence[Array], common: Common
) -> Array | None:
    """Covariance (3, 3) of the difference a priori, or an upper bound; None if no test holds."""
    one, other = covariances[0] / a.factor, covariances[1] / b.factor
    if common in ("same", "datum"):
        return None
    if common == "disjoint":
        return one + other
    if common == "nested":
        return one - other if len(a.active) < len(b.active) else other - one
    return 2.0 * (one + other)


def _statistic(shift: Array, covariance: Array, whole: Array) -> tuple[float, int]:
    """Squared shift in the metric of its covariance, and its degrees of freedom.

    Directions in which the variance of the difference is nothing beside that of the place
    (``whole``), or beside what coordinates are exact to, tell nothing: there a shift of rounding
    would be divided by what is left of two numbers that are nearly equal. Method section 11.7.
    """
    root = np.linalg.cholesky(whole + _EXACT**2 * np.eye(len(whole)))
    inverse = np.linalg.inv(root)
    share, vectors = np.linalg.eigh(inverse @ covariance @ inverse.T)
    across = inverse.T @ vectors
    # variance that inexact coordinates have along each direction
    noise = _EXACT**2 * (across**2).sum(axis=0)
    good = share > np.maximum(_SHARE, _ABOVE**2 * noise)
    along = across[:, good].T @ shift
    return float((along**2 / share[good]).sum()), int(good.sum())


def _most(a: _Result, b: _Result) -> float:
    """What no test of a nested difference can exceed: the change of the weighted sum.

    It is the quadratic form of the differences of all unknowns together. A test beyond it shows
    that the difference of both covariances is that of their points of linearisation.
    """
    sums = [float(r.data["sigma0"]["vtpv"]) for r in (a, b)]
    return abs(sums[1] - sums[0]) * (1 + _SHARE) + _SHARE


def _observations(a: _Result, b: _Result) -> list[ObservationChange]:
    """Observed values that are not the same, those whose state changed first."""
    out = []
    for key in dict.fromkeys((*a.rows, *b.rows)):
        one, other = a.rows.get(key), b.rows.get(key)
        change = _change(one, other)
        if change is None:
            continue
        row = other or one or {}
        states = (one or _ABSENT)["state"], (other or _ABSENT)["state"]
        w = (one or _ABSENT)["w"], (other or _ABSENT)["w"]
        ends, reason = (row["kind"], row["from"], row["to"]), row.get("reason", "")
        out.append(ObservationChange(*key, *ends, change, states, reason, w))
    return sorted(out, key=lambda change: _ORDER.index(change.change))


def _change(one: Mapping[str, Any] | None, other: Mapping[str, Any] | None) -> Any:
    """First key that differs; None if all agree."""
    if one is None or other is None:
        return "only in the second" if one is None else "only in the first"
    if one["state"] != other["state"]:
        return "state"
    alike = {key: _alike(one[key], other[key]) for key in ("value", "sigma")}
    return next((key for key, same in alike.items() if not same), None)
