"""How many files one direction passes from its line in a GSI file to its row in a report."""

import pytest

from tests.way_of_a_direction import Way, way


@pytest.fixture(scope="module")
def passed() -> Way:
    return way()


def test_it_begins_in_its_file_and_ends_in_a_row(passed: Way) -> None:
    for file in ("io/totalstation/gsi.py", "instruments/reduction.py", "report/tables.py"):
        assert file in passed.files
    assert "report.tables.Cell" in passed.forms


def test_it_passes_few_files(passed: Way) -> None:
    assert len(passed.files) <= 35, sorted(passed.files)


def test_it_takes_few_forms(passed: Way) -> None:
    """Eight are the goal; a further one has to say what it is for."""
    assert len(passed.forms) <= 10, sorted(passed.forms)
