"""What a job leaves besides its adjustment, for the chapters of its report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
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

__all__ = ["JobResults"]


@dataclass(frozen=True)
class JobResults:
    """Products of a job, those that it has.

    Parameters
    ----------
    project : Project or None
        What was run; None where files of networks were adjusted.
    sessions : sequence of SessionResult
        Of receivers whose baselines were computed for the job.
    registered : Registered or None
        How scans were tied to each other before the adjustment.
    placed : PlacedScans or None
        Scans with their targets and clouds, through the adjusted stations.
    comparisons : sequence of StationComparison
        Between stations, as the project asks for.
    epochs : sequence of ComparedEpochs
        The job against earlier epochs.
    antennas : CarriedAntennas or None
        Lever arms and the rigid model of stations that carry antennas or prisms.
    logo : str
        The picture in the head of the report as an address that holds it, "" if there is none.
    """

    project: Project | None = None
    sessions: Sequence[SessionResult] = ()
    registered: Registered | None = None
    placed: PlacedScans | None = None
    comparisons: Sequence[StationComparison] = field(default=())
    epochs: Sequence[ComparedEpochs] = field(default=())
    antennas: CarriedAntennas | None = None
    logo: str = ""

    @property
    def lever_arms(self) -> Sequence[EstimatedLeverArm]:
        """Lever arms that were estimated."""
        return () if self.antennas is None else self.antennas.lever_arms
