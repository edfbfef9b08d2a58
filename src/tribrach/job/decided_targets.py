"""Found targets as somebody decided by hand: named, or rejected."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from tribrach._types import Array
from tribrach.errors import UnknownName
from tribrach.job.find_targets import Findings
from tribrach.job.scans import StationScan
from tribrach.project.edits import Edits
from tribrach.registration.identify import is_tie_point
from tribrach.sentences import Sentence, joined
from tribrach.targets.detection import Detection, Rejected

#: a target of an entry lies within this distance of the place given [m]; two centres of one target
#: that was found twice differ by less, two targets by more
WITHIN_M = 0.02


def found_again(findings: Sequence[Findings], edits: Edits) -> list[Findings]:
    """What scans show without targets rejected by hand, which are listed with the reason."""
    out = list(findings)
    places = {finding.scan: k for k, finding in enumerate(findings)}
    for number, target in enumerate(edits.target):
        if target.scan not in places:
            error = UnknownName("scan with targets", target.scan, places)
            raise edits.error("target", number, error.what, error.cure)
        k = places[target.scan]
        found = nearest(findings[k].detections, np.array(target.center))
        if found is None:
            raise edits.error("target", number, *_far(findings[k], np.array(target.center)))
        if not target.accept:
            bad = Rejected(
                found.kind,
                found.center,
                Sentence("rejected by hand: {target.reason}", target=target),
            )
            out[k] = _without(out[k], found, bad)
    for number, pick in enumerate(edits.pick):
        if pick.scan not in places:
            error = UnknownName("scan", pick.scan, places)
            raise edits.error("pick", number, error.what, error.cure)
        for bad in findings[places[pick.scan]].rejected:
            if bad.kind == pick.kind and np.array_equal(bad.center, pick.place):
                cure = "pick it anew: another place, radius_m or kind"
                raise edits.error("pick", number, f"{pick.name} in {pick.scan}: {bad.reason}", cure)
    return out


def _without(finding: Findings, found: Detection, bad: Rejected) -> Findings:
    """What a scan holds with one of its targets among the rejected candidates."""
    keep = [detection is not found for detection in finding.detections]
    view = finding.panorama
    return replace(
        finding,
        detections=tuple(d for d, kept in zip(finding.detections, keep, strict=True) if kept),
        rejected=(*finding.rejected, bad),
        panorama=None if view is None else view.chosen(keep),
    )


def nearest(detections: Sequence[Detection], center: Array) -> Detection | None:
    """The target at a place (3,) [m] of its scan; None where there is none."""
    if not detections:
        return None
    gaps = [float(np.linalg.norm(d.center - center)) for d in detections]
    k = int(np.argmin(gaps))
    return detections[k] if gaps[k] <= WITHIN_M else None


def _far(finding: Findings, center: Array) -> tuple[str, str]:
    """Message and cure for a place without a target."""
    what = Sentence(
        "scan {finding.scan} has no target within {within_m:mmg} of {center}",
        finding=finding,
        within_m=WITHIN_M,
        center=joined(", ", (Sentence("{x:3}", x=x) for x in center)),
    )
    near = sorted(finding.detections, key=lambda d: float(np.linalg.norm(d.center - center)))[:3]
    places = joined(
        "; ",
        (
            Sentence("[{d}]", d=joined(", ", (Sentence("{x:3}", x=x) for x in d.center)))
            for d in near
        ),
    )
    return what, Sentence(
        "the nearest are at {places}", places=places
    ) if near else "it has no targets at all"


def names_by_hand(
    edits: Edits, targets: Mapping[str, Sequence[Detection]], scans: Sequence[StationScan]
) -> dict[str, dict[int, str]]:
    """Names that were decided by hand, by station and number of the detection there."""
    out: dict[str, dict[int, str]] = {}
    station_of = {scan.name: scan.station for scan in scans}
    for number, target in enumerate(edits.target):
        if target.name is None:
            continue
        if is_tie_point(target.name):
            raise edits.error(
                "target",
                number,
                f"{target.name} is a name that tie points are given, and those change",
                "give the target a name of its own",
            )
        station = station_of[target.scan]
        # the more precise of several scans of a station is not always the one that was named
        gaps = [float(np.linalg.norm(d.center - target.center)) for d in targets[station]]
        own = out.setdefault(station, {})
        if target.name in own.values():
            raise edits.error(
                "target",
                number,
                f"two targets of {station} have the name {target.name}",
                "give each its own",
            )
        own[int(np.argmin(gaps))] = target.name
    for number, pick in enumerate(edits.pick):
        station = station_of[pick.scan]
        own = out.setdefault(station, {})
        if pick.name in own.values() or is_tie_point(pick.name):
            raise edits.error(
                "pick", number, f"{station} has another {pick.name}", "give it a name of its own"
            )
        # a pick is nowhere but in its own radius
        near = {
            k: float(np.linalg.norm(d.center - pick.place))
            for k, d in enumerate(targets[station])
            if d.kind == pick.kind and d.scan == pick.scan and k not in own
        }
        best = min(near, key=near.__getitem__, default=None)
        if best is None or near[best] > pick.radius_m:
            raise edits.error(
                "pick",
                number,
                f"a target of {station} that was found lies where {pick.name} was picked",
                "name that target, or take the pick out",
            )
        own[best] = pick.name
    return out


def with_names(
    names: Mapping[str, Sequence[str]], by_hand: Mapping[str, Mapping[int, str]]
) -> dict[str, tuple[str, ...]]:
    """Names of all stations with those decided by hand, which no other target there keeps.

    A name that is given to one sight of a tie point is that of the point, wherever else it was
    seen; sights of it that were given several names are what they were named, and the rest keeps
    its number.
    """
    given: dict[str, set[str]] = {}
    for station, own in by_hand.items():
        for k, name in own.items():
            matched = names[station][k] if station in names else ""
            if is_tie_point(matched):
                given.setdefault(matched, set()).add(name)
    everywhere = {tie: min(found) for tie, found in given.items() if len(found) == 1}
    out: dict[str, tuple[str, ...]] = {}
    for station, matched_names in names.items():
        own = by_hand.get(station, {})
        taken = set(own.values())
        kept = ["" if name in taken else name for name in matched_names]
        named = [everywhere.get(name, name) for name in kept]
        # what the station sees under this name already is another target
        doubled = [
            name != old and (name in taken or name in kept)
            for name, old in zip(named, kept, strict=True)
        ]
        others = (
            old if twice else name for name, old, twice in zip(named, kept, doubled, strict=True)
        )
        out[station] = tuple(own.get(k, name) for k, name in enumerate(others))
    return out
