"""From the section ``[gnss]`` and files of GNSS results to observations of a survey."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from tribrach._types import Array, Progress
from tribrach.errors import InputError
from tribrach.geodesy import frames
from tribrach.geodesy.epochs import Passage, Realisation
from tribrach.geodesy.grid_datum import GridDatum
from tribrach.geodesy.site import EllipsoidSite, Site, ecef_from_geodetic
from tribrach.gnss.baseline import Processing
from tribrach.gnss.sessions import Occupation, ReceiverSession, SessionResult, run_sessions
from tribrach.io.gnss.files import GnssContext
from tribrach.network.facts import FrameChange
from tribrach.network.survey import Survey
from tribrach.observations.gnss import GnssBaselines
from tribrach.project.gnss import GnssSection
from tribrach.project.sections import EpochKeys, ObservationFile
from tribrach.project.site import SiteSection

#: frames closer than this [m] are one
SAME_FRAME = 1e-3
#: the frame of orbits, and with them of what RTKLIB computes
_ORBITS = "ITRF2014"
#: epoch where none is given [decimal year]
_TODAY = 2020.0
_YEAR = 365.25 * 86400


def job_realisation(site: SiteSection) -> Realisation | None:
    """Frame and epoch of the network's geocentric coordinates, None if nothing names them.

    A projected site is in the datum of its grid; a frame beside it is that of geocentric
    coordinates in files. Where both are one to a millimetre, the frame is the better name. WGS 84
    has realisations that differ by decimetres from the first to the last, and names none.
    """
    own = None if site.kind != "projected" or site.crs is None else GridDatum.of(site.crs).frame
    if site.frame is None:
        return None if own in (None, "WGS 84") else Realisation(own, site.epoch)
    stated = Realisation(site.frame, site.epoch)
    if own in (None, "WGS 84") or site.crs is None:
        return stated
    grid = Realisation(own, site.epoch)
    here = _somewhere(site.crs)
    moved, _ = Passage(stated, grid).positions(here)
    return stated if np.abs(moved - here).max() < SAME_FRAME else grid


def _somewhere(crs: str) -> Array:
    """A place (1, 3) in the area of a grid, geocentric [m]."""
    area = GridDatum.of(crs).projected.area_of_use
    if area is None:
        return np.array([[6378137.0, 0.0, 0.0]])
    latitude, longitude = np.radians([(area.south + area.north) / 2, (area.west + area.east) / 2])
    return ecef_from_geodetic(latitude, longitude, np.float64(0.0))[None]  # type: ignore[arg-type]


def stated_passage(site: SiteSection, job: Realisation | None) -> Passage | None:
    """The way of geocentric coordinates in the frame that the site names; None if there is none."""
    if site.frame is None or job is None or job.frame == site.frame:
        return None
    return Passage(Realisation(site.frame, site.epoch), job)


def passage(keys: EpochKeys, job: Realisation | None) -> Passage | None:
    """Passage of a file's coordinates to the frame and epoch of the job; None if they are there."""
    source = keys.realisation(job)
    if source is None or job is None or source == job:
        return None
    way = Passage(source, job, keys.motion)
    # what cannot be moved is refused before any file is read
    way.positions(np.array([[6378137.0, 0.0, 0.0]]))
    return way


def gnss_context(
    entry: ObservationFile,
    site: Site,
    job: Realisation | None,
    stated: Passage | None,
    known: Iterable[str],
    *,
    placed: bool,
) -> GnssContext:
    """Collect what a project says about a file of GNSS results."""
    if placed and not isinstance(site, EllipsoidSite):
        raise InputError(
            "geocentric vectors need a place on the ellipsoid, and the site is flat",
            cure="give the site latitude_deg and longitude_deg, a crs, or a frame",
        )
    return GnssContext(
        site=site if placed and isinstance(site, EllipsoidSite) else None,
        job=job,
        stated=stated,
        frame=entry.frame or "",
        epoch=entry.epoch,
        motion=entry.motion,
        point=entry.point,
        base=entry.base,
        factor=entry.sigma_factor,
        stations=entry.stations,
        known=frozenset(known),
    )


def compute_sessions(
    section: GnssSection,
    survey: Survey,
    folder: Path,
    job: Realisation | None,
    progress: Progress,
) -> tuple[SessionResult, ...]:
    """Compute the baselines of all sessions, started at the points of a survey."""
    site = _ellipsoid(survey.site)
    sessions = []
    for k, session in enumerate(section.sessions):
        receivers = tuple(
            Occupation(r.point, folder / r.file, r.antenna, r.antenna_height_m)
            for r in session.receivers
        )
        orbits = tuple(folder / name for name in (*session.navigation, *section.navigation))
        sessions.append(
            ReceiverSession(session.name or str(k + 1), receivers, orbits, session.star)
        )
    given = {n: p for n, p in survey.points.items() if np.isfinite(p.xyz).all()}
    surest = sorted(given, key=lambda n: given[n].role not in ("fixed", "control"))
    known = {name: site.to_ecef(given[name].xyz[None])[0] for name in surest}
    if known and _plate_fixed(job):
        assert job is not None
        # satellites are computed in their own frame; its epoch moves them by centimetres only
        there, _ = frames.transform(
            np.array(list(known.values())), job.frame, _ORBITS, job.epoch or _TODAY
        )
        known = dict(zip(known, there, strict=True))
    processing: Processing = section.processing(folder)
    return run_sessions(sessions, known, processing, progress)


def _plate_fixed(job: Realisation | None) -> bool:
    """True if coordinates are in a frame other than that of the orbits, and the way is known."""
    if job is None or job.dynamic or job.frame == "WGS 84":
        return False
    return frames.connected(_ORBITS, job.frame)


def add_sessions(
    survey: Survey, results: Iterable[SessionResult], job: Realisation | None = None
) -> None:
    """Baselines as observations, those of one session with their joint covariance."""
    site = _ellipsoid(survey.site)
    turn = site.w_from_ecef
    for result in results:
        m = len(result.baselines)
        whole = np.kron(np.eye(m), turn)
        covariance = whole @ result.covariance @ whole.T
        source = [f"{b.files[0]}, {b.files[1]}" for b in result.baselines]
        vectors = np.array([b.vector for b in result.baselines])
        if m and job is not None and _plate_fixed(job):
            year = 1980.014 + result.baselines[0].start / _YEAR
            way = Passage(Realisation(_ORBITS, year), job)
            frame, accuracy = way.turn(site.origin)
            after = vectors @ frame.T
            survey.facts += (
                FrameChange.of_vectors(f"session {result.name}", way, vectors, after, accuracy),
            )
            vectors = after
        table = survey.add(
            GnssBaselines,
            values=vectors @ turn.T,
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
