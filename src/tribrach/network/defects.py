"""Rank defects in words, with a cure, before anything is inverted (method section 3.2).

Two questions are answered separately: does the datum close every motion of the network as a
whole, and can the observations separate all remaining unknowns? Null vectors are reduced to
echelon form with pivots on parameters other than points, so that each sentence names as few
unknowns as possible, and the part on the points is recognised as a similarity motion where it
is one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach.errors import RankDefect
from tribrach.network.assembly import Assembly
from tribrach.network.datum import GENERATORS, OpenMotions, generators, pins_of
from tribrach.network.linear import SingularMatrix, SparseFactor
from tribrach.network.network import Network
from tribrach.network.unknowns import State

__all__ = [
    "check_datum",
    "check_rank",
    "datum_mask",
    "null_space",
    "sentences",
    "worst_misclosure",
]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: singular values of the column-scaled system below this are zero
RANK_TOLERANCE = 1e-9
DENSE_LIMIT = 1500
HEADLINE = "the observations leave unknowns open"


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
    if assembly.network.datum.kind == "control":
        null, _ = null_space(design, constraints, motions.basis)
        raise RankDefect(
            "the network is not tied to a frame",
            [
                f"all points together can still move without any observation noticing: {moves} "
                f"({d} in all); give more control coordinates, heights, an azimuth or GNSS, or ask "
                "for inner constraints (datum free)",
                *sentences(assembly, null),
            ],
        )
    held = np.linalg.svd(_unit(motions.basis * datum[:, None]), compute_uv=False)
    part = np.linalg.norm(motions.basis * datum[:, None], axis=0)
    if (part == 0).any() or held[-1] < 1e-7:
        raise RankDefect(
            "the datum points cannot carry the inner constraints",
            [
                f"the network is open in {d} ways ({moves}) and the chosen datum points do not "
                "close all of them; name more datum points that are not on one line"
            ],
        )


def _unit(matrix: Array) -> Array:
    size = np.linalg.norm(matrix, axis=0)
    return matrix / np.where(size > 0, size, 1.0)


def motion_words(mix: Array) -> list[str]:
    """Motions of the whole network, given by their mix (7, d) of the generators, in words."""
    basis, _ = np.linalg.qr(_unit(mix))
    words, left = [], []
    for k, name in enumerate(GENERATORS):
        along = basis @ basis[k]
        along[k] -= 1.0
        (words if np.linalg.norm(along) < 1e-6 else left).append(name)
    missing = basis.shape[1] - len(words)
    if missing:
        inside = np.array([n in words for n in GENERATORS])
        rest = np.where(inside[:, None], 0.0, basis)
        u, s, _ = np.linalg.svd(rest)
        words += [_screw(u[:, i]) for i in range(missing) if s[i] > 1e-9]
    return words


def _screw(mix: Array) -> str:
    """One general motion in words."""
    turn = mix[3:6]
    size = float(np.linalg.norm(turn))
    if size < 1e-9:
        terms = [f"{c:+.3g} {n}" for c, n in zip(mix, GENERATORS, strict=True) if abs(c) > 1e-6]
        return " ".join(terms)
    axis = turn / size
    azimuth = np.degrees(np.arctan2(axis[0], axis[1])) % 360
    elevation = np.degrees(np.arcsin(np.clip(axis[2], -1, 1)))
    return f"rotation about an axis of azimuth {azimuth:.0f} deg and elevation {elevation:.0f} deg"


def check_rank(
    assembly: Assembly, design: sp.csr_array, constraints: sp.csr_array, motions: Array
) -> None:
    """Refuse a network whose unknowns cannot be separated, apart from the known motions.

    Raises
    ------
    RankDefect : one sentence for each combination of unknowns that is open.
    """
    null, gap = null_space(design, constraints, motions)
    if null.shape[1] == 0:
        return
    said = sentences(assembly, null)
    raise RankDefect(
        f"{HEADLINE}: {null.shape[1]} combination{'s' if null.shape[1] > 1 else ''} cannot be "
        f"determined (singular values {gap[0]:.0e} against {gap[1]:.0e})",
        said,
    )


def null_space(
    design: sp.csr_array, constraints: sp.csr_array, motions: Array
) -> tuple[Array, tuple[float, float]]:
    """Null vectors (u, d) of the whitened design and constraints, without the known motions.

    Also the gap: the largest singular value taken as zero and the smallest taken as not,
    of the system with columns scaled to unit length.
    """
    length = np.sqrt(np.asarray(design.multiply(design).sum(axis=0)).ravel())
    seen = length > 0
    median = float(np.median(length[seen])) if seen.any() else 1.0
    length = np.where(seen, length, median)
    rows = [design, sp.diags_array(median / _row_length(constraints)) @ constraints]
    scaled = sp.csr_array(sp.csr_array(sp.vstack(rows)) @ sp.diags_array(1 / length))
    known, _ = np.linalg.qr(motions * length[:, None])
    if scaled.shape[1] <= DENSE_LIMIT:
        vectors, values = _dense_null(scaled.toarray(), known)
    else:
        vectors, values = _sparse_null(scaled, known)
    zero = values <= RANK_TOLERANCE * max(1.0, float(values.max(initial=0.0)))
    gap = (float(values[zero].max(initial=0.0)), float(values[~zero].min(initial=np.inf)))
    return vectors[:, zero] / length[:, None], gap


def _row_length(matrix: sp.csr_array) -> Array:
    length = np.sqrt(np.asarray(matrix.multiply(matrix).sum(axis=1)).ravel())
    return np.where(length > 0, length, 1.0)


def _dense_null(scaled: Array, known: Array) -> tuple[Array, Array]:
    """Right singular vectors and all singular values, the known motions held."""
    system = np.vstack([scaled, known.T])
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


def sentences(assembly: Assembly, null: Array) -> list[str]:
    """One sentence per null vector (u, d), each as sparse as echelon form makes it."""
    state = assembly.network.start
    layout = state.layout
    columns = assembly.free_columns
    is_point = columns < 3 * layout.count("point")
    vectors = _echelon(null, is_point)
    motion = generators(state)[columns]
    seen: dict[str, None] = {}
    for vector in vectors.T:
        seen[_sentence(assembly, vector, is_point, motion)] = None
    return list(seen)


def _echelon(null: Array, is_point: NDArray[np.bool_]) -> Array:
    """Reduced echelon form (u, d): each pivot appears in one vector only; points come last."""
    scale = np.abs(null).max(axis=1)
    scale[scale == 0] = 1.0
    work = (null / scale[:, None]).T.copy()
    order = np.concatenate([np.flatnonzero(~is_point), np.flatnonzero(is_point)])
    free_rows = list(range(len(work)))
    done: list[int] = []
    for column in order:
        if not free_rows:
            break
        best = max(free_rows, key=lambda r: abs(work[r, column]))
        if abs(work[best, column]) < 1e-6 * np.abs(work[free_rows]).max():
            continue
        work[best] /= work[best, column]
        for r in range(len(work)):
            if r != best:
                work[r] -= work[r, column] * work[best]
        free_rows.remove(best)
        done.append(best)
    work[np.abs(work) < 1e-6 * np.abs(work).max(axis=1, keepdims=True)] = 0.0
    reduced: Array = work[done].T * scale[:, None]
    return reduced


def _sentence(
    assembly: Assembly, vector: Array, is_point: NDArray[np.bool_], motion: Array
) -> str:
    """One null vector (u,) in words, with what would cure it."""
    layout = assembly.layout
    columns = assembly.free_columns
    other = np.flatnonzero((vector != 0) & ~is_point)
    terms = [layout.label(int(columns[i])) for i in other]
    points, body = _point_words(assembly, vector, is_point, motion)
    families = {layout.describe(int(columns[i]))[0] for i in other}
    if not terms:
        return _only_points(assembly, points, body)
    if len(terms) == 1 and not points:
        return (
            f"{terms[0]} is not determined by any observation; observe it, fix it or leave it out"
        )
    effect = _join(terms) + (f" and {body}" if points else "")
    cure = {
        "scalar": "give one of them a known value with its sigma, or leave it out",
        "pose": "add common targets, levelling or a position for the station",
        "plane": "add planes or targets of another direction",
        "vector": "give the vector a prior with its sigma",
    }
    family = next(f for f in ("scalar", "vector", "plane", "pose") if f in families)
    return f"cannot be separated: {effect}; only their sum has an effect; {cure[family]}"


def _join(terms: Sequence[str], most: int = 8) -> str:
    shown = list(terms[:most]) + ([f"{len(terms) - most} more"] if len(terms) > most else [])
    return shown[0] if len(shown) == 1 else ", ".join(shown[:-1]) + " and " + shown[-1]


def _point_words(
    assembly: Assembly, vector: Array, is_point: NDArray[np.bool_], motion: Array
) -> tuple[list[str], str]:
    """Names of the points a null vector moves, and the motion in words."""
    names = assembly.layout.names["point"]
    columns = assembly.free_columns
    moving = is_point & (vector != 0)
    index = np.unique(columns[moving] // 3)
    if len(index) == 0:
        return [], ""
    points = [names[i] for i in index]
    together = is_point & np.isin(columns // 3, index)
    mix, residual = _similarity(motion[together], vector[together])
    everyone = len(index) == len(np.unique(columns[is_point] // 3))
    whom = "all points together" if everyone and len(index) > 1 else f"point {points[0]}"
    if len(index) > 1 and not everyone:
        whom = f"points {_join(points)} together"
    if len(index) > 1 and residual < 1e-6:
        return points, f"{whom}: {', '.join(motion_words(mix[:, None]))}"
    if len(index) > 1:
        return points, f"points {_join(points)}"
    axes = [assembly.layout.describe(int(c))[2] for c in columns[moving]]
    return points, f"{_join(axes)} of {whom}"


def _similarity(motion: Array, part: Array) -> tuple[Array, float]:
    """Mix (7,) of the generators that comes nearest to a vector, and the relative misfit."""
    size = np.linalg.norm(motion, axis=0)
    size[size == 0] = 1.0
    mix = np.linalg.lstsq(motion / size, part, rcond=1e-9)[0]
    misfit = np.linalg.norm(motion / size @ mix - part) / np.linalg.norm(part)
    return np.where(np.abs(mix) > 1e-7 * np.abs(mix).max(), mix, 0.0) / size, float(misfit)


def _only_points(assembly: Assembly, points: list[str], body: str) -> str:
    """A null vector that moves nothing but points."""
    if len(points) > 1:
        return f"nothing holds {body}; tie them to the rest by another observation"
    ties = _ties(assembly, points[0])
    if not ties:
        return f"point {points[0]} is observed by nothing; observe it or leave it out"
    return (
        f"{body} cannot be determined: the point is observed only by {_join(ties, 4)}; add a "
        "distance, a direction or a height that sees the open component"
    )


def _ties(assembly: Assembly, name: str) -> list[str]:
    """The active observations that touch a name, in words."""
    network = assembly.network
    out = []
    for o, items in zip(network.observations, assembly.active, strict=True):
        for i, ends in enumerate(o.ends(assembly.layout)):
            if name in ends and i in items:
                out.append(network.describe(o, i, network.start))
    return out


def worst_misclosure(assembly: Assembly, state: State) -> str:
    """The observation that fits a state worst, in words."""
    white = np.abs(assembly.whiten(assembly.misclosure(state)))
    worst = int(np.argmax(white))
    rows = assembly.rows
    observations = assembly.network.observations[rows.table[worst]]
    words = assembly.network.describe(observations, int(rows.item[worst]), state)
    return f"the worst misfit is {white[worst]:.3g} sigma at {words}; look for a blunder there"
