"""A RiSCAN PRO project in numbers and words, for ``tribrach info``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tribrach.errors import InputError
from tribrach.io.survey.riscan.links import linked_stations
from tribrach.io.survey.riscan.reader import is_geocentric, read
from tribrach.io.survey.riscan.records import RiscanProject, ScanPosition, parse

__all__ = ["ProjectDescription", "describe_project"]


@dataclass(frozen=True, eq=False)
class ProjectDescription:
    """What a project holds."""

    #: the file
    path: Path
    #: its records; reflectors have the names of what they are linked to
    project: RiscanProject
    #: what reading it says, one sentence each
    warnings: tuple[str, ...]

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
        return rows + [
            (f"position {station.name}", self._position_words(station))
            for station in project.stations
        ]

    def _position_words(self, station: ScanPosition) -> str:
        active = sum(target.active for target in station.targets)
        parts = [
            "registered" if station.registered and station.sop is not None else "not registered",
            f"{len(station.targets)} reflectors, {active} active",
        ]
        control = self._of_control(station)
        if control:
            parts.append(f"{control} of them control")
        if station.position is not None:
            accuracy = station.position.accuracy
            sigma = f" of {accuracy:.2f} m" if np.isfinite(accuracy) else ""
            off = "" if station.position.enabled else ", switched off"
            parts.append(f"GNSS position{sigma}{off}")
        return "; ".join(parts)

    def _of_control(self, station: ScanPosition) -> int:
        """How many reflectors of a position are control points."""
        names = {point.name for point in self.project.glcs}
        return sum(target.name in names for target in station.targets)

    def sentences(self) -> list[str]:
        """What looks wrong or is worth knowing, one sentence each."""
        return [f"{w[:1].upper()}{w[1:].rstrip('.')}." for w in self.warnings]

    def to_json(self) -> dict[str, Any]:
        """The description as numbers, with metres."""
        project = self.project
        return {
            "file": str(self.path),
            "name": project.name,
            "crs": project.crs or None,
            "pop": None if project.pop is None else project.pop.tolist(),
            "control": len(project.glcs),
            "tie_points": len(project.prcs),
            "positions": [
                {
                    "name": station.name,
                    "registered": station.registered,
                    "sop": None if station.sop is None else station.sop.tolist(),
                    "reflectors": len(station.targets),
                    "active": sum(target.active for target in station.targets),
                    "of_control": self._of_control(station),
                    "gnss": None if station.position is None else station.position.vector.tolist(),
                    "gnss_accuracy": _accuracy(station),
                }
                for station in project.stations
            ],
            "sentences": self.sentences(),
        }


def _accuracy(station: ScanPosition) -> float | None:
    """Stated accuracy of a GNSS position [m], None if there is none."""
    position = station.position
    if position is None or not np.isfinite(position.accuracy):
        return None
    return position.accuracy


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
