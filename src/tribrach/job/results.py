"""What a job leaves besides its adjustment, for the chapters of its report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tribrach.gnss.sessions import SessionResult
    from tribrach.job.antenna_lever_arms import EstimatedLeverArm
    from tribrach.job.antennas import CarriedAntennas
    from tribrach.job.epochs import ComparedEpochs
    from tribrach.job.station_comparison import StationComparison
    from tribrach.job.steps import PlacedScans
    from tribrach.job.tie import Registered
    from tribrach.project import Project


@dataclass(frozen=True)
class JobResults:
    """Products of a job, those that it has."""

    project: Project | None = None  #: what was run; None where files of networks were adjusted
    #: of receivers whose baselines were computed for the job
    sessions: Sequence[SessionResult] = ()
    registered: Registered | None = None  #: how scans were tied to each other before the adjustment
    #: scans with their targets and clouds, through the adjusted stations
    placed: PlacedScans | None = None
    #: between stations, as the project asks for
    comparisons: Sequence[StationComparison] = field(default=())
    epochs: Sequence[ComparedEpochs] = field(default=())  #: the job against earlier epochs
    #: lever arms and the rigid model of stations that carry antennas or prisms
    antennas: CarriedAntennas | None = None
    #: the picture in the head of the report as an address that holds it, "" if there is none
    logo: str = ""

    @property
    def lever_arms(self) -> Sequence[EstimatedLeverArm]:
        """Lever arms that were estimated."""
        return () if self.antennas is None else self.antennas.lever_arms

    def of_scans(
        self, registered: Registered, placed: PlacedScans, comparisons: Sequence[StationComparison]
    ) -> JobResults:
        """The same with what was made of the scans."""
        return replace(self, registered=registered, placed=placed, comparisons=comparisons)
