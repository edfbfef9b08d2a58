"""The house style: docstrings, public names, words; ruff, mypy and import-linter see the rest."""

import ast
import re
import runpy
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "tribrach"
FILES = sorted(SOURCE.rglob("*.py"))
Function = ast.FunctionDef | ast.AsyncFunctionDef
Trees = dict[Path, ast.Module]


@pytest.fixture(scope="module")
def trees() -> Trees:
    """Syntax of all modules; no longer kept than these tests take, for it is much."""
    return {path: ast.parse(path.read_text()) for path in FILES}


def public(tree: ast.AST, inside: str = "") -> Iterator[tuple[str, ast.AST]]:
    """Public classes and functions with their names, methods included."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.ClassDef | Function) and not node.name.startswith("_"):
            yield inside + node.name, node
            if isinstance(node, ast.ClassDef):
                yield from public(node, f"{inside}{node.name}.")


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_everything_public_is_documented(path: Path, trees: Trees) -> None:
    tree = trees[path]
    assert ast.get_docstring(tree), "the module says nothing"
    silent = [name for name, node in public(tree) if not ast.get_docstring(node)]
    assert silent == []


def test_lists_of_names_have_no_ghosts(trees: Trees) -> None:
    """``__all__`` stands where a module passes names on; elsewhere an underscore says it."""
    for path, tree in trees.items():
        for node in tree.body:
            if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "__all__":
                text = path.read_text()
                names = ast.literal_eval(node.value)
                assert [n for n in names if text.count(n) < 2] == [], path.name


def test_no_two_public_classes_share_a_name(trees: Trees) -> None:
    homes: dict[str, list[str]] = {}
    for path, tree in trees.items():
        for name, node in public(tree):
            if isinstance(node, ast.ClassDef) and "." not in name:
                homes.setdefault(name, []).append(str(path.relative_to(SOURCE)))
    assert {name: paths for name, paths in homes.items() if len(paths) > 1} == {}


#: modules beside io that touch files themselves, and why
TOUCH_FILES = {
    "gnss/engine.py": "writes what the engine reads into a temporary folder of the run",
    "comparison/streams.py": "keeps points in temporary files that nobody else reads",
    "comparison/tiles.py": "keeps points in temporary files that only its own tasks read",
    "job/state.py": "keeps what is remembered between runs beside the results",
    "code_version.py": "reads the sources of the program itself",
    "compiling_ahead.py": "reads a list of its own, and keeps stamps beside compiled code",
}
METHODS = {"open", "read_text", "read_bytes", "write_text", "write_bytes", "tofile"}
FUNCTIONS = {
    "np": {"load", "save", "savez", "savez_compressed", "fromfile", "memmap", "loadtxt", "savetxt"},
    "shutil": {"copy", "copyfile", "copytree", "move"},
    "os": {"open", "replace", "rename"},
}


def touches_files(node: ast.AST) -> bool:
    """True for a call that opens, reads or writes a file."""
    if not isinstance(node, ast.Call):
        return False
    if isinstance(node.func, ast.Name):
        return node.func.id == "open"
    if not isinstance(node.func, ast.Attribute):
        return False
    owner = getattr(node.func.value, "id", "")
    if owner[:1].isupper() and owner != "Path":
        return False  # a class that has a way to make an instance of that name
    return node.func.attr in METHODS or node.func.attr in FUNCTIONS.get(owner, ())


def test_files_are_touched_in_io_only(trees: Trees) -> None:
    """What is read and written is read and written in io; everybody else gets data."""
    places = {
        str(path.relative_to(SOURCE))
        for path, tree in trees.items()
        if path.relative_to(SOURCE).parts[0] != "io" and any(map(touches_files, ast.walk(tree)))
    }
    assert places == TOUCH_FILES.keys()


def test_text_names_no_private_places() -> None:
    """Nothing in the project speaks of where or how it was written."""
    words = ("/work/", "/tmp/", "/opt/", "/home/", "/root/", "TODO", "FIXME", "XXX")
    places = [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *FILES]
    found = {(p.name, w) for p in places for w in words if w in p.read_text()}
    assert found == set()


#: modules that write JSON, and what
WRITE_JSON = {
    "io/json_text.py": "what is no document",
}


def test_json_is_written_in_one_place_for_each_sort() -> None:
    """Python writes NaN and Infinity into JSON, which no strict reader takes."""
    words = ("json.dump", ".model_dump_json(", "to_json_bytes", "pydantic_core.to_json(")
    places = {
        str(path.relative_to(SOURCE))
        for path in FILES
        if any(word in path.read_text() for word in words)
    }
    assert places == WRITE_JSON.keys()


def test_the_map_names_forty_classes() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text()
    (places,) = re.findall(r"^\{insert: classes (.*)\}$", text, re.MULTILINE)
    filled = runpy.run_path(str(ROOT / "docs" / "inserts.py"))["classes"](places)
    assert len(filled.splitlines()) >= 42


def test_the_pipeline_is_a_page() -> None:
    """A verb a line: what a verb does is in its own module."""
    assert len((SOURCE / "pipeline.py").read_text().splitlines()) <= 80


#: rooms whose sentences reach reports and answers, beside those in io and workbench
SAY = (
    "calibration", "comparison", "geodesy", "gnss", "instruments", "job", "network", "questions",
    "planning", "registration", "report", "scan", "solution.py", "targets", "transformation",
)  # fmt: skip
#: functions there that write a number themselves, and what it is part of
WRITE_NUMBERS = {
    "geodesy/frames.py": "options of PROJ",
    "gnss/baseline.py": "options of the engine",
    "gnss/engine.py": "options of the engine",
    "instruments/range_law.py": "a refusal",
    "job/first_project.py": "a project file",
    "job/folder.py": "a line of the terminal",
    "job/poses.py": "a table of poses",
    "job/shared.py": "names of effects",
    "network/given_values.py": "the digest of what is given",
    "network/network.py": "an edit as it was given",
    "network/observation_rows.py": "the row for Python",
    "network/results.py": "results for Python",
    "planning/prospect.py": "rounding",
    "questions/calibrate/chapters.py": "columns of the terminal",
    "questions/complete/clouds.py": "names of columns",
    "questions/transform/chapters.py": "a cell",
    "report/chapters/scans.py": "the name of an axis",
    "report/charts.py": "places in a drawing",
    "report/histogram.py": "places in a drawing",
    "report/map.py": "places in a drawing",
    "report/numbers.py": "cells, which are numbers",
    "report/panoramas.py": "places in a drawing",
    "report/regression.py": "cells",
    "report/views.py": "the name of an axis",
    "scan/neighbour_correlation.py": "keys of JSON",
}
#: what makes a cell, a mark or an exception: numbers of these are no sentences
NO_SENTENCES = {"number_cell", "Cell", "mark", "refuse"}


def numbers_in_strings(tree: ast.AST) -> Iterator[int]:
    """Lines of strings that write a number with digits, outside of exceptions and repr."""
    for node in ast.iter_child_nodes(tree):
        name = ""
        if isinstance(node, ast.Call):
            name = ast.unparse(node.func).split(".")[-1]
        if isinstance(node, ast.Raise) or name in NO_SENTENCES or name.endswith("Error"):
            continue
        if isinstance(node, Function) and node.name in ("__repr__", "_repr_html_", "summary"):
            continue
        if isinstance(node, ast.FormattedValue) and isinstance(node.format_spec, ast.JoinedStr):
            spec = ast.unparse(node.format_spec)[2:-1]
            if re.search(r"[fg%,]$", spec):
                yield node.lineno
        yield from numbers_in_strings(node)


def test_sentences_keep_their_figures(trees: Trees) -> None:
    """Numbers of sentences are fields of a Sentence, which writes them for the project."""
    found = {
        str(path.relative_to(SOURCE)): lines
        for path, tree in trees.items()
        if path.relative_to(SOURCE).parts[0] in SAY and (lines := [*numbers_in_strings(tree)])
    }
    assert {name: lines for name, lines in found.items() if name not in WRITE_NUMBERS} == {}
    assert {name for name in WRITE_NUMBERS if name not in found} == set()


#: modules that work on letters of text, and on which; sentences that are finished are none
ON_LETTERS = {
    "geodesy/frames.py": "names of frames",
    "io/gnss/navigation_file.py": "the kind of a file",
    "io/gnss/observation_file.py": "the kind of a file",
    "io/toml_model.py": "what pydantic says",
    "job/first_project.py": "names of files",
    "job/plausibility.py": "names of points",
    "job/poses.py": "names of files",
    "job/state.py": "names of files",
    "network/identity.py": "parts of an id",
    "project/toml_file.py": "what the parser of TOML says",
    "questions/calibrate/command.py": "names of files",
    "report/characters.py": "anchors, and characters that steer",
    "report/tables.py": "cells, which are numbers",
    "sentences.py": "templates",
}


def test_nothing_rewrites_finished_sentences(trees: Trees) -> None:
    """No room searches its own sentences by patterns or gives them other first letters."""
    found = set()
    for path, tree in trees.items():
        name = str(path.relative_to(SOURCE))
        said = name.split("/")[0] in (*SAY, "cli", "project", "sentences.py")
        for node in ast.walk(tree):
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
                continue
            to, of = node.func.attr, node.func.value
            first = isinstance(of, ast.Subscript) and ast.unparse(of.slice) == ":1"
            if to == "capitalize" or (to in ("upper", "lower") and first) or (to == "sub" and said):
                found.add(name)
    assert found == set(ON_LETTERS)
