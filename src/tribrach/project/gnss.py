"""The section ``[gnss]``: sessions of receivers whose RINEX files become baselines."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from tribrach.gnss.baseline import Processing
from tribrach.project.sections import Section

Name = Annotated[str, Field(min_length=1)]


class Receiver(Section):
    """A receiver over a point: its observation file, its antenna."""

    point: Name  #: Name of the point.
    file: Name  #: RINEX file of its observations.
    antenna: str | None = None  #: Model of the antenna, that of the file's header if not given.
    #: Height of its reference point over the mark, that of the file's header if not given.
    antenna_height_m: float | None = Field(default=None, ge=-10, lt=100)


class GnssSession(Section):
    """Receivers that observed together; star : the one all baselines start from."""

    name: str = ""
    receivers: tuple[Receiver, ...] = Field(min_length=2)
    navigation: tuple[str, ...] = ()
    star: str | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        points = [receiver.point for receiver in self.receivers]
        twice = {name for name in points if points.count(name) > 1}
        if twice:
            raise ValueError(f"point {sorted(twice)[0]} has two receivers in one session")
        if self.star is not None and self.star not in points:
            raise ValueError(f"star names {self.star}, which has no receiver in the session")
        return self


class GnssSection(Section):
    """How baselines are computed, and from what."""

    sessions: tuple[GnssSession, ...] = ()  #: Receivers that observed together.
    navigation: tuple[str, ...] = ()  #: Broadcast orbits of all sessions, and precise ones (SP3).
    mask_deg: float = Field(default=15.0, ge=0, le=60)  #: Lowest elevation of satellites.
    frequencies: Literal[1, 2, 3] = 2  #: How many are used.
    #: Letters of the satellite systems.
    systems: str = Field(default="GEJC", pattern="^[GRECJSI]+$")
    atmosphere: bool = True  #: False leaves models of troposphere and ionosphere out.
    ratio: float = Field(default=3.0, ge=1)  #: From which ratio on ambiguities are fixed.
    sigma_factor: PositiveFloat | None = None  #: Factor on formal standard deviations.
    antex: str | None = None  #: File of antenna corrections.
    #: The program that computes baselines.
    engine: Literal["auto", "pyrtklib", "rnx2rtkp"] = "auto"
    time_limit_s: PositiveFloat = 600.0  #: Longest time for one run of the engine.
    #: Doubtful baselines are computed in other ways too, and the best is taken.
    alternatives: bool = True
    pieces: bool = True  #: Check sigmas by computing pieces of each session.
    #: Sigmas of each axis in plan and of the height that stay alike within a session; else learned
    #: from baselines of several sessions, or those of a data sheet.
    session_mm: tuple[NonNegativeFloat, NonNegativeFloat] | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        for k, session in enumerate(self.sessions):
            if not session.navigation and not self.navigation:
                raise ValueError(f"session {session.name or k + 1} has no navigation files")
        return self

    def processing(self, folder: Path) -> Processing:
        """The same for the engine; files are relative to the folder."""
        return Processing(
            mask=self.mask_deg,
            frequencies=self.frequencies,
            systems=self.systems,
            atmosphere=self.atmosphere,
            ratio=self.ratio,
            factor=self.sigma_factor,
            antex=None if self.antex is None else folder / self.antex,
            engine=self.engine,
            seconds=self.time_limit_s,
            alternatives=self.alternatives,
            pieces=self.pieces,
            session=None
            if self.session_mm is None
            else (self.session_mm[0] / 1000, self.session_mm[1] / 1000),
        )
