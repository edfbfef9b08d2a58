"""Survey of ready GNSS vectors and positions: GVX, SINEX, SKI-ASCII, TDEF, solutions of RTKLIB.

All files of one call share a work frame: that of the job, or one centred on what they hold.
Coordinates of other frames and epochs are carried to those of the job, or refused where nothing
says how the marks move.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError, RefusalCollector
from tribrach.geodesy import frames
from tribrach.geodesy.epochs import Motion, Passage, Realisation, carry
from tribrach.geodesy.site import EllipsoidSite
from tribrach.io.gnss import ski, tdef
from tribrach.io.gnss.gvx import read_gvx
from tribrach.io.gnss.jobxml import has_vectors_only, read_jobxml
from tribrach.io.gnss.records import GnssRecords
from tribrach.io.gnss.rtklib_pos import read_rtklib
from tribrach.io.gnss.sinex import read_sinex
from tribrach.io.totalstation.text import head
from tribrach.network.facts import FrameChange, Reference
from tribrach.network.identity import names_apart
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.observations.gnss import GnssBaselines, GnssPositions
from tribrach.sentences import Sentence

Reader = Callable[[Path], GnssRecords]
#: test of the beginning and reader of text files with vectors, whatever their suffix
_VECTORS: tuple[tuple[Callable[[str], bool], Reader], ...] = (
    (ski.sniff, ski.read_ski),
    (tdef.sniff, tdef.read_tdef),
)

#: what plate-fixed frames are turned against the ITRF [rad]: NAD83, the most of all
FRAME_TURN = 0.2e-6


@dataclass(frozen=True)
class GnssContext:
    """What the project says about GNSS files."""

    site: EllipsoidSite | None = None  #: the ellipsoidal work frame, None if the files bring it
    job: Realisation | None = None  #: frame and epoch of the project
    #: the way of coordinates in the frame that the site names, where that is not the job's
    stated: Passage | None = None
    frame: str = ""  #: frame of the files; overrides what they say
    epoch: float | None = None  #: epoch of the files as a decimal year; overrides what they say
    motion: Motion | None = None  #: how marks move
    #: names for a solution of RTKLIB
    point: str = ""
    base: str = ""
    #: on the formal standard deviations of a solution of RTKLIB, None for the default, or on those
    #: of a SINEX file
    factor: float | None = None
    stations: tuple[str, ...] = ()  #: stations of SINEX files that are wanted, all if empty
    #: points that have coordinates already
    known: frozenset[str] = field(default_factory=frozenset)


def read(
    paths: Sequence[Path],
    context: GnssContext | None = None,
    labels: Mapping[Path, str] | None = None,
) -> Survey:
    """Survey of files of GNSS results.

    ``paths``: GVX (``.gvx``, ``.xml``), solutions of RTKLIB (``.pos``), SKI-ASCII, TDEF and JobXML
    by how they begin, else SINEX; ``labels``: what tells files of the same name apart, by path;
    derived from these files if not given.
    """
    settings = context or GnssContext()
    readers: dict[str, Reader] = {
        ".gvx": read_gvx,
        ".xml": read_gvx,
        ".pos": lambda path: read_rtklib(
            path, point=settings.point, base=settings.base, factor=settings.factor
        ),
    }

    def solution(path: Path) -> GnssRecords:
        return read_sinex(path, chosen=settings.stations, factor=settings.factor)

    apart = names_apart(paths) if labels is None else labels
    files = []
    with RefusalCollector() as refused:
        for path in paths:
            with refused.record():
                reader = readers.get(path.suffix.lower()) or vector_reader(path)
                # a job with sights as well is asked for its vectors by name
                reader = reader or (read_jobxml if "<JOBFile" in head(path) else solution)
                if settings.stations and reader is not solution:
                    raise InputError(
                        "stations are chosen from SINEX files only",
                        file=path,
                        cure="leave them out",
                    )
                records = reader(path)
                for sources in (records.position_sources, records.vector_sources):
                    sources[:] = [apart[path] + s.removeprefix(path.name) for s in sources]
                files.append((path, records))
    return survey_of(files, settings)


def vector_reader(path: Path) -> Reader | None:
    """The reader of a text file of vectors that begins like one of these formats, or None."""
    text = head(path)
    if "<JOBFile" in text:
        return read_jobxml if has_vectors_only(path) else None
    return next((reader for sniff, reader in _VECTORS if sniff(text)), None)


def survey_of(files: Sequence[tuple[Path, GnssRecords]], context: GnssContext) -> Survey:
    """Survey of the vectors and positions in files."""
    job = _job(files, context)
    changes = [_carried(path, records, context, job) for path, records in files]
    site = context.site
    if site is None:
        places = [r.xyz for _, r in files if len(r.xyz)]
        places += [np.array(list(r.approximate.values())) for _, r in files if r.approximate]
        if not places:
            raise InputError(
                "the vectors bring no coordinates of any point",
                file=files[0][0],
                cure="use them in a project with a site and points",
            )
        site = EllipsoidSite.centred(np.concatenate(places))
    survey = Survey(site=site)
    if job is not None:
        survey.reference = Reference(frame=job.frame, epoch=job.epoch)
    for (_, records), change in zip(files, changes, strict=True):
        _add(survey, site, records, context)
        survey.warnings += records.warnings
        survey.facts += change
    return survey


def _job(files: Sequence[tuple[Path, GnssRecords]], context: GnssContext) -> Realisation | None:
    """Frame and epoch of the job: those of the project, or of the first file that states them."""
    if context.job is not None:
        return context.job
    for _, records in files:
        if records.frame or context.frame:
            epoch = records.epoch if context.epoch is None else context.epoch
            return Realisation(context.frame or records.frame, epoch)
    return None


def _carried(
    path: Path, records: GnssRecords, context: GnssContext, job: Realisation | None
) -> tuple[FrameChange, ...]:
    """Carry what a file holds into the frame of the job, and its coordinates to the epoch."""
    if job is None:
        return ()
    name = context.frame or records.frame
    default = job if context.stated is None else context.stated.source
    if not name and len(records.xyz):
        records.warnings.append(
            f"{path.name} does not name its frame; its coordinates are taken as {default.frame}"
        )
    epoch = records.epoch if context.epoch is None else context.epoch
    source = Realisation(name or default.frame, default.epoch if epoch is None else epoch)
    motion = context.motion
    if motion is None and records.velocity is not None:
        motion = Motion(velocity=records.velocity)
        _add_velocity_covariance(records, source, job)
    way = Passage(source, job, motion)
    changes = []
    try:
        if len(records.xyz):
            before = records.xyz
            records.xyz, accuracy = way.positions(before)
            if frames.frame(source.frame) != frames.frame(job.frame):
                changes.append(
                    FrameChange.of_positions(path.name, way, before, records.xyz, accuracy)
                )
        if len(records.vectors) and not frames.connected(source.frame, job.frame):
            longest = float(np.linalg.norm(records.vectors, axis=1).max())
            records.warnings.append(
                Sentence(
                    "the vectors of {path.name} are in {source.frame} and used as they are: no way "
                    "from there to {job.frame} is known; frames of satellites are turned by up to "
                    "{frame_turn:ppm1}, {change:mm1} in the longest",
                    path=path,
                    source=source,
                    job=job,
                    frame_turn=FRAME_TURN,
                    change=FRAME_TURN * longest,
                )
            )
        elif len(records.vectors) and frames.frame(source.frame) != frames.frame(job.frame):
            before = records.vectors
            turn, accuracy = way.turn(_somewhere(records, context))
            records.vectors = before @ turn.T
            changes.append(
                FrameChange.of_vectors(path.name, way, before, records.vectors, accuracy)
            )
        if records.approximate:
            # start values only: nothing depends on their motion
            places = np.array(list(records.approximate.values()))
            still = motion if motion and motion.plate else Motion(velocity=np.zeros(3))
            moved, _ = carry(places, source, job, still)
            records.approximate = dict(zip(records.approximate, moved, strict=True))
    except InputError as error:
        raise InputError(error.what, file=path, cure=error.cure) from error
    records.warnings += [change.warning for change in changes if change.warning is not None]
    return tuple(changes)


def _somewhere(records: GnssRecords, context: GnssContext) -> Array:
    """A place (3,) [m] near the vectors of a file, geocentric."""
    if context.site is not None:
        return context.site.origin
    if records.approximate:
        place: Array = np.array(list(records.approximate.values())).mean(axis=0)
        return place
    return records.xyz.mean(axis=0) if len(records.xyz) else np.array([6378137.0, 0.0, 0.0])


def _add_velocity_covariance(records: GnssRecords, source: Realisation, job: Realisation) -> None:
    """Covariance of positions that were moved by the velocities of the same solution."""
    if records.velocity_covariance is None or source.epoch is None or job.epoch is None:
        return
    n = 3 * len(records.xyz)
    move = np.hstack([np.eye(n), (job.epoch - source.epoch) * np.eye(n)])
    records.covariance = move @ records.velocity_covariance @ move.T


def _add(survey: Survey, site: EllipsoidSite, records: GnssRecords, context: GnssContext) -> None:
    """Add the observations of one file, and start values of points without coordinates."""
    turn = site.w_from_ecef
    named = set(survey.points) | context.known
    for name, xyz in records.approximate.items():
        if name not in named:
            survey.point(name, site.from_ecef(xyz[None])[0])
    n = len(records.positions)
    if n:
        whole = np.kron(np.eye(n), turn)
        covariance = whole @ records.covariance @ whole.T
        table = survey.add(
            GnssPositions,
            values=site.from_ecef(records.xyz),
            covariance=np.einsum("aiaj->aij", covariance.reshape(n, 3, n, 3)),
            position=records.positions,
            source=records.position_sources,
        )
        if n > 1:
            item, row = np.divmod(np.arange(3 * n), 3)
            source = records.position_sources[0]
            survey.correlate(np.full(3 * n, table), item, row, covariance, source)
    if len(records.start):
        off = np.array(records.vector_off or [""] * len(records.start), dtype=object)
        survey.add(
            GnssBaselines,
            values=records.vectors @ turn.T,
            covariance=turn @ records.blocks @ turn.T,
            start=records.start,
            end=records.end,
            source=records.vector_sources,
            use=np.where(off == "", Use.ACTIVE, Use.OFF).astype(np.int8),
            reason=off,
        )
