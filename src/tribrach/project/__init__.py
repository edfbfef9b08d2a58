"""The project file and its Python object: two views of one model."""

from tribrach.project.lever_arm_section import LeverArm
from tribrach.project.model import Project
from tribrach.project.sections import (
    AdjustmentSection,
    DatumSection,
    Instrument,
    ObservationFile,
    OutputSection,
    PointFile,
    ScaleBar,
    SiteSection,
    Station,
    parse_datum,
)

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
