"""Which tables the report has, chapter by chapter, with their notes in words."""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter

from tribrach.report.columns import AXES, ColumnSet, Spec
from tribrach.report.content import Content, Control, KindCount, Point, Unknown
from tribrach.report.instruments import instrument_table
from tribrach.report.observation_table import kind_name, observation_table
from tribrach.report.scan_tables import scan_tables
from tribrach.report.style import Style
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    build_table,
    number_cell,
    text_cell,
)
from tribrach.units import format_angle

__all__ = ["Chapters"]


class Chapters:
    """Tables of one content in one style; empty chapters have no rows.

    most : rows per table, all of them if None.
    """

    def __init__(self, content: Content, most: int | None = None) -> None:
        self.content, self.most = content, most
        self.style = Style(content.settings.angle)
        self.columns = ColumnSet(self.style)
        self.percent = f"{100 * content.settings.confidence:g} %"
        posterior = content.settings.posterior and content.summary.dof > 0
        self.origin = "a posteriori" if posterior else "a priori"

    def all(self) -> list[ReportTable]:
        """Every table that has rows, in the order of the report."""
        tables = [
            *self.scans(),
            *self.comparisons(),
            *self.reductions(),
            *(t.first(self.most) for chapter in self.content.chapters for t in chapter.tables),
            self.kinds(),
            self.components(),
            self.snooping(),
            self.control(),
            self.observations(),
            self.stations(),
            self.points(),
            self.ellipsoids(),
            self.geodetic(),
            self.unknowns(),
            self.correlations(),
            instrument_table(self.content.instruments),
        ]
        return [table for table in tables if table.rows]

    def scans(self) -> list[ReportTable]:
        """Targets, clouds and classes, where there are scans."""
        chapter = self.content.scans
        return [] if chapter is None else scan_tables(chapter, self.columns, self.most)

    def comparisons(self) -> list[ReportTable]:
        """Sites, predictions and regressions, where stations were compared."""
        angle = self.content.settings.angle
        return [table for one in self.content.comparisons for table in one.tables(angle)]

    def reductions(self) -> list[ReportTable]:
        """Axis errors and rounds, where there are raw files of total stations."""
        chapter = self.content.reductions
        return [] if chapter is None else chapter.tables(self.columns, self.most)

    def observations(self) -> ReportTable:
        """Every observed value, worst first."""
        return observation_table(self.content, self.columns, self.most)

    def kinds(self) -> ReportTable:
        """What was observed, how often, and whether each group deserves its sigmas."""
        note = (
            "Counts are observed values. The ratio of sigma0 a posteriori to a priori is that of "
            "the group alone: 1 says its sigmas are right, 2 that they are half of what they "
            "should be."
        )
        columns: list[Spec] = [
            (ColumnHead("Kind", numeric=False), lambda k: text_cell(kind_name(k.kind))),
            (ColumnHead("Group", numeric=False), lambda k: text_cell(_group(k))),
            *(self.columns.plain(head, head, 0) for head in ("active", "check", "off")),
            self.columns.plain("redundancy", "redundancy"),
            self.columns.plain("ratio of sigma0", "sigma0", 3),
        ]
        return build_table(
            "kinds",
            "Observations by kind",
            note,
            self.content.summary.kinds,
            columns,
            most=self.most,
        )

    def control(self) -> ReportTable:
        """Control and check points against the network."""
        limit = 100 * (1 - self.content.settings.alpha)
        note = (
            "Difference: adjusted minus given; its sigma is what the difference should have "
            "if given coordinates and network are right. The test is the squared difference in "
            f"that metric against chi-square at {limit:g} %. Check points take no part."
        )
        columns: list[Spec] = [
            self.columns.word("Point", "name"),
            self.columns.word("Use", "use"),
            *self.columns.axes("given ", "given", self.columns.metres),
            *self.columns.axes("σ given ", "sigma", self.columns.mm, wide=True),
            *self.columns.axes("Δ", "difference", self.columns.mm),
            *self.columns.axes("σ Δ", "difference_sigma", self.columns.mm, wide=True),
            (ColumnHead("test"), _test),
            (ColumnHead("limit"), _limit),
            (ColumnHead("verdict", numeric=False), _verdict),
            self.columns.source(),
        ]
        rows = sorted(
            self.content.control, key=lambda c: ("check", "weighted", "held", "off").index(c.use)
        )
        return build_table(
            "control",
            "Control and check points",
            note,
            rows,
            columns,
            _control_state,
            most=self.most,
        )

    def points(self) -> ReportTable:
        """Adjusted points with sigmas and ellipses."""
        note = (
            f"Sigmas are {self.origin}. Ellipse in plan and height interval hold with "
            f"{self.percent} each; the azimuth is that of the major axis."
        )
        columns: list[Spec] = [
            self.columns.word("Point", "name"),
            self.columns.word("Role", "role"),
            *self.columns.axes("", "xyz", self.columns.metres),
            *self.columns.axes("σ ", "sigma", self.columns.mm),
            *self.columns.ellipse(),
        ]
        return build_table(
            "points", "Adjusted points", note, self.content.points, columns, most=self.most
        )

    def ellipsoids(self) -> ReportTable:
        """Covariance matrices of the points and their ellipsoids."""
        note = (
            f"Covariances are {self.origin}. The ellipsoid holds with {self.percent}; azimuth "
            "and elevation are those of its longest axis."
        )
        pairs = [(i, j) for i in range(3) for j in range(i, 3)]
        columns: list[Spec] = [
            self.columns.word("Point", "name"),
            *(self._square(f"{AXES[i]}{AXES[j]}", i, j) for i, j in pairs),
            *(self.columns.mm(f"axis {k + 1}", _semi_axis(k)) for k in range(3)),
            self.columns.bearing("azimuth", lambda p: p.ellipsoid and p.ellipsoid.azimuth),
            self.columns.bearing("elevation", lambda p: p.ellipsoid and p.ellipsoid.elevation),
        ]
        rows = [p for p in self.content.points if any(p.sigma)]
        return build_table(
            "ellipsoids", "Covariances and ellipsoids", note, rows, columns, most=self.most
        )

    def _square(self, head: str, i: int, j: int) -> Spec:
        def cell(point: Point) -> Cell:
            value = point.covariance[i][j]
            held = point.sigma[i] is None or point.sigma[j] is None
            shown = None if value is None or held else value * 1e6
            return number_cell(shown, self.style.plain(shown, 3))

        return ColumnHead(head, "mm²"), cell

    def geodetic(self) -> ReportTable:
        """Latitude, longitude and height, geocentric and projected coordinates of known sites."""
        columns: list[Spec] = [
            self.columns.word("Point", "name"),
            (ColumnHead("latitude", "° ′ ″"), lambda p: _dms(p.geodetic[0])),
            (ColumnHead("longitude", "° ′ ″"), lambda p: _dms(p.geodetic[1])),
            self.columns.metres("ellipsoidal height", lambda p: p.geodetic[2]),
            *(self.columns.metres(name, _part("ecef", k)) for k, name in enumerate("XYZ")),
            *(
                self.columns.metres(name, _part("projected", k))
                for k, name in enumerate(("easting", "northing", "height"))
            ),
        ]
        note = (
            "X, Y, Z are geocentric; easting, northing and height are those of the site's grid. "
            "All are at the epoch of the reference system, where it has one."
        )
        rows = [p for p in self.content.points if p.geodetic]
        return build_table("geodetic", "Geodetic coordinates", note, rows, columns, most=self.most)

    def stations(self) -> ReportTable:
        """Scanner stations with attitude."""
        note = (
            f"Sigmas are {self.origin}. Heading is the azimuth of the scanner's x axis; the tilts "
            "turn its z axis about E and N; tilt is its angle with the vertical."
        )
        columns: list[Spec] = [
            self.columns.word("Station", "name"),
            *self.columns.axes("", "xyz", self.columns.metres),
            *self.columns.axes("σ ", "sigma", self.columns.mm),
            self.columns.angle("heading", attrgetter("heading"), "heading"),
            self.columns.small_angle("σ heading", attrgetter("heading_sigma")),
            self.columns.angle("tilt about E", attrgetter("tilt_e"), wide=True),
            self.columns.small_angle("σ", attrgetter("tilt_e_sigma"), wide=True),
            self.columns.angle("tilt about N", attrgetter("tilt_n"), wide=True),
            self.columns.small_angle("σ", attrgetter("tilt_n_sigma"), wide=True),
            self.columns.angle("tilt", attrgetter("tilt")),
            self.columns.small_angle("σ", attrgetter("tilt_sigma")),
            *self.columns.ellipse(wide=True),
        ]
        return build_table(
            "stations", "Stations", note, self.content.stations, columns, most=self.most
        )

    def unknowns(self) -> ReportTable:
        """Orientations, calibration parameters, lever arms and planes."""
        note = (
            f"Sigmas are {self.origin}. Sigmas of a plane are those of two turns of its normal "
            "and of its offset."
        )
        columns: list[Spec] = [
            self.columns.word("Name", "name"),
            self.columns.word("What", "role"),
            self.columns.word("At", "at"),
            (ColumnHead("value", numeric=False), self._values),
            (ColumnHead("σ", numeric=False), self._sigmas),
        ]
        return build_table(
            "unknowns", "Other unknowns", note, self.content.unknowns, columns, most=self.most
        )

    def _values(self, unknown: Unknown) -> Cell:
        parts = [
            f"{self.style.value(v, unit, unknown.role)} {self.style.value_unit(unit)}".strip()
            for v, unit in zip(unknown.values, unknown.units, strict=True)
        ]
        return Cell("; ".join(parts), unknown.values[0])

    def _sigmas(self, unknown: Unknown) -> Cell:
        units = ("rad", "rad", "m") if unknown.family == "plane" else unknown.units
        parts = [
            "held" if s is None else f"{self.style.small(s, unit)} {self.style.small_unit(unit)}"
            for s, unit in zip(unknown.sigma, units, strict=True)
        ]
        return Cell("; ".join(parts), unknown.sigma[0])

    def components(self) -> ReportTable:
        """Variance components."""
        columns: list[Spec] = [
            self.columns.word("Group", "group"),
            self.columns.plain("factor on sigma", "factor", 3),
            self.columns.plain("σ of the factor", "sigma", 3),
            self.columns.plain("redundancy", "redundancy"),
            self.columns.word("Note", "note"),
        ]
        note = "Factors by which the given sigmas were multiplied before this adjustment."
        return build_table(
            "components",
            "Variance components",
            note,
            self.content.components,
            columns,
            most=self.most,
        )

    def snooping(self) -> ReportTable:
        """What iterative snooping did."""
        columns: list[Spec] = [
            self.columns.plain("Step", "number", 0),
            self.columns.word("Observation", "observation"),
            self.columns.plain("test", "test"),
            self.columns.plain("limit", "limit"),
            (
                ColumnHead("estimated error"),
                lambda s: number_cell(
                    s.error,
                    f"{self.style.small(s.error, s.unit)} {self.style.small_unit(s.unit)}",
                ),
            ),
            self.columns.word("Action", "action"),
        ]
        note = "One suspect at a time; what was switched off stays in the list of observations."
        return build_table(
            "snooping", "Snooping", note, self.content.snooping, columns, most=self.most
        )

    def correlations(self) -> ReportTable:
        """Unknowns that are hard to tell apart."""
        columns: list[Spec] = [
            self.columns.word("Unknown", "a"),
            self.columns.word("and", "b"),
            self.columns.plain("correlation", "value", 3),
        ]
        note = "Pairs of unknowns other than point coordinates, stronger than 0.7."
        return build_table(
            "correlations", "Correlations", note, self.content.correlations, columns, most=self.most
        )


def _semi_axis(k: int) -> Callable[[Point], float | None]:
    """Takes one semi-axis of the ellipsoid of a point."""
    return lambda point: point.ellipsoid.axes[k] if point.ellipsoid else None


def _group(k: KindCount) -> str:
    return "" if k.group == k.kind else k.group


def _part(name: str, k: int) -> Callable[[Point], float | None]:
    """One of three coordinates of a point, None where it has none of that kind."""

    def get(point: Point) -> float | None:
        found: tuple[float, ...] | None = getattr(point, name)
        return None if found is None else found[k]

    return get


def _dms(value: float) -> Cell:
    """Degrees, minutes and seconds to 1e-5 arc seconds, a third of a millimetre."""
    return Cell(format_angle(value, "dms", 5), value)


def _test(c: Control) -> Cell:
    if c.verdict is None:
        return Cell("")
    return number_cell(c.verdict.statistic, f"{c.verdict.statistic:.2f}")


def _limit(c: Control) -> Cell:
    return Cell("") if c.verdict is None else number_cell(c.verdict.limit, f"{c.verdict.limit:.2f}")


def _verdict(c: Control) -> Cell:
    """In words: agrees, does not agree, or why there is no verdict."""
    if c.verdict is None:
        return text_cell({"off": c.reason, "held": "held"}.get(c.use, "not controlled"))
    return text_cell("agrees", "good") if c.verdict.agrees else text_cell("does not agree", "bad")


def _control_state(c: Control) -> str:
    return c.use if c.use in ("off", "check") else ""
