"""Runs every command on degenerate inputs and judges what comes back.

A result is a finding if it is not finite, or off the truth by more than nine times its sigma; an
end is one if it is no sentence. Warnings are errors, and a case may take so much time and memory.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from typer.testing import CliRunner

from tests.algorithms.clouds import MOST, Random, random_cloud, room, write_ply
from tests.algorithms.networks import random_network
from tribrach.cli import app
from tribrach.shell import flow

#: what a case may take: time [s], memory beyond what the process has [bytes]
SECONDS, MEMORY = 60, 2 << 30
#: sigmas that a result may be off the truth, and what no covariance knows [m]
SIGMAS, FLOOR = 9.0, 1e-5


@dataclass(frozen=True)
class Found:
    """Something that should not have happened."""

    seed: int
    command: str
    inputs: str
    what: str

    def __str__(self) -> str:
        return f"case {self.seed}: {self.command} on {self.inputs}\n{self.what}"


@dataclass(frozen=True)
class Case:
    """A command on inputs, and what its JSON has to agree with."""

    words: list[str]
    inputs: str
    judge: Callable[[Any], str] | None = None


def _cloud(words: list[str], count: int = 1) -> Callable[[Path, Random], Case]:
    """A command on so many clouds, which are the same or alike now and then."""

    def made(folder: Path, rng: Random) -> Case:
        files, told = [], []
        for k in range(count):
            file = folder / f"{'ab'[k]}.ply"
            if k and rng.random() < 0.2:
                shutil.copy(files[0], file)
                told.append("its copy")
            else:
                told.append(random_cloud(file, rng))
            files.append(file)
        return Case([*words, *map(str, files)], " | ".join(told))

    return made


def _placed(folder: Path, rng: Random) -> Case:
    """Two scans in a room whose pose is known."""
    shift, turn = rng.uniform(-0.8, 0.8, 3) * [1, 1, 0.3], rng.uniform(0, 2 * np.pi)
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    noise = float(rng.choice([0.0, 1e-4, 3e-3]))
    a = room(rng, MOST)
    b = room(rng, MOST, shift) @ rotation
    for name, xyz in (("a", a), ("b", b)):
        write_ply(folder / f"{name}.ply", xyz + rng.normal(size=xyz.shape) * noise)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, shift

    def judge(data: Any) -> str:
        for group in data["groups"]:
            for name, one in group["stations"].items():
                if name == group["frame_of"]:
                    continue
                found = np.array(one["world_from_scanner"], dtype=float)
                sigma = np.sqrt(np.diag(np.array(one["covariance"], dtype=float))[:3])
                off = np.abs(found[:3, 3] - matrix[:3, 3])
                if (off > SIGMAS * sigma + FLOOR).any():
                    return f"{name} is {off} m off, stated {sigma}"
        return ""

    return Case(
        ["register", *(str(folder / f"{n}.ply") for n in "ab")], f"a room, noise {noise} m", judge
    )


def _network(words: list[str], *more: str) -> Callable[[Path, Random], Case]:
    """A command on a network."""

    def made(folder: Path, rng: Random) -> Case:
        told, true = random_network(folder, rng)
        options = [o for o in more if rng.random() < 0.5]

        def judge(data: Any) -> str:
            for name, one in data["points"].items():
                at = None if true is None else true.get(name)
                if at is None or None in one["xyz"]:
                    continue
                sigma = np.sqrt(np.diag(np.array(one["covariance"], dtype=float)))
                off = np.abs(np.array(one["xyz"], dtype=float) - at)
                if (off > SIGMAS * sigma + FLOOR).any():
                    return f"{name[:20]} is {off} m off, stated {sigma}"
            return ""

        checked = judge if words == ["adjust"] and "flat" in told else None
        return Case([*words, str(folder / "p.toml"), *options], told, checked)

    return made


def _export(folder: Path, rng: Random) -> Case:
    told, _ = random_network(folder, rng)
    to = str(rng.choice(["gkf", "dynaml", "starnet"]))
    words = ["export", str(folder / "p.toml"), "--to", to, "--partial"]
    return Case([*words, "--out", str(folder / "x.out")], told)


def _epochs(folder: Path, rng: Random) -> Case:
    told, projects = [], []
    for name in ("1", "2"):
        (folder / name).mkdir()
        told.append(random_network(folder / name, rng)[0])
        projects.append(str(folder / name / "p.toml"))
    if rng.random() < 0.3:
        projects[1] = projects[0]
    return Case(["epochs", *projects], " | ".join(told))


def _convert(folder: Path, rng: Random) -> Case:
    told = random_cloud(folder / "a.ply", rng)
    suffix = str(rng.choice([".laz", ".las", ".copc.laz", ".ply", ".e57"]))
    return Case(["convert", str(folder / "a.ply"), str(folder / f"o{suffix}")], told + suffix)


def _points(folder: Path, rng: Random, name: str) -> str:
    """A list of points for transformations."""
    n = int(rng.choice([0, 1, 2, 3, 4, 10]))
    sort = str(rng.choice(["any", "equal", "collinear", "coplanar", "tiny", "huge"]))
    xyz = np.random.default_rng(7).uniform(-10, 10, (10, 3))[:n]
    if sort == "equal":
        xyz[:] = 1.0
    elif sort == "collinear":
        xyz = np.arange(n)[:, None] * np.array([[1.0, 2.0, 3.0]])
    elif sort == "coplanar":
        xyz[:, 2] = 0.0
    elif sort in ("tiny", "huge"):
        xyz = xyz * (1e-12 if sort == "tiny" else 1e7)
    lines = [f"P{k},{x!r},{y!r},{z!r}" for k, (x, y, z) in enumerate(xyz.tolist())]
    (folder / name).write_text("\n".join(["point,x_m,y_m,z_m", *lines]) + "\n")
    return f"{n} points, {sort}"


def _transform(folder: Path, rng: Random) -> Case:
    told = _points(folder, rng, "a.csv")
    told += " | " + ("itself" if rng.random() < 0.3 else _points(folder, rng, "b.csv"))
    second = "a.csv" if told.endswith("itself") else "b.csv"
    words = ["transform", "fit", str(folder / "a.csv"), str(folder / second)]
    check = ["--check", "P1"] if rng.random() < 0.3 else []
    return Case([*words, *check], told)


def _field(folder: Path, rng: Random) -> Case:
    """A field check: one target, one place, one station, one face."""
    stations, targets = int(rng.integers(1, 4)), int(rng.integers(1, 7))
    sort = str(rng.choice(["any", "one place", "stations at one place", "one face", "no noise"]))
    at = (
        rng.uniform(-5, 5, (stations, 3))
        if sort != "stations at one place"
        else np.zeros((stations, 3))
    )
    to = rng.uniform(-30, 30, (targets, 3)) + 40
    if sort == "one place":
        to[:] = to[0]
    rows = ["scan,point,set,face,range_m,horizontal_deg,zenith_deg"]
    for s in range(stations):
        for t in range(targets):
            for face in (1,) if sort == "one face" else (1, -1):
                way = to[t] - at[s]
                noise = rng.normal(size=3) * (0.0 if sort == "no noise" else 1.0)
                r = float(np.linalg.norm(way)) + noise[0] * 1e-3
                h = np.degrees(np.arctan2(way[0], way[1])) + noise[1] * 2e-3
                z = np.degrees(np.arccos(way[2] / np.linalg.norm(way))) + noise[2] * 2e-3
                rows.append(f"S{s},T{t},1,{face},{r:.5f},{h % 360:.6f},{z:.6f}")
    (folder / "t.csv").write_text("\n".join(rows) + "\n")

    def judge(data: Any) -> str:
        unseen = (
            stations < 2
            or targets < 3
            or sort in ("one place", "one face", "stations at one place")
        )
        return "passed without evidence" if unseen and data["passed"] else ""

    words = ["check", str(folder / "t.csv"), "--range-mm", "1.2", "--angle-arcsec", "8"]
    return Case(words, f"{stations} stations, {targets} targets, {sort}", judge)


def _series(folder: Path, rng: Random) -> Case:
    """Cycles of a prism and three references: few, still, at one time, with gaps."""
    cycles = int(rng.integers(0, 8))
    sort = str(rng.choice(["noisy", "no noise", "one time", "gap", "one target", "summer time"]))
    places = {"R1": (40.0, 5, 1), "R2": (-30.0, 40, 2), "R3": (5.0, -50, 0), "P": (30.0, 30, 3)}
    rows = ["time,station,target,direction_gon,zenith_gon,slope_distance_m"]
    for k in range(cycles):
        for n, (name, place) in enumerate(places.items()):
            if (sort == "one target" and name != "P") or (sort == "gap" and rng.random() < 0.5):
                continue
            xyz = np.array(place, dtype=float)
            noise = rng.normal(size=3) * (0.0 if sort == "no noise" else 1.0) * [1e-4, 1e-4, 5e-4]
            r = float(np.linalg.norm(xyz))
            h = (np.arctan2(xyz[0], xyz[1]) / np.pi * 200 + noise[0]) % 400
            z = np.arccos(xyz[2] / r) / np.pi * 200 + noise[1]
            hour = 0 if sort == "one time" else k
            time = f"2026-10-25T{hour:02d}:00:{n:02d}"
            if sort == "summer time":  # the hour that comes twice
                time = f"2026-10-25T{(1, 2, 2, 3, 4, 5, 6)[k % 7]:02d}:30:{n:02d}"
            rows.append(f"{time},S,{name},{h:.6f},{z:.6f},{r + noise[2]:.6f}")
    (folder / "s.csv").write_text("\n".join(rows) + "\n")
    lines = [f"{name},{e},{m},{u}" for name, (e, m, u) in places.items() if name != "P"]
    (folder / "c.csv").write_text("\n".join(["point,e_m,n_m,u_m", *lines, "S,0,0,0"]) + "\n")
    words = ["series", str(folder / "s.csv"), "--points", str(folder / "c.csv")]
    return Case(words, f"{cycles} cycles, {sort}")


#: how often a command is tried, and what makes a case of it
MAKERS: tuple[tuple[int, Callable[[Path, Random], Case]], ...] = (
    (3, _cloud(["info"])),
    (6, _convert),
    (4, _cloud(["complete"])),
    (3, _cloud(["noise"])),
    (3, _cloud(["targets", "--sphere", "0.07"])),
    (2, _cloud(["targets", "--checkerboard", "0.3"])),
    (2, _cloud(["targets", "--disc", "0.1"])),
    (4, _cloud(["compare"], 2)),
    (2, _cloud(["regress"])),
    (3, _cloud(["register"], 2)),
    (1, _placed),
    (14, _network(["adjust"], "--snoop", "--vce")),
    (2, _network(["check-project"])),
    (2, _network(["plan"])),
    (2, _network(["calibrate"])),
    (4, _export),
    (4, _epochs),
    (5, _transform),
    (5, _field),
    (3, _series),
)
#: commands that write no JSON or no page
_NO_JSON = ("convert", "export", "check-project")
_NO_PAGE = (*_NO_JSON, "info", "transform", "targets")


@contextmanager
def limits() -> Iterator[None]:
    """So much time for a case; the next one gets as much."""

    def late(number: int, frame: object) -> None:
        raise TimeoutError(f"more than {SECONDS} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(SECONDS)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def bounded() -> None:
    """Bound the memory of this process."""
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY + (6 << 30), hard))


def run(seed: int) -> Found | None:
    """Make a case of a number, run it, judge it."""
    rng = np.random.default_rng(seed)
    weights = np.array([weight for weight, _ in MAKERS], dtype=float)
    maker = MAKERS[int(rng.choice(len(MAKERS), p=weights / weights.sum()))][1]
    folder = Path(tempfile.mkdtemp(prefix="algorithms-"))
    faults: list[str] = []

    def kept(error: BaseException) -> None:
        faults.append("".join(traceback.format_exception(error)))

    before, there = flow.write_fault, Path.cwd()
    flow.write_fault = kept
    try:
        os.chdir(folder)
        case = maker(folder, rng)
        words, out = list(case.words), folder / "r.json"
        command = words[0]
        if command not in _NO_JSON:
            words += ["--json", str(out)]
        if command not in _NO_PAGE and rng.random() < 0.5:
            words += ["--html", str(folder / "r.html")]
        with limits(), warnings.catch_warnings():
            warnings.simplefilter("error")
            result = CliRunner().invoke(app, words)
        what = _judged(case, result, out, faults)
        return Found(seed, " ".join(words[:2]), case.inputs, what) if what else None
    finally:
        flow.write_fault = before
        os.chdir(there)
        shutil.rmtree(folder, ignore_errors=True)


def _judged(case: Case, result: Any, out: Path, faults: list[str]) -> str:
    """What is wrong with an end; "" if nothing is."""
    if faults:
        return faults[0]
    if result.exit_code not in (0, 2):
        trace = "".join(traceback.format_exception(*result.exc_info)) if result.exc_info else ""
        return f"exit {result.exit_code}\n{trace}"
    if result.exit_code == 2 and "Usage:" in result.output:
        return f"no such words: {result.output[-600:]}"
    if result.exit_code == 2 and not any(
        line.startswith("tribrach: ") for line in result.output.splitlines()
    ):
        return f"no sentence: {result.output[-600:]}"
    if result.exit_code == 2 or not out.exists():
        return ""

    def refused(word: str) -> float:
        raise ValueError(f"{word} in JSON")

    try:
        data = json.loads(out.read_text(), parse_constant=refused)
    except ValueError as error:
        return str(error)
    return "" if case.judge is None else case.judge(data)


def findings(first: int, cases: int) -> Iterator[Found]:
    """Run cases of numbers one after the other."""
    for seed in range(first, first + cases):
        found = run(seed)
        if found is not None:
            yield found
