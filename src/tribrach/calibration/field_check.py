"""Checks a scanner in the field: faces, distances, series, known lengths; one verdict.

The tests share the error probability (Šidák 1967), so that a scanner without errors fails the whole
with the stated probability or less.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tribrach.answers import Result
from tribrach.calibration.distance_statistics import DistanceStatistics, distance_statistics
from tribrach.calibration.field_series import FTest, SeriesCheck, against_earlier, check_series
from tribrach.calibration.known_lengths import (
    GROSS,
    GROSS_METRES,
    KnownLengths,
    LengthCheck,
    compare_lengths,
    without_blunders,
)
from tribrach.calibration.scanner_readings import (
    FacePairs,
    ScannerReadings,
    face_means,
    face_pairs,
)
from tribrach.calibration.target_distances import (
    DistanceCheck,
    common_targets,
    compare_distances,
)
from tribrach.calibration.two_face import TwoFaceTest, two_face_test
from tribrach.errors import InputError
from tribrach.instruments.calibration import meaning_of, unit_of
from tribrach.sentences import Sentence, joined

#: shift of a test value that is found with 80 % at 0.1 %
FOUND = 4.132
#: a range zero that is found only beyond so many sigmas of a range is not seen: a pass is no claim
TOLD = 10.0
#: the same of a signature of both faces, in sigmas of a half difference: four targets up to 20
#: degrees from the horizon show all of them at 10, four within 2 degrees some at 80 only
HIDDEN = 30.0


#: half of the targets of a field check are nearer [m]; half differences of faces that are no
#: misalignment [rad]
_FARTHEST_M, _GROSS_RAD = 1000.0, float(np.radians(0.5))


@dataclass(frozen=True)
class Earlier:
    """The result of an earlier check."""

    s: float  #: experimental standard deviation [m]
    dof: float  #: degrees of freedom of the chi-square that spreads as its square does
    title: str  #: of that check
    #: the uncertainty of a target that its repeated distances showed [m], and the degrees of
    #: freedom of a chi-square of the same spread; None if they showed none
    u: float | None = None
    dof_u: float | None = None


@dataclass(frozen=True)
class FieldCheck(
    Result,
    also=("passed", "failures", "unseen"),
    without=("series_names", "earlier", "notes", "range_sigma"),
):
    """Everything that was tested of a scanner in the field."""

    title: str
    #: error probability of the whole, and of one test
    alpha: float
    alpha_each: float
    #: number of readings
    readings: int
    stations: tuple[str, ...]
    targets: tuple[str, ...]
    series_names: tuple[str, ...]
    two_face: TwoFaceTest | None  #: null without readings in both faces
    #: the same against the noise alone, where the stated precision has a systematic part: what it
    #: finds and the other does not is within what the scanner is stated to have
    two_face_noise: TwoFaceTest | None
    #: one for each pair of stations
    distances: tuple[DistanceCheck, ...]
    statistics: tuple[DistanceStatistics, ...]
    lengths: LengthCheck | None  #: against known lengths
    series: SeriesCheck | None  #: repeated scans; null if there is only one series
    #: an earlier check, and F tests against it, of coordinates and of distances
    earlier: Earlier | None
    change: FTest | None
    change_of_distances: FTest | None
    notes: tuple[str, ...]  #: what could not be tested, and why
    range_sigma: float  #: sigma of a range as it is stated, of the middle reading [m]

    @property
    def failures(self) -> list[str]:
        """The tests that failed, in words."""
        out = []
        if self.two_face is not None:
            out += [f"{c.reading} of both faces" for c in self.two_face.components if not c.passed]
            if self.two_face.explanation.causes and not out:
                out.append("a misalignment seen in both faces")
        out += [
            f"distances from {d.stations[0]} and {d.stations[1]}"
            for d in self.distances
            if not d.passed
        ]
        out += [
            f"repeated distances from {d.stations[0]} and {d.stations[1]} against the stated "
            "precision"
            for d in self.statistics
            if d.repeated is not None and not d.repeated.passed
        ]
        if self.lengths is not None and not self.lengths.passed:
            out.append("distances against known lengths")
        if self.series is not None and not self.series.passed:
            out.append("the experimental standard deviation against the stated precision")
        stations = None if self.series is None else self.series.stations
        if stations is not None and not stations.passed:
            out.append("what the stations differ by against their own scatter")
        if self.change is not None and not self.change.passed:
            out.append("the precision against the earlier check")
        if self.change_of_distances is not None and not self.change_of_distances.passed:
            out.append("the precision of distances against the earlier check")
        return out

    @property
    def unseen(self) -> list[str]:
        """Errors that a scanner may have and these readings would not show, in words."""
        out: list[str] = []
        if self.two_face is None:
            out.append("errors that change sign with the face: no target was read in both")
        else:
            half = np.sqrt(np.median(np.einsum("nii->ni", self.two_face.pairs.covariance), axis=0))
            hidden = [
                meaning_of(name)
                for name, least in self.two_face.detectable.items()
                if not least <= HIDDEN * half[0 if unit_of(name) == "m" else 1]
            ]
            if hidden:
                out.append(
                    f"{', '.join(hidden)}: both faces show these only at targets of other zenith "
                    "angles and ranges"
                )
        lengths, zeros = self.lengths, [d.range_zero.sigma for d in self.distances]
        if lengths is not None and np.isfinite(lengths.zero.sigma):
            zeros.append(lengths.zero.sigma)
        if not zeros and lengths is None:
            out.append("errors of the range: no distances were compared")
        elif zeros and not FOUND * min(zeros) <= TOLD * self.range_sigma:
            least = FOUND * min(zeros)
            words = Sentence("one of less than {least:mm1}", least=least)
            out.append(
                Sentence(
                    "a range zero: these distances would not show {words}",
                    words=words if np.isfinite(least) else "any",
                )
            )
        if lengths is not None and not lengths.rows.sigma.min() <= TOLD * self.range_sigma:
            out.append(
                Sentence(
                    "errors of the range: the best comparison with a known length has a sigma of "
                    "{least:mm1}",
                    least=lengths.rows.sigma.min(),
                )
            )
        return out

    @property
    def passed(self) -> bool | None:
        """True if no test failed and all is seen; null if a fault might not be seen."""
        return False if self.failures else None if self.unseen else True


def check_readings(
    readings: ScannerReadings,
    title: str,
    alpha: float = 0.05,
    earlier: Earlier | None = None,
    known: KnownLengths | None = None,
    noise: ScannerReadings | None = None,
) -> FieldCheck:
    """Test whatever the readings allow to test (method sections 11.2, 11.3 and 11.6).

    ``alpha`` is the error probability of the whole; ``noise`` are the same readings with the
    covariances of their noise alone.
    """
    means, pairs = face_means(readings), face_pairs(readings)
    notes: list[str] = []
    stations = tuple(dict.fromkeys(str(s) for s in readings.station))
    series = tuple(dict.fromkeys(str(s) for s in readings.series))
    couples = _couples(means, stations, notes)
    repeated = len(series) > 1 and (len(stations) > 1 or len(series) > 2)
    without = () if known is None else known.without_sigma
    blunders: tuple[str, ...] = ()
    if known is not None and len(known):
        known, blunders = without_blunders(means, known)
        known = known if len(known) else None
    elif known is not None:
        known = None
    lengths = None if known is None else compare_lengths(means, known, alpha)
    twice = sum(all(_scans(means, s) > 1 for s in couple) for couple in couples)
    only = None if noise is None or not len(pairs) else face_pairs(noise)
    tests = (
        bool(len(pairs)) + bool(only) + len(couples) + twice + repeated * (1 + (len(stations) > 1))
    )
    before = earlier if repeated else None
    with_u = before is not None and before.u is not None and len(couples) == twice == 1
    tests += (before is not None) + with_u + (lengths is not None)
    if not tests:
        raise InputError(
            "nothing can be tested: " + "; ".join(notes or ["there is one scan in one face"]),
            cure="measure both faces, or the same targets from two stations",
        )
    each = 1 - (1 - alpha) ** (1 / tests)
    distances = tuple(compare_distances(means, a, b, each) for a, b in couples)
    _refuse_what_no_scanner_does(means, pairs, distances)
    _what_is_missing(notes, faces=bool(len(pairs)), repeated=repeated)
    if lengths is not None and known is not None:
        # computed once to know whether it can be, with its share now that this is known
        lengths = compare_lengths(means, known, each)
    elif known is not None:
        notes.append("no station saw both ends of a known length in all of its scans")
    else:
        notes.append(
            f"no lengths are {'left' if blunders else 'known'}, so that a scale of the range "
            f"cannot be tested: {'all' if len(stations) > 2 else 'both'} stations share it"
        )
    notes += blunders
    if without:
        notes.append(
            f"coordinates of {', '.join(without)} state no sigmas and make no known lengths: taken "
            "as exact, their own errors would be blamed on the scanner"
        )
    whole = check_series(means, each) if repeated else None
    statistics = tuple(distance_statistics(means, a, b, each, alpha) for a, b in couples)
    change = change_of_distances = None
    if before is not None and whole is not None:
        change = against_earlier(whole.s, whole.dof_equivalent, before.s, before.dof, each)
        now = statistics[0].repeated if with_u else None
        if now is not None and before.u is not None and before.dof_u is not None:
            change_of_distances = against_earlier(
                now.u, now.dof_equivalent, before.u, before.dof_u, each
            )
    elif earlier is not None:
        notes.append("an earlier check is compared with repeated series only")
    return FieldCheck(
        title=title,
        readings=len(readings),
        stations=stations,
        targets=tuple(dict.fromkeys(str(t) for t in readings.target)),
        series_names=series,
        two_face=two_face_test(pairs, each) if len(pairs) else None,
        two_face_noise=None if only is None else two_face_test(only, each),
        distances=distances,
        statistics=statistics,
        lengths=lengths,
        series=whole,
        earlier=earlier,
        change=change,
        change_of_distances=change_of_distances,
        alpha=alpha,
        alpha_each=each,
        notes=tuple(notes),
        range_sigma=float(np.sqrt(np.median(readings.covariance[:, 0, 0]))),
    )


def _refuse_what_no_scanner_does(
    means: ScannerReadings, pairs: FacePairs, distances: Sequence[DistanceCheck]
) -> None:
    """Refuse tables whose units, names or faces are wrong rather than their scanner."""
    said = []
    far = float(np.median(means.polar[:, 0]))
    if far > _FARTHEST_M:
        said.append(Sentence("half of the targets are {far:m0} away or more", far=far))
    angle = float(np.median(np.abs(pairs.half[:, 1:]).max(axis=1))) if len(pairs) else 0.0
    if angle > _GROSS_RAD:
        said.append(Sentence("both faces differ by {angle:degrees1} (median)", angle=2 * angle))
    for one in distances:
        off = np.abs(one.pairs.difference)
        if np.median(off - GROSS * one.pairs.lengths.max(axis=1)) > GROSS_METRES:
            first, second = one.stations
            said.append(
                Sentence(
                    "distances between targets from {first} and {second} differ by {off:m2} "
                    "(median)",
                    off=float(np.median(off)),
                    first=first,
                    second=second,
                )
            )
    if said:
        raise InputError(
            joined("; ", said) + ": no scanner is wrong by as much",
            cure="see that units are those of the column heads (horizontal_gon, range_mm), and the "
            "names and faces of the targets",
        )


def _what_is_missing(notes: list[str], *, faces: bool, repeated: bool) -> None:
    """Say what was not measured and cannot be tested."""
    if not faces:
        notes.append(
            "no target was measured in both faces, so that misalignments that change sign with the "
            "face cannot be tested"
        )
    if not repeated:
        notes.append(
            "there is one series only: the experimental standard deviation takes three series of "
            "four targets from two stations"
        )


def _scans(readings: ScannerReadings, station: str) -> int:
    """Number of scans of a station."""
    return len(set(readings.series[readings.station == station]))


def _couples(
    means: ScannerReadings, stations: Sequence[str], notes: list[str]
) -> list[tuple[str, str]]:
    """Stations with at least three targets in common in all of their scans."""
    if len(stations) < 2:
        notes.append("there is one station only, so that no distances can be compared")
    out = []
    for a, b in combinations(stations, 2):
        common = len(common_targets(means, a, b))
        if common >= 3:
            out.append((a, b))
        else:
            of_all = " in all of their scans" if _scans(means, a) + _scans(means, b) > 2 else ""
            notes.append(f"{a} and {b} have {common} targets in common{of_all}, three are needed")
    return out
