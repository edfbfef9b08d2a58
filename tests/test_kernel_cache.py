"""Compiled code finds a place wherever the package is installed, and never a foreign one."""

import errno
import os
import subprocess
import sys
import tempfile
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numba
import pytest

from tribrach import kernel_cache
from tribrach.kernel_cache import ensure_cache

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="folders of Linux")


@pytest.fixture
def read_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package and a home that cannot be written; temporary files go to the folder returned."""
    barred = [tmp_path / "package", tmp_path / "home"]
    for folder in barred:
        folder.mkdir()
    # set, so that it is forgotten afterwards
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(barred[1] / ".cache"))
    monkeypatch.setattr(kernel_cache, "_PACKAGE", barred[0])
    allowed = os.access
    # who runs as root may write anywhere
    monkeypatch.setattr(
        os, "access", lambda path, mode: Path(path) not in barred and allowed(path, mode)
    )
    place = tmp_path / "tmp"
    place.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(place))
    return place


def test_a_private_folder_where_nothing_can_be_written(
    read_only: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = ensure_cache()
    assert folder == read_only / f"tribrach-{os.getuid()}"
    assert folder.stat().st_mode & 0o777 == 0o700
    assert os.environ["NUMBA_CACHE_DIR"] == numba.config.CACHE_DIR == str(folder)
    # the next process finds it again
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    assert ensure_cache() == folder


@pytest.mark.parametrize("kind", ["open to all", "a link"])
def test_a_folder_that_others_can_write_is_not_used(read_only: Path, kind: str) -> None:
    planted = read_only / f"tribrach-{os.getuid()}"
    if kind == "a link":
        (read_only / "elsewhere").mkdir()
        planted.symlink_to(read_only / "elsewhere")
    else:
        planted.mkdir()
        planted.chmod(0o777)
    folder = ensure_cache()
    assert folder is not None
    assert folder.parent == read_only
    assert folder not in (planted, read_only / "elsewhere")
    assert folder.stat().st_mode & 0o077 == 0


def test_numba_is_left_alone_where_it_can_write(
    read_only: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert ensure_cache() is None
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "mine"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    assert ensure_cache() is None
    assert os.environ["NUMBA_CACHE_DIR"] == str(tmp_path / "mine")


def test_it_is_done_before_numba_loads() -> None:
    code = (
        "import os, tribrach.kernel_cache as k; k._writable = lambda folder: False\n"
        "import importlib, tribrach; importlib.reload(tribrach)\n"
        "import numba; print(numba.config.CACHE_DIR == os.environ['NUMBA_CACHE_DIR'] != '')"
    )
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    out = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert out.stdout.strip() == "True"


def test_a_full_disk_costs_a_kernel_and_not_the_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = tmp_path / "loops.py"
    source.write_text(
        "from tribrach.kernels import njit\n\n\n"
        "@njit(cache=True)\ndef inner(x):\n    return x + 1.0\n\n\n"
        "@njit(cache=True)\ndef outer(x):\n    return 2.0 * inner(x)\n"
    )
    found = spec_from_file_location("loops", source)
    assert found is not None
    assert found.loader is not None
    loops = module_from_spec(found)
    found.loader.exec_module(loops)
    asked = []

    def full(self: object, *given: object) -> None:
        asked.append(given)
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(numba.core.caching.IndexDataCacheFile, "_save_data", full)
    assert loops.outer(3.0) == 8.0
    assert asked
