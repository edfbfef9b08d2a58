"""A plan while proposals come to it: stations, targets, moves, what can be spared, sets.

Each proposal is judged by updates of one covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Array, Progress
from tribrach.answers import Number, Result, Vector
from tribrach.errors import InputError, NoStartValues, RankDefect
from tribrach.network.adjustment import Adjustment
from tribrach.network.assembly import Assembly
from tribrach.network.network import Network
from tribrach.network.roles import used_axes
from tribrach.observations.declaration import Category
from tribrach.planning.blocks import join
from tribrach.planning.groups import coming, going, prospect_for
from tribrach.planning.prediction import Criterion, fixed_datum, predict, with_parameters
from tribrach.planning.search import Pick, best_moves, propose
from tribrach.planning.weights import (
    RequiredPrecision,
    SetsByStation,
    needed_precision,
    needed_sets,
)
from tribrach.questions.plan.lever_arm import PLANNED
from tribrach.questions.plan.scans import ScannerPlace
from tribrach.questions.plan.survey import PlanSurvey, named, read_places
from tribrach.simulate.sight_lines import surface_places


@dataclass(frozen=True)
class DesignProposal(Result, keys={"sort": "add", "place": "xyz"}):
    """A target or station to add, with the criterion before and after it."""

    sort: str
    name: str
    place: Vector
    before: Number
    after: Number


@dataclass(frozen=True)
class Relocation(Result, keys={"place": "xyz"}):
    """A target that would stand better elsewhere, with the criterion before and after."""

    name: str
    to: str
    place: Vector
    before: Number
    after: Number


@dataclass(frozen=True)
class Spare(Result):
    """A target or station, the criterion with and without it; null where the plan needs it."""

    sort: str
    name: str
    before: Number
    after: Number


def axes_of(adjustment: Adjustment) -> int:
    """Coordinates that points of a network have."""
    return int(used_axes(adjustment).sum())


class PlanWork:
    """A plan while proposals come to it."""

    def __init__(self, survey: PlanSurvey, criterion: Criterion, progress: Progress) -> None:
        self.survey, self.plan, self.progress = survey, survey.plan, progress
        self.criterion, self.named = criterion, criterion.names
        self.targets: dict[str, Array] = {}
        self.stations: dict[str, ScannerPlace] = {}
        self.proposals: list[DesignProposal] = []
        self.single: dict[str, float] = {}
        self.judged_at: tuple[str, ...] = ()
        self.looked_at: dict[str, Array] = {}
        self.warnings: list[str] = []
        self.judged = 0
        self._places: dict[str, Array] | None = None

    def settle(self) -> Criterion:
        """The criterion about all points of the plan as it stands, where none were named."""
        if not self.named:
            points = self.network().start.layout.names["point"]
            self.criterion = replace(self.criterion, names=points)
        return self.criterion

    def network(self) -> Network:
        """The plan as it stands."""
        return self.survey.network(self.targets, self.stations)

    def prediction(self) -> Adjustment:
        """Its prediction, in the datum that stays while points come and go."""
        return predict(self._comparable(()))

    def _comparable(self, without: Sequence[str]) -> Network:
        """The plan with inner constraints that proposals do not touch."""
        return fixed_datum(self.network(), (*self.targets, *without))

    def cover(self) -> None:
        """Stations needed to determine all, one by one, first the one that sees most of it."""
        while True:
            try:
                self.prediction()
            except (NoStartValues, RankDefect):
                if len(self.proposals) >= self.plan.add_stations:
                    raise
            else:
                return
            open_points = _open_points(self.network())
            targets = {n: self.survey.points[n] for n in open_points if n in self.survey.points}
            places = self._station_places()
            seen = self.survey.scans.seen(places, targets).sum(axis=1)
            if not len(seen) or not seen.max():
                # says in sentences what is open
                self.prediction()
                return
            name = list(places)[int(np.argmax(seen))]
            self.stations[name] = places[name]
            place = places[name].position
            self.proposals.append(
                DesignProposal("station", name, place, float("nan"), float("nan"))
            )

    def _station_places(self) -> dict[str, ScannerPlace]:
        """Places where stations could be and are not."""
        if self.plan.station_places is None:
            return {}
        return {
            name: ScannerPlace(xyz, np.eye(3))
            for name, xyz in self._places_of(self.plan.station_places).items()
            if name not in self.stations
        }

    def _places_of(self, file: str) -> dict[str, Array]:
        """The places of a file, which are none of the project."""
        path = self.survey.project.folder / file
        places = read_places(path, self.survey.context)
        for name in places:
            if name in self.survey.points or name in self.survey.stations:
                raise InputError(
                    f"{name} is a point or station of the project already",
                    file=path,
                    cure="give the place another name",
                )
        return places

    def _target_places(self) -> dict[str, Array]:
        """Places where targets could be and are not."""
        if self._places is None:
            self._places = self._all_target_places()
        return {n: x for n, x in self._places.items() if n not in self.targets}

    def _all_target_places(self) -> dict[str, Array]:
        survey = self.survey
        if self.plan.target_places is not None:
            return self._places_of(self.plan.target_places)
        scene = survey.scans.scene
        stations = survey.stations | self.stations
        if scene is None or self.plan.spacing_m is None:
            carrying = [] if survey.arm is None else survey.arm.stations
            around = next((stations[n].position for n in carrying if n in stations), None)
            if survey.arm is None or around is None:
                return {}
            return named(survey.arm.places(around), "P", set(survey.points) | set(stations))
        candidates = surface_places(
            scene,
            np.array([place.position for place in stations.values()]).reshape(-1, 3),
            self.plan.spacing_m,
            longest=self.plan.longest_m,
            steepest=float(np.radians(self.plan.steepest_deg)),
        )
        return named(list(candidates.round(2)), "P", set(survey.points) | set(stations))

    def add_stations(self, count: int) -> None:
        """Propose up to so many stations."""
        places = self._station_places() if count > 0 else {}
        for pick in self._search({}, places, count, "stations"):
            name = list(places)[pick.number]
            self.stations[name] = place = places[name]
            found = DesignProposal("station", name, place.position, pick.before, pick.after)
            self.proposals.append(found)

    def add_targets(self, count: int) -> None:
        """Propose up to so many targets."""
        places = self._target_places() if count > 0 else {}
        for pick in self._search(places, {}, count, "targets"):
            name = list(places)[pick.number]
            self.targets[name] = place = places[name]
            self.proposals.append(DesignProposal("target", name, place, pick.before, pick.after))

    def _search(
        self, targets: dict[str, Array], stations: dict[str, ScannerPlace], count: int, what: str
    ) -> Sequence[Pick]:
        """The places that serve most."""
        names = [*targets, *stations]
        if not names:
            return ()
        self.looked_at |= targets | {name: place.position for name, place in stations.items()}
        self.progress(f"{len(names)} places of {what}", 0, None)
        base = self.prediction()
        further = self.survey.candidates(targets, stations, base.network)
        if further is None:
            self.warnings.append(f"no place of {what} is seen, or sees anything")
            return ()
        now = prospect_for(base, self.criterion, [further])
        parts = coming(base, now, further, {name: k for k, name in enumerate(names)})
        search = propose(now, parts, count, self.plan.required(axes_of(base)))
        self.judged += search.judged
        unseen = len(names) - sum(len(part) for part in parts)
        if unseen:
            self.warnings.append(f"{unseen} of {len(names)} places of {what} are seen by nothing")
        if not self.single:
            self.single = {
                names[int(k)]: float(v)
                for k, v in zip(search.number, search.single, strict=False)
                if np.isfinite(v)
            }
        return search.picks

    def _movable(self) -> list[str]:
        """Targets that only scanners see, which nothing holds where they are."""
        scanned = set(self.survey.targets)
        network = self.network()
        layout = network.start.layout
        tied: set[str] = set(self.plan.keep) | set(self.named)
        for o in network.observations:
            of_scans = o.facts.own_category is Category.OWN_TARGETS
            if not of_scans and o.group != PLANNED:
                tied |= {name for ends in o.ends(layout) for name in ends}
        return [n for n in layout.names["point"] if n in scanned and n not in tied]

    def relocations(self, count: int) -> tuple[Relocation, ...]:
        """The best other places of single targets."""
        movable, places = self._movable(), self._target_places() if count else {}
        if not count or not movable or not places:
            return ()
        self.progress(f"{len(movable)} targets at {len(places)} other places", 0, None)
        base = predict(self._comparable(movable))
        further = self.survey.candidates(places, {}, base.network)
        if further is None:
            return ()
        criterion = self._without(movable, base)
        now = prospect_for(base, criterion, [further], movable)
        names = list(places)
        parts = coming(base, now, further, {name: k for k, name in enumerate(names)})
        moves = best_moves(now, going(base, now, movable), parts)
        self.judged += len(movable) * sum(len(part) for part in parts)
        return tuple(
            Relocation(movable[m.gone], names[m.come], places[names[m.come]], m.before, m.after)
            for m in moves[:count]
        )

    def _without(self, names: Sequence[str], base: Adjustment) -> Criterion:
        """The criterion about points that stay, where none are named."""
        if self.named:
            self.judged_at = self.named
            return self.criterion
        stay = tuple(n for n in base.layout.names["point"] if n not in names)
        self.judged_at = stay or base.layout.names["pose"]
        return replace(self.criterion, names=self.judged_at)

    def spares(self) -> tuple[Spare, ...]:
        """What the plan does without each movable target and each planned station."""
        movable = self._movable()
        stations = [
            n
            for n in (*self.survey.planned, *self.stations)
            if n not in self.plan.keep and n not in self.named
        ]
        names = [*movable, *stations]
        if not names:
            return ()
        self.progress(f"the plan without each of {len(names)}", 0, None)
        base = predict(self._comparable(movable))
        criterion = self._without(movable, base)
        now = prospect_for(base, criterion, going_names=names)
        blocks = join(going(base, now, names))
        scores, before = now.judge(blocks, -1), now.value()
        self.judged += len(blocks)
        return tuple(
            Spare(
                "station" if names[int(k)] in stations else "target",
                names[int(k)],
                before,
                float(value),
            )
            for k, value in zip(blocks.number, scores.value, strict=True)
        )

    def weights(
        self, required: float | None
    ) -> tuple[SetsByStation | None, tuple[RequiredPrecision, ...]]:
        """Sets and sigmas that the requirement takes."""
        if required is None:
            return None, ()
        network = self._comparable(())
        self.progress("sets", 0, None)
        sets = needed_sets(network, self.criterion, required)
        self.progress("sigmas", 0, None)
        return sets, tuple(needed_precision(network, self.criterion, required))


def _open_points(network: Network) -> list[str]:
    """Points that their own observations do not determine, were everything else known."""
    network = with_parameters(network)
    assembly = Assembly(network)
    design = assembly.design(network.start)
    layout = network.start.layout
    out = []
    columns = assembly.reduced[layout.columns("point", np.arange(layout.count("point")))]
    for name, own in zip(layout.names["point"], columns, strict=True):
        free = own[own >= 0]
        part = design[:, free].toarray()
        part = part[np.abs(part).any(axis=1)]
        if np.linalg.matrix_rank(part) < len(free):
            out.append(name)
    return out
