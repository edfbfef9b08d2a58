"""The sections ``[telescopes.NAME]``: what is known of the axes of telescopes."""

from __future__ import annotations

from tribrach.io.survey.csv.turning import telescope_unknowns
from tribrach.network.survey import Survey
from tribrach.observations.control import ScalarPriors
from tribrach.observations.telescopes import TelescopeTargets
from tribrach.project import Project
from tribrach.project.sections import TelescopeSection
from tribrach.units import MM, SEC


def add_telescopes(project: Project, survey: Survey, *, whole: bool) -> None:
    """Add what a project knows of the axes of its telescopes to a survey."""
    observed = survey.named(TelescopeTargets, "reference")
    for name, section in project.telescopes.items():
        if name not in observed:
            if not whole:
                continue
            raise project.error(
                ("telescopes", name),
                f"no target stands on the telescope {name}",
                "correct its name, or add a table of its targets",
            )
        unknowns = telescope_unknowns(name)
        for field, value, sigma in _known(section):
            if value is None:
                continue
            scalar = unknowns[field]
            survey.scalars[scalar] = (value, sigma != 0)
            if sigma:
                survey.add(
                    ScalarPriors,
                    values=[value],
                    sigma=[sigma],
                    scalar=[scalar],
                    source=[f"telescope {name}"],
                    group="axes of telescopes",
                )


def _known(section: TelescopeSection) -> tuple[tuple[str, float | None, float | None], ...]:
    """Field, value and sigma of each unknown of the axes, in metres and radians."""

    def scaled(value: float | None, unit: float) -> float | None:
        return None if value is None else value * unit

    tilt = scaled(section.sigma_tilt_arcsec, SEC)
    skew = section.non_orthogonality_arcsec, section.sigma_non_orthogonality_arcsec
    return (
        ("axis_offset", section.offset_m, scaled(section.sigma_offset_mm, MM)),
        ("axis_skew", scaled(skew[0], SEC), scaled(skew[1], SEC)),
        ("tilt_east", scaled(section.tilt_east_arcsec, SEC), tilt),
        ("tilt_north", scaled(section.tilt_north_arcsec, SEC), tilt),
    )
