"""A project open before a person: observations are switched, the network is adjusted again at once.

What the scans say comes from what an earlier run remembered; it is found anew where that does not
hold any more. A change goes the way of ``edits.toml``: the network is that of the project with the
decisions as :mod:`tribrach.job.edits` obeys them, and the steps are those of
:class:`tribrach.solution.Solving`, so the numbers are those of ``run`` and ``adjust`` with the same
file. A network of at most :data:`LARGE` values is adjusted as they do it, bit by bit. A larger one
starts from the last adjusted state instead of approximate values, unless inner constraints refer to
these; both end within the limits of :class:`tribrach.network.adjustment.Options` of the minimum.
"""

from __future__ import annotations

import datetime
import getpass
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from tribrach._types import Progress
from tribrach.errors import AdjustmentError, InputError, NotConverged, TribrachError, UnknownName
from tribrach.io.keeping import alone, keeping
from tribrach.io.outputs import write_text
from tribrach.io.toml_model import read_text
from tribrach.job.decided_targets import nearest
from tribrach.job.edits import obeyed
from tribrach.job.find_targets import Findings
from tribrach.job.opened import Job, open_job
from tribrach.job.results import JobResults
from tribrach.job.steps import FoundInScans, ScanWork, find, name_and_tie, refuse_lost
from tribrach.network.adjustment import Adjustment
from tribrach.network.blunders.snooping import restart
from tribrach.network.network import Network, PointRole, is_given
from tribrach.network.observation_rows import observation_rows
from tribrach.network.removal import what_if
from tribrach.observations.base import Use
from tribrach.project import Project
from tribrach.project.edits import (
    Edits,
    ObservationEdit,
    RoleEdit,
    TargetEdit,
    edits_text,
    read_edits,
)
from tribrach.registration.identify import is_tie_point
from tribrach.report import json_result
from tribrach.report.content import Report
from tribrach.solution import AdjustmentSettings, Solving, report
from tribrach.workbench.snapshots import (
    Snapshot,
    compared,
    last_run,
    moves,
    snapshot,
    with_tests,
)

#: columns of the table of observations that change with every adjustment
COLUMNS = (
    "residual", "redundancy", "w", "tau", "mdb", "external", "external_at", "suspicious", "state",
    "reason",
)  # fmt: skip
#: networks with more values than this start from where they were
LARGE = 5000
#: states whose places and tests are kept for comparison
KEPT = 200

_Entry = TypeVar("_Entry", ObservationEdit, RoleEdit, TargetEdit)


class Conflict(TribrachError):
    """A change was made to a state that is not the newest any more."""


class Superseded(TribrachError):
    """The tests of a state are not wanted any more, because there is a newer one."""


class Defect(TribrachError):
    """The network cannot be adjusted with a change; the state before it stays."""

    def __init__(self, sentences: Sequence[str]) -> None:
        self.sentences = tuple(sentences)
        super().__init__("; ".join(self.sentences))


class _Change(BaseModel):
    """What a page asks for; other keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    reason: str = ""


class _UseChange(_Change):
    do: Literal["use"]
    observation: str
    use: Literal["off", "check", "active"]


class _RoleChange(_Change):
    do: Literal["role"]
    point: str
    role: PointRole


class _TargetChange(_Change):
    do: Literal["target"]
    scan: str
    number: int = Field(ge=1)
    name: str | None = None
    accept: bool = True


_KINDS: dict[str, type[_Change]] = {
    "use": _UseChange,
    "role": _RoleChange,
    "target": _TargetChange,
}


@dataclass(frozen=True, eq=False)
class _Measured:
    """A network before uses and roles are decided, and what its scans add."""

    network: Network
    work: ScanWork | None


@dataclass(frozen=True, eq=False)
class _State:
    """One state of a session: the decisions, and the network adjusted with them."""

    revision: int
    edits: Edits
    measured: _Measured
    solving: Solving

    @property
    def adjustment(self) -> Adjustment:
        """The network adjusted."""
        return self.solving.adjustment


class Session:
    """A project that is worked on; every method may be called from any thread.

    Use :meth:`open`. Coordinates are of the work frame, in metres and radians.
    """

    def __init__(self, job: Job, found: FoundInScans | None, author: str) -> None:
        self._job, self._found, self._author = job, found, author
        self.settings = AdjustmentSettings.of(job.project)
        # one change at a time; short looks at the state take the other lock alone
        self._turn, self._lock = threading.RLock(), threading.RLock()
        self._built: dict[object, _Measured] = {}
        self._history: list[Edits] = [job.edits]
        self._at = 0
        self._saved = job.edits.model_dump()
        self._snapshots: dict[int, Snapshot] = {}
        self._decisions: dict[int, int] = {}
        self._tested: dict[str, Any] | None = None
        self._told: tuple[_State, Report] | None = None
        self._state = self._adjusted(1, job.edits, None)
        self._note(self._state)
        self._run = last_run(self.folder)

    @classmethod
    def open(
        cls,
        project: Project | str | Path,
        progress: Progress = lambda what, done, total: None,
        *,
        author: str | None = None,
    ) -> Session:
        """Open a project and adjust it once."""
        project = project if isinstance(project, Project) else Project.load(project)
        job = open_job(project, progress)
        found = None
        if project.scans:
            name = project.file_name
            with keeping(project.inputs(), project.results, command="run", kind=name):
                found = find(job, project.results, progress)
        return cls(job, found, _user() if author is None else author)

    @property
    def project(self) -> Project:
        """The project."""
        return self._job.project

    @property
    def folder(self) -> Path:
        """Folder of the results."""
        return self.project.results

    @property
    def posterior(self) -> bool:
        """True if covariances are scaled by the a-posteriori variance factor."""
        return self.settings.posterior

    @property
    def revision(self) -> int:
        """Number of the state; it grows with every change."""
        return self._state.revision

    @property
    def adjustment(self) -> Adjustment:
        """The network as it is adjusted now."""
        return self._state.adjustment

    @property
    def edits(self) -> Edits:
        """The decisions as they are now."""
        return self._state.edits

    def state(self) -> dict[str, Any]:
        """What a page needs to show the session, as plain values."""
        with self._lock:
            state, tested = self._state, self._tested
            return {
                "revision": state.revision,
                "edits": _listed(state.edits),
                "undo": self._at > 0,
                "redo": self._at < len(self._history) - 1,
                "saved": state.edits.model_dump() == self._saved,
                "states": ["run", *(str(revision) for revision in self._snapshots)],
                "decisions": {str(k): self._decisions[k] for k in self._snapshots},
                "ran": self._run is not None,
                "adjusted": self._as_adjusted(state, 0.0),
                "tested": tested,
            }

    def apply(self, revision: int, changes: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """Change uses, roles or targets, and adjust."""
        asked = [_parsed(change) for change in changes]
        if not asked:
            raise InputError("no change was asked for", cure="name an observation, point or target")
        with self._turn:
            self._refuse_old(revision)
            edits = self._state.edits
            for change in asked:
                edits = self._decided(edits, change)
            history = [*self._history[: self._at + 1], edits]
            return self._go(edits, history, len(history) - 1)

    def undo(self, revision: int) -> dict[str, Any]:
        """Take the last change back; returns and raises what :meth:`apply` does."""
        return self._step(revision, -1, "there is nothing to take back")

    def redo(self, revision: int) -> dict[str, Any]:
        """Make the change again that was taken back; returns and raises what :meth:`apply` does."""
        return self._step(revision, 1, "nothing was taken back")

    def save(self) -> Path:
        """Write the decisions beside the project."""
        path = self.project.edits_file
        with self._turn, alone(path):
            there, text = (read_edits(path), read_text(path)) if path.exists() else (Edits(), "")
            if there.model_dump() != self._saved:
                raise InputError(
                    "this file was changed since the session read it",
                    file=path,
                    cure="move it away or open the project again",
                )
            edits = self._state.edits
            write_text(path, edits_text(edits, text))
            with self._lock:
                self._saved = edits.model_dump()
            return path

    def ran(self) -> None:
        """Compare with the results of the run that has just ended."""
        with self._lock:
            self._run = last_run(self.folder)

    def tests(self, revision: int) -> dict[str, Any]:
        """Test the state: all figures of all observations."""
        began = time.perf_counter()
        with self._lock:
            state, tested = self._state, self._tested
        if state.revision != revision:
            raise Superseded(f"state {revision} is not the newest any more")
        if tested is not None:
            return tested
        quality = state.solving.quality
        if self.revision != revision:
            raise Superseded(f"state {revision} is not the newest any more")
        adjustment = state.adjustment
        if adjustment.network.count() <= LARGE:
            content = self._content(state)
            observations, warnings = content.observations, list(content.warnings)
        else:
            # what else looks wrong is looked for when the whole state is asked for
            observations = observation_rows(adjustment, quality)
            warnings = list(adjustment.warnings)
        rows = {name: observations.column(name) for name in COLUMNS}
        rows["external_at"] = np.array([name or None for name in rows["external_at"]], dtype=object)
        chance = quality.chance
        out = {
            "revision": revision,
            "columns": {name: _column(rows[name]) for name in COLUMNS},
            "beyond": chance.beyond,
            "tests": chance.tests,
            "expected": chance.expected,
            "warnings": warnings,
            "seconds": time.perf_counter() - began,
        }
        with self._lock:
            if self._state is not state:
                raise Superseded(f"state {revision} is not the newest any more")
            self._tested = out
            snap = self._snapshots[revision]
            self._snapshots[revision] = with_tests(snap, observations)
        return out

    def what_if(self, observation: str) -> dict[str, Any]:
        """Predict what switching an observation off, or on, would do; nothing is adjusted again.

        ``sigma0``, ``dof``, ``largest`` with ``name`` and ``moved`` [m], and ``words``; numbers are
        None where the network needs the observation.
        """
        with self._lock:
            state = self._state
        adjustment = state.adjustment
        table, item = self._place(adjustment.network, observation)
        found = what_if(adjustment, table, item)
        verb = "Without" if found.takes_part else "With"
        if found.needed:
            words = f"{verb} it something of the network is open: nothing else controls it."
            return {"sigma0": None, "dof": found.dof, "largest": None, "words": words}
        name = adjustment.layout.position_name(found.largest) if found.largest >= 0 else ""
        moved = float(np.linalg.norm(found.moved[found.largest])) if name else 0.0
        sigma0 = None if found.dof <= 0 else found.sigma0
        now = adjustment.sigma0_posterior
        figure = "no redundancy is left" if sigma0 is None else f"sigma0 {now:.3f} -> {sigma0:.3f}"
        return {
            "sigma0": sigma0,
            "dof": found.dof,
            "largest": {"name": name, "moved": moved},
            "words": f"{verb} it: {figure}, {name} moves {1000 * moved:.2f} mm most.",
        }

    def compare(self, a: int | str, b: int | str) -> dict[str, Any]:
        """Two states side by side: moves from a to b, sigmas, tests."""
        return compared(self._snapshot(a), self._snapshot(b))

    def targets(self) -> list[dict[str, Any]]:
        """Targets that were found in scans, with their names and what was decided about them.

        Numbers count from 1 in each scan, as the finders left them; centres are in the scanner
        frame. A rejected target has the name that it would have if none were rejected.
        """
        with self._lock:
            state = self._state
        if self._found is None:
            return []
        names = _names(state.measured.work)
        unrejected = self._names_unrejected(state.edits)
        out = []
        for finding in self._found.findings:
            for number, detection in enumerate(finding.detections, start=1):
                entry = _entry(state.edits, finding, number)
                out.append(
                    {
                        "scan": finding.scan,
                        "number": number,
                        "kind": detection.kind,
                        "center": [float(x) for x in detection.center],
                        "name": names(finding, number)
                        if entry is None or entry.accept
                        else unrejected(finding, number),
                        "accepted": entry is None or entry.accept,
                        "reason": "" if entry is None else entry.reason,
                    }
                )
        return out

    def _names_unrejected(self, edits: Edits) -> Callable[[Findings, int], str]:
        """Names of targets as they are if none is rejected; as they are where that cannot be."""
        kept = tuple(target for target in edits.target if target.accept)
        if len(kept) == len(edits.target):
            return _names(None)
        try:
            with self._lock:
                return _names(self._measured(edits.model_copy(update={"target": kept})).work)
        except TribrachError:
            # what was rejected may be what cannot be matched
            return _names(None)

    def scene_input(self) -> tuple[dict[str, Any], Path]:
        """The network as it is now by the keys of ``result.json``, and the folder of results."""
        return json_result.network(self.content()), self.folder

    def content(self) -> Report:
        """The report of the state, without what is made of clouds."""
        with self._lock:
            state = self._state
        return self._content(state)

    def _content(self, state: _State) -> Report:
        """The report of a state; that of the newest is kept."""
        kept = self._told
        if kept is not None and kept[0] is state:
            return kept[1]
        work = state.measured.work
        registered = None if work is None else work.registered
        results = JobResults(self.project, self._job.sessions, registered=registered)
        content = report(state.solving.solved, self.settings, self.project.facts, results)
        self._told = state, content
        with self._lock:
            snap = self._snapshots.get(state.revision)
            if snap is not None and not snap.tests:
                self._snapshots[state.revision] = with_tests(snap, content.observations)
        return content

    def _step(self, revision: int, by: int, otherwise: str) -> dict[str, Any]:
        """Go back or forth in the history."""
        with self._turn:
            self._refuse_old(revision)
            at = self._at + by
            if not 0 <= at < len(self._history):
                raise InputError(otherwise)
            return self._go(self._history[at], self._history, at)

    def _refuse_old(self, revision: int) -> None:
        if revision != self.revision:
            raise Conflict(f"the state is {self.revision} by now, the change was for {revision}")

    def _go(self, edits: Edits, history: list[Edits], at: int) -> dict[str, Any]:
        """Adjust with other decisions and make that the state."""
        began = time.perf_counter()
        state = self._adjusted(self.revision + 1, edits, self._state)
        with self._lock:
            self._state, self._history, self._at = state, history, at
            self._tested = None
            self._note(state)
            return self._as_adjusted(state, time.perf_counter() - began)

    def _note(self, state: _State) -> None:
        """Keep places and covariances of a state."""
        self._snapshots[state.revision] = snapshot(
            state.adjustment, self.settings.posterior, self.settings.confidence
        )
        self._decisions[state.revision] = len(_listed(state.edits))
        while len(self._snapshots) > KEPT:
            oldest = min(self._snapshots)
            del self._snapshots[oldest], self._decisions[oldest]

    def _as_adjusted(self, state: _State, seconds: float) -> dict[str, Any]:
        """A state as plain values."""
        now = self._snapshots[state.revision]
        return {
            "revision": state.revision,
            "sigma0": dict(now.sigma0),
            **moves(now, self._before),
            "edits": _listed(state.edits),
            "seconds": seconds,
        }

    @property
    def _before(self) -> Snapshot:
        """What moves are counted from: the last run, or the state when the project was opened."""
        return self._opened if self._run is None else self._run

    @cached_property
    def _opened(self) -> Snapshot:
        return self._snapshots[min(self._snapshots)]

    def _snapshot(self, which: int | str) -> Snapshot:
        with self._lock:
            if which == "run":
                return self._before
            known = {str(revision): snap for revision, snap in self._snapshots.items()}
        if str(which) not in known:
            raise UnknownName("state", str(which), ["run", *known])
        return known[str(which)]

    def _adjusted(self, revision: int, edits: Edits, last: _State | None) -> _State:
        """The network with these decisions, adjusted from where it was."""
        try:
            measured = self._measured(edits)
            network = obeyed(measured.network, edits)
            near = network
            if last is not None and network.count() > LARGE:
                near = _restarted(network, last.adjustment)
            solving = Solving(near, self.settings)
            try:
                adjustment = solving.adjustment
            except NotConverged:
                if near is network:
                    raise
                solving = Solving(network, self.settings)
                adjustment = solving.adjustment
            if measured.work is not None:
                refuse_lost(self._job, measured.work, adjustment)
        except AdjustmentError as error:
            raise Defect([error.headline, *error.sentences]) from error
        return _State(revision, edits, measured, solving)

    def _measured(self, edits: Edits) -> _Measured:
        """The network before uses and roles: built anew where they have to do with the names."""
        key = self._key(edits)
        if key not in self._built:
            job = self._job.decided(edits)
            if self._found is None:
                made = _Measured(job.measured(job.surveyed()), None)
            else:
                work = name_and_tie(job, self._found, lambda what, done, total: None)
                survey = job.surveyed(work.registered.survey)
                whole = work.registered.survey is not None
                made = _Measured(job.measured(survey, whole=whole), work)
            if len(self._built) > 8:
                self._built.pop(next(iter(self._built)))
            self._built[key] = made
        return self._built[key]

    def _key(self, edits: Edits) -> str:
        """What the network depends on before uses and roles are decided.

        Targets are matched to the marks that the survey knows, so decisions about its observations
        count; planes and clouds are tied through a first adjustment of everything.
        """
        if self._found is None:
            return ""
        if self.project.registration.by != ("targets",):
            return repr(edits)
        points, observations = self._marks
        near = {
            "edit": tuple(edit for edit in edits.edit if edit.observation in observations),
            "role": tuple(role for role in edits.role if role.point in points),
        }
        return repr(edits.model_copy(update=near))

    @cached_property
    def _marks(self) -> tuple[frozenset[str], frozenset[str]]:
        """Points, and ids and sources of observations, that targets may be matched by."""
        try:
            network = self._job.survey.of_marks(active=False).network()
        except InputError:
            return frozenset(), frozenset()
        sources = [str(s) for o in network.observations for s in o.source]
        ids = [str(i) for column in network.ids for i in column]
        return frozenset(network.start.layout.names["point"]), frozenset((*ids, *sources))

    def _decided(self, edits: Edits, change: _Change) -> Edits:
        """Decisions with one more; one that only says what is so anyway is none."""
        if not change.reason.strip():
            raise InputError("the change has no reason", cure="say why")
        said: dict[str, Any] = {"reason": change.reason.strip(), "by": self._author, "at": _now()}
        if isinstance(change, _UseChange):
            network = self._measured(edits).network
            table, item = self._place(network, change.observation)
            own = ObservationEdit(observation=change.observation, use=change.use, **said)
            kept = tuple(e for e in edits.edit if e.observation != change.observation)
            was = Use(int(network.observations[table].use[item])).name.lower()
            # a decision about all that stands at one place may lie beneath
            alone = all(e.observation in self._ids(network) for e in kept)
            new = kept if was == change.use and alone else (*kept, own)
            return edits.model_copy(update={"edit": new})
        if isinstance(change, _RoleChange):
            role = RoleEdit(point=change.point, role=change.role, **said)
            others = tuple(r for r in edits.role if r.point != change.point)
            same = _role(self._measured(edits).network, change.point) == change.role
            return edits.model_copy(update={"role": others if same else (*others, role)})
        assert isinstance(change, _TargetChange)
        return self._target_decided(edits, change, said)

    def _target_decided(
        self, edits: Edits, change: _TargetChange, said: Mapping[str, Any]
    ) -> Edits:
        """Decisions with one more about a target."""
        finding = self._finding(change)
        detection = finding.detections[change.number - 1]
        old = _entry(edits, finding, change.number)
        others = tuple(t for t in edits.target if t is not old)
        name = (change.name or "").strip() or None
        if change.accept and name is None and old is not None and not old.accept:
            # taken back: it gets the name that is found for it
            return edits.model_copy(update={"target": others})
        if change.accept and name is None:
            name = _names(self._measured(edits).work)(finding, change.number)
        if change.accept and (not name or is_tie_point(name)):
            what = f"it is {name}" if name else "it has no name"
            raise InputError(
                f"target {change.number} of {change.scan} cannot be confirmed: {what}, and such a "
                "name follows from what else is found",
                cure="give it a name of its own",
            )
        x, y, z = (float(value) for value in detection.center)
        entry = TargetEdit(
            scan=change.scan,
            center=(round(x, 5), round(y, 5), round(z, 5)),
            name=name if change.accept else None,
            accept=change.accept,
            **said,
        )
        return edits.model_copy(update={"target": (*others, entry)})

    def _finding(self, change: _TargetChange) -> Findings:
        """Findings in the scan of a target."""
        findings = () if self._found is None else self._found.findings
        by_scan = {finding.scan: finding for finding in findings}
        if change.scan not in by_scan:
            raise UnknownName("scan with targets", change.scan, by_scan)
        finding = by_scan[change.scan]
        if change.number > len(finding.detections):
            raise InputError(
                f"{change.scan} has {len(finding.detections)} targets, and none of the number "
                f"{change.number}"
            )
        return finding

    def _place(self, network: Network, observation: str) -> tuple[int, int]:
        """Table and number of an observation by its id."""
        ids = self._ids(network)
        if observation not in ids:
            raise UnknownName("observation", observation, ids)
        return ids[observation]

    def _ids(self, network: Network) -> Mapping[str, tuple[int, int]]:
        """Table and number by id; those of a network do not change with uses."""
        key = network.ids
        if getattr(self, "_ids_of", None) is not key:
            self._by_id = {
                str(name): (table, item)
                for table, column in enumerate(key)
                for item, name in enumerate(column)
            }
            self._ids_of = key
        return self._by_id


def _parsed(change: Mapping[str, Any]) -> _Change:
    """A change as a page or a program gives it."""
    kind = _KINDS.get(str(change.get("do")))
    if kind is None:
        raise UnknownName("change", str(change.get("do")), _KINDS)
    try:
        return kind.model_validate(dict(change))
    except ValidationError as error:
        detail = error.errors()[0]
        key = ".".join(str(part) for part in detail["loc"])
        raise InputError(f"the change cannot be understood: {key}: {detail['msg']}") from error


def _restarted(network: Network, last: Adjustment) -> Network:
    """A network that starts from where it was, if it has the same unknowns."""
    return restart(network, last) if last.layout == network.start.layout else network


def _role(network: Network, point: str) -> str:
    """What the given coordinates of a point are for in a network that nobody changed."""
    layout = network.start.layout
    if not layout.has("point", point):
        raise UnknownName("point", point, layout.names["point"])
    uses = {
        int(o.use[item])
        for o in network.observations
        if is_given(type(o), o.group)
        for item in np.flatnonzero(o.end_names(layout)[0] == point)
    }
    index = layout.index("point", point)
    free, xyz = network.free[3 * index : 3 * index + 3], network.start.points[index]
    held = not free.all() and bool(np.isfinite(xyz[~free]).any())
    if Use.ACTIVE in uses or (held and not uses):
        return "control"
    return "check" if Use.CHECK in uses else "free"


def _listed(edits: Edits) -> list[dict[str, Any]]:
    """Decisions as plain values, each with its kind and number."""
    return [
        {"do": do, "number": number, **entry.model_dump(mode="json", exclude_none=True)}
        for do, entries in (("use", edits.edit), ("role", edits.role), ("target", edits.target))
        for number, entry in enumerate(entries, start=1)
    ]


def _entry(edits: Edits, finding: Findings, number: int) -> TargetEdit | None:
    """The decision about a target; None if there is none."""
    detection = finding.detections[number - 1]
    for target in edits.target:
        if target.scan == finding.scan:
            found = nearest(finding.detections, np.array(target.center))
            if found is detection:
                return target
    return None


def _names(work: ScanWork | None) -> Callable[[Findings, int], str]:
    """Names of targets by scan and number, "" where a target has none."""
    if work is None or work.named is None:
        return lambda finding, number: ""
    named = work.named

    def name(finding: Findings, number: int) -> str:
        """That of the target itself, or of the more precise sight of it from the same station."""
        detection = finding.detections[number - 1]
        own = named.targets.get(finding.station, ())
        names = named.identification.names.get(finding.station, ())
        gaps = [float(np.linalg.norm(d.center - detection.center)) for d in own]
        if not gaps or not names:
            return ""
        k = int(np.argmin(gaps))
        return names[k] if gaps[k] <= max(0.02, detection.radius, own[k].radius) else ""

    return name


def _column(values: Any) -> list[Any]:
    """A column as JSON takes it: None for NaN."""
    if values.dtype.kind == "f" and np.isnan(values).any():
        out = values.astype(object)
        out[np.isnan(values)] = None
        return list(out.tolist())
    return list(values.tolist())


def _now() -> datetime.datetime:
    """Date and time of a decision, without what is smaller than a second."""
    return datetime.datetime.now().replace(microsecond=0)


def _user() -> str:
    """The user of the computer, as far as it says."""
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return ""
