"""Scans through their adjusted poses into files, each point with its sigmas; nothing made twice."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Progress, Single
from tribrach.cloud.covariance import covariances, place_with_sigmas, rounded
from tribrach.cloud.placement import Placement
from tribrach.cloud.summary import CloudSummary
from tribrach.errors import InputError
from tribrach.geodesy.local_map import LocalMap
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.instruments.range_law import RangeLaw
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader, CloudWriter, step_for
from tribrach.io.keeping import is_read
from tribrach.job.each import Item, each
from tribrach.job.grouping import groups, whole_source
from tribrach.job.poses import PLACED, pose_words, station_order
from tribrach.job.scans import MeasuredScan, StationScan
from tribrach.job.state import Remembered, digest
from tribrach.kernels import in_threads
from tribrach.scan.normals import incidence_cosines
from tribrach.scan.scan import Field
from tribrach.sentences import Sentence, joined

if TYPE_CHECKING:
    from tribrach.project.sections import CloudSection

# Clouds of an earlier grouping or format give way to those that hold the same scans now.
#
# A file is removed only if its record says that it was written here, its size and date are still
# those of then, and every scan in it is in the clouds of this run. What anybody else put there or
# changed stays, and so does the cloud of a scan that the project has no longer.


#: records of files hold paths and dates, and so are apart from those of what was made
_NOTE = "file-cloud-"


@dataclass(frozen=True)
class _Note:
    """A cloud that was written: its file with its date [ns], and marks of the scans in it."""

    file: str
    date: int
    scans: tuple[str, ...]


def note_written(state: Remembered, path: Path, scans: Sequence[StationScan]) -> None:
    """Note what a cloud just written is, so that it can be removed later."""
    note = _Note(path.name, path.stat().st_mtime_ns, _marks(scans))
    state.remember(_NOTE + path.name, "", note, path)


def remove_superseded(
    state: Remembered, folder: Path, current: Sequence[Path], scans: Sequence[StationScan]
) -> list[str]:
    """Remove clouds that others have taken the place of; the names of their files."""
    held, gone = set(_marks(scans)), []
    for record, note, sizes in state.records(_NOTE, _Note):
        path = _own(folder, note, sizes)
        if path is None or is_read(path) or not set(note.scans) <= held:
            continue
        if any(path.name == now.name or _same(path, now) for now in current):
            continue
        try:
            path.unlink()
            state.forget(f"cloud-{path.name}")
            record.unlink(missing_ok=True)
        except OSError as error:
            raise InputError(
                f"this cloud of an earlier run cannot be removed ({error.strerror})",
                file=path,
                cure="close it elsewhere, or take another folder with --out",
            ) from error
        gone.append(path.name)
    return gone


def _own(folder: Path, note: _Note, sizes: Sequence[int]) -> Path | None:
    """The file that a note tells of, if it is untouched since; names lead nowhere else."""
    path = folder / note.file
    if not note.scans or note.file in ("", ".", "..") or path.name != note.file:
        return None
    if path.parent != folder:
        return None
    try:
        status = path.lstat()
    except (OSError, ValueError):
        return None
    untouched = status.st_mtime_ns == note.date and [status.st_size] == sizes
    return path if untouched and path.is_file() and not path.is_symlink() else None


def _marks(scans: Sequence[StationScan]) -> tuple[str, ...]:
    """A mark for each scan: its file and its number there."""
    return tuple(digest(str(s.scan.path.resolve()), s.scan.index) for s in scans)


def _same(one: Path, other: Path) -> bool:
    """One file under two names, where a file system knows no capitals."""
    try:
        return one.samefile(other)
    except OSError:
        return False


_SIGMAS = ("sigma_x", "sigma_y", "sigma_z")
#: of all three together
_SIGMA = "sigma"
#: fields of points of LAS that mean nothing elsewhere
_OF_LAS = frozenset(
    (
        "synthetic",
        "key_point",
        "withheld",
        "overlap",
        "scanner_channel",
        "scan_direction_flag",
        "edge_of_flight_line",
        "user_data",
        "scan_angle",
        "scan_angle_rank",
        "point_source_id",
    )
)
_CORRELATIONS = ("correlation_xy", "correlation_xz", "correlation_yz")
_NORMALS = ("normal_x", "normal_y", "normal_z")
#: rigid poses that miss the projection by less are not worth a sentence [m]
_NEGLIGIBLE = 1e-4
#: a smaller share of points beyond the law of their noise is not worth a sentence
_WORTH_SAYING = 0.01


@dataclass(frozen=True)
class Product:
    """A cloud that was written."""

    #: its file and the names of the scans in it
    path: Path
    scans: tuple[str, ...]
    summary: CloudSummary  #: what its points are like
    step: float | None  #: of stored coordinates [m], None for a copy, which has those of its source
    new: bool  #: was it written in this run?
    sentences: tuple[str, ...] = ()  #: what the file cannot carry


def write_clouds(
    scans: Sequence[StationScan],
    placements: Mapping[str, Placement],
    frame: OutputFrame,
    section: CloudSection,
    folder: Path,
    state: Remembered,
    progress: Callable[[str, int, int | None], None],
    sigma_origin: str = "prior",
) -> list[Product]:
    """Write every cloud that is not there already.

    Clouds that an earlier run wrote of the same scans in another grouping or format are removed
    when all of these are there.
    """
    state.sweep(folder)
    numbers = {name: k for k, name in enumerate(station_order(scans), start=1)}
    wanted, items = groups(scans, section), []
    for group in wanted:
        placed = [placements[scan.name] for scan in group.scans]
        measured = [scan.measured for scan in group.scans]
        sources = tuple(numbers[scan.station] for scan in group.scans)
        items.append(
            Item(
                f"cloud-{group.file}",
                group.name,
                (group.file, group.name, measured, placed, frame, section, sources, sigma_origin),
                source=group.scans[0].scan.path,
                cost=sum(scan.scan.records or 0 for scan in group.scans),
                file=folder / group.file,
            )
        )
    fresh = set[int]()

    def made(number: int) -> None:
        fresh.add(number)
        note_written(state, folder / wanted[number].file, wanted[number].scans)

    written = each(_written, items, state=state, progress=progress, made=made)
    products = [
        Product(
            folder / group.file,
            tuple(scan.name for scan in group.scans),
            summary,
            step,
            number in fresh,
            sentences,
        )
        for number, (group, (summary, step, sentences)) in enumerate(
            zip(wanted, written, strict=True)
        )
    ]
    remove_superseded(state, folder, [p.path for p in products], scans)
    return products


def _written(
    file: str, *of: Any, path: Path, progress: Progress
) -> tuple[CloudSummary, float | None, tuple[str, ...]]:
    """Write a cloud; its summary, the step of its coordinates, and what the file cannot carry.

    file : its name in the end; of : what :class:`CloudProduct` takes besides.
    """
    cloud = CloudProduct(file, *of)
    summary = cloud.write(path, progress)
    return summary, None if cloud.copied else cloud.step, tuple(cloud.sentences)


def _rounded(sigma: Single) -> Single:
    """Sigmas (n, 3) without digits that nobody knows."""
    out = np.empty_like(sigma)

    def fill(first: int, last: int) -> None:
        out[first:last] = rounded(sigma[first:last])

    in_threads(fill, len(sigma))
    return out


def _in_space(sigma: Single) -> Single:
    """Sigmas (n,) in space of those (n, 3) along the axes."""
    out = np.empty(len(sigma), dtype=np.float32)

    def fill(first: int, last: int) -> None:
        x, y, z = sigma[first:last].T.astype(np.float64)
        out[first:last] = rounded(np.sqrt(x * x + y * y + z * z).astype(np.float32))

    in_threads(fill, len(sigma))
    return out


class CloudProduct:
    """One cloud on its way into its file."""

    def __init__(
        self,
        file: str,
        name: str,
        scans: Sequence[MeasuredScan],
        placements: Sequence[Placement],
        frame: OutputFrame,
        section: CloudSection,
        sources: Sequence[int],
        sigma_origin: str,
    ) -> None:
        self.file, self.name, self.scans, self.placements = file, name, scans, placements
        self.sources, self.sigma_origin = sources, sigma_origin
        self.as_las = section.format in ("las", "laz", "copc")
        self.frame, self.section = frame, section
        self.whole = all(where.noise is not None for where in placements)
        self.step = step_for(min(self._smallest(where) for where in placements))
        self.in_scanner = section.format == "e57"
        self.copied = self.in_scanner and whole_source(scans)
        self.sentences: list[str] = []
        self._misfit = 0.0
        self._points_of, self._outside = [0] * len(scans), [0] * len(scans)

    @staticmethod
    def _smallest(where: Placement) -> float:
        """A lower bound of the sigmas of a cloud's coordinates [m]."""
        own = 0.0 if where.noise is None else where.noise.least_range
        return max(1e-4, min(own or 1.0, 3 * float(np.sqrt(np.diag(where.covariance)[:3].min()))))

    def write(self, path: Path, progress: Callable[[str, int, int | None], None]) -> CloudSummary:
        """Write the file; the summary of its points."""
        if self.in_scanner and not self.copied and len(self.scans) > 1:
            raise InputError(
                "an E57 file keeps points in the frame of their scanner, one scan per file",
                file=self.file,
                cure="say merged = false, or take another format",
            )
        path.parent.mkdir(parents=True, exist_ok=True)
        summary = self._copy(path, progress) if self.copied else self._new(path, progress)
        self._say_no_sigmas()
        self._say_outside_of_law()
        self._say_misfit()
        return summary

    def _new(self, path: Path, progress: Callable[[str, int, int | None], None]) -> CloudSummary:
        """Write every point."""
        summary, total = CloudSummary(), self._records()
        with ExitStack() as stack:
            writer: CloudWriter = stack.enter_context(create(path, self._header()))
            for xyz, local, values, sigma in self._points():
                writer.write(local if self.in_scanner else xyz, values)
                summary.add(xyz, sigma)
                progress(self.name, summary.points, total)
        return summary

    def _copy(self, path: Path, progress: Callable[[str, int, int | None], None]) -> CloudSummary:
        """Copy the source with new poses; its points are only read for the summary."""
        from tribrach.io.clouds.e57 import copy_with_poses

        source = self.scans[0].scan.path
        poses = {
            scan.scan.index: where.delivered(self.frame).pose
            for scan, where in zip(self.scans, self.placements, strict=True)
        }
        summary, total = CloudSummary(), self._records()
        for xyz, _, _, sigma in self._points(values=False):
            summary.add(xyz, sigma)
            progress(self.name, summary.points, total)
        remarks = copy_with_poses(source, path, poses, crs=self.frame.wkt or "")
        asked = [name for name in ("correlations", "incidence") if getattr(self.section, name)]
        lost = " and ".join(
            [", ".join(["sigmas", *asked[:-1]]), asked[-1]] if asked else ["sigmas"]
        )
        self.sentences.append(
            f"{self.file} has the points of {source.name} byte for byte: {lost} are not in it"
        )
        self.sentences += [f"{self.file}: {sentence}" for sentence in remarks]
        return summary

    def _say_no_sigmas(self) -> None:
        """Why points have no sigmas, if they have none."""
        for scan, where in zip(self.scans, self.placements, strict=True):
            if where.noise is not None:
                continue
            why = (
                "no instrument with range_mm and scan_angle_arcsec is given for it"
                if scan.origin_known
                else "where the scanner stood among its points is not known (if at 0, 0, 0, say "
                'origin = "scanner" in its [[scans]])'
            )
            self.sentences.append(
                f"{self.file} has no sigmas of points because of scan {scan.name}: {why}"
            )

    def _say_outside_of_law(self) -> None:
        """Which scans have intensities that the law of their noise says nothing of, or none."""
        for k, (scan, where) in enumerate(zip(self.scans, self.placements, strict=True)):
            law = None if where.noise is None else where.noise.law
            if law is None:
                continue
            if "intensity" not in scan.scan.names:
                self.sentences.append(
                    f"{self.file}: scan {scan.name} has no intensities, so that its ranges have "
                    "the sigmas of the data sheet and not those of the law of their noise"
                )
            elif self._outside[k] > _WORTH_SAYING * self._points_of[k]:
                share = self._outside[k] / self._points_of[k]
                self.sentences.append(
                    Sentence(
                        "{own.file}: {share:%} of the points of scan {scan.name} have intensities "
                        "outside of those that the law of their noise was estimated from "
                        "({law.low:g} to {law.high:g}); weaker light has what it gives down to "
                        "{law.weakest:g}, stronger light what it gives at its end",
                        own=self,
                        share=share,
                        scan=scan,
                        law=law,
                    )
                )

    def _say_misfit(self) -> None:
        """What a rigid pose in a projection costs, if it is anything."""
        if not self._misfit > _NEGLIGIBLE:
            return
        at = self.placements[0].pose.translation
        scale = np.sqrt(abs(np.linalg.det(self.frame.jacobian(at)[:2, :2]))) - 1
        self.sentences.append(
            Sentence(
                "{own.file} has rigid poses, which do not carry the scale of {own.frame.crs} "
                "({scale:ppm+1} at this site, {change:mm1} in 100 m): its points are up to "
                "{own._misfit:mm1} beside their coordinates in the projection; the frames work "
                "and ecef, and other formats, are exact",
                own=self,
                scale=scale,
                change=100 * abs(scale),
            )
        )

    def _records(self) -> int | None:
        counts = [scan.scan.records for scan in self.scans]
        return None if None in counts else sum(c for c in counts if c is not None)

    def _points(
        self, values: bool = True
    ) -> Iterator[tuple[Array, Array, dict[str, NDArray[Any]], NDArray[np.float32] | None]]:
        """Chunks of coordinates, delivered and of the scanner, their values and sigmas."""
        to_frame = LocalMap(self.frame.from_work) if self.frame.kind == "projected" else None
        for number, (scan, where) in enumerate(zip(self.scans, self.placements, strict=True)):
            turn = self.frame.rotation(where.pose.translation)
            turned, rigid = where.turned(turn), where.delivered(self.frame).pose
            for chunk in scan.scan.chunks():
                cosine = incidence_cosines(chunk.xyz) if self.section.incidence else None
                sigma, world = None, None
                if where.noise is not None:
                    light = chunk.values.get("intensity")
                    placed, plain = place_with_sigmas(chunk.xyz, turned, cosine, light)
                    self._count_outside(number, where.noise.law, light)
                    sigma = _rounded(plain)
                    # only the work frame has the axes that the sigmas are along
                    world = placed if self.frame.kind == "work" else None
                world = where.pose @ chunk.xyz if world is None else world
                out = self.frame.from_work(world) if to_frame is None else to_frame(world)
                if self.in_scanner and to_frame is not None and len(out):
                    off = float(np.linalg.norm(rigid @ chunk.xyz - out, axis=1).max())
                    self._misfit = max(self._misfit, off)
                kept = dict(chunk.values) if values else {}
                if not self.as_las:
                    kept = {name: v for name, v in kept.items() if name not in _OF_LAS}
                if values:
                    self._complete(kept, chunk.xyz, turned, sigma, cosine, number)
                yield out, chunk.xyz, kept, sigma

    def _count_outside(self, number: int, law: RangeLaw | None, light: Array | None) -> None:
        """Points of a scan whose intensities (n,) the law of its noise was not estimated from."""
        if law is not None and light is not None:
            self._points_of[number] += len(light)
            self._outside[number] += law.outside(light)

    def _complete(
        self,
        values: dict[str, NDArray[Any]],
        xyz: Array,
        turned: Placement,
        sigma: NDArray[np.float32] | None,
        cosine: Array | None,
        number: int,
    ) -> None:
        """Turn normals with the points and add what the cloud says of its own uncertainty."""
        if not self.in_scanner and all(name in values for name in _NORMALS):
            normals = np.stack([values[name] for name in _NORMALS], axis=1)
            turned_normals = (normals @ turned.pose.rotation.T).astype(np.float32)
            values |= dict(zip(_NORMALS, turned_normals.T, strict=True))
        if len(self.scans) > 1:
            values["station"] = np.full(len(xyz), number, dtype=np.uint16)
        if self.as_las:
            values["point_source_id"] = np.full(len(xyz), self.sources[number], dtype=np.uint16)
        if cosine is not None:
            values["incidence"] = rounded(np.degrees(np.arccos(cosine)).astype(np.float32))
        if sigma is None or not self.whole:
            return
        values |= dict(zip(_SIGMAS, sigma.T, strict=True))
        values[_SIGMA] = _in_space(sigma)
        if self.section.correlations:
            c = covariances(xyz, turned, cosine, values.get("intensity"))
            root = np.sqrt(c[:, :3])
            for k, (name, (i, j)) in enumerate(
                zip(_CORRELATIONS, ((0, 1), (0, 2), (1, 2)), strict=True)
            ):
                ratio = c[:, 3 + k] / (root[:, i] * root[:, j])
                values[name] = rounded(ratio.astype(np.float32))

    def _header(self) -> CloudHeader:
        """Fields that all scans of the cloud have, and the added ones."""
        shared = list(self.scans[0].scan.fields)
        for scan in self.scans[1:]:
            names = set(scan.scan.names)
            shared = [f for f in shared if f.name in names]
        shared = [self._light(f) if f.name == "intensity" else f for f in shared]
        extra: list[Field] = []
        if not self.as_las:
            shared = [f for f in shared if f.name not in _OF_LAS]
        elif all(f.name != "point_source_id" for f in shared):
            extra.append(Field("point_source_id", "uint16"))
        if len(self.scans) > 1:
            extra.append(Field("station", "uint16", description="number of the scan, from 0"))
        if self.section.incidence:
            extra.append(Field("incidence", "float32", description="incidence angle [deg]"))
        if self.whole:
            axes = self.frame.axes
            extra += [
                Field(name, "float32", description=f"sigma of {axis} [m]")
                for name, axis in zip(_SIGMAS, axes, strict=True)
            ]
            extra.append(Field(_SIGMA, "float32", description="3D sigma [m]"))
            if self.section.correlations:
                extra += [Field(name, "float32") for name in _CORRELATIONS]
        offset = self.frame.from_work(self.placements[0].pose.translation[None])[0]
        pose = self.placements[0].delivered(self.frame).pose if self.in_scanner else None
        return CloudHeader(
            name=self.name,
            fields=(*shared, *extra),
            step=self.step,
            offset=np.zeros(3) if self.in_scanner else np.round(offset, -2),
            pose=pose,
            crs=self.frame.wkt,
            epoch=self.frame.epoch,
            facts=self._facts(),
        )

    def _light(self, field: Field) -> Field:
        """The intensity of all scans: with the limits of all, without a step where these differ."""
        others = [f for scan in self.scans for f in scan.scan.fields if f.name == "intensity"]
        low = [f.low for f in others if f.low is not None]
        high = [f.high for f in others if f.high is not None]
        known = len(low) == len(high) == len(others)
        return Field(
            "intensity",
            field.dtype,
            low=min(low) if known else None,
            high=max(high) if known else None,
            description=field.description,
            step=field.step if all(f.step == field.step for f in others) else None,
        )

    def _facts(self) -> dict[str, str]:
        """Frame, stations, pose, and where the sigmas come from, in words that ``info`` gives back.

        The poses of a merged cloud are in the file of poses beside it.
        """
        facts = {"frame": self.frame.kind, "axes": ", ".join(self.frame.axes)}
        if len(self.scans) > 1:
            facts["stations"] = "; ".join(f"{k} {s.name}" for k, s in enumerate(self.scans))
        else:
            facts["station"] = self.placements[0].station
            facts[PLACED] = pose_words(self.placements[0].delivered(self.frame).pose)
        if self.as_las:
            named = dict(zip(self.sources, (w.station for w in self.placements), strict=True))
            facts["point_source_id"] = "; ".join(f"{k} {name}" for k, name in named.items())
        facts["sigmas"] = self._origin_of_sigmas()
        return facts

    def _origin_of_sigmas(self) -> str:
        """What the sigmas of the points are made of."""
        if not self.whole:
            return "none: no noise is known of the scanner, or not where it stood"
        noises = list(dict.fromkeys(w.noise for w in self.placements if w.noise is not None))
        calibrated = any(where.calibration is not None for where in self.placements)
        parts = [
            f"pose of the station ({'a posteriori' if 'post' in self.sigma_origin else 'a priori'})"
        ]
        parts += ["calibration of the scanner"] if calibrated else []
        parts += [noise.words for noise in noises[:3]]
        return joined("; ", parts)
