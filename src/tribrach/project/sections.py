"""Sections about what was measured, what is done with it and where it goes.

Sections with a subject of their own have a file each beside this one.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from tribrach.project.epoch_keys import EpochKeys
from tribrach.project.section import Section

__all__ = [
    "AdjustmentSection",
    "Backsight",
    "ObservationFile",
    "OutputSection",
    "PointFile",
    "ScaleBar",
    "Station",
]


class PointFile(EpochKeys, Section):
    """A CSV file of coordinates and what they are for, unless its column ``role`` says it."""

    file: str
    role: Literal["control", "fixed", "approximate", "check"] = "control"


class ObservationFile(EpochKeys, Section):
    """A file of observations, or ``files`` that belong together; format if the suffix misleads.

    point, base : marks of a solution of RTKLIB, which has no names; sigma_factor on its formal
    standard deviations.
    """

    file: str | None = None
    files: tuple[str, ...] = ()
    format: (
        Literal["csv", "gama", "dynaml", "dna", "comp3d", "riscan", "totalstation", "gnss"] | None
    ) = None
    instrument: str | None = None
    point: str = ""
    base: str = ""
    sigma_factor: PositiveFloat | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if (self.file is None) == (not self.files):
            raise ValueError("give either file or files")
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """The files as typed."""
        return self.files if self.file is None else (self.file,)


class Backsight(Section):
    """A sight of the scanner's telescope: its horizontal angle, counter-clockwise from its x axis.

    sigma of one pointing is 60" over the instrument's magnification unless given here.
    """

    to: str
    horizontal_deg: float = Field(ge=-360, le=360)
    height_target_m: float = 0.0
    pointings: int = Field(default=1, ge=1)
    sigma_arcsec: PositiveFloat | None = None


class Station(Section):
    """A scanner station: levelled by its compensator or not, and the antenna on it.

    occupies : the mark that it stands over, its centre height_m above it; backsights : sights of
    its telescope.
    mounted_point : name of the antenna or prism in observations that are made to it and not to the
    station.
    The sigma of the compensator is the instrument's levelling_arcsec unless given here.
    """

    levelled: bool = False
    levelling_arcsec: PositiveFloat | None = None
    instrument: str | None = None
    lever_arm: str | None = None
    mounted_point: str | None = None
    occupies: str | None = None
    height_m: float = 0.0
    backsights: tuple[Backsight, ...] = ()


class ScaleBar(Section):
    """A known length between two points or stations, held exactly with ``sigma_mm = 0``."""

    start: str = Field(alias="from")
    end: str = Field(alias="to")
    length_m: PositiveFloat
    sigma_mm: NonNegativeFloat


class AdjustmentSection(Section):
    """What is done besides adjusting.

    heights : of GNSS marks, weighed by the network or by a recipe to compare with it, which keeps
    that of height_mark and takes the others from the levelled scan of height_station.
    """

    snoop: bool = False
    robust: Literal["none", "huber", "danish", "igg3"] = "none"
    vce: bool = False
    posterior: bool = False
    heights: Literal["network", "recipe"] = "network"
    height_mark: str | None = None
    height_station: str | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.heights == "network" and (self.height_mark or self.height_station):
            raise ValueError('height_mark and height_station need heights = "recipe"')
        return self


class OutputSection(Section):
    """Folder of the results inside the project's, and how angles are written."""

    folder: Annotated[str, Field(min_length=1)] = "out"
    angle: Literal["gon", "deg"] = "gon"
