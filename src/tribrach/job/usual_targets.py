"""Which targets stand in scans that nobody named: usual sizes, in the densest scan of a set-up.

A size counts where several targets of it are found; which ones were tried and found is told.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from tribrach.errors import InputError
from tribrach.job.find_targets import found_alone
from tribrach.job.folder import FolderFile
from tribrach.job.scans import StationScan
from tribrach.job.set_ups import density, set_ups
from tribrach.project.instrument import Instrument
from tribrach.project.sections import TargetSection
from tribrach.scan.scan import Scan
from tribrach.sentences import Sentence, joined

#: sizes that makers sell and surveyors print [m], by the key of a project
SIZES: dict[str, tuple[float, ...]] = {
    "checkerboard_side_m": (0.3, 0.2, 0.15, 0.1),
    "sphere_radius_m": (0.0725, 0.07, 0.1, 0.05),
}
#: so many targets of a size are no chance
_FEWEST = 3
#: a set-up is looked at in a scan of at most so many points, if it has one, all of them in so many
_MOST, _ALL = 5_000_000, 60_000_000
_WORDS = {
    "checkerboard_side_m": "checkerboards of side",
    "sphere_radius_m": "spheres of radius",
}


def usual_targets(found: Sequence[FolderFile]) -> tuple[list[tuple[str, float]], str]:
    """Keys of ``[targets]`` with sizes [m] that are in the scans of a folder, and what was tried.

    At most one size for each kind; of sizes that find as many, the one that rejects fewest.
    """
    scans = list(_looked_at(found))
    if not scans:
        return [], ""
    chosen: list[tuple[str, float]] = []
    told = []
    looked: list[str] = []
    for key, sizes in SIZES.items():
        counts = _counts(scans, key, sizes, looked)
        best = max(sizes, key=lambda size: (counts[size][0], -counts[size][1]))
        if counts[best][0] < _FEWEST:
            continue
        chosen.append((key, best))
        others = [Sentence("{s:g}", s=s) for s in sizes if s != best and counts[s][0] >= _FEWEST]
        more = (
            Sentence(" (as many fit {others} m)", others=joined(" or ", others)) if others else ""
        )
        told.append(
            Sentence(
                "{counts} {value} {best:mg}{more}",
                counts=counts[best][0],
                value=_WORDS[key],
                best=best,
                more=more,
            )
        )
    tried = joined(
        "; ",
        (
            Sentence(
                "{value} {g} m",
                value=_WORDS[key],
                g=joined(", ", (Sentence("{s:g}", s=s) for s in sizes)),
            )
            for key, sizes in SIZES.items()
        ),
    )
    what = Sentence("{told}", told=joined(" and ", told)) if told else "none"
    return chosen, (
        Sentence(
            "no targets were named: {tried} were sought in {source}; found: {what}; name "
            "them with --target",
            tried=tried,
            source=", ".join(dict.fromkeys(looked)),
            what=what,
        )
    )


def _looked_at(found: Sequence[FolderFile]) -> Iterator[Scan]:
    """The densest scan of each set-up that is not too large, up to so many points in all."""
    scans = [(one.path, scan) for one in found if one.kind == "scans" for scan in one.scans]
    stations = set_ups(scans)
    of: dict[str, list[Scan]] = {}
    for path, scan in scans:
        if scan.origin != "unknown":
            of.setdefault(stations[path, scan.name], []).append(scan)
    points = 0
    for several in of.values():
        small = [scan for scan in several if (scan.records or 0) <= _MOST]
        if small:
            scan = max(small, key=density) if len(small) > 1 else small[0]
        else:
            scan = min(several, key=lambda one: one.records or 0)
        points += scan.records or 0
        if points > _ALL and points > (scan.records or 0):
            return
        yield scan


def _counts(
    scans: Sequence[Scan], key: str, sizes: Sequence[float], looked: list[str]
) -> dict[float, tuple[int, int]]:
    """Most targets of each size in a set-up, and rejected candidates, up to one with enough."""
    most = dict.fromkeys(sizes, (0, 0))
    for scan in scans:
        looked.append(scan.path.name)
        if not _count(scan, key, sizes)[0]:
            continue
        own = {size: _count(scan, key, [size]) for size in sizes}
        best = max(count for count, _ in own.values())
        if best > max(count for count, _ in most.values()):
            most = own
        if best >= _FEWEST:
            break
    return most


def _count(scan: Scan, key: str, sizes: Sequence[float]) -> tuple[int, int]:
    """How many targets of some sizes are found, and how many candidates are rejected."""
    noise = Instrument(range_mm=2.0, scan_angle_arcsec=8.0).noise()
    station = StationScan(scan.name, scan.name, scan, noise, levelled=False, names={})
    try:
        _, findings = found_alone(
            station,
            TargetSection.model_validate({key: list(sizes)}),
            progress=lambda what, done, total: None,
        )
    except InputError:
        return 0, 0
    return len(findings.detections), len(findings.rejected)
