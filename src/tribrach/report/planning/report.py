"""What a plan tells the crew: findings in words, map and tables; the same as JSON."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from tribrach.job.results import JobResults
from tribrach.network.quality import assess
from tribrach.network.roles import datum_sentence
from tribrach.observations.scanner import ScannerPolar
from tribrach.planning.prediction import Figures
from tribrach.report.build import build
from tribrach.report.figures import Picture
from tribrach.report.names import some_of
from tribrach.report.numbers import Style, number, numbers
from tribrach.report.page import FrontPage
from tribrach.report.planning.page import PlanPage, gain_map
from tribrach.report.planning.sights import sights_of
from tribrach.report.planning.tables import (
    criterion_words,
    lever_arm_json,
    lever_arm_sentences,
    plan_tables,
    shown,
)
from tribrach.report.schema.base import heading
from tribrach.report.schema.plan import SCHEMA, PlanDocument
from tribrach.sentences import Sentence, joined

if TYPE_CHECKING:
    from tribrach.job.plan.steps import DesignResult

__all__ = ["plan_document", "plan_report"]


#: zenith angles [deg] and ratio of ranges that calibrations take
_STEEP, _SPREAD = (45, 110), 3


#: what changes the criterion by less than this share can be spared
_SPARE = 0.01
_SIGNED = (
    "This plan: stations, targets and sights, with what they are predicted to reach if they are "
    "measured as stated here."
)


def plan_report(plan: DesignResult) -> PlanPage:
    """Findings, tables and map of a plan."""
    quality = assess(plan.adjustment)
    content = build(plan.adjustment, quality, title=plan.title, angle=_angle(plan))
    content = replace(content, job=JobResults(project=plan.project))
    sights = sights_of(content, plan.adjustment)
    return PlanPage(
        plan.title,
        tuple(_sentences(plan)),
        plan.warnings,
        plan_tables(plan, sights, Style(content.settings.angle)),
        content,
        _front(plan),
        tuple(_pictures(plan)),
    )


def _angle(plan: DesignResult) -> Literal["gon", "deg"]:
    """The unit of angles that the project asks for."""
    return "gon" if plan.project is None else plan.project.output.angle


def _front(plan: DesignResult) -> FrontPage:
    """Whether the plan does what it has to."""
    kind = plan.criterion.kind
    words = criterion_words(plan, kind)
    value = shown(kind, plan.after.value(kind))
    signed = f"{_SIGNED} {datum_sentence(plan.adjustment)}"
    if plan.required is None:
        return FrontPage(
            "none",
            "Predicted",
            f"The {words} is {value}; no requirement is stated.",
            signed=signed,
        )
    sentence = f"The {words} is {value}."
    if not plan.reached and plan.sets is not None and plan.sets.reached:
        sentence += " More sets reach it, see below."
    return FrontPage("good" if plan.reached else "bad", _requirement(plan), sentence, signed=signed)


def _requirement(plan: DesignResult) -> str:
    """Whether what is required is reached, without the stop."""
    assert plan.required is not None
    verdict = "is reached" if plan.reached else "is not reached"
    enough = " without any proposal" if plan.reached and not plan.proposals else ""
    return Sentence(
        "The requirement of {shown} {verdict}{enough}",
        shown=shown(plan.criterion.kind, plan.required),
        verdict=verdict,
        enough=enough,
    )


def _sentences(plan: DesignResult) -> list[str]:
    kind, after = plan.criterion.kind, plan.after
    value = after.value(kind)
    words = criterion_words(plan, kind)
    out = [
        "Everything here is predicted from the standard deviations of the observations, a priori: "
        f"{plan.adjustment.n_observations} values, {plan.adjustment.n_unknowns} unknowns, "
        f"redundancy {plan.adjustment.dof}."
    ]
    if plan.before is not None and plan.proposals:
        out.append(
            Sentence(
                "The {words} goes from {shown} to {shown2} with {plan} proposals.",
                words=words,
                shown=shown(kind, plan.before.value(kind)),
                shown2=shown(kind, value),
                plan=len(plan.proposals),
            )
        )
    else:
        out.append(Sentence("The {words} is {shown}.", words=words, shown=shown(kind, value)))
        if plan.single:
            out.append("No place that was looked at makes it better.")
    if plan.required is not None:
        out.append(Sentence("{requirement}.", requirement=_requirement(plan)))
    out += lever_arm_sentences(plan.lever_arm)
    if plan.lever_arm is None:
        out.append(
            Sentence(
                "Of the points that are judged, {after} is worst, with {after2:mmg3} in its "
                "worst direction; this depends on the datum.",
                after=after.names[int(np.argmax(after.sigma))],
                after2=after.sigma.max(),
            )
        )
        out.append(
            Sentence(
                "Between two epochs measured like this its displacement of {detectable:mmg3} would "
                "be found with 80 % (test at 5 %), in the direction in which that is hardest.",
                detectable=plan.detectable,
            )
        )
    out += [
        Sentence(
            "The weakest observation is {after.redundancy_at} with a redundancy of "
            "{after.redundancy:2}.",
            after=after,
        ),
    ]
    if after.undetected_at:
        out.append(
            Sentence(
                "An error that stays undetected moves a point by up to {undetected}: {at} (test at "
                "{alpha:%g}, power 80 %).",
                undetected=shown("undetected", after.undetected),
                at=after.undetected_at,
                alpha=0.001,
            )
        )
    if after.correlation_at:
        out.append(
            Sentence(
                "{after.correlation_at} have the largest correlation, {after.correlation:3}",
                after=after,
            )
            + ("; they can hardly be told apart." if after.correlation > 0.95 else ".")
        )
    return out + _of_proposals(plan) + _of_weights(plan) + _of_calibration(plan) + _of_datums(plan)


def _of_proposals(plan: DesignResult) -> list[str]:
    kind = plan.criterion.kind
    out = []
    for p in plan.proposals:
        place = joined(
            ", ",
            (
                Sentence("{axis} {x:2}", axis=axis, x=round(x, 2) + 0.0)
                for axis, x in zip("ENU", p.place, strict=True)
            ),
        )
        gain = (
            ": nothing is determined without it"
            if math.isnan(p.before)
            else Sentence(
                ": {shown} becomes {shown2}",
                shown=shown(kind, p.before),
                shown2=shown(kind, p.after),
            )
        )
        out.append(
            Sentence("Add {p.sort} {p.name} at {place} m{gain}.", p=p, place=place, gain=gain)
        )
    if plan.relocations:
        r = plan.relocations[0]
        out.append(
            Sentence(
                "The best single move is {r.name} to {r.to}: {shown} becomes {shown2}{at}.",
                r=r,
                shown=shown(kind, r.before),
                shown2=shown(kind, r.after),
                at=" at the points that do not move" * (not plan.lever_arm),
            )
        )
    spare = [s for s in plan.spares if _spared(plan, s.before, s.after)]
    if plan.spares:
        few = ", ".join(s.name for s in sorted(spare, key=lambda s: s.after)[:10])
        could = "could be left out" if len(spare) == 1 else "could each be left out alone"
        out.append(
            f"{len(spare)} of {len(plan.spares)} {could} for less than 1 % of the criterion"
            + (f": {few}." if few else ".")
        )
    return out


def _spared(plan: DesignResult, before: float, after: float) -> bool:
    change = before - after if plan.criterion.kind == "redundancy" else after - before
    return bool(change <= _SPARE * abs(before))


def _of_weights(plan: DesignResult) -> list[str]:
    kind = plan.criterion.kind
    out = []
    if plan.sets is not None:
        if plan.sets.reached and plan.sets.steps:
            many = [f"{n} sets at {s}" for s, n in plan.sets.sets.items() if n > 1]
            if min(plan.sets.sets.values()) == 1:
                many.append("one elsewhere")
            value = shown(kind, plan.sets.value)
            out.append(
                Sentence(
                    "With {sets} the requirement is reached ({value}).",
                    sets=some_of(many, len(many)),
                    value=value,
                )
            )
        elif not plan.sets.reached:
            out.append(
                Sentence(
                    "More sets do not reach the requirement: at best {value}.",
                    value=shown(kind, plan.sets.value),
                )
            )
    for p in plan.precisions:
        group = p.group.replace("_", " ")
        if math.isnan(p.factor):
            out.append(
                Sentence(
                    "However precise the {group} readings, they alone leave {limit}.",
                    group=group,
                    limit=shown(kind, p.limit),
                )
            )
        elif p.factor < 1:
            out.append(
                Sentence(
                    "The requirement is reached if the {group} readings are {times:2} times as "
                    "precise.",
                    group=group,
                    times=1 / p.factor,
                )
            )
    return out


def _of_calibration(plan: DesignResult) -> list[str]:
    """What calibrations need and the scans of the plan lack (method section 3.7)."""
    scans = [
        o
        for o in plan.network.observations
        if isinstance(o, ScannerPolar) and o.model is not None and len(o)
    ]
    if not scans:
        return []
    v = np.concatenate([np.where(o.values[:, 2] > np.pi, 2 * np.pi, 0) for o in scans])
    v = np.abs(np.concatenate([o.values[:, 2] for o in scans]) - v)
    r = np.concatenate([o.values[:, 0] for o in scans])
    faces = {float(face) for o in scans for face in np.unique(o.face)}
    out = []
    if len(faces) < 2:
        out.append("Calibrations gain most from two faces; the plan has one.")
    if np.degrees(v.min()) > _STEEP[0] or np.degrees(v.max()) < _STEEP[1]:
        out.append(
            Sentence(
                "For a calibration targets should be steep, at zenith angles below {steep[0]}° "
                "and above {steep[1]}°; the plan has {v:°0} to {v2:°0}.",
                steep=_STEEP,
                v=v.min(),
                v2=v.max(),
            )
        )
    if r.max() < _SPREAD * r.min():
        out.append(
            Sentence(
                "For a calibration ranges should differ by a factor of {spread}; the plan has "
                "{r:m1~} to {r2:m1}.",
                spread=_SPREAD,
                r=r.min(),
                r2=r.max(),
            )
        )
    return out


def _of_datums(plan: DesignResult) -> list[str]:
    valid = [d for d in plan.datums if not d.refused]
    if len(valid) < 2:
        return []
    distances = [d.distance for d in valid]
    same = max(distances) - min(distances) <= 1e-4 * max(distances)
    if same:
        return [
            Sentence(
                "The datums that were compared give the same sigma of every distance (the "
                "largest {distances:mmg3}): they differ in the sigmas of coordinates only, "
                "which are not to be compared between datums.",
                distances=max(distances),
            )
        ]
    return [
        Sentence(
            "Control adds to the network itself: the largest sigma of a distance is "
            "{distances:mmg3~} to {distances2:mmg3}, by datum.",
            distances=min(distances),
            distances2=max(distances),
        )
    ]


def _pictures(plan: DesignResult) -> list[Picture]:
    if len(plan.single) < 3:
        return []
    kind = plan.criterion.kind
    start = plan.before.value(kind) if plan.before is not None else max(plan.single.values())
    values = np.array(list(plan.single.values()))
    gains = values - start if kind == "redundancy" else start - values
    places = np.array([plan.places[n] for n in plan.single])
    chosen = [p for p in plan.proposals if p.name in plan.single]
    state = plan.adjustment.state
    metric = kind in ("sigma", "undetected")
    return [
        gain_map(
            places,
            gains * (1e3 if metric else 1.0),
            [p.name for p in chosen],
            np.array([p.place for p in chosen]).reshape(-1, 3),
            state.pose_t,
            "mm" if metric else "1",
        )
    ]


def _figures_json(figures: Figures | None) -> Any:
    if figures is None:
        return None
    return {
        "sigma": dict(zip(figures.names, numbers(figures.sigma), strict=True)),
        "redundancy": {"value": number(figures.redundancy), "at": figures.redundancy_at},
        "undetected": {"value": number(figures.undetected), "at": figures.undetected_at},
        "correlation": {"value": number(figures.correlation), "at": figures.correlation_at},
    }


def plan_document(plan: DesignResult, page: PlanPage) -> PlanDocument:
    """The plan as data: metres and radians, names as keys, None where there is no number."""
    adjustment, content = plan.adjustment, page.network
    layout = adjustment.layout
    new = {p.name for p in plan.proposals}
    covariances = adjustment.position_covariances()
    places = {
        name: {
            "xyz": numbers(adjustment.state.positions[k]),
            "covariance": [numbers(row) for row in covariances[k]],
            "new": name in new,
        }
        for k, name in enumerate((*layout.names["point"], *layout.names["pose"]))
    }
    points = layout.count("point")
    sights = [
        {
            "from": s.start,
            "to": s.end,
            "kinds": s.kinds,
            "length": number(s.length),
            "azimuth": number(s.azimuth),
            "zenith": number(s.zenith),
            "values": s.values,
            "redundancy": s.redundancy,
            "undetected": s.undetected,
        }
        for s in sights_of(content, adjustment)
    ]
    data = heading(SCHEMA) | {
        "title": plan.title,
        "datum": {"kind": content.datum.kind, "names": list(content.datum.names)},
        "criterion": {
            "kind": plan.criterion.kind,
            "points": list(plan.criterion.names),
            "required": plan.required,
            "reached": plan.reached,
        },
        "before": _figures_json(plan.before),
        "plan": _figures_json(plan.after),
        "lever_arm": lever_arm_json(plan.lever_arm),
        "points": dict(list(places.items())[:points]),
        "stations": dict(list(places.items())[points:]),
        "parameters": {
            u: number(math.sqrt(adjustment.covariance(u)[0, 0])) for u in layout.names["scalar"]
        },
        "sights": sights,
        "designs_judged": plan.judged,
        **_proposals_json(plan),
        "findings": list(page.sentences),
        "warnings": list(plan.warnings),
    }
    return PlanDocument.model_validate(data)


def _proposals_json(plan: DesignResult) -> dict[str, Any]:
    """What is proposed, and what it would take."""
    sets = plan.sets
    return {
        "proposals": [
            {
                "add": p.sort,
                "name": p.name,
                "xyz": numbers(p.place),
                "before": number(p.before),
                "after": number(p.after),
            }
            for p in plan.proposals
        ],
        "moves": [
            {
                "name": r.name,
                "to": r.to,
                "xyz": numbers(r.place),
                "before": number(r.before),
                "after": number(r.after),
            }
            for r in plan.relocations
        ],
        "without": [
            {"sort": s.sort, "name": s.name, "before": number(s.before), "after": number(s.after)}
            for s in plan.spares
        ],
        "sets": None
        if sets is None
        else {"sets": dict(sets.sets), "value": number(sets.value), "reached": sets.reached},
        "precision": [
            {
                "group": p.group,
                "sigma": p.sigma,
                "factor": number(p.factor),
                "perfect": number(p.limit),
            }
            for p in plan.precisions
        ],
        "datums": [
            {
                "datum": d.words,
                "sigma": number(d.sigma),
                "mean": number(d.mean),
                "distance": number(d.distance),
                "redundancy": number(d.redundancy),
                "refused": d.refused,
            }
            for d in plan.datums
        ],
    }
