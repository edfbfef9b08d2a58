"""Reads check points that do not agree in other ways: exchanged, turned, in feet.

A check point that is off by kilometres is rarely a check. Its coordinates are taken as given with E
and N exchanged, with another sign, or in another unit, and compared with the network again. What
fits then is said with both test values (method section 3.4); nothing is changed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.geodesy.site import FlatSite
from tribrach.network.adjustment import Adjustment
from tribrach.network.roles import given_coordinates, used_axes
from tribrach.observations.base import Use
from tribrach.observations.declaration import End
from tribrach.sentences import Sentence, joined
from tribrach.statistics import chi2
from tribrach.units import UNITS

#: significance at which a point disagrees, and at which another reading of it agrees
_DISAGREES, _AGREES = 0.001, 0.05
#: units that files say metres and mean, in words
_UNITS = {"ft": "feet", "usft": "US survey feet", "mm": "millimetres", "cm": "centimetres",
          "km": "kilometres"}  # fmt: skip


@dataclass(frozen=True)
class _Reading:
    """One way to read coordinates: true = matrix @ given."""

    words: str
    matrix: Array


def _readings() -> Iterator[_Reading]:
    """Every way that is tried, the simplest first."""
    swap = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    yield _Reading("with E and N exchanged", swap)
    for axis, name in enumerate("ENU"):
        sign = np.ones(3)
        sign[axis] = -1
        yield _Reading(f"with the other sign of {name}", np.diag(sign))
    yield _Reading("with the other signs of E and N", np.diag([-1.0, -1.0, 1.0]))
    yield _Reading("with E and N exchanged and the sign of E turned", np.diag([-1.0, 1, 1]) @ swap)
    yield _Reading("with E and N exchanged and the sign of N turned", np.diag([1.0, -1, 1]) @ swap)
    for unit, words in _UNITS.items():
        factor = UNITS[unit]
        yield _Reading(f"in {words}", factor * np.eye(3))
        yield _Reading(f"with the height in {words}", np.diag([1.0, 1.0, factor]))
        yield _Reading(f"with plan in {words}", np.diag([factor, factor, 1.0]))
        yield _Reading(f"with E and N exchanged, in {words}", factor * swap)


@dataclass(frozen=True)
class _Check:
    """A check point that does not agree: given, adjusted (3,), both covariances, its test."""

    words: str
    given: Array
    adjusted: Array
    own: Array
    network: Array
    axes: Array
    statistic: float

    def test(self, matrix: Array) -> float:
        """Statistic of another reading; infinite where it needs an axis that is not given."""
        moved = (matrix[self.axes] != 0).any(axis=0)
        if not set(np.flatnonzero(moved)) <= set(self.axes.tolist()):
            return np.inf
        return _statistic(
            matrix @ self.given,
            self.adjusted,
            matrix @ self.own @ matrix.T + self.network,
            self.axes,
        )


def misread_checks(adjustment: Adjustment) -> list[str]:
    """Sentences on check points that agree if they are read in another way."""
    if not isinstance(adjustment.network.site, FlatSite):
        return []
    out, left = list[str](), _disagreeing(adjustment)
    readings = list(_readings())
    while left:
        found = []
        for reading in readings:
            tests = np.array([check.test(reading.matrix) for check in left])
            limits = np.array([float(chi2.ppf(1 - _AGREES, len(check.axes))) for check in left])
            found.append((int((tests <= limits).sum()), -float(tests.min()), tests, limits))
        best = max(range(len(found)), key=lambda k: found[k][:2])
        count, _, tests, limits = found[best]
        if count == 0:
            break
        fits = np.flatnonzero(tests <= limits)
        worst = fits[int(np.argmax(tests[fits]))]
        before = left[worst].statistic
        others = [
            readings[k].words
            for k, (_, _, other, _) in enumerate(found)
            if k != best and (other[fits] <= limits[fits]).all()
        ]
        doubt = Sentence("; also {others}", others=joined(" or ", others[:2])) if others else ""
        names = joined(", ", (left[k].words for k in fits[:6]))
        more = f" and {len(fits) - 6} more" if len(fits) > 6 else ""
        noun, verb = ("check point", "agrees") if len(fits) == 1 else ("check points", "agree")
        out.append(
            Sentence(
                "{noun} {names}{more} {verb} if read {readings}: test {tests:1} against "
                "{limits:1}, as given {before:g3}{doubt}; correct the file, or the unit or "
                "order of its columns",
                noun=noun,
                names=names,
                more=more,
                verb=verb,
                readings=readings[best].words,
                tests=tests[worst],
                limits=limits[worst],
                before=before,
                doubt=doubt,
            )
        )
        left = [check for k, check in enumerate(left) if k not in fits]
    return out


def _statistic(given: Array, adjusted: Array, covariance: Array, axes: Array) -> float:
    """Squared difference along some axes against its covariance."""
    d = (given - adjusted)[axes]
    return float(d @ np.linalg.solve(covariance[np.ix_(axes, axes)], d))


def _disagreeing(adjustment: Adjustment) -> list[_Check]:
    """Check points whose coordinates do not agree with the network."""
    layout, used, out = adjustment.layout, used_axes(adjustment), []
    for o in given_coordinates(adjustment):
        axes, at = o.coordinate_axes(), o.end_field(End.AT)
        if axes is None or at is None:
            continue
        position = np.asarray(getattr(o, at.name))
        for item in np.flatnonzero(o.use == Use.CHECK).tolist():
            rows = np.flatnonzero(used[axes[item]])
            along = np.asarray(axes[item])[rows]
            if len(along) == 0:
                continue
            given, own = np.zeros(3), np.zeros((3, 3))
            given[along] = o.values[item][rows]
            own[np.ix_(along, along)] = o.covariance[item][np.ix_(rows, rows)]
            columns = layout.position_columns(np.array([position[item]]))[0]
            network = adjustment.covariance_columns(columns, columns)
            adjusted = adjustment.state.positions[position[item]]
            statistic = _statistic(given, adjusted, own + network, along)
            if chi2.sf(statistic, len(along)) < _DISAGREES:
                source = str(o.source[item])
                words = layout.position_name(int(position[item])) + f" ({source})" * bool(source)
                out.append(_Check(words, given, adjusted, own, network, along, statistic))
    return out
