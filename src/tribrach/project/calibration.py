"""The section ``[calibration]`` of a project: which parameters, of what, under which conditions."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import NonNegativeFloat, PositiveFloat, field_validator, model_validator

from tribrach.errors import InputError
from tribrach.instruments.calibration import CalibrationModel, find_model
from tribrach.project.sections import Section

#: components of a station's position [m] and of its turn [rad], with the axis of each
COMPONENTS = {
    "e": (1.0, 0.0, 0.0),
    "n": (0.0, 1.0, 0.0),
    "u": (0.0, 0.0, 1.0),
    "tilt_e": (1.0, 0.0, 0.0),
    "tilt_n": (0.0, 1.0, 0.0),
    "heading": (0.0, 0.0, 1.0),
}


class Hold(Section):
    """A component of a station's orientation that is known, exactly unless it has a sigma."""

    station: str  #: Name of the station.
    #: Of the position (e, n, u), or a turn about these axes (tilt_e, tilt_n, heading).
    component: Literal["e", "n", "u", "tilt_e", "tilt_n", "heading"]
    relative_to: str | None = None  #: Another station, in whose frame the component is meant.
    #: Its value, zero if not given.
    value_m: float | None = None
    value_deg: float | None = None
    #: Its standard deviation.
    sigma_mm: PositiveFloat | None = None
    sigma_arcsec: PositiveFloat | None = None

    @property
    def turns(self) -> bool:
        """True for a turn, False for a component of the position."""
        return self.component not in ("e", "n", "u")

    @model_validator(mode="after")
    def _fitting(self) -> Self:
        """Positions have metres, turns have degrees."""
        if self.relative_to == self.station:
            raise ValueError("a station is not held relative to itself")
        wrong = (self.value_m, self.sigma_mm) if self.turns else (self.value_deg, self.sigma_arcsec)
        if wrong != (None, None):
            units = "value_deg and sigma_arcsec" if self.turns else "value_m and sigma_mm"
            raise ValueError(f"the component {self.component} has {units}")
        return self


class CalibrationSection(Section):
    """Calibration parameters as unknowns."""

    instrument: tuple[str, ...] = ()  #: Whose, a name or several; the only scanner if not given.
    #: Functions of the scanner's errors.
    model: Literal["nist", "high-end", "paper", "paper-elevation", "lichti"] = "high-end"
    #: Those of the model that are estimated; all of them if not given.
    parameters: tuple[str, ...] = ()
    leave_out: tuple[str, ...] = ()  #: Parameters of the model that are not estimated.
    #: Unit lengths of the cyclic range errors of some models.
    unit_lengths_m: tuple[PositiveFloat, ...] = ()
    #: One set for each instrument, or one for each station.
    per: Literal["instrument", "station"] = "instrument"
    #: With a back face (panoramic) or without (hybrid).
    scanner: Literal["panoramic", "hybrid"] = "panoramic"
    #: What is done with unknowns that the observations leave open.
    open: Literal["refuse", "minimum-norm"] = "refuse"
    hold: tuple[Hold, ...] = ()  #: Conditions of orientation.
    limit_t: PositiveFloat = 3.29  #: From which t on a parameter is significant.
    #: From which correlation on two parameters are called near.
    near_correlation: NonNegativeFloat = 0.95

    @field_validator("near_correlation")
    @classmethod
    def _below_one(cls, value: float) -> float:
        if not value < 1:
            raise ValueError("a correlation is below 1")
        return value

    @model_validator(mode="after")
    def _known(self) -> Self:
        """The model has the parameters."""
        try:
            self.columns()
        except InputError as error:
            words = error.what + (f"; {error.cure}" if error.cure else "")
            raise ValueError(words) from error
        return self

    def columns(self) -> CalibrationModel:
        """The model with the parameters that are estimated, each of which it has."""
        model = find_model(self.model, self.parameters, self.unit_lengths_m)
        kept = [p for p in model.parameters if p not in model.select(self.leave_out).parameters]
        if not kept:
            raise InputError("no parameter is left to estimate", cure="leave out fewer")
        return model.select(kept)
