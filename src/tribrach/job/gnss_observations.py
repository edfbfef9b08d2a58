"""From the section ``[gnss]`` and files of GNSS results to observations of a survey."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from tribrach._types import Array, Progress
from tribrach.errors import InputError
from tribrach.geodesy.epochs import Realisation, carry
from tribrach.geodesy.site import EllipsoidSite, Site
from tribrach.gnss.baseline import Processing
from tribrach.gnss.sessions import Occupation, Session, SessionResult, run_sessions
from tribrach.io.gnss.files import GnssContext
from tribrach.network.survey import Survey
from tribrach.observations.gnss import GnssBaselines
from tribrach.project.gnss import GnssSection
from tribrach.project.sections import EpochKeys, ObservationFile
from tribrach.project.site import SiteSection

__all__ = ["add_sessions", "compute_sessions", "gnss_context", "job_realisation", "mover"]


def job_realisation(site: SiteSection) -> Realisation | None:
    """Frame and epoch of the project's coordinates, None if the site names no frame."""
    return None if site.frame is None else Realisation(site.frame, site.epoch)


def mover(keys: EpochKeys, job: Realisation | None) -> Callable[[Array], Array] | None:
    """What takes ECEF (n, 3) of a file to the frame and epoch of the job; None if nothing does.

    Raises
    ------
    InputError
        Another epoch without a velocity or plate, a frame that the site lacks.
    """
    source = keys.realisation(job)
    if source is None or job is None or source == job:
        return None
    motion = keys.motion

    def move(xyz: Array) -> Array:
        return carry(xyz, source, job, motion)[0]

    # what cannot be moved is refused before any file is read
    move(np.array([[6378137.0, 0.0, 0.0]]))
    return move


def gnss_context(
    entry: ObservationFile,
    site: Site,
    job: Realisation | None,
    known: Iterable[str],
    *,
    placed: bool,
) -> GnssContext:
    """Collect what a project says about a file of GNSS results.

    Parameters
    ----------
    entry : ObservationFile
        The entry of the file.
    site : Site
        The work frame.
    job : Realisation or None
        Frame and epoch of the coordinates of the project.
    known : Iterable[str]
        Names of points with coordinates.
    placed : bool
        True if the project has a work frame already.

    Returns
    -------
    GnssContext

    Raises
    ------
    InputError
        The work frame is flat.
    """
    if placed and not isinstance(site, EllipsoidSite):
        raise InputError(
            "geocentric vectors need a place on the ellipsoid, and the site is flat",
            cure="give the site latitude_deg and longitude_deg, a crs, or a frame",
        )
    return GnssContext(
        site=site if placed and isinstance(site, EllipsoidSite) else None,
        job=job,
        frame=entry.frame or "",
        epoch=entry.epoch,
        motion=entry.motion,
        point=entry.point,
        base=entry.base,
        factor=entry.sigma_factor,
        known=frozenset(known),
    )


def compute_sessions(
    section: GnssSection, survey: Survey, folder: Path, progress: Progress
) -> tuple[SessionResult, ...]:
    """Compute the baselines of all sessions, started at the points of a survey.

    Parameters
    ----------
    section : GnssSection
        The sessions and how they are computed.
    survey : Survey
        Gives the coordinates of the first receivers.
    folder : Path
        Folder that the files are relative to.
    progress : Progress
        Told of every baseline.

    Returns
    -------
    tuple of SessionResult

    Raises
    ------
    InputError
        A flat site, and as :func:`~tribrach.gnss.sessions.run_sessions`.
    """
    site = _ellipsoid(survey.site)
    sessions = []
    for k, session in enumerate(section.sessions):
        receivers = tuple(
            Occupation(r.point, folder / r.file, r.antenna, r.antenna_height_m)
            for r in session.receivers
        )
        orbits = tuple(folder / name for name in (*session.navigation, *section.navigation))
        sessions.append(Session(session.name or str(k + 1), receivers, orbits, session.star))
    given = {n: p for n, p in survey.points.items() if np.isfinite(p.xyz).all()}
    surest = sorted(given, key=lambda n: given[n].role not in ("fixed", "control"))
    known = {name: site.to_ecef(given[name].xyz[None])[0] for name in surest}
    processing: Processing = section.processing(folder)
    return run_sessions(sessions, known, processing, progress)


def add_sessions(survey: Survey, results: Iterable[SessionResult]) -> None:
    """Baselines as observations, those of one session with their joint covariance."""
    turn = _ellipsoid(survey.site).w_from_ecef
    for result in results:
        m = len(result.baselines)
        whole = np.kron(np.eye(m), turn)
        covariance = whole @ result.covariance @ whole.T
        source = [f"{b.files[0]}, {b.files[1]}" for b in result.baselines]
        table = survey.add(
            GnssBaselines,
            values=np.array([b.vector for b in result.baselines]) @ turn.T,
            covariance=np.einsum("aiaj->aij", covariance.reshape(m, 3, m, 3)),
            start=[b.names[0] for b in result.baselines],
            end=[b.names[1] for b in result.baselines],
            source=source,
        )
        if m > 1:
            item, row = np.divmod(np.arange(3 * m), 3)
            survey.correlate(np.full(3 * m, table), item, row, covariance, source[0])
        survey.warnings += [
            *result.warnings,
            *dict.fromkeys(text for b in result.baselines for text in b.warnings),
        ]


def _ellipsoid(site: Site) -> EllipsoidSite:
    if not isinstance(site, EllipsoidSite):
        raise InputError(
            "GNSS baselines need a place on the ellipsoid, and the site is flat",
            cure="give the site latitude_deg and longitude_deg, a crs, or a frame",
        )
    return site
