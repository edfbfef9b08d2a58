"""Commands that read results, lists or cycles replace none of what they read."""

import os
from pathlib import Path

import pytest

from tests.cli.test_bad_scans import RUN, end
from tests.cli.test_nothing_is_lost import digests
from tests.epochs.test_series import control, readings
from tribrach.cli import app

PROJECT = """\
title = "Loop"

[site]
kind = "flat"

[instruments.level]
levelling_mm_per_sqrt_km = 1.0

[[points]]
file = "control.csv"
role = "control"

[[observations]]
file = "levelling.csv"
instrument = "level"

[output]
folder = "out"
epoch = true
"""


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two epochs of a levelling loop, run; the folder of both."""
    folder = tmp_path_factory.mktemp("epochs")
    for name, change in (("first", 0.0), ("second", 0.004)):
        here = folder / name
        here.mkdir()
        (here / "control.csv").write_text("point,u_m,sigma_u_mm\nA,10,1\nB,11,1\n")
        rows = [("A", "B", 1.0), ("B", "C", 0.5 + change), ("C", "A", -1.5 - change)]
        lines = [f"{a},{b},{dh + 0.0003:.4f},100" for a, b, dh in rows]
        (here / "levelling.csv").write_text(
            "\n".join(["from,to,height_difference_m,length_m", *lines]) + "\n"
        )
        (here / "job.toml").write_text(PROJECT)
        assert RUN.invoke(app, ["run", str(here / "job.toml"), "-q"]).exit_code == 0
    return folder


def kept(folder: Path, place: Path, *words: object, also: tuple[Path, ...] = ()) -> None:
    """A command that is given each file that it reads as the name of what it writes."""
    before = digests(folder)
    read = [word for word in (*words, *also) if isinstance(word, Path)]
    for number, path in enumerate(read):
        os.link(path, place / f"hard{number}")
        (place / f"soft{number}").symlink_to(path)
        for other in (path, place / f"hard{number}", place / f"soft{number}"):
            said = end(*words, other, "--overwrite")
            assert "take the place of a file that is read" in said
    assert digests(folder) == before


@pytest.mark.parametrize("option", ["--json", "--html"])
def test_epochs(job: Path, tmp_path: Path, option: str) -> None:
    pair = (job / "first" / "job.toml", job / "second" / "out" / "epoch.json")
    named = (job / "first" / "control.csv", job / "first" / "levelling.csv")
    kept(job, tmp_path, "epochs", *pair, option, also=named)


def test_differences(job: Path, tmp_path: Path) -> None:
    pair = (job / "first" / "out" / "result.json", job / "second" / "out" / "result.json")
    kept(job, tmp_path, "diff", *pair, "--json")


@pytest.mark.parametrize("option", ["--json", "--html", "--alarms"])
def test_series(tmp_path: Path, option: str) -> None:
    folder, place = tmp_path / "cycles", tmp_path / "place"
    folder.mkdir()
    place.mkdir()
    kept(folder, place, "series", readings(folder, 8), "--points", control(folder), option)


def test_a_first_project(job: Path) -> None:
    before = digests(job)
    for name in ("control.csv", "levelling.csv"):
        words = ["init", job / "first", "--yes", "--overwrite", "--out", job / "first" / name]
        # files that were left out stand below the sentence, a line each
        assert RUN.invoke(app, [str(word) for word in words]).exit_code == 2
    assert digests(job) == before


def test_an_export_into_the_results(job: Path) -> None:
    """A page may be written beside files of others; of them all stay."""
    before = digests(job)
    end("view", job / "first" / "out", "--export", job / "first" / "out", "--overwrite", "-q")
    RUN.invoke(app, ["view", str(job / "first" / "out"), "--export", str(job / "first"), "-q"])
    after = digests(job)
    assert {name: after.get(name) for name in before} == before
