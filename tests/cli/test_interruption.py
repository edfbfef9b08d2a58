"""Commands that are asked to end, that meet another run, or whose files change while they work."""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock, Timeout

from tests.job.test_killed import job as job
from tribrach.errors import InputError
from tribrach.io.folder_lock import FolderLock
from tribrach.io.keeping import STATE_FOLDER, keeping
from tribrach.io.outputs import write_text
from tribrach.io.twins import write_twin
from tribrach.pipeline import run
from tribrach.scratch import scratch_folder
from tribrach.simulate.twins import build

PATIENCE = 300.0
MAIN = "from tribrach.cli import main; main()"
HOLDING = """
import sys, time
from pathlib import Path
from tribrach.io.folder_lock import FolderLock
lock = FolderLock(Path(sys.argv[1]))
lock.take()
print("held", flush=True)
time.sleep(100)
"""
SCRATCH = """
import time
from tribrach.scratch import scratch_folder
with scratch_folder() as folder:
    (folder / "big").write_bytes(bytes(1000))
    print("made", flush=True)
    time.sleep(100)
"""


def start(code: str, *arguments: object, **environment: str) -> subprocess.Popen[str]:
    """Start Python, which hears Ctrl-C when this returns."""
    # tests that were started in the background hear none, and what they start would not either
    hearing = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    code = f"{hearing}; print('begun', flush=True)\n{code}"
    process = subprocess.Popen(
        [sys.executable, "-c", code, *map(str, arguments)],
        env=os.environ | environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    return process


def clouds(folder: Path, number: int) -> list[Path]:
    """Two clouds of a wall as PLY."""
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {number}\n"
        "property float x\nproperty float y\nproperty float z\nend_header\n"
    )
    paths = []
    for name in "ab":
        draw = np.random.default_rng(ord(name))
        path = folder / f"{name}.ply"
        with path.open("wb") as file:
            file.write(head.encode())
            for begin in range(0, number, 1_000_000):
                points = draw.uniform(0, 100, (min(1_000_000, number - begin), 3))
                points[:, 2] = draw.normal(scale=0.002, size=len(points))
                file.write(points.astype("<f4").tobytes())
        paths.append(path)
    return paths


@pytest.mark.parametrize("after", [0.2, 0.5, 1.0, 1.5])
def test_ctrl_c_at_any_moment_is_one_sentence(tmp_path: Path, after: float) -> None:
    with start(MAIN, "demo", "--out", tmp_path / "demo") as process:
        time.sleep(after)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=PATIENCE)
    # a busy machine may not have come to the first line of ours: then Python tells what it loads
    if "Traceback" in said:
        assert ", in main" not in said
    elif said:
        assert process.returncode == 130
        assert said.strip().splitlines()[-1] == "tribrach: interrupted; nothing was half-written"


def interrupted_comparison(folder: Path, number: int, code: str = MAIN) -> None:
    """Send SIGTERM to a comparison as soon as it has written something temporary."""
    a, b = clouds(folder, number)
    scratch = folder / "tmp"
    scratch.mkdir()
    with start(code, "compare", a, b, "--json", folder / "r.json", TMPDIR=str(scratch)) as process:
        until = time.monotonic() + PATIENCE
        while process.poll() is None and time.monotonic() < until:
            if any(path.is_file() and path.stat().st_size > 1e5 for path in scratch.rglob("*")):
                break
            time.sleep(0.01)
        assert process.poll() is None, process.communicate()
        process.terminate()
        _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + signal.SIGTERM, said
    assert said.strip() == "tribrach: interrupted; nothing was half-written"
    assert list(scratch.iterdir()) == []
    assert not (folder / "r.json").exists()


def test_sigterm_leaves_no_temporary_files(tmp_path: Path) -> None:
    # with less memory at hand, 300,000 points go through temporary files
    little = "import tribrach.comparison.tiles as tiles; tiles.SIZE = 30_000; "
    interrupted_comparison(tmp_path, 300_000, little + MAIN)


@pytest.mark.slow
def test_sigterm_to_a_large_comparison(tmp_path: Path) -> None:
    interrupted_comparison(tmp_path, 30_000_000)


def test_what_killed_processes_left_is_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with (
        start(SCRATCH, TMPDIR=str(tmp_path)) as killed,
        start(SCRATCH, TMPDIR=str(tmp_path)) as other,
    ):
        for process in (killed, other):
            assert process.stdout is not None
            assert process.stdout.readline() == "made\n"
        killed.kill()
        killed.wait()
        assert len(list(tmp_path.iterdir())) == 2
        monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
        with scratch_folder() as folder:
            left = set(tmp_path.iterdir()) - {folder.parent}
            assert [(path / "content" / "big").stat().st_size for path in left] == [1000]
        other.kill()


@pytest.mark.parametrize("removed", [False, True])
def test_a_folder_that_another_process_takes_for_abandoned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, removed: bool
) -> None:
    """Between the making of a folder and its lock somebody may come and remove it."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    acquire, turns = FileLock.acquire, []

    def late(lock: FileLock, **options: object) -> object:
        turns.append(lock)
        if len(turns) > 2:
            return acquire(lock, **options)
        if not removed:
            raise Timeout(lock.lock_file)
        taken = acquire(lock, **options)
        shutil.rmtree(Path(lock.lock_file).parent)
        return taken

    monkeypatch.setattr(FileLock, "acquire", late)
    with scratch_folder() as folder:
        assert folder.is_dir()
        assert list(tmp_path.iterdir()) == [folder.parent]
    assert len(turns) == 3
    assert not list(tmp_path.iterdir())


def test_two_runs_in_one_folder(job: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with start(HOLDING, out / STATE_FOLDER) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "held\n"
        with pytest.raises(InputError, match=rf"out: another run \(process {other.pid} on") as said:
            run(job, out)
        assert "is writing into this folder" in str(said.value)
        assert not (out / "report.html").exists()
        other.kill()
        other.wait()
    run(job, out)
    assert (out / "report.html").exists()


def test_two_threads_in_one_folder(tmp_path: Path) -> None:
    lock = FolderLock(tmp_path)
    thread = threading.Thread(target=lock.take)
    thread.start()
    thread.join()
    with pytest.raises(InputError, match="another run of this process"):
        FolderLock(tmp_path).take()
    lock.give_back()
    again = FolderLock(tmp_path)
    again.take()
    FolderLock(tmp_path).take()
    again.give_back()


@pytest.mark.parametrize("what", ["changed", "vanished"])
def test_inputs_that_change_during_a_run(tmp_path: Path, what: str) -> None:
    project = write_twin(build("newcastle-lab", 10_000), tmp_path / "job")
    control = project.parent / "control.csv"
    out = tmp_path / "out"

    def meanwhile(step: str, done: int, total: int | None) -> None:
        if control.exists() and control.stat().st_size < 10_000:
            if what == "changed":
                control.write_text(control.read_text() + "\n" * 10_000)
            else:
                control.unlink()

    with pytest.raises(InputError, match=f"control.csv: this file {what} while it was worked with"):
        run(project, out, meanwhile)
    assert not (out / "report.html").exists()
    assert not list(out.rglob("*.laz"))


def test_a_file_that_is_read_later_may_come_later(tmp_path: Path) -> None:
    """What was not there when it was named cannot have been half read."""
    with keeping([tmp_path / "later.csv"]):
        (tmp_path / "later.csv").write_text("A")
        write_text(tmp_path / "result.csv", "B")
    assert (tmp_path / "result.csv").read_text() == "B"
