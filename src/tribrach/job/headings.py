"""Headings that compasses of scanners show, and what the headings of one compass share."""

from __future__ import annotations

import numpy as np

from tribrach.job.whose_instrument import Instruments
from tribrach.network.survey import Survey, as_column
from tribrach.observations.control import ScalarPriors
from tribrach.observations.headings import Headings
from tribrach.project import Project


def add_headings(project: Project, instruments: Instruments, survey: Survey) -> None:
    """Add the headings that stations state, and the unknown that each compass has."""
    for name, station in project.stations.items():
        if station.heading_deg is None or name not in survey.stations:
            continue
        own = instruments.precision(instruments.of_station(name)).compass
        given = station.sigma_heading_deg
        sigma = own if given is None else float(np.radians(given))
        if sigma is None:
            raise project.error(
                ("stations", name, "heading_deg"),
                f"the sigma of the heading of {name} is not given",
                "add sigma_heading_deg to the station or compass_deg to its instrument",
            )
        survey.add(
            Headings,
            values=[np.radians(station.heading_deg)],
            sigma=sigma,
            station=[name],
            direction=np.pi / 2 if station.heading_axis == "y" else 0.0,
            source=[f"station {name}"],
        )
    shared: dict[str, float] = {}
    for table in survey.tables():
        if table.kind is not Headings:
            continue
        offsets = np.full(table.n, "", dtype=object)
        for k, station in enumerate(as_column(table.columns["station"], table.n)):
            compass = instruments.of_station(str(station))
            sigma = instruments.precision(compass).compass_common
            if sigma:
                offsets[k] = f"heading offset of {compass}"
                shared[offsets[k]] = sigma
        table.columns["offset"] = offsets
    for name, sigma in shared.items():
        survey.scalars[name] = (0.0, True)
        survey.add(
            ScalarPriors,
            values=[0.0],
            sigma=sigma,
            scalar=[name],
            source=[name],
            group="heading offset",
        )
