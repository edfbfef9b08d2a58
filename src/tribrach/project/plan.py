"""The section ``[plan]`` of a project: what will be measured, and what is to be proposed."""

from __future__ import annotations

from typing import Literal, Self

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator

from tribrach.epochs.design import sigma_for_displacement
from tribrach.project.sections import Section
from tribrach.simulate.scene import Primitive, box, cylinder, rectangle, sphere

#: reflectance of bodies of a scene, which plans do not use
_GREY = 0.5


class SceneBody(Section):
    """Something that hides targets or carries them.

    A box may be a building, or a room seen from inside.
    """

    #: Box, rectangle, standing cylinder or sphere.
    kind: Literal["box", "rectangle", "cylinder", "sphere"]
    center_m: tuple[float, float, float]  #: Its centre in the work frame.
    #: Width, depth and height of a box, width and height of a rectangle, diameter and height of a
    #: cylinder, diameter of a sphere.
    size_m: tuple[PositiveFloat, ...]
    heading_deg: float = 0.0  #: Turns a box counter-clockwise.
    normal: tuple[float, float, float] | None = None  #: Of a rectangle.

    @model_validator(mode="after")
    def _complete(self) -> Self:
        """Each kind has its sizes."""
        wanted = {"box": 3, "rectangle": 2, "cylinder": 2, "sphere": 1}[self.kind]
        if len(self.size_m) != wanted:
            raise ValueError(f"size_m of a {self.kind} has {wanted} number{'s' * (wanted > 1)}")
        if (self.kind == "rectangle") != (self.normal is not None):
            raise ValueError("a rectangle has a normal, other bodies have none")
        if self.normal is not None and not np.linalg.norm(self.normal) > 0:
            raise ValueError("normal has no length")
        return self

    def primitive(self) -> Primitive:
        """The body in the scene."""
        if self.kind == "box":
            return box(self.center_m, self.size_m, _GREY, float(np.radians(self.heading_deg)))
        if self.kind == "rectangle":
            assert self.normal is not None
            return rectangle(self.center_m, self.normal, self.size_m[0], self.size_m[1], _GREY)
        if self.kind == "cylinder":
            return cylinder(self.center_m, self.size_m[0] / 2, self.size_m[1], _GREY)
        return sphere(self.center_m, self.size_m[0] / 2, _GREY)


class LeverArmPlan(Section):
    """The calibration of a lever arm: which one, and where its targets may stand."""

    name: str  #: Name of the lever arm.
    gnss: str  #: Instrument that measures every target and the antenna.
    #: So many are laid out around the scanner where the project has no points.
    targets: int = Field(default=11, ge=1, le=500)
    #: Part of the horizon around north where they stand.
    window_deg: float = Field(default=360.0, gt=0, le=360)
    #: Level distance of these and of proposed places from the scanner.
    nearest_m: PositiveFloat = 5.0
    farthest_m: PositiveFloat = 15.0
    #: Their height over the scanner.
    lowest_m: float = -1.5
    highest_m: float = 2.5

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        """Near before far, low before high."""
        if self.nearest_m > self.farthest_m:
            raise ValueError("nearest_m is larger than farthest_m")
        if self.lowest_m > self.highest_m:
            raise ValueError("lowest_m is larger than highest_m")
        return self


class PlanSection(Section):
    """A network before it is measured."""

    stations: str | None = None  #: File of coordinates of planned scanner stations.
    targets: tuple[str, ...] = ()  #: Points that they scan, all points of the project if empty.
    observations: tuple[str, ...] = ()  #: Files of planned sights.
    instrument: str | None = None  #: Of planned stations and observations that name none.
    #: Of every planned scan.
    faces: Literal[1, 2] = 1
    sets: PositiveInt = 1
    #: Independent points of one scan on a target; its centre has their mean noise and the whole
    #: systematic part of the angles.
    target_points: PositiveInt = 1
    #: Compensator of planned stations that are not levelled otherwise.
    levelling_arcsec: PositiveFloat | None = None
    #: Limits of scanned targets.
    longest_m: PositiveFloat = 100.0
    steepest_deg: PositiveFloat = Field(default=60.0, le=90)
    scene: tuple[SceneBody, ...] = ()  #: What hides targets.
    #: Files of coordinates where targets and stations could be.
    target_places: str | None = None
    station_places: str | None = None
    #: Places on the surfaces of the scene instead of a file.
    spacing_m: PositiveFloat | None = None
    #: How many are to be proposed.
    add_targets: int = Field(default=0, ge=0, le=50)
    add_stations: int = Field(default=0, ge=0, le=20)
    move_targets: int = Field(default=0, ge=0, le=50)
    drop: bool = False  #: True to name what can be spared.
    keep: tuple[str, ...] = ()  #: Points and stations that stay.
    #: What is judged, and where.
    criterion: Literal["sigma", "redundancy", "undetected", "correlation"] = "sigma"
    points: tuple[str, ...] = ()
    #: Points that are to be determined newly, which the criterion is then about.
    new_points: tuple[str, ...] = ()
    #: The lever arm that the plan is about, instead of points.
    lever_arm: LeverArmPlan | None = None
    #: What is required of the criterion.
    sigma_mm: PositiveFloat | None = None
    redundancy: NonNegativeFloat | None = Field(default=None, lt=1)
    undetected_mm: PositiveFloat | None = None
    correlation: PositiveFloat | None = Field(default=None, lt=1)
    #: Instead of ``sigma_mm``: a displacement between two such epochs to be found with 80 %.
    displacement_mm: PositiveFloat | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        """Check that proposals have places, and that criterion and requirement go together."""
        somewhere = self.target_places or self.spacing_m or self.lever_arm
        if (self.add_targets or self.move_targets) and not somewhere:
            raise ValueError("targets are proposed at target_places, or with spacing_m on a scene")
        if self.spacing_m and not self.scene:
            raise ValueError("spacing_m needs a scene")
        if self.add_stations and not self.station_places:
            raise ValueError("stations are proposed at station_places: name the file")
        if self.displacement_mm is not None:
            if self.criterion != "sigma" or self.lever_arm is not None:
                raise ValueError("displacement_mm is about points and the criterion sigma")
            if self.sigma_mm is not None:
                raise ValueError("give either displacement_mm or sigma_mm")
        if self.lever_arm is None:
            return self
        if self.points or self.new_points:
            raise ValueError("a plan is about points or about lever_arm, not both")
        if self.criterion not in ("sigma", "undetected"):
            raise ValueError(f"the criterion {self.criterion} says nothing about lever_arm")
        return self

    def required(self, axes: int = 3) -> float | None:
        """Required value of the criterion [m, or a number], ``axes`` of a displacement."""
        if self.displacement_mm is not None:
            return sigma_for_displacement(self.displacement_mm * 1e-3, axes)
        return {
            "sigma": None if self.sigma_mm is None else self.sigma_mm * 1e-3,
            "redundancy": self.redundancy,
            "undetected": None if self.undetected_mm is None else self.undetected_mm * 1e-3,
            "correlation": self.correlation,
        }[self.criterion]
