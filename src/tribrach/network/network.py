"""Observations + unknowns + datum: the least-squares network before it is adjusted."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tribrach._types import Array, Index
from tribrach.answers import Result
from tribrach.errors import InputError, UnknownName
from tribrach.geodesy.site import FlatSite, Site
from tribrach.network.facts import Fact, Reference
from tribrach.network.identity import observation_ids
from tribrach.observations.base import Observations, Use
from tribrach.observations.control import CHECK_SIGMA, Coordinate
from tribrach.observations.declaration import Category, ObservedAxes
from tribrach.observations.unknowns import State


def axes_in_use(axes: Iterable[ObservedAxes], site: Site) -> NDArray[np.bool_]:
    """Axes E, N, U (3,) that a network observes at all.

    On a flat site plan and heights part: directions, angles, azimuths and horizontal distances know
    nothing of heights, levelled height differences nothing of the plan. What a whole network does
    not observe takes no part in it, as in a levelling network or a trilateration. Single points
    that lack an observation are another matter and refused as such.
    """
    observed = set(axes) - {ObservedAxes.NONE}
    used = np.ones(3, dtype=bool)
    if not isinstance(site, FlatSite):
        return used
    if observed == {ObservedAxes.PLAN}:
        used[2] = False
    elif observed == {ObservedAxes.HEIGHTS}:
        used[:2] = False
    return used


def is_given(kind: type[Observations], group: str) -> bool:
    """True for observations that are given coordinates, control or check."""
    return kind.facts.listed_as_control and group == "control"


def axes_sentence(used: NDArray[np.bool_]) -> str | None:
    """Sentence on coordinates that take no part; None if all do."""
    if used.all():
        return None
    if used[2]:
        return "Heights alone are observed: coordinates in plan take no part."
    return "Heights are not observed: the network is adjusted in plan."


DatumKind = Literal["control", "free", "fixed"]
#: what given coordinates of a point can be made to do
PointRole = Literal["control", "check", "free"]


@dataclass(frozen=True)
class Datum:
    """Datum: control, inner constraints or fixed points.

    Attributes
    ----------
    kind
        ``"control"``: the given control (fixed or weighted) and nothing else; ``"free"``: inner
        constraints, the corrections of the datum unknowns have minimum norm; ``"fixed"``: the
        named points are held at their given coordinates.
    names
        Points and stations that carry the datum; with ``free`` all of them if empty.
    components
        Optional mask (n_columns,) of the full tangent vector that carries the inner
        constraints, for networks whose points are datum points in some coordinates only.

    Raises
    ------
    InputError
        No such kind, or one text in place of the names.
    """

    kind: DatumKind = "control"
    names: tuple[str, ...] = ()
    components: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        """Refuse other kinds, and names that would be read letter by letter."""
        if self.kind not in get_args(DatumKind):
            raise UnknownName("kind of datum", str(self.kind), get_args(DatumKind))
        if isinstance(self.names, str):
            raise InputError(
                f"the names of the datum are the text {self.names!r}",
                cure=f"give a tuple of names, ({self.names!r},)",
            )


@dataclass(frozen=True)
class JointCovariance:
    """One covariance matrix over values of several observations, across kinds.

    It replaces the values' own covariances. If any of the values is switched off, its rows and
    columns are left out.
    """

    table: NDArray[np.int64]  #: (k,), index of each value into ``Network.observations``
    item: NDArray[np.int64]  #: (k,), observation within the table
    row: NDArray[np.int64]  #: (k,), value within the observation
    covariance: Array  #: (k, k), in metres and radians, in the order of the values
    #: (k, k), the part of it that one cause makes common to the values, where that is known apart:
    #: what is left is the covariance of each observation by itself. None if the values are
    #: correlated as they are.
    common: Array | None = None
    category: Category | None = None  #: part of the error budget that ``common`` belongs to

    def part(self, keep: Index) -> JointCovariance:
        """The covariance of some of the values, by their numbers (m,)."""
        square = np.ix_(keep, keep)
        return JointCovariance(
            self.table[keep],
            self.item[keep],
            self.row[keep],
            self.covariance[square],
            None if self.common is None else self.common[square],
            self.category,
        )


@dataclass(frozen=True)
class EstimatedFactors:
    """Variance factors that residuals gave: no sigma of the network is known better than they."""

    groups: tuple[str, ...]  #: the g groups whose covariances were multiplied
    covariance: Array  #: (g, g), covariance of the factors, each divided by its value


@dataclass(frozen=True)
class Constraint:
    """Observations that must hold exactly (method section 2.13): their covariance is not used."""

    observations: Observations
    label: str = ""


@dataclass(frozen=True)
class Edit(Result):
    """A change made by hand in a network that was read."""

    id: str  #: of the observation; the name of a point; scan and place of a target
    #: ``off``, ``check`` or ``active``; ``sigma`` with the new values [m, rad]; ``role`` of a
    #: point; ``name`` of a target, or ``rejected``
    action: str
    reason: str = ""
    by: str = ""
    at: str = ""  #: when it was decided, as it was written; empty if that is not known


@dataclass(frozen=True, repr=False)
class Network:
    """Observations, unknowns and datum: everything the adjustment needs.

    Attributes
    ----------
    start
        Values of all unknowns, NaN where they are to be found from the observations.
    free : array (size,)
        Mask over the columns of the full tangent vector; False for fixed or unused components.
    observations
        One table for each kind and group, with all its observations.
    joint
        Covariances across observations.
    constraints
        Hard constraints.
    datum
        What fixes the frame.
    site
        How verticals run over the site.
    sigma0
        A-priori standard deviation of unit weight (covariances already include it).
    warnings
        Sentences of readers about what was odd.
    title
        Of the file or project, empty if it has none.
    reference
        System of the coordinates.
    facts
        What readers learned besides, for the report.
    edits
        What was changed by hand.
    point_sources
        ``file:line`` of points by name, where it is known.
    factors
        Variance factors that were estimated and are in the covariances; None if there are none.
    """

    start: State
    free: NDArray[np.bool_]
    observations: tuple[Observations, ...]
    joint: tuple[JointCovariance, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    datum: Datum = field(default_factory=Datum)
    site: Site = field(default_factory=FlatSite)
    sigma0: float = 1.0
    warnings: tuple[str, ...] = ()
    title: str = ""
    reference: Reference = Reference()
    facts: tuple[Fact, ...] = ()
    edits: tuple[Edit, ...] = ()
    point_sources: Mapping[str, str] = field(default_factory=dict)
    factors: EstimatedFactors | None = None

    def __repr__(self) -> str:
        layout, tables = self.start.layout, self.observations
        parts = [f"{len(layout.names['point'])} points"]
        if layout.names["pose"]:
            parts.append(f"{len(layout.names['pose'])} stations")
        off = sum(int((o.use != Use.ACTIVE).sum()) for o in tables)
        observed = f"{sum(len(o) for o in tables)} observations"
        parts.append(f"{observed} ({off} of them off or checks)" if off else observed)
        return f"<Network: {', '.join(parts)}; datum {self.datum.kind}>"

    @property
    def edits_sentence(self) -> str:
        """How much was changed by hand, in a sentence that ends with a stop; empty if nothing."""
        n = len(self.edits)
        if not n:
            return ""
        return f"{n} changes were made by hand." if n > 1 else "One change was made by hand."

    @cached_property
    def ids(self) -> tuple[NDArray[np.object_], ...]:
        """Ids ``kind:from:to:file:n`` (n,) of each table (:mod:`tribrach.network.identity`)."""
        return self._all_ids[: len(self.observations)]

    @cached_property
    def _all_ids(self) -> tuple[NDArray[np.object_], ...]:
        hard = tuple(constraint.observations for constraint in self.constraints)
        return observation_ids((*self.observations, *hard), self.start.layout)

    def with_datum(self, datum: Datum) -> Network:
        """Return the same observations in another datum.

        ``free`` and ``fixed`` switch given control off: coordinates that were observed are kept as
        inactive observations with the reason, coordinates that were held become free (or, for
        ``fixed``, stay held at the named points only). A station that is fixed keeps its given
        pose; without one its frame is the work frame.

        Parameters
        ----------
        datum
            What is to fix the frame.

        Returns
        -------
        Network
            A changed copy.

        Raises
        ------
        InputError
            A name that is no point or station, or a fixed point without coordinates.
        """
        if datum.kind == "control":
            return replace(self, datum=datum)
        layout = self.start.layout
        unknown = [n for n in datum.names if not (layout.has("point", n) or layout.has("pose", n))]
        if unknown:
            raise InputError(
                f"the datum names {unknown[0]}, which is no point or station of the network",
                cure="name points that occur in the observations",
            )
        free = self.free.copy()
        points = free[: 3 * layout.count("point")].reshape(-1, 3)
        used = self._used_axes()
        points[:, used], points[:, ~used] = True, False
        start = self.start
        if datum.kind == "fixed":
            poses = [layout.index("pose", n) for n in datum.names if layout.has("pose", n)]
            start = _posed(start, poses)
            free[layout.columns("pose", np.array(poses, dtype=np.int64)).ravel()] = False
            for name in (n for n in datum.names if not layout.has("pose", n)):
                index = layout.index("point", name)
                if np.isnan(self.start.points[index][used]).any():
                    raise InputError(
                        f"the datum fixes {name}, which has no given coordinates",
                        cure="give its coordinates or fix another point",
                    )
                points[index] = False
        off = [_switched_off(o, "the datum does not use it") for o in self.observations]
        return replace(self, datum=datum, free=free, observations=tuple(off), start=start)

    def without(self, selector: str | Iterable[str], *, reason: str, by: str = "") -> Network:
        """The same network with observations switched off.

        They stay in the network and in every report as ``off``, with the reason.

        Parameters
        ----------
        selector : str or iterable of str
            Id of an observation, or the ``file:line`` where one or several were written.
        reason : str
            Why they take no part, in words.
        by : str
            Who says so.

        Returns
        -------
        Network
            A new network; this one stays as it is.

        Raises
        ------
        UnknownName
            No observation has this id or source.
        InputError
            No reason, or all that is named holds exactly and cannot be switched off.

        Examples
        --------
        >>> less = network.without("traverse.gsi:43", reason="prism tilted")  # doctest: +SKIP
        """
        return self.with_use(selector, Use.OFF, reason=reason, by=by)

    def with_use(
        self,
        selector: str | Iterable[str],
        use: Use,
        *,
        reason: str,
        by: str = "",
        at: str = "",
    ) -> Network:
        """The same network with another use of observations.

        Parameters
        ----------
        selector : str or iterable of str
            Id of an observation, or the ``file:line`` where one or several were written.
        use : Use
            Active, check or off.
        reason, by, at : str
            Why, in words, who says so, and when.

        Returns
        -------
        Network
            A new network; this one stays as it is.

        Raises
        ------
        UnknownName
            No observation has this id or source.
        InputError
            No reason, or all that is named holds exactly and cannot be switched off.

        Examples
        --------
        >>> held = network.with_use("gnss.csv:7", Use.CHECK, reason="wall")  # doctest: +SKIP
        """
        _refuse_blank(reason)
        places, edits = [], []
        for name in _selectors(selector):
            for table, item in self._selected(name):
                places.append((table, item))
                edits.append(Edit(str(self.ids[table][item]), use.name.lower(), reason, by, at))
        return _replace_kept(self.switched(places, use, reason), edits=(*self.edits, *edits))

    def switched(self, places: Iterable[tuple[int, int]], use: Use, reason: str = "") -> Network:
        """The same network with another use of observations by their places; no edit is noted.

        Parameters
        ----------
        places : iterable of (int, int)
            Table in ``observations`` and observation within it.
        use : Use
            Active, check or off.
        reason : str
            Kept with the observations.

        Returns
        -------
        Network
            A new network; this one stays as it is.
        """
        by_table: dict[int, list[int]] = {}
        for table, item in places:
            by_table.setdefault(table, []).append(item)
        observations = list(self.observations)
        for table, items in by_table.items():
            o = observations[table]
            uses, reasons = o.use.copy(), o.reason.copy()
            uses[items], reasons[items] = use, reason
            observations[table] = replace(o, use=uses, reason=reasons)
        return _replace_kept(self, observations=tuple(observations))

    def noting(self, edits: Iterable[Edit]) -> Network:
        """The same network with more edits on its list: of what was done before it was built."""
        return _replace_kept(self, edits=(*self.edits, *edits))

    def with_role(
        self, name: str, role: PointRole, *, reason: str, by: str = "", at: str = ""
    ) -> Network:
        """The same network with given coordinates of a point used for something else.

        Coordinates with a sigma take part in the adjustment (``control``), are compared with it
        (``check``) or are off (``free``). Coordinates that were held exactly are released; as check
        coordinates they are compared with a sigma of :data:`CHECK_SIGMA`.

        Parameters
        ----------
        name : str
            A point.
        role : str
            ``control``, ``check`` or ``free``.
        reason, by, at : str
            Why, in words, who says so, and when.

        Returns
        -------
        Network
            A new network; this one stays as it is.

        Raises
        ------
        UnknownName
            No point has this name, or there is no such role.
        InputError
            No reason, or a point that has no coordinates which could be control or check.
        """
        _refuse_blank(reason)
        if role not in get_args(PointRole):
            raise UnknownName("role of a point", str(role), get_args(PointRole))
        layout = self.start.layout
        if not layout.has("point", name):
            raise UnknownName("point", name, layout.names["point"])
        edits = (*self.edits, Edit(name, f"role {role}", reason, by, at))
        given = [
            (table, item)
            for table, o in enumerate(self.observations)
            if is_given(type(o), o.group)
            for item in np.flatnonzero(o.end_names(layout)[0] == name).tolist()
        ]
        index = layout.index("point", name)
        free = self.free.copy()
        mine = free[3 * index : 3 * index + 3]
        held = ~mine & self._used_axes() & np.isfinite(self.start.points[index])
        if not given and not held.any() and role != "free":
            raise InputError(
                f"point {name} has no given coordinates that could be {role}",
                cure="give them with their sigmas in a file of points",
            )
        if role == "control" and not given:
            return _replace_kept(self, edits=edits)
        use = {"control": Use.ACTIVE, "check": Use.CHECK, "free": Use.OFF}[role]
        changed = self.switched(given, use, reason)
        if role == "control" or not held.any():
            return _replace_kept(changed, edits=edits)
        mine[held] = True
        tables = changed.observations
        if role == "check":
            tables = (*tables, self._compared(name, np.flatnonzero(held), reason))
        return replace(changed, observations=tables, free=free, edits=edits)

    def _compared(self, name: str, axes: Index, reason: str) -> Observations:
        """Coordinates of a point along some axes, held until now, as check observations."""
        layout = self.start.layout
        n = len(axes)
        return Coordinate(
            values=self.start.points[layout.index("point", name)][axes][:, None],
            covariance=np.full((n, 1, 1), CHECK_SIGMA**2),
            position=np.full(n, layout.position_index(name)),
            axis=axes,
            source=np.full(n, self.point_sources.get(name, ""), dtype=object),
            use=np.full(n, Use.CHECK, dtype=np.int8),
            reason=np.full(n, reason, dtype=object),
            group="control",
        )

    def _used_axes(self) -> NDArray[np.bool_]:
        """Which of E, N, U (3,) take part: those free somewhere, or neither zero nor unknown."""
        points = self.free[: 3 * self.start.layout.count("point")].reshape(-1, 3)
        used = np.asarray(points.any(axis=0))
        used |= (np.nan_to_num(self.start.points) != 0).any(axis=0)
        tables = [*self.observations, *(c.observations for c in self.constraints)]
        tables = [o for o in tables if not is_given(type(o), o.group)]
        used &= axes_in_use((o.observed_axes(vars(o)) for o in tables), self.site)
        return used

    def with_sigma(
        self,
        selector: str | Iterable[str],
        sigma: ArrayLike,
        *,
        reason: str = "",
        by: str = "",
    ) -> Network:
        """The same network with other standard deviations of observations.

        Correlations stay: within an observation, and with others that share a covariance.

        Parameters
        ----------
        selector : str or iterable of str
            Id of an observation, or the ``file:line`` where one or several were written.
        sigma : float or array_like
            Standard deviation in metres or radians; one for each of its values, or one for all.
        reason, by : str
            Why, and who says so.

        Returns
        -------
        Network
            A new network; this one stays as it is.

        Raises
        ------
        UnknownName
            No observation has this id or source.
        InputError
            A sigma that is not above zero, or not as many as the observation has values.
        """
        wanted = np.atleast_1d(np.asarray(sigma, dtype=float))
        if not ((wanted > 0) & np.isfinite(wanted)).all():
            raise InputError(f"sigma is {wanted.min():g}", cure="give one above zero, or without()")
        edited, edits = list(self.observations), []
        factors = [np.ones(o.values.shape) for o in edited]
        for name in _selectors(selector):
            for table, item in self._selected(name):
                o = edited[table]
                if len(wanted) not in (1, o.rows):
                    raise InputError(
                        f"{self.ids[table][item]} has {o.rows} values and {len(wanted)} sigmas are "
                        "given",
                        cure="give one for each value, or one for all",
                    )
                factors[table][item] = wanted / o.sigma[item]
                text = ", ".join(f"{value:g}" for value in wanted)
                edits.append(Edit(str(self.ids[table][item]), f"sigma {text}", reason, by))
        for table, (o, factor) in enumerate(zip(edited, factors, strict=True)):
            if (factor != 1).any():
                scaled = o.covariance * factor[:, :, None] * factor[:, None, :]
                edited[table] = replace(o, covariance=scaled)
        return replace(
            self,
            observations=tuple(edited),
            joint=tuple(_rescaled(joint, factors) for joint in self.joint),
            edits=(*self.edits, *edits),
        )

    def _selected(self, name: str) -> list[tuple[int, int]]:
        """Table and item of what an id or source names; conditions that hold exactly are refused.

        Raises
        ------
        UnknownName, InputError
            Nothing has this name; what has it are conditions.
        """
        if name not in self._named:
            raise UnknownName("observation", name, self._named)
        hits = self._named[name]
        observed = [(table, item) for table, item in hits if table < len(self.observations)]
        if not observed:
            raise InputError(
                f"{name} holds exactly and has no sigma",
                cure="give it a sigma in the file, or leave it out there",
            )
        return observed

    @cached_property
    def _named(self) -> dict[str, list[tuple[int, int]]]:
        """Table and item of the observations, then the constraints, by their ids and sources."""
        tables = (*self.observations, *(c.observations for c in self.constraints))
        out: dict[str, list[tuple[int, int]]] = {}
        for names in (self._all_ids, [o.source for o in tables]):
            for table, column in enumerate(names):
                for item, name in enumerate(column):
                    if name:
                        out.setdefault(str(name), []).append((table, item))
        return out

    def with_start(self, state: State) -> Network:
        """The same network with other start values."""
        return _replace_kept(self, start=state)

    def count(self) -> int:
        """Number of observed values, whatever their use."""
        return sum(o.values.size for o in self.observations)

    @staticmethod
    def describe(observations: Observations, item: int, state: State) -> str:
        """An observation in words: ``direction S1 -> T3 (net.gkf:17)``."""
        start, end = (names[item] for names in observations.end_names(state.layout))
        source = observations.source[item]
        arrow = f" {start} -> {end}" if end else f" {start}"
        return f"{observations.facts.title}{arrow}" + (f" ({source})" if source else "")


def _posed(state: State, poses: list[int]) -> State:
    """The state with stations that have no pose at the origin, along the axes."""
    t, r = state.pose_t.copy(), state.pose_r.copy()
    for k in poses:
        if np.isnan(t[k]).any() or np.isnan(r[k]).any():
            t[k], r[k] = 0.0, np.eye(3)
    return replace(state, pose_t=t, pose_r=r)


def _switched_off(observations: Observations, reason: str) -> Observations:
    """Control coordinates switched off with a reason; other kinds unchanged."""
    if observations.group != "control":
        return observations
    use = np.full(len(observations), Use.OFF, dtype=np.int8)
    return replace(observations, use=use, reason=np.full(len(observations), reason, dtype=object))


def _replace_kept(network: Network, **changed: Any) -> Network:
    """A network with other uses or edits: ids and names of observations are not computed again."""
    out = replace(network, **changed)
    for name in ("_all_ids", "_named"):
        if name in vars(network):
            vars(out)[name] = vars(network)[name]
    return out


def _refuse_blank(reason: str) -> None:
    """Refuse an edit without a reason."""
    if not reason.strip():
        raise InputError("no reason is given", cure="say why the network is changed")


def _selectors(selector: str | Iterable[str]) -> list[str]:
    """One or several selectors as a list."""
    return [selector] if isinstance(selector, str) else list(selector)


def _rescaled(joint: JointCovariance, factors: list[Array]) -> JointCovariance:
    """A joint covariance with its values' sigmas multiplied by factors (n, rows) by table."""
    values = zip(joint.table, joint.item, joint.row, strict=True)
    factor = np.array([factors[table][item, row] for table, item, row in values])
    if (factor == 1).all():
        return joint
    scale = factor[:, None] * factor
    common = None if joint.common is None else joint.common * scale
    return replace(joint, covariance=joint.covariance * scale, common=common)
