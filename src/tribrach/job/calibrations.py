"""The calibration of each scanner station: known from a file, sought, or both."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from tribrach.calibration.calibrated import StationModel, add_priors, calibrate_survey, unknown_name
from tribrach.io.calibration_file import Calibration, read_calibration
from tribrach.job.whose_instrument import Instruments
from tribrach.network.survey import Survey
from tribrach.observations.control import DirectedComponents
from tribrach.observations.poses import RelativeRotations, RelativeTranslations, RotationComponents
from tribrach.project.calibration import COMPONENTS, Hold
from tribrach.units import SEC


class Calibrations:
    """The calibrations of a project: known ones, read from their files, and those sought."""

    def __init__(self, instruments: Instruments) -> None:
        self.project = project = instruments.project
        self.instruments = instruments
        self.known: dict[str, Calibration] = {
            name: read_calibration(project.folder / instrument.calibration)
            for name, instrument in project.instruments.items()
            if instrument.calibration is not None
        }
        self.sought = self._sought()

    def _sought(self) -> tuple[str, ...]:
        """Names of the instruments whose parameters are unknowns."""
        section, instruments = self.project.calibration, self.project.instruments
        if section is None:
            return ()
        if not section.instrument:
            scanners = [n for n, i in instruments.items() if i.range_mm is not None]
            if len(scanners) != 1:
                raise self.project.error(
                    ("calibration",),
                    f"the project has {len(scanners)} scanners with range_mm, so that the "
                    "instrument to calibrate must be named",
                    "give instrument in [calibration]",
                )
            return (scanners[0],)
        for name in section.instrument:
            if name not in instruments:
                raise self.project.error(
                    ("calibration", "instrument"),
                    f"instrument {name} is not defined",
                    f"add a section [instruments.{name}]",
                )
        return tuple(dict.fromkeys(section.instrument))

    def model_of(self, instrument: str | None, station: str) -> StationModel | None:
        """Model of a station; None if its instrument has none."""
        known = None if instrument is None else self.known.get(instrument)
        section = self.project.calibration if instrument in self.sought else None
        if instrument is None or (known is None and section is None):
            return None
        if section is None:
            assert known is not None
            return StationModel(known.columns(), instrument, known.architecture)
        if known is None:
            owner = instrument if section.per == "instrument" else station
            return StationModel(section.columns(), owner, section.scanner)
        if section.per == "station":
            raise self.project.error(
                ("calibration", "per"),
                f"the calibration file of {instrument} holds for all of its stations",
                'say per = "instrument"',
            )
        first, second = known.columns(), section.columns()
        if first.name != second.name or known.unit_lengths != section.unit_lengths_m:
            raise self.project.error(
                ("calibration", "model"),
                f"the calibration file of {instrument} has the model {known.model}",
                "take the same model in [calibration]",
            )
        both = first.joined(second)
        return StationModel(both, instrument, section.scanner)

    def has(self, station: str) -> bool:
        """True if the scans of a station have a calibration, known or sought."""
        return self.model_of(self.instruments.of_station(station), station) is not None

    def apply(
        self,
        survey: Survey,
        stations: Iterable[str],
        whose: Callable[[str], str | None] | None = None,
    ) -> None:
        """Give scanner stations of a survey their calibration models."""
        whose = whose or self.instruments.of_station
        models = {}
        for station in stations:
            model = self.model_of(whose(station), station)
            if model is not None:
                models[station] = model
        if models:
            calibrate_survey(survey, models)

    def finish(self, survey: Survey, *, whole: bool) -> None:
        """Add what is known of parameters, and conditions of orientation, of all if ``whole``."""
        for name, known in self.known.items():
            names = [unknown_name(p, name) for p in known.parameters]
            if names[0] in survey.scalars:
                source = f"calibration file of {name}"
                add_priors(survey, names, known.values, known.covariance, source)
        section = self.project.calibration
        for k, hold in enumerate(() if section is None else section.hold):
            missing = [s for s in self._stations(hold) if s not in survey.stations]
            if missing and not whole:
                continue
            if missing:
                raise self.project.error(
                    ("calibration", "hold", k),
                    f"scanner station {missing[0]} is observed by nothing",
                    "name a station that has observations",
                )
            _add_hold(survey, hold, f"hold {k + 1}")

    @staticmethod
    def _stations(hold: Hold) -> Iterable[str]:
        return [hold.station, *([] if hold.relative_to is None else [hold.relative_to])]


def _add_hold(survey: Survey, hold: Hold, source: str) -> None:
    """A condition: exact without a sigma."""
    axis = np.array([COMPONENTS[hold.component]])
    value = np.radians(hold.value_deg or 0.0) if hold.turns else (hold.value_m or 0.0)
    sigma = hold.sigma_arcsec * SEC if hold.sigma_arcsec else None
    if hold.sigma_mm is not None:
        sigma = hold.sigma_mm * 1e-3
    common: dict[str, Any] = {
        "values": [value],
        "sigma": sigma,
        "hard": sigma is None,
        "source": [source],
        "group": "orientation",
    }
    reference = np.eye(3)[None]
    if hold.relative_to is None:
        if hold.turns:
            survey.add(
                RotationComponents,
                station=[hold.station],
                axis=axis,
                reference=reference,
                **common,
            )
        else:
            survey.add(DirectedComponents, position=[hold.station], direction=axis, **common)
        return
    ends: dict[str, Any] = {"start": [hold.relative_to], "end": [hold.station], "axis": axis}
    if hold.turns:
        survey.add(RelativeRotations, reference=reference, **ends, **common)
    else:
        survey.add(RelativeTranslations, **ends, **common)
