"""A project that is killed, at whatever moment, and run again ends with the same bytes."""

import json
import random
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.io.keeping import MANIFEST, STATE_FOLDER
from tribrach.io.scans.formats import read_scans
from tribrach.io.twins import write_twin
from tribrach.questions.convert import convert_scans
from tribrach.simulate.twins import build

COMMAND = [sys.executable, "-c", "from tribrach.cli import main; main()", "run"]
#: the clouds of four formats take different ways to the disk; those in E57 are copies
FORMATS = ("laz", "copc", "ply", "e57")
#: no run takes longer, even on a busy machine [s]
PATIENCE = 300.0


def start(project: Path) -> subprocess.Popen[bytes]:
    return subprocess.Popen([*COMMAND, str(project), "--quiet"], stderr=subprocess.PIPE)


def finish(project: Path) -> float:
    """Run to the end; the seconds it took."""
    begun = time.monotonic()
    with start(project) as process:
        _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, said.decode()
    return time.monotonic() - begun


def finish_here(project: Path) -> None:
    """Run to the end in this process, which saves the time of starting another one."""
    result = CliRunner().invoke(app, ["run", str(project), "--quiet"])
    assert result.exit_code == 0, result.output


def kill(project: Path, after: float) -> bool:
    """SIGKILL so many seconds after the start; False if the run had ended before."""
    with start(project) as process:
        try:
            process.wait(after)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
    return process.returncode == -signal.SIGKILL


def kill_at(project: Path, sign: str) -> None:
    """SIGKILL as soon as a file of this pattern is in the results."""
    out, until = project.parent / "out", time.monotonic() + PATIENCE
    with start(project) as process:
        while not list(out.glob(sign)) and time.monotonic() < until:
            time.sleep(0.001)
        process.kill()
        process.communicate()
    assert process.returncode == -signal.SIGKILL


def results(project: Path) -> dict[str, bytes]:
    """Contents of everything that a run leaves: clouds, poses, reports, and what it remembers.

    Only the remembered digests of the scans are left out, for they hold paths and dates, and the
    dates in the list of what was written.
    """
    out = project.parent / "out"
    files = [path for path in out.rglob("*") if path.is_file()]
    assert not [path for path in files if path.name.startswith(".") or ".part" in path.name]
    kept = [path for path in files if not path.match(".tribrach/file-*")]
    contents = {str(path.relative_to(out)): path.read_bytes() for path in kept}
    listed = json.loads(contents[f"{STATE_FOLDER}/{MANIFEST}"])["written"]
    held = {name: [(one[0], *one[2:]) for one in known] for name, known in listed.items()}
    return contents | {f"{STATE_FOLDER}/{MANIFEST}": json.dumps(held).encode()}


def copied(project: Path, folder: Path) -> Path:
    """The project without results in a folder of its own."""
    shutil.copytree(project.parent, folder, ignore=shutil.ignore_patterns("out"))
    return folder / project.name


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two small scans of spheres in a courtyard; the project file."""
    twin = build("sphere-courtyard", 10_000, 1)
    stations = [station for station in twin.stations if station.name in ("S1", "S2")]
    scans = [one for one in twin.scans if one.name in ("S1-targets", "S2-targets")]
    small = replace(twin, stations=stations, scans=scans)
    return write_twin(small, tmp_path_factory.mktemp("job"), truth=0)


def of_format(job: Path, folder: Path, kind: str) -> Path:
    """The project with clouds of a format, in a folder of its own."""
    project = copied(job, folder)
    text = project.read_text()
    if kind == "e57":
        for scan in (folder / "scans").glob("*.laz"):
            convert_scans(
                read_scans(scan),
                scan.with_suffix(".e57"),
                placed=False,
                step=1e-5,
                progress=lambda *_: None,
            )
        text = text.replace(".laz", ".e57")
    project.write_text(text + f'\n[cloud]\nformat = "{kind}"\n')
    return project


def test_killed_beside_its_first_cloud(job: Path, tmp_path: Path) -> None:
    undisturbed, disturbed = copied(job, tmp_path / "a"), copied(job, tmp_path / "b")
    finish_here(undisturbed)
    kill_at(disturbed, "clouds/*.laz")
    for half in (
        "clouds/.S2.laz.part",
        ".report.html.x7.part",
        "pictures/.1-S1--1.webp.x7.part",
        "targets/.targets.json.x7.part",
        ".tribrach/.file.x7.part",
        ".tribrach/.made-1-2-S2.laz.part",
        ".tribrach/made-1-2-S2.laz",
    ):
        path = disturbed.parent / "out" / half
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"what a run leaves that is killed a moment later")
    finish_here(disturbed)
    whole = results(undisturbed)
    assert {"clouds/S1.laz", "clouds/S2.laz", "clouds/poses.csv", "result.json"} <= set(whole)
    assert results(disturbed) == whole


@pytest.mark.slow
@pytest.mark.parametrize("kind", FORMATS)
def test_killed_at_five_random_moments(job: Path, tmp_path: Path, kind: str) -> None:
    undisturbed, disturbed = (of_format(job, tmp_path / name, kind) for name in "ab")
    duration = finish(undisturbed)
    draw = random.Random(f"moments of {kind}")
    killed = [kill(disturbed, draw.uniform(0, duration)) for _ in range(5)]
    assert any(killed)
    finish(disturbed)
    whole = results(undisturbed)
    signs = ("report.html", "result.json", "clouds/poses.csv", "clouds/poses.json")
    assert set(signs) < set(whole)
    assert len([name for name in whole if name.startswith("clouds/S")]) == 2
    # targets, cloud and sampled surface of both scans
    for product in ("targets", "cloud", "surface"):
        assert len([name for name in whole if name.startswith(f".tribrach/{product}-")]) == 2
    assert results(disturbed) == whole


@pytest.mark.slow
def test_killed_beside_each_product(job: Path, tmp_path: Path) -> None:
    """At the moments that matter most: a file has just appeared."""
    undisturbed = of_format(job, tmp_path / "whole", "copc")
    finish(undisturbed)
    signs = (
        ".tribrach/targets-*",
        ".tribrach/.made-*.points.part",
        ".tribrach/.made-*-S2.copc.laz.part",
        "clouds/S1.*",
        ".tribrach/cloud-S1*",
    )
    for number, sign in enumerate(signs):
        disturbed = of_format(job, tmp_path / str(number), "copc")
        kill_at(disturbed, sign)
        finish(disturbed)
        assert results(disturbed) == results(undisturbed), sign
