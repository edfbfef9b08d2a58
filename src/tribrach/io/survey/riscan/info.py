"""A RiSCAN PRO project in numbers and words, for ``tribrach info``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tribrach.answers import Matrix, Number, Result, Vector, part
from tribrach.errors import InputError
from tribrach.io.survey.riscan.links import linked_stations
from tribrach.io.survey.riscan.reader import is_geocentric, read
from tribrach.io.survey.riscan.records import RiscanProject, ScanPosition, parse
from tribrach.sentences import capital, stopped


@dataclass(frozen=True, eq=False)
class DescribedPosition(
    Result,
    without=("position", "control"),
    also=(
        "name",
        "registered",
        "sop",
        "reflectors",
        "active",
        "of_control",
        "gnss",
        "gnss_accuracy",
    ),
):
    """A scan position of a project of RiSCAN PRO [m]."""

    position: ScanPosition
    control: frozenset[str]  #: names of control points

    name = part("position.name", str, "Of the position.")
    registered = part("position.registered", bool, "The program had determined the SOP.")
    sop = part("position.sop", Matrix | None, "Project from scanner, 4 x 4.")

    @property
    def reflectors(self) -> int:
        """How many were seen."""
        return len(self.position.targets)

    @property
    def active(self) -> int:
        """How many of them take part."""
        return sum(target.active for target in self.position.targets)

    @property
    def of_control(self) -> int:
        """Reflectors that are control points."""
        return sum(target.name in self.control for target in self.position.targets)

    @property
    def gnss(self) -> Vector | None:
        """Position by the scanner's own receiver."""
        return None if self.position.position is None else self.position.position.vector

    @property
    def gnss_accuracy(self) -> Number | None:
        """As it is stated, null if it is not."""
        return None if self.position.position is None else self.position.position.accuracy

    @property
    def words(self) -> str:
        """All of it in a line."""
        registered = "registered" if self.registered and self.sop is not None else "not registered"
        parts = [registered, f"{self.reflectors} reflectors, {self.active} active"]
        if self.of_control:
            parts.append(f"{self.of_control} of them control")
        receiver = self.position.position
        if receiver is not None:
            stated = np.isfinite(receiver.accuracy)
            sigma = f" of {receiver.accuracy:.2f} m" if stated else ""
            off = "" if receiver.enabled else ", switched off"
            parts.append(f"GNSS position{sigma}{off}")
        return "; ".join(parts)


@dataclass(frozen=True, eq=False)
class ProjectDescription(
    Result,
    without=("path", "project", "warnings"),
    also=("file", "name", "crs", "pop", "control", "tie_points", "positions", "sentences"),
    null=("crs",),
):
    """A project of RiSCAN PRO [m]."""

    path: Path
    project: RiscanProject  #: its records; reflectors have the names of what they are linked to
    warnings: tuple[str, ...]  #: what reading it says, one sentence each

    name = part("project.name", str, "Of the project.")
    crs = part("project.crs", str, "Reference system.")
    pop = part("project.pop", Matrix | None, "Global from project, 4 x 4.")

    @property
    def file(self) -> str:
        """Path of the file."""
        return str(self.path)

    @property
    def control(self) -> int:
        """How many control points."""
        return len(self.project.glcs)

    @property
    def tie_points(self) -> int:
        """How many tie points."""
        return len(self.project.prcs)

    @property
    def positions(self) -> tuple[DescribedPosition, ...]:
        """Scan positions."""
        control = frozenset(point.name for point in self.project.glcs)
        return tuple(DescribedPosition(station, control) for station in self.project.stations)

    @property
    def title(self) -> str:
        """Name of file and project."""
        return f"{self.path.name} ({self.project.name or 'without a name'})"

    @property
    def placed(self) -> bool:
        """True if the POP places the project on the Earth."""
        pop = self.project.pop
        return pop is not None and is_geocentric(pop[:3, 3])

    def rows(self) -> list[tuple[str, str]]:
        """Names and values, in the order of reading."""
        project = self.project
        used = sum(point.active for point in project.glcs)
        rows = [
            ("scan positions", f"{len(project.stations)}"),
            ("CRS", project.crs or "none"),
            ("POP", "places the project on the Earth" if self.placed else "none on the Earth"),
            ("control (GLCS)", f"{len(project.glcs)} points, {used} active"),
            ("tie points (PRCS)", f"{len(project.prcs)}"),
        ]
        return rows + [(f"position {station.name}", station.words) for station in self.positions]

    @property
    def sentences(self) -> list[str]:
        """What looks wrong or is worth knowing, one sentence each."""
        return [stopped(capital(w)) for w in self.warnings]


def describe_project(path: Path) -> ProjectDescription:
    """Read a project and describe it."""
    project = parse(path)
    linked, _ = linked_stations(project)
    try:
        warnings = tuple(read(path).warnings)
    except InputError as error:
        warnings = (str(error),)
    whole = RiscanProject(
        project.name, project.pop, tuple(linked), project.prcs, project.glcs, project.crs
    )
    return ProjectDescription(path, whole, warnings)
