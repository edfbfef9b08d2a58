"""The verdict on a scanner in words: what each test says, with its limits."""

from __future__ import annotations

import math

import numpy as np

from tribrach.calibration.field_check import FieldCheck
from tribrach.calibration.field_series import FTest, SeriesCheck
from tribrach.calibration.misalignment_search import Cause, Explanation
from tribrach.calibration.target_distances import DistanceCheck
from tribrach.calibration.two_face import ComponentTest, TwoFaceTest
from tribrach.units import SEC

__all__ = ["amount", "check_sentences"]

_METRES = ("x1n", "x1z", "x2", "x3", "x10")
#: shift of a test value that is found with 80 % at 0.1 %
_FOUND = 4.132


def check_sentences(found: FieldCheck) -> list[str]:
    """The verdict first, then what each test says, with its limits."""
    failures = found.failures
    verdict = (
        "The scanner passes: every test is within its limit."
        if not failures
        else f"The scanner does not pass: {'; '.join(failures)}."
    )
    out = [
        verdict,
        f"A scanner that is as precise as stated and has no misalignments fails with at most "
        f"{found.alpha:.1%}; each test has {found.alpha_each:.2%}.",
    ]
    if found.two_face is not None:
        out += _two_face_words(found.two_face)
    for one in found.distances:
        out += _distance_words(one)
    if found.repeated is not None:
        out += _series_words(found.repeated)
    if found.change is not None and found.earlier is not None and found.repeated is not None:
        out.append(
            _change_words(found.change, found.repeated, found.earlier.s, found.earlier.title)
        )
    return [*out, *(f"{note[:1].upper()}{note[1:]}." for note in found.notes)]


def amount(name: str, value: float) -> str:
    """A parameter with its unit."""
    return f"{value * 1e3:.2f} mm" if name in _METRES else f"{value / SEC:.1f}″"


def _component_words(test: ComponentTest) -> str:
    size = f"{test.rms_metres * 1e3:.2f} mm"
    if test.name != "range":
        size = f"{test.rms / SEC:.1f}″ ({size})"
    verdict = "within" if test.passed else "beyond"
    return (
        f"Both faces, {test.name}: rms of the half differences {size}; {test.statistic:.1f} is "
        f"{verdict} the limit {test.limit:.1f} (chi-square, {test.dof} pairs), largest at "
        f"{test.at}."
    )


def _two_face_words(test: TwoFaceTest) -> list[str]:
    out = [_component_words(component) for component in test.components]
    return out + _explained(test.explanation, "the faces")


def _explained(explanation: Explanation, what: str) -> list[str]:
    if not explanation.causes:
        return [
            f"No single misalignment is significant in {what} (|t| > {explanation.t_limit:.2f})."
        ]
    out = [_cause_words(cause, what) for cause in explanation.causes]
    if not explanation.fits:
        out.append(
            f"What these leave of {what} is still more than noise ({explanation.after:.1f} against "
            f"{explanation.limit:.1f}): another error, or a misread target."
        )
    return out


def _cause_words(cause: Cause, what: str) -> str:
    alike = (
        f"; {', '.join(cause.alternatives)} would explain it as well" if cause.alternatives else ""
    )
    return (
        f"{what[:1].upper()}{what[1:]} point to {cause.name}, {cause.words}: "
        f"{amount(cause.name, cause.value)} ± {amount(cause.name, cause.sigma)} "
        f"(t = {cause.t:.1f}){alike}."
    )


def _distance_words(test: DistanceCheck) -> list[str]:
    a, b = test.stations
    where = f" in series {test.series}" if test.series else ""
    worst = int(np.argmax(np.abs(test.difference) / test.limit))
    verdict = "within" if test.passed else "beyond"
    out = [
        f"Distances from {a} and {b}{where}: {test.statistic:.1f} is {verdict} the limit "
        f"{test.critical:.1f} (chi-square, {test.dof} degrees of freedom); the worst is "
        f"{test.pairs[worst][0]} to {test.pairs[worst][1]}, {test.difference[worst] * 1e3:.2f} mm "
        f"against ± {test.limit[worst] * 1e3:.2f} mm."
    ]
    least = _FOUND * test.sigma_zero
    out.append(
        f"Range zero from these distances: {test.zero * 1e3:.2f} ± {test.sigma_zero * 1e3:.2f} mm; "
        f"one of {least * 1e3:.1f} mm would be found with 80 %."
        if math.isfinite(least)
        else "These stations do not show a range zero: set up one between the targets and one "
        "outside on their line."
    )
    targets = len({name for pair in test.pairs for name in pair})
    if targets < test.in_common:
        out.append(f"{targets} of {test.in_common} common targets were compared, evenly chosen.")
    if not test.passed:
        out += _explained(test.explanation, "the distances")
    return out


def _series_words(test: SeriesCheck) -> list[str]:
    verdict = "within" if test.passed else "beyond"
    out = [
        f"Series: experimental standard deviation of a coordinate {test.s * 1e3:.2f} mm from "
        f"{test.scans} scans of {test.targets} targets (redundancy {test.dof}); stated are "
        f"{test.sigma * 1e3:.2f} mm. With the stated precision {test.statistic:.1f} is {verdict} "
        f"the limit {test.critical:.1f} (chi-square).",
    ]
    if test.stations is not None:
        f = test.stations
        out.append(
            f"The stations differ {f.ratio:.2f} times as much as their own series do, "
            + ("within" if f.passed else "beyond")
            + f" the limit {f.upper:.2f} (F, {f.dof[0]} and {f.dof[1]})"
            + ("." if f.passed else ": errors that depend on where the scanner stands.")
        )
    if test.series < 3 or test.targets < 4:
        out.append("A full check takes three series of four targets from two stations.")
    return out


def _change_words(test: FTest, now: SeriesCheck, before: float, title: str) -> str:
    words = "no significant change" if test.passed else "a significant change"
    return (
        f"Against {title}: {now.s * 1e3:.2f} mm after {before * 1e3:.2f} mm is {words} (F "
        f"{test.ratio:.2f}, limits {test.lower:.2f} to {test.upper:.2f})."
    )
