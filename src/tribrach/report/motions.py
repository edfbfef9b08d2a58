"""What moved between two clouds in the words of a surveyor, as tables, and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from tribrach._types import Array
from tribrach.comparison.not_compared import NotCompared, Where
from tribrach.comparison.rigid_motion import COMPONENTS, PartMotion
from tribrach.job.motions import CloudMotions, MovedPart, StableArea, Verdict
from tribrach.report.names import some_of
from tribrach.report.numbers import count_cell, fixed_cell, mm_cell, number, percent_cell
from tribrach.report.page import FrontPage
from tribrach.report.schema.motions import MotionsPart
from tribrach.report.tables import Cell, ColumnHead, ReportTable, build_table, text_cell
from tribrach.units import format_angle, percent

__all__ = ["motions_front", "motions_part", "motions_sentences", "motions_tables"]

Angle = Literal["gon", "deg"]

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


def motions_front(motions: CloudMotions) -> FrontPage:
    """Which parts moved, and what one signs."""
    noun = "Site" if motions.named else "Part"
    names: dict[Verdict, list[str]] = {}
    for part in motions.parts:
        names.setdefault(part.verdict, []).append(part.name)
    stable = motions.stable
    signed = (
        "The motions stated here with their intervals, of what could be compared and of nothing "
        "else."
    )
    if stable is None:
        verdict, sentence = "No stable area", _stable(motions)[0]
        return FrontPage("bad", verdict, sentence, signed=signed)
    share = f"{percent(motions.surface.share)} of the surface of both clouds could be compared"
    registered = "passes" if stable.agrees else "fails"
    sentence = f"{share}; the registration {registered} its test on the stable area."

    def told(which: Verdict, words: str, plural: str) -> str:
        some = names.get(which, [])
        one = len(some) == 1
        what = f"{noun}{'' if one else 's'} {some_of(some, _IN_VERDICT)}"
        return f"{what} {words if one else plural}" if some else ""

    moved = told("moved", "moved", "moved")
    bent = told("not one body", "differs, not as one body", "differ, not as one body")
    few = told("too few distances", "cannot be told", "cannot be told")
    verdict = "; ".join(filter(None, [moved, bent]))
    if verdict:
        return FrontPage("none", verdict, sentence, signed=signed)
    verdict = "; ".join(filter(None, ["No motion found", few]))
    sort: Literal["good", "bad", "none"] = "bad" if not stable.agrees else "none" if few else "good"
    return FrontPage(sort, verdict, sentence, signed=signed)


def motions_sentences(motions: CloudMotions, angle: Angle = "gon") -> list[str]:
    """What keeps its place, what moved, what cannot be told, and what was assumed."""
    out = [*_stable(motions), *_parts(motions, angle), *_surface(motions.surface)]
    return [*out, _registration(motions)]


def _stable(motions: CloudMotions) -> list[str]:
    """The stable area, and the registration on it."""
    stable = motions.stable
    if stable is None:
        return [
            f"No stable area: no more than half of {motions.patches} patches of the surface agree "
            "in one motion, so the registration is not tested by the surface."
        ]
    first = (
        f"{stable.patches} of {motions.patches} patches, {percent(stable.share)} of the surface "
        f"in patches (about {stable.area:.0f} m²), keep their places among each other and are "
        "taken as stable. Assumed is that the largest such group is what did not move; of the "
        "registration nothing was assumed to find it."
    )
    return [first, _registered(stable)]


def _registered(stable: StableArea) -> str:
    """The test of the registration."""
    motion = stable.motion
    verdict = "passes" if stable.agrees else "fails"
    largest = _largest(motion)
    more = (
        f"an error of {1e3 * stable.detectable:.1f} mm along its mean normal would have been found "
        "with 80 %"
        if stable.agrees
        else "either a registration is worse than its covariance says, or what is called stable "
        "moved together; motions against the stable area do not depend on it, those against the "
        "control do"
    )
    return (
        f"The registration {verdict} its test on it ({_test(motion, stable.limit)}{largest}): "
        f"{more}."
    )


def _test(motion: PartMotion, limit: float | None) -> str:
    words = f"test {motion.statistic:.1f} with {motion.rank} degrees of freedom"
    return words if limit is None else f"{words}, limit {limit:.1f}"


def _largest(motion: PartMotion) -> str:
    """How far off the stable area is along its mean normal, if that is seen."""
    if not motion.seen[0]:
        return ""
    return f"; {_with(motion, 0)} mm along its mean normal"


def _with(motion: PartMotion, k: int, sign: float = 1.0, digits: int = 1) -> str:
    """A component with its interval of 95 %, in millimetres or millimetres per metre."""
    half = _NORMAL_95 * float(np.sqrt(max(motion.covariance[k, k], 0.0)))
    return f"{1e3 * sign * motion.values[k]:.{digits}f} ± {1e3 * half:.{digits}f}"


def _parts(motions: CloudMotions, angle: Angle) -> list[str]:
    """Each part with a motion, then the others by name."""
    out = []
    what = "Site" if motions.named else "Part"
    told = [p for p in motions.parts if p.verdict in ("moved", "not one body")]
    for part in told[:_NAMED]:
        out.append(_moved(part, what, angle))
    if told[_NAMED:]:
        out.append(f"{len(told) - _NAMED} more are in the table.")
    still = [p for p in motions.parts if p.verdict == "no motion found"]
    if still:
        seen = sorted(1e3 * p.detectable for p in still if p.detectable is not None)
        named = ", ".join(p.name for p in still[:_NAMED])
        named += f" and {len(still) - _NAMED} more" if still[_NAMED:] else ""
        span = f"{seen[0]:.1f}" if len(seen) == 1 else f"{seen[0]:.1f} to {seen[-1]:.1f}"
        out.append(
            f"No motion was found of {what.lower()} {named}: {span} mm outwards would have been "
            "found with 80 %."
        )
    few = [p.name for p in motions.parts if p.verdict == "too few distances"]
    if few:
        out.append(f"Too few distances to tell a motion of {what.lower()} {', '.join(few)}.")
    if not motions.named and motions.stable is not None and not told:
        out.append("Beside the stable area no part was found that moved.")
    if motions.loose > 0.005:
        out.append(
            f"{percent(motions.loose)} of the surface in patches neither keeps its place nor is "
            "part of a body that was found: borders of parts, and what bends."
        )
    hidden = [p for p in told if p.motion is not None and not p.motion.seen.all()]
    if hidden:
        out.append(
            "Distances along normals do not show how a flat part moves within its own face "
            "(to the side, upwards, about its normal): such motions are not excluded."
        )
    return out


def _moved(part: MovedPart, what: str, angle: Angle) -> str:
    """A part that moved, in one sentence."""
    motion = part.motion
    assert motion is not None
    place = ", ".join(f"{a} {v:.1f}" for a, v in zip("ENU", motion.middle, strict=True))
    head = f"{what} {part.name} (middle {place}; about {part.area:.0f} m²)"
    figures = "; ".join(_figures(motion, angle))
    test = _test(motion, part.limit)
    if part.verdict == "not one body":
        return (
            f"{head} differs and does not move as one body ({motion.left_out} of "
            f"{len(motion.kept)} distances do not go along with the others): {figures} on the "
            "average."
        )
    more = ""
    if part.relative is not None and part.relative.seen[0]:
        more = f"; along its normal {_with(part.relative, 0)} mm against the stable area"
    return f"{head} moved {figures} (95 %; {test}{more})."


def _figures(motion: PartMotion, angle: Angle) -> list[str]:
    """Shift, tilt and turn, those that are seen; which way only where that is sure with 95 %."""
    lies = abs(motion.normal[2]) > _LYING
    # of a floor seen from below up is inwards
    down = lies and motion.normal[2] < 0
    ends = {
        3: ("tilted", "tilt", "north end up" if lies else "upper end outwards"),
        4: ("turned", "turn", "east end up" if lies else "right end outwards"),
    }
    others = {"up": "down", "outwards": "inwards"}
    out = []
    if motion.seen[0]:
        sign = 1.0 if motion.values[0] >= 0 else -1.0
        if _sure(motion, 0):
            way = _towards(sign * motion.normal, angle)
            out.append(f"{_with(motion, 0, sign)} mm {way}")
        else:
            out.append(f"along its normal {_with(motion, 0)} mm")
    for k, (done, noun, end) in ends.items():
        if not motion.seen[k]:
            continue
        if not _sure(motion, k):
            out.append(f"no {noun} is sure ({_with(motion, k, 1.0, 2)} mm/m)")
            continue
        positive = (motion.values[k] >= 0) != down
        last = end.rsplit(" ", 1)[1]
        words = end if positive else end.replace(last, others[last])
        sign = 1.0 if motion.values[k] >= 0 else -1.0
        out.append(f"{done} {_with(motion, k, sign, 2)} mm/m, {words}")
    for k, word in ((1, "east" if lies else "to its right"), (2, "north" if lies else "upwards")):
        if motion.seen[k]:
            out.append(f"{_with(motion, k)} mm {word}")
    if motion.seen[5]:
        out.append(f"{_with(motion, 5, 1.0, 2)} mm/m about its normal")
    return out


def _sure(motion: PartMotion, k: int) -> bool:
    """Is the sign of a component sure with 95 %?"""
    sigma = float(np.sqrt(max(motion.covariance[k, k], 0.0)))
    return abs(float(motion.values[k])) > _NORMAL_95 * sigma


def _towards(direction: Array, angle: Angle) -> str:
    """A direction in words."""
    if abs(direction[2]) > _LYING:
        return "up" if direction[2] > 0 else "down"
    azimuth = float(np.arctan2(direction[0], direction[1]) % (2 * np.pi))
    unit = " gon" if angle == "gon" else "°"
    return f"towards {format_angle(azimuth, angle, 0)}{unit}"


def _surface(surface: NotCompared) -> list[str]:
    """What cannot be compared, by area."""
    out = [
        f"{percent(surface.share)} of the surface of both clouds (about "
        f"{surface.compared:.0f} m²) could be compared."
    ]
    for reason in surface.reasons:
        places = [place for place in reason.places[:_PLACES] if place.area >= _SPECK]
        where = "; ".join(map(_where, places or reason.places[:1]))
        out.append(
            f"Not compared ({reason.words}): {percent(reason.share)} (about {reason.area:.0f} "
            f"m²), most of it at {where}."
        )
    return out


def _where(place: Where) -> str:
    middle = ", ".join(f"{a} {v:.1f}" for a, v in zip("ENU", place.middle, strict=True))
    return f"{middle} ({place.area:.0f} m²)"


def _registration(motions: CloudMotions) -> str:
    """What both registrations share."""
    if motions.one_result:
        return "Both clouds are of one run: its joint covariance is in every sigma."
    if motions.alike:
        return (
            f"Both registrations rest on {len(motions.alike)} given values that are alike: what "
            "these are wrong by is counted once."
        )
    return (
        "Both registrations are taken as independent: no given value of both is known to be one "
        "and the same."
    )


def motions_tables(motions: CloudMotions) -> list[ReportTable]:
    """Stable area, parts, and what cannot be compared; those with rows."""
    tables = [_stable_table(motions), _table(motions), _not_compared(motions.surface)]
    return [table for table in tables if table.rows]


def _stable_table(motions: CloudMotions) -> ReportTable:
    """The stable area, and the test of the registration on it."""

    def verdict(stable: StableArea) -> Cell:
        words = "passes" if stable.agrees else "fails"
        return text_cell(words, "good" if stable.agrees else "bad")

    columns = [
        (ColumnHead("patches"), lambda s: count_cell(s.patches)),
        (ColumnHead("share", "%"), lambda s: percent_cell(s.share)),
        (ColumnHead("area", "m²"), lambda s: fixed_cell(s.area, 1)),
        (ColumnHead("distances"), lambda s: count_cell(s.motion.count)),
        (ColumnHead("out", "mm"), lambda s: _component(s.motion, 0)),
        (ColumnHead("±", "mm"), lambda s: _half(s.motion, 0)),
        (ColumnHead("tilt", "mm/m"), lambda s: _component(s.motion, 3)),
        (ColumnHead("±", "mm/m"), lambda s: _half(s.motion, 3)),
        (ColumnHead("turn", "mm/m"), lambda s: _component(s.motion, 4)),
        (ColumnHead("±", "mm/m"), lambda s: _half(s.motion, 4)),
        (ColumnHead("test"), lambda s: fixed_cell(s.motion.statistic, 1)),
        (ColumnHead("limit"), lambda s: fixed_cell(s.limit, 1)),
        (ColumnHead("detectable", "mm"), lambda s: mm_cell(s.detectable)),
        (ColumnHead("Registration", numeric=False), verdict),
    ]
    rows = [] if motions.stable is None else [motions.stable]
    return build_table("stable", "Stable area", _STABLE_NOTE, rows, columns)


def _table(motions: CloudMotions) -> ReportTable:
    columns = [
        (ColumnHead("Site" if motions.named else "Part", numeric=False), _name),
        (ColumnHead("area", "m²"), lambda p: fixed_cell(p.area, 1)),
        (ColumnHead("distances"), lambda p: count_cell(_of(p, "count"))),
        (ColumnHead("out", "mm"), lambda p: _component(p.motion, 0)),
        (ColumnHead("±", "mm"), lambda p: _half(p.motion, 0)),
        (ColumnHead("tilt", "mm/m"), lambda p: _component(p.motion, 3)),
        (ColumnHead("±", "mm/m"), lambda p: _half(p.motion, 3)),
        (ColumnHead("turn", "mm/m"), lambda p: _component(p.motion, 4)),
        (ColumnHead("±", "mm/m"), lambda p: _half(p.motion, 4)),
        (ColumnHead("out, stable", "mm", wide=True), lambda p: _component(p.relative, 0)),
        (ColumnHead("±", "mm", wide=True), lambda p: _half(p.relative, 0)),
        (ColumnHead("test"), lambda p: fixed_cell(_of(p, "statistic"), 1)),
        (ColumnHead("limit"), lambda p: fixed_cell(p.limit, 1)),
        (ColumnHead("detectable", "mm"), lambda p: mm_cell(p.detectable)),
        (ColumnHead("Verdict", numeric=False), _verdict),
    ]
    return build_table("motions", "Motions of parts", _PARTS_NOTE, motions.parts, columns)


def _not_compared(surface: NotCompared) -> ReportTable:
    rows = [(r, w) for r in surface.reasons for w in r.places[:_PLACES]]
    columns = [
        (ColumnHead("Not compared", numeric=False), lambda x: text_cell(x[0].words)),
        (ColumnHead("share of all", "%"), lambda x: percent_cell(x[0].share)),
        (ColumnHead("E", "m"), lambda x: fixed_cell(x[1].middle[0], 1)),
        (ColumnHead("N", "m"), lambda x: fixed_cell(x[1].middle[1], 1)),
        (ColumnHead("U", "m"), lambda x: fixed_cell(x[1].middle[2], 1)),
        (ColumnHead("along E", "m"), lambda x: fixed_cell(x[1].extent[0], 1)),
        (ColumnHead("along N", "m"), lambda x: fixed_cell(x[1].extent[1], 1)),
        (ColumnHead("along U", "m"), lambda x: fixed_cell(x[1].extent[2], 1)),
        (ColumnHead("area", "m²"), lambda x: fixed_cell(x[1].area, 1)),
    ]
    return build_table(
        "not-compared", "Surface that cannot be compared", _SURFACE_NOTE, rows, columns
    )


def _name(part: MovedPart) -> Cell:
    return text_cell(part.name)


def _verdict(part: MovedPart) -> Cell:
    return text_cell(part.verdict, "bad" if part.verdict in ("moved", "not one body") else "")


def _of(part: MovedPart, name: str) -> float | None:
    return None if part.motion is None else float(getattr(part.motion, name))


def _component(motion: PartMotion | None, k: int) -> Cell:
    return mm_cell(None if motion is None or not motion.seen[k] else float(motion.values[k]))


def _half(motion: PartMotion | None, k: int) -> Cell:
    if motion is None or not motion.seen[k]:
        return mm_cell(None)
    return mm_cell(_NORMAL_95 * float(np.sqrt(max(motion.covariance[k, k], 0.0))))


def motions_part(motions: CloudMotions) -> MotionsPart:
    """The same as JSON."""
    stable = motions.stable
    return MotionsPart.model_validate(
        {
            "parts": [_part(p) for p in motions.parts],
            "sites": motions.named,
            "stable": None
            if stable is None
            else {
                "patches": stable.patches,
                "share": stable.share,
                "area": stable.area,
                "motion": _motion(stable.motion),
                "limit": stable.limit,
                "agrees": stable.agrees,
                "detectable": number(stable.detectable),
            },
            "patches": motions.patches,
            "loose": motions.loose,
            "factor": motions.factor,
            "compared": {"area": motions.surface.compared, "share": motions.surface.share},
            "not_compared": motions.surface.reasons,
            "given_alike": list(motions.alike),
            "one_result": motions.one_result,
            "sentences": motions_sentences(motions),
        }
    )


def _part(part: MovedPart) -> dict[str, Any]:
    return {
        "name": part.name,
        "verdict": part.verdict,
        "area": part.area,
        "motion": None if part.motion is None else _motion(part.motion),
        "against_stable": None if part.relative is None else _motion(part.relative),
        "limit": part.limit,
        "detectable": None if part.detectable is None else number(part.detectable),
    }


def _motion(motion: PartMotion) -> dict[str, Any]:
    values: Sequence[float] = motion.values.tolist()
    return {
        "middle": motion.middle.tolist(),
        "normal": motion.normal.tolist(),
        "distances": motion.count,
        "left_out": motion.left_out,
        "statistic": motion.statistic,
        "dof": motion.rank,
        "components": dict(zip(COMPONENTS, map(number, values), strict=True)),
        "covariance": [[number(v) for v in row] for row in motion.covariance.tolist()],
        "unseen": [name for name, seen in zip(COMPONENTS, motion.seen, strict=True) if not seen],
    }
