"""A clock that was set back, or a copy with other dates, changes no result and hides no change."""

import os
from pathlib import Path

import pytest

from tests.job.test_killed import copied, finish_here, results
from tests.job.test_killed import job as job

YEAR = 365 * 86_400 * 10**9


def dated(folder: Path, years: list[int]) -> None:
    """Give all files dates so many years after 1970, in turn, so that any order is turned round."""
    for number, path in enumerate(sorted(p for p in folder.rglob("*") if p.is_file())):
        date = years[number % len(years)] * YEAR + number
        os.utime(path, ns=(date, date))


# what a run takes for changed is tested in tests/job/test_state.py without any run
@pytest.mark.slow
def test_no_order_of_dates_matters(job: Path, tmp_path: Path) -> None:
    project = copied(job, tmp_path / "job")
    finish_here(project)
    first = results(project)
    # results older than their inputs, and inputs of a day to come
    dated(project.parent, [130, 5, 60])
    finish_here(project)
    assert results(project) == first
    # another project file of the same length, with an earlier date and with the date it had
    title = 'title = "'
    text = project.read_text(encoding="utf-8")
    at = text.index(title) + len(title)
    for back in (YEAR, 0):
        date = project.stat().st_mtime_ns - back
        letter = "Z" if text[at] != "Z" else "Y"
        text = text[:at] + letter + text[at + 1 :]
        project.write_text(text, encoding="utf-8")
        os.utime(project, ns=(date, date))
        finish_here(project)
        assert (project.parent / "out" / "report.txt").read_text().count(text[at : at + 8])
