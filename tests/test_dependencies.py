"""What is imported is declared in pyproject.toml, and what is declared is imported."""

import ast
import re
import sys
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, packages_distributions, requires
from pathlib import Path

from packaging.requirements import Requirement
from packaging.version import Version

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]
#: extras for those who work on the program
WORKSHOP = {"dev", "docs", "peers", "fuzz"}
#: calls that import a module by its name
BY_NAME = {"import_module", "find_spec"}
OURS = {"tribrach", "tests", "fuzz", "benchmarks"}


@cache
def installed() -> Mapping[str, list[str]]:
    """Distributions of each module that can be imported here."""
    return packages_distributions()


def normal(name: str) -> str:
    """A distribution's name as indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


@cache
def imported(folder: Path) -> dict[str, str]:
    """Third-party modules that the code of a folder imports, each with one of the files."""
    return {
        name.split(".")[0]: str(path.relative_to(ROOT))
        for path in sorted(folder.rglob("*.py"))
        for name in modules(ast.parse(path.read_text()))
        if name.split(".")[0] not in sys.stdlib_module_names | OURS
    }


def modules(tree: ast.Module) -> Iterator[str]:
    """Modules that a file imports by statements or by a name in a call."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module
        elif isinstance(node, ast.Call) and node.args:
            called = getattr(node.func, "attr", getattr(node.func, "id", ""))
            argument = node.args[0]
            if called in BY_NAME and isinstance(argument, ast.Constant):
                yield argument.value


def distributions(module: str) -> set[str]:
    """Distributions that bring a module; one that is not installed has the module's name."""
    return {normal(name) for name in installed().get(module, [module])}


def declared(requirements: list[str]) -> set[str]:
    """Distributions of requirements, those of the extras that they ask for among them."""
    names = set()
    for requirement in requirements:
        name, extras = re.match(r"([\w.-]+)(?:\[([^]]*)\])?", requirement).groups()
        names.add(normal(name))
        if extras:
            names |= of_extras(name, {extra.strip() for extra in extras.split(",")})
    return names


def of_extras(name: str, extras: set[str]) -> set[str]:
    """Distributions that extras of an installed distribution bring."""
    try:
        lines = requires(name) or []
    except PackageNotFoundError:
        return set()
    pairs = [re.match(r"([\w.-]+).*extra == ['\"]([^'\"]+)['\"]", line) for line in lines]
    return {normal(pair[1]) for pair in pairs if pair and pair[2] in extras}


def undeclared(folders: list[str], names: set[str]) -> dict[str, str]:
    return {
        module: path
        for folder in folders
        for module, path in imported(ROOT / folder).items()
        if not distributions(module) & names
    }


def test_the_program_imports_what_it_declares() -> None:
    extras = [line for name in EXTRAS.keys() - WORKSHOP for line in EXTRAS[name]]
    assert undeclared(["src"], declared(PROJECT["dependencies"] + extras)) == {}


def test_tests_and_documentation_import_what_is_declared() -> None:
    every = PROJECT["dependencies"] + [line for lines in EXTRAS.values() for line in lines]
    assert undeclared(["tests", "benchmarks", "docs", "fuzz"], declared(every)) == {}


def test_whoever_installs_the_program_gets_nothing_it_does_not_import() -> None:
    used = {name for module in imported(ROOT / "src") for name in distributions(module)}
    required = {normal(re.match(r"[\w.-]+", line)[0]) for line in PROJECT["dependencies"]}
    assert required - used == set()


def test_tested_versions_are_pinned() -> None:
    """``constraints.txt`` has one version of each declared distribution, within its bounds."""
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pins = {normal(name): version for name, _, version in (line.partition("==") for line in lines)}
    assert all(pins.values())
    for extra in ("", *(set(EXTRAS) - {"peers", "fuzz", "kiss"})):
        for text in EXTRAS[extra] if extra else PROJECT["dependencies"]:
            asked = Requirement(text)
            assert asked.specifier.contains(pins[normal(asked.name)], prereleases=True), text


#: first versions without the faults that are published of earlier ones
MENDED = {
    "cryptography": "46.0.5",
    "dask": "2026.1",
    "filelock": "3.20.3",
    "jinja2": "3.1.6",
    "lxml": "4.9.1",
    "pillow": "12.1.1",
    "starlette": "0.49.1",
}


def test_no_version_with_a_published_fault_is_enough() -> None:
    lines = [*PROJECT["dependencies"], *(line for lines in EXTRAS.values() for line in lines)]
    asked = [(normal(one.name), one.specifier) for one in map(Requirement, lines)]
    assert set(MENDED) <= {name for name, _ in asked}
    for name, specifier in asked:
        (least,) = (Version(one.version) for one in specifier if one.operator in (">=", "=="))
        assert least >= Version(MENDED.get(name, "0")), name
