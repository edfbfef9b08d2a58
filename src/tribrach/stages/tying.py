"""Planes and clouds as observations of the network, once the stations have approximate poses."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tribrach.errors import AdjustmentError
from tribrach.geodesy.site import Site
from tribrach.geometry.pose import Pose
from tribrach.network.adjustment import adjust
from tribrach.network.network import Network
from tribrach.network.observations.plane import FittedPlanes
from tribrach.network.survey import Survey
from tribrach.registration.clouds.graph import CloudEdge, observe
from tribrach.registration.plane_poses import information
from tribrach.registration.plane_ties import PlaneTies, tie_planes
from tribrach.registration.surroundings import Surroundings
from tribrach.stages.cloud_pairs import observable

__all__ = ["Tying"]

#: adjusted poses may be wrong by this where planes are tied between groups [m]
_SLACK = 0.004


@dataclass(frozen=True, eq=False)
class Tying:
    """What there is to tie.

    network : makes the network of the project and a further survey; site : of the survey; targets :
    observations of target centres, None if there are none; stations : with the planes to tie;
    edges : relative poses from clouds; groups : stations whose relative poses are sharp already.
    """

    network: Callable[[Survey], Network]
    site: Site
    targets: Survey | None
    stations: Sequence[Surroundings]
    edges: Sequence[CloudEdge]
    groups: Sequence[Mapping[str, Pose]]

    def tied(
        self, poses: Mapping[str, Pose], *, framed: bool
    ) -> tuple[Survey, PlaneTies, Mapping[str, Pose]]:
        """The survey with planes and clouds, surfaces in common, and poses.

        Planes are tied within the groups, then between all stations: poses from the matching of
        targets are too coarse to tell a wall from a window in it. framed : the poses are in the
        frame of the survey and serve as start values.
        """
        ties = tie_planes(self.stations, poses, groups=self.groups)
        survey = self._survey(ties, poses, framed=framed)
        whole = len(self.groups) == 1 and len(self.groups[0]) == len(poses)
        if whole or not self.stations:
            return survey, ties, poses
        try:
            first = adjust(self.network(survey))
        except AdjustmentError:
            return survey, ties, poses
        state, layout = first.state, first.layout
        at = {name: layout.index("pose", name) for name in poses}
        poses = {name: Pose(state.pose_r[k], state.pose_t[k]) for name, k in at.items()}
        ties = tie_planes(self.stations, poses, _SLACK)
        return self._survey(ties, poses, framed=True), ties, poses

    def _survey(self, ties: PlaneTies, poses: Mapping[str, Pose], *, framed: bool) -> Survey:
        """Stations, targets, surfaces and relative poses."""
        survey = Survey(site=self.site)
        if self.targets is not None:
            survey.merge(self.targets)
        for name, pose in poses.items():
            if name not in survey.stations:
                survey.station(name, source=f"scan {name}")
            if framed:
                known = survey.stations[name]
                survey.stations[name] = replace(
                    known, translation=pose.translation, rotation=pose.rotation
                )
        plane_factor, cloud_factor = self._factors(ties, poses)
        if len(ties.surface):
            self._planes(survey, ties, plane_factor, framed=framed)
        observe(survey, observable(self.edges, poses, cloud_factor))
        return survey

    def _factors(self, ties: PlaneTies, poses: Mapping[str, Pose]) -> tuple[float, float]:
        """Factors of the covariances of planes and of clouds where both are used.

        Both are taken from the same points. Counted with the weights w and 1 - w in the ratio of
        what either knows of a pair (the sixth root of the determinants of their information, the
        median over the pairs), two equal ones know as much together as one of them, and next to a
        better one a worse one adds hardly anything.
        """
        planes = {s.name: s.planes for s in self.stations}
        ratios = []
        for edge in self.edges:
            pairs = ties.pairs.get((edge.first, edge.second))
            if pairs is None or not len(pairs):
                continue
            one, two = planes[edge.first], planes[edge.second]
            between = poses[edge.first].inverse @ poses[edge.second]
            matrix, _ = information(one, two, pairs, between)
            sign, size = np.linalg.slogdet(matrix)
            if sign > 0:
                ratios.append((size + np.linalg.slogdet(edge.covariance)[1]) / 6)
        if not ratios:
            return 1.0, 1.0
        ratio = float(np.exp(np.clip(np.median(ratios), -20, 20)))
        return (1 + ratio) / ratio, 1 + ratio

    def _planes(self, survey: Survey, ties: PlaneTies, shared: float, *, framed: bool) -> None:
        """Surfaces that several stations see, and how each station fitted them."""
        names = [f"plane {k + 1}" for k in range(len(ties.normal))]
        if framed:
            for name, normal, offset in zip(names, ties.normal, ties.offset, strict=True):
                survey.planes[name] = (normal, float(offset))
        planes = {s.name: s.planes for s in self.stations}
        rows = [(planes[name], k) for name, k in zip(ties.station, ties.number, strict=True)]
        survey.add(
            FittedPlanes,
            values=np.zeros((len(rows), 3)),
            covariance=shared * np.array([p.covariance[k] for p, k in rows]),
            station=list(ties.station),
            plane=[names[k] for k in ties.surface],
            normal=np.array([p.normal[k] for p, k in rows]),
            centroid=np.array([p.center[k] for p, k in rows]),
            source=[f"{p.scans[k]}: plane" for p, k in rows],
        )
