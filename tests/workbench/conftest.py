"""Results of a small job in three frames, made once for all tests here."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.workbench.twins import results


@pytest.fixture(scope="session")
def yard(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The folder of results of the yard in a frame; nobody may change it."""
    base = tmp_path_factory.mktemp("yard")
    return lambda kind: results(base / kind, kind)
