"""What stops a run is told alone: nothing follows that is not its cause."""

from pathlib import Path
from types import SimpleNamespace
from typing import cast

from tests.job.test_decided_marks import role, survey
from tribrach.errors import InputError, RankDefect, TribrachError
from tribrach.job.find_targets import Findings
from tribrach.job.opened import Job
from tribrach.job.state import Remembered
from tribrach.job.steps import FoundInScans, GivenBesides, scans_to_tell_of
from tribrach.project.edits import Edits
from tribrach.project.sections import TargetSection
from tribrach.targets.detection import Detection


def test_a_question_ends_with_one_mark() -> None:
    error = Edits().error("edit", 0, "there is no observation x", "did you mean y?")
    assert str(error) == "edit 1: there is no observation x; did you mean y?"


def findings(scan: str, station: str, *, empty: bool) -> Findings:
    seen = cast(tuple[Detection, ...], () if empty else ("a sphere",))
    return Findings(scan, station, seen, (), 1000)


def test_scans_without_targets_are_not_told_where_the_control_network_is_open() -> None:
    rows = [("S1", "S1", True), ("S1b", "S1", False), ("S2", "S2", True)]
    parts = [findings(scan, station, empty=empty) for scan, station, empty in rows]
    found = FoundInScans(
        (), parts, TargetSection(), cast(Remembered, None), cast(GivenBesides, None)
    )
    edits = role("A", "free")
    open_job = cast(Job, SimpleNamespace(survey=survey(), edits=edits))
    closed = cast(Job, SimpleNamespace(survey=survey(), edits=Edits()))

    def told(error: TribrachError, job: Job) -> list[str]:
        return [finding.scan for finding in scans_to_tell_of(error, job, found)]

    assert told(RankDefect("open"), open_job) == ["S2"]
    assert told(RankDefect("open"), closed) == ["S1", "S2"]
    assert told(InputError("station S2 cannot be matched"), closed) == ["S1", "S2"]
    edits._file = Path("edits.toml")
    assert told(edits.error("role", 0, "there is no point A"), open_job) == []
