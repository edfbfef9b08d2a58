"""Each layer of the house imports only from those below it, and every module has its layer."""

import ast
import re
import runpy
import subprocess
import sys
import tomllib
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CONTRACT = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
LINT = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports())"


def test_imports_keep_to_the_layers() -> None:
    result = subprocess.run(
        [sys.executable, "-c", LINT], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr


def test_every_module_has_its_layer() -> None:
    layers = " ".join(CONTRACT["contracts"][0]["layers"]).replace(":", " ").split()
    listed = {name.removeprefix("tribrach.").strip("()") for name in layers}
    package = ROOT / "src" / "tribrach"
    modules = {p.stem for p in package.glob("*.py")} | {
        p.parent.name for p in package.glob("*/__init__.py")
    }
    assert modules - {"__init__", "__main__"} == listed


def imports_between_modules() -> dict[str, set[str]]:
    """Which modules each imports, also for types only and inside functions."""
    source = ROOT / "src"
    files = {".".join(p.relative_to(source).with_suffix("").parts): p for p in source.rglob("*.py")}
    files = {name.removesuffix(".__init__"): path for name, path in files.items()}
    graph: dict[str, set[str]] = {}
    for name, path in files.items():
        graph[name] = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module:
                for item in node.names:
                    inner = f"{node.module}.{item.name}"
                    graph[name].add(inner if inner in files else node.module)
        # a package hands on the names of its modules: nobody imports the package for itself
        graph[name] = {other for other in graph[name] & files.keys() if other != "tribrach"}
    return graph


def test_no_circles() -> None:
    try:
        TopologicalSorter(imports_between_modules()).prepare()
    except CycleError as error:
        raise AssertionError(" -> ".join(error.args[1])) from None


def test_picture_of_the_house_is_current() -> None:
    script = ROOT / "docs" / "house_picture.py"
    drawn = runpy.run_path(str(script))["picture"]()
    assert (ROOT / "docs" / "pictures" / "house.svg").read_text(encoding="utf-8") == drawn, (
        "run python docs/house_picture.py"
    )


def test_places_that_the_architecture_names_exist() -> None:
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    for name in re.findall(r"`((?:\w+/)+\w*(?:\.py)?)`", page):
        bases = (ROOT / "src" / "tribrach", ROOT)
        assert any((base / name).exists() for base in bases), name
