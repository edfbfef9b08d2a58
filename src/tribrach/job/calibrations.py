"""The calibration of each scanner station: known from a file, sought, or both."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from tribrach.calibration.calibrated import StationModel, add_priors, calibrate_survey, unknown_name
from tribrach.instruments.calibration import CalibrationModel
from tribrach.instruments.tilt_drift import Sweep, drift_model, drift_names
from tribrach.io.calibration_file import Calibration, read_calibration
from tribrach.job.scan_entries import scans_of_entry
from tribrach.job.whose_instrument import Instruments
from tribrach.network.survey import Survey
from tribrach.observations.control import DirectedComponents
from tribrach.observations.poses import RelativeRotations, RelativeTranslations, RotationComponents
from tribrach.project.calibration import COMPONENTS, Hold
from tribrach.scan.prepared import sweep_of
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
        self._sweeps: dict[str, Sweep] = {}

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
        """Model of a station; None if its instrument has none and its tilt does not drift."""
        drift, model = self._drift(station), self._of_instrument(instrument, station)
        if drift is None:
            return model
        if instrument in self.sought:
            raise self.project.error(
                ("stations", station, "tilt_drift_arcsec"),
                f"the tilt of {station} drifts and {instrument} is calibrated",
                "leave out one of them: take the calibration from its file",
            )
        model = model or StationModel(drift, station)
        return replace(
            model, model=model.model.joined(drift), station=station, own=drift.parameters
        )

    def _drift(self, station: str) -> CalibrationModel | None:
        """Model of a tilt that drifts during the scan of a station."""
        section = self.project.stations.get(station)
        if section is None or section.tilt_drift_arcsec is None:
            return None
        if station not in self._sweeps:
            if section.sweep_start_deg is not None and section.sweep_deg is not None:
                given = np.radians([section.sweep_start_deg, section.sweep_deg]).tolist()
                self._sweeps[station] = Sweep(*given)
            else:
                self._sweeps[station] = self._sweep(station)
        return drift_model(self._sweeps[station], drift_names(section.tilt_drift_pieces))

    def _sweep(self, station: str) -> Sweep:
        """How the head turned in the only scan of a station."""
        scans = [
            scan
            for k, entry in enumerate(self.project.scans)
            if entry.station in (None, station)
            for scan in scans_of_entry(self.project, k, entry)
            if (entry.station or scan.name) == station
        ]
        if len(scans) != 1:
            raise self.project.error(
                ("stations", station, "tilt_drift_arcsec"),
                f"{station} has {len(scans)} scans, so that the time of a target is not known",
                "give sweep_start_deg and sweep_deg, or each scan a station of its own",
            )
        return sweep_of(scans[0])

    def _of_instrument(self, instrument: str | None, station: str) -> StationModel | None:
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
        for station, given in self.project.stations.items():
            model = self._drift(station) if station in survey.stations else None
            if model is None or unknown_name(model.parameters[0], station) not in survey.scalars:
                continue
            sigma, count = float(given.tilt_drift_arcsec or 0) * SEC, len(model.parameters)
            # what the pieces add is the drift of the whole scan
            each = np.eye(count) * sigma**2 * 2 / count
            names = [unknown_name(p, station) for p in model.parameters]
            add_priors(survey, names, np.zeros(count), each, f"station {station}")
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
