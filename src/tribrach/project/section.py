"""What all sections of a project file have in common; units stand in the names of the keys."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

__all__ = ["Section"]


class Section(BaseModel):
    """A table of the project file: no other keys than these, and not changed once read."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)
