"""In which frame and at which epoch are the coordinates of a file, and how do its marks move?"""

from __future__ import annotations

from typing import Self

import numpy as np
from pydantic import BaseModel, Field, model_validator

from tribrach.errors import InputError
from tribrach.geodesy.epochs import PLATES, Motion, Realisation, crs_is_dynamic

__all__ = ["EpochKeys", "check_reference"]


class EpochKeys(BaseModel):
    """Keys of files whose coordinates may be of another frame or epoch than the project.

    velocity_m_per_year : of the marks in ECEF, or plate : their plate in PROJ's motion model.
    """

    frame: str | None = None
    epoch: float | None = Field(default=None, gt=1900, lt=2200)
    velocity_m_per_year: tuple[float, float, float] | None = None
    plate: str | None = None

    @model_validator(mode="after")
    def _one_motion(self) -> Self:
        """A velocity or a plate, not both; a plate that is known."""
        if self.plate is not None and self.velocity_m_per_year is not None:
            raise ValueError("give either plate or velocity_m_per_year")
        if self.plate is not None and self.plate.upper() not in PLATES:
            raise ValueError(f"plate {self.plate!r} is none of {', '.join(PLATES)}")
        speed = self.velocity_m_per_year
        if speed is not None and not max(abs(v) for v in speed) < 1:
            raise ValueError("a velocity of a metre a year or more is none: it is in m, not mm")
        return self

    @property
    def motion(self) -> Motion | None:
        """How the marks move, None if it is not said."""
        if self.velocity_m_per_year is not None:
            return Motion(velocity=np.array(self.velocity_m_per_year))
        return None if self.plate is None else Motion(plate=self.plate)

    def realisation(self, job: Realisation | None) -> Realisation | None:
        """Frame and epoch of the file; what it leaves out is that of the job.

        Raises
        ------
        InputError : it names a frame or epoch and the job has none.
        """
        if self.frame is None and self.epoch is None:
            return job
        if job is None:
            raise InputError(
                "the file has a frame or an epoch and the site has none",
                cure="add frame and epoch to the section site",
            )
        epoch = job.epoch if self.epoch is None else self.epoch
        return Realisation(self.frame or job.frame, epoch)


def check_reference(crs: str | None, frame: str | None, epoch: float | None) -> None:
    """A dynamic reference system has its epoch.

    Raises
    ------
    ValueError : it has none, or the frame is not known.
    """
    if epoch is None and crs is not None and crs_is_dynamic(crs):
        raise ValueError(
            f"coordinates in {crs} move with time: add the epoch as a decimal year, such as 2026.9"
        )
    if frame is not None:
        try:
            Realisation(frame, epoch)
        except InputError as error:
            raise ValueError(f"{error.what}; {error.cure}") from error
