"""The sections ``[instruments.NAME]`` of a project."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any, Literal, Self

import numpy as np
from pydantic import (
    Field,
    ModelWrapValidatorHandler,
    NonNegativeFloat,
    PositiveFloat,
    PrivateAttr,
    field_validator,
    model_validator,
)

from tribrach.errors import InputError
from tribrach.instruments.common_errors import CommonErrors
from tribrach.instruments.precision import CentringPer, Precision
from tribrach.instruments.range_law import RangeLaw
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.instrument_sheets import Figure, find_sheet
from tribrach.project.sections import Section
from tribrach.units import MM, SEC

#: where a figure of an instrument stands
Origin = Literal["project", "file", "sheet"]


#: keys of an angle: one reading in one face, and the mean of both faces
_FACES = {
    "direction_arcsec": "direction_both_faces_arcsec",
    "zenith_arcsec": "zenith_both_faces_arcsec",
}
_OTHER = _FACES | {both: one for one, both in _FACES.items()}
#: keys of the law of the noise of ranges, all of them or none
_LAW = (
    "range_law_a_mm",
    "range_law_b",
    "range_law_c_mm",
    "range_law_from",
    "range_law_to",
)


class Instrument(Section):
    """Standard deviations of an instrument as it is set up, used where a file gives none."""

    sheet: str | None = None  #: A model whose data sheet gives all figures that are not given here.
    #: An instrument file (:mod:`tribrach.project.instrument_file`); it goes before the sheet.
    file: str | None = None
    serial: str = ""  #: Serial number.
    #: A calibration file, whose parameters correct what the scanner measures.
    calibration: str | None = None
    #: Of one reading in one face.
    direction_arcsec: PositiveFloat | None = None
    zenith_arcsec: PositiveFloat | None = None
    #: Of the mean of both faces, as data sheets by ISO 17123-3 or DIN 18723 state it.
    direction_both_faces_arcsec: PositiveFloat | None = None
    zenith_both_faces_arcsec: PositiveFloat | None = None
    #: Of a distance, added linearly.
    distance_mm: PositiveFloat | None = None
    distance_ppm: NonNegativeFloat = 0.0
    centring_mm: NonNegativeFloat = 0.0  #: Of either end of a sight.
    #: What shares one error of centring and height: ``setup`` (tripods: each set-up, and each
    #: target seen from it), ``mark`` (forced centring) or ``sight``.
    centring_per: CentringPer = "setup"
    height_mm: NonNegativeFloat = 0.0  #: Of either end of a sight.
    levelling_mm_per_sqrt_km: PositiveFloat | None = None  #: Of height differences.
    #: Of a single point of a scanner: the noise that is new with every point.
    range_mm: PositiveFloat | None = None
    range_ppm: NonNegativeFloat = 0.0
    #: Of the scale of a scanner's ranges, one for all its points and stations.
    range_scale_common_ppm: NonNegativeFloat = 0.0
    #: Of the zero of a scanner's ranges, one for all its points and stations.
    range_zero_common_mm: NonNegativeFloat = 0.0
    #: Of the coefficient of refraction: for each station of a scanner (default none), for each
    #: set-up of a total station with sights longer than 150 m (default 0.1).
    refraction_sigma: NonNegativeFloat | None = None
    #: Of a scanner's light [micrometres].
    wavelength_um: float = Field(default=0.658, ge=0.4, le=1.7)
    #: The air that a scanner computes its ranges for.
    reference_temperature_c: float = 12.0
    reference_pressure_hpa: PositiveFloat = 1013.25
    reference_humidity_percent: float = Field(default=60.0, ge=0, le=100)
    #: Of a single point of a scanner: the noise that is new with every point.
    scan_angle_arcsec: PositiveFloat | None = None
    #: Of both angles of a scanner as makers state it: noise, and a systematic part that
    #: neighbouring points share.
    scan_angle_accuracy_arcsec: PositiveFloat | None = None
    #: Noise of ranges by the intensity I, ``a I^b + c``, instead of range_mm and range_ppm for
    #: points with an intensity.
    range_law_a_mm: NonNegativeFloat | None = None
    range_law_b: float | None = None
    range_law_c_mm: NonNegativeFloat | None = None
    #: Intensities, in the unit of the scans, from which this law was estimated.
    range_law_from: PositiveFloat | None = None
    range_law_to: PositiveFloat | None = None
    #: Growing intensities and factors on this law there, linear in the logarithm of the intensity.
    range_law_at: tuple[PositiveFloat, ...] = ()
    range_law_times: tuple[PositiveFloat, ...] = ()
    #: With ``incidence = true`` range_mm and range_ppm are divided by this power of the cosine of
    #: the incidence.
    range_incidence: float = Field(default=1.0, ge=0, le=2)
    #: Diameter of the beam at the exit and full angle, which give its footprint.
    beam_exit_mm: NonNegativeFloat = 0.0
    beam_divergence_mrad: NonNegativeFloat = 0.0
    #: How it widens: as a beam with its ``waist`` at the exit, or as a ``cone``.
    beam_shape: Literal["waist", "cone"] = "waist"
    #: Share of the range variance that neighbouring points have in common (default: all where beams
    #: overlap), and over which angle (0: width of the beam).
    shared_share: float | None = Field(default=None, ge=0, le=1)
    shared_angle_mrad: NonNegativeFloat = 0.0
    target_floor_mm: NonNegativeFloat = 0.0  #: Added to target centres.
    levelling_arcsec: PositiveFloat | None = None  #: Of the compensator.
    magnification: PositiveFloat | None = None  #: Of the telescope.
    compass_deg: PositiveFloat | None = None  #: Of a heading of the compass.
    #: Of what all its headings share: declination and mounting, one unknown of the compass.
    compass_common_deg: NonNegativeFloat = 0.0
    #: Of GNSS positions.
    gnss_plan_mm: PositiveFloat | None = None
    gnss_up_mm: PositiveFloat | None = None
    #: Share of their variance that one session has in common.
    gnss_common_share: float = Field(default=0.5, ge=0, lt=1)
    #: Of targets on rods.
    rod_mm: PositiveFloat | None = None
    bubble_arcmin: NonNegativeFloat | None = None
    eccentricity_mm: NonNegativeFloat = 0.0
    refraction: float = 0.13  #: Coefficient of refraction.
    source: str = ""  #: Where these figures come from.
    #: keys that stand in the section itself
    _typed: frozenset[str] = PrivateAttr(default=frozenset())
    #: figures of the instrument file, None before it is read
    _borrowed: dict[str, Figure] | None = PrivateAttr(default=None)
    #: keys of the instrument file that other figures of the section go before
    _shadowed: tuple[str, ...] = PrivateAttr(default=())

    @field_validator("sheet")
    @classmethod
    def _known(cls, name: str | None) -> str | None:
        try:
            return None if name is None else find_sheet(name).name
        except InputError as error:
            raise ValueError(f"{error.what}; {error.cure}") from error

    @model_validator(mode="wrap")
    @classmethod
    def _from_sheet(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """What is not given comes from the sheet; an angle is given by either of its keys."""
        if not isinstance(data, dict):
            return handler(data)
        known = {}
        if isinstance(data.get("sheet"), str):
            with suppress(InputError):
                known = find_sheet(data["sheet"]).values
        instrument = handler(_without(known, data) | data)
        instrument._typed = frozenset(data)
        return instrument

    @model_validator(mode="after")
    def _one_key_for_each_angle(self) -> Self:
        """One reading, or the mean of both faces."""
        for one, both in _FACES.items():
            if getattr(self, one) is not None and getattr(self, both) is not None:
                raise ValueError(
                    f"{one} is one reading in one face and {both} the mean of both: "
                    "give one of them"
                )
        return self

    @model_validator(mode="after")
    def _whole_law(self) -> Self:
        """All figures of the law of the noise, or none of them, and such as a law can have."""
        missing = [key for key in _LAW if getattr(self, key) is None]
        if self.file is not None and missing:
            return self  # the file may have them
        if 0 < len(missing) < len(_LAW):
            raise ValueError(f"a law of the noise of ranges has {', '.join(missing)} as well")
        try:
            self._law()
        except InputError as error:
            raise ValueError(f"{error.what}; {error.cure}") from error
        return self

    @property
    def file_is_read(self) -> bool:
        """True if the figures of the instrument file are among these, or there is none."""
        return self.file is None or self._borrowed is not None

    def with_file(self, given: Mapping[str, Any], source: str) -> Self:
        """Fill in what an instrument file gives: before the sheet, after what is typed here.

        ``source``: where its figures come from.
        """
        typed = {key: getattr(self, key) for key in self._typed}
        borrowed = {k: v for k, v in _without(given, typed).items() if k != "source"}
        whole = {key: value for key, value in (borrowed | typed).items() if key != "file"}
        filled = type(self).model_validate(whole).model_copy(update={"file": self.file})
        filled._typed = self._typed
        filled._shadowed = tuple(
            key
            for key, value in given.items()
            if key not in borrowed and key != "source" and typed.get(key) != value
        )
        filled._borrowed = {
            key: Figure(key, float(value), source)
            for key, value in borrowed.items()
            if isinstance(value, int | float)
        }
        return filled

    def stated_by(self, key: str) -> Origin:
        """Where the figure of a key stands: in the project itself, its file or the sheet."""
        if key in (self._borrowed or {}):
            return "file"
        return "project" if key in self._typed or self.sheet is None else "sheet"

    @property
    def shadowed(self) -> tuple[str, ...]:
        """Keys of the instrument file that do not count, as other figures are typed here."""
        return self._shadowed

    def figures(self) -> list[Figure]:
        """Every figure that is given, with its source: file, sheet or the project's own words."""
        sheet = None if self.sheet is None else find_sheet(self.sheet)
        out = []
        for key in type(self).model_fields:
            value = getattr(self, key)
            if key not in self.model_fields_set or not isinstance(value, int | float):
                continue
            listed = None if sheet is None else sheet.figure(key)
            if key in (self._borrowed or {}):
                out.append((self._borrowed or {})[key])
            elif listed is not None and listed.value == value:
                out.append(listed)
            else:
                out.append(Figure(key, float(value), self.source or "project file"))
        return out

    def _one_face(self, key: str) -> float | None:
        """An angle of one reading in one face [rad], from whichever key it is given by."""
        one, both = getattr(self, key), getattr(self, _FACES[key])
        if one is not None:
            return float(one * SEC)
        return None if both is None else float(np.sqrt(2) * both * SEC)

    def _systematic_angle(self) -> float:
        """What the angles of a scanner have beyond their noise [rad]."""
        noise, accuracy = self.scan_angle_arcsec, self.scan_angle_accuracy_arcsec
        if noise is None or accuracy is None:
            return 0.0
        return float(np.sqrt(max(accuracy**2 - noise**2, 0.0)) * SEC)

    def precision(self) -> Precision:
        """The same in metres and radians."""

        def scaled(value: float | None, unit: float) -> float | None:
            return None if value is None else value * unit

        return Precision(
            direction=self._one_face("direction_arcsec"),
            zenith=self._one_face("zenith_arcsec"),
            distance=scaled(self.distance_mm, MM),
            scale=self.distance_ppm * 1e-6,
            centring=self.centring_mm * MM,
            centring_per=self.centring_per,
            height=self.height_mm * MM,
            levelling=scaled(self.levelling_mm_per_sqrt_km, MM),
            range=scaled(self.range_mm, MM),
            range_scale=self.range_ppm * 1e-6,
            scan_angle=scaled(self.scan_angle_arcsec, SEC),
            scan_angle_systematic=self._systematic_angle(),
            target=self.target_floor_mm * MM,
            tilt=scaled(self.levelling_arcsec, SEC),
            compass=scaled(self.compass_deg, np.pi / 180),
            compass_common=float(np.radians(self.compass_common_deg)),
            gnss_plan=scaled(self.gnss_plan_mm, MM),
            gnss_up=scaled(self.gnss_up_mm, MM),
            gnss_common=self.gnss_common_share,
            rod=scaled(self.rod_mm, MM),
            bubble=scaled(self.bubble_arcmin, 60 * SEC),
            eccentricity=self.eccentricity_mm * MM,
            refraction=self.refraction,
            refraction_sigma=0.1 if self.refraction_sigma is None else self.refraction_sigma,
        )

    def noise(self) -> ScanNoise | None:
        """Noise of single points in metres and radians; None if range or angle are not given."""
        if self.range_mm is None or self.scan_angle_arcsec is None:
            return None
        angle = self.scan_angle_arcsec * SEC
        return ScanNoise(
            self.range_mm * MM,
            self.range_ppm * 1e-6,
            angle,
            angle,
            self.beam_exit_mm * MM,
            self.beam_divergence_mrad * 1e-3,
            self._systematic_angle(),
            self.beam_shape == "cone",
            self._law(),
            self.shared_share,
            self.shared_angle_mrad * 1e-3,
            self.range_incidence,
        )

    def common(self, name: str) -> CommonErrors | None:
        """What all points of a station have in common, None where nothing is given."""
        bend = self.refraction_sigma or 0.0
        zero = self.range_zero_common_mm * MM
        if not (self.range_scale_common_ppm or bend or zero):
            return None
        return CommonErrors(name, self.range_scale_common_ppm * 1e-6, bend, zero)

    def _law(self) -> RangeLaw | None:
        """The law of the noise of ranges, None without one."""
        a, b, c, low, high = (getattr(self, key) for key in _LAW)
        if None in (a, b, c, low, high):
            return None
        return RangeLaw(a * MM, b, c * MM, low, high, self.range_law_at, self.range_law_times)


def _without(figures: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Figures that are not given, under their own key or the other one of the same angle."""
    return {k: v for k, v in figures.items() if k not in given and _OTHER.get(k) not in given}


def noise_of(model: str | None) -> ScanNoise | None:
    """Noise of single points of a model with a data sheet, None without a model."""
    if model is None:
        return None
    sheet = find_sheet(model)
    noise = Instrument(sheet=sheet.name).noise()
    if noise is None:
        raise InputError(
            f"the data sheet of {sheet.name} has no noise of scanned points",
            cure="name the model of a scanner",
        )
    return noise
