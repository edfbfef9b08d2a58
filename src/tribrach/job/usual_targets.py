"""Which targets stand in scans that nobody named: usual sizes, sought in one scan.

A size counts where several targets of it are found; which ones were tried and found is told.
"""

from __future__ import annotations

from collections.abc import Sequence

from tribrach.errors import InputError
from tribrach.job.find_targets import found_alone
from tribrach.job.folder import FolderFile
from tribrach.job.scans import StationScan
from tribrach.project.instrument import Instrument
from tribrach.project.sections import TargetSection
from tribrach.scan.scan import Scan
from tribrach.sentences import Sentence, joined

__all__ = ["usual_targets"]

#: sizes that makers sell and surveyors print [m], by the key of a project
SIZES: dict[str, tuple[float, ...]] = {
    "checkerboard_side_m": (0.3, 0.2, 0.15, 0.1),
    "sphere_radius_m": (0.0725, 0.07, 0.1, 0.05),
}
#: so many targets of a size are no chance
_FEWEST = 3
#: scans with more points take too long for a look
_MOST = 5_000_000
_WORDS = {
    "checkerboard_side_m": "checkerboards of side",
    "sphere_radius_m": "spheres of radius",
}


def usual_targets(found: Sequence[FolderFile]) -> tuple[list[tuple[str, float]], str]:
    """Keys of ``[targets]`` with sizes [m] that are in the scans of a folder, and what was tried.

    Returns
    -------
    sizes : list of (str, float)
        At most one for each kind; of sizes that find as many, the one that rejects fewest.
    sentence : str
        What was sought and found, without the stop; "" where no scan was looked at.
    """
    scans = [scan for one in found if one.kind == "scans" for scan in one.scans]
    usable = [s for s in scans if s.origin != "unknown" and (s.records or 0) <= _MOST]
    if not usable:
        return [], ""
    scan = max(usable, key=lambda one: one.records or 0)
    noise = Instrument(range_mm=2.0, scan_angle_arcsec=8.0).noise()
    station = StationScan(scan.name, scan.name, scan, noise, levelled=False, names={})
    chosen: list[tuple[str, float]] = []
    told = []
    for key, sizes in SIZES.items():
        counts = {size: _count(station, key, size) for size in sizes}
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
            source=_source(scan),
            what=what,
        )
    )


def _count(scan: StationScan, key: str, size: float) -> tuple[int, int]:
    """How many targets of a size are found, and how many candidates are rejected."""
    try:
        _, findings = found_alone(
            scan, TargetSection.model_validate({key: size}), progress=lambda what, done, total: None
        )
    except InputError:
        return 0, 0
    return len(findings.detections), len(findings.rejected)


def _source(scan: Scan) -> str:
    return scan.path.name
