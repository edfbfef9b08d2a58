"""What was measured, by name: the common ground of all readers.

A reader fills a :class:`Survey`; several surveys merge; :meth:`Survey.network` turns names into
indices and gives the :class:`~tribrach.network.network.Network`. Points that are observed but
not given coordinates become free points whose start values are found from the observations.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, KeysView, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tribrach._types import Array
from tribrach.errors import NO_TEXT, InputError, NoStartValues, UnknownName
from tribrach.geodesy.plumb import PlumbField, PlumbLines
from tribrach.geodesy.site import FlatSite, Site
from tribrach.network.alike_names import alike_groups, alike_hint, look_alike
from tribrach.network.facts import Fact, Reference
from tribrach.network.identity import file_and_line
from tribrach.network.network import (
    Constraint,
    Datum,
    JointCovariance,
    Network,
    axes_in_use,
    axes_sentence,
    is_given,
)
from tribrach.network.start.start_values import find_start
from tribrach.observations.base import Observations, Use, covariance_from_sigma
from tribrach.observations.control import Coordinate, Coordinates
from tribrach.observations.declaration import Category, Family
from tribrach.observations.unknowns import FAMILIES, Layout, State
from tribrach.sentences import Sentence
from tribrach.units import GON, LARGEST, beyond_circle, check_circle

#: standard deviations below are none
SMALLEST_SIGMA = 1e-15


#: nor are heights over a mark [m]
HIGHEST = 1e4


#: fields of every kind that are given otherwise than as columns
_NO_COLUMNS = frozenset({"values", "covariance", "source", "group", "site", "plumb"})


#: what coordinates of points are for
ROLES = ("control", "fixed", "check", "free", "approximate")
#: points, and observations of a point, that a sentence names
_NAMED, _NAMED_LINES = 8, 10
#: how often what hangs on points that are left out is looked for
_ROUNDS = 20
#: kinds that name points, and nothing but points
_OF_POINTS = ("point", "position")
#: how far entries of a given rotation may be off by rounding
_ROUNDING = 2e-3


@dataclass
class ObservationTable:
    """Observations of a kind as one call of :meth:`Survey.add` gave them."""

    kind: type[Observations]  #: the observation class
    group: str  #: name of the variance component
    #: columns (n, ...) by field, with names where the kind has indices of unknowns
    columns: dict[str, Any]
    n: int  #: how many observations
    hard: bool = False  #: the values hold exactly, as constraints

    def names(self, family: str) -> KeysView[str]:
        """Names of unknowns that the table refers to as this family, in its order."""
        out: dict[str, None] = {}
        for reference in self.kind.references():
            if reference.family == family and reference.name in self.columns:
                column = np.ravel(self.columns[reference.name])
                out.update({str(name): None for name in dict.fromkeys(column.tolist()) if name})
        return out.keys()

    def active(self) -> ObservationTable:
        """The rows without check values and rows switched off."""
        use = self.columns.get("use")
        if use is None:
            return self
        return self.part(as_column(use, self.n).astype(int) == Use.ACTIVE)

    def part(self, keep: NDArray[np.bool_]) -> ObservationTable:
        """Some of the observations, by a mask (n,)."""
        shared = {f.name for f in fields(self.kind) if "shared" in f.metadata}
        columns = {
            name: column if name in shared else _chosen(column, keep)
            for name, column in self.columns.items()
        }
        return ObservationTable(self.kind, self.group, columns, int(keep.sum()), self.hard)


def _chosen(column: Any, keep: NDArray[np.bool_]) -> Any:
    """The kept items of a column; what has one value for all stays."""
    if isinstance(column, list):
        return [item for item, kept in zip(column, keep, strict=True) if kept]
    return column[keep] if isinstance(column, np.ndarray) and column.ndim else column


def check_covariance(matrices: Array, source: Sequence[str], what: str) -> None:
    """Refuse covariances (n, k, k) that are not finite, symmetric and positive definite."""
    scale = np.sqrt(np.abs(np.einsum("nii->ni", matrices)))
    check_sigmas(np.where(scale > 0, scale, 1.0), source, what)
    scale[scale == 0] = 1.0
    unit = matrices / scale[:, :, None] / scale[:, None, :]
    finite = np.isfinite(unit).all(axis=(1, 2))
    even = np.isclose(unit, unit.swapaxes(1, 2), atol=1e-9).all(axis=(1, 2)) & finite
    good = even.copy()
    good[even] = np.linalg.eigvalsh(unit[even])[:, 0] > 1e-14
    if not good.all():
        raise InputError(
            f"covariance of {what} is not symmetric and positive definite",
            record=source[int(np.argmin(good))] or None,
            cure="check the order and the signs of its elements",
        )


def check_values(values: Array, source: Sequence[str], kind: str) -> None:
    """Refuse measured values (n, rows) that are not finite or beyond any measurement."""
    good = (np.abs(values) < LARGEST).all(axis=1)
    if good.all():
        return
    k = int(np.argmin(good))
    what = values[k][~(np.abs(values[k]) < LARGEST)][0]
    raise InputError(
        f"{kind} is {what:.3g}, beyond any measurement"
        if np.isfinite(what)
        else f"{kind} is not a number",
        record=source[k] or f"observation {k + 1}",
    )


def check_angles(values: Array, source: Sequence[str], kind: type[Observations]) -> list[str]:
    """Refuse angles of more than two turns, and tell of those of more than one.

    Angles of up to two turns are sums that nobody reduced to the circle, as programs write them;
    they are right as they are, or a digit of them is not.

    ``values`` (n, rows): of a kind, metres and radians.
    """
    out: list[str] = []
    for row in kind.angular:
        for k in np.flatnonzero(beyond_circle(values[:, row])).tolist():
            name = " ".join(filter(None, [kind.facts.title, kind.components[row]]))
            record = source[int(k)] or f"observation {k + 1}"
            try:
                check_circle(float(values[k, row]), turns=2)
            except ValueError as error:
                raise InputError(f"{name}: {error}", record=record) from None
            gon = values[k, row] / GON
            out.append(
                Sentence(
                    "{record}: the {name} of {gon:gong6} is more than a circle and counts as "
                    "{counts:gong6}: check that no digit is wrong",
                    record=record,
                    name=name,
                    gon=gon * GON,
                    counts=(gon - np.sign(gon) * 400) * GON,
                )
            )
    return out


def check_sigmas(sigmas: Array, source: Sequence[str], kind: str) -> None:
    """Refuse standard deviations (n, rows) that are not above zero, or beyond any weight."""
    fair = (sigmas > SMALLEST_SIGMA) & (sigmas < LARGEST)
    if fair.all():
        return
    k = int(np.argmin(fair.all(axis=1)))
    what = sigmas[k][~fair[k]][0]
    raise InputError(
        f"sigma of {kind} is {what:g}",
        record=source[k] or f"observation {k + 1}",
        cure="leave the observation out"
        if what >= LARGEST
        else f"give a standard deviation above {SMALLEST_SIGMA if what > 0 else 0:g}",
    )


def check_heights(columns: Mapping[str, Any], source: Sequence[str], kind: str) -> None:
    """Refuse heights of instruments, targets and antennas (n,) that nothing stands on."""
    for name, column in columns.items():
        if "height" not in name:
            continue
        heights = np.asarray(column, dtype=float)
        good = np.abs(heights) < HIGHEST
        if not good.all():
            k = int(np.argmin(good))
            raise InputError(
                f"{name.replace('_', ' ')} of {kind} is {heights[k]:.6g} m",
                record=source[k] or f"observation {k + 1}",
                cure="give the height over the mark in metres",
            )


def check_columns(
    kind: type[Observations], columns: Mapping[str, Any], n: int, source: Sequence[str]
) -> None:
    """Refuse columns that a kind does not have, and missing values in those it needs."""
    known = {item.name: item for item in fields(kind) if item.name not in _NO_COLUMNS}
    first = next((name for name in source if name), None)
    listed = f"a {kind.facts.title} has the columns {', '.join(known)}"
    for name in columns:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            raise InputError(
                f"a {kind.facts.title} has no column {name!r}",
                record=first,
                cure=f"did you mean {near[0]}? {listed}" if near else listed,
            )
    for name, item in known.items():
        required = item.default is MISSING and item.default_factory is MISSING
        if required and columns.get(name) is None:
            raise InputError(
                f"a {kind.facts.title} needs the column {name!r}", record=first, cure=listed
            )
    names_of = {reference.name for reference in kind.references()}
    for name, column in columns.items():
        whole = name in names_of or "shared" in known[name].metadata
        if not whole and np.ndim(column) and len(column) != n:
            raise InputError(
                f"the column {name!r} of {kind.facts.title} has {len(column)} entries for "
                f"{n} values",
                record=first,
                cure="give one for each, or a single one for all",
            )
    for reference in kind.references():
        column = columns.get(reference.name)
        if column is None:
            continue
        # a list with a number in it would become an array of words
        listed_names = np.array(column, dtype=object) if isinstance(column, list) else column
        names = as_column(listed_names, n)
        if len(names) != n:
            raise InputError(
                f"the column {reference.name!r} of {kind.facts.title} has {len(names)} names for "
                f"{n} values",
                record=first,
                cure="give one name for each",
            )
        flat = names.ravel().tolist()
        if {*map(type, flat)} <= {str} and (reference.optional or "" not in flat):
            continue
        for k, name in enumerate(flat):
            if reference.optional and not name:
                continue
            if not isinstance(name, str) or not name:
                raise InputError(
                    f"the {reference.name} of a {kind.facts.title} is {name!r}, not a name",
                    record=source[k * n // names.size] or f"observation {k * n // names.size + 1}",
                    cure=f"name a {reference.family}",
                )


def _numbers(given: Any, what: str) -> Array:
    """Given figures as an array; one that is not a number is refused."""
    try:
        return np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise InputError(
            f"{what} are not all numbers", cure="give metres and radians, without units"
        ) from None


def _origins(source: str | Sequence[str] | None, n: int, kind: type[Observations]) -> list[str]:
    """Sources (n,) of observations; one is taken for all."""
    if source is None or isinstance(source, str):
        return [source or ""] * n
    origins = list(source)
    if len(origins) != n:
        raise InputError(
            f"{kind.kind} has {len(origins)} sources for {n} values", cure="give one for each"
        )
    return origins


def as_column(part: Any, n: int) -> NDArray[Any]:
    """A column (n, ...) of a table; a single value is repeated."""
    if isinstance(part, str) or np.ndim(part) == 0:
        return np.full(n, part, dtype=object if isinstance(part, str) else float)
    array = np.asarray(part)
    return array.astype(object) if array.dtype.kind in "US" else array


def layout_of(given: Mapping[str, Iterable[str]], tables: Sequence[ObservationTable]) -> Layout:
    """All names that are given, by family, or referred to by the tables."""
    names: dict[str, dict[str, None]] = {family: {} for family in FAMILIES}
    for family, known in given.items():
        names[family] |= dict.fromkeys(known)
    for table in tables:
        for reference in table.kind.references():
            if reference.name not in table.columns:
                continue
            used = dict.fromkeys(table.columns[reference.name].ravel().tolist())
            used.pop("", None)
            if reference.family == "position":
                names["point"] |= {n: None for n in used if n not in names["pose"]}
            else:
                names[reference.family] |= used
    everyone = (name for known in names.values() for name in known)
    if bad := next(filter(NO_TEXT.search, everyone), None):
        raise InputError(
            f"the name {bad!a} holds a character that no text has",
            cure="write the name with letters, digits and signs that can be seen",
        )
    clash = names["point"].keys() & names["pose"].keys()
    if clash:
        raise InputError(
            f"{sorted(clash)[0]} is used both as a point and as a scanner station",
            cure="give the station a name of its own",
        )
    return Layout(*(tuple(names[family]) for family in FAMILIES))


def concatenate(
    layout: Layout, tables: Sequence[ObservationTable], site: Site, plumb: PlumbLines
) -> tuple[list[Observations], dict[int, tuple[int, int]]]:
    """One Observations per kind and group; where each table went (number, first item)."""
    grouped: dict[tuple[Any, ...], list[ObservationTable]] = {}
    for table in tables:
        shared = (f.name for f in fields(table.kind) if "shared" in f.metadata)
        # two instruments' calibration models do not mix, whatever their group
        key = (table.kind, table.group, *(table.columns.get(name) for name in shared))
        grouped.setdefault(key, []).append(table)
    out: list[Observations] = []
    place: dict[int, tuple[int, int]] = {}
    for (kind, group, *_), members in grouped.items():
        first = 0
        for table in members:
            place[id(table)] = (len(out), first)
            first += table.n
        out.append(_build(layout, kind, group, members, site, plumb))
    return out, place


def _build(
    layout: Layout,
    kind: type[Observations],
    group: str,
    members: list[ObservationTable],
    site: Site,
    plumb: PlumbLines,
) -> Observations:
    """The tables of one kind and group, one after the other."""
    columns: dict[str, Any] = {}
    families = {reference.name: reference.family for reference in kind.references()}
    for item in fields(kind):
        parts = [m.columns.get(item.name) for m in members]
        if item.name in ("group", "site", "plumb") or all(part is None for part in parts):
            continue
        if "shared" in item.metadata:
            columns[item.name] = parts[0]
            continue
        default = 0 if item.name == "use" else item.metadata.get("per_item", "")
        filled = [
            np.full(m.n, default, dtype=object if default == "" else float)
            if part is None
            else as_column(part, m.n)
            for part, m in zip(parts, members, strict=True)
        ]
        column = np.concatenate(filled)
        family = families.get(item.name)
        columns[item.name] = column if family is None else _indices(layout, family, column)
    for name, value in (("site", site), ("plumb", plumb)):
        if any(item.name == name for item in fields(kind)):
            columns[name] = value
    return kind(group=group, **columns)


def _indices(layout: Layout, family: Family, names: NDArray[Any]) -> NDArray[np.int64]:
    """Indices of names in a family; "" gives -1."""
    numbers = {**layout.numbers(family), "": -1}
    index = [numbers[name] for name in names.ravel().tolist()]
    return np.array(index, dtype=np.int64).reshape(names.shape)


def _rotation(matrix: Array, name: str, source: str) -> Array:
    """The rotation nearest to a matrix; refused where that is another one than was meant."""
    if matrix.shape == (3, 3):
        u, _, vt = np.linalg.svd(matrix)
        nearest: Array = u @ vt
        off = np.abs(nearest - matrix).max()
        if np.linalg.det(matrix) > 0 and off < _ROUNDING:
            return matrix if off < 1e-12 else nearest
    raise InputError(
        f"the matrix given for station {name} is not a rotation: its columns are not unit vectors"
        " at right angles, or they are left-handed",
        record=source or None,
        cure="give the matrix (3, 3) that turns scanner coordinates into the world",
    )


@dataclass
class GivenPoint:
    """A point with what is known of it beforehand."""

    xyz: Array  #: (3,), E, N, U [m], NaN where unknown
    free: NDArray[np.bool_]  #: (3,), false for fixed or unused components
    role: str = "free"  #: control, check or free
    covariance: Array | None = None  #: (3, 3), of weighted control [m^2]
    #: (3,), components that carry inner constraints, where the reader's format marks them
    datum: NDArray[np.bool_] | None = None
    source: str = ""  #: ``file:line``
    #: false for a check point whose coordinates came without sigmas: those that its observations
    #: have only make the comparison possible and say nothing of the coordinates
    stated: bool = True


@dataclass
class GivenStation:
    """A scanner station with six unknowns."""

    translation: Array  #: (3,), approximate place in the work frame [m], NaN if unknown
    rotation: Array  #: (3, 3), approximate rotation, world from scanner, NaN if unknown
    #: (6,), false for fixed parts: translation, then left rotation increments
    free: NDArray[np.bool_]
    source: str = ""  #: ``file:line``


def control_observations(points: Mapping[str, GivenPoint], layout: Layout) -> list[Observations]:
    """Weighted control coordinates as observations, one table of them or none."""
    control = [(n, p) for n, p in points.items() if p.covariance is not None]
    if not control:
        return []
    return [
        Coordinates(
            values=np.array([p.xyz for _, p in control]),
            covariance=np.array([p.covariance for _, p in control]),
            position=np.array([layout.index("point", n) for n, _ in control]),
            source=np.array([p.source for _, p in control], dtype=object),
            use=np.array([Use.CHECK if p.role == "check" else Use.ACTIVE for _, p in control]),
            group="control",
        )
    ]


@dataclass
class Survey:
    """Points, stations and observations by name.

    title : of the file or project, "" if it has none; reference : system of the coordinates;
    facts : what readers learned besides, for the report; leaves_out_unplaced : points that cannot
    be placed are left out, as the program does that the file belongs to; plumb : what is known of
    plumb lines and geoid at any place; deflections, undulations : xi, eta [rad] and geoid height
    [m] of positions by name, which go before that.
    """

    site: Site = field(default_factory=FlatSite)
    points: dict[str, GivenPoint] = field(default_factory=dict)
    stations: dict[str, GivenStation] = field(default_factory=dict)
    planes: dict[str, tuple[Array, float]] = field(default_factory=dict)
    vectors: dict[str, tuple[Array, bool | NDArray[np.bool_]]] = field(default_factory=dict)
    scalars: dict[str, tuple[float, bool]] = field(default_factory=dict)
    datum: Datum = field(default_factory=Datum)
    sigma0: float = 1.0
    warnings: list[str] = field(default_factory=list)
    title: str = ""
    reference: Reference = Reference()
    facts: tuple[Fact, ...] = ()
    leaves_out_unplaced: bool = False
    plumb: PlumbField = field(default_factory=PlumbField)
    deflections: dict[str, tuple[float, float]] = field(default_factory=dict)
    undulations: dict[str, float] = field(default_factory=dict)
    _tables: list[ObservationTable] = field(default_factory=list)
    #: tables are numbers of ``_tables`` here
    _joint: list[JointCovariance] = field(default_factory=list)

    def __repr__(self) -> str:
        kinds: dict[str, int] = {}
        for table in self._tables:
            kinds[table.kind.kind] = kinds.get(table.kind.kind, 0) + table.n
        counts = ", ".join(f"{n} {kind.replace('_', ' ')}" for kind, n in kinds.items())
        title = f" {self.title!r}" if self.title else ""
        given = [f"{len(self.points)} given points"]
        if self.stations:
            given.append(f"{len(self.stations)} stations")
        return f"<Survey{title}: {', '.join(given)}; {counts or 'nothing observed'}>"

    def point(
        self,
        name: str,
        xyz: ArrayLike = (np.nan, np.nan, np.nan),
        *,
        free: ArrayLike = (True, True, True),
        role: str = "free",
        covariance: ArrayLike | None = None,
        datum: ArrayLike | None = None,
        source: str = "",
        stated: bool = True,
    ) -> None:
        """Add a point; a second definition of the same name is an error.

        Parameters
        ----------
        name : str
            Unique among points and stations.
        xyz : array_like (3,)
            E, N, U [m]; NaN where the observations are to tell.
        free : array_like of bool (3,)
            False for components that are held or not used.
        role : {"control", "fixed", "check", "free", "approximate"}
            What the coordinates are for. With a covariance those of a check point are held out of
            the adjustment and compared with it; others are weighted control.
        covariance : array_like (3, 3), optional
            Of the given coordinates [m^2].
        datum : array_like of bool (3,), optional
            Components that carry inner constraints.
        source : str
            ``file:line``.
        stated : bool
            False if the coordinates of a check point came without sigmas.

        Raises
        ------
        InputError
            Duplicate name, unknown role, impossible coordinates, covariance of another shape or
            not positive definite.
        """
        if name in self.points or name in self.stations:
            other = (self.points.get(name) or self.stations[name]).source
            raise InputError(
                f"point {name} is defined twice" + (f" (first at {other})" if other else ""),
                record=source or None,
                cure="keep one definition",
            )
        if role not in ROLES:
            raise UnknownName("role of a point", role, ROLES)
        coordinates = np.asarray(xyz, dtype=float)
        if (np.abs(coordinates) >= LARGEST).any():
            raise InputError(
                f"point {name} has a coordinate of {np.nanmax(np.abs(coordinates)):.3g} m",
                record=source or None,
                cure="give coordinates in metres",
            )
        matrix = None if covariance is None else np.asarray(covariance, dtype=float)
        if matrix is not None:
            if matrix.shape != (3, 3):
                raise InputError(
                    f"the covariance of point {name} has the shape {matrix.shape}",
                    record=source or None,
                    cure="give a matrix (3, 3) in square metres",
                )
            check_covariance(matrix[None], [source], f"point {name}")
        mask = None if datum is None else np.asarray(datum, dtype=bool)
        self.points[name] = GivenPoint(
            coordinates, np.asarray(free, dtype=bool), role, matrix, mask, source, stated
        )

    def station(
        self,
        name: str,
        *,
        translation: ArrayLike = (np.nan, np.nan, np.nan),
        rotation: ArrayLike | None = None,
        free: ArrayLike = (True, True, True, True, True, True),
        source: str = "",
    ) -> None:
        """Add a scanner station.

        Parameters
        ----------
        name : str
            Unique among points and stations.
        translation : array_like (3,)
            Place of the scanner in the work frame, E, N, U [m]; NaN where the observations are
            to tell.
        rotation : array_like (3, 3), optional
            World from scanner. One that is off by rounding, up to 0.002 in an entry, is replaced
            by the nearest rotation.
        free : array_like of bool (6,)
            False for parts that are held: translation, then left rotation increments.
        source : str
            ``file:line``.

        Raises
        ------
        InputError
            A second definition of the same name, or a matrix that is not a rotation.
        """
        if name in self.points or name in self.stations:
            raise InputError(
                f"station {name} is defined twice",
                record=source or None,
                cure="keep one definition",
            )
        matrix = np.full((3, 3), np.nan) if rotation is None else np.asarray(rotation, dtype=float)
        if rotation is not None and not np.isnan(matrix).any():
            matrix = _rotation(matrix, name, source)
        self.stations[name] = GivenStation(
            np.asarray(translation, dtype=float), matrix, np.asarray(free, dtype=bool), source
        )

    def add(
        self,
        kind: type[Observations],
        *,
        values: ArrayLike,
        sigma: ArrayLike | None = None,
        covariance: ArrayLike | None = None,
        source: str | Sequence[str] | None = None,
        group: str = "",
        hard: bool = False,
        **columns: Any,
    ) -> int:
        """Add n observations of a kind.

        Parameters
        ----------
        kind : type[Observations]
            The observation class; its index fields are given as names here.
        values : array (n,) or (n, rows)
            In metres and radians.
        sigma : array (n,) or (n, rows), optional
            Standard deviations; not needed with ``hard``.
        covariance : array (n, rows, rows), optional
            In place of sigma.
        source : str or sequence of str (n,), optional
            ``file:line`` of each, or one for all.
        group : str, optional
            Name of the variance component; that of the kind if not given.
        hard : bool
            The values must hold exactly (a constraint).
        **columns
            The kind's own fields (n, ...), names for those that refer to unknowns; ``use`` and
            ``reason``. A single value is repeated.

        Returns
        -------
        int
            The table's number for :meth:`correlate`.

        Raises
        ------
        InputError
            A column that the kind does not have, one that it must have and is missing or empty,
            one of another length; a value that is not a number, an angle of more than two circles,
            a sigma that is not positive, a covariance that is not positive definite.
        """
        rows = len(kind.units)
        measured = _numbers(values, f"the values of {kind.kind}").reshape(-1, rows)
        n = len(measured)
        origin = _origins(source, n, kind)
        check_columns(kind, columns, n, origin)
        check_values(measured, origin, kind.kind)
        self.warnings += check_angles(measured, origin, kind)
        if covariance is None:
            if sigma is None and not hard:
                raise InputError(
                    f"the observations of {kind.kind} have neither sigma nor covariance",
                    record=next((name for name in origin if name), None),
                    cure="give one of them",
                )
            sigmas = _numbers(1.0 if sigma is None else sigma, f"the sigmas of {kind.kind}")
            sigmas = sigmas.reshape(-1, rows) if sigmas.ndim else sigmas
            if sigmas.ndim and len(sigmas) not in (1, n):
                raise InputError(
                    f"{kind.kind} has {len(sigmas)} sigmas for {n} values",
                    cure="give one for all, or one for each",
                )
            sigmas = np.broadcast_to(sigmas, (n, rows))
            check_sigmas(sigmas, origin, kind.kind)
            matrices = covariance_from_sigma(sigmas)
        else:
            matrices = _numbers(covariance, f"the covariances of {kind.kind}")
            if matrices.size != n * rows * rows:
                raise InputError(
                    f"{kind.kind} has covariances of the shape {matrices.shape}",
                    cure=f"give them as {(n, rows, rows)}",
                )
            matrices = matrices.reshape(-1, rows, rows).copy()
            check_covariance(matrices, origin, kind.kind)
        whole = {item.name for item in fields(kind) if "shared" in item.metadata}
        table = {
            name: column if name in whole else as_column(column, n)
            for name, column in columns.items()
        }
        check_heights(table, origin, kind.kind)
        table |= {"values": measured, "covariance": matrices, "source": origin}
        self._tables.append(ObservationTable(kind, group or kind.kind, table, n, hard))
        return len(self._tables) - 1

    def correlate(
        self,
        table: ArrayLike,
        item: ArrayLike,
        row: ArrayLike,
        covariance: ArrayLike,
        source: str = "",
        common: tuple[Array, Category] | None = None,
    ) -> None:
        """Give values of several observations one covariance matrix (k, k).

        table, item, row (k,): the number that :meth:`add` returned, the observation within that
        call, its row; common: the part (k, k) of the matrix that one cause makes common to them,
        with its part of the error budget.

        Raises
        ------
        InputError
            The matrix, or what of it is not common, is not symmetric positive definite, or that
            correlates observations with each other.
        """
        matrix = np.asarray(covariance, dtype=float)
        check_covariance(matrix[None], [source], "covariance matrix")
        index = [np.asarray(a, dtype=np.int64).ravel() for a in (table, item, row)]
        same = (index[0][:, None] == index[0]) & (index[1][:, None] == index[1])
        if common is not None:
            own = matrix - common[0]
            check_covariance(own[None], [source], "covariance matrix of what is not common")
            if (np.abs(own) > 1e-9 * np.sqrt(np.outer(np.diag(own), np.diag(own))))[~same].any():
                raise InputError(
                    "observations are correlated by more than what they have in common",
                    record=source or None,
                    cure="give their whole correlation as common",
                )
        shared, category = common or (None, None)
        self._joint.append(JointCovariance(index[0], index[1], index[2], matrix, shared, category))
        for a, b in np.argwhere(same):  # each observation's own block, for the reports
            columns = self._tables[index[0][a]].columns
            columns["covariance"][index[1][a], index[2][a], index[2][b]] = matrix[a, b]

    def correlated_tables(self) -> set[int]:
        """Numbers of the tables of which some values have a covariance with others."""
        return {int(n) for joint in self._joint for n in joint.table}

    def copy(self) -> Survey:
        """Copy the survey so that what is added to one does not come to the other.

        Returns
        -------
        Survey
            With points, stations and tables of its own; the numbers in them are shared.
        """
        return replace(
            self,
            points={name: replace(point) for name, point in self.points.items()},
            stations={name: replace(station) for name, station in self.stations.items()},
            planes=dict(self.planes),
            vectors=dict(self.vectors),
            scalars=dict(self.scalars),
            warnings=list(self.warnings),
            deflections=dict(self.deflections),
            undulations=dict(self.undulations),
            _tables=[replace(table, columns=dict(table.columns)) for table in self._tables],
            _joint=list(self._joint),
        )

    def merge(self, other: Survey) -> None:
        """Add everything of another survey.

        A point defined in both keeps the definition that has more to say: coordinates over none.

        Raises
        ------
        InputError
            The same point defined with different coordinates in both.
        """
        for name, given in other.points.items():
            own = self.points.get(name)
            if own is not None and not np.isnan(own.xyz).all() and not np.isnan(given.xyz).all():
                raise InputError(
                    f"point {name} is defined in both {own.source or 'one survey'} and "
                    f"{given.source or 'the other'}",
                    cure="keep one definition",
                )
            if own is None or np.isnan(own.xyz).all():
                self.points[name] = given
        self.stations |= other.stations
        self.planes |= other.planes
        self.vectors |= other.vectors
        self.scalars |= other.scalars
        first = len(self._tables)
        self._tables += other._tables
        self._joint += [replace(joint, table=joint.table + first) for joint in other._joint]
        self.warnings += other.warnings
        self.leaves_out_unplaced |= other.leaves_out_unplaced
        self.title = self.title or other.title
        self.reference = self.reference.completed(other.reference)
        self.facts += other.facts
        self.deflections |= other.deflections
        self.undulations |= other.undulations
        if other.plumb != PlumbField():
            self.plumb = other.plumb
        if other.datum.kind != "control":
            self.datum = other.datum

    def tables(self) -> tuple[ObservationTable, ...]:
        """Tables of observations, call by call."""
        return tuple(self._tables)

    def joint_covariances(self) -> tuple[JointCovariance, ...]:
        """Covariances across observations; their tables are numbers of :meth:`tables`."""
        return tuple(self._joint)

    def joint_tables(self) -> set[int]:
        """Numbers of the tables that share a covariance with others."""
        return {int(t) for joint in self._joint for t in joint.table}

    def replace_tables(self, parts: Sequence[Sequence[ObservationTable]]) -> None:
        """Put others in the place of each table; those that share a covariance stay single."""
        first = np.cumsum([0, *(len(part) for part in parts)])
        self._tables = [table for part in parts for table in part]
        self._joint = [replace(joint, table=first[joint.table]) for joint in self._joint]

    def part(self, keep: Sequence[NDArray[np.bool_]]) -> Survey:
        """Some of the observations, with what is left of the covariances that they share.

        Parameters
        ----------
        keep : sequence of array of bool (n,)
            Which observations of each table stay.

        Returns
        -------
        Survey
            With the same points; tables of which nothing stays are left out.
        """
        stays = [bool(mask.any()) for mask in keep]
        number = np.cumsum([0, *stays])
        place = [np.cumsum(mask) - 1 for mask in keep]
        joint = []
        for whole in self._joint:
            pairs = zip(whole.table.tolist(), whole.item.tolist(), strict=True)
            kept = np.flatnonzero([bool(keep[t][i]) for t, i in pairs])
            if len(kept):
                left = whole.part(kept)
                pairs = zip(left.table.tolist(), left.item.tolist(), strict=True)
                moved = np.array([place[t][i] for t, i in pairs], dtype=np.int64)
                joint.append(replace(left, table=number[left.table], item=moved))
        return replace(
            self,
            _tables=[t.part(m) for t, m, s in zip(self._tables, keep, stays, strict=True) if s],
            _joint=joint,
        )

    def of_marks(self, *, active: bool = True) -> Survey:
        """The survey of marks alone, without scanner stations and check values.

        Points that nothing else observes are left out, so that the rest can be adjusted by itself.

        Parameters
        ----------
        active : bool
            False to keep check values and what is switched off.
        """
        tables = [
            table.active() if active else table
            for table in self._tables
            if not table.names("pose") and not (table.names("position") & self.stations.keys())
        ]
        return self._of(tables, {})

    def of_stations(self) -> Survey:
        """What ties scanner stations to each other alone: targets, planes, poses, plumb lines.

        Points have no given coordinates here, and nothing places the stations in the frame:
        adjusted as a free network they are a model of the site.
        """
        tables = [
            table.active()
            for table in self._tables
            if table.names("pose") and not table.kind.facts.places_station
        ]
        inner = self._of(tables, self.stations)
        points = {
            name: GivenPoint(np.full(3, np.nan), np.ones(3, dtype=bool), source=given.source)
            for name, given in inner.points.items()
        }
        return replace(inner, points=points, datum=Datum("free", tuple(inner.stations)))

    def _of(self, tables: list[ObservationTable], stations: dict[str, GivenStation]) -> Survey:
        """Some of the tables with the unknowns that they refer to."""
        tables = [table for table in tables if table.n]
        used = {f: set().union(*(t.names(f) for t in tables)) for f in (*FAMILIES, "position")}
        return replace(
            self,
            points={n: p for n, p in self.points.items() if n in used["point"] | used["position"]},
            stations={n: s for n, s in stations.items() if n in used["pose"] | used["position"]},
            planes={n: p for n, p in self.planes.items() if n in used["plane"]} if stations else {},
            vectors={n: v for n, v in self.vectors.items() if n in used["vector"]},
            scalars={n: v for n, v in self.scalars.items() if n in used["scalar"]},
            warnings=[],
            _tables=tables,
            _joint=[],
        )

    def used_as_in(self, network: Network) -> Survey:
        """The same survey with uses and held coordinates of the network that was made of it.

        Parameters
        ----------
        network : Network
            As :meth:`network` made it, with other uses of observations and roles of points.

        Returns
        -------
        Survey
            Points whose given coordinates take no part any more are free; the tables have the uses
            of the network.
        """
        layout = network.start.layout
        soft = [table for table in self._tables if not table.hard]
        _, place = concatenate(layout, soft, self.site, self._plumb_lines(layout))
        uses = [o.use for o in network.observations]
        tables = []
        for table in self._tables:
            if not table.hard:
                number, first = place[id(table)]
                use = uses[number][first : first + table.n]
                table = replace(table, columns={**table.columns, "use": use})
            tables.append(table)
        weighted = [name for name, given in self.points.items() if given.covariance is not None]
        number = 1 + max((number for number, _ in place.values()), default=-1)
        active = dict(zip(weighted, uses[number] == Use.ACTIVE, strict=True)) if weighted else {}
        points = {}
        for name, given in self.points.items():
            free = network.free[layout.columns("point", layout.index("point", name))]
            counts = active.get(name, False)
            weight, role = (given.covariance, "control") if counts else (None, given.role)
            points[name] = replace(given, free=free, covariance=weight, role=role)
        return replace(self, points=points, _tables=tables)

    def named(self, kind: type[Observations], field_name: str) -> set[str]:
        """Names that the observations of a kind have in one of its fields."""
        names: set[str] = set()
        for table in self._tables:
            if table.kind is kind and field_name in table.columns:
                names |= {str(name) for name in np.ravel(table.columns[field_name]) if name}
        return names

    def network(self) -> Network:
        """Resolve all names and give the network.

        Raises
        ------
        InputError
            Nothing observed, or a name refers to an unknown of another family.
        """
        if not self._tables:
            left_out = "; ".join(text.removesuffix(".") for text in self.warnings)
            raise InputError(
                f"no observations take part: {left_out}"
                if left_out
                else "there are no observations",
                cure=None if left_out else "give a file with observations",
            )
        layout = layout_of(self._given(), self._tables)
        tables, plumb = self._tables, self._plumb_lines(layout)
        soft = [t for t in tables if not t.hard]
        kinds, place = concatenate(layout, soft, self.site, plumb)
        hard, _ = concatenate(layout, [t for t in tables if t.hard], self.site, plumb)
        free, datum_mask = self._masks(layout)
        datum = self.datum
        if datum.kind == "free" and datum.components is None and datum_mask is not None:
            datum = Datum("free", datum.names, datum_mask)
        return Network(
            start=self._start(layout),
            free=free,
            observations=tuple(kinds + control_observations(self.points, layout)),
            joint=self._joint_covariances(place),
            constraints=tuple(Constraint(o) for o in hard),
            datum=datum,
            site=self.site,
            sigma0=self.sigma0,
            warnings=tuple(self.warnings),
            title=self.title,
            reference=self.reference,
            facts=self.facts,
            point_sources={name: p.source for name, p in self.points.items() if p.source},
        )

    def _plumb_lines(self, layout: Layout) -> PlumbLines:
        """Plumb lines of all positions, in their order."""
        names = [*layout.names["point"], *layout.names["pose"]]
        deflections, undulations = np.empty((0, 2)), np.empty(0)
        if self.deflections:
            none = (np.nan, np.nan)
            deflections = np.array([self.deflections.get(name, none) for name in names])
        if self.undulations:
            undulations = np.array([self.undulations.get(name, np.nan) for name in names])
        return PlumbLines(self.plumb, deflections, undulations)

    def _given(self) -> dict[str, Iterable[str]]:
        """Names that are given, by family."""
        return {
            "point": self.points,
            "pose": self.stations,
            "plane": self.planes,
            "vector": self.vectors,
            "scalar": self.scalars,
        }

    def _joint_covariances(
        self, place: Mapping[int, tuple[int, int]]
    ) -> tuple[JointCovariance, ...]:
        """Joint covariances of the network, from where each table went in it."""
        return tuple(
            replace(
                joint,
                table=np.array([place[id(self._tables[t])][0] for t in joint.table]),
                item=np.array([place[id(self._tables[t])][1] for t in joint.table]) + joint.item,
            )
            for joint in self._joint
        )

    def _start(self, layout: Layout) -> State:
        start = State.blank(layout)
        if self.points:
            numbers = layout.numbers("point")
            index = [numbers[name] for name in self.points]
            start.points[index] = [given.xyz for given in self.points.values()]
        for name, station in self.stations.items():
            start.pose_t[layout.index("pose", name)] = station.translation
            start.pose_r[layout.index("pose", name)] = station.rotation
        for name, (normal, offset) in self.planes.items():
            start.plane_n[layout.index("plane", name)] = normal
            start.plane_d[layout.index("plane", name)] = offset
        for name, (vector, _) in self.vectors.items():
            start.vectors[layout.index("vector", name)] = vector
        start.scalars[:] = np.nan
        for name, (value, _) in self.scalars.items():
            start.scalars[layout.index("scalar", name)] = value
        return start

    def _masks(self, layout: Layout) -> tuple[NDArray[np.bool_], NDArray[np.bool_] | None]:
        """Free columns, and columns that carry the datum if the survey marks any."""
        free = np.ones(layout.size, dtype=bool)
        datum = np.zeros(layout.size, dtype=bool)
        numbers = layout.numbers("point")
        columns = layout.columns("point", np.array([numbers[name] for name in self.points]))
        for place, given in zip(columns, self.points.values(), strict=True):
            free[place] = given.free
            if given.datum is not None:
                datum[place] = given.datum
        for name, station in self.stations.items():
            free[layout.columns("pose", layout.index("pose", name))] = station.free
        for name, (_, is_free) in self.vectors.items():
            free[layout.columns("vector", layout.index("vector", name))] = is_free
        for name, (_, is_free) in self.scalars.items():
            free[layout.columns("scalar", layout.index("scalar", name))] = is_free
        return free, datum if datum.any() else None


def observed_part(survey: Survey) -> Survey:
    """The survey without points and without axes that are given and observed by nothing.

    Lists of coordinates mostly name more points than a job observed, and levelling lines or a
    trilateration come with all three coordinates of their control, or with fewer. Of a survey in
    which nothing is observed at all the points stay.
    """
    if all(map(_given, survey.tables())):
        return _axes(survey)
    return _placed_part(_axes(_points(survey)))


def _given(table: ObservationTable) -> bool:
    """True for coordinates that were given, not observed."""
    return is_given(table.kind, table.group)


def _points(survey: Survey) -> Survey:
    """The survey without points that have only given coordinates."""
    observed: set[str] = set()
    for number, table in enumerate(survey.tables()):
        # coordinates that share a covariance with others stay together
        if not _given(table) or number in survey.joint_tables():
            observed |= set().union(*(table.names(family) for family in (*FAMILIES, "position")))
    alone = [name for name in survey.points if name not in observed]
    hints = _hints(observed, survey.points, set(alone))
    if not alone:
        return replace(survey, warnings=[*survey.warnings, *hints]) if hints else survey
    left_out = set(alone)
    parts = []
    for table in survey.tables():
        if not table.names("position") & left_out:
            parts.append([table])
            continue
        names = np.ravel(table.columns["position"])
        keep = np.array([str(name) not in left_out for name in names], dtype=bool)
        parts.append([table.part(keep)] if keep.any() else [])
    points = {name: given for name, given in survey.points.items() if name not in left_out}
    out = replace(survey, points=points, warnings=[*survey.warnings, _unobserved(alone), *hints])
    out.replace_tables(parts)
    return out


def _hints(observed: set[str], given: Mapping[str, GivenPoint], alone: set[str]) -> list[str]:
    """Names that may be one point: given but not observed, and observed but not given."""
    out = []
    for group in alike_groups(sorted(observed | set(given))):
        unknown = [name for name in group if name in observed and name not in given]
        unseen = [name for name in group if name in alone]
        known = ", and the one is given and not observed, the other observed and not given"
        out += [alike_hint(a, b, known) for a in unseen for b in unknown]
        seen = [name for name in group if name in observed]
        out += [alike_hint(seen[0], b) for b in seen[1:] if look_alike(seen[0], b)]
    return out


def _unobserved(names: list[str]) -> str:
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    several = f"s {', '.join(names[:_NAMED])}{more} are" if len(names) > 1 else f" {names[0]} is"
    return f"Point{several} given and observed by nothing: left out."


def _axes(survey: Survey) -> Survey:
    """The survey without plan, or without heights, if nothing in it depends on them."""
    tables = survey.tables()
    telling = [t for t in tables if not _given(t)] or tables
    used = axes_in_use([t.kind.observed_axes(t.columns) for t in telling], survey.site)
    sentence = axes_sentence(used)
    joint = survey.joint_tables()
    whole = any(given.covariance is not None for given in survey.points.values())
    whole |= any(
        _given(t) and (k in joint or _correlated(t)) and not _within(t, used)
        for k, t in enumerate(tables)
    )
    # coordinates that are correlated with each other are not taken apart
    if sentence is None or whole:
        return survey
    names = dict.fromkeys(n for t in tables for f in _OF_POINTS for n in sorted(t.names(f)))
    blank = GivenPoint(np.full(3, np.nan), np.ones(3, dtype=bool))
    points = {name: survey.points.get(name, blank) for name in (*survey.points, *names)}
    if not any((given.free & ~used).any() for given in points.values()):
        return survey
    out = replace(
        survey,
        points={n: replace(p, free=p.free & used) for n, p in points.items()},
        warnings=[*survey.warnings, sentence],
    )
    out.replace_tables([_of_axes(t, used) if _given(t) else [t] for t in tables])
    return out


def _within(table: ObservationTable, used: NDArray[np.bool_]) -> bool:
    """True if a table of single coordinates has none along axes that are not in use."""
    return table.kind is Coordinate and bool(
        used[np.asarray(table.columns["axis"]).astype(int)].all()
    )


def _correlated(table: ObservationTable) -> bool:
    """True if coordinates E, N, U of a point are correlated."""
    covariance = table.columns["covariance"]
    return bool((covariance * (1 - np.eye(covariance.shape[1]))).any())


def _of_axes(table: ObservationTable, used: NDArray[np.bool_]) -> list[ObservationTable]:
    """Given coordinates along the axes in use, one table for each axis."""
    axes = np.flatnonzero(used)
    if table.kind is Coordinate:
        keep = np.isin(np.asarray(table.columns["axis"]).astype(int), axes)
        return [table.part(keep)] if keep.any() else []
    if len(table.kind.units) == 1:  # heights
        return [table] if used[2] else []
    out = []
    for axis in axes:
        columns: dict[str, Any] = dict(table.columns)
        columns["values"] = columns["values"][:, axis : axis + 1]
        columns["covariance"] = columns["covariance"][:, axis : axis + 1, axis : axis + 1]
        columns["axis"] = np.full(table.n, axis)
        out.append(ObservationTable(Coordinate, table.group, columns, table.n, table.hard))
    return out


def _placed_part(survey: Survey) -> Survey:
    """The survey without points that cannot be placed, and without what was observed of them.

    GNU Gama and Comp3D compute a network without the points that have no approximate
    coordinates. Their files are read so, if most points stay.
    """
    if not survey.leaves_out_unplaced:
        return survey
    part, network = survey, survey.network()
    everywhere = set(network.start.layout.names["point"])
    for _ in range(_ROUNDS):
        try:
            find_start(network)
        except NoStartValues as error:
            left_out = {name for family, name in error.unplaced if family == "point"}
            kept = {*network.start.layout.names["point"]} - left_out
            if not left_out or 2 * len(kept) <= len(everywhere):
                return survey
            part = _without(part, left_out)
            if all(map(_given, part.tables())):
                return survey
            network = part.network()
        else:
            break
    return part


def _without(survey: Survey, names: set[str]) -> Survey:
    """The survey without points and without the observations that refer to them."""
    masks = [_untouched(table, names) for table in survey.tables()]
    sources: dict[str, dict[str, None]] = {name: {} for name in sorted(names)}
    for table, keep in zip(survey.tables(), masks, strict=True):
        for row in np.flatnonzero(~keep).tolist():
            for name in names & _points_of(table, row):
                sources[name][str(table.columns["source"][row])] = None
    sentences = [_unplaced(n, sorted(s, key=file_and_line)) for n, s in sources.items()]
    return replace(
        survey.part(masks),
        points={name: given for name, given in survey.points.items() if name not in names},
        warnings=[*survey.warnings, *sentences],
    )


def _untouched(table: ObservationTable, names: set[str]) -> NDArray[np.bool_]:
    """Which observations (n,) refer to none of the points."""
    if not names & {*table.names("point"), *table.names("position")}:
        return np.ones(table.n, dtype=bool)
    return np.array([not names & _points_of(table, row) for row in range(table.n)], dtype=bool)


def _points_of(table: ObservationTable, row: int) -> set[str]:
    """Names of points that an observation refers to."""
    return {
        str(np.broadcast_to(table.columns[reference.name], table.n)[row])
        for reference in table.kind.references()
        if reference.family in ("point", "position") and reference.name in table.columns
    }


def _unplaced(name: str, sources: list[str]) -> str:
    sources = [source for source in sources if source]
    more = f" and {len(sources) - _NAMED_LINES} more" if len(sources) > _NAMED_LINES else ""
    lines = f" ({', '.join(sources[:_NAMED_LINES])}{more})" if sources else ""
    own = "observation" if len(sources) == 1 else "observations"
    return f"Point {name} cannot be placed: it is left out with its {own}{lines}."
