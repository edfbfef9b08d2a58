"""Rank defects in words, with a cure, before anything is inverted (method section 3.2).

Two questions are answered separately: does the datum close every motion of the network as a
whole, and can the observations separate all remaining unknowns?
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach.errors import RankDefect
from tribrach.network.assembly import Assembly
from tribrach.network.datum import OpenMotions, pins_of
from tribrach.network.defect_words import motion_words, sentences, unit_columns, weak_words
from tribrach.network.linear import SparseFactor
from tribrach.network.network import Network
from tribrach.network.unknowns import State

__all__ = [
    "check_datum",
    "check_rank",
    "column_length",
    "datum_mask",
    "not_computed",
    "null_space",
    "worst_misclosure",
]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: singular values of the column-scaled system below this are zero
RANK_TOLERANCE = 1e-9
#: and below this they are worth a warning
WEAK_TOLERANCE = 1e-6
DENSE_LIMIT = 1500
#: misclosures beyond so many sigmas overflow when they are squared
_WILD = 1e150


def datum_mask(network: Network, free_columns: Index) -> NDArray[np.bool_]:
    """Free columns (u,) that carry the inner constraints: the named points and stations.

    All points if none are named; all stations in a network without points.
    """
    layout = network.start.layout
    mask = np.zeros(layout.size, dtype=bool)
    datum = network.datum
    if datum.components is not None:
        mask |= datum.components
    elif datum.names:
        for name in datum.names:
            family = "point" if layout.has("point", name) else "pose"
            mask[layout.columns(family, layout.index(family, name))] = True
    elif layout.count("point"):
        mask[: 3 * layout.count("point")] = True
    else:
        mask[: layout.offset["plane"]] = True
    return mask[free_columns]


def check_datum(
    assembly: Assembly,
    design: sp.csr_array,
    constraints: sp.csr_array,
    motions: OpenMotions,
    datum: NDArray[np.bool_],
) -> None:
    """Refuse a network whose datum leaves motions open.

    Raises
    ------
    RankDefect : control is missing, or the datum points cannot carry the inner constraints.
    """
    d = motions.basis.shape[1]
    if d == 0:
        return
    moves = ", ".join(motion_words(motions.mix))
    if assembly.network.datum.kind != "free":
        null, _ = null_space(design, constraints, motions.basis)
        length = column_length(design)
        raise RankDefect(
            "the network is not tied to a frame",
            [
                f"all points together can still move without any observation noticing: {moves} "
                f"({d} in all); give more control coordinates, heights, an azimuth or GNSS, or ask "
                "for inner constraints (datum free)",
                *sentences(assembly, null, motions.basis, length),
            ],
        )
    held = np.linalg.svd(unit_columns(motions.basis * datum[:, None]), compute_uv=False)
    part = np.linalg.norm(motions.basis * datum[:, None], axis=0)
    if (part == 0).any() or held[-1] < 1e-7:
        raise RankDefect(
            "the datum points cannot carry the inner constraints",
            [
                f"the network is open in {d} ways ({moves}) and the chosen datum points do not "
                "close all of them; name more datum points that are not on one line"
            ],
        )


def check_rank(
    assembly: Assembly, design: sp.csr_array, constraints: sp.csr_array, motions: Array
) -> tuple[str, ...]:
    """Refuse a network whose unknowns cannot be separated, apart from the known motions.

    Returns warnings about combinations that are separated, but only just.

    Raises
    ------
    RankDefect : one sentence for each combination of unknowns that is open.
    """
    vectors, values = _spectrum(design, constraints, motions)
    zero = values <= RANK_TOLERANCE
    if zero.any():
        count = int(zero.sum())
        raise RankDefect(
            f"the observations leave unknowns open: {count} combination"
            f"{'s' if count > 1 else ''} cannot be determined (singular values "
            f"{values[zero].max():.0e} against {values[~zero].min(initial=np.inf):.0e})",
            sentences(assembly, vectors[:, zero], motions, column_length(design)),
        )
    weak = np.flatnonzero(values <= WEAK_TOLERANCE)[:3]
    return tuple(
        f"nearly open (singular value {values[i]:.0e}): "
        f"{weak_words(assembly, vectors[:, i])}; its sigma depends on the last digits of the data"
        for i in weak
    )


def null_space(
    design: sp.csr_array, constraints: sp.csr_array, motions: Array
) -> tuple[Array, tuple[float, float]]:
    """Null vectors (u, d) of the whitened design and constraints, without the known motions.

    Also the gap: the largest singular value taken as zero and the smallest taken as not,
    of the system with columns scaled to unit length.
    """
    vectors, values = _spectrum(design, constraints, motions)
    zero = values <= RANK_TOLERANCE
    gap = (float(values[zero].max(initial=0.0)), float(values[~zero].min(initial=np.inf)))
    return vectors[:, zero], gap


def _spectrum(
    design: sp.csr_array, constraints: sp.csr_array, motions: Array
) -> tuple[Array, Array]:
    """Right singular vectors (u, k), in natural units, and values from the smallest upwards."""
    length = column_length(design)
    median = float(np.median(length))
    rows = [design, sp.diags_array(median / _row_length(constraints)) @ constraints]
    scaled = sp.csr_array(sp.csr_array(sp.vstack(rows)) @ sp.diags_array(1 / length))
    known, _ = np.linalg.qr(motions * length[:, None])
    small = scaled.shape[1] <= DENSE_LIMIT
    find = _dense_null if small else _sparse_null
    vectors, values = find(scaled, known)
    order = np.argsort(values)
    return vectors[:, order] / length[:, None], values[order]


def column_length(design: sp.csr_array) -> Array:
    """Lengths (u,) of the columns of the whitened design; the median where nothing observes."""
    length = np.sqrt(np.asarray(design.multiply(design).sum(axis=0)).ravel())
    seen = length > 0
    return np.where(seen, length, np.median(length[seen]) if seen.any() else 1.0)


def _row_length(matrix: sp.csr_array) -> Array:
    length = np.sqrt(np.asarray(matrix.multiply(matrix).sum(axis=1)).ravel())
    return np.where(length > 0, length, 1.0)


def _dense_null(scaled: sp.csr_array, known: Array) -> tuple[Array, Array]:
    """Right singular vectors and all singular values, the known motions held."""
    system = np.vstack([scaled.toarray(), known.T])
    if system.shape[0] < system.shape[1]:
        system = np.vstack([system, np.zeros((system.shape[1] - len(system), system.shape[1]))])
    triangle = np.linalg.qr(system, mode="r")
    _, values, vt = np.linalg.svd(triangle)
    return vt.T, values


def _sparse_null(scaled: sp.csr_array, known: Array) -> tuple[Array, Array]:
    """Smallest singular values and vectors by inverse subspace iteration.

    The regularised normal matrix only steers the iteration; the singular values come from
    ``scaled @ X`` itself, so they keep full precision.
    """
    u = scaled.shape[1]
    transposed = sp.csr_array(scaled.T)
    normal = transposed @ scaled + 1e-11 * sp.eye_array(u)
    pinned = np.zeros(u)
    pinned[pins_of(known)] = 1.0
    factor = SparseFactor(sp.csc_array(normal + sp.diags_array(pinned)), np.ones(u))
    generator = np.random.default_rng(0)
    width = 16
    while True:
        x = generator.standard_normal((u, min(width, u)))
        for _ in range(4):
            x -= known @ (known.T @ x)
            x, _ = np.linalg.qr(factor.solve(x))
        x -= known @ (known.T @ x)
        x, _ = np.linalg.qr(x)
        _, values, vt = np.linalg.svd(scaled @ x, full_matrices=False)
        if values[0] > RANK_TOLERANCE or width >= min(u, 256):
            return x @ vt.T, values
        width *= 2


def not_computed(assembly: Assembly, design: sp.csr_array, white: Array) -> str:
    """The first observation that has no value or no derivative at a state, in words."""
    wild = ~np.isfinite(white) | (np.abs(white) > _WILD)
    bad = ~np.isfinite(design.data)
    wild[np.repeat(np.arange(design.shape[0]), np.diff(design.indptr))[bad]] = True
    first = int(np.argmax(wild))
    rows, network = assembly.rows, assembly.network
    observations = network.observations[rows.table[first]]
    words = network.describe(observations, int(rows.item[first]), network.start)
    return f"the first is {words}; look for points in one place, or a number that is far off"


def worst_misclosure(assembly: Assembly, state: State) -> str:
    """The observation that fits a state worst, in words."""
    white = np.abs(assembly.whiten(assembly.misclosure(state)))
    worst = int(np.argmax(white))
    rows = assembly.rows
    observations = assembly.network.observations[rows.table[worst]]
    words = assembly.network.describe(observations, int(rows.item[worst]), state)
    return f"the worst misfit is {white[worst]:.3g} sigma at {words}; look for a blunder there"
