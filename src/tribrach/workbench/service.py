"""What the server answers with, without a word of the web: scene, clouds, tables, the session.

Work that takes long is done in threads of its own; who listens hears of it by events. Of requests
that come in while another one is worked on, the newest counts.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel, ConfigDict

from tribrach._types import Array
from tribrach.errors import InputError, TribrachError
from tribrach.io.keeping import alone, keeping, looking
from tribrach.io.outputs import write_text
from tribrach.io.toml_model import quoted, read_model, read_text, with_comments
from tribrach.workbench.epochs import read_epochs
from tribrach.workbench.further import further_names
from tribrach.workbench.result_folder import CLOUDS, RESULT, ResultFolder, read_result
from tribrach.workbench.scene import decided_targets, scene_of
from tribrach.workbench.schema import FORM, SceneCloud, SceneDocument

# A view is the part of the address behind ``#``: layers, camera, colours and selection.


#: beside the project file
VIEWS = "views.toml"
#: views of a project, and characters of a name and of a view
_MOST, _NAME, _LENGTH = 500, 100, 20_000
_HEAD = "# Views of the workbench, by name: what stands behind # in its address.\n"


class _View(BaseModel):
    model_config = ConfigDict(extra="forbid")
    name: str
    hash: str


class _Views(BaseModel):
    model_config = ConfigDict(extra="forbid")
    view: list[_View] = []


def read_views(path: Path) -> dict[str, str]:
    """Views by name; none where there is no file."""
    if not path.is_file():
        return {}
    views = read_model(path, _Views, "a view has a name and a hash").view
    return {view.name: view.hash for view in views}


def keep_view(path: Path, name: str, place: str | None) -> dict[str, str]:
    """Save a view, or remove the one of a name."""
    name = name.strip()
    if not name or len(name) > _NAME or len(place or "") > _LENGTH:
        raise InputError(
            f"a view has a name of at most {_NAME} characters and a state of at most {_LENGTH}",
            cure="give it a short name",
        )
    with alone(path):
        text = read_text(path) if path.is_file() else ""
        views = read_views(path)
        if place is None:
            views.pop(name, None)
        else:
            views[name] = place
        if len(views) > _MOST:
            raise InputError(f"there are {_MOST} views already", cure="remove some")
        tables = [f"[[view]]\nname = {quoted(n)}\nhash = {quoted(h)}\n" for n, h in views.items()]
        with keeping(overwrite=True):
            write_text(path, with_comments(_HEAD, tables, text))
    return views


if TYPE_CHECKING:
    from tribrach.workbench.clouds import SceneCloudFile
    from tribrach.workbench.session import Session
    from tribrach.workbench.sources import PointSources

#: so long the end waits for work to stop [s]
_PATIENCE = 5.0
#: told of an event by its name and what belongs to it
Listener = Callable[[str, Mapping[str, Any]], None]


class Cancelled(TribrachError):
    """Somebody asked to stop."""


class Declined(TribrachError):
    """Something that was asked for and is not done."""

    def __init__(self, status: int, content: Mapping[str, Any]) -> None:
        super().__init__(str(content.get("sentence", "")))
        self.status, self.content = status, content


class Service:
    """A folder of results, and a session where there is one.

    ``scratch`` takes converted clouds where the folder may not be written; ``further`` are clouds
    besides those of the run; ``epochs`` is what ``tribrach epochs --json`` wrote.
    """

    def __init__(
        self,
        folder: Path,
        session: Session | None = None,
        scratch: Path | None = None,
        further: Sequence[Path] = (),
        epochs: Path | None = None,
    ) -> None:
        self.folder, self.session = folder, session
        self._further = list(zip(further, further_names(further), strict=True))
        self._epochs = [] if epochs is None else read_epochs(epochs)
        self._copies = folder if scratch is None else scratch
        self._lock = threading.RLock()
        self._listeners: list[Listener] = []
        self._stop, self._converting = threading.Event(), threading.Event()
        self._giving: threading.Thread | None = None
        self._unread = ""
        self._running: threading.Event | None = None
        self._threads: list[threading.Thread] = []
        self._load()
        if self._epochs:
            # refused before anything is served, not when the page asks
            _ = self.scene

    def _load(self) -> None:
        """Read the result and what lies beside it."""
        with looking():
            if self.session is None:
                result, beside = read_result(self.folder), ResultFolder.beside(self.folder)
            else:
                result, beside = self._of_session(self.session)
        with self._lock:
            self._result, self.beside = result, beside
            self._clouds: dict[str, SceneCloudFile] = {}
            self._parts: list[SceneCloud] = []
            self._pending: list[str] = []
            self._text: bytes | None = None
            self._scene: SceneDocument | None = None

    def _of_session(self, session: Session) -> tuple[dict[str, Any], ResultFolder]:
        """The network as it is now, with what the last run says of the scans."""
        now, folder = session.scene_input()
        try:
            last = read_result(folder)
            beside = ResultFolder.beside(folder)
        except InputError as error:
            last, beside = {}, ResultFolder()
            self._unread = str(error) if (folder / RESULT).is_file() else ""
        further = ("scans", "registration", "comparisons")
        kept = {key: last[key] for key in further if key in last}
        result = {**kept, **now}
        result["scans"] = decided_targets(result.get("scans"), session.targets())
        return result, beside

    @property
    def scene(self) -> SceneDocument:
        """The scene as it is now."""
        with self._lock:
            if self._scene is None:
                if self.session is not None:
                    self._result, _ = self._of_session(self.session)
                parts = sorted(self._parts, key=lambda part: part.name)
                live = self.session is not None
                scene = scene_of(
                    self._result, self.beside, parts, session=live, epochs=self._epochs
                )
                self._scene = replace(scene, pending=list(self._pending), lacking=self._lacking())
            return self._scene

    def _lacking(self) -> str:
        """Parts of the scans that cannot be shown, and the cure."""
        from tribrach.workbench.clouds import lacking_clouds

        if self.session is not None and self.beside.folder is None:
            if not self.session.project.scans:
                return ""
            if self._unread:
                return f"The last run cannot be shown ({self._unread}): press Run to make it anew."
            return (
                "This project was not run to its end yet, so there are no clouds to show: press "
                "Run to write them. What is shown of the network is adjusted."
            )
        return lacking_clouds(self._result, self.folder, self.beside.pose_file)

    @property
    def scene_text(self) -> bytes:
        """The scene as JSON."""
        with self._lock:
            if self._text is None:
                self._text = FORM.text(self.scene).encode()
            return self._text

    def changed(self) -> None:
        """Have the scene made anew when somebody asks for it."""
        with self._lock:
            self._scene = self._text = None

    @property
    def sources(self) -> PointSources:
        """What queries about points are answered from."""
        from tribrach.workbench.sources import PointSources

        scene, session = self.scene, self.session
        points = scene.points
        stations = scene.stations
        with self._lock:
            clouds = {cloud.name: cloud for cloud in self._clouds.values()}
        return PointSources(
            self.beside,
            _places(points.name, points.xyz, points.covariance),
            _places(stations.name, stations.xyz, stations.covariance),
            clouds,
            None if session is None else session.adjustment,
            1.0
            if session is None
            else session.adjustment.variance_factor(posterior=session.posterior),
        )

    def cloud(self, file: str) -> Path | None:
        """The COPC file that the page calls so, None if there is none."""
        with self._lock:
            cloud = self._clouds.get(file)
        return None if cloud is None else _whole_file(cloud.path)

    def picture(self, file: str) -> Path | None:
        """A picture that the run listed, None if there is none of that name."""
        path = self.beside.picture_file(file)
        return None if path is None else _whole_file(path)

    def start(self) -> None:
        """Begin to give out clouds, those that have to be converted after the others."""
        # what reads and writes clouds takes its time to load, and the page comes first
        self._give()

    def stop(self) -> None:
        """End what is going on; nothing half-written remains."""
        self._stop.set()
        self._converting.set()
        if self._running is not None:
            self._running.set()
        self.tell("stopped", {})
        for thread in self._threads:
            thread.join(_PATIENCE)

    def _begin(self, work: Callable[..., None], *values: Any) -> threading.Thread:
        """Do something in a thread of its own."""
        thread = threading.Thread(target=work, args=values, daemon=True, name=work.__name__)
        self._threads = [*(t for t in self._threads if t.is_alive()), thread]
        thread.start()
        return thread

    def _give(self) -> None:
        """Give out clouds in a thread of its own, until it is stopped."""
        if self.stopped:
            return
        # made here, so that what was begun a moment ago can be stopped too
        self._converting = threading.Event()
        self._giving = self._begin(self._give_clouds, self._converting)

    @property
    def stopped(self) -> bool:
        """Whether the end has come."""
        return self._stop.is_set()

    def _give_clouds(self, stop: threading.Event) -> None:
        from tribrach.workbench.clouds import (
            cloud_parts,
            convert_clouds,
            convert_further,
            written_clouds,
        )

        with self._lock:
            result, beside = self._result, self.beside
        folder = self.folder if beside.folder is None else beside.folder
        paths = sorted(written_clouds(result, folder), key=lambda path: path.stat().st_size)
        works = [(path, partial(convert_further, path, name)) for path, name in self._further]
        works += [(path, partial(convert_clouds, [path])) for path in paths]
        with self._lock:
            # what was given before it was stopped is not given again
            given = {cloud.source for cloud in self._clouds.values()}
            works = [work for work in works if work[0].name not in given]
            self._pending = [path.name for path, _ in works]
            self.changed()

        def ready(cloud: SceneCloudFile) -> None:
            parts = cloud_parts([cloud], beside.pose_file, upright=beside.frame.kind != "ecef")
            with self._lock:
                if beside is not self.beside:
                    raise Cancelled("the results are those of another run now")
                self._clouds[cloud.file] = cloud
                self._parts += parts
                self._pending.remove(cloud.source)
                self.changed()
            self.tell("clouds", {})

        progress = self._progress(stop)
        for path, convert in works:
            try:
                convert(self._copies, progress, ready)
            except Cancelled:
                return
            except (TribrachError, OSError) as error:
                # the other clouds are shown all the same
                with self._lock:
                    self._pending.remove(path.name)
                    self.changed()
                self.tell("failed", {"sentence": str(error)})

    def _progress(self, stop: threading.Event) -> Callable[[str, int, int | None], None]:
        """Tells listeners how far something is, and ends it when it is stopped."""

        def progress(what: str, done: int, total: int | None) -> None:
            if stop.is_set() or self.stopped:
                raise Cancelled("it was stopped")
            self.tell("progress", {"what": what, "done": done, "total": total})

        return progress

    def state(self) -> dict[str, Any]:
        """The state of the session."""
        state = dict(self._worked_on().state())
        state["adjusted"] = self.beside.frame.of_adjusted(state["adjusted"])
        running = self._running
        stopping = running is not None and running.is_set()
        return {**state, "running": running is not None, "stopping": stopping}

    def what_if(self, observation: str) -> Any:
        """What switching an observation off would do, from the factor at hand."""
        with self._answers():
            return self._worked_on().what_if(observation)

    def compare(self, a: str, b: str) -> Any:
        """Two states of the session: what moves, sigmas, tests."""
        states = [int(text) if text.isdecimal() else text for text in (a, b)]
        with self._answers():
            return self.beside.frame.of_adjusted(self._worked_on().compare(*states))

    def edit(self, given: Mapping[str, Any]) -> Any:
        """Change observations, targets or roles and adjust; tests follow as an event."""
        session, changes = self._worked_on(), given.get("changes")
        if not isinstance(changes, list) or not all(isinstance(c, dict) for c in changes):
            raise Declined(422, {"sentence": "Say which changes: a list of objects."})
        return self._adjusted(lambda: session.apply(_revision(given), changes))

    def undo(self, given: Mapping[str, Any]) -> Any:
        """Take the last change back."""
        session = self._worked_on()
        return self._adjusted(lambda: session.undo(_revision(given)))

    def redo(self, given: Mapping[str, Any]) -> Any:
        """Make the last change that was taken back again."""
        session = self._worked_on()
        return self._adjusted(lambda: session.redo(_revision(given)))

    def save(self, given: Mapping[str, Any]) -> Any:
        """Write the decisions beside the project."""
        with self._answers():
            path = _saved(self._worked_on())
        self.changed()
        return {"file": path.name, "state": self.state()}

    def _worked_on(self) -> Session:
        """The session."""
        if self.session is None:
            sentence = "These results are only looked at: open the project with tribrach workbench."
            raise Declined(404, {"sentence": sentence})
        return self.session

    @contextmanager
    def _answers(self) -> Iterator[None]:
        """What a session refuses, as the page takes it."""
        from tribrach.workbench.session import Conflict, Defect

        try:
            yield
        except Conflict as error:
            raise Declined(409, {"sentence": str(error), "state": self.state()}) from error
        except Defect as error:
            self.tell("defect", {"sentences": list(error.sentences)})
            raise Declined(422, {"defect": list(error.sentences)}) from error

    def _adjusted(self, work: Callable[[], Any]) -> Any:
        """Send an adjusted network to all pages and begin its tests."""
        with self._answers():
            adjusted = self.beside.frame.of_adjusted(work())
        self.changed()
        self.tell("adjusted", adjusted)
        revision = adjusted["revision"]
        self._begin(self._test, revision)
        return adjusted

    def _test(self, revision: int) -> None:
        """All tests of a revision; none where a newer one has come."""
        from tribrach.workbench.session import Superseded

        try:
            tested = self._worked_on().tests(revision)
        except Superseded:
            return
        except TribrachError as error:
            self.tell("failed", {"sentence": str(error)})
            return
        self.changed()
        self.tell("tested", tested)

    def run(self, given: Mapping[str, Any]) -> Any:
        """Save and run the whole project; progress and the end are events."""
        session = self._worked_on()
        with self._lock:
            if self._running is not None:
                raise Declined(409, {"sentence": "It is running already.", "state": self.state()})
            stop = self._running = threading.Event()
        try:
            with self._answers():
                _saved(session)
        except BaseException:
            self._running = None
            raise
        self._begin(self._run, stop)
        return {"running": True}

    def _run(self, stop: threading.Event) -> None:
        from tribrach import pipeline

        assert self.session is not None
        # what is converted meanwhile is of the old clouds, and one work at a time writes there
        self._converting.set()
        if self._giving is not None:
            self._giving.join()
        before, failed = _stamps(self.folder / CLOUDS), ""
        fault: Exception | None = None
        try:
            pipeline.run(self.session.project, self.folder, self._progress(stop))
        except Cancelled:
            failed = "The run was stopped; what it had made is kept for the next one."
        except (TribrachError, OSError) as error:
            failed = str(error)
        except Exception as error:
            # a fault of the program itself: who waits for the end must hear of it all the same
            failed, fault = f"The run ended by a fault of the program: {error!r}", error
        # before anybody is told, because who is told asks at once how it is now
        self._running = None
        if failed:
            self._failed(failed, _stamps(self.folder / CLOUDS) != before)
            if fault is not None:
                raise fault
            return
        with looking():
            self.session.ran()
        self._load()
        self.tell("ran", {})
        self._give()

    def _failed(self, sentence: str, written: bool) -> None:
        """Tell of a run that came to no end; go on with what it leaves.

        written : it had begun to write poses and clouds, so that they may be of two runs now.
        """
        if written:
            sentence = f"{sentence.rstrip('.')}."
            sentence += " The folder may hold poses and clouds of two runs now: run again."
            with suppress(InputError):
                self._load()
        self.tell("failed", {"sentence": sentence, "reload": written})
        self._give()

    def cancel(self, given: Mapping[str, Any]) -> Any:
        """Stop a run; what it has made so far is kept for the next one."""
        running = self._running
        if running is not None:
            running.set()
        return {"running": running is not None}

    def views(self) -> dict[str, str]:
        """Views that were saved by name."""
        return {} if self.session is None else read_views(self._views_file())

    def keep_view(self, given: Mapping[str, Any]) -> dict[str, str]:
        """Save a view under a name; without a place it is removed."""
        self._worked_on()
        name, place = given.get("name"), given.get("hash")
        if not isinstance(name, str) or not (place is None or isinstance(place, str)):
            raise Declined(422, {"sentence": "Say name and hash, both texts."})
        with self._lock:
            return keep_view(self._views_file(), name, place or None)

    def _views_file(self) -> Path:
        folder: Path = self._worked_on().project.folder
        return folder / VIEWS

    def relative(self, a: str, b: str) -> dict[str, Any]:
        """The distance of two places with its sigma; see :mod:`tribrach.workbench.relative`."""
        from tribrach.workbench.relative import relative

        return relative(self.sources, a, b)

    def point(self, cloud: str, x: str, y: str, z: str) -> dict[str, Any]:
        """All figures of a picked point; see :mod:`tribrach.workbench.point`."""
        from tribrach.workbench.point import point

        return point(self.sources, cloud, (x, y, z))

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Tell somebody of events from now on."""
        with self._lock:
            self._listeners.append(listener)

        def leave() -> None:
            with self._lock, suppress(ValueError):
                self._listeners.remove(listener)

        return leave

    def tell(self, event: str, content: Mapping[str, Any]) -> None:
        """Tell everybody who listens of an event."""
        with self._lock:
            listeners: Sequence[Listener] = tuple(self._listeners)
        for listener in listeners:
            listener(event, content)


def _places(
    names: Sequence[str], xyz: Sequence[Any], covariance: Sequence[Any]
) -> dict[str, tuple[Array, Array]]:
    """Places with their covariances (3, 3) by name; those without a coordinate are left out."""
    return {
        name: (np.array(place, dtype=float), np.array(block, dtype=float)[:3, :3])
        for name, place, block in zip(names, xyz, covariance, strict=True)
        if place is not None and None not in place and block is not None
    }


def _stamps(folder: Path) -> dict[str, tuple[int, int]]:
    """Size and date of every file of a folder, by which one sees that something was written."""
    if not folder.is_dir():
        return {}
    found = {path.name: path.stat() for path in folder.iterdir()}
    return {name: (status.st_size, status.st_mtime_ns) for name, status in found.items()}


def _saved(session: Session) -> Path:
    """Write the decisions; whether somebody else changed the file is known to the session."""
    with looking(), keeping(overwrite=True):
        return session.save()


def _revision(given: Mapping[str, Any]) -> int:
    """The revision that a change refers to."""
    revision = given.get("revision")
    if not isinstance(revision, int) or isinstance(revision, bool):
        raise Declined(422, {"sentence": "Say which revision the page shows."})
    return revision


def _whole_file(path: Path) -> Path | None:
    """A plain file in its own folder, without links; None otherwise."""
    try:
        if path.is_symlink() or not path.is_file():
            return None
        if path.resolve(strict=True) != path.parent.resolve(strict=True) / path.name:
            return None
    except OSError:
        return None
    return path
