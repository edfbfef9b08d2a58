"""The sections ``[instruments.NAME]`` of a project."""

from __future__ import annotations

from typing import Any

from pydantic import Field, NonNegativeFloat, PositiveFloat, field_validator, model_validator

from tribrach.errors import InputError
from tribrach.instruments.precision import Precision
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.instrument_sheets import Figure, find_sheet
from tribrach.project.sections import Section
from tribrach.units import MM, SEC

__all__ = ["Instrument"]


class Instrument(Section):
    """Standard deviations of an instrument as it is set up, used where a file gives none.

    Attributes
    ----------
    sheet
        A model whose data sheet gives all figures that are not given here.
    serial
        Serial number.
    calibration
        A calibration file, whose parameters correct what the scanner measures.
    direction_arcsec, zenith_arcsec
        Of one reading.
    distance_mm, distance_ppm
        Of a distance, added linearly.
    centring_mm, height_mm
        Of either end of a sight.
    levelling_mm_per_sqrt_km
        Of height differences.
    range_mm, range_ppm, scan_angle_arcsec
        Of a single point of a scanner.
    beam_exit_mm, beam_divergence_mrad
        Diameter of the beam at the exit and full angle, which give its footprint.
    target_floor_mm
        Added to target centres.
    levelling_arcsec
        Of the compensator.
    magnification
        Of the telescope.
    gnss_plan_mm, gnss_up_mm
        Of GNSS positions.
    gnss_common_share
        Share of their variance that one session has in common.
    rod_mm, bubble_arcmin, eccentricity_mm
        Of targets on rods.
    refraction
        Coefficient of refraction.
    source
        Where these figures come from.
    """

    sheet: str | None = None
    serial: str = ""
    calibration: str | None = None
    direction_arcsec: PositiveFloat | None = None
    zenith_arcsec: PositiveFloat | None = None
    distance_mm: PositiveFloat | None = None
    distance_ppm: NonNegativeFloat = 0.0
    centring_mm: NonNegativeFloat = 0.0
    height_mm: NonNegativeFloat = 0.0
    levelling_mm_per_sqrt_km: PositiveFloat | None = None
    range_mm: PositiveFloat | None = None
    range_ppm: NonNegativeFloat = 0.0
    scan_angle_arcsec: PositiveFloat | None = None
    beam_exit_mm: NonNegativeFloat = 0.0
    beam_divergence_mrad: NonNegativeFloat = 0.0
    target_floor_mm: NonNegativeFloat = 0.0
    levelling_arcsec: PositiveFloat | None = None
    magnification: PositiveFloat | None = None
    gnss_plan_mm: PositiveFloat | None = None
    gnss_up_mm: PositiveFloat | None = None
    gnss_common_share: float = Field(default=0.5, ge=0, lt=1)
    rod_mm: PositiveFloat | None = None
    bubble_arcmin: NonNegativeFloat | None = None
    eccentricity_mm: NonNegativeFloat = 0.0
    refraction: float = 0.13
    source: str = ""

    @field_validator("sheet")
    @classmethod
    def _known(cls, name: str | None) -> str | None:
        try:
            return None if name is None else find_sheet(name).name
        except InputError as error:
            raise ValueError(f"{error.what}; {error.cure}") from error

    @model_validator(mode="before")
    @classmethod
    def _from_sheet(cls, data: Any) -> Any:
        """What is not given comes from the sheet."""
        if not isinstance(data, dict) or not isinstance(data.get("sheet"), str):
            return data
        try:
            return find_sheet(data["sheet"]).values | data
        except InputError:
            return data

    def figures(self) -> list[Figure]:
        """Every figure that is given, with its source: the sheet's, or the project's own words."""
        sheet = None if self.sheet is None else find_sheet(self.sheet)
        known = {} if sheet is None else sheet.values
        out = []
        for key in type(self).model_fields:
            value = getattr(self, key)
            if key not in self.model_fields_set or not isinstance(value, int | float):
                continue
            same = sheet is not None and known.get(key) == value
            own = self.source or "project file"
            out.append(Figure(key, float(value), sheet.source(key) if sheet and same else own))
        return out

    def precision(self) -> Precision:
        """The same in metres and radians."""

        def scaled(value: float | None, unit: float) -> float | None:
            return None if value is None else value * unit

        return Precision(
            direction=scaled(self.direction_arcsec, SEC),
            zenith=scaled(self.zenith_arcsec, SEC),
            distance=scaled(self.distance_mm, MM),
            scale=self.distance_ppm * 1e-6,
            centring=self.centring_mm * MM,
            height=self.height_mm * MM,
            levelling=scaled(self.levelling_mm_per_sqrt_km, MM),
            range=scaled(self.range_mm, MM),
            range_scale=self.range_ppm * 1e-6,
            scan_angle=scaled(self.scan_angle_arcsec, SEC),
            target=self.target_floor_mm * MM,
            tilt=scaled(self.levelling_arcsec, SEC),
            gnss_plan=scaled(self.gnss_plan_mm, MM),
            gnss_up=scaled(self.gnss_up_mm, MM),
            gnss_common=self.gnss_common_share,
            rod=scaled(self.rod_mm, MM),
            bubble=scaled(self.bubble_arcmin, 60 * SEC),
            eccentricity=self.eccentricity_mm * MM,
            refraction=self.refraction,
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
        )
