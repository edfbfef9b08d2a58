"""A second process compiles ahead of a command, ends with it, and never stands in its way."""

import inspect
import os
import runpy
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import psutil
import pytest
from filelock import FileLock

from tribrach import compiling_ahead as ahead
from tribrach.kernels import Kernel

ROOT = Path(__file__).resolve().parents[1]
PATIENCE = 300.0
#: kernels that compile in some tenths of a second, among lines that are out of date
BOUNDS = "cloud.summary\t_bounds\tfloat64[:,::1], float64[::1], float64[::1]"
STALE = (
    "demo\tno.such.module\t_loop\tint64\n"
    "demo\tcloud.summary\t_no_such_kernel\tint64\n"
    "demo\tcloud.summary\t_bounds\tint64\n"
    "demo\tcloud.summary\t_bounds\tno_type_of_numba\n"
)


def test_every_line_of_the_list_names_a_kernel_and_types_for_its_arguments() -> None:
    commands = import_module("tribrach.cli.commands").COMMANDS
    lines = [line.split("\t") for line in ahead._LIST.read_text().splitlines()]
    assert len({tuple(kernel) for _, *kernel in lines}) == len(lines) > 20
    for names, module, name, types in lines:
        assert set(names.split()) <= commands.keys()
        kernel = getattr(import_module(f"tribrach.{module}"), name)
        function = kernel.py_func
        assert isinstance(kernel, Kernel) or hasattr(kernel, "signatures"), (module, name)
        inspect.signature(function).bind(*ahead.types_of(types))


@pytest.mark.slow
def test_the_demo_compiles_what_the_list_says(tmp_path: Path) -> None:
    script = runpy.run_path(str(ROOT / "docs" / "make_kernel_list.py"))
    words = ["demo", "--quiet", "--points", "100000"]
    found = script["compiled"](words, tmp_path, tmp_path / "kernels")
    unknown = set(found) - set(ahead.kernels_of("demo"))
    assert unknown == set(), "run docs/make_kernel_list.py"


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty place for compiled code, and a list with stale lines and one kernel."""
    folder = tmp_path / "kernels"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    monkeypatch.setenv(ahead.SWITCH, "1")
    monkeypatch.setattr(ahead, "_LIST", tmp_path / "list.tsv")
    monkeypatch.setattr(ahead, "_helps", lambda: True)
    ahead._LIST.write_text(f"{STALE}demo run\t{BOUNDS}\n")
    # the second process has the same list
    place = f"pathlib.Path({str(ahead._LIST)!r})"
    other = f"import pathlib, tribrach.compiling_ahead as ahead; ahead._LIST = {place}"
    before, after = ahead._CODE.split("from tribrach", 1)
    monkeypatch.setattr(ahead, "_CODE", f"{before}{other}\nfrom tribrach{after}")
    return folder


def stored(cache: Path) -> int:
    return len(list(cache.rglob("*.nbc")))


def until(true: Callable[[], bool]) -> None:
    """Wait until a function says so."""
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_all_is_stored_whatever_is_stale_and_then_no_process_starts(cache: Path) -> None:
    with ahead.compiling_ahead(["demo", "--quiet"]) as process:
        assert process.wait(PATIENCE) == 0
    assert stored(cache) == 1
    stamp = cache / "tribrach-demo.compiled"
    assert stamp.read_text() == ahead.state("demo")
    with ahead.compiling_ahead(["demo"]) as process:
        assert process is None
    # another command has kernels of its own
    with ahead.compiling_ahead(["run", "a.toml"]) as process:
        assert process.wait(PATIENCE) == 0
    assert stored(cache) == 1


@pytest.mark.parametrize("content", [b"", b"begun\n", b"\xff\x00", b"cpython-311\n"])
def test_a_stamp_that_says_something_else_is_made_again(cache: Path, content: bytes) -> None:
    ahead._LIST.write_text("demo\tno.such.module\t_loop\tint64\n")
    cache.mkdir()
    (cache / "tribrach-demo.compiled").write_bytes(content)
    with ahead.compiling_ahead(["demo"]) as process:
        assert process.wait(PATIENCE) == 0
    assert (cache / "tribrach-demo.compiled").read_text() == ahead.state("demo")


def test_the_stamp_is_of_one_source_and_one_list(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = ahead.state("demo")
    assert before == ahead.state("demo") != ahead.state("run")
    monkeypatch.setattr(ahead, "_age", lambda file: "another")
    assert ahead.state("demo") != before


@pytest.mark.parametrize("words", [[], ["--version"], ["adjust", "a.gkf"], ["demo", "--help"]])
def test_no_process_where_no_kernel_is_needed(cache: Path, words: list[str]) -> None:
    with ahead.compiling_ahead(words) as process:
        assert process is None


def test_no_process_where_nobody_wants_it_or_it_would_be_in_the_way(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda who: {0, 1}, raising=False)
    monkeypatch.setenv(ahead.SWITCH, "1")
    assert ahead._helps()
    monkeypatch.setattr(os, "sched_getaffinity", lambda who: {1}, raising=False)
    assert not ahead._helps()
    monkeypatch.setattr(os, "sched_getaffinity", lambda who: {0, 1}, raising=False)
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert not ahead._helps()
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "0")
    monkeypatch.setattr(sys, "frozen", True, raising=False)
    assert not ahead._helps()
    monkeypatch.delattr(sys, "frozen")
    assert ahead._helps()
    monkeypatch.setenv(ahead.SWITCH, "0")
    assert not ahead._helps()


def test_nothing_is_compiled_where_nothing_can_be_stored(tmp_path: Path, cache: Path) -> None:
    cache.write_text("a file where the folder should be")
    with ahead.compiling_ahead(["demo"]) as process:
        assert process.wait(PATIENCE) == 1
    assert cache.is_file()


def test_commands_of_one_name_have_one_process_between_them(cache: Path) -> None:
    ahead._LIST.write_text("demo\ttime\tsleep\tint64\n")
    stamp = cache / "tribrach-demo.compiled"
    cache.mkdir()
    with FileLock(stamp.with_suffix(".lock")), ahead.compiling_ahead(["demo"]) as process:
        assert process.wait(PATIENCE) == 0
        assert not stamp.exists()
    with ahead.compiling_ahead(["demo"]) as process:
        assert process.wait(PATIENCE) == 0
        assert stamp.exists()


def test_a_system_that_starts_no_process_is_no_reason_to_fail(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", str(cache / "no python"))
    with ahead.compiling_ahead(["demo"]) as process:
        assert process is None


def test_it_ends_with_the_block(cache: Path) -> None:
    with ahead.compiling_ahead(["demo"]) as process:
        until((cache / "tribrach-demo.compiled").exists)
    until(lambda: process.poll() is not None)
    with pytest.raises(KeyboardInterrupt), ahead.compiling_ahead(["demo"]) as process:
        raise KeyboardInterrupt
    until(lambda: process.poll() is not None)


@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize("number", ["SIGINT", "SIGKILL"])
def test_it_ends_with_the_command_however_that_ends(tmp_path: Path, number: str) -> None:
    code = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "import tribrach.compiling_ahead as ahead; ahead._helps = lambda: True\n"
        "from tribrach.cli import main; main()"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    words = [sys.executable, "-c", code, "demo", "--quiet", "--out", str(tmp_path / "demo")]
    with subprocess.Popen(words, env=environment, stderr=subprocess.PIPE) as command:
        watched = psutil.Process(command.pid)
        until((tmp_path / "kernels" / "tribrach-demo.compiled").exists)
        (second,) = watched.children()
        assert "tribrach.compiling_ahead" in " ".join(second.cmdline())
        command.send_signal(getattr(signal, number))
        command.communicate(timeout=PATIENCE)
    until(lambda: not second.is_running() or second.status() == psutil.STATUS_ZOMBIE)
