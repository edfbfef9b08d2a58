"""Checks a scanner in the field: faces, distances from two stations, series; one verdict.

The tests share the error probability (Šidák 1967), so that a scanner without errors fails the whole
with the stated probability or less.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from tribrach.calibration.field_series import FTest, SeriesCheck, against_earlier, check_series
from tribrach.calibration.scanner_readings import ScannerReadings, face_means, face_pairs
from tribrach.calibration.target_distances import DistanceCheck, compare_distances
from tribrach.calibration.two_face import TwoFaceTest, two_face_test
from tribrach.errors import InputError

__all__ = ["Earlier", "FieldCheck", "check_readings"]


@dataclass(frozen=True)
class Earlier:
    """The result of an earlier check.

    Attributes
    ----------
    s
        Experimental standard deviation [m].
    dof
        Its redundancy.
    title
        Of that check.
    """

    s: float
    dof: int
    title: str


@dataclass(frozen=True)
class FieldCheck:
    """Everything that was tested.

    Attributes
    ----------
    title
        Of the check.
    readings
        Number of readings.
    stations, targets, series
        Their names.
    two_face
        Test of both faces, None without pairs.
    distances
        Tests of distances, one for each pair of stations and series.
    repeated
        Test of the series, None if there is only one.
    earlier
        An earlier check, None if none was given.
    change
        F-test against it.
    alpha
        Error probability of the whole.
    alpha_each
        Error probability of one test.
    notes
        What could not be tested, and why.
    """

    title: str
    readings: int
    stations: tuple[str, ...]
    targets: tuple[str, ...]
    series: tuple[str, ...]
    two_face: TwoFaceTest | None
    distances: tuple[DistanceCheck, ...]
    repeated: SeriesCheck | None
    earlier: Earlier | None
    change: FTest | None
    alpha: float
    alpha_each: float
    notes: tuple[str, ...]

    @property
    def failures(self) -> list[str]:
        """The tests that failed, in words."""
        out = []
        if self.two_face is not None:
            out += [f"{c.name} of both faces" for c in self.two_face.components if not c.passed]
            if self.two_face.explanation.causes and not out:
                out.append("a misalignment seen in both faces")
        out += [
            f"distances from {d.stations[0]} and {d.stations[1]}"
            + (f" in series {d.series}" if d.series else "")
            for d in self.distances
            if not d.passed
        ]
        if self.repeated is not None and not self.repeated.passed:
            out.append("the experimental standard deviation against the stated precision")
        stations = None if self.repeated is None else self.repeated.stations
        if stations is not None and not stations.passed:
            out.append("what the stations differ by against their own scatter")
        if self.change is not None and not self.change.passed:
            out.append("the precision against the earlier check")
        return out

    @property
    def passed(self) -> bool:
        """True if no test failed."""
        return not self.failures


def check_readings(
    readings: ScannerReadings, title: str, alpha: float = 0.05, earlier: Earlier | None = None
) -> FieldCheck:
    """Test whatever the readings allow to test (method sections 11.2 and 11.3).

    Parameters
    ----------
    readings
        Of all stations, series and faces.
    title
        Of the check.
    alpha
        Error probability of the whole.
    earlier
        An earlier check to compare with.

    Returns
    -------
    FieldCheck
        All tests and one verdict.

    Raises
    ------
    InputError
        Nothing can be tested, or a target is there twice.
    """
    means, pairs = face_means(readings), face_pairs(readings)
    notes: list[str] = []
    stations = tuple(dict.fromkeys(str(s) for s in readings.station))
    series = tuple(dict.fromkeys(str(s) for s in readings.series))
    couples = _couples(means, stations, series, notes)
    repeated = len(series) > 1 and (len(stations) > 1 or len(series) > 2)
    tests = bool(len(pairs)) + len(couples) + repeated * (1 + (len(stations) > 1))
    tests += earlier is not None and repeated
    if not tests:
        raise InputError(
            "nothing can be tested: " + "; ".join(notes or ["there is one scan in one face"]),
            cure="measure both faces, or the same targets from two stations",
        )
    each = 1 - (1 - alpha) ** (1 / tests)
    if not len(pairs):
        notes.append(
            "no target was measured in both faces, so that misalignments that change sign with the "
            "face cannot be tested"
        )
    whole = check_series(means, each) if repeated else None
    if not repeated:
        notes.append(
            "there is one series only: the experimental standard deviation takes three series of "
            "four targets from two stations"
        )
    change = None
    if earlier is not None and whole is not None:
        change = against_earlier(whole, earlier.s, earlier.dof)
    elif earlier is not None:
        notes.append("an earlier check is compared with repeated series only")
    return FieldCheck(
        title=title,
        readings=len(readings),
        stations=stations,
        targets=tuple(dict.fromkeys(str(t) for t in readings.target)),
        series=series,
        two_face=two_face_test(pairs, each) if len(pairs) else None,
        distances=tuple(compare_distances(means, a, b, one, each) for a, b, one in couples),
        repeated=whole,
        earlier=earlier,
        change=change,
        alpha=alpha,
        alpha_each=each,
        notes=tuple(notes),
    )


def _couples(
    means: ScannerReadings, stations: Sequence[str], series: Sequence[str], notes: list[str]
) -> list[tuple[str, str, str]]:
    """Stations and series with at least three targets in common."""
    if len(stations) < 2:
        notes.append("there is one station only, so that no distances can be compared")
    out = []
    for a, b in combinations(stations, 2):
        for one in series:
            seen = [set(means.target[(means.station == s) & (means.series == one)]) for s in (a, b)]
            common = len(seen[0] & seen[1])
            if common >= 3:
                out.append((a, b, one))
            elif seen[0] and seen[1]:
                where = f" in series {one}" if one else ""
                notes.append(
                    f"{a} and {b} have {common} targets in common{where}, three are needed"
                )
    return out
