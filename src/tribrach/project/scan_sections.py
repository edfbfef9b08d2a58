"""Sections about scans: their files, targets, registration, clouds and comparisons."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, NonNegativeFloat, PositiveFloat, field_validator, model_validator

from tribrach.project.section import Section

__all__ = [
    "CloudSection",
    "ComparisonSection",
    "RegistrationSection",
    "ScanFile",
    "TargetSection",
]


class ScanFile(Section):
    """A file of scans.

    scan : its name in a file with several, all of them if not given; station : where it was taken,
    the name of the scan if not given; origin : says that the scanner is at (0, 0, 0) where the
    format does not, or where it is among placed points, x, y, z [m] of the file; names : targets by
    name, each near x, y, z [m] of the scanner frame; face : that measured the points, for a
    calibration: front, back, in ``dome`` the back where H is above 180 degrees, or as the
    ``order`` of rows and columns tells, which makes two scans of one.
    """

    file: str
    scan: str | None = None
    station: str | None = None
    instrument: str | None = None
    origin: Literal["scanner"] | tuple[float, float, float] | None = None
    names: dict[str, tuple[float, float, float]] = Field(default_factory=dict)
    face: Literal["front", "back", "dome", "order"] = "front"


class TargetSection(Section):
    """Which targets to look for in every scan; without a size none of that kind.

    floor : standard deviation that no centre falls below, in each coordinate.
    """

    sphere_radius_m: tuple[PositiveFloat, ...] = ()
    checkerboard_side_m: tuple[PositiveFloat, ...] = ()
    disc_radius_m: tuple[PositiveFloat, ...] = ()
    floor_mm: NonNegativeFloat = 0.3

    @property
    def wanted(self) -> bool:
        """True if there is anything to look for."""
        return bool(self.sphere_radius_m or self.checkerboard_side_m or self.disc_radius_m)


class RegistrationSection(Section):
    """What ties the stations to each other: any of targets, planes and clouds, all in one network.

    plane_area : planes of a scan smaller than this are not used; plane_floor : standard deviation
    that no plane falls below, for what a fit does not see of a surface; cloud_floor : the same of
    shift and turn between two clouds.
    """

    by: tuple[Literal["targets", "planes", "clouds"], ...] = ("targets",)
    plane_area_m2: PositiveFloat = 0.5
    plane_floor_mm: NonNegativeFloat = 0.3
    cloud_floor_mm: NonNegativeFloat = 1.0
    cloud_floor_arcsec: NonNegativeFloat = 10.0

    @field_validator("by")
    @classmethod
    def _each_once(cls, by: tuple[str, ...]) -> tuple[str, ...]:
        if not by or len(set(by)) != len(by):
            raise ValueError("by names one or more of targets, planes, clouds, each once")
        return by


class CloudSection(Section):
    """How clouds leave, or that none are wanted with ``write = false``.

    frame : ``work``, ``projected`` or ``ecef``, the site's own if not given; correlations and
    incidence add fields; e57 of an E57 source keeps its points byte for byte and gets new poses.
    """

    write: bool = True
    format: Literal["laz", "las", "copc", "ply", "e57"] = "laz"
    frame: Literal["work", "projected", "ecef"] | None = None
    merged: bool = False
    correlations: bool = False
    incidence: bool = False
    epoch: float | None = Field(default=None, gt=1900, lt=2200)


class ComparisonSection(Section):
    """Two scans, or the scans of two stations, against each other on test sites.

    b is the reference; sites : CSV file of balls or boxes in the frame of the clouds, chosen from
    the scans if not given; limit : longest distance that is compared.
    """

    a: str
    b: str
    sites: str | None = None
    limit_mm: PositiveFloat = 200.0
    method: Literal["c2c", "m3c2", "both"] = "both"

    @model_validator(mode="after")
    def _two(self) -> Self:
        if self.a == self.b:
            raise ValueError(f"{self.a} is compared with itself; name two scans or stations")
        return self
