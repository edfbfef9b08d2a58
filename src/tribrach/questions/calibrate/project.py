"""A calibration project: observations from files and scans, the calibrations, their files."""

from __future__ import annotations

import datetime
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Progress
from tribrach.calibration.self_calibration import CalibrationOptions, SelfCalibration, calibrate
from tribrach.errors import InputError
from tribrach.instruments.calibration import NIST
from tribrach.io.calibration_file import Calibration
from tribrach.job.steps import find_and_name
from tribrach.network.network import Datum, Network

if TYPE_CHECKING:
    from tribrach.job.opened import Job
    from tribrach.project import Project
    from tribrach.project.calibration import CalibrationSection


def calibration_of(project: Project) -> CalibrationSection:
    """Give the section of a project that says what is calibrated, before any file is read."""
    if project.calibration is None:
        raise project.error(
            (), "the project has no section calibration", "add [calibration] with a model"
        )
    return project.calibration


def calibrate_project(job: Job, progress: Progress, *, reduce: bool = False) -> SelfCalibration:
    """Calibrate the scanners of a job.

    Without control and without a datum of its own the project has inner constraints.
    """
    project, section = job.project, calibration_of(job.project)
    work = find_and_name(job, project.results, progress) if project.scans else None
    further = None if work is None else work.registered.survey
    progress("calibration", 0, None)
    options = CalibrationOptions(
        near=section.near_correlation,
        limit_t=section.limit_t,
        posterior=project.adjustment.posterior,
        minimum_norm=section.open == "minimum-norm",
        reduce=reduce,
        back=section.scanner == "panoramic",
        snoop=project.adjustment.snoop,
    )
    network = job.network(further, final=True)
    if "datum" not in project.model_fields_set and not _has_control(network):
        network = network.with_datum(Datum("free"))
    return calibrate(network, options, [NIST])


def _has_control(network: Network) -> bool:
    """True if any coordinate is given as control or held."""
    points = network.free[: 3 * network.start.layout.count("point")]
    return not points.all() or any(o.group == "control" for o in network.observations)


def calibrations_of(job: Job, calibration: SelfCalibration) -> dict[str, Calibration]:
    """The calibrations as they go into files, by instrument."""
    project, section = job.project, job.project.calibration
    names = job.calibrations.sought
    assert section is not None
    if section.per == "station":
        raise InputError(
            "parameters of single stations hold for these set-ups only and are not saved",
            cure='say per = "instrument"',
        )
    if section.open == "minimum-norm":
        raise InputError(
            "a minimum-norm solution is no calibration and is not saved",
            cure='say open = "refuse" and leave out what cannot be separated',
        )
    return {name: _calibration(project, section, calibration, name) for name in names}


def _calibration(
    project: Project, section: CalibrationSection, calibration: SelfCalibration, instrument: str
) -> Calibration:
    """Estimated calibration of one instrument."""
    own = [k for k, p in enumerate(calibration.parameters) if p.owner == instrument]
    if not own:
        raise InputError(
            f"no parameter of {instrument} was estimated",
            cure="give observations from its stations, or do not name it in [calibration]",
        )
    a = calibration.adjustment
    return Calibration(
        instrument=instrument,
        serial=project.instruments[instrument].serial,
        model=section.model,
        parameters=tuple(calibration.parameters[k].plain for k in own),
        values=np.array([calibration.parameters[k].value for k in own]),
        covariance=calibration.covariance[np.ix_(own, own)],
        unit_lengths=tuple(section.unit_lengths_m),
        architecture=section.scanner,
        date=datetime.date.today(),
        datum=calibration.datum,
        sigma_origin=calibration.sigma_origin,
        observations=a.n_observations,
        redundancy=a.dof,
    )
