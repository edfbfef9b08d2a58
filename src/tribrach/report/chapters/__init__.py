"""The chapters of a report: one file each, and the order in which a report has them.

A new chapter is a file that declares a ``SUBJECT``, and its name in :data:`SUBJECTS`.
"""

from tribrach.report.chapters import (
    adjustment,
    comparisons,
    control,
    georeferencing,
    gnss,
    instruments,
    lever_arms,
    observations,
    observed_noise,
    points,
    reductions,
    registration,
    rigid_model,
    scans,
    side_shots,
    stations,
    unknowns,
)

__all__ = ["SUBJECTS"]

#: in the order of the report
SUBJECTS = tuple(
    chapter.SUBJECT
    for chapter in (
        scans,
        comparisons,
        reductions,
        gnss,
        georeferencing,
        registration,
        lever_arms,
        rigid_model,
        adjustment,
        control,
        observations,
        stations,
        points,
        side_shots,
        unknowns,
        instruments,
        observed_noise,
    )
)
