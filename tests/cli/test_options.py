"""Options that several commands have mean the same in each, and a bad file stops no list."""

import json
import re
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.cli.commands import COMMANDS, GROUPS
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.shell.help_words import in_words

RUN = CliRunner()
PROJECT = """
title = "Loop"
[site]
kind = "flat"
[instruments.level]
levelling_mm_per_sqrt_km = 1.0
[[points]]
file = "points.csv"
role = "control"
[[observations]]
file = "levels.csv"
instrument = "level"
[output]
folder = "out"
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    (tmp_path / "points.csv").write_text(
        "name,e,n,u,sigma_e_mm,sigma_n_mm,sigma_u_mm\nA,0,0,10.0,1.0,1.0,1.0\nC,80,0,13.0,1.0,1.0,1.0\n".replace(
            "\\\n", "\n"
        )
    )
    (tmp_path / "levels.csv").write_text(
        "from,to,height_difference_m,length_km\nA,B,1.0002,1.0\nB,C,2.0011,1.0\nA,C,3.0004,1.0\n"
    )
    path = tmp_path / "loop.toml"
    path.write_text(PROJECT)
    return path


def result(folder: Path) -> dict:
    return json.loads((folder / "out" / "result.json").read_text())


def test_run_takes_the_options_of_adjust(project: Path) -> None:
    def run(*options: str) -> dict:
        done = RUN.invoke(app, ["run", str(project), "-q", "--overwrite", *options])
        assert done.exit_code == 0, done.output
        return result(project.parent)

    plain = run()
    assert plain["datum"]["kind"] == "control"
    assert plain["sigma0"]["covariances"] == "prior"
    assert run("--posterior")["sigma0"]["covariances"] == "posterior"
    assert run("--datum", "free:A,C")["datum"]["kind"] == "free"
    assert run("--confidence", "0.99")["sigma0"]["global_test"]["alpha"] == pytest.approx(0.01)
    options = ("--datum", "free:A,C", "--posterior", "--confidence", "0.9")
    other = project.parent / "adjusted.json"
    done = RUN.invoke(app, ["adjust", str(project), "-q", "--json", str(other), *options])
    assert done.exit_code == 0, done.output
    ran, adjusted = run(*options), json.loads(other.read_text())
    for key in ("datum", "sigma0", "points", "observations"):
        assert ran[key] == adjusted[key], key


def test_a_datum_that_is_none_is_refused(project: Path) -> None:
    done = RUN.invoke(app, ["run", str(project), "--datum", "loose"])
    assert done.exit_code == 2
    assert "is no datum" in done.output


def test_info_goes_on_after_a_bad_file(tmp_path: Path) -> None:
    good, bad, worse = (tmp_path / name for name in ("good.laz", "bad.laz", "none.e57"))
    with create(good, CloudHeader("good")) as writer:
        writer.write(np.arange(12.0).reshape(4, 3), {})
    bad.write_bytes(b"LASF and nothing else")
    done = RUN.invoke(app, ["info", str(bad), str(good), str(worse)])
    assert done.exit_code == 2
    words = " ".join(done.output.split())
    for name in ("bad.laz", "good", "none.e57"):
        assert name in words
    assert "Traceback" not in words


def test_every_command_stands_in_a_group_and_once() -> None:
    names = [name for group in GROUPS.values() for name in group]
    assert len(names) == len(set(names))
    assert set(COMMANDS) - set(names) <= {"simulate", "doctor", "pdf"}
    listed = RUN.invoke(app, ["--help"]).output
    assert [g for g in GROUPS if g in listed]
    at = [listed.index(g) for g in GROUPS if g in listed]
    assert at == sorted(at)


def test_options_with_a_unit_in_words_carry_it_in_their_name() -> None:
    """A single number whose help says metres, degrees or millimetres has the unit in its name."""
    listed = typer.main.get_command(app).commands.values()  # type: ignore[attr-defined]
    single = [command.loaded for command in listed]
    single += [c for group in single for c in getattr(group, "commands", {}).values()]
    seen = 0
    for command in single:
        for option in command.params:
            if option.metavar != "NUMBER" or getattr(option, "multiple", False):
                continue
            seen += 1
            said = re.search(r"\bin (metres|degrees|millimetres)\b", option.help or "")
            if said:
                ends = {"metres": "_m", "degrees": "_deg", "millimetres": "_mm"}
                assert option.name.endswith(ends[said[1]]), (command.name, option.name)
    assert seen > 40


@pytest.mark.parametrize("command", ["", "adjust", "targets", "transform", "transform fit"])
def test_help_names_no_types_of_a_language(command: str) -> None:
    """FILE, NUMBER and gon|deg are read by who has never written a program; <bool> is not."""
    text = RUN.invoke(app, [*command.split(), "--help"]).output
    assert "Show this message" in text
    assert not re.search(r"<\w|\b(bool|str|float|Path|list\[)", text)


def test_what_options_take_is_said_in_words() -> None:
    assert in_words(Literal["gon", "deg"] | None) == "gon|deg"
    assert in_words(tuple[float, float, float]) == "NUMBER NUMBER NUMBER"
    assert in_words(list[Path] | None) == "FILE"
    assert in_words(bool) == ""
