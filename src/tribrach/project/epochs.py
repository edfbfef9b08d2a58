"""The sections ``[[epochs]]`` of a project: earlier epochs that it is compared with."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, NonNegativeFloat, model_validator

from tribrach.epochs.comparison import Settings
from tribrach.epochs.differences import MOTIONS
from tribrach.project.sections import Section


class EpochSection(Section):
    """An earlier epoch, and how the project is compared with it."""

    #: Files of the earlier epoch: project, epoch file, survey files, result of GNU Gama, SINEX, or
    #: coordinates with covariance matrix.
    against: tuple[str, ...] = Field(min_length=1)
    #: Free, so that control of both epochs is tested like all other points, or control as given.
    datum: Literal["free", "control"] = "free"
    #: Points that are taken as stable until a test says otherwise; control of both epochs, or all
    #: points, if empty.
    references: tuple[str, ...] = ()
    #: Heights, plan or 3D; all that both epochs have if not given.
    coordinates: Literal["heights", "plan", "3D"] | None = None
    free: tuple[str, ...] = ()  #: Further motions of the whole that are taken out, such as scale.
    #: Probability with which a minimal detectable displacement is found.
    power: float = Field(default=0.8, gt=0.05, lt=1)
    posterior: bool = False  #: True for variances and tests a posteriori.
    #: True for one confidence of the tests of all points together, instead of each.
    together: bool = False
    #: Reference points that may have moved; the smaller half if not given.
    most_moved: int | None = Field(default=None, ge=1, le=1000)
    #: Bounds of what may be systematic in a difference, in E and N, and in U.
    systematic_mm: NonNegativeFloat = 0.0
    systematic_up_mm: NonNegativeFloat | None = None

    @model_validator(mode="after")
    def _motions(self) -> Self:
        strange = [m for m in self.free if m not in MOTIONS]
        if strange:
            raise ValueError(f"{strange[0]!r} is no motion: give {', '.join(MOTIONS)}")
        return self

    def settings(self, confidence: float) -> Settings:
        """How epochs are compared, with the confidence of the project."""
        up = self.systematic_mm if self.systematic_up_mm is None else self.systematic_up_mm
        plan = 1e-3 * self.systematic_mm
        return Settings(
            references=self.references,
            confidence=confidence,
            power=self.power,
            posterior=self.posterior,
            together=self.together,
            most=self.most_moved,
            systematic=(plan, plan, 1e-3 * up),
        )
