"""Every observed value with its residual and its tests, as columns and as rows by id."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from html import escape
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.answers import Number, Result, rows_of
from tribrach.errors import InputError, UnknownName
from tribrach.network.assembly import Rows
from tribrach.network.quality import Quality, check_covariances
from tribrach.network.roles import scalar_roles
from tribrach.network.solved import SolvedSystem
from tribrach.observations.base import Observations, Use
from tribrach.observations.declaration import End
from tribrach.statistics import largest_first

#: words by :class:`Use`
_STATES = np.array(["active", "check", "off"], dtype=object)
_FIGURES = ("redundancy", "w", "tau", "mdb", "external")


@dataclass(frozen=True, repr=False)
class ObservationRow(
    Result,
    keys={"start": "from", "end": "to"},
    without=("number", "block_limit"),
    null=("external_at",),
    maybe=("reason",),
):
    """One observed value; figures that need it to take part are null for others.

    Numbers that do not exist are NaN: tests of values that take no part or that no other
    observation controls.
    """

    number: int  #: in the order of the network, from 1
    #: stable id of the observation, ``kind:from:to:file:n``; the components of a vector share it
    id: str
    kind: str
    #: which of its values this is, empty where it has one
    component: str
    start: str
    end: str
    #: ``m``, ``rad`` or ``1``, of value, sigma, residual and mdb
    unit: str
    value: float
    sigma: float  #: as it was given
    residual: Number  #: adjusted minus observed
    redundancy: Number  #: share of an error of the value that shows in its residual, 0 to 1
    #: test value with sigma0 a priori; of a check value the residual over its predicted sigma
    w: Number
    tau: Number  #: test value with sigma0 a posteriori
    mdb: Number  #: minimal detectable bias
    external: Number  #: what an undetected bias of that size would do to a position [m]
    external_at: str  #: which position
    block_test: Number  #: test of the whole vector or target
    #: its limit: chi-square a priori; a posteriori divided by the variance factor
    block_limit: Number
    #: of its variance component
    group: str
    state: Literal["active", "check", "off"]
    reason: str  #: why it is off or a check
    source: str  #: file and line, or scan and detection
    #: its test or that of its block is beyond the limit: of w and chi-square a priori, of tau and F
    #: where the quality is a posteriori
    suspicious: bool

    def __repr__(self) -> str:
        return f"<{self}>"

    def __str__(self) -> str:
        return (
            f"{self.id} {self.component}".rstrip() + f": {_sized(self.value, self.unit)}, "
            f"residual {_sized(self.residual, self.unit)}, w {self.w:.2f}, {self.state}"
        )


_NAMES = tuple(item.name for item in fields(ObservationRow))


class ObservationRows(Sequence[ObservationRow]):
    """Observed values in the order of the network: a sequence of rows, by number and by id.

    ``rows["slope_distance:A:B:traverse.gsi:1"]`` is the row of an observation with one value,
    ``rows["gnss_baseline:A:B:day1.gvx:1", "U"]`` that of one component of a vector.
    ``rows["traverse.gsi:7"]`` is the row of a line of a file that holds one value, and
    ``rows.of("traverse.gsi:7")`` those of any line. ``rows.column("w")`` is an array (n,) of all.

    ``columns``: arrays (n,) by the names of the attributes of :class:`ObservationRow`.
    """

    def __init__(self, columns: Mapping[str, NDArray[Any]]) -> None:
        self._columns = dict(columns)
        self._place: dict[str, list[int]] = {}

    def column(self, name: str) -> NDArray[Any]:
        """Array (n,) of an attribute of all rows."""
        if name not in self._columns:
            raise UnknownName("column", name, self._columns)
        return self._columns[name]

    def columns(self) -> dict[str, NDArray[Any]]:
        """All columns by the names that tables and JSON give them: ``from`` and ``to`` for ends."""
        keys = {"start": "from", "end": "to"}
        columns = {keys.get(n, n): self._columns[n] for n in _NAMES if n != "number"}
        where = columns["external_at"]
        columns["external_at"] = _objects([name or None for name in where])
        return columns

    def written(self) -> list[dict[str, Any]]:
        """The rows as JSON has them."""
        return rows_of(ObservationRow, self._columns)

    def __len__(self) -> int:
        return len(self._columns["id"])

    @overload
    def __getitem__(self, key: int | str | tuple[str, str]) -> ObservationRow: ...

    @overload
    def __getitem__(self, key: slice) -> ObservationRows: ...

    def __getitem__(
        self, key: int | str | tuple[str, str] | slice
    ) -> ObservationRow | ObservationRows:
        if isinstance(key, slice):
            return self.chosen(np.arange(len(self))[key])
        if isinstance(key, str):
            places = self._places(key)
            if len(places) > 1 and key not in self._index():
                ids = ", ".join(dict.fromkeys(str(self._columns["id"][k]) for k in places))
                raise InputError(
                    f"{key} holds {len(places)} values",
                    cure=f"name one of them by its id, or take rows.of({key!r}): {ids}",
                )
            if len(places) > 1:
                names = ", ".join(str(self._columns["component"][k]) for k in places)
                raise InputError(
                    f"{key} has {len(places)} values",
                    cure=f"name one of them, rows[id, component]: {names}",
                )
            return self._row(places[0])
        if isinstance(key, tuple):
            identity, component = key
            components = {str(self._columns["component"][k]): k for k in self._places(identity)}
            if component not in components:
                raise UnknownName(f"component of {identity}", component, components)
            return self._row(components[component])
        if not -len(self) <= key < len(self):
            raise IndexError(f"there are {len(self)} rows")
        return self._row(key % len(self))

    def __iter__(self) -> Iterator[ObservationRow]:
        whole = zip(*(self._columns[name].tolist() for name in _NAMES), strict=True)
        return (ObservationRow(*values) for values in whole)

    def __contains__(self, row: object) -> bool:
        if isinstance(row, str):
            return row in self._index()
        return any(row == other for other in self)

    def of(self, identity: str) -> ObservationRows:
        """The rows of one observation or one line of a file, one for each of their values."""
        return self.chosen(np.array(self._places(identity)))

    @property
    def suspicious(self) -> ObservationRows:
        """The rows whose test is beyond its limit, worst first."""
        return self.chosen(np.flatnonzero(self._columns["suspicious"])).worst()

    def worst(self, most: int | None = None) -> ObservationRows:
        """The rows by size of w, largest first; values without a test last."""
        w = np.nan_to_num(np.abs(self._columns["w"].astype(float)), nan=-1.0)
        return self.chosen(largest_first(w)[:most])

    def _row(self, k: int) -> ObservationRow:
        return ObservationRow(*(self._columns[name][k : k + 1].tolist()[0] for name in _NAMES))

    def chosen(self, rows: NDArray[Any]) -> ObservationRows:
        """Some of the rows, by numbers from 0 in their order, or by a mask (n,)."""
        return ObservationRows({name: column[rows] for name, column in self._columns.items()})

    def _index(self) -> dict[str, list[int]]:
        if not self._place:
            for k, identity in enumerate(self._columns["id"]):
                self._place.setdefault(str(identity), []).append(k)
        return self._place

    def _places(self, identity: str) -> list[int]:
        index = self._index()
        if identity in index:
            return index[identity]
        source = self._columns["source"].astype(str)
        read = np.flatnonzero(source == identity).tolist()
        if not read:
            near = index if identity.count(":") > 1 else dict.fromkeys(source.tolist())
            raise UnknownName("observation", identity, [*near])
        return read

    def __repr__(self) -> str:
        state = self._columns["state"]
        parts = [f"{int((state == word).sum())} {word}" for word in ("active", "check", "off")]
        return (
            f"<{len(self)} observed values: {', '.join(parts)}; "
            f"{int(self._columns['suspicious'].sum())} suspicious>"
        )

    def _repr_html_(self) -> str:
        """The worst rows as a table for notebooks."""
        return html_table(
            ["id", "value", "σ", "residual", "redundancy", "w", "state"],
            [
                [
                    f"{row.id} {row.component}".rstrip(),
                    _sized(row.value, row.unit),
                    _sized(row.sigma, row.unit),
                    _sized(row.residual, row.unit),
                    f"{row.redundancy:.2f}",
                    f"{row.w:.2f}",
                    f"{row.state} {row.reason}".rstrip(),
                ]
                for row in self.worst(20)
            ],
            repr(self)[1:-1] + ", worst first",
        )


def html_table(head: Sequence[str], rows: Sequence[Sequence[str]], caption: str) -> str:
    """A table for notebooks, everything in it escaped."""
    cells = "".join(f"<th>{escape(text)}</th>" for text in head)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(text)}</td>" for text in row) + "</tr>" for row in rows
    )
    return f"<table><caption>{escape(caption)}</caption><tr>{cells}</tr>{body}</table>"


def _sized(value: float, unit: str) -> str:
    """A value with its unit; small lengths in millimetres, angles in gon or milligon."""
    if unit == "rad":
        gon = value * 200 / np.pi
        return f"{gon:.4f} gon" if abs(gon) >= 0.1 else f"{1000 * gon:.2f} mgon"
    if unit == "m":
        return f"{value:.4f} m" if abs(value) >= 0.1 else f"{1000 * value:.2f} mm"
    return f"{value:.6g}"


def observation_rows(adjustment: SolvedSystem, quality: Quality) -> ObservationRows:
    """All observed values of an adjusted network in its order, whatever their state."""
    tables = adjustment.network.observations
    parts = [
        _columns(adjustment, quality, number, o, ids)
        for number, (o, ids) in enumerate(zip(tables, adjustment.network.ids, strict=True))
    ]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in _NAMES[1:]}
    for name in (*_FIGURES, "residual", "block_test", "block_limit"):
        # minus zero loses its sign
        columns[name] = np.where(np.isfinite(columns[name]), columns[name] + 0.0, np.nan)
    return ObservationRows({"number": np.arange(1, len(columns["id"]) + 1), **columns})


def _columns(
    adjustment: SolvedSystem,
    quality: Quality,
    number: int,
    o: Observations,
    ids: NDArray[np.object_],
) -> dict[str, NDArray[Any]]:
    """Columns of one table: its values row by row."""
    layout, rows = adjustment.layout, o.rows
    figures = _figures(adjustment, quality, number, o)
    statistic, limit = _blocks(quality, number, o)
    residual = -o.misclosure(adjustment.state)
    checks = np.flatnonzero(o.use == Use.CHECK)
    if len(checks):
        spread = np.sqrt(np.einsum("nii->ni", check_covariances(adjustment, o, checks)))
        figures["w"][checks] = residual[checks] / spread
        if quality.posterior:
            figures["tau"][checks] = figures["w"][checks] / np.sqrt(quality.variance_factor)
    suspicious = _suspicious(adjustment.rows, quality, number, o)
    judged = figures["tau" if quality.posterior else "w"][checks]
    suspicious[checks] = np.abs(np.nan_to_num(judged)) > quality.check_critical
    where = figures.pop("where").ravel().astype(int)
    start, end = o.end_names(layout)
    each = {
        "id": ids,
        "start": start,
        "end": end,
        "block_test": statistic,
        "block_limit": limit,
        "state": _STATES[o.use],
        "reason": _objects(o.reason.tolist()),
        "source": _objects(list(map(str, o.source))),
    }
    n = len(o)
    return {
        "kind": _objects([o.kind] * (n * rows)),
        "component": _objects(list(o.components) * n),
        "unit": _units(adjustment, o),
        "value": o.values.ravel(),
        "sigma": o.sigma.ravel(),
        "residual": residual.ravel(),
        "external_at": np.append(layout.name_array("position"), "")[where],
        "group": _objects([o.group] * (n * rows)),
        "suspicious": suspicious.ravel(),
        **{name: figure.ravel() for name, figure in figures.items()},
        **{name: np.repeat(column, rows) for name, column in each.items()},
    }


def _units(adjustment: SolvedSystem, o: Observations) -> NDArray[np.object_]:
    """Units (n * rows,) of all values; a prior of a scalar has that of its scalar."""
    reference = o.end_field(End.AT)
    if not o.facts.of_unknown or reference is None:
        return _objects(list(o.units) * len(o))
    roles = scalar_roles(adjustment)
    index = getattr(o, reference.name).tolist()
    units = [(roles[i][0],) if i in roles else o.units for i in index]
    return _objects([unit for own in units for unit in own])


def _objects(values: Sequence[Any]) -> NDArray[np.object_]:
    """An array (n,) of strings as objects."""
    column = np.empty(len(values), dtype=object)
    column[:] = values
    return column


def _figures(
    adjustment: SolvedSystem, quality: Quality, number: int, o: Observations
) -> dict[str, Array]:
    """Quality figures (n, rows) of a table; NaN (and position -1) for values not taking part."""
    rows = adjustment.rows
    active = np.flatnonzero(rows.table == number)
    place = rows.item[active], rows.row[active]
    out = {name: np.full(o.values.shape, np.nan) for name in _FIGURES}
    for name in _FIGURES:
        out[name][place] = getattr(quality, name)[active]
    out["where"] = np.full(o.values.shape, -1.0)
    known = np.isfinite(quality.external[active]) & (quality.external[active] > 0)
    out["where"][place] = np.where(known, quality.external_position[active], -1)
    return out


def _suspicious(rows: Rows, quality: Quality, number: int, o: Observations) -> NDArray[np.bool_]:
    """Values (n, rows) of a table that their test, or that of their block, rejects."""
    out = np.zeros(o.values.shape, dtype=bool)
    active = np.flatnonzero(rows.table == number)
    out[rows.item[active], rows.row[active]] = quality.suspicious[active]
    blocks = quality.blocks.table == number
    out[quality.blocks.item[blocks]] |= quality.blocks.rejected[blocks][:, None]
    return out


def _blocks(quality: Quality, number: int, o: Observations) -> tuple[Array, Array]:
    """Statistic and limit (n,) of whole observations; NaN and infinity where there is none."""
    statistic, limit = np.full(len(o), np.nan), np.full(len(o), np.inf)
    blocks = quality.blocks.table == number
    item = quality.blocks.item[blocks]
    statistic[item], limit[item] = quality.blocks.statistic[blocks], quality.blocks.critical[blocks]
    return statistic, limit
