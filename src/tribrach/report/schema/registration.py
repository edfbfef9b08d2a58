"""Registrations of clouds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tribrach.report.schema.base import Document, DocumentPart, Matrix, Number, heading

if TYPE_CHECKING:
    from tribrach.job.approximate_poses import ApproximatePoses
    from tribrach.job.register import RegisteredFiles
    from tribrach.registration.clouds.pair import PairFit
    from tribrach.registration.clouds.together import CloudGroup

__all__ = ["RegistrationDocument", "registration_document"]

SCHEMA = 1


class RegisteredScanPart(DocumentPart):
    """A scan and its file."""

    scan: str
    file: str
    points: int
    """Without beams that came back from nothing."""
    no_return: int
    """Beams that came back from nothing, left out."""


class RegisteredPairPart(DocumentPart):
    """A pair of scans that was tried; figures only where it was registered."""

    first: str
    second: str
    registered: bool
    sentences: list[str]
    first_from_second: Matrix | None = None
    """4 x 4."""
    relative_covariance: Matrix | None = None
    """6 x 6 of the translation in the first [m] and a rotation vector in the second."""
    overlap: list[Number] | None = None
    rms: Number = None
    matches: int | None = None
    effective_matches: Number = None
    correlation_length: Number = None
    held_directions: int | None = None
    found_by: str | None = None


class RegisteredLoopPart(DocumentPart):
    """A loop of pairs and its closure [m, rad]."""

    stations: list[str]
    shift: Number
    turn: Number
    shift_sigma: Number
    turn_sigma: Number
    statistic: Number
    limit: Number
    closes: bool


class RegisteredStationPart(DocumentPart):
    """A pose with its covariance."""

    world_from_scanner: Matrix
    covariance: Matrix


class DifferencePart(DocumentPart):
    """A pair against the adjusted poses."""

    first: str
    second: str
    places: int
    observed: Number
    noise: Number
    registration: Number


class RegisteredGroupPart(DocumentPart):
    """Stations that hang together, in the frame of one of them."""

    frame_of: str
    stations: dict[str, RegisteredStationPart]
    differences: list[DifferencePart]


class ApproximatePart(DocumentPart):
    """Approximate poses that said where to look [m, rad]."""

    scans: list[str]
    origin: str
    sigma_shift: Number
    sigma_turn: Number


class RegistrationDocument(Document):
    """What ``tribrach register --json`` writes."""

    scans: list[RegisteredScanPart]
    pairs: list[RegisteredPairPart]
    loops: list[RegisteredLoopPart]
    not_used: list[list[str]]
    groups: list[RegisteredGroupPart]
    covariance_of: str
    relative_covariance_of: str
    sigma_origin: str
    approximate: ApproximatePart | None = None
    """None where there were no approximate poses."""
    sentences: list[str]


def registration_document(files: RegisteredFiles) -> RegistrationDocument:
    """All figures; metres and radians."""
    registration = files.registration
    data = heading(SCHEMA) | {
        "scans": [
            {
                "scan": name,
                "file": scan.path.name,
                "points": files.points[name],
                "no_return": 0 if scan.no_return is None else scan.no_return.points,
            }
            for name, scan in files.scans.items()
        ],
        "pairs": [
            {
                "first": p.a,
                "second": p.b,
                "registered": p.fit is not None,
                "sentences": list(p.sentences),
                **({} if p.fit is None else _fit_json(p.fit)),
            }
            for p in registration.pairs
        ],
        "loops": [
            {
                "stations": list(loop.stations),
                "shift": loop.shift,
                "turn": loop.turn,
                "shift_sigma": loop.shift_sigma,
                "turn_sigma": loop.turn_sigma,
                "statistic": loop.statistic,
                "limit": loop.limit,
                "closes": loop.closes,
            }
            for loop in registration.consistency.loops
        ],
        "not_used": [[e.first, e.second] for e in registration.consistency.dropped],
        "groups": [_group_json(group) for group in registration.groups],
        "covariance_of": "translation [m], left rotation increments [rad]",
        "relative_covariance_of": "translation in the first [m], rotation vector in the second",
        "sigma_origin": "prior",
        "approximate": _approximate_json(files.approximate),
        "sentences": list(files.sentences),
    }
    return RegistrationDocument.model_validate(data)


def _approximate_json(known: ApproximatePoses) -> dict[str, Any] | None:
    """Approximate poses, None without any."""
    if not known.poses:
        return None
    return {
        "scans": list(known.poses),
        "origin": known.origin,
        "sigma_shift": known.sigma.shift,
        "sigma_turn": known.sigma.turn,
    }


def _fit_json(fit: PairFit) -> dict[str, Any]:
    """A pair that was registered."""
    precision = fit.precision
    return {
        "first_from_second": fit.pose.matrix.tolist(),
        "relative_covariance": precision.covariance.tolist(),
        "overlap": list(fit.verdict.overlap),
        "rms": fit.alignment.rms,
        "matches": precision.observations,
        "effective_matches": precision.effective,
        "correlation_length": precision.correlation_length,
        "held_directions": precision.rank,
        "found_by": fit.origin.value,
    }


def _group_json(group: CloudGroup) -> dict[str, Any]:
    """Stations that hang together."""
    return {
        "frame_of": group.stations[0],
        "stations": {
            name: {
                "world_from_scanner": pose.matrix.tolist(),
                "covariance": np.asarray(group.covariances[name]).tolist(),
            }
            for name, pose in group.poses.items()
        },
        "differences": [
            {
                "first": a,
                "second": b,
                "places": d.places,
                "observed": d.observed,
                "noise": d.noise,
                "registration": d.registration,
            }
            for (a, b), d in group.differences.items()
        ],
    }
