"""Compares the datums that a network could have (zero order of a design).

Sigmas of coordinates belong to their datum and are not to be compared between datums. Distances,
redundancies and undetected errors in observations are the same in every datum that only closes what
is open; control that is more than that adds information and its own errors (method sections 3.2 and
3.7).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from math import nan

import numpy as np

from tribrach._types import Array
from tribrach.answers import Number, Result
from tribrach.errors import AdjustmentError, InputError
from tribrach.network.adjustment import Adjustment
from tribrach.network.network import Datum, Network
from tribrach.planning.prediction import Criterion, figures, position_columns, predict

#: positions whose mutual distances are compared
_MOST = 40


@dataclass(frozen=True)
class DatumChoice(Result):
    """The plan in another datum [m]."""

    datum: str  #: in words
    #: largest sigma in any direction of the named positions [m], of this datum only
    sigma: Number = nan
    mean: Number = nan  #: root of the mean of their variances [m], of this datum only
    distance: Number = nan  #: largest sigma of a distance between them [m]
    redundancy: Number = nan  #: the smallest redundancy
    refused: str = ""  #: why it is no datum of this network, else empty


def distance_sigmas(adjustment: Adjustment, names: tuple[str, ...]) -> Array:
    """A-priori sigmas [m] of the distances between named positions, 40 of them at most."""
    names, columns = position_columns(adjustment.layout, names)
    chosen = np.unique(np.linspace(0, len(names) - 1, min(_MOST, len(names))).astype(int))
    columns = columns[chosen]
    xyz = adjustment.state.positions[
        [adjustment.layout.position_index(names[int(k)]) for k in chosen]
    ]
    if len(chosen) < 2:
        return np.zeros(0)
    covariance = adjustment.covariance_columns(columns.ravel(), columns.ravel())
    blocks = covariance.reshape(len(chosen), 3, len(chosen), 3).transpose(0, 2, 1, 3)
    i, j = np.array(list(combinations(range(len(chosen)), 2))).T
    unit = xyz[j] - xyz[i]
    unit = unit / np.linalg.norm(unit, axis=1, keepdims=True)
    spread = blocks[i, i] + blocks[j, j] - blocks[i, j] - blocks[j, i]
    variance = np.einsum("ni,nij,nj->n", unit, spread, unit)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def compare_datums(network: Network, criterion: Criterion) -> list[DatumChoice]:
    """Predict a network in its own datum, and in others that it could have."""
    layout = network.start.layout
    own = "as the project has it: "
    own += {"control": "control", "free": "inner constraints", "fixed": "points held"}[
        network.datum.kind
    ]
    if network.datum.names and network.datum.kind != "control":
        few = ", ".join(network.datum.names[:6])
        own += f" over {few}" + (" and others" if len(network.datum.names) > 6 else "")
    choices: list[tuple[str, Network]] = [(own, network)]
    every = ("inner constraints over all points", Datum("free"))
    others = [every] if layout.count("point") else []
    if criterion.names and set(criterion.names) != set(layout.names["point"]):
        others.append(("inner constraints over the named points", Datum("free", criterion.names)))
    if layout.count("pose"):
        others.append(("inner constraints over the stations", Datum("free", layout.names["pose"])))
    for words, datum in others:
        same = network.datum.kind == "free" and network.datum.names == datum.names
        if not same:
            bare = replace(network, datum=Datum())
            choices.append((words, bare.with_datum(datum)))
    return [_choice(words, changed, criterion) for words, changed in choices]


def _choice(words: str, network: Network, criterion: Criterion) -> DatumChoice:
    """The figures of a network in its datum, or why they cannot be computed."""
    try:
        adjustment = predict(network)
        predicted = figures(adjustment, replace(criterion, parameters=()))
    except (AdjustmentError, InputError) as error:
        why = error.headline if isinstance(error, AdjustmentError) else error.what
        return DatumChoice(words, refused=why)
    _, columns = position_columns(adjustment.layout, criterion.names)
    blocks = adjustment.cofactor.blocks(adjustment.reduced[columns])
    return DatumChoice(
        words,
        predicted.value("sigma"),
        float(np.sqrt(np.einsum("nii->n", blocks).mean())),
        float(distance_sigmas(adjustment, criterion.names).max(initial=0.0)),
        predicted.value("redundancy"),
    )
