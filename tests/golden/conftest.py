"""What the cases of one test file share."""

from collections.abc import Iterator

import pytest

from tests.golden.harness import Runs


@pytest.fixture(scope="module")
def runs() -> Iterator[Runs]:
    """Folders of inputs and results, each made once."""
    made = Runs()
    yield made
    made.close()
