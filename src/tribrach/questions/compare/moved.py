"""What moved between two clouds in the words of a surveyor, and as tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from tribrach._types import Array
from tribrach.comparison.common_effect import CommonEffect
from tribrach.comparison.not_compared import Reason, Where
from tribrach.comparison.rigid_motion import PartMotion
from tribrach.questions.compare.motions import CloudMotions, MovedPart, StableArea, Verdict
from tribrach.report.columns import column
from tribrach.report.findings import Finding, words
from tribrach.report.names import some_of
from tribrach.report.page import FrontPage
from tribrach.report.tables import ReportTable, Spec, build_table
from tribrach.sentences import Sentence, joined, written
from tribrach.units import format_angle

#: two-sided 95 % of the normal distribution
_NORMAL_95 = 1.96
#: parts and places with a sentence of their own
_NAMED, _PLACES = 12, 3
#: a smaller place is not worth a word [m^2]
_SPECK = 0.5
#: parts that the verdict names
_IN_VERDICT = 4
#: a face whose normal is as near to the vertical lies [cosine]
_LYING = 0.9
#: a place in a sentence
_PLACE = "E {m[0]:m1~}, N {m[1]:m1~}, U {m[2]:m1~}"

_PARTS_NOTE = (
    "Each part as one body, at its middle, against the control of both clouds, with both "
    "registrations in every sigma. Out: along its normal, which looks towards the scanner of B. "
    "Tilt: how much further out its upper end is, per metre (of ground: its north end up); turn: "
    "its right-hand end as seen from outside (of ground: its east end up). Intervals are of 95 %. "
    "Against the stable area: what both registrations do to both alike is out. "
    "Detectable: the shift outwards that would have been found with 80 %. "
)
_STABLE_NOTE = (
    "The largest group of patches that keep their places among each other, and its motion against "
    "the control of both clouds: what the registration is off by there, if it did not move. "
    "Intervals are of 95 %. "
)
_SURFACE_NOTE = (
    "Cells of the surface as wide as the cylinders; areas are about right on faces along the axes "
    "and too large by up to two thirds on slanted ones."
)


@dataclass(frozen=True, eq=False)
class ToldMotions(CloudMotions, also=("sentences",)):
    """What moved between two clouds."""

    @property
    def sentences(self) -> list[str]:
        """Sentences on stable area, moved parts, undecided parts and assumptions."""
        return words(motions_findings(self))


def told_motions(motions: CloudMotions) -> ToldMotions:
    """Motions with their sentences."""
    return ToldMotions(**vars(motions))


def motions_front(motions: CloudMotions) -> FrontPage:
    """Which parts moved, and what one signs."""
    noun = "Site" if motions.sites else "Part"
    names: dict[Verdict, list[str]] = {}
    for part in motions.parts:
        names.setdefault(part.verdict, []).append(part.name)
    stable = motions.stable
    signed = (
        "The motions stated here with their intervals, of what could be compared and of nothing "
        "else."
    )
    if stable is None:
        sentence = next(_stable(motions)).words
        return FrontPage("bad", "No stable area", sentence, signed=signed)
    sentence = Sentence(
        "{share:%} of the surface of both clouds could be compared; the registration {passes} its "
        "test on the stable area.",
        share=motions.compared.share,
        passes="passes" if stable.agrees else "fails",
    )

    def told(which: Verdict, one: str, several: str) -> str:
        some = names.get(which, [])
        what = f"{noun}{'' if len(some) == 1 else 's'} {some_of(some, _IN_VERDICT)}"
        return f"{what} {one if len(some) == 1 else several}" if some else ""

    moved = told("moved", "moved", "moved")
    bent = told("bends", "bends", "bend")
    other = told("not one body", "differs, not as one body", "differ, not as one body")
    few = told("too few distances", "cannot be told", "cannot be told")
    verdict = "; ".join(filter(None, [moved, bent, other]))
    if verdict:
        return FrontPage("none", verdict, sentence, signed=signed)
    verdict = "; ".join(filter(None, ["No motion found", few]))
    sort: Literal["good", "bad", "none"] = "bad" if not stable.agrees else "none" if few else "good"
    return FrontPage(sort, verdict, sentence, signed=signed)


def motions_findings(motions: CloudMotions) -> list[Finding]:
    """Findings on stable area, moved parts, undecided parts and assumptions."""
    effect = [] if motions.effect is None else [_common(motions.effect)]
    found = *_stable(motions), *_parts(motions), *_surface(motions), _registration(motions)
    return [*effect, *found]


def _common(effect: CommonEffect) -> Finding:
    """What both campaigns measured otherwise."""
    value = {
        "scale": "a scale of {effect.value:ppm1} ± {half:ppm1}",
        "zero": "a zero of the ranges of {effect.value:mm2} ± {half:mm2}",
        "refraction": "refraction of {effect.value:2} ± {half:2} in its coefficient",
    }[effect.kind]
    return Finding.of(
        "common_effect",
        f"Between the campaigns lies {value} (95 %): with it {{effect.share:%}} of the surface "
        "agree in one motion, without it {effect.without:%}. It is taken off, and what it explains "
        "is not called moved. Surfaces that move apart may look like it: test both scanners, or a "
        "known length.",
        True,
        effect=effect,
        half=_NORMAL_95 * effect.sigma,
    )


def _stable(motions: CloudMotions) -> Iterator[Finding]:
    """The stable area, and the registration on it."""
    stable = motions.stable
    if stable is None:
        yield Finding.of(
            "no_stable_area",
            "No stable area: no more than half of {patches} patches of the surface agree in one "
            "motion, so the registration is not tested by the surface.",
            patches=motions.patches,
        )
        return
    yield Finding.of(
        "stable_area",
        "{stable.patches} of {patches} patches, {stable.share:%} of the surface in patches (about "
        "{stable.area:0} m²), keep their places among each other and are taken as stable. Assumed "
        "is that the largest such group is what did not move; of the registration nothing was "
        "assumed to find it.",
        stable=stable,
        patches=motions.patches,
    )
    more = (
        "an error of {stable.detectable:mm1} along its mean normal would have been found with 80 %"
        if stable.agrees
        else "either a registration is worse than its covariance says, or what is called stable "
        "moved together; motions against the stable area do not depend on it, those against the "
        "control do"
    )
    seen = "; {along} mm along its mean normal" if stable.motion.seen[0] else ""
    yield Finding.of(
        "registration_tested",
        f"The registration {{verdict}} its test on it ({{test}}{seen}): {more}.",
        verdict="passes" if stable.agrees else "fails",
        test=_test(stable.motion, stable.limit),
        along=_with(stable.motion, 0),
        stable=stable,
    )


def _test(motion: PartMotion, limit: float | None) -> str:
    more = "" if limit is None else ", limit {limit:1}"
    return Sentence(
        f"test {{m.statistic:1}} with {{m.dof}} degrees of freedom{more}", m=motion, limit=limit
    )


def _half(motion: PartMotion, k: int) -> float:
    """Half of the interval of 95 % of a component."""
    return _NORMAL_95 * float(np.sqrt(max(motion.covariance[k, k], 0.0)))


def _with(motion: PartMotion, k: int, sign: float = 1.0, digits: int = 1) -> Sentence:
    """A component with its interval of 95 %, in millimetres or millimetres per metre."""
    return Sentence(
        f"{{value:mm{digits}~}} ± {{half:mm{digits}~}}",
        value=sign * float(motion.values[k]),
        half=_half(motion, k),
    )


def _parts(motions: CloudMotions) -> Iterator[Finding]:
    """Each part with a motion, then the others by name."""
    what = "Site" if motions.sites else "Part"
    told = [p for p in motions.parts if p.differs]
    yield from (_moved(part, what) for part in told[:_NAMED])
    if told[_NAMED:]:
        more = len(told) - _NAMED
        yield Finding.of("more_parts", "{more} more are in the table.", more=more)
    still = [p for p in motions.parts if p.verdict == "no motion found"]
    if still:
        seen = sorted(p.detectable for p in still if p.detectable is not None)
        named = ", ".join(p.name for p in still[:_NAMED])
        least = "" if len(seen) == 1 else "{least:mm1~} to "
        yield Finding.of(
            "no_motion",
            f"No motion was found of {{what}} {{named}}: {least}{{most:mm1}} outwards would have "
            "been found with 80 %.",
            what=what.lower(),
            named=f"{named} and {len(still) - _NAMED} more" if still[_NAMED:] else named,
            least=seen[0],
            most=seen[-1],
        )
    few = [p.name for p in motions.parts if p.verdict == "too few distances"]
    if few:
        yield Finding.of(
            "too_few",
            "Too few distances to tell a motion of {what} {names}.",
            what=what.lower(),
            names=", ".join(few),
        )
    if not motions.sites and motions.stable is not None and not told:
        yield Finding("Beside the stable area no part was found that moved.", key="no_part")
    if motions.loose > 0.005:
        yield Finding.of(
            "loose",
            "{loose:%} of the surface in patches neither keeps its place nor is part of a body "
            "that was found: borders of parts, and what bends.",
            loose=motions.loose,
        )
    if any(p.motion is not None and not p.motion.seen.all() for p in told):
        yield Finding(
            "Distances along normals do not show how a flat part moves within its own face "
            "(to the side, upwards, about its normal): such motions are not excluded.",
            key="unseen",
        )


def _moved(part: MovedPart, what: str) -> Finding:
    """A part that moved, in one sentence."""
    motion = part.motion
    assert motion is not None
    if part.verdict == "not one body":
        did = (
            "differs and does not move as one body ({part.motion.left_out} of {all} distances do "
            "not go along with the others): {figures} on the average."
        )
    elif part.verdict == "bends":
        did = (
            "bends: its pieces tilt against each other and agree where they touch; {figures} on "
            "the average."
        )
    else:
        relative = part.against_stable
        seen = relative is not None and relative.seen[0]
        more = "; along its normal {relative} mm against the stable area" if seen else ""
        did = f"moved {{figures}} (95 %; {{test}}{more})."
    return Finding.of(
        part.verdict.replace(" ", "_"),
        "{what} {part.name} (middle {place}; about {part.area:0} m²) " + did,
        what=what,
        part=part,
        place=Sentence(_PLACE, m=motion.middle),
        all=len(motion.kept),
        figures=joined("; ", _figures(motion)),
        test=_test(motion, part.limit),
        relative=None if part.against_stable is None else _with(part.against_stable, 0),
    )


def _figures(motion: PartMotion) -> list[str]:
    """Shift, tilt and turn, those that are seen; which way only where that is sure with 95 %."""
    lies = abs(motion.normal[2]) > _LYING
    # of a floor seen from below up is inwards
    down = lies and motion.normal[2] < 0
    ends = {
        3: ("tilted", "tilt", "north end up" if lies else "upper end outwards"),
        4: ("turned", "turn", "east end up" if lies else "right end outwards"),
    }
    others = {"up": "down", "outwards": "inwards"}
    values, seen = motion.values, motion.seen
    sure = [abs(float(values[k])) > _half(motion, k) for k in range(len(values))]
    signs = np.where(values >= 0, 1.0, -1.0)
    out: list[str] = []
    if seen[0] and sure[0]:
        way = _towards(signs[0] * motion.normal)
        out.append(_with(motion, 0, signs[0]) + f" mm {way}")
    elif seen[0]:
        out.append("along its normal " + _with(motion, 0) + " mm")
    for k, (done, noun, end) in ends.items():
        if not seen[k]:
            continue
        if not sure[k]:
            out.append(
                Sentence("no {noun} is sure ({v} mm/m)", noun=noun, v=_with(motion, k, 1.0, 2))
            )
            continue
        last = end.rsplit(" ", 1)[1]
        positive = (values[k] >= 0) != down
        out.append(
            Sentence(
                "{done} {v} mm/m, {end}",
                done=done,
                v=_with(motion, k, signs[k], 2),
                end=end if positive else end.replace(last, others[last]),
            )
        )
    for k, word in ((1, "east" if lies else "to its right"), (2, "north" if lies else "upwards")):
        if seen[k]:
            out.append(_with(motion, k) + f" mm {word}")
    if seen[5]:
        out.append(_with(motion, 5, 1.0, 2) + " mm/m about its normal")
    return out


def _towards(direction: Array) -> str:
    """A direction in words."""
    if abs(direction[2]) > _LYING:
        return "up" if direction[2] > 0 else "down"
    azimuth = float(np.arctan2(direction[0], direction[1]) % (2 * np.pi))
    return f"towards {format_angle(azimuth, 'gon', 0)} gon"


def _surface(motions: CloudMotions) -> Iterator[Finding]:
    """Areas that can be compared, and that cannot."""
    yield Finding.of(
        "compared",
        "{all.share:%} of the surface of both clouds (about {all.area:0} m²) could be compared.",
        all=motions.compared,
    )
    for reason in motions.not_compared:
        places = [place for place in reason.places[:_PLACES] if place.area >= _SPECK]
        where = [
            Sentence(_PLACE + " ({area:0} m²)", m=place.middle, area=place.area)
            for place in places or reason.places[:1]
        ]
        yield Finding.of(
            "not_compared",
            "Not compared ({r.words}): {r.share:%} (about {r.area:0} m²), most of it at {where}.",
            r=reason,
            where=joined("; ", where),
        )


def _registration(motions: CloudMotions) -> Finding:
    """What both registrations share."""
    if motions.one_result:
        return Finding(
            "Both clouds are of one run: its joint covariance is in every sigma.", key="one_run"
        )
    if motions.given_alike:
        return Finding.of(
            "given_alike",
            "Both registrations rest on {count} given values that are alike: what these are wrong "
            "by is counted once.",
            count=len(motions.given_alike),
        )
    return Finding(
        "Both registrations are taken as independent: no given value of both is known to be one "
        "and the same.",
        key="independent",
    )


def motions_tables(motions: CloudMotions) -> list[ReportTable]:
    """Stable area, parts, and what cannot be compared; those with rows."""
    stable = [
        column("patches", "patches", "0"),
        column("share", "share", "%1"),
        column("area", "area", "1", unit="m²"),
        *_motion_columns(),
        column("limit", "limit", "1"),
        column("detectable", "detectable", "mm2"),
        column(
            "Registration",
            lambda s: "passes" if s.agrees else "fails",
            mark=lambda s: "good" if s.agrees else "bad",
        ),
    ]
    parts = [
        column("Site" if motions.sites else "Part", "name"),
        column("area", "area", "1", unit="m²"),
        *_motion_columns(relative=True),
        column("limit", "limit", "1"),
        column("detectable", "detectable", "mm2"),
        column("Verdict", "verdict", mark=lambda p: "bad" if p.differs else ""),
    ]
    missed = [
        column("Not compared", lambda x: x[0].words),
        column("share of all", lambda x: x[0].share, "%1"),
        *(
            column(f"{along}{axis}", _of_place(path, k), "m1")
            for along, path in (("", "middle"), ("along ", "extent"))
            for k, axis in enumerate("ENU")
        ),
        column("area", lambda x: x[1].area, "1", unit="m²"),
    ]
    rows: list[StableArea] = [] if motions.stable is None else [motions.stable]
    places = [(r, w) for r in motions.not_compared for w in r.places[:_PLACES]]
    title = "Surface that cannot be compared"
    tables = [
        build_table("stable", "Stable area", _STABLE_NOTE, rows, stable),
        build_table("motions", "Motions of parts", _PARTS_NOTE, motions.parts, parts),
        build_table("not-compared", title, _SURFACE_NOTE, places, missed),
    ]
    return [table for table in tables if table.rows]


def _of_place(path: str, k: int) -> Callable[[tuple[Reason, Where]], float]:
    """Takes a coordinate or an extent of a place."""
    return lambda row: float(getattr(row[1], path)[k])


def _motion_columns(*, relative: bool = False) -> list[Spec]:
    """Distances, components that a face shows with their intervals, and the test of them."""
    out = [column("distances", "motion.distances", "0")]
    for name, k, unit in (("out", 0, "mm"), ("tilt", 3, "mm/m"), ("turn", 4, "mm/m")):
        out += _of("motion", name, k, unit)
    if relative:
        out += _of("against_stable", "out, stable", 0, "mm", wide=True)
    return [*out, column("test", "motion.statistic", "1")]


def _of(which: str, head: str, k: int, unit: str, *, wide: bool = False) -> list[Spec]:
    """A component of a motion, and half of its interval."""

    def seen(get: Callable[[PartMotion], float]) -> Callable[[Any], float | None]:
        def value(item: Any) -> float | None:
            motion = getattr(item, which)
            return None if motion is None or not motion.seen[k] else get(motion)

        return value

    return [
        column(name, seen(get), lambda v, _: written(v, "mm2~"), unit=unit, wide=wide)
        for name, get in (
            (head, lambda motion: float(motion.values[k])),
            ("±", lambda motion: _half(motion, k)),
        )
    ]
