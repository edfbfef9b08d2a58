"""Given coordinates that are all written otherwise: another unit, exchanged axes, another scale.

What is wrong with a whole list is in each of its points, and to test point by point accuses one of
them. The list is therefore asked first. The network is adjusted without given coordinates, and the
given ones are laid on what comes out: as they stand, and in every other unit and order of axes.
What then fits is said only if the whole network fits with it. A scale is estimated: as one more
parameter of all given coordinates in plan (method section 3.4).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Array, Index, Mask
from tribrach.errors import InputError, TribrachError
from tribrach.geometry.alignment import Alignment, kabsch, planar
from tribrach.geometry.axis_orders import axis_orders
from tribrach.network.blunders.slip_search import Slip, SlipSearch
from tribrach.network.network import Datum, Network, is_given
from tribrach.observations.base import Use
from tribrach.observations.declaration import End
from tribrach.observations.unknowns import State
from tribrach.units import OTHER_LENGTHS

#: the kind of these slips
GIVEN_LIST = "given_list"
#: points of a list from which on it is looked at
_LEAST = 3
#: share of the misfit as given that may be left in another form; forms this much alike are equal
_LEFT, _ALIKE = 0.1, 1.5
#: forms that are adjusted
_TRIED = 3
#: open motions from which on nothing says what is upright
_TILTS = 6
#: names that a sentence lists
_NAMED = 6


@dataclass(frozen=True)
class _Form:
    """Another way to read coordinates (n, 3), in words; the likelier, the smaller its rank."""

    words: str
    read: Callable[[Array], Array]
    rank: tuple[int, ...]


@dataclass(frozen=True)
class _Given:
    """Given coordinates of points: one row for a point in a list."""

    position: Index  #: (k,), positions
    #: (k,), number of the list, and names of the lists
    part: Index
    lists: tuple[str, ...]
    xyz: Array  #: (k, 3), NaN where nothing is given
    #: table (-1 where held), item, row, and the place (row and axis) in ``xyz``, (m, 5)
    places: Index

    def within(self, network: Network, xyz: Array) -> Network:
        """The network with other given values, started anew."""
        start = _anew(network)
        points = start.points
        values = [o.values.copy() for o in network.observations]
        for table, item, row, k, axis in self.places.tolist():
            if table < 0:
                points[self.position[k], axis] = xyz[k, axis]
            else:
                values[table][item, row] = xyz[k, axis]
        tables = tuple(
            replace(o, values=v) for o, v in zip(network.observations, values, strict=True)
        )
        return replace(network, observations=tables, start=start)


def _anew(network: Network) -> State:
    """Start values of held coordinates; NaN for all others."""
    start, layout = network.start, network.start.layout
    held: dict[str, Mask] = {
        family: ~network.free[layout.columns(family, np.arange(layout.count(family)))]
        for family in ("point", "pose", "plane", "scalar")
    }
    pose: Mask = np.any(held["pose"], axis=1)
    plane: Mask = np.any(held["plane"], axis=1)
    return replace(
        start,
        points=np.where(held["point"], start.points, np.nan),
        pose_t=np.where(pose[:, None], start.pose_t, np.nan),
        pose_r=np.where(pose[:, None, None], start.pose_r, np.nan),
        plane_n=np.where(plane[:, None], start.plane_n, np.nan),
        plane_d=np.where(plane, start.plane_d, np.nan),
        scalars=np.where(held["scalar"][:, 0], start.scalars, np.nan),
    )


def _given(network: Network) -> _Given:
    """All given coordinates that take part."""
    layout = network.start.layout
    rows: dict[tuple[int, str], int] = {}
    places: list[tuple[int, int, int, int, int]] = []
    values: list[float] = []

    def note(position: int, source: str, at: tuple[int, int, int], axis: int, value: float) -> None:
        row = rows.setdefault((position, source.rpartition(":")[0]), len(rows))
        places.append((*at, row, axis))
        values.append(value)

    points = network.start.points
    held = ~network.free[: points.size].reshape(points.shape) & np.isfinite(points)
    for p, axis in np.argwhere(held).tolist():
        source = network.point_sources.get(layout.names["point"][p], "")
        note(p, source, (-1, -1, -1), axis, float(points[p, axis]))
    for table, o in enumerate(network.observations):
        axes, at = o.coordinate_axes(), o.end_field(End.AT)
        if not is_given(type(o), o.group) or axes is None or at is None:
            continue
        position = np.asarray(getattr(o, at.name))
        for item in np.flatnonzero(o.use == Use.ACTIVE).tolist():
            for row, axis in enumerate(np.asarray(axes)[item].tolist()):
                spot, value = (table, item, row), float(o.values[item, row])
                note(int(position[item]), str(o.source[item]), spot, axis, value)
    lists = tuple(dict.fromkeys(source for _, source in rows))
    xyz = np.full((len(rows), 3), np.nan)
    where = np.array(places, dtype=np.int64).reshape(-1, 5)
    xyz[where[:, 3], where[:, 4]] = values
    return _Given(
        np.array([p for p, _ in rows], dtype=np.int64),
        np.array([lists.index(source) for _, source in rows], dtype=np.int64),
        lists,
        xyz,
        where,
    )


def given_lists(network: Network, before: float, search: SlipSearch) -> Slip | None:
    """Find the other form of given coordinates in which a network fits.

    ``network``: it does not fit; ``before``: its variance factor, infinite if it could not be
    adjusted.
    """
    given = _given(network)
    if len(given.position) < _LEAST:
        return None
    try:
        nowhere = np.full_like(given.xyz, np.nan)
        free = given.within(network, nowhere).with_datum(Datum("free"))
        alone = search.run(free)
    except TribrachError:
        return None
    places, tilts = alone.state.positions[given.position], alone.defect >= _TILTS
    parts: list[Mask] = [np.ones(len(given.part), dtype=bool)]
    if len(given.lists) > 1:
        parts += [given.part == k for k in range(len(given.lists))]
    for part in parts:
        if part.sum() < _LEAST:
            continue
        for form in _fitting(given.xyz, places, part, tilts=tilts):
            read = np.where(part[:, None], form.read(given.xyz), given.xyz)
            if (np.isnan(read) != np.isnan(given.xyz)).any():
                continue
            corrected = given.within(network, read)
            after = search.explained(corrected, before)
            if after is not None:
                return Slip(
                    _in_words(network, given, part, form),
                    "read so",
                    before,
                    after,
                    "write the list in metres, with its columns in the order of its head",
                    GIVEN_LIST,
                    corrected=corrected,
                )
    return None


def _in_words(network: Network, given: _Given, part: Mask, form: _Form) -> str:
    """All points of a list, and how they look written."""
    names = list(
        dict.fromkeys(network.start.layout.position_name(int(p)) for p in given.position[part])
    )
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    file = given.lists[int(given.part[part][0])]
    where = f" in {file}" if file and len(set(given.part[part].tolist())) == 1 else ""
    listed = ", ".join(names[:_NAMED]) + more
    return (
        f"the given coordinates of all {len(names)} points{where} ({listed}) look written "
        f"otherwise: {form.words}"
    )


def _forms() -> Iterator[_Form]:
    """Units of all coordinates, of the plan and of the heights; orders and signs of axes."""
    for unit, size in OTHER_LENGTHS.items():
        for words, axes in (
            (f"they fit as {unit}", (1, 1, 1)),
            (f"their eastings and northings fit as {unit}", (1, 1, 0)),
            (f"their heights fit as {unit}", (0, 0, 1)),
        ):
            factor = np.where(axes, size, 1.0)
            yield _Form(words, _times(factor), (0, 3 - sum(axes)))
    for order in axis_orders(3):
        # half a turn about the vertical shows in nothing that is measured
        if order.plain or (order.moved == (0, 1, 2) and order.signs == (-1, -1, 1)):
            continue
        words = order.words(("easting", "northing", "height"))
        upright = order.moved[2] == 2 and order.signs[2] > 0
        yield _Form(words, order, (1, not upright, min(order.signs) < 0, order.changes))


def _times(factor: Array) -> Callable[[Array], Array]:
    """Coordinates times factors (3,)."""

    def read(xyz: Array) -> Array:
        out: Array = xyz * factor
        return out

    return read


def _fitting(xyz: Array, places: Array, part: Mask, *, tilts: bool) -> list[_Form]:
    """Forms of a part of the coordinates in which they fit their places, the likeliest first."""
    plain = _misfit(xyz, places, tilts=tilts)
    if not np.isfinite(plain):
        return []
    tried: list[tuple[float, _Form]] = []
    for form in _forms():
        left = _misfit(np.where(part[:, None], form.read(xyz), xyz), places, tilts=tilts)
        if left < _LEFT * plain:
            tried.append((left, form))
    if not tried:
        return []
    best = min(left for left, _ in tried)
    alike = [(form.rank, left, form) for left, form in tried if left <= _ALIKE * best]
    return [form for _, _, form in sorted(alike, key=lambda one: one[:2])][:_TRIED]


def _misfit(xyz: Array, places: Array, *, tilts: bool) -> float:
    """Residual [m] of coordinates aligned with places, upright or in any position."""
    known = np.isfinite(xyz + places).all(axis=1)
    if tilts and known.sum() >= _LEAST:
        return _rms(kabsch, places[known], xyz[known])
    plan = np.isfinite(xyz[:, :2] + places[:, :2]).all(axis=1)
    height = np.isfinite(xyz[:, 2] + places[:, 2])
    square, count = 0.0, 0
    if plan.sum() >= 2:
        square += _rms(planar, places[plan, :2], xyz[plan, :2]) ** 2 * plan.sum()
        count += int(plan.sum())
    if height.sum() >= 2:
        square += float(np.square(_centred(xyz[height, 2] - places[height, 2])).sum())
        count += int(height.sum())
    return float(np.sqrt(square / count)) if count else np.inf


def _centred(values: Array) -> Array:
    """Values (n,) less their mean."""
    out: Array = values - values.mean()
    return out


def _rms(align: Callable[[Array, Array], Alignment], a: Array, b: Array) -> float:
    """RMS of the residuals of an alignment; infinite if it is not determined."""
    try:
        return float(align(a, b).rms)
    except InputError:
        return np.inf
