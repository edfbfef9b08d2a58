"""Writes a twin to disk: scans, tables, project file, and the truth.

Campaigns at one site share a folder: each has its project file there and a folder of its name for
its scans and its truth.

``truth/truth.json`` holds poses, points and what each station can see; ``truth/truth-SCAN.npz`` the
true places of a random share of the points that are no mixture of several surfaces: ``point`` (n,)
in the order of the file, ``xyz`` (n, 3) world [m]; also how many points the scan has, and a digest
of what it was made from: a scan that is there and whole is not simulated again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import fields
from importlib.metadata import version
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from tribrach.errors import InputError
from tribrach.io.arrays import read_named
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.json_text import json_text
from tribrach.io.keeping import keeping, refuse_loss, refuse_mixture
from tribrach.io.outputs import write_bytes, write_texts
from tribrach.scan.scan import Field
from tribrach.simulate.scanner import SimulatedPoints
from tribrach.simulate.twin import Twin, TwinScan, child_rng

#: coordinate step on disk [m]
STEP = 1e-5
#: points of a scan whose truth is kept
TRUTH = 100_000

#: fields of a scanner whose text is not the same in every run, or in every order
_MODEL = ("model", "parameters")

_FIELDS = (
    Field("intensity", "float32", 0.0, 1.0, "light received, 1 from white at the best range"),
    Field("row", "int32", description="row of the grid"),
    Field("column", "int32", description="column of the grid"),
)


def write_twin(
    twin: Twin,
    folder: Path,
    progress: Callable[[str, int, int], None] | None = None,
    truth: int = TRUTH,
    *,
    overwrite: bool = False,
) -> Path:
    """Simulate all scans of a twin and write everything.

    Scans that are there and whole stay as they are, and if all of them are, so do the tables and
    the project file. Otherwise the project file is removed first and written last: an interrupted
    call leaves no project, and another call goes on with it.
    """
    tell = progress or (lambda name, done, all_of_it: None)
    rays = sum(scan.rays for one in (twin, *twin.later) for scan in one.scans)
    kind = f"{twin.name} --seed {twin.seed} with {rays} rays"
    with keeping((), folder, overwrite=overwrite, command="simulate", kind=kind):
        path, *_ = [_write(one, folder, _of(one, tell), truth) for one in (twin, *twin.later)]
        return path


def _of(twin: Twin, tell: Callable[[str, int, int], None]) -> Callable[[str, int, int], None]:
    """Progress that says of which campaign a scan is."""
    if not twin.campaign:
        return tell
    return lambda name, done, rays: tell(f"{name} of {twin.campaign}", done, rays)


def _write(twin: Twin, folder: Path, tell: Callable[[str, int, int], None], truth: int) -> Path:
    """Write everything that is not there."""
    path = folder / twin.project_file
    recipes = [_recipe(twin, number, truth) for number in range(len(twin.scans))]
    known = [_made(folder, twin, k, recipe) for k, recipe in enumerate(recipes)]
    kept = path.is_file() and None not in known
    if not kept:
        new = [one for one, done in zip(twin.scans, known, strict=True) if done is None]
        names = (*twin.files, path.name, _truth(twin), *(_file(twin, one) for one in new))
        refuse_mixture(folder)
        places = (_truth_file(folder, twin, one) for one in new)
        for place in (*(folder / name for name in names), *places):
            refuse_loss(place)
        _clear(folder, folder / twin.campaign, path)
    counts = {}
    for number, one in enumerate(twin.scans):
        done = known[number]
        if done is None:
            done = _write_scan(twin, number, folder, tell, truth, recipes[number])
        counts[one.name] = done
        tell(one.name, one.rays, one.rays)
    texts: dict[Path, str | bytes] = {folder / name: text for name, text in twin.files.items()}
    texts[folder / _truth(twin)] = json_text(truth_of(twin, counts), indent=1) + "\n"
    texts[path] = project_text(twin)
    write_texts({p: t for p, t in texts.items() if not (kept and p.is_file())})
    return path


def _clear(folder: Path, campaign: Path, path: Path) -> None:
    """Remove the project file, and files that a killed simulation left half-written."""
    places = {folder, campaign, campaign / "scans", campaign / "truth"}
    parts = [p for place in places for p in place.glob(".*.part")]
    try:
        for each in (path, *parts):
            if each.is_file():
                each.unlink()
    except OSError as error:
        raise InputError(
            f"the file cannot be replaced ({error.strerror})", file=path, cure="check the folder"
        ) from error


def _recipe(twin: Twin, number: int, truth: int) -> str:
    """Digest of everything that a scan and the tables of its project are made from."""
    one, scanner, scene = twin.scans[number], twin.scanner, twin.scene
    words = [version("tribrach"), twin.name, twin.seed, number, truth, STEP, one.name, one.grid]
    words += [sorted(scanner.parameters.items()), scanner.model.name]
    words += [getattr(scanner, f.name) for f in fields(scanner) if f.name not in _MODEL]
    words += [sorted(twin.files.items()), project_text(twin)]
    state = hashlib.blake2b(repr(words).encode(), digest_size=20)
    arrays = [scene.kind, scene.center, scene.axes, scene.half, scene.reflectance, scene.pattern]
    arrays += [twin.station(one.station).pose.matrix]
    for array in arrays if one.mask is None else [*arrays, one.mask]:
        state.update(np.ascontiguousarray(array).tobytes())
    return state.hexdigest()


def _made(folder: Path, twin: Twin, number: int, recipe: str) -> int | None:
    """Number of points of a scan that is there, whole and made in this way; None otherwise."""
    one = twin.scans[number]
    try:
        data = read_named(_truth_file(folder, twin, one), "recipe", "points", "contents")
        if str(data["recipe"]) != recipe:
            return None
        points, written = int(data["points"]), str(data["contents"])
        return points if written == _contents(folder / _file(twin, one)) else None
    except (OSError, InputError, ValueError, TypeError):
        return None


def _contents(path: Path) -> str:
    """Digest of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "blake2b").hexdigest()


def _file(twin: Twin, one: TwinScan) -> str:
    return f"{_prefix(twin)}scans/{one.name}{twin.suffix}"


def _prefix(twin: Twin) -> str:
    """The folder of a campaign, with its slash; empty where there is but one."""
    return f"{twin.campaign}/" if twin.campaign else ""


def _truth(twin: Twin) -> str:
    """File of its poses and points."""
    return f"{_prefix(twin)}truth/truth.json"


def _truth_file(folder: Path, twin: Twin, one: TwinScan) -> Path:
    return folder / twin.campaign / "truth" / f"truth-{_title(twin, one)}.npz"


def _write_scan(
    twin: Twin,
    number: int,
    folder: Path,
    tell: Callable[[str, int, int], None],
    truth: int,
    recipe: str,
) -> int:
    """Write one scan and its truth."""
    one = twin.scans[number]
    header = CloudHeader(one.name, _FIELDS, step=STEP)
    keeper = _Keeper(truth, child_rng(twin.seed, "truth"))
    done, path = 0, folder / _file(twin, one)
    tell(one.name, 0, one.rays)
    with create(path, header) as writer:
        for block in twin.measure(number):
            values = {"intensity": block.intensity, "row": block.row, "column": block.column}
            writer.write(block.xyz, values)
            keeper.take(block)
            done += block.rays
            tell(one.name, done, one.rays)
    if truth and keeper.seen:
        made = {"recipe": recipe, "points": keeper.seen, "contents": _contents(path)}
        write_bytes(_truth_file(folder, twin, one), keeper.packed(made))
    return keeper.seen


class _Keeper:
    """Keeps the truth of a random share of points that come in blocks."""

    def __init__(self, count: int, rng: np.random.Generator) -> None:
        self._count, self._rng, self.seen, self.mixed = count, rng, 0, 0
        self._lot, self._point, self._xyz = (
            np.empty(0),
            np.empty(0, dtype=np.int64),
            np.empty((0, 3)),
        )

    def take(self, block: SimulatedPoints) -> None:
        """Take a block into account; the points with the smallest lots stay."""
        alone = np.flatnonzero(~block.mixed)
        lot = np.concatenate([self._lot, self._rng.random(len(alone))])
        keep = np.sort(np.argsort(lot)[: self._count])
        self._lot = lot[keep]
        self._point = np.concatenate([self._point, self.seen + alone])[keep]
        self._xyz = np.concatenate([self._xyz, block.truth[alone]])[keep]
        self.seen += len(block)
        self.mixed += len(block) - len(alone)

    def packed(self, made: dict[str, Any]) -> bytes:
        """Numbers in the file and world coordinates as npz, with the facts ``made`` of the scan."""
        buffer = BytesIO()
        np.savez(buffer, point=self._point, xyz=self._xyz, **made)
        return buffer.getvalue()


def _title(twin: Twin, one: TwinScan) -> str:
    """Name of the scan in a project, where a station may have several."""
    alone = sum(other.station == one.station for other in twin.scans) == 1
    return one.station if alone or one.name == one.station else f"{one.station} {one.name}"


def project_text(twin: Twin) -> str:
    """The project file: the twin's own sections, then its scans and stations."""
    parts = [twin.project]
    for one in twin.scans:
        parts.append(
            f'[[scans]]\nfile = "{_file(twin, one)}"\nstation = "{one.station}"\n'
            'instrument = "scanner"\norigin = "scanner"\n'
        )
    parts += list(_station_sections(twin))
    if twin.campaign:
        # what a later campaign is compared with
        parts.append(f'[output]\nfolder = "out/{twin.campaign}"\nangle = "gon"\nepoch = true\n')
    else:
        parts.append('[output]\nfolder = "out"\nangle = "gon"\n')
    return "\n".join(parts)


def _station_sections(twin: Twin) -> Iterator[str]:
    """A section of the project file for each station."""
    arms = twin.facts.get("lever_arms", {})
    for station in twin.stations:
        text = f"[stations.{station.name}]\nlevelled = {str(station.levelled).lower()}\n"
        text += 'instrument = "scanner"\n'
        if station.name in arms:
            text += f'lever_arm = "{arms[station.name]}"\n'
        yield text


def truth_of(twin: Twin, counts: dict[str, int]) -> dict[str, Any]:
    """The truth as JSON: metres, radians, poses as 4x4 world from scanner."""
    return {
        "twin": twin.name,
        "seed": twin.seed,
        "stations": {
            s.name: {
                "world_from_scanner": s.pose.matrix.tolist(),
                "levelled": s.levelled,
                "visible": twin.visible(s.name),
                "sights": {n: vars(sight) for n, sight in twin.sights[s.name].items()},
            }
            for s in twin.stations
        },
        "targets": {
            t.name: {
                "kind": t.kind,
                "size": t.size,
                "normal": None if t.normal is None else t.normal.tolist(),
            }
            for t in twin.targets
        },
        "points": {
            **{name: np.asarray(x).tolist() for name, x in twin.marks.items()},
            **{t.name: t.center.tolist() for t in twin.targets},
        },
        "scans": {
            one.name: {
                "file": _file(twin, one),
                "station": one.station,
                "points": counts.get(one.name, 0),
                "step": one.grid.step,
            }
            for one in twin.scans
        },
        "calibration": dict(twin.scanner.parameters),
        "facts": dict(twin.facts),
    }
