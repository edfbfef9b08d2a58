"""Cases of networks are as their golden files."""

from collections.abc import Iterator

import pytest

from tests.golden.harness import Runs, by_name, differences
from tests.golden.networks import GROUPS

CASES = by_name(GROUPS)


@pytest.fixture(scope="module")
def runs() -> Iterator[Runs]:
    made = Runs()
    yield made
    made.close()


@pytest.mark.parametrize("name", CASES)
def test_as_before(name: str, runs: Runs) -> None:
    lines = differences(*CASES[name], runs)
    assert not lines, "\n".join([f"python -m tests.golden --write {name}", *lines[:40]])
