"""Results of a small job in three frames, made once for all tests here, and pages of them."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from tests.workbench.browsing import FLAGS, Watched, executable, program
from tests.workbench.twins import results
from tribrach.cli import app


@pytest.fixture(scope="session")
def yard(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The folder of results of the yard in a frame; nobody may change it."""
    base = tmp_path_factory.mktemp("yard")
    return lambda kind: results(base / kind, kind)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """One browser for all tests of the session."""
    path = executable()
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield opened
        opened.close()


@pytest.fixture
def page(browser: Any) -> Iterator[Watched]:
    """A page of its own, that must have been fine when the test ends."""
    context = browser.new_context(viewport={"width": 1200, "height": 760})
    watched = Watched(context.new_page())
    yield watched
    context.close()


@pytest.fixture(scope="module")
def seen(yard: Callable[[str], Path]) -> Iterator[str]:
    """The address of `tribrach view` of a small job."""
    with program("view", yard("work")) as address:
        yield address


@pytest.fixture(scope="module")
def exported(yard: Callable[[str], Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same job as a static folder."""
    folder = tmp_path_factory.mktemp("export") / "site"
    done = CliRunner().invoke(app, ["view", str(yard("work")), "--export", str(folder)])
    assert done.exit_code == 0, done.output
    return folder


@pytest.fixture
def project(yard: Callable[[str], Path], tmp_path: Path) -> Path:
    """A copy of the small job that may be changed."""
    folder = tmp_path / "yard"
    shutil.copytree(yard("work").parent, folder)
    return folder / "yard.toml"
