"""Scanner stations over known marks, turned to backsights, as observations of the network.

The scanner's centre is the height of instrument above its mark, with the centring in plan; the
prism over the backsight likewise, so that it is a place of its own; the telescope's horizontal
angle ties both. What control, centring, levelling and pointing do to the pose follows from the
adjustment (method section 5.1); targets, sights and further backsights may be mixed in freely.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tribrach._types import Array
from tribrach.errors import AdjustmentError, InputError
from tribrach.geometry.rotation import exp
from tribrach.instruments.precision import pointing_sigma
from tribrach.job.edits import decided_marks
from tribrach.job.whose_instrument import Instruments
from tribrach.network.adjustment import adjust
from tribrach.network.survey import Survey
from tribrach.observations.control import Offsets
from tribrach.observations.instrument_frames import FrameAngles
from tribrach.project import Project
from tribrach.project.edits import Edits
from tribrach.project.instrument import Instrument
from tribrach.project.sections import Backsight, StationSection
from tribrach.units import MM, SEC


def add_known_setups(instruments: Instruments, survey: Survey, edits: Edits) -> None:
    """Add the occupied marks and backsights of all stations to a survey."""
    project = instruments.project
    for name, station in project.stations.items():
        if station.occupies is None and not station.backsights:
            continue
        instrument = _instrument(instruments, name)
        _start(survey, edits, name, station)
        over = _centring(project, name, instrument)
        if station.occupies is not None:
            _over(survey, station.occupies, name, station.height_m, over, f"station {name}")
        for k, sight in enumerate(station.backsights):
            prism = f"{sight.to}, backsight of {name}"
            source = f"backsight {k + 1} of station {name}"
            _over(survey, sight.to, prism, sight.height_target_m, over, source)
            sigma = _pointing(project, name, k, instrument, sight)
            survey.add(
                FrameAngles,
                values=[np.radians(sight.horizontal_deg)],
                sigma=sigma,
                station=[name],
                target=[prism],
                circle=[0],
                source=[source],
                group="backsight",
            )


def _start(survey: Survey, edits: Edits, name: str, station: StationSection) -> None:
    """The station with a pose to start from, if its mark and a backsight are known."""
    names = [station.occupies, *(sight.to for sight in station.backsights)]
    places = _places(survey, edits, [one for one in names if one is not None])
    mark = None if station.occupies is None else places.get(station.occupies)
    sights = [sight for sight in station.backsights if sight.to in places]
    given = survey.stations.get(name)
    if mark is None or not sights or (given is not None and np.isfinite(given.rotation).all()):
        if given is None:
            survey.station(name, source=f"station {name}")
        return
    line = places[sights[0].to] - mark
    heading = np.arctan2(line[1], line[0]) - np.radians(sights[0].horizontal_deg)
    pose = exp(np.array([0.0, 0.0, heading])), mark + np.array([0.0, 0.0, station.height_m])
    if given is None:
        survey.station(name, translation=pose[1], rotation=pose[0], source=f"station {name}")
    else:
        given.rotation, given.translation = pose


def _places(survey: Survey, edits: Edits, names: Sequence[str]) -> dict[str, Array]:
    """Coordinates (3,) of marks, given or from what was measured of marks alone."""
    points = survey.points
    known = {n: points[n].xyz for n in names if n in points and np.isfinite(points[n].xyz).all()}
    if set(names) <= known.keys():
        return known
    try:
        alone = adjust(decided_marks(survey, edits).network())
    except (AdjustmentError, InputError):
        return known
    adjusted = dict(zip(alone.layout.names["point"], alone.state.points, strict=True))
    return {n: x for n, x in adjusted.items() if n in names and np.isfinite(x).all()} | known


def _instrument(instruments: Instruments, name: str) -> Instrument:
    """The instrument of a station."""
    chosen = instruments.of_station(name)
    if chosen is None:
        raise instruments.project.error(
            ("stations", name),
            f"station {name} is set up over a mark or turned to a backsight and has no instrument",
            "name an instrument of the project with its centring_mm and height_mm",
        )
    return instruments.named(chosen)


def _centring(project: Project, name: str, instrument: Instrument) -> Array:
    """Covariance (3, 3) [m^2] of a centre over its mark."""
    plan, up = instrument.centring_mm * MM, instrument.height_mm * MM
    if not (plan > 0 and up > 0):
        raise project.error(
            ("stations", name),
            f"how well the instrument of {name} is centred and its height measured is not given",
            "add centring_mm and height_mm to the instrument",
        )
    return np.diag([plan**2, plan**2, up**2])


def _over(
    survey: Survey, mark: str, place: str, height: float, covariance: Array, source: str
) -> None:
    """A place plumb over a mark."""
    survey.add(
        Offsets,
        values=[[0.0, 0.0, height]],
        covariance=covariance[None],
        start=[mark],
        end=[place],
        source=[source],
        group="centring",
    )


def _pointing(
    project: Project, name: str, k: int, instrument: Instrument, sight: Backsight
) -> float:
    """Sigma [rad] of the horizontal angle to a backsight."""
    if sight.sigma_arcsec is not None:
        return sight.sigma_arcsec * SEC
    if instrument.magnification is None:
        raise project.error(
            ("stations", name, "backsights", k),
            f"how well the telescope of {name} points is not given",
            "add magnification to the instrument, or sigma_arcsec to the backsight",
        )
    return pointing_sigma(instrument.magnification, sight.pointings)
