"""What ties the stations of a project to each other: targets, planes, clouds, all in one network.

Planes join stations without targets and approximate poses; what they join is matched to the known
points as one. A station that planes leave open is placed by its targets: once a first adjustment
has its pose to millimetres, its planes are tied to those of the others as well.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from tribrach.errors import AdjustmentError, InputError
from tribrach.geometry.pose import Pose
from tribrach.network.adjustment import adjust
from tribrach.network.observations.plane import FittedPlanes
from tribrach.network.survey import Survey
from tribrach.registration.by_planes import PlaneRegistration, register_by_planes
from tribrach.registration.plane_poses import Surroundings
from tribrach.registration.plane_ties import PlaneTies, tie_planes
from tribrach.stages.extraction import Findings
from tribrach.stages.naming import Named, name_targets
from tribrach.stages.planes import surroundings
from tribrach.stages.scans import StationScan
from tribrach.stages.state import State

if TYPE_CHECKING:
    from tribrach.project import Project

__all__ = ["Registered", "register"]

#: adjusted poses may be wrong by this where planes are tied between groups [m]
_SLACK = 0.004


@dataclass(frozen=True, eq=False)
class Registered:
    """Stations before the adjustment.

    survey : what the scans add to the survey; named : their targets, None if none are sought;
    stations : planes and views, empty without planes; planes : how planes join them; ties :
    surfaces in common; poses : approximate, in one frame; sentences : how stations were placed and
    what was not used.
    """

    survey: Survey | None
    named: Named | None
    stations: Sequence[Surroundings] = ()
    planes: PlaneRegistration | None = None
    ties: PlaneTies | None = None
    poses: Mapping[str, Pose] | None = None
    sentences: tuple[str, ...] = ()


def register(
    project: Project,
    scans: Sequence[StationScan],
    findings: Sequence[Findings],
    state: State,
    progress: Callable[[str, int, int | None], None],
) -> Registered:
    """Names, approximate poses and observations of all stations.

    Raises
    ------
    InputError : a station that nothing places, with what was tried and what would help.
    """
    by = project.registration.by
    wanted = "targets" in by and project.targets.wanted
    if "planes" not in by:
        named = name_targets(project, scans, findings) if wanted else None
        return Registered(None if named is None else named.survey, named)
    around = surroundings(scans, project.registration, state, lambda what: progress(what, 0, None))
    found = register_by_planes(around, lambda k, n: progress("pairs of stations by planes", k, n))
    groups = [group for group in found.groups if len(group) > 1]
    named = name_targets(project, scans, findings, groups, partial=True) if wanted else None
    poses, adrift = _poses(named, found)
    _refuse_lost(project, scans, poses, found, named)
    framed = not adrift or (project.datum.kind == "free" and not project.survey().points)
    survey, ties, poses = _tied(project, named, around, groups, poses, framed=framed)
    if named is not None:
        named = replace(named, survey=survey)
    return Registered(survey, named, around, found, ties, poses, _sentences(found, ties, poses))


def _tied(
    project: Project,
    named: Named | None,
    stations: Sequence[Surroundings],
    groups: Sequence[Mapping[str, Pose]],
    poses: Mapping[str, Pose],
    *,
    framed: bool,
) -> tuple[Survey, PlaneTies, Mapping[str, Pose]]:
    """The survey with planes: tied within the groups that they form, then between all stations.

    Poses from the matching of targets are too coarse to tell a wall from a window in it.
    """
    ties = tie_planes(stations, poses, groups=groups)
    survey = _with_planes(project, named, stations, ties, poses, framed=framed)
    if len(groups) == 1 and len(groups[0]) == len(poses):
        return survey, ties, poses
    try:
        first = adjust(project.network(survey))
    except AdjustmentError:
        return survey, ties, poses
    state, layout = first.state, first.layout
    at = {name: layout.index("pose", name) for name in poses}
    poses = {name: Pose(state.pose_r[k], state.pose_t[k]) for name, k in at.items()}
    ties = tie_planes(stations, poses, _SLACK)
    return _with_planes(project, named, stations, ties, poses, framed=True), ties, poses


def _with_planes(
    project: Project,
    named: Named | None,
    stations: Sequence[Surroundings],
    ties: PlaneTies,
    poses: Mapping[str, Pose],
    *,
    framed: bool,
) -> Survey:
    """What targets and planes add to the survey."""
    survey = Survey(site=project.survey().site)
    if named is not None:
        survey.merge(named.survey)
    _observe(survey, stations, ties, poses, framed=framed)
    return survey


def _poses(named: Named | None, found: PlaneRegistration) -> tuple[Mapping[str, Pose], bool]:
    """Approximate poses of all stations that were placed; are they in a frame of their own?"""
    if named is not None and named.identification.poses:
        return named.identification.poses, named.identification.adrift
    return found.groups[0], True


def _refuse_lost(
    project: Project,
    scans: Sequence[StationScan],
    poses: Mapping[str, Pose],
    found: PlaneRegistration,
    named: Named | None,
) -> None:
    """Say which stations nothing places, unless the survey itself observes them."""
    lost = [s for s in dict.fromkeys(scan.station for scan in scans) if s not in poses]
    lost = [name for name in lost if name not in project.survey().stations]
    if not lost:
        return
    name = lost[0]
    reason = found.obstacles.get(name)
    if reason is None:
        group = next(group for group in found.groups if name in group)
        reason = (
            f"its planes join it to {', '.join(n for n in group if n != name)}, and nothing joins "
            "these to the rest"
        )
    words = f"station {name} cannot be registered by planes: {reason}"
    if named is not None:
        why = named.identification.unplaced.get(name, "it shows none")
        words += f"; nor by targets: {why}"
    if len(lost) > 1:
        words += f" (and so for {', '.join(lost[1:6])}{' ...' * (len(lost) > 6)})"
    raise InputError(
        words,
        record=name,
        cure="add what is named there, or take the scans of these stations out of the project",
    )


def _observe(
    survey: Survey,
    stations: Sequence[Surroundings],
    ties: PlaneTies,
    poses: Mapping[str, Pose],
    *,
    framed: bool,
) -> None:
    """Stations, surfaces and their observations; with start values if the frame is the site's."""
    for name, pose in poses.items():
        if name not in survey.stations:
            survey.station(name, source=f"scan {name}")
        if framed:
            known = survey.stations[name]
            survey.stations[name] = replace(
                known, translation=pose.translation, rotation=pose.rotation
            )
    if len(ties.surface) == 0:
        return
    names = [f"plane {k + 1}" for k in range(len(ties.normal))]
    if framed:
        for name, normal, offset in zip(names, ties.normal, ties.offset, strict=True):
            survey.planes[name] = (normal, float(offset))
    planes = {s.name: s.planes for s in stations}
    rows = [(planes[name], k) for name, k in zip(ties.station, ties.number, strict=True)]
    survey.add(
        FittedPlanes,
        values=np.zeros((len(rows), 3)),
        covariance=np.array([p.covariance[k] for p, k in rows]),
        station=list(ties.station),
        plane=[names[k] for k in ties.surface],
        normal=np.array([p.normal[k] for p, k in rows]),
        centroid=np.array([p.center[k] for p, k in rows]),
        source=[f"{p.scans[k]}: plane" for p, k in rows],
    )


def _sentences(
    found: PlaneRegistration, ties: PlaneTies, poses: Mapping[str, Pose]
) -> tuple[str, ...]:
    """How planes joined the stations, what they left to others and what was not used."""
    said = []
    for group in found.groups:
        if len(group) > 1:
            names = list(group)
            said.append(f"planes join {', '.join(names[:-1])} and {names[-1]}")
    for name, reason in found.obstacles.items():
        how = "its targets place it" if name in poses else "other observations have to place it"
        said.append(f"{name} is not registered by planes: {reason}; {how}")
    said += found.sentences
    said.append(f"{len(ties.normal)} surfaces are seen by two or more stations")
    return tuple(said)
