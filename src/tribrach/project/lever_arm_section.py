"""The sections ``[lever_arms.NAME]`` of a project."""

from __future__ import annotations

from typing import Self

from pydantic import NonNegativeFloat, model_validator

from tribrach.project.section import Section

__all__ = ["LeverArm"]


class LeverArm(Section):
    """An antenna or prism on a scanner, in the scanner frame.

    Either its components with their sigmas (``sigma_mm`` for all, or one for each; a component of
    sigma 0 is held), or the file of a lever arm that another project found. mounting : how well it
    goes back to its place, used where points are mounted on stations.
    """

    file: str | None = None
    x_m: float | None = None
    y_m: float | None = None
    z_m: float | None = None
    sigma_mm: NonNegativeFloat | None = None
    sigma_x_mm: NonNegativeFloat | None = None
    sigma_y_mm: NonNegativeFloat | None = None
    sigma_z_mm: NonNegativeFloat | None = None
    mounting_mm: NonNegativeFloat = 0.1

    @model_validator(mode="after")
    def _complete(self) -> Self:
        """A file, or numbers."""
        numbers = (self.x_m, self.y_m, self.z_m)
        single = (self.sigma_x_mm, self.sigma_y_mm, self.sigma_z_mm)
        given = [v is not None for v in (*numbers, self.sigma_mm, *single)]
        if self.file is not None:
            if any(given):
                raise ValueError("a lever arm has a file or numbers, not both")
            return self
        if any(v is None for v in numbers):
            raise ValueError("a lever arm needs x_m, y_m and z_m, or a file")
        if self.sigma_mm is None and any(v is None for v in single):
            raise ValueError("a lever arm needs sigma_mm, or sigma_x_mm, sigma_y_mm, sigma_z_mm")
        return self
