"""The project file and its Python object: two views of one model."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tribrach.project.instrument import Instrument
    from tribrach.project.model import Project
    from tribrach.project.sections import (
        AdjustmentSection,
        DatumSection,
        HeightSection,
        LeverArm,
        ObservationFile,
        OutputSection,
        PointFile,
        ScaleBar,
        StationSection,
        TelescopeSection,
        parse_datum,
    )
    from tribrach.project.site import SiteSection

__all__ = [
    "AdjustmentSection",
    "DatumSection",
    "HeightSection",
    "Instrument",
    "LeverArm",
    "ObservationFile",
    "OutputSection",
    "PointFile",
    "Project",
    "ScaleBar",
    "SiteSection",
    "StationSection",
    "TelescopeSection",
    "parse_datum",
]

_HOMES = {
    "Instrument": "instrument",
    "Project": "model",
    "SiteSection": "site",
}


def __getattr__(name: str) -> Any:
    """Load the public names when first used: one section does not need the whole project."""
    if name not in __all__:
        raise AttributeError(f"module tribrach.project has no attribute {name}")
    return getattr(import_module(f"tribrach.project.{_HOMES.get(name, 'sections')}"), name)
