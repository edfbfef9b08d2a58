"""Errors of centring and refraction that the sights of one occupation have in common.

Whoever sets an instrument or a target over a mark makes one error, and all sights to or from it
have that one. It is a vector of the network, zero as far as is known (method section 2.3). An end
that only one sight of each kind uses needs no vector: there the error is part of the sight's sigma.
The coefficient of refraction is another one at every set-up, where its sights are long.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.geodesy.site import FlatSite
from tribrach.instruments.precision import Precision
from tribrach.network.network import Network
from tribrach.network.start.start_values import find_start
from tribrach.network.survey import Survey
from tribrach.observations.base import Observations
from tribrach.observations.control import Centrings, RefractionChanges
from tribrach.observations.declaration import ObservedAxes
from tribrach.observations.sights import ECCENTRICITY_UNKNOWN

#: sights [m] beyond which 0.1 of the coefficient of refraction is more than 0.2 mm in height
LONG = 150.0

Names = NDArray[np.object_]


@dataclass(frozen=True)
class Ends:
    """Where the n sights of one kind go, whose errors of centring are those of an instrument."""

    kind: type[Observations]
    #: (n,), marks of instruments and targets
    start: Names
    end: Names
    setup: Names  #: (n,), what tells the set-ups of one mark apart; "" where there is one


@dataclass(frozen=True)
class Occupied:
    """Vectors that the sights of one kind have in common with others."""

    #: (n,), names of the vectors of both ends; "" for an error that is the sight's own
    instrument: Names
    target: Names

    @property
    def ends(self) -> Array:
        """How many ends (n,) have an error that is the sight's own."""
        own: Array = (self.instrument == "").astype(float) + (self.target == "")
        return own

    @property
    def columns(self) -> dict[str, Names]:
        """Both as columns of the kind; empty if nothing is shared."""
        if (self.ends == 2).all():
            return {}
        return {"eccentricity_instrument": self.instrument, "eccentricity_target": self.target}


def occupy(
    survey: Survey, precision: Precision, file: str, sights: Sequence[Ends]
) -> list[Occupied]:
    """Give a survey the errors of centring that sights of a file share.

    ``survey``: receives the vectors and what is known of them; ``file``: name of the file, since
    the next one is of another occupation; ``sights``: all sights of the file, kind by kind. Returns
    the vectors of each kind, in the order of ``sights``.
    """
    named = [_names(precision, file, one) for one in sights]
    uses: dict[str, dict[type[Observations], int]] = {}
    for one, (instrument, target) in zip(sights, named, strict=True):
        for name in (*instrument.tolist(), *target.tolist()):
            of_kind = uses.setdefault(name, {})
            of_kind[one.kind] = of_kind.get(one.kind, 0) + 1
    uses.pop("", None)
    common = {name: kinds for name, kinds in uses.items() if max(kinds.values()) > 1}
    _state(survey, precision, common)
    return [
        Occupied(*(np.where(np.isin(names, list(common)), names, "") for names in both))
        for both in named
    ]


def share_refraction(
    survey: Survey, precision: Precision, file: str, sights: Ends, length: Array
) -> dict[str, Names]:
    """Give a survey what the coefficient of refraction of its set-ups may differ by.

    ``survey``: receives the unknowns and what is known of them; ``length`` (n,): of these sights
    [m], NaN where it is not known. Returns a column of zenith angles; empty where no sight is long.
    """
    at = np.empty(len(length), dtype=object)
    at[:] = [
        f"refraction at {start}{f', {setup}' if setup else ''} ({file})"
        for start, setup in zip(sights.start, sights.setup, strict=True)
    ]
    long = dict.fromkeys(at[np.nan_to_num(length) > LONG].tolist())
    straight = isinstance(survey.site, FlatSite) and survey.site.curvature_radius is None
    if not long or not precision.refraction_sigma or straight:
        return {}
    survey.scalars |= dict.fromkeys(long, (0.0, True))
    survey.add(
        RefractionChanges,
        values=np.zeros(len(long)),
        sigma=precision.refraction_sigma,
        scalar=list(long),
        group="refraction",
    )
    return {"refraction_unknown": np.where(np.isin(at, list(long)), at, "")}


def _names(precision: Precision, file: str, sights: Ends) -> tuple[Names, Names]:
    """What the errors (n,) of both ends would be called; "" where there is none to share."""
    n = len(sights.start)
    shares = any(f.name == "eccentricity_target" for f in fields(sights.kind))
    has = precision.centring > 0 or precision.height > 0
    instrument, target = np.full(n, "", dtype=object), np.full(n, "", dtype=object)
    if not (shares and has) or precision.centring_per == "sight":
        return instrument, target
    for k, (start, end, setup) in enumerate(
        zip(sights.start, sights.end, sights.setup, strict=True)
    ):
        again = f", {setup}" if setup else ""
        if precision.centring_per == "mark":
            instrument[k], target[k] = (f"centring over {name} ({file})" for name in (start, end))
        else:
            instrument[k] = f"centring at {start}{again} ({file})"
            target[k] = f"centring of {end} from {start}{again} ({file})"
    return instrument, target


def _state(
    survey: Survey, precision: Precision, common: dict[str, dict[type[Observations], int]]
) -> None:
    """Vectors of the survey, zero but for the errors of centring and heights."""
    sigma = np.array([precision.centring, precision.centring, precision.height])
    vectors: list[str] = []
    axes: list[int] = []
    for name, kinds in common.items():
        free = sigma > 0
        free[2] &= any(kind.facts.axes is ObservedAxes.SPACE for kind in kinds)
        survey.vectors[name] = (np.zeros(3), free)
        vectors += [name] * int(free.sum())
        axes += np.flatnonzero(free).tolist()
    if vectors:
        survey.add(
            Centrings,
            values=np.zeros(len(vectors)),
            sigma=sigma[axes],
            vector=vectors,
            axis=np.array(axes, dtype=float),
            group="centring",
        )


def by_sight(network: Network) -> Network:
    """The network as other programs have it: errors of centring in the sigma of each sight.

    The sigma of each observed value by itself stays what it is; what sights have in common is lost.
    """
    layout = network.start.layout
    prior = np.zeros(layout.size)
    for o in network.observations:
        if isinstance(o, Centrings):
            column = layout.columns("vector", o.vector)[np.arange(len(o)), o.axis.astype(int)]
            prior[column] = o.covariance[:, 0, 0]
    if not prior.any():
        return network
    state = find_start(network)
    tables, kept = [], []
    for k, o in enumerate(network.observations):
        if isinstance(o, Centrings):
            continue
        kept.append(k)
        names = [r.name for r in o.references() if r.means == ECCENTRICITY_UNKNOWN]
        if any((getattr(o, name) >= 0).any() for name in names):
            covariance = o.covariance.copy()
            for block in o.jacobian(state):
                known = np.where(block.columns >= 0, prior[block.columns], 0.0)
                covariance += np.einsum("nik,nk,njk->nij", block.values, known, block.values)
            none: dict[str, Any] = {name: np.full(len(o), -1) for name in names}
            o = replace(o, covariance=covariance, **none)
        tables.append(o)
    number = np.full(len(network.observations), -1)
    number[kept] = np.arange(len(kept))
    joint = tuple(replace(one, table=number[one.table]) for one in network.joint)
    free = network.free & (prior == 0)
    return replace(network, observations=tuple(tables), joint=joint, free=free)
