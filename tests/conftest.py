"""Fixtures that all tests share."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

# A change is judged by its own faults: the check draws the same examples each time (see
# .ci/check), and whoever runs pytest alone draws new ones. None of them fails for taking long,
# which tells of the machine alone.
settings.register_profile("default", deadline=None)
settings.register_profile("check", derandomize=True, deadline=None)
settings.load_profile("default")
# commands of tests are many and short: no second process compiles ahead of each
os.environ.setdefault("TRIBRACH_COMPILE_AHEAD", "0")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of third-party test data; the test is skipped where it is absent."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"third-party data are not in {folder}")
    return folder
