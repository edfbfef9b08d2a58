"""Names of reflectors by the links that RiSCAN PRO keeps between tie points.

A tie point may name another one that it is the same as: control in the global frame, a tie point of
the project, or the reflector of another scan position, as a path
``/project/SCANS/SP01/TPL (SOCS)/tp006`` or ``/project/TPL (GLCS)/CP1``. Paths are followed to their
end, whose name is that of the reflector.
"""

from __future__ import annotations

from dataclasses import replace

from tribrach.io.survey.riscan.records import RiscanProject, ScanPosition, TiePoint

#: links that follow each other, at most
_LONGEST = 8

#: list and, within a scan position, its name; then the name of the tie point
_Place = tuple[str, str, str]


def linked_stations(project: RiscanProject) -> tuple[list[ScanPosition], list[str]]:
    """Scan positions whose reflectors take the names of their links."""
    known: dict[_Place, TiePoint] = {("GLCS", "", p.name): p for p in project.glcs}
    known |= {("PRCS", "", p.name): p for p in project.prcs}
    known |= {("SOCS", s.name, t.name): t for s in project.stations for t in s.targets}
    warnings: list[str] = []
    stations = []
    for station in project.stations:
        own = {target.name for target in station.targets if not target.link}
        targets = []
        for target in station.targets:
            name, lost = _name(target, known)
            if lost:
                warnings.append(
                    f"{target.source}: reflector {target.name} of {station.name} is linked to "
                    f"{target.link}, which is not in the project; it keeps its name"
                )
            if target.link and name in own:
                warnings.append(
                    f"{target.source}: reflector {target.name} of {station.name} is linked to "
                    f"{name}, as another reflector of that position is; it keeps its name"
                )
                name = target.name
            own.add(name)
            targets.append(replace(target, name=name))
        stations.append(replace(station, targets=tuple(targets)))
    return stations, warnings


def _name(target: TiePoint, known: dict[_Place, TiePoint]) -> tuple[str, bool]:
    """Name at the end of the links of a tie point, and whether a link leads nowhere."""
    point = target
    for _ in range(_LONGEST):
        if not point.link:
            return point.name, False
        place = _place(point.link)
        if place is None or place not in known:
            return point.name, True
        point = known[place]
    return target.name, True


def _place(link: str) -> _Place | None:
    """List, scan position and name that a path leads to; None for other paths."""
    parts = link.strip("/").split("/")
    if len(parts) < 3:
        return None
    group = parts[-2].removeprefix("TPL (").removesuffix(")")
    if group in ("GLCS", "PRCS"):
        return group, "", parts[-1]
    return ("SOCS", parts[-3], parts[-1]) if group == "SOCS" and len(parts) > 3 else None
