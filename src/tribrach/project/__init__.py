"""The project file and its Python object: two views of one model."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tribrach.project.datum_section import DatumSection, parse_datum
    from tribrach.project.instrument_section import Instrument
    from tribrach.project.lever_arm_section import LeverArm
    from tribrach.project.model import Project
    from tribrach.project.sections import (
        AdjustmentSection,
        ObservationFile,
        OutputSection,
        PointFile,
        ScaleBar,
        Station,
    )
    from tribrach.project.site_section import SiteSection

__all__ = [
    "AdjustmentSection",
    "DatumSection",
    "Instrument",
    "LeverArm",
    "ObservationFile",
    "OutputSection",
    "PointFile",
    "Project",
    "ScaleBar",
    "SiteSection",
    "Station",
    "parse_datum",
]

_HOMES = {
    "DatumSection": "datum_section",
    "Instrument": "instrument_section",
    "LeverArm": "lever_arm_section",
    "Project": "model",
    "SiteSection": "site_section",
    "parse_datum": "datum_section",
}


def __getattr__(name: str) -> Any:
    """Load the public names when first used: one section does not need the whole project."""
    if name not in __all__:
        raise AttributeError(f"module tribrach.project has no attribute {name}")
    return getattr(import_module(f"tribrach.project.{_HOMES.get(name, 'sections')}"), name)
