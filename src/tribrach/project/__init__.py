"""The project file and its Python object: two views of one model."""

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
