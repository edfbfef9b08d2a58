"""Finds rank defects before anything is inverted and says in words what is open, with a cure.

Two questions are answered separately: does the datum close every motion of the network as a whole,
and can the observations separate all remaining unknowns? (method section 3.2)

Null vectors become sentences that name points, stations and parameters. Those that live on one
point or one station are taken out first; the rest is reduced to echelon form with pivots on
parameters other than points, so that each sentence names as few unknowns as possible; what happens
to the points is recognised as a similarity motion where it is one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.errors import NotConverged, RankDefect
from tribrach.network.assembly import Assembly
from tribrach.network.datum import GENERATORS, OpenMotions, generators, pins_of
from tribrach.network.facts import StartOnly, facts_of
from tribrach.network.linear import SparseFactor
from tribrach.network.network import Network
from tribrach.network.weakness import weak_place_of
from tribrach.observations.base import Use
from tribrach.observations.sights import HEIGHT_UNKNOWNS
from tribrach.observations.unknowns import FAMILIES, WIDTH, Layout, State
from tribrach.sentences import Sentence, joined
from tribrach.statistics import chi2

#: singular values of the column-scaled system below this are zero
RANK_TOLERANCE = 1e-9
#: and below this they are worth a warning
WEAK_TOLERANCE = 1e-6
#: generic places that are tried where a network is open at its start, and singular values that are
#: full rank for sure
_GENERIC, _SURE = 3, 1e-7
#: a place that no weak combination moves by as much is not the weak part of it [m]
_FIRM = 0.05
#: and below this curvature may lead the iteration astray
_STEERABLE = 1e-3
#: unknowns up to which all singular values are computed
DENSE_LIMIT = 1500
#: misclosures beyond so many sigmas overflow when they are squared
_WILD = 1e150
#: names that a sentence lists
_NAMED = 6


def datum_mask(network: Network, free_columns: Index) -> NDArray[np.bool_]:
    """Mark the free columns that carry the inner constraints.

    Those of the named points and stations; all points if none are named, all stations in a network
    without points.

    ``free_columns`` (u,): free columns of the full tangent vector. Returns (u,): true for columns
    of datum points and stations.
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

    ``design`` (n, u): whitened Jacobian; ``constraints`` (q, u): Jacobian of the hard constraints;
    ``datum`` (u,): columns that carry the inner constraints.
    """
    d = motions.basis.shape[1]
    if d == 0:
        return
    moves = joined(", ", motion_words(motions.mix))
    if assembly.network.datum.kind != "free":
        null, _ = null_space(design, constraints, motions.basis)
        length = column_length(design)
        # inner constraints would let go what is given in plan
        cure = (
            "give the height of any one point, whatever it is: what is given in plan stays held"
            if moves == GENERATORS[2]
            else "give more control coordinates, heights, an azimuth or GNSS, or ask for inner "
            "constraints (datum free)"
        )
        lists = [
            f"the coordinates of {', '.join(one.names[:_NAMED])}"
            f"{f' and {len(one.names) - _NAMED} more' if len(one.names) > _NAMED else ''} in "
            f"{one.file} only start the iteration, for they have neither role nor sigma; give them "
            "a column role (control with sigmas, or fixed)"
            for one in facts_of(assembly.network.facts, StartOnly)
        ]
        raise RankDefect(
            "the network is not tied to a frame",
            [
                f"all points together can still move without any observation noticing: {moves} "
                f"({d} in all); {cure}",
                *lists,
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
    assembly: Assembly,
    design: sp.csr_array,
    constraints: sp.csr_array,
    motions: Array,
    state: State,
) -> tuple[str, ...]:
    """Refuse a network whose unknowns cannot be separated, apart from the known motions.

    A network that is open where it is linearised may be closed anywhere else: then the place is to
    blame and not the observations.

    ``design`` (n, u): whitened Jacobian; ``constraints`` (q, u): Jacobian of the hard constraints;
    ``motions`` (u, d): open motions that the datum closes.
    """
    vectors, values = _spectrum(design, constraints, motions)
    zero = values <= RANK_TOLERANCE
    if zero.any() and not motions.shape[1] and closed_elsewhere(assembly, state):
        moved = np.linalg.norm(vectors[:, zero], axis=1) * column_length(design)
        moved[assembly.free_columns >= 3 * assembly.layout.count("point")] = 0.0
        where = assembly.layout.describe(int(assembly.free_columns[int(np.argmax(moved))]))[1]
        raise RankDefect(
            "the observations fix all unknowns, but not from the coordinates that were found for a "
            "start",
            [f"give a rough coordinate of {where}: where it was started, nothing tells it apart"],
        )
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


def closed_elsewhere(assembly: Assembly, state: State) -> bool:
    """True if a network has full rank at generic places of its unknown points."""
    free = assembly.free_columns
    points = free < 3 * assembly.layout.count("point")
    if not points.any():
        return False
    given = ~np.isin(np.arange(state.points.size), free).reshape(-1, 3)
    held = np.flatnonzero((given & np.isfinite(state.points))[:, :2].any(axis=1))
    coordinates = np.nan_to_num(state.points)
    state = replace(state, points=coordinates)
    around = coordinates[held] if len(held) > 1 else coordinates
    # medians: a point that started far away must not say how large the network is
    centre = np.median(around, axis=0)
    extent = float(np.median(np.abs(around - centre), axis=0).max(initial=1.0))
    generator = np.random.default_rng(0)
    for _ in range(_GENERIC):
        place = centre + extent * generator.standard_normal(coordinates.shape)
        step = np.zeros(assembly.layout.size)
        step[free[points]] = (place - coordinates).ravel()[free[points]]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            moved = state.retract(step)
            design, (constraints, _) = assembly.design(moved), assembly.constraints(moved)
        if not np.isfinite(design.data).all():
            continue
        _, values = _spectrum(design, constraints, np.zeros((len(free), 0)))
        if (values > _SURE).all():
            return True
    return False


def null_space(
    design: sp.csr_array, constraints: sp.csr_array, motions: Array
) -> tuple[Array, tuple[float, float]]:
    """Find the null vectors of a network, apart from the known motions.

    ``design`` (n, u): whitened Jacobian; ``constraints`` (q, u): Jacobian of the hard constraints;
    ``motions`` (u, k): open motions that the datum closes. Returns ``vectors`` (u, d): null vectors
    in metres, radians and parameters; largest singular value taken as zero and smallest taken as
    not, of the system with columns scaled to unit length.
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
    """Lengths (n,) of the rows; one for rows of zeros."""
    length = np.sqrt(np.asarray(matrix.multiply(matrix).sum(axis=1)).ravel())
    return np.where(length > 0, length, 1.0)


def _dense_null(scaled: sp.csr_array, known: Array) -> tuple[Array, Array]:
    """Right singular vectors and all singular values, the known motions held."""
    system = np.vstack([scaled.toarray(), known.T])
    if system.shape[0] < system.shape[1]:
        system = np.vstack([system, np.zeros((system.shape[1] - len(system), system.shape[1]))])
    triangle = np.linalg.qr(system, mode="r")
    try:
        _, values, vt = np.linalg.svd(triangle)
    except np.linalg.LinAlgError:
        # the faster algorithm gives up where another one does not
        try:
            _, values, vt = scipy.linalg.svd(triangle, lapack_driver="gesvd")
        except (ValueError, np.linalg.LinAlgError):
            raise NotConverged("the rank cannot be told where the iteration went") from None
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


def sentences(assembly: Assembly, null: Array, motions: Array, length: Array) -> list[str]:
    """Describe each open combination of unknowns in one sentence that names as few as possible.

    ``null`` (u, d): null vectors over the free columns; ``motions`` (u, k): motions of the network
    as a whole, which are described elsewhere; ``length`` (u,): lengths of the columns of the
    whitened design: they make metres, radians and parameters comparable.
    """
    layout = assembly.layout
    columns = assembly.free_columns
    starts = np.array([layout.offset[f] for f in FAMILIES])
    family = np.searchsorted(starts, columns, side="right") - 1
    is_point = columns < 3 * layout.count("point")
    scaled, held = null * length[:, None], motions * length[:, None]
    everything = np.hstack([scaled, held])
    owner = _owners(layout, columns)
    local, rest = _local(everything, owner)
    described = _basis(np.hstack([local, held]))
    vectors = _echelon(_at_rest(rest, held, is_point), family)
    news = np.linalg.norm(vectors - described @ (described.T @ vectors), axis=0)
    new = np.flatnonzero(news > 1e-6 * np.linalg.norm(vectors, axis=0))
    new = new[: _basis(everything).shape[1] - described.shape[1]]
    # what an unknown does on its own is said once and taken out of the rest
    shared = vectors[:, new] - local @ (local.T @ vectors[:, new])
    shared[np.abs(shared) < 1e-6 * np.abs(shared).max(axis=0, initial=0.0)] = 0.0
    alone = [np.abs(part).max(axis=1) for part in _by_owner(local, owner)]
    motion = generators(assembly.network.start)[columns]
    return [
        _sentence(assembly, vector / length, is_point, motion) for vector in [*alone, *shared.T]
    ]


def _at_rest(null: Array, motions: Array, is_point: NDArray[np.bool_]) -> Array:
    """Null vectors less the motion of the whole network that moves the pinned points."""
    if motions.shape[1] == 0 or is_point.sum() < motions.shape[1]:
        return null
    basis = _basis(motions)
    pins = np.flatnonzero(is_point)[pins_of(basis[is_point])]
    if np.linalg.svd(basis[pins], compute_uv=False)[-1] < 1e-9:
        return null
    still = null - basis @ np.linalg.solve(basis[pins], null[pins])
    return _basis(still[:, np.linalg.norm(still, axis=0) > 1e-9])


def _by_owner(local: Array, owner: Index) -> list[Array]:
    """Local null vectors grouped by the unknown they live on."""
    of = owner[np.abs(local).argmax(axis=0)] if local.size else np.empty(0, dtype=np.int64)
    return [local[:, of == unknown] for unknown in np.unique(of)]


def _basis(vectors: Array) -> Array:
    """Orthonormal basis of the span of columns."""
    if vectors.shape[1] == 0:
        return vectors
    left, size, _ = np.linalg.svd(unit_columns(vectors), full_matrices=False)
    basis: Array = left[:, size > 1e-9]
    return basis


def _owners(layout: Layout, columns: Index) -> Index:
    """Number of the unknown (point, pose, ...) that each free column belongs to."""
    width = np.concatenate([np.full(layout.count(f), WIDTH[f]) for f in WIDTH])
    owner: Index = np.repeat(np.arange(len(width)), width)[columns]
    return owner


def _local(null: Array, owner: Index) -> tuple[Array, Array]:
    """Null vectors that live on one unknown alone, and a basis of the others.

    With an orthonormal basis V of the null space, a vector V c lives on one unknown if its rows
    there already have full length: an eigenvalue of ``V_k^T V_k`` that is 1.
    """
    basis = _basis(null)
    count = int(owner.max(initial=-1)) + 1
    gram = np.zeros((count, basis.shape[1], basis.shape[1]))
    np.add.at(gram, owner, basis[:, :, None] * basis[:, None, :])
    value, vector = np.linalg.eigh(gram)
    unknown, which = np.nonzero(value > 1 - 1e-9)
    if len(unknown) == 0:
        return np.zeros((len(null), 0)), basis
    mixes = vector[unknown, :, which].T
    vectors = np.where(owner[:, None] == unknown, basis @ mixes, 0.0)
    left, _, _ = np.linalg.svd(mixes)
    return vectors, basis @ left[:, mixes.shape[1] :]


def _echelon(null: Array, family: Index) -> Array:
    """Reduced echelon form (u, d): each pivot appears in one vector only.

    Pivots are looked for among scalars first, then vectors, planes and stations, points last.
    """
    if null.shape[1] == 0:
        return null
    work = unit_columns(null).T.copy()
    free_rows = list(range(len(work)))
    done: list[int] = []
    for column in np.argsort(-family, kind="stable"):
        if not free_rows:
            break
        best = max(free_rows, key=lambda r: abs(work[r, column]))
        if abs(work[best, column]) < 1e-6 * np.abs(work[best]).max():
            continue
        work[best] /= work[best, column]
        for r in range(len(work)):
            if r != best:
                work[r] -= work[r, column] * work[best]
        free_rows.remove(best)
        done.append(best)
    work[np.abs(work) < 1e-6 * np.abs(work).max(axis=1, keepdims=True)] = 0.0
    reduced: Array = work[done].T
    return reduced


def _sentence(assembly: Assembly, vector: Array, is_point: NDArray[np.bool_], motion: Array) -> str:
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
    effect = _join(terms) + (Sentence(" and {body}", body=body) if points else "")
    cure = {
        "scalar": "give one of them a known value with its sigma, or leave it out",
        "pose": "add common targets, levelling or a position for the station",
        "plane": "add planes or targets of another direction",
        "vector": "give the vector a prior with its sigma",
    }
    family = next(f for f in ("scalar", "vector", "plane", "pose") if f in families)
    advice = cure[family]
    scalars = {layout.describe(int(columns[i]))[1] for i in other if family == "scalar"}
    if scalars & height_names(assembly.network):
        advice = (
            "measure one of these heights and give its sigma, or tie the points to known heights "
            "without it: by levelling, or by zenith angles to them with another, known height"
        )
    return Sentence(
        "cannot be separated: {effect}; only their sum has an effect; {advice}",
        effect=effect,
        advice=advice,
    )


def height_names(network: Network) -> set[str]:
    """Scalars that are heights of instruments or targets over their marks."""
    names, out = network.start.layout.names["scalar"], set()
    for o in network.observations:
        for reference in o.references():
            if reference.means in HEIGHT_UNKNOWNS:
                used = np.unique(getattr(o, reference.name))
                out |= {names[i] for i in used[used >= 0]}
    return out


def weak_words(assembly: Assembly, vector: Array) -> str:
    """The unknowns that take most part in a vector (u,), in words."""
    owner = _owners(assembly.layout, assembly.free_columns)
    share = np.abs(vector) / np.abs(vector).max()
    first = dict.fromkeys(int(owner[i]) for i in np.argsort(-share) if share[i] > 0.05)
    labels = []
    for unknown in first:
        members = np.flatnonzero(owner == unknown)
        column = int(assembly.free_columns[members[np.argmax(share[members])]])
        labels.append(assembly.layout.label(column))
    return _join(labels, 6)


def _join(terms: Sequence[str], most: int = 8) -> str:
    """Terms as an English list, the last of them counted if there are too many."""
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
    # two points or fewer follow some similarity whatever they do
    if len(index) > 2 and residual < 1e-6:
        return points, Sentence(
            "{whom}: {motion_words}",
            whom=whom,
            motion_words=joined(", ", motion_words(mix[:, None])),
        )
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
        upward = body.endswith(f": {GENERATORS[2]}")
        cure = "give the height of any one of them, or " if upward else ""
        return f"nothing holds {body}; {cure}tie them to the rest by another observation"
    ties = _ties(assembly, points[0])
    if not ties:
        return f"point {points[0]} is observed by nothing; observe it or leave it out"
    off = _ties(assembly, points[0], Use.OFF)
    cure = (
        f"{_join(off, 2)} {'is' if len(off) == 1 else 'are'} there and take no part: see why below"
        if off
        else "add a distance, a direction or a height that sees the open component"
    )
    return f"{body} cannot be determined: the point is observed only by {_join(ties, 4)}; {cure}"


def _ties(assembly: Assembly, name: str, use: Use = Use.ACTIVE) -> list[str]:
    """The observations of a use that touch a name, in words."""
    network = assembly.network
    return [
        network.describe(o, i, network.start)
        for o in network.observations
        for i, ends in enumerate(o.ends(assembly.layout))
        if name in ends and o.use[i] == use
    ]


def unit_columns(matrix: Array) -> Array:
    """Columns scaled to unit length; zero columns stay."""
    size = np.linalg.norm(matrix, axis=0)
    return matrix / np.where(size > 0, size, 1.0)


def motion_words(mix: Array) -> list[str]:
    """Motions of the whole network, given by their mix (7, d) of the generators, in words."""
    basis, _ = np.linalg.qr(unit_columns(mix))
    words: list[str] = []
    left: list[str] = []
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
        terms = [
            Sentence("{c:+g3} {n}", c=c, n=n)
            for c, n in zip(mix, GENERATORS, strict=True)
            if abs(c) > 1e-6
        ]
        return joined(" ", terms)
    axis = turn / size
    along = int(np.argmax(np.abs(axis)))
    if abs(axis[along]) > 1 - 1e-9:
        return GENERATORS[3 + along]
    azimuth = np.degrees(np.arctan2(axis[0], axis[1])) % 360
    elevation = np.degrees(np.arcsin(np.clip(axis[2], -1, 1)))
    return Sentence(
        "rotation about an axis of azimuth {azimuth:0} deg and elevation {elevation:0} deg",
        azimuth=azimuth,
        elevation=elevation,
    )


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


def not_converged(assembly: Assembly, state: State, motions: Array) -> list[str]:
    """Say why no minimum was found: weak geometry, or a misfit; ``motions`` (u, d) are open."""
    design = assembly.design(state)
    constraints, _ = assembly.constraints(state)
    white = assembly.whiten(assembly.misclosure(state))
    vectors, values = _spectrum(design, constraints, motions)
    out = []
    weak = values[0] < _STEERABLE
    if weak:
        out.append(_weak_sentence(assembly, design, vectors[:, 0], float(values[0])))
    dof = len(white) - design.shape[1] + constraints.shape[0] + motions.shape[1]
    chance = dof < 1 or float(white @ white) <= chi2.ppf(0.999, dof)
    misfit = worst_misclosure(assembly, state)
    if chance:
        out.append(
            Sentence(
                "the observations fit each other: {misfit}, which is no blunder", misfit=misfit
            )
        )
    elif weak:
        out.append(
            Sentence(
                "{misfit}, where the search stopped; that need not be a blunder", misfit=misfit
            )
        )
    else:
        out.append(Sentence("{misfit}; look for a blunder there", misfit=misfit))
    return out


def worst_misclosure(assembly: Assembly, state: State) -> str:
    """The observation that fits a state worst, in words."""
    white = np.abs(assembly.whiten(assembly.misclosure(state)))
    worst = int(np.argmax(white))
    rows = assembly.rows
    observations = assembly.network.observations[rows.table[worst]]
    words = assembly.network.describe(observations, int(rows.item[worst]), state)
    return Sentence(
        "the worst misfit is {white:g3} sigma at {words}", white=white[worst], words=words
    )


def _weak_sentence(assembly: Assembly, design: sp.csr_array, vector: Array, value: float) -> str:
    """The weakest combination of unknowns in words, with what would hold it."""
    place = weak_place_of(
        assembly.layout, assembly.free_columns, vector, float(np.linalg.norm(design @ vector))
    )
    body = f"the network is weak (singular value {value:.0e}): {weak_words(assembly, vector)}"
    if place is None or place.sigma < _FIRM:
        return Sentence(
            "{body}; an orientation takes a sight to a point that is neither straight "
            "above nor below, any other a known value with its sigma",
            body=body,
        )
    return Sentence(
        "{body}; {place.name} can move {place.sigma:g2} m {place2} within one sigma of "
        "all observations; {place3}",
        body=body,
        place=place,
        place2=place.along(),
        place3=place.cure(),
    )
