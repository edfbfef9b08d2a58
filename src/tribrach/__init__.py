"""Tribrach: one least-squares network for scans and survey observations.

>>> import tribrach as tb
>>> report = tb.run("campus.toml")                     # doctest: +SKIP
>>> report.adjustment.stations["S3"].world_from_scanner  # doctest: +SKIP
>>> adjustment = tb.adjust("network.gkf")              # doctest: +SKIP
>>> adjustment.points["B"].xyz                         # doctest: +SKIP

``run`` does everything that a project file asks for and gives its report; ``adjust`` adjusts a
network, a survey, files or a project without scans; ``read`` gives the survey in files and
``open_job`` that of a project, to be looked at or changed first; ``place`` puts an array of points
into the world. ``register``, ``noise``, ``calibrate`` and ``compare`` find what the commands of
these names find. ``cloud_points`` reads points of a delivered cloud with what they share;
``mean_of``, ``relative``, ``plane_distance``, ``area_of``, ``volume_between`` and ``propagate``
compute from them with the sigma that results have.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tribrach.kernel_cache import ensure_cache

if TYPE_CHECKING:
    from tribrach.cloud.placing import place
    from tribrach.cloud.quantities import (
        area_of,
        mean_of,
        plane_distance,
        propagate,
        relative,
        volume_between,
    )
    from tribrach.cloud.shared_part import SharedPart
    from tribrach.io.survey.formats import read
    from tribrach.job.cloud_file import cloud_points
    from tribrach.job.opened import open_job
    from tribrach.network.adjustment import Adjustment
    from tribrach.network.network import Datum, Network
    from tribrach.network.quality import assess
    from tribrach.network.survey import Survey
    from tribrach.pipeline import run
    from tribrach.project import Project
    from tribrach.questions.adjust.adjusted import adjust
    from tribrach.questions.verbs import calibrate, compare, noise, register
    from tribrach.report.content import Report
    from tribrach.transformation.fit import fit_transformation

__version__ = "0.1.0"
__all__ = [
    "Adjustment",
    "Datum",
    "Network",
    "Project",
    "Report",
    "SharedPart",
    "Survey",
    "adjust",
    "area_of",
    "assess",
    "calibrate",
    "cloud_points",
    "compare",
    "fit_transformation",
    "mean_of",
    "noise",
    "open_job",
    "place",
    "plane_distance",
    "propagate",
    "read",
    "register",
    "relative",
    "run",
    "volume_between",
]

_HOMES = {
    "Adjustment": "network.adjustment",
    "Datum": "network.network",
    "Network": "network.network",
    "Project": "project",
    "Report": "report.content",
    "SharedPart": "cloud.shared_part",
    "Survey": "network.survey",
    "adjust": "questions.adjust.adjusted",
    "area_of": "cloud.quantities",
    "assess": "network.quality",
    "calibrate": "questions.verbs",
    "cloud_points": "job.cloud_file",
    "compare": "questions.verbs",
    "fit_transformation": "transformation.fit",
    "mean_of": "cloud.quantities",
    "noise": "questions.verbs",
    "open_job": "job.opened",
    "place": "cloud.placing",
    "plane_distance": "cloud.quantities",
    "propagate": "cloud.quantities",
    "read": "io.survey.formats",
    "register": "questions.verbs",
    "relative": "cloud.quantities",
    "run": "pipeline",
    "volume_between": "cloud.quantities",
}


ensure_cache()


def __getattr__(name: str) -> Any:
    """Load the public names when first used: ``import tribrach`` stays quick."""
    if name not in _HOMES:
        raise AttributeError(f"module tribrach has no attribute {name}")
    from importlib import import_module

    return getattr(import_module(f"tribrach.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    """The public names."""
    return [*__all__, "__version__"]
