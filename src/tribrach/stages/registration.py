"""What ties the stations of a project to each other: targets, planes, clouds, all in one network.

Planes and clouds join stations without targets and approximate poses; what they join is matched to
the known points as one. A station that they leave open is placed by its targets: once a first
adjustment has its pose to millimetres, its planes are tied to those of the others as well.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.network.survey import Survey
from tribrach.registration.by_planes import PlaneRegistration, register_by_planes
from tribrach.registration.clouds.graph import CloudEdge
from tribrach.registration.plane_set import PlaneSet
from tribrach.registration.plane_ties import PlaneTies
from tribrach.registration.station_view import StationView
from tribrach.registration.surroundings import Surroundings
from tribrach.stages.cloud_pairs import CloudPairs, cloud_pairs, contradicted
from tribrach.stages.extraction import Findings
from tribrach.stages.naming import Named, name_targets
from tribrach.stages.planes import surroundings
from tribrach.stages.scans import StationScan
from tribrach.stages.state import State
from tribrach.stages.tying import Tying
from tribrach.units import MM, SEC

if TYPE_CHECKING:
    from tribrach.project import Project

__all__ = ["Registered", "register"]


@dataclass(frozen=True, eq=False)
class Registered:
    """Stations before the adjustment.

    survey : what the scans add to the survey; named : their targets, None if none are sought;
    stations : planes and views, empty without planes and clouds; ties : surfaces in common, None
    if planes are not used; poses : approximate, in one frame; sentences : how stations were
    placed and what was not used.
    """

    survey: Survey | None
    named: Named | None
    stations: Sequence[Surroundings] = ()
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
    if by == ("targets",):
        named = name_targets(project, scans, findings) if wanted else None
        return Registered(None if named is None else named.survey, named)
    around = _stations(project, scans, state, progress)
    wish = project.registration
    floor = wish.cloud_floor_mm * MM, wish.cloud_floor_arcsec * SEC
    clouds = cloud_pairs(scans, floor, state, progress) if "clouds" in by else None
    found = register_by_planes(
        around,
        lambda k, n: progress("pairs of stations by planes", k, n),
        () if clouds is None else clouds.joints,
        _by_targets(project, scans, findings) if wanted else None,
    )
    groups = [group for group in found.groups if len(group) > 1]
    named = name_targets(project, scans, findings, groups, partial=True) if wanted else None
    poses, adrift = _poses(named, found)
    surveyed = project.survey()
    obstacles = _obstacles(by, found, clouds)
    _refuse_lost(surveyed, scans, poses, found, obstacles, named)
    framed = not adrift or (project.datum.kind == "free" and not surveyed.points)
    edges, wrong = _believed(clouds, poses)
    tying = Tying(
        project.network,
        surveyed.site,
        None if named is None else named.survey,
        around if "planes" in by else (),
        edges,
        groups,
    )
    survey, ties, poses = tying.tied(poses, framed=framed)
    if named is not None:
        named = replace(named, survey=survey)
    said = (*_sentences(found, obstacles, ties, clouds, poses), *wrong)
    return Registered(survey, named, around, ties if "planes" in by else None, poses, said)


def _by_targets(
    project: Project, scans: Sequence[StationScan], findings: Sequence[Findings]
) -> Mapping[str, Pose]:
    """Poses of the stations that their own targets place."""
    return name_targets(project, scans, findings, partial=True).identification.poses


def _believed(
    clouds: CloudPairs | None, poses: Mapping[str, Pose]
) -> tuple[list[CloudEdge], list[str]]:
    """Pairs of clouds that the poses do not contradict, and sentences on the others."""
    if clouds is None:
        return [], []
    wrong = contradicted(clouds.edges, poses)
    said = [
        f"the clouds of {e.first} and {e.second} fit at a place that contradicts the other ties by "
        f"{gap:.2f} m: not used"
        for e, gap in wrong
    ]
    return [e for e in clouds.edges if all(e is not bad for bad, _ in wrong)], said


def _stations(
    project: Project,
    scans: Sequence[StationScan],
    state: State,
    progress: Callable[[str, int, int | None], None],
) -> list[Surroundings]:
    """Planes and views of all stations; both empty where planes are not wanted."""
    wish = project.registration
    if "planes" in wish.by:
        return surroundings(scans, wish, state, lambda what: progress(what, 0, None))
    blank, blind = PlaneSet.joined([]), StationView.empty()
    levelled = {scan.station: scan.levelled for scan in scans}
    return [Surroundings.of(name, blank, blind, flat) for name, flat in levelled.items()]


def _poses(named: Named | None, found: PlaneRegistration) -> tuple[Mapping[str, Pose], bool]:
    """Approximate poses of all stations that were placed; are they in a frame of their own?"""
    if named is not None and named.identification.poses:
        return named.identification.poses, named.identification.adrift
    return found.groups[0], True


def _obstacles(
    by: Sequence[str], found: PlaneRegistration, clouds: CloudPairs | None
) -> dict[str, str]:
    """Why stations are alone, by planes and by clouds."""
    out = {}
    for name, reason in found.obstacles.items():
        words = [f"by planes {reason}"] if "planes" in by else []
        if clouds is not None:
            mine = [why for pair, why in clouds.obstacles.items() if name in pair]
            words.append(f"by clouds {mine[0]}" if mine else "no pair of clouds holds it")
        out[name] = "; ".join(words)
    return out


def _refuse_lost(
    surveyed: Survey,
    scans: Sequence[StationScan],
    poses: Mapping[str, Pose],
    found: PlaneRegistration,
    obstacles: Mapping[str, str],
    named: Named | None,
) -> None:
    """Say which stations nothing places, unless the survey itself observes them."""
    lost = [s for s in dict.fromkeys(scan.station for scan in scans) if s not in poses]
    lost = [name for name in lost if name not in surveyed.stations]
    if not lost:
        return
    name = lost[0]
    reason = obstacles.get(name)
    if reason is None:
        group = next(group for group in found.groups if name in group)
        reason = (
            f"it hangs together with {', '.join(n for n in group if n != name)}, and nothing joins "
            "these to the rest"
        )
    words = f"station {name} cannot be registered: {reason}"
    if named is not None:
        why = named.identification.unplaced.get(name, "it shows none")
        words += f"; by targets: {why}"
    if len(lost) > 1:
        words += f" (and so for {', '.join(lost[1:6])}{' ...' * (len(lost) > 6)})"
    raise InputError(
        words,
        record=name,
        cure="add what is named there, or take the scans of these stations out of the project",
    )


def _sentences(
    found: PlaneRegistration,
    obstacles: Mapping[str, str],
    ties: PlaneTies,
    clouds: CloudPairs | None,
    poses: Mapping[str, Pose],
) -> tuple[str, ...]:
    """What joined the stations, what was left to others and what was not used."""
    said = []
    by = "planes and clouds" if clouds is not None and len(ties.normal) else "clouds"
    by = "planes" if clouds is None else by
    for group in found.groups:
        if len(group) > 1:
            names = list(group)
            said.append(f"{by} join {', '.join(names[:-1])} and {names[-1]}")
    for name, reason in obstacles.items():
        how = "its targets place it" if name in poses else "other observations have to place it"
        said.append(f"{name} is not joined to the others: {reason}; {how}")
    said += found.sentences
    if clouds is not None:
        said += clouds.sentences
    if len(ties.normal):
        said.append(f"{len(ties.normal)} surfaces are seen by two or more stations")
    return tuple(said)
