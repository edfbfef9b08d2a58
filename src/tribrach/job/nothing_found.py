"""What is said where targets were sought and none was found.

Sizes, scans, candidates with the reasons against them, the density that targets of these sizes take
and the density of the scans; and whether a size is meant in another unit: where a size is not that
of a target, and where a search with the size in another unit, or with a radius for a diameter,
finds some. That search is made, so that the question has a reason.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from tribrach.errors import NothingFound
from tribrach.job.find_targets import Findings, find_targets
from tribrach.job.scans import MeasuredScan, StationScan
from tribrach.project.sections import TargetSection
from tribrach.sentences import Sentence, joined
from tribrach.targets.detection import Kind

#: candidates that are named for each scan; the files have all of them
_NAMED = 4
#: scans that are searched again with sizes in other units, those with most points
_SEARCHED_AGAIN = 3
#: scans whose searches are told in a sentence each
_TOLD = 6

#: kinds with the names of their sizes in a project, what they are called, whether they are half of
#: what is across, and the least and largest that makers sell or surveyors print [m]
_SIZES: Mapping[Kind, tuple[str, str, bool, tuple[float, float]]] = {
    "sphere": ("sphere_radius_m", "radius", True, (0.01, 0.5)),
    "checkerboard": ("checkerboard_side_m", "side", False, (0.03, 2.0)),
    "disc": ("disc_radius_m", "radius", True, (0.005, 1.0)),
}

#: what a size may have been meant in, over the metre
_UNITS = {"millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254, "feet": 0.3048}


def sizes_of(wanted: TargetSection) -> list[tuple[Kind, float]]:
    """Kinds and sizes [m] as the project has them."""
    return [(kind, size) for kind, row in _SIZES.items() for size in getattr(wanted, row[0])]


def odd_sizes(wanted: TargetSection) -> list[str]:
    """Sizes of targets that nobody makes, each in a sentence without the stop."""
    out: list[str] = []
    for kind, size in sizes_of(wanted):
        name, word, half, (least, most) = _SIZES[kind]
        if least <= size <= most:
            continue
        fits = [unit for unit, f in _UNITS.items() if least <= f * size <= most]
        asked = f" or in {fits[0]}" if fits else ""
        across = ", and the radius, not the diameter" if half else ""
        out.append(
            Sentence(
                "[targets]: {name} is {size:g}, which is no usual {word} of a {kind}: is it in "
                "metres{asked}{across}",
                name=name,
                size=size,
                word=word,
                kind=kind,
                asked=asked,
                across=across,
            )
        )
    return out


def density_sentences(findings: Findings, wanted: TargetSection) -> list[str]:
    """Compare the density of a scan with what targets of each size take."""
    if findings.sampling is None:
        return []
    sentences: list[str] = []
    for kind, size in sizes_of(wanted):
        _, word, half, _ = _SIZES[kind]
        places = np.array([r.center for r in findings.rejected if r.kind == kind]).reshape(-1, 3)
        away, whose = findings.sampling.median, "the scan"
        if len(places):
            away, whose = float(np.median(np.linalg.norm(places, axis=1))), "the candidates"
        density = findings.sampling.sentence(kind, 2 * size if half else size, away)
        sentences.append(
            Sentence(
                "{findings.scan}: no {kind} of {word} {size:mg} in {findings.points} points; "
                "at the median range of {whose}, {density}",
                findings=findings,
                kind=kind,
                word=word,
                size=size,
                whose=whose,
                density=density,
            )
        )
    return sentences


def search_sentences(findings: Findings, wanted: TargetSection) -> list[str]:
    """Sentences on a search without targets: density against size, and candidates."""
    name = findings.scan
    sentences = [*findings.sentences, *density_sentences(findings, wanted)]
    if not findings.rejected:
        return [*sentences, f"{name}: nothing in it looked like one"]
    several = [
        Sentence("{r.kind} at {place}: {r.reason}", r=r, place=_place(r.center))
        for r in list(findings.rejected)[:_NAMED]
    ]
    more = len(findings.rejected) - len(several)
    kinds = Counter(r.kind for r in findings.rejected)
    counted = ", ".join(f"{count} for a {kind}" for kind, count in kinds.items())
    sentences.append(
        Sentence(
            "{name}: candidates that were rejected ({counted}): {several}",
            name=name,
            counted=counted,
            several=joined("; ", several),
        )
        + (f"; and {more} more" if more else "")
    )
    return sentences


def unit_sentences(scans: Sequence[MeasuredScan], wanted: TargetSection) -> list[str]:
    """Questions about the unit of sizes, each with what asks it."""
    sentences: list[str] = []
    for kind, size in sizes_of(wanted):
        name, word, half, (least, most) = _SIZES[kind]
        odd = not least <= size <= most
        others = {f"in {unit}": size * factor for unit, factor in _UNITS.items()}
        if half:
            others["as the diameter"] = size / 2
        others["doubled"] = 2 * size
        hits = []
        for how, other in others.items():
            if not least <= other <= most:
                continue
            one = {name: (other,), "floor_mm": wanted.floor_mm}
            single = TargetSection.model_validate(one)
            for scan in scans[:_SEARCHED_AGAIN]:
                count = len(find_targets(scan, single).detections)
                if count:
                    hits.append(
                        Sentence(
                            "{count} of {other:mg4} ({how}) in {scan.name}",
                            count=count,
                            other=other,
                            how=how,
                            scan=scan,
                        )
                    )
        if not odd and not hits:
            continue
        asked = f"is the {word} of the {kind} in metres, and the {word}?"
        why = [Sentence("{size:mg} is no usual size of one", size=size)] if odd else []
        why += (
            [Sentence("a search for other sizes finds {hits}", hits=joined(", ", hits))]
            if hits
            else []
        )
        sentences.append(Sentence("{asked} {why}", asked=asked, why=joined("; ", why)))
    return sentences


def nothing_found(
    headline: str,
    scans: Sequence[StationScan],
    findings: Sequence[Findings],
    wanted: TargetSection,
) -> NothingFound:
    """The refusal of a project whose scans show no targets that would tie them."""
    sought = joined(
        ", ",
        (
            Sentence("{kind} of {value} {s:mg}", kind=kind, value=_SIZES[kind][1], s=s)
            for kind, s in sizes_of(wanted)
        ),
    )
    named = [f.scan for f in findings]
    listed = ", ".join(named[:_TOLD]) + (f" and {len(named) - _TOLD} more" * (len(named) > _TOLD))
    sentences: list[str] = [
        Sentence("sought: {sought}; searched: {listed}", sought=sought, listed=listed)
    ]
    for finding in list(findings)[:_TOLD]:
        sentences += search_sentences(finding, wanted)
    empty = [scan for scan in scans if scan.name in set(named)]
    points = {f.scan: f.points for f in findings}
    empty.sort(key=lambda scan: -points[scan.name])
    sentences += unit_sentences([scan.measured for scan in empty], wanted)
    return NothingFound(
        headline,
        sentences,
        cure="check sizes and their unit, scan targets closer or finer, or tie the stations by "
        "planes, clouds or observations",
    )


def refuse_unplaced(
    stations: Iterable[str],
    scans: Sequence[StationScan],
    findings: Sequence[Findings],
    wanted: TargetSection,
) -> None:
    """Refuse stations that nothing places if targets were sought in their scans and not found."""
    seen = {f.station for f in findings if f.detections}
    bare = [name for name in stations if name not in seen]
    if not bare or not wanted.wanted:
        return
    raise nothing_found(
        f"no target was found in the scans of {', '.join(bare[:_TOLD])}"
        f"{f' and {len(bare) - _TOLD} more' * (len(bare) > _TOLD)}, and nothing else places "
        f"{'this station' if len(bare) == 1 else 'these stations'}",
        scans,
        [f for f in findings if f.station in set(bare)],
        wanted,
    )


def _place(center: Iterable[float]) -> str:
    """Coordinates of a candidate."""
    return joined(" ", (Sentence("{x:2}", x=x) for x in center))
