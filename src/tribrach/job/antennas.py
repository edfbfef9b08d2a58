"""Stations that carry antennas or prisms: what the report says of lever arms and rigid placing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from tribrach.errors import AdjustmentError
from tribrach.job.antenna_lever_arms import lever_arm_chapter, lever_arm_files, lever_arms
from tribrach.job.rigid_placing import place_rigidly, rigid_chapter
from tribrach.network.adjustment import Adjustment
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.observations.gnss import Antennas
from tribrach.registration.rigid_model import TooFewPlaces
from tribrach.report.content import Content

__all__ = ["add_antennas", "height_sentences"]

_KINDS = ("antenna", "mounted_point")


#: an error so many times larger in height than in plan looks like a wrong antenna height
_UPRIGHT = 3.0


def height_sentences(adjustment: Adjustment) -> list[str]:
    """Antennas that are switched off and stand too high or too low, in words."""
    out = []
    for o in adjustment.network.observations:
        if not isinstance(o, Antennas):
            continue
        gap, names = o.misclosure(adjustment.state), adjustment.layout.names["pose"]
        for k in np.flatnonzero(o.use == Use.OFF):
            plan, up = float(np.hypot(gap[k, 0], gap[k, 1])), float(gap[k, 2])
            if abs(up) > _UPRIGHT * max(plan, float(o.sigma[k, 2])):
                side = "above" if up > 0 else "below"
                out.append(
                    f"The antenna on {names[o.station[k]]}, which is switched off, was measured "
                    f"{1e3 * abs(up):.0f} mm {side} where all the rest puts it, and only "
                    f"{1e3 * plan:.0f} mm beside: look at its height."
                )
    return out


def add_antennas(
    content: Content, survey: Survey, adjustment: Adjustment, folder: Path
) -> tuple[Content, Mapping[Path, str]]:
    """The content with chapters on antennas, and lever arm files by their paths.

    Nothing is added where no station carries one.
    """
    if not any(o.kind in _KINDS and len(o) for o in adjustment.network.observations):
        return content, {}
    factor = adjustment.variance_factor(posterior=content.settings.posterior)
    angle, origin = content.settings.angle, content.sigma_origin
    chapters, files = list(content.chapters), {}
    warnings = [*content.warnings, *height_sentences(adjustment)]
    found = lever_arms(adjustment, factor)
    if found:
        chapters.append(lever_arm_chapter(found, angle, origin))
        files = lever_arm_files(found, folder, content.datum.sentence, origin)
    try:
        chapters.append(rigid_chapter(place_rigidly(survey, adjustment), adjustment, angle))
    except TooFewPlaces:
        pass  # a single scan, say: there is nothing to compare with
    except AdjustmentError as error:
        warnings.append(f"The stations make no rigid model by themselves: {error.headline}.")
    return replace(content, chapters=tuple(chapters), warnings=tuple(warnings)), files
