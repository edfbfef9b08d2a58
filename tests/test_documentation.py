"""What README and docs show is what the program does: commands, snippets, columns, keys, kinds."""

import json
import re
import runpy
import shlex
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from tests.demo_twin import few_boards
from tests.observations.test_contract import kinds
from tribrach import demo
from tribrach.cli import app
from tribrach.io.survey.csv.columns import LAYOUTS, QUANTITIES, TableLayout
from tribrach.io.survey.csv.file import read_table
from tribrach.io.survey.formats import SUFFIXES
from tribrach.job.opened import open_job
from tribrach.project import Project
from tribrach.project.edits import read_edits
from tribrach.project.instrument_file import read_instrument_file
from tribrach.project.sections import Section
from tribrach.report import json_result

ROOT = Path(__file__).resolve().parents[1]
FILLED = runpy.run_path(str(ROOT / "docs" / "inserts.py"))["filled"]
#: pages as the site has them, with their tables
DOCS = {path.stem: FILLED(path.read_text()) for path in (ROOT / "docs").glob("*.md")}
PAGES = {"README": (ROOT / "README.md").read_text(), **DOCS}
RUN = CliRunner()


def blocks(language: str) -> list[tuple[str, str]]:
    """Fenced blocks of a language with the page that shows them."""
    found = []
    for page, text in PAGES.items():
        for tag, block in re.findall(r"^```(\w*)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE):
            if tag == language:
                found.append((page, block))
    return found


def words(text: str) -> set[str]:
    """What stands in backticks, outside of fenced blocks."""
    text = re.sub(r"^```.*?^```$", "", text, flags=re.DOTALL | re.MULTILINE)
    return set(re.findall(r"`([^`]+)`", text))


def rows(page: str, after: str) -> list[list[str]]:
    """Cells of the first table after a text."""
    lines = DOCS[page].split(after, 1)[1].splitlines()
    table = []
    for line in lines:
        if line.startswith("|"):
            table.append([cell.strip() for cell in line.strip("|").split("|")])
        elif table:
            break
    return table[2:]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the demonstration project in ``demo``."""
    place = tmp_path_factory.mktemp("docs")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(demo, "build", few_boards)
        result = RUN.invoke(app, ["demo", "--out", str(place / "demo"), "-q"])
    assert result.exit_code == 0, result.output
    return place


@pytest.mark.parametrize(("page", "snippet"), blocks("python"))
def test_python_snippets_run(
    page: str, snippet: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    names: dict[str, object] = {}
    exec(compile(snippet, page, "exec"), names)
    if "east" in names:
        assert names["east"] == pytest.approx(100.004, abs=1e-9)
        assert names["sigma"] == pytest.approx(0.002 / 2**0.5, rel=1e-9)


@pytest.mark.parametrize(("page", "text"), blocks("toml"))
def test_project_files_load(page: str, text: str, folder: Path) -> None:
    if text.startswith("[[edit]]"):
        path = folder / "decisions.toml"
        path.write_text(text)
        assert len(read_edits(path)) == 3
        return
    path = folder / "demo" / f"{page}.toml"
    path.write_text(text)
    if text.startswith("[instrument]"):
        assert read_instrument_file(path)[0]
        return
    project = Project.load(path)
    # the scans of a snippet do not lie there; its keys are read all the same
    assert project.scans or project.plan or open_job(project).network().count() > 30


def commands() -> list[tuple[str, list[str]]]:
    """Calls of the program in fenced blocks without a language."""
    lines = [(p, line) for p, block in blocks("") for line in block.splitlines()]
    calls = [(p, line.split("&&")[-1]) for p, line in lines]
    split = [(p, shlex.split(call, comments=True)) for p, call in calls]
    return [(p, call) for p, call in split if call and call[0].endswith("tribrach")]


@pytest.mark.parametrize(("page", "call"), commands())
def test_commands_and_options_exist(page: str, call: list[str]) -> None:
    command = typer.main.get_command(app).commands[call[1]].loaded  # type: ignore[attr-defined]
    if hasattr(command, "commands"):
        command = command.commands[call[2]]
    known = {option for p in command.params for option in p.opts}
    assert {word for word in call if word.startswith("-")} <= known, page


def test_options_named_in_the_text_exist() -> None:
    listed = typer.main.get_command(app).commands.values()  # type: ignore[attr-defined]
    single = [command.loaded for command in listed]
    single += [c for group in single for c in getattr(group, "commands", {}).values()]
    known = {o for c in single for p in c.params for o in (*p.opts, *p.secondary_opts)}
    for page, text in PAGES.items():
        named = {word.split()[0] for word in words(text) if word.startswith("--")}
        assert named <= known, page


def test_run_and_demo_as_shown(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    result = RUN.invoke(app, ["run", "demo/hanoi-facade.toml"])
    assert result.exit_code == 0, result.output
    for name in ("report.html", "report.txt", "result.json", "clouds/poses.csv"):
        assert (folder / "demo" / "out" / name).is_file()


def test_every_observation_kind_is_in_one_table() -> None:
    named = [line.split("`")[1] for line in DOCS["observations"].splitlines() if line[:3] == "| `"]
    assert sorted(named) == sorted(kind.kind for kind in kinds())


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.name)
def test_csv_columns_are_known(layout: TableLayout, tmp_path: Path) -> None:
    """A table is one with the columns it must have, and with all of them."""
    _, has, may = layout.documented()
    # a row of one empty cell would be an empty line
    must = [*re.findall(r"`(\w+)`", has), "comment"]
    further = re.findall(r"`(\w+)`", may)
    for columns in (must, [*must, *further]):
        path = tmp_path / "table.csv"
        path.write_text(",".join(columns) + "\n" + ",".join([""] * len(columns)) + "\n")
        assert read_table(path).layout is layout


def test_csv_tables_are_complete() -> None:
    assert {row[0] for row in rows("formats", "follows from its\ncolumns:")} == {
        layout.name for layout in LAYOUTS
    }
    units = {unit for quantity in QUANTITIES.values() for unit in quantity}
    assert units <= words(DOCS["formats"]) | {"m2", "mm2"}


def test_suffixes_are_listed() -> None:
    listed = words(DOCS["formats"])
    assert set(SUFFIXES) <= listed


def test_project_keys_are_listed() -> None:
    named = words(DOCS["project_keys"]) | words(DOCS["edits"])
    listed = {key for word in named for key in re.findall(r"[a-zA-Z_0-9]+", word)}
    models = {Project, *Section.__subclasses__()}
    assert len(models) > 20
    for model in models:
        keys = {field.alias or name for name, field in model.model_fields.items()}
        assert keys <= listed, model.__name__


def test_json_keys_are_listed(folder: Path) -> None:
    result = json.loads((folder / "demo" / "out" / "result.json").read_text())
    assert result["schema"] == json_result.SCHEMA
    assert set(result) - {"tribrach"} <= words(DOCS["formats"])
    assert result["sigma0"]["covariances"] == "prior"


def test_pages_are_in_the_contents() -> None:
    contents = (ROOT / "mkdocs.yml").read_text()
    docs = ROOT / "docs"
    pages = {path.relative_to(docs).as_posix() for path in docs.rglob("*.md")}
    assert pages == set(re.findall(r"[\w/]+\.md", contents))


def test_files_named_in_the_readme_exist() -> None:
    for word in words(PAGES["README"]):
        if "/" in word and " " not in word and not word.startswith("demo/"):
            assert (ROOT / word).exists(), word
