"""What an installation lacks is said before work starts, or in one sentence where it is met."""

import subprocess
import sys
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.cli import doctor as module
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader

RUN = CliRunner()


def test_what_is_required_and_optional_is_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """A package of an extra, or without a wheel for a machine, is missed; another is broken."""
    lines = ["here>=1", 'absent>=1; extra == "xyz"', "pye58; sys_platform == 'linux'"]
    monkeypatch.setattr(module.metadata, "requires", lambda name: lines)
    found = {"here": "1.5", "tribrach": "0"}

    def version(name: str) -> str:
        if name not in found:
            raise metadata.PackageNotFoundError(name)
        return found[name]

    monkeypatch.setattr(module.metadata, "version", version)
    result = RUN.invoke(app, ["doctor"])
    assert result.exit_code == 0, result.output
    assert "here 1.5" in result.output
    assert 'absent: the extra xyz (pip install "tribrach[xyz]")' in result.output
    assert "(pip install pye58)" in result.output
    lines[0] = "there>=1"
    result = RUN.invoke(app, ["doctor"])
    assert result.exit_code == 1
    assert "Missing: there" in result.output


def test_without_the_library_of_e57_all_else_works(tmp_path: Path) -> None:
    xyz = np.random.default_rng(1).uniform(-5, 5, (200, 3))
    for suffix in ("e57", "ply"):
        with create(tmp_path / f"a.{suffix}", CloudHeader("a", step=1e-4)) as writer:
            writer.write(xyz, {})
    start = "import sys; sys.modules['pye57'] = None; from tribrach.cli import main; main()"

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-c", start, *words],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )

    done = run("convert", "a.ply", "b.laz")
    assert done.returncode == 0, done.stderr
    for words in (["convert", "a.ply", "c.e57"], ["convert", "a.e57", "c.laz"]):
        done = run(*words)
        assert done.returncode == 2, done.stderr
        assert "takes the package pye57" in done.stderr
        assert not (tmp_path / words[-1]).exists()
