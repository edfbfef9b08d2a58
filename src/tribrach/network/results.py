"""What a surveyor asks of an adjusted network: points, stations and observations by name.

Coordinates are those of the work frame (E, N, U) in metres, angles radians. Every figure that
depends on it says whether its covariance is a priori or a posteriori; the datum is that of the
whole network, :attr:`Results.datum`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar, get_args

import numpy as np

from tribrach._types import Array
from tribrach.answers import Estimate
from tribrach.errors import InputError, UnknownName
from tribrach.network.ellipsoids import (
    ConfidenceEllipse,
    ConfidenceEllipsoid,
    confidence_factor,
    plan_ellipses,
    principal_axes,
)
from tribrach.network.observation_rows import ObservationRows, html_table, observation_rows
from tribrach.network.quality import Quality, assess, global_test
from tribrach.network.roles import Role, datum_sentence, point_roles, scalar_roles, used_axes
from tribrach.network.solved import Scale, SolvedSystem
from tribrach.sentences import capital

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TableName = Literal["observations", "points", "stations"]
FrameLibrary = Literal["polars", "pandas"]
#: libraries of frames, the one that is taken first before the other
_LIBRARIES = get_args(FrameLibrary)
PlotName = Literal["plan", "residuals"]

#: observations and points that a summary lists
_WORST, _LISTED = 5, 40

Result = TypeVar("Result")


class Names(Mapping[str, Result], Generic[Result]):
    """Results by name in the network's order; :class:`~tribrach.errors.UnknownName` of others."""

    def __init__(
        self, noun: str, names: Sequence[str], result: Callable[[int], Result], context: str
    ) -> None:
        self._noun, self._result, self._context = noun, result, context
        self._index = {name: k for k, name in enumerate(names)}

    def __getitem__(self, name: str) -> Result:
        if name not in self._index:
            raise UnknownName(self._noun, name, self._index)
        return self._result(self._index[name])

    def __contains__(self, name: object) -> bool:
        return name in self._index

    def __iter__(self) -> Iterator[str]:
        return iter(self._index)

    def __len__(self) -> int:
        return len(self._index)

    def __reduce__(self) -> tuple[Any, ...]:
        # a copy holds the results themselves, not the function that makes them
        results = tuple(self.values())
        return Names, (self._noun, tuple(self._index), results.__getitem__, self._context)

    def __repr__(self) -> str:
        names = list(self._index)
        more = f" and {len(names) - 8} more" if len(names) > 8 else ""
        plural = "" if len(names) == 1 else "s"
        return f"<{len(names)} {self._noun}{plural}: {', '.join(names[:8])}{more}; {self._context}>"


@dataclass(frozen=True, repr=False)
class PlaceDifference:
    """The place of one point or station less that of another."""

    #: names of both
    a: str
    b: str
    xyz: Array  #: b less a in E, N, U (3,) [m]; NaN for coordinates that the network does not have
    covariance: Array  #: (3, 3) [m^2], with what both share
    scale: Scale  #: whether the covariance is a priori or a posteriori

    @property
    def sigma(self) -> Array:
        """Standard deviations along E, N, U (3,) [m]; NaN where xyz is."""
        return np.where(np.isnan(self.xyz), np.nan, np.sqrt(np.diagonal(self.covariance)))

    def along(self, gradient: Array, value: float) -> Estimate:
        """A value that depends on the difference by a gradient (3,), with its sigma."""
        return Estimate(
            value, float(np.sqrt(max(float(gradient @ self.covariance @ gradient), 0.0)))
        )

    def __repr__(self) -> str:
        return (
            f"<{self.a} to {self.b}: {_triple(self.xyz, 4)} m, "
            f"sigma {_triple(1000 * self.sigma, 2)} mm {self.scale}>"
        )


@dataclass(frozen=True, repr=False)
class PointResult:
    """An adjusted point."""

    name: str  #: of the point
    xyz: Array  #: E, N, U (3,) [m]; NaN for coordinates that the network does not have
    covariance: Array  #: (3, 3) [m^2]; zero for coordinates that are held
    role: Role  #: ``control``, ``check`` or ``free``
    scale: Scale  #: whether the covariance is a priori or a posteriori
    confidence: float = 0.95  #: probability of ellipses
    #: degrees of freedom (3,) of the variances along E, N, U; infinite where sigmas are given
    freedom: Array = field(default_factory=lambda: np.full(3, np.inf))

    @property
    def sigma(self) -> Array:
        """Standard deviations of E, N, U (3,) [m]; zero where held, NaN where xyz is."""
        return np.where(np.isnan(self.xyz), np.nan, np.sqrt(np.diagonal(self.covariance)))

    @property
    def ellipse(self) -> ConfidenceEllipse:
        """Confidence ellipse in plan."""
        factor = confidence_factor(2, self.confidence, self.freedom[0])
        plan = plan_ellipses(self.covariance[None], factor)
        return ConfidenceEllipse(
            float(plan.major[0]), float(plan.minor[0]), float(plan.azimuth[0]), self.confidence
        )

    @property
    def ellipsoid(self) -> ConfidenceEllipsoid:
        """Confidence ellipsoid."""
        factor = confidence_factor(3, self.confidence, self.freedom.min())
        axes, directions = principal_axes(self.covariance[None], factor)
        return ConfidenceEllipsoid(axes[0], directions[0], self.confidence)

    def __repr__(self) -> str:
        return (
            f"<point {self.name}, {self.role}: {_triple(self.xyz, 4)} m, "
            f"sigma {_triple(1000 * self.sigma, 2)} mm {self.scale}>"
        )


@dataclass(frozen=True, repr=False)
class StationResult:
    """An adjusted scanner station."""

    name: str  #: of the station
    world_from_scanner: Array  #: (4, 4): ``x_world = world_from_scanner @ (x, y, z, 1)``, metres
    #: (6, 6) of the translation [m], then of the left rotation increments about E, N, U [rad]
    covariance: Array
    scale: Scale  #: whether the covariance is a priori or a posteriori

    @property
    def sigma(self) -> Array:
        """Standard deviations (6,) [m, rad] in the order of the covariance."""
        return np.sqrt(np.diagonal(self.covariance))

    @property
    def xyz(self) -> Array:
        """E, N, U (3,) [m] of the scanner's origin."""
        return self.world_from_scanner[:3, 3]

    @property
    def rotation(self) -> Array:
        """(3, 3) world from scanner."""
        return self.world_from_scanner[:3, :3]

    def __repr__(self) -> str:
        mgon = np.degrees(self.sigma[3:]) / 0.9 * 1000
        return (
            f"<station {self.name}: {_triple(self.xyz, 4)} m, "
            f"sigma {_triple(1000 * self.sigma[:3], 2)} mm, {_triple(mgon, 2)} mgon {self.scale}>"
        )


@dataclass(frozen=True, repr=False)
class ScalarResult:
    """A single adjusted unknown: an orientation, a scale, a calibration parameter."""

    name: str  #: of the unknown
    #: in its own unit; an orientation is in [0, 2 pi)
    value: float
    sigma: float
    #: ``m``, ``rad`` or ``1``; what it is, such as ``orientation``
    unit: str
    role: str
    scale: Scale  #: whether sigma is a priori or a posteriori

    def __repr__(self) -> str:
        return f"<{self.name}: {self.value:.9g} {self.unit}, sigma {self.sigma:.3g} {self.scale}>"


@dataclass(frozen=True, repr=False)
class Results:
    """Results of an adjusted network by name, in one scaling and at one confidence."""

    adjustment: SolvedSystem = field(repr=False)  #: the adjusted network
    #: scale covariances of unknowns by ``v^T P v / r``; without redundancy, or with residuals that
    #: are all zero, they stay a priori
    posterior: bool = False
    confidence: float = 0.95  #: probability that ellipses and ellipsoids hold

    def __post_init__(self) -> None:
        """Refuse a confidence that is not a probability."""
        if not 0 < self.confidence < 1:
            raise InputError(
                f"the confidence is {self.confidence:g}, which is not between 0 and 1",
                cure="give a probability such as 0.95",
            )

    def __getstate__(self) -> dict[str, Any]:
        """The fields; what was computed from them is computed again from a copy."""
        return {item.name: getattr(self, item.name) for item in fields(self)}

    @property
    def scale(self) -> Scale:
        """Whether covariances of unknowns are a priori or a posteriori."""
        return self.adjustment.scale(posterior=self.posterior)

    @cached_property
    def _freedom(self) -> Array:
        """Degrees of freedom (P + S, 3) that confidence regions are taken with."""
        return self.adjustment.freedom(posterior=self.posterior)

    @cached_property
    def datum(self) -> str:
        """The datum in a sentence."""
        return datum_sentence(self.adjustment)

    @cached_property
    def quality(self) -> Quality:
        """Tests, redundancies and minimal detectable biases."""
        return assess(self.adjustment, posterior=self.posterior, confidence=self.confidence)

    @cached_property
    def observations(self) -> ObservationRows:
        """Every observed value with its residual and tests."""
        return observation_rows(self.adjustment, self.quality)

    @cached_property
    def points(self) -> Names[PointResult]:
        """Points by name."""
        covariances, roles = self._covariances("point"), point_roles(self.adjustment)
        names = self.adjustment.layout.names["point"]
        xyz = np.where(used_axes(self.adjustment), self.adjustment.state.points, np.nan)
        freedom, scale, confidence = self._freedom, self.scale, self.confidence

        def point(k: int) -> PointResult:
            name = names[k]
            role = roles.get(name, "free")
            return PointResult(name, xyz[k], covariances[k], role, scale, confidence, freedom[k])

        return Names("point", names, point, self._context)

    @cached_property
    def stations(self) -> Names[StationResult]:
        """Scanner stations by name."""
        covariances, state = self._covariances("pose"), self.adjustment.state
        names = self.adjustment.layout.names["pose"]
        matrices = np.tile(np.eye(4), (len(names), 1, 1))
        matrices[:, :3, :3], matrices[:, :3, 3] = state.pose_r, state.pose_t

        def station(k: int) -> StationResult:
            return StationResult(names[k], matrices[k], covariances[k], self.scale)

        return Names("station", names, station, self._context)

    @cached_property
    def scalars(self) -> Names[ScalarResult]:
        """Single unknowns by name."""
        names, values = self.adjustment.layout.names["scalar"], self.adjustment.state.scalars
        sigma = np.sqrt(np.maximum(self._covariances("scalar")[:, 0, 0], 0.0))
        roles = scalar_roles(self.adjustment)

        def scalar(k: int) -> ScalarResult:
            unit, role, _ = roles.get(k, ("1", "parameter", ""))
            value = float(values[k])
            if role == "orientation":
                value = value % (2 * np.pi) % (2 * np.pi)  # the second brings 2 pi itself to 0
            return ScalarResult(names[k], value, float(sigma[k]), unit, role, self.scale)

        return Names("scalar", names, scalar, self._context)

    def difference(self, a: str, b: str) -> PlaceDifference:
        """Place of one point or station less that of another, with its covariance."""
        solved, columns, xyz = self.adjustment, [], []
        for name in (a, b):
            if name in self.points:
                xyz.append(self.points[name].xyz)
            elif name in self.stations:
                xyz.append(self.stations[name].xyz)
            else:
                raise UnknownName("point or station", name, [*self.points, *self.stations])
            columns.append(solved.columns(name)[:3])
        whole = solved.covariance_columns(*[np.concatenate(columns)] * 2)
        turn = np.hstack([-np.eye(3), np.eye(3)])
        factor = solved.variance_factor(posterior=self.posterior)
        return PlaceDifference(a, b, xyz[1] - xyz[0], factor * turn @ whole @ turn.T, self.scale)

    def distance(self, a: str, b: str, *, horizontal: bool = False) -> Estimate:
        """Distance of two points or stations [m], in plan if ``horizontal``, with its sigma."""
        between = self.difference(a, b)
        step = np.where([True, True, not horizontal], np.nan_to_num(between.xyz), 0.0)
        length = float(np.linalg.norm(step))
        if length == 0.0:
            raise InputError(f"{a} and {b} are one place", cure="name two that are apart")
        return between.along(step / length, length)

    def direction(self, a: str, b: str) -> Estimate:
        """Azimuth from one point or station to another [rad], from N clockwise, with its sigma."""
        between = self.difference(a, b)
        east, north = np.nan_to_num(between.xyz[:2])
        square = float(east**2 + north**2)
        if square == 0.0:
            raise InputError(f"{a} and {b} are one place in plan", cure="name two that are apart")
        gradient = np.array([north, -east, 0.0]) / square
        return between.along(gradient, float(np.arctan2(east, north) % (2 * np.pi)))

    @property
    def _context(self) -> str:
        datum = self.adjustment.network.datum.kind
        return f"datum {datum}, sigmas {self.scale}"

    def _covariances(self, family: str) -> Array:
        """Scaled blocks (n, w, w) of a family."""
        factor = self.adjustment.variance_factor(posterior=self.posterior)
        return self.adjustment.family_covariances(family) * factor

    def to_frame(
        self, table: TableName = "observations", library: FrameLibrary | None = None
    ) -> Any:
        """A table of results."""
        tables: dict[str, Callable[[], dict[str, Any]]] = {
            "observations": self.observations.columns,
            "points": self._point_columns,
            "stations": self._station_columns,
        }
        if table not in tables:
            raise UnknownName("table", table, tables)
        chosen: str = library or next((name for name in _LIBRARIES if find_spec(name)), "polars")
        if chosen not in _LIBRARIES:
            raise UnknownName("library", chosen, _LIBRARIES)
        columns = {name: _plain(column) for name, column in tables[table]().items()}
        try:
            return import_module(chosen).DataFrame(columns)
        except ModuleNotFoundError as error:
            raise InputError(
                f"{chosen} is not installed, which makes the table",
                cure=f"pip install {chosen}; polars or pandas will do",
            ) from error

    def _point_columns(self) -> dict[str, Any]:
        """Columns of the table of points; one for each element of the covariance."""
        points = list(self.points.values())
        columns: dict[str, Any] = {
            "name": [p.name for p in points],
            "role": [p.role for p in points],
        }
        axes = "enu"
        for k, axis in enumerate(axes):
            columns[axis] = np.array([p.xyz[k] for p in points])
        for k, axis in enumerate(axes):
            columns[f"sigma_{axis}"] = np.array([p.sigma[k] for p in points])
        for i in range(3):
            for j in range(i, 3):
                name = f"c_{axes[i]}{axes[j]}"
                columns[name] = np.array([p.covariance[i, j] for p in points])
        return columns | {"scale": [p.scale for p in points]}

    def _station_columns(self) -> dict[str, Any]:
        """Columns of the table of stations: place, rotation row by row, sigmas."""
        stations = list(self.stations.values())
        columns: dict[str, Any] = {"name": [s.name for s in stations]}
        for k, axis in enumerate("enu"):
            columns[axis] = np.array([s.xyz[k] for s in stations])
        for i in range(3):
            for j in range(3):
                columns[f"r_{i + 1}{j + 1}"] = np.array([s.rotation[i, j] for s in stations])
        names = ("e", "n", "u", "rotation_e", "rotation_n", "rotation_u")
        for k, name in enumerate(names):
            columns[f"sigma_{name}"] = np.array([s.sigma[k] for s in stations])
        return columns | {"scale": [s.scale for s in stations]}

    def summary(self) -> str:
        """Datum, sigma0, global test, worst observations, points and stations, as text."""
        solved, test = self.adjustment, self.quality.global_test.sentence()
        lines = [
            solved.network.title or "Adjusted network",
            f"{solved.n_observations} observed values, {solved.n_unknowns} unknowns, "
            f"{solved.n_constraints} constraints, datum defect {solved.defect}, "
            f"redundancy {solved.dof}, {solved.iterations} iterations",
            self.datum,
            f"sigma0 a priori {solved.sigma0:g}, a posteriori {solved.sigma0_posterior:.4f}"
            if solved.dof > 0
            else f"sigma0 a priori {solved.sigma0:g}",
            f"{capital(test)}. {solved.network.edits_sentence}".rstrip(),
        ]
        rows = self.observations.worst(_WORST)
        if len(rows):
            test = "tau" if self.quality.posterior else "w"
            lines += ["", f"Worst observations (limit of {test}: {self.quality.critical:.2f})"]
            lines += [f"  {row}" + f", tau {row.tau:.2f}" * self.quality.posterior for row in rows]
        if len(self.points):
            lines += ["", f"Points: E, N, U [m], sigmas [mm] {self.scale}"]
            lines += _table(
                [(p.name, p.xyz, 1000 * p.sigma, p.role) for p in self._some(self.points)]
            )
        if len(self.stations):
            lines += ["", f"Stations: E, N, U [m], sigmas [mm] {self.scale}"]
            lines += _table(
                [(s.name, s.xyz, 1000 * s.sigma[:3], "") for s in self._some(self.stations)]
            )
        lines += ["", *solved.warnings] if solved.warnings else []
        return "\n".join(lines)

    @staticmethod
    def _some(names: Names[Result]) -> list[Result]:
        """The first results, as many as a summary lists."""
        return [names[name] for name, _ in zip(names, range(_LISTED), strict=False)]

    def plot(self, what: PlotName = "plan", axes: Axes | None = None) -> Axes:
        """Draw the network with matplotlib, which the extra ``tribrach[plot]`` brings."""
        plots: dict[str, Callable[[Axes], None]] = {
            "plan": self._plot_plan,
            "residuals": self._plot_residuals,
        }
        if what not in plots:
            raise UnknownName("plot", what, plots)
        if find_spec("matplotlib") is None:
            raise InputError(
                "plots need matplotlib, which is not installed", cure="install tribrach[plot]"
            )
        if axes is None:
            axes = import_module("matplotlib.pyplot").subplots()[1]
            assert axes is not None
        plots[what](axes)
        return axes

    def _plot_plan(self, axes: Axes) -> None:
        """Points, stations, lines of sight and ellipses, which are enlarged to be seen."""
        patches = import_module("matplotlib.patches")
        collections = import_module("matplotlib.collections")
        positions = self.adjustment.state.positions[:, :2]
        axes.add_collection(
            collections.LineCollection(self._sights(), colors="0.8", linewidths=0.6, zorder=1)
        )
        counts = len(self.points)
        axes.plot(*positions[:counts].T, "o", color="black", markersize=3, zorder=3)
        axes.plot(*positions[counts:].T, "^", color="tab:blue", markersize=6, zorder=3)
        for name, place in zip((*self.points, *self.stations), positions, strict=True):
            axes.annotate(name, place, xytext=(3, 3), textcoords="offset points", fontsize=7)
        covariances = np.concatenate(
            [self._covariances("point"), self._covariances("pose")[:, :3, :3]]
        )
        factor = confidence_factor(2, self.confidence, self._freedom[:, 0])
        ellipses = plan_ellipses(covariances, factor)
        size = float(np.ptp(positions, axis=0).max()) if len(positions) else 1.0
        largest = float(ellipses.major.max(initial=0.0))
        enlarged = _round_factor(0.06 * size / largest) if largest > 0 else 1.0
        for place, major, minor, azimuth in zip(
            positions, ellipses.major, ellipses.minor, ellipses.azimuth, strict=True
        ):
            axes.add_patch(
                patches.Ellipse(
                    place,
                    2 * enlarged * major,
                    2 * enlarged * minor,
                    angle=90 - np.degrees(azimuth),
                    fill=False,
                    edgecolor="tab:red",
                    zorder=2,
                )
            )
        axes.autoscale_view()
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_xlabel("E [m]")
        axes.set_ylabel("N [m]")
        axes.set_title(
            f"Ellipses of {100 * self.confidence:g} %, {self.scale}, enlarged {enlarged:g} times\n"
            f"{self.datum}",
            fontsize=8,
            wrap=True,
        )

    def _sights(self) -> list[Array]:
        """Ends (2, 2) of the lines between positions that active observations join."""
        layout, rows = self.adjustment.layout, self.observations
        names = {*layout.names["point"], *layout.names["pose"]}
        active = rows.column("state") == "active"
        pairs = set(zip(rows.column("start")[active], rows.column("end")[active], strict=True))
        places = self.adjustment.state.positions[:, :2]
        return [
            places[[layout.position_index(a), layout.position_index(b)]]
            for a, b in sorted(pairs)
            if a in names and b in names
        ]

    def _plot_residuals(self, axes: Axes) -> None:
        """Test values by kind, with the limit: w a priori, tau a posteriori."""
        rows, limit = self.observations, self.quality.critical
        test = "tau" if self.quality.posterior else "w"
        kinds = list(dict.fromkeys(rows.column("kind")))
        number = np.array([kinds.index(kind) for kind in rows.column("kind")], dtype=float)
        w, suspicious = rows.column(test), rows.column("suspicious")
        # side by side in the order of the network, so that no dot hides another
        for k in range(len(kinds)):
            of_kind = np.flatnonzero(number == k)
            number[of_kind] += np.linspace(-0.3, 0.3, len(of_kind)) if len(of_kind) > 1 else 0.0
        axes.plot(number[~suspicious], w[~suspicious], ".", color="black")
        axes.plot(number[suspicious], w[suspicious], "x", color="tab:red")
        for bound in (-limit, limit):
            axes.axhline(bound, color="tab:red", linewidth=0.8, linestyle="--")
        axes.set_xticks(range(len(kinds)), [str(kind).replace("_", " ") for kind in kinds])
        axes.set_ylabel(f"{test}, {self.scale}")
        axes.set_title(f"Test values, limit {limit:.2f}", fontsize=8)

    def __repr__(self) -> str:
        solved = self.adjustment
        parts = [f"{len(solved.layout.names['point'])} points"]
        if solved.layout.names["pose"]:
            parts.append(f"{len(solved.layout.names['pose'])} stations")
        passed = global_test(solved).passed
        verdict = {None: "nothing checked", True: "global test passed", False: "global test failed"}
        return (
            f"<Adjustment: {', '.join(parts)}, {solved.n_observations} observed values, "
            f"redundancy {solved.dof}, {verdict[passed]}>"
        )

    def _repr_html_(self) -> str:
        """Summary and points for notebooks."""
        test = self.quality.global_test.sentence()
        caption = (
            f"{repr(self)[1:-1]}; {test}. {self.datum} Sigmas {self.scale}, "
            f"sigma0 {self.adjustment.sigma0:g} a priori, "
            f"{_number(self.adjustment.sigma0_posterior, 3)} a posteriori."
        )
        rows = [
            [
                p.name,
                p.role,
                *(_number(x, 4) for x in p.xyz),
                *(_number(1000 * s, 2) for s in p.sigma),
            ]
            for p in self._some(self.points)
        ]
        head = ["point", "role", "E [m]", "N [m]", "U [m]", "σE [mm]", "σN [mm]", "σU [mm]"]
        return html_table(head, rows, caption)


def _plain(column: Any) -> list[Any]:
    """A column as a list, None for numbers that do not exist."""
    if isinstance(column, np.ndarray) and column.dtype.kind == "f":
        return [value if np.isfinite(value) else None for value in column.tolist()]
    return list(column.tolist() if isinstance(column, np.ndarray) else column)


def _number(value: float, digits: int) -> str:
    """A number with its digits, ``-`` if it does not exist."""
    return "-" if np.isnan(value) else f"{value:.{digits}f}"


def _triple(values: Array, digits: int) -> str:
    return " ".join(_number(value, digits) for value in values)


def _table(rows: Sequence[tuple[str, Array, Array, str]]) -> list[str]:
    """Lines of names with coordinates and sigmas in columns."""
    width = max(len(name) for name, *_ in rows)
    return [
        f"  {name:{width}}"
        + "".join(f"{_number(value, 4):>14}" for value in xyz)
        + "".join(f"{_number(value, 2):>9}" for value in sigma)
        + (f"  {role}" if role else "")
        for name, xyz, sigma, role in rows
    ]


def _round_factor(factor: float) -> float:
    """A factor rounded down to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(factor))
    return float(power * max(k for k in (1, 2, 5) if k * power <= factor * (1 + 1e-12)))
