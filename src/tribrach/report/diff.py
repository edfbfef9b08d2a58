"""Two results of one job: what moved, which sigmas changed, which observations changed state.

A shift is called moved only after a test against the covariance of the difference. Two results are
seldom independent: they share observations, so that their covariances do not add up. What is known
of the difference depends on which measurements they share (method section 11.7).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry import rotation
from tribrach.network.significance import sidak
from tribrach.report.numbers import Style, counted, fixed_cell, mm_cell
from tribrach.report.schema.base import heading
from tribrach.report.schema.diff import (
    SCHEMA,
    DiffDocument,
    EditPart,
    ObservationChange,
    PlaceChange,
    Sigma0Change,
)
from tribrach.report.tables import (
    ColumnHead,
    ReportTable,
    Worst,
    build_table,
    number_cell,
    text_cell,
)
from tribrach.statistics import chi2

__all__ = ["difference", "difference_tables"]

Common = Literal["same", "nested", "disjoint", "overlapping", "model", "datum"]
Key = tuple[str, str]

#: to what coordinates are exact [m]: rounding, the last iteration, other points of linearisation
_EXACT = 1e-6
#: variance of a difference over that of the place below which a direction cannot be tested:
#: covariances from other points of linearisation agree no better
_SHARE = 1e-3
#: sigma of a difference over what coordinates are exact to, below which it cannot be tested
_ABOVE = 3.0
_NOTE = (
    "Sigmas are 3D. σ before and after are those of the place; σ of shift is that of the "
    "difference, which is smaller where both results share measurements. Test: the squared shift "
    "in the metric of its covariance, in as many directions as it has degrees of freedom."
)
_SENTENCES: dict[Common, str] = {
    "same": (
        "Both rest on the same measurements with the same sigmas: what differs comes from the "
        "model, the options or the start, and no test can call it moved."
    ),
    "nested": (
        "One rests on measurements of the other and on further ones: the covariance of the "
        "difference is the difference of both covariances. Nothing moved on site between them: "
        "what differs is due to the values that only one of them uses."
    ),
    "disjoint": (
        "They share no measurement: the covariance of the difference is the sum of both, as far "
        "as nothing else is common to them."
    ),
    "overlapping": (
        "They share some measurements, and each has others: the covariance of the difference is "
        "not known from both results. It is at most twice the sum of both, whatever they share; "
        "moved is what stands out of that."
    ),
    "model": (
        "They have different unknowns besides points and stations (calibrations, lever arms, "
        "planes): the covariance of the difference is at most twice the sum of both."
    ),
    "datum": (
        "The datum differs: coordinates move with it, so that nothing is called moved. Compare "
        "distances, or adjust both in one datum."
    ),
}


@dataclass(frozen=True)
class _Result:
    """What is compared of a result."""

    data: Mapping[str, Any]
    active: Mapping[Key, tuple[float, float]]
    rows: Mapping[Key, Mapping[str, Any]]
    factor: float

    @classmethod
    def of(cls, data: Mapping[str, Any], name: str) -> _Result:
        """Take it out of the keys of the file.

        Raises
        ------
        InputError
            A key is missing or of another kind.
        """
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
) -> DiffDocument:
    """What differs between two results.

    Parameters
    ----------
    first, second : mapping
        Keys of ``result.json`` [m, rad, m^2].
    names : (str, str)
        What they are called in messages.
    confidence : float
        Of all tests together: the share of clean pairs of results in which nothing is called moved.

    Returns
    -------
    DiffDocument
        Shifts second minus first [m], with their tests.

    Raises
    ------
    InputError
        A result lacks what is compared.
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
    observations = _observations(a, b)
    edits = [[EditPart.model_validate(e) for e in r.data["edits"]] for r in (a, b)]
    sigma0 = _sigma0(a, b)
    inside = [{*r.data["points"], *_posed(r)} for r in (a, b)]
    document = {
        "first": names[0],
        "second": names[1],
        "common": common,
        "sigma0": sigma0,
        "places": places,
        "only_first": sorted(inside[0] - inside[1]),
        "only_second": sorted(inside[1] - inside[0]),
        "observations": observations,
        "edits_only_first": [e for e in edits[0] if e not in edits[1]],
        "edits_only_second": [e for e in edits[1] if e not in edits[0]],
        "sentences": _sentences(common, places, observations, sigma0),
    }
    return DiffDocument.model_validate(heading(SCHEMA) | document)


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
    names = [("point", name) for name in a.data["points"] if name in b.data["points"]]
    other = set(_posed(b))
    names += [("station", name) for name in _posed(a) if name in other]
    alpha = sidak(1 - confidence, len(names))
    changes = [_place(a, b, what, name, common, alpha) for what, name in names]
    return sorted(changes, key=lambda c: (-((c.test or 0.0) / (c.limit or 1.0)), -c.length))


def _place(
    a: _Result, b: _Result, what: str, name: str, common: Common, alpha: float
) -> PlaceChange:
    """One of them."""
    one, other = (_xyz(r, what, name) for r in (a, b))
    covariances = [_covariance(r, what, name) for r in (a, b)]
    known = np.isfinite(one) & np.isfinite(other)
    shift = np.where(known, other - one, np.nan)
    turn = None
    if what == "station":
        poses = [np.array(r.data["stations"][name]["world_from_scanner"], float) for r in (a, b)]
        turn = float(np.linalg.norm(rotation.log(poses[1][:3, :3] @ poses[0][:3, :3].T)))
    metric = _of_difference(a, b, covariances, common)
    test, limit, sigma, freedom = None, None, None, None
    if metric is not None and known.any():
        at = np.ix_(known, known)
        inner = metric[at]
        whole = max((c[at] / r.factor for c, r in zip(covariances, (a, b), strict=True)),
                    key=lambda c: float(np.trace(c)))  # fmt: skip
        found, freedom = _statistic(shift[known], inner, whole)
        if common == "nested" and found > _most(a, b):
            freedom = 0
        sigma = float(np.sqrt(max(np.trace(inner), 0.0)))
        if freedom:
            test, limit = found, float(chi2.ppf(1 - alpha, freedom))
    return PlaceChange(
        name=name,
        what="point" if what == "point" else "station",
        shift=(_number(shift[0]), _number(shift[1]), _number(shift[2])),
        length=float(np.sqrt(np.nansum(shift**2))),
        turn=turn,
        sigma=(_spread(covariances[0]), _spread(covariances[1])),
        difference_sigma=sigma,
        test=test,
        limit=limit,
        freedom=freedom,
        moved=test is not None and limit is not None and test > limit,
    )


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _spread(covariance: Array) -> float | None:
    total = float(np.trace(covariance))
    return float(np.sqrt(total)) if total > 0 else None


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
        change = _change(a.rows.get(key), b.rows.get(key))
        if change is None:
            continue
        rows = [r.rows.get(key) for r in (a, b)]
        row = rows[1] or rows[0]
        assert row is not None
        out.append(
            ObservationChange(
                id=key[0],
                component=key[1],
                kind=row["kind"],
                from_=row["from"],
                to=row["to"],
                change=change,
                states=(_state(rows[0]), _state(rows[1])),
                reason=row.get("reason", ""),
                w=(_figure(rows[0]), _figure(rows[1])),
            )
        )
    order = ("state", "value", "sigma", "only in the first", "only in the second")
    return sorted(out, key=lambda change: order.index(change.change))


def _state(row: Mapping[str, Any] | None) -> str:
    return "" if row is None else str(row["state"])


def _figure(row: Mapping[str, Any] | None) -> float | None:
    return None if row is None else row["w"]


def _change(
    one: Mapping[str, Any] | None, other: Mapping[str, Any] | None
) -> Literal["only in the first", "only in the second", "state", "value", "sigma"] | None:
    """What is not the same of a value, None if all is."""
    if one is None:
        return "only in the second"
    if other is None:
        return "only in the first"
    if one["state"] != other["state"]:
        return "state"
    if not _alike(one["value"], other["value"]):
        return "value"
    return None if _alike(one["sigma"], other["sigma"]) else "sigma"


def _sigma0(a: _Result, b: _Result) -> Sigma0Change:
    one, other = a.data["sigma0"], b.data["sigma0"]
    return Sigma0Change(
        posterior=(one["posterior"], other["posterior"]),
        dof=(one["dof"], other["dof"]),
        accepted=(one["global_test"]["accepted"], other["global_test"]["accepted"]),
    )


def _sentences(
    common: Common,
    places: Sequence[PlaceChange],
    observations: Sequence[ObservationChange],
    sigma0: Sigma0Change,
) -> list[str]:
    """What it comes to."""
    still = all(p.length == 0.0 and p.sigma[0] == p.sigma[1] for p in places)
    if (
        common == "same"
        and still
        and not observations
        and sigma0.posterior[0] == sigma0.posterior[1]
    ):
        return [
            "Both rest on the same measurements, and they are the same: "
            f"{counted(len(places), 'place')} with their sigmas, all observed values, sigma0."
        ]
    out = [_SENTENCES[common]]
    moved = [place for place in places if place.moved]
    largest = max(places, key=lambda place: place.length, default=None)
    if moved:
        words = ", ".join(
            f"{p.name} by {1e3 * p.length:.2f} mm (test {p.test:.1f} against {p.limit:.1f} with "
            f"{counted(p.freedom or 0, 'degree')} of freedom)"
            for p in moved[:5]
        )
        more = f" and {len(moved) - 5} more" if len(moved) > 5 else ""
        verb = "place" if len(moved) == 1 else "places"
        verb += " shifted beyond the limit" if common == "nested" else " moved"
        out.append(f"{len(moved)} of {len(places)} {verb}: {words}{more}.")
    elif any(place.test is not None for place in places):
        tested = sum(place.test is not None for place in places)
        out.append(f"None of {counted(tested, 'tested place')} moved beyond its limit.")
    untold = sum(place.freedom == 0 for place in places)
    if untold:
        out.append(
            f"Of {counted(untold, 'place')} it cannot be told whether the shift is more than "
            "chance: the covariances of both results, or what coordinates are exact to, leave no "
            "variance of the difference that could be divided by."
        )
    if largest is not None:
        told = f"The largest shift is that of {largest.name}, {1e3 * largest.length:.2f} mm"
        sigma = largest.difference_sigma
        most = "at most " if common in ("overlapping", "model") else ""
        tail = "" if sigma is None else f", the sigma of the shift {most}{1e3 * sigma:.2f} mm"
        out.append(f"{told}{tail}.")
    shares = [(p.length / p.sigma[0], p.name) for p in places if p.sigma[0]]
    if shares:
        share, name = max(shares)
        out.append(
            f"Measured by the sigma of the place itself, the largest shift is {share:.2g} of it "
            f"({name})."
        )
    ratios = [(p.sigma[1] / p.sigma[0], p.name) for p in places if p.sigma[0] and p.sigma[1]]
    if ratios:
        low, high = min(ratios), max(ratios)
        out.append(
            f"Sigmas are {low[0]:.3f} ({low[1]}) to {high[0]:.3f} ({high[1]}) times what they were."
        )
    states = sum(change.change == "state" for change in observations)
    if observations:
        out.append(
            f"{counted(len(observations), 'observed value')} changed, {states} of them their state."
        )
    before, after = (_written(value) for value in sigma0.posterior)
    out.append(
        f"Sigma0 a posteriori was {before} with redundancy {sigma0.dof[0]} and is {after} with "
        f"redundancy {sigma0.dof[1]}."
    )
    return out


def _written(value: float | None) -> str:
    return "not estimated" if value is None else f"{value:.4f}"


def difference_tables(
    document: DiffDocument, angle: Literal["gon", "deg"] = "gon", most: int = 40
) -> list[ReportTable]:
    """Places, observations and edits that differ; tables without rows are left out."""
    style = Style(angle)
    places = [
        (ColumnHead("Name", numeric=False), lambda p: text_cell(p.name)),
        (ColumnHead("Shift E", "mm"), lambda p: mm_cell(p.shift[0])),
        (ColumnHead("N", "mm"), lambda p: mm_cell(p.shift[1])),
        (ColumnHead("U", "mm"), lambda p: mm_cell(p.shift[2])),
        (ColumnHead("Turn", style.small_unit("rad")), lambda p: number_cell(
            p.turn, style.small(p.turn, "rad"))),
        (ColumnHead("σ of shift", "mm"), lambda p: mm_cell(p.difference_sigma)),
        (ColumnHead("test"), lambda p: fixed_cell(p.test, 2)),
        (ColumnHead("limit"), lambda p: fixed_cell(p.limit, 2)),
        (ColumnHead("freedom"), lambda p: fixed_cell(p.freedom, 0)),
        (ColumnHead("σ before", "mm"), lambda p: mm_cell(p.sigma[0])),
        (ColumnHead("σ after", "mm"), lambda p: mm_cell(p.sigma[1])),
        (ColumnHead("Verdict", numeric=False), lambda p: _verdict(p, document.common)),
    ]  # fmt: skip
    observations = [
        (ColumnHead("Observation", numeric=False), lambda o: text_cell(
            f"{o.kind.replace('_', ' ')} {o.component}".strip())),
        (ColumnHead("From", numeric=False), lambda o: text_cell(o.from_)),
        (ColumnHead("To", numeric=False), lambda o: text_cell(o.to)),
        (ColumnHead("What changed", numeric=False), lambda o: text_cell(_told(o))),
        (ColumnHead("w before"), lambda o: fixed_cell(o.w[0], 2)),
        (ColumnHead("w after"), lambda o: fixed_cell(o.w[1], 2)),
        (ColumnHead("Reason", numeric=False), lambda o: text_cell(o.reason)),
    ]  # fmt: skip
    edits = [
        (ColumnHead("Edit of", numeric=False), lambda e: text_cell(e[1].id)),
        (ColumnHead("Only in", numeric=False), lambda e: text_cell(e[0])),
        (ColumnHead("Action", numeric=False), lambda e: text_cell(e[1].action)),
        (ColumnHead("Reason", numeric=False), lambda e: text_cell(e[1].reason)),
    ]
    decided = [("the first", e) for e in document.edits_only_first]
    decided += [("the second", e) for e in document.edits_only_second]
    first = Worst("those with the largest test for its limit")
    tables = [
        build_table("places", "Points and stations", _NOTE, document.places, places, most=most,
                    worst=first),
        build_table("changed", "Observations", "", document.observations, observations, most=most),
        build_table("edits", "Edits", "", decided, edits, most=most),
    ]  # fmt: skip
    return [table for table in tables if table.rows]


def _verdict(place: PlaceChange, common: Common) -> Any:
    if place.test is None:
        return text_cell("not tested" if place.freedom is None else "cannot be told")
    if not place.moved:
        return text_cell("within its limit")
    return text_cell("beyond its limit" if common == "nested" else "moved", "bad")


def _told(change: ObservationChange) -> str:
    if change.change == "state":
        return f"{change.states[0]} to {change.states[1]}"
    return change.change
