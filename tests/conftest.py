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


TESTS = Path(__file__).resolve().parent
#: what ``-m core`` runs: rooms that every answer rests on, and of the others what is soon said
CORE = (
    "network", "observations", "geodesy", "geometry", "instruments", "transformation", "cloud",
    "registration/test_identify.py", "registration/test_plane_ties.py",
    "registration/test_pose_graph.py", "golden/test_networks.py",
)  # fmt: skip
#: but for these, which repeat experiments or go through many networks for long
LONG = (
    "network/test_accusations.py", "network/test_given_lists.py", "network/test_gross.py",
    "network/test_monte_carlo.py", "network/test_occupations.py", "network/test_placeholders.py",
    "network/test_slips.py", "network/test_variance_components.py",
    "observations/test_extension.py", "instruments/test_distance_statistics.py",
    "network/test_contributions.py", "network/test_patterns.py", "transformation/test_fit.py",
    "transformation/test_testing.py",
)  # fmt: skip


def in_core(path: Path) -> bool:
    """True if tests of a file are of the core."""
    place = path.relative_to(TESTS) if path.is_relative_to(TESTS) else path
    return any(place.is_relative_to(one) for one in CORE) and place.as_posix() not in LONG


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Do not even load the files that the core, or all but the core, has no test in."""
    asked = {"core": True, "not slow and not core": False}.get(config.option.markexpr)
    if asked is None or collection_path.suffix != ".py" or collection_path.name == "__init__.py":
        return None
    return True if in_core(collection_path) != asked else None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of the core."""
    for item in items:
        if in_core(item.path) and item.get_closest_marker("slow") is None:
            item.add_marker(pytest.mark.core)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of third-party test data; the test is skipped where it is absent."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"third-party data are not in {folder}")
    return folder
