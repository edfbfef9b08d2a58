"""Raw files of total stations as observations: directions, zenith angles and slope distances.

Each target of a set-up gives one of each, the mean over faces and sets; the directions read with
one position of the circle share an orientation unknown. A file has no standard deviations: they
are those of the instrument, divided by the root of the number of readings. Coordinates in the file
are start values, and the datum where nothing else gives one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.errors import InputError, RefusalCollector
from tribrach.geodesy.site import FlatSite, Site
from tribrach.instruments.atmosphere import first_velocity_ppm
from tribrach.instruments.precision import Precision
from tribrach.instruments.reduction import LIMIT, Means, Reduction, reduce
from tribrach.io.totalstation import formats
from tribrach.io.totalstation.records import RawFile
from tribrach.network.adjustment import Options, adjust
from tribrach.network.facts import EARTH, Fact, PointCodes, facts_of
from tribrach.network.identity import names_apart
from tribrach.network.network import Datum, is_given
from tribrach.network.occupations import LONG, Ends, Occupied, occupy, share_refraction
from tribrach.network.start.placeholders import contradiction, dummy_places, dummy_words
from tribrach.network.survey import Survey
from tribrach.observations.base import Observations, Use
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles
from tribrach.sentences import Sentence
from tribrach.statistics import robust_sigma
from tribrach.units import SEC

# What a surveyor must be told of a raw file: what was left out, assumed, or looks misread.

#: adjusts to look at the figure of a network; what takes longer says nothing about its points
_soon = partial(adjust, options=Options(max_iterations=15))


#: closures and residuals of sets that are worth a word, at the least
CLOSURE, RESIDUAL = 10 * SEC, 15 * SEC


#: sentences of one kind before the rest is only counted
MOST = 5


def file_words(raw: RawFile) -> list[str]:
    """Notes of the reader, records left out, sights that are not used."""
    name = raw.name
    words = [f"In {name}: {note}" for note in raw.notes]
    words += _some([f"At {raw.source(p.line)}: left out, {p.what}." for p in raw.problems], name)
    if raw.unknown:
        listed = ", ".join(f"{n} x {word}" for word, n in sorted(raw.unknown.items()))
        words.append(f"In {name}: not understood are {listed}.")
    shots = raw.shots
    for reason in dict.fromkeys(shots.off[shots.off != ""].tolist()):
        words.append(f"In {name}: {int((shots.off == reason).sum())} sights are off: {reason}.")
    own = int(
        sum(raw.setups.station[s] == t for s, t in zip(shots.setup, shots.target, strict=True))
    )
    if own:
        words.append(f"In {name}: {own} sights go to the point that they come from; they are off.")
    if not shots.applied.all():
        bare = ~shots.applied & np.isnan(shots.ppm) & np.isnan(shots.pressure_hpa)
        if bare.any():
            words.append(
                f"In {name}: {int(bare.sum())} raw distances have no atmospheric correction."
            )
    return words


def reduction_words(reduced: ReducedFile) -> list[str]:
    """Faces that are far apart, horizons that do not close, sets that disagree, lone faces."""
    words = _some(_faces(reduced), reduced.raw.name)
    words += _some(_closures(reduced), reduced.raw.name)
    words += _some(_residuals(reduced), reduced.raw.name)
    axes = reduced.reduction.axes
    single = np.isfinite(reduced.reduction.cells[1].value) & np.isnan(axes.half_zenith)
    significant = abs(axes.index) > 3 * axes.sigma_index
    if axes.pairs and single.any() and significant:
        words.append(
            Sentence(
                "In {reduced.raw.name}: {single} sights were read in one face and keep the "
                'index error of the day, {axes:+1}".',
                reduced=reduced,
                single=int(single.sum()),
                axes=axes.index / SEC,
            )
        )
    return words


def hanging_words(names: list[str]) -> str:
    """Points that cannot be placed."""
    listed = ", ".join(names[:MOST]) + (", ..." if len(names) > MOST else "")
    what = "point is" if len(names) == 1 else "points are"
    return (
        f"{len(names)} {what} seen by angles from one station only and left out ({listed}); "
        "coordinates or a distance would place them."
    )


def _faces(reduced: ReducedFile) -> list[str]:
    circle, level, _ = reduced.reduction.cells
    axes = reduced.reduction.axes
    out: list[str] = []
    for what, cells, half, usual in (
        ("directions", circle, axes.half_direction, axes.collimation),
        ("zenith angles", level, axes.half_zenith, axes.index),
    ):
        usual = 0.0 if np.isnan(usual) else usual
        for i in np.flatnonzero(cells.far):
            off = (2 * (half[i] - usual)) / SEC
            out.append(
                Sentence(
                    "At {source}: the {what} of both faces from {start} to {end} differ "
                    'by {off:+0}" more than the others: misread, or another target.',
                    source=reduced.source(int(cells.first[i])),
                    what=what,
                    start=reduced.station[cells.setup[i]],
                    end=reduced.target[cells.target[i]],
                    off=off,
                )
            )
    return out


def _closures(reduced: ReducedFile) -> list[str]:
    closures, axes = reduced.reduction.closures, reduced.reduction.axes
    scatter = 0.0 if np.isnan(axes.sigma_direction) else axes.sigma_direction
    limit = max(CLOSURE, 3 * np.sqrt(2) * scatter)
    return [
        Sentence(
            "In {reduced.raw.name}: set {closures} at {start} closes on {end} with "
            '{off:+1}" in face {face}.',
            reduced=reduced,
            closures=closures.set[i] + 1,
            start=reduced.station[closures.setup[i]],
            end=reduced.target[closures.target[i]],
            off=closures.difference[i] / SEC,
            face=closures.face[i],
        )
        for i in np.flatnonzero(np.abs(closures.difference) > limit)
    ]


def _residuals(reduced: ReducedFile) -> list[str]:
    """Residuals of sets that no scatter of the file explains."""
    setups = reduced.reduction.setups
    pool = [
        np.abs(s.rounds.residual[np.isfinite(s.rounds.residual)]) for s in setups if s.rounds.dof
    ]
    if not pool:
        return []
    limit = max(RESIDUAL, LIMIT * robust_sigma(np.concatenate(pool), about=0.0))
    out: list[str] = []
    for setup in setups:
        if not setup.rounds.dof:
            continue
        for s, t in np.argwhere(np.abs(setup.rounds.residual) > limit):
            out.append(
                Sentence(
                    "In {reduced.raw.name}: the direction from {start} to {end} in set "
                    '{setup} is {off:+0}" off the mean of the sets.',
                    reduced=reduced,
                    start=reduced.station[setup.setup],
                    end=reduced.target[setup.targets[t]],
                    setup=setup.sets[s] + 1,
                    off=setup.rounds.residual[s, t] / SEC,
                )
            )
    return out


def _some(words: list[str], name: str) -> list[str]:
    """The first of many sentences, and how many more there are."""
    if len(words) <= MOST:
        return words
    return [*words[:MOST], f"In {name}: {len(words) - MOST} more of this kind."]


#: of an instrument that nobody has described
TYPICAL = Precision(
    direction=3 * SEC,
    zenith=3 * SEC,
    distance=2e-3,
    scale=2e-6,
    centring=1e-3,
    height=1e-3,
    refraction_sigma=0.1,
)


FAR = "the faces are too far apart"


@dataclass(frozen=True)
class ReducedFile(Fact):
    """A raw file and what its readings give.

    station (setups,) names; target (targets,) names and height (targets,) [m] of the target index
    of the reduction; rows : sights of the file that took part, for the readings' indices.
    """

    raw: RawFile
    reduction: Reduction
    station: NDArray[Any]
    target: NDArray[Any]
    height: Array
    rows: Index

    def source(self, reading: int) -> str:
        """``file:line`` of a reading."""
        return self.raw.source(int(self.raw.shots.line[self.rows[reading]]))


def read(
    paths: Sequence[Path],
    precision: Precision | None = None,
    *,
    alone: bool = True,
    site: Site | None = None,
    known: Collection[str] | None = (),
    labels: Mapping[Path, str] | None = None,
) -> Survey:
    """The survey of raw files of any format that is known."""
    apart = names_apart(paths) if labels is None else labels
    files = []
    with RefusalCollector() as refused:
        for path in paths:
            with refused.record():
                files.append(replace(formats.read(path), label=apart[path]))
    return survey_of(files, precision, alone=alone, site=site, known=known)


def read_beside(
    paths: Sequence[Path], lists: Sequence[Survey], labels: Mapping[Path, str] | None = None
) -> Survey:
    """The survey of raw files beside lists of points, whose coordinates come before their own."""
    given = {
        name: (point.xyz, point.source)
        for survey in lists
        for name, point in survey.points.items()
        if np.isfinite(point.xyz[:2]).all() and point.role != "check"
    }
    if not given:
        return read(paths, labels=labels)
    raw = read(paths, alone=False, known=given.keys(), labels=labels)
    tables = [table for survey in lists for table in survey.tables()]
    points = [point for survey in lists for point in survey.points.values()]
    if any(is_given(t.kind, t.group) for t in tables) or not all(p.free.all() for p in points):
        return raw
    _fit_to_lists(raw, lists, given)
    return raw


def _fit_to_lists(
    raw: Survey, lists: Sequence[Survey], given: Mapping[str, tuple[Array, str]]
) -> None:
    """Datum of coordinates that have neither sigmas nor a role: the network is fitted to them."""
    network = raw.network()
    seen = {
        name: xyz for name, (xyz, _) in given.items() if network.start.layout.has("point", name)
    }
    wrong = contradiction(network, seen, _soon)
    off = () if wrong is None else wrong.off
    if wrong is not None:
        raw.warnings.append(wrong.sentence())
        for survey in lists:
            for name in {*off, *wrong.heights} & survey.points.keys():
                point = survey.points[name]
                blank = (
                    np.array([True, True, True]) if name in off else np.array([False, False, True])
                )
                survey.points[name] = replace(point, xyz=np.where(blank, np.nan, point.xyz))
    kept = tuple(name for name in seen if name not in off)
    files = sorted(
        {source.rpartition(":")[0] for name, (_, source) in given.items() if name in seen}
    )
    raw.datum = Datum("free", kept if len(kept) > 1 else ())
    if len(kept) > 1:
        raw.warnings.append(
            f"The coordinates of {' and '.join(files) or 'the list'} have neither sigmas nor a "
            f"role: the network keeps its shape and is fitted to the {len(kept)} points that it "
            "observes. State sigmas, or the role fixed, where they are to hold."
        )
    else:
        raw.warnings.append(_datum_words(len(kept), hold=False, dropped=True))


def survey_of(
    files: Sequence[RawFile],
    precision: Precision | None = None,
    *,
    alone: bool = True,
    site: Site | None = None,
    known: Collection[str] | None = (),
) -> Survey:
    """The survey of files that have been read; ``facts`` keep a :class:`ReducedFile` of each."""
    survey = Survey()
    measured = [raw for raw in files if len(raw.shots)]
    if not measured:
        raise InputError(
            f"{files[0].path.name} has coordinates and no sights",
            file=files[0].path,
            cure="give them as [[points]] in a CSV file, and a file with observations here",
        )
    if precision is None or precision.direction is None:
        precision = TYPICAL
        survey.warnings.append(
            Sentence(
                "The instrument is not described: {t.direction:arc seconds0} for a direction and a "
                "zenith angle in one face, {t.distance:mm0} + {t.scale:ppm0} for a distance are "
                "assumed. State its sigmas in a project ([instruments]).",
                t=TYPICAL,
            )
        )
    for raw in files:
        survey.warnings += file_words(raw)
        survey.facts += (PointCodes(raw.codes),) if raw.codes else ()
    reductions = [reduce_file(raw) for raw in measured]
    survey.site = site or _site_of(reductions)
    if alone:
        known = {str(n) for raw in files for n in raw.points.name[raw.points.given]}
    hanging = set() if known is None else _hanging(reductions)
    held = bool(hanging & set(known or ()))
    hanging -= set(known or ())
    if hanging:
        survey.warnings.append(hanging_words(sorted(hanging)))
    for reduced in reductions:
        survey.facts += (reduced,)
        survey.warnings += reduction_words(reduced)
        _Writer(survey, reduced, precision, hanging).write()
    if alone:
        _coordinates(survey, files, held)
    return survey


def _site_of(reductions: Sequence[ReducedFile]) -> FlatSite:
    """Where files lie that nobody gave a site: on a round Earth if a sight is long enough."""
    long = max((r.reduction.distances.value.max(initial=0.0) for r in reductions), default=0.0)
    tilted = any(len(r.reduction.zeniths.value) for r in reductions)
    return FlatSite(EARTH) if tilted and long > LONG else FlatSite()


def reduce_file(raw: RawFile) -> ReducedFile:
    """Correct distances, pair faces, adjust rounds; a target with two heights counts as two."""
    shots, setups = raw.shots, raw.setups
    stem = raw.name.removesuffix(raw.path.suffix)
    station = np.array(
        [name or f"{stem} set-up {j + 1}" for j, name in enumerate(setups.station)], dtype=object
    )
    own = shots.target == station[shots.setup]
    rows = np.flatnonzero((shots.off == "") & ~own)
    height = np.nan_to_num(shots.height[rows]).round(4)
    keys = list(zip(shots.target[rows].tolist(), height.tolist(), strict=True))
    known = {key: k for k, key in enumerate(dict.fromkeys(keys))}
    names = np.empty(len(known), dtype=object)
    names[:] = [name for name, _ in known]
    reduction = reduce(
        shots.setup[rows],
        np.array([known[key] for key in keys], dtype=np.int64),
        shots.face[rows],
        shots.direction[rows],
        shots.zenith[rows],
        corrected(raw)[rows],
        shots.series[rows],
    )
    heights = np.array([h for _, h in known], dtype=float)
    return ReducedFile(raw, reduction, station, names, heights, rows)


def corrected(raw: RawFile) -> Array:
    """Distances (n,) [m], ``D (1 + ppm) + c``; where ppm are not given they follow from the air."""
    shots = raw.shots
    air = first_velocity_ppm(shots.temperature_c, shots.pressure_hpa, shots.humidity_percent)
    ppm = np.where(np.isnan(shots.ppm), air, shots.ppm)
    full = shots.distance * (1 + 1e-6 * np.nan_to_num(ppm)) + np.nan_to_num(shots.prism)
    result: Array = np.where(shots.applied, shots.distance, full)
    return result


class _Writer:
    """Adds the means of a file to a survey."""

    def __init__(
        self, survey: Survey, reduced: ReducedFile, precision: Precision, hanging: set[str]
    ) -> None:
        self.survey, self.reduced, self.precision = survey, reduced, precision
        #: targets that are left out
        self.out = np.array([name in hanging for name in reduced.target], dtype=bool)
        self.lengths = self._lengths()

    def write(self) -> None:
        """Directions, zenith angles and distances."""
        reduction, precision = self.reduced.reduction, self.precision
        circle = reduction.directions
        level, far = reduction.zeniths, reduction.distances
        turned, tilted, reached = self._occupied(circle, level, far)
        keys = list(zip(circle.setup.tolist(), circle.circle.tolist(), strict=True))
        # a direction alone says nothing: its orientation takes all of it
        kept = ~self.out[circle.target]
        count = Counter(key for key, keep in zip(keys, kept, strict=True) if keep)
        use = np.array([count[key] > 1 for key in keys], dtype=bool)
        orientation = [self._orientation(setup, turn) for setup, turn in keys]
        readings = circle.readings.astype(float)
        sigma = precision.of_directions(self._length(circle), readings, turned.ends)
        further = {"orientation": np.array(orientation, object), **turned.columns}
        self._add(Directions, circle, sigma, use, further)
        readings = level.readings.astype(float)
        sigma = precision.of_zeniths(self._length(level), readings, tilted.ends)
        further = {"refraction": np.full(len(level.value), precision.refraction), **tilted.columns}
        further |= share_refraction(
            self.survey,
            precision,
            self.reduced.raw.name,
            self._ends_of(ZenithAngles, level),
            self._length(level),
        )
        self._add(ZenithAngles, level, sigma, np.ones(len(level.value), dtype=bool), further)
        sigma = precision.of_distances(far.value, far.readings.astype(float), reached.ends)
        every = np.ones(len(far.value), dtype=bool)
        self._add(SlopeDistances, far, sigma, every, dict(reached.columns))

    def _occupied(self, circle: Means, level: Means, far: Means) -> list[Occupied]:
        """Errors of centring that directions, zenith angles and distances have in common."""
        kinds = ((Directions, circle), (ZenithAngles, level), (SlopeDistances, far))
        ends = [self._ends_of(kind, means) for kind, means in kinds]
        return occupy(self.survey, self.precision, self.reduced.raw.name, ends)

    def _ends_of(self, kind: type[Observations], means: Means) -> Ends:
        """Where means of a kind go, and from which set-up of a mark that has several."""
        names = self.reduced.station
        setup = np.full(len(names), "", dtype=object)
        for k in np.flatnonzero([(names == name).sum() > 1 for name in names]):
            setup[k] = f"set-up {k + 1}"
        return Ends(kind, self._starts(means), self._ends(means), setup[means.setup])

    def _orientation(self, setup: int, circle: int) -> str:
        """Name of the unknown of one position of the circle."""
        again = f", circle {circle + 1}" if circle else ""
        raw = self.reduced.raw
        return (
            f"orientation of {self.reduced.station[setup]}, set-up {setup + 1}{again} ({raw.name})"
        )

    def _lengths(self) -> dict[frozenset[str], float]:
        """Length of each line that has a distance, whichever end it was measured from."""
        far = self.reduced.reduction.distances
        ends = zip(self._starts(far), self._ends(far), strict=True)
        return {frozenset(pair): x for pair, x in zip(ends, far.value.tolist(), strict=True)}

    def _length(self, means: Means) -> Array:
        ends = zip(self._starts(means), self._ends(means), strict=True)
        return np.array([self.lengths.get(frozenset(pair), np.nan) for pair in ends], dtype=float)

    def _starts(self, means: Means) -> NDArray[Any]:
        names: NDArray[Any] = self.reduced.station[means.setup]
        return names

    def _ends(self, means: Means) -> NDArray[Any]:
        names: NDArray[Any] = self.reduced.target[means.target]
        return names

    def _add(
        self,
        kind: type[Observations],
        means: Means,
        sigma: Array | None,
        use: NDArray[np.bool_],
        further: dict[str, Any],
    ) -> None:
        use = use & ~self.out[means.target]
        if not use.any():
            return
        if sigma is None:
            raise InputError(
                f"the instrument has no sigma of a {kind.kind.replace('_', ' ')}",
                file=self.reduced.raw.path,
                cure="add it to the instrument of the project",
            )
        far = means.far[use]
        self.survey.add(
            kind,
            values=means.value[use],
            sigma=sigma[use],
            start=self._starts(means)[use],
            end=self._ends(means)[use],
            height_instrument=np.nan_to_num(self.reduced.raw.setups.height[means.setup[use]]),
            height_target=self.reduced.height[means.target[use]],
            source=[self.reduced.source(int(i)) for i in means.first[use]],
            use=np.where(far, Use.OFF, Use.ACTIVE).astype(np.int8),
            reason=np.where(far, FAR, "").astype(object),
            **{name: column[use] for name, column in further.items()},
        )


def _hanging(files: Sequence[ReducedFile]) -> set[str]:
    """Targets that no distance reaches and that are seen from one station only."""
    seen: dict[str, set[str]] = {}
    held: set[str] = set()
    for reduced in files:
        held |= set(reduced.station.tolist())
        held |= set(reduced.target[reduced.reduction.distances.target].tolist())
        for means in (reduced.reduction.directions, reduced.reduction.zeniths):
            starts, ends = reduced.station[means.setup], reduced.target[means.target]
            for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
                seen.setdefault(end, set()).add(start)
    return {name for name, stations in seen.items() if len(stations) < 2} - held


def _coordinates(survey: Survey, files: Sequence[RawFile], held: bool) -> None:
    """Coordinates of the files: start values of what was observed, and the datum.

    held : the network needs the given points themselves, since angles alone lead to one of them;
    otherwise it keeps its shape and is fitted to them. What was keyed in counts for more than what
    the instrument computed, the last more than before.
    """
    used: set[str] = set()
    for reduced in facts_of(survey.facts, ReducedFile):
        used |= {*reduced.station.tolist(), *reduced.target.tolist()}
    chosen: dict[str, tuple[Array, bool, str]] = {}
    for raw in files:
        p = raw.points
        for name, xyz, given, line in zip(p.name, p.xyz, p.given, p.line, strict=True):
            better = name not in chosen or given or not chosen[name][1]
            if name in used and better and np.isfinite(xyz).all():
                chosen[name] = (xyz, bool(given), raw.source(int(line)))
    places = {name: xyz for name, (xyz, _, _) in chosen.items()}
    if dummies := dummy_places(survey.network(), places) if len(places) > 1 else []:
        survey.warnings.append(dummy_words(dummies))
        chosen = {n: c for n, c in chosen.items() if not any(n in group for group in dummies)}
    keyed = {n: xyz for n, (xyz, given, _) in chosen.items() if given}
    wrong = contradiction(survey.network(), keyed, _soon)
    if wrong is not None:
        survey.warnings.append(wrong.sentence())
        # what the instrument computed follows from what was keyed in
        chosen = {n: c for n, c in chosen.items() if n in wrong.kept}
        for name in wrong.heights:
            xyz, given, source = chosen[name]
            chosen[name] = (np.array([*xyz[:2], np.nan]), given, source)
    fixed = tuple(name for name, (_, given, _) in chosen.items() if given)
    hold = held and len(fixed) >= 2
    # one place alone would keep the start values from a frame of their own
    for name, (xyz, given, source) in chosen.items() if len(chosen) >= 2 else ():
        if hold and given:
            survey.point(name, xyz, free=(False, False, False), role="control", source=source)
        else:
            survey.point(name, xyz, source=source)
    survey.datum = Datum("control") if hold else Datum("free", fixed if len(fixed) >= 2 else ())
    survey.warnings.append(_datum_words(len(fixed), hold, bool(dummies) or wrong is not None))


def _datum_words(given: int, hold: bool, dropped: bool) -> str:
    """What holds a network of raw files alone."""
    if hold:
        return f"The {given} points that the files give coordinates of are held."
    if given >= 2:
        return f"The network is fitted to the {given} points that the files give coordinates of."
    which = "no control" if not dropped else "no control that can be used"
    return (
        f"The files give {which}: all points carry the datum. Where coordinates have to be in a "
        "given system, state control points in a project ([[points]])."
    )
