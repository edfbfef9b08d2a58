"""The version of code changes with the source that is used, and with no other."""

import ast
import os
import subprocess
import sys
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

import pytest

import tribrach
from tribrach import code_version as versions
from tribrach.code_version import code_version, reachable

ROOT = Path(tribrach.__file__).parent
FINDING = "tribrach.job.find_targets"


@pytest.fixture(autouse=True)
def forgotten() -> Iterator[None]:
    """No version is remembered before and after."""
    caches = (versions._version, versions._module, versions._files, versions._library)
    for cache in caches:
        cache.cache_clear()
    yield
    for cache in caches:
        cache.cache_clear()


def edited(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """One more comment in a module."""
    (file,) = ROOT.glob(name)
    original = versions.source_text
    monkeypatch.setattr(
        versions, "source_text", lambda f: original(f) + ("# edited\n" if f == file else "")
    )
    versions._module.cache_clear()
    versions._version.cache_clear()


@pytest.mark.parametrize(
    ("file", "matters"),
    [
        ("job/find_targets.py", True),
        ("targets/spheres/fit.py", True),
        ("scan/range_image.py", True),
        # values that come without a name of their own module
        ("units.py", True),
        # readers are loaded by computed names
        ("io/scans/e57.py", True),
        ("network/blunders/snooping.py", False),
        ("report/html.py", False),
        ("io/clouds/copc.py", False),
        ("registration/clouds/pair.py", False),
        ("__init__.py", False),
    ],
)
def test_an_edit_counts_where_the_module_is_used(
    monkeypatch: pytest.MonkeyPatch, file: str, matters: bool
) -> None:
    before = code_version({FINDING})
    assert code_version({FINDING}) == before
    edited(monkeypatch, file)
    assert (code_version({FINDING}) != before) is matters


def test_clouds_depend_on_their_writers_and_planes_on_their_finder() -> None:
    clouds = reachable({"tribrach.job.clouds"})
    assert {f"tribrach.io.clouds.{name}" for name in ("las", "copc", "e57", "ply")} <= clouds
    assert "tribrach.targets.planes" not in clouds
    assert "tribrach.targets.planes" in reachable({"tribrach.job.find_planes"})


def test_a_new_library_counts_and_other_packages_do_not(monkeypatch: pytest.MonkeyPatch) -> None:
    before = code_version({FINDING})
    assert code_version({FINDING, "builtins", "numpy", "tests.job"}) == before
    monkeypatch.setattr(versions, "_library", lambda name: "2.0" if name == "numpy" else "1.0")
    versions._version.cache_clear()
    assert code_version({FINDING}) != before


def test_every_library_is_a_distribution() -> None:
    """None is misspelt, and none has a distribution of another name that is not listed."""
    modules = (versions._module(name) for name in versions._files())
    libraries = set[str]().union(*(module.libraries for module in modules if module is not None))
    absent = {name for name in libraries if versions._library(name) == "none"}
    assert absent <= {"kiss_matcher", "small_gicp", "py4dgeo", "pyrtklib", "hatanaka"}
    assert versions._library("numpy") == metadata.version("numpy")
    assert {"numpy", "scipy", "laspy", "pye57", "pyproj", "numba"} <= libraries


def imported(file: Path) -> set[str]:
    """What a module imports, by its syntax tree; without what is there for types only."""
    names = set[str]()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            return
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: imports are absolute"
            names.add(node.module or "")
            names.update(f"{node.module}.{one.name}" for one in node.names)
        elif isinstance(node, ast.Import):
            names.update(one.name for one in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func) == "import_module":
            names.update(one.value for one in node.args if isinstance(one, ast.Constant))
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(ast.parse(file.read_text()))
    return {name for name in names if name in versions._files()}


def test_imports_are_read_from_the_text_as_python_reads_them() -> None:
    for name, file in versions._files().items():
        module = versions._module(name)
        assert module is not None
        expected = imported(file)
        assert expected <= module.modules, name
        text = file.read_text()
        for more in module.modules - expected:
            assert f'f"{more.rpartition(".")[0]}.{{' in text, f"{name} does not import {more}"


def test_without_the_source_the_version_of_the_package_stands_for_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    before = code_version({FINDING})
    monkeypatch.setattr(versions, "_ROOT", tmp_path)
    versions._files.cache_clear()
    versions._version.cache_clear()
    absent = code_version({FINDING})
    assert absent != before
    monkeypatch.setattr(metadata, "version", lambda name: "999")
    versions._version.cache_clear()
    assert code_version({FINDING}) != absent


SCRIPT = """\
import numpy as np
from pathlib import Path
from tribrach.instruments.calibration import find_model
from tribrach.instruments.correction import Correction
from tribrach.job.find_targets import find_targets
from tribrach.job.state import Remembered
model = find_model("lichti", ("A3", "B6"), (1.2, 9.6))
correction = Correction(model, np.array([1e-3, 1e-5]))
print(Remembered(Path("out")).key(find_targets, correction, {"b", "a", "c"}))
"""


def test_every_process_makes_the_same_key() -> None:
    keys = set()
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        run = [sys.executable, "-c", SCRIPT]
        done = subprocess.run(run, env=environment, capture_output=True, text=True, check=True)
        keys.add(done.stdout)
    assert len(keys) == 1
