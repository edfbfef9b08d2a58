"""What a plan tells the crew: findings, map and tables."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from tribrach._types import Array
from tribrach.answers import Form
from tribrach.job.results import JobResults
from tribrach.network.quality import assess
from tribrach.network.roles import datum_sentence
from tribrach.observations.scanner import ScannerPolar
from tribrach.questions.plan.design import DesignResult
from tribrach.questions.plan.lever_arm import LeverArmForecast
from tribrach.questions.plan.tables import METRIC, criterion_words, plan_tables, shown, solutions
from tribrach.report.answer import Answer
from tribrach.report.build import build
from tribrach.report.charts import Chart, beside, colour_bar
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding, words
from tribrach.report.names import some_of
from tribrach.report.notation import notation_of
from tribrach.report.numbers import Style
from tribrach.report.page import FrontPage
from tribrach.sentences import Sentence

if TYPE_CHECKING:
    from tribrach.project import Project

FORM = Form("plan", DesignResult, 1, findings=list[str])
#: zenith angles [rad] and ratio of ranges that calibrations take
_STEEP, _SPREAD = np.radians((45, 110)), 3
#: what changes the criterion by less than this share can be spared
_SPARE = 0.01
#: targets that leave a wider part of the horizon free than this are not all around [rad]
_GAP = np.pi
_SIGNED = (
    "This plan: stations, targets and sights, with what they are predicted to reach if they are "
    "measured as stated here."
)


def answer_of(plan: DesignResult, project: Project | None = None) -> Answer:
    """The plan as the crew reads it, written as a project wants it."""
    angle: Literal["gon", "deg"] = "gon" if project is None else project.output.angle
    content = build(plan.adjustment, assess(plan.adjustment), title=plan.title, angle=angle)
    content = replace(content, job=JobResults(project=project))
    found = list(_findings(plan))
    answer = Answer(
        "Plan of a network",
        plan.title,
        _front(plan),
        plan,
        FORM,
        {"findings": words(found)},
        [*(Finding(text, True) for text in plan.warnings), *found],
        pictures=_pictures(plan),
        tables=plan_tables(plan, Style(angle)),
        footer="All standard deviations are predicted from those of the observations; nothing was "
        "measured.",
        network=content,
        notation=notation_of(content),
    )
    return replace(answer, terminal=[answer.printed(without=("sights",))])


def _front(plan: DesignResult) -> FrontPage:
    """Whether the plan does what it has to."""
    signed = f"{_SIGNED} {datum_sentence(plan.adjustment)}"
    kind = plan.criterion.kind
    own = {"words": criterion_words(plan, kind), "value": shown(kind, plan.after.value(kind))}
    if plan.required is None:
        said = Sentence("The {words} is {value}; no requirement is stated.", **own)
        return FrontPage("none", "Predicted", said, signed=signed)
    said = Sentence("The {words} is {value}.", **own)
    if not plan.reached and plan.sets is not None and plan.sets.reached:
        said += " More sets reach it, see below."
    return FrontPage("good" if plan.reached else "bad", _required(plan), said, signed=signed)


def _required(plan: DesignResult) -> Sentence:
    """Whether what is required is reached, without the stop."""
    assert plan.required is not None
    verdict = "is reached" if plan.reached else "is not reached"
    verdict += " without any proposal" * bool(plan.reached and not plan.proposals)
    value = shown(plan.criterion.kind, plan.required)
    return Sentence(f"The requirement of {{value}} {verdict}", value=value)


def _findings(plan: DesignResult) -> Iterator[Finding]:
    kind, after, a = plan.criterion.kind, plan.after, plan.adjustment
    yield Finding.of(
        "predicted",
        "Everything here is predicted from the standard deviations of the observations, a priori: "
        "{a.n_observations} values, {a.n_unknowns} unknowns, redundancy {a.dof}.",
        a=a,
    )
    own: Any = {"words": criterion_words(plan, kind), "value": shown(kind, after.value(kind))}
    if plan.before is not None and plan.proposals:
        yield Finding.of(
            "criterion",
            "The {words} goes from {before} to {value} with {n} proposals.",
            before=shown(kind, plan.before.value(kind)),
            n=len(plan.proposals),
            **own,
        )
    else:
        yield Finding.of("criterion", "The {words} is {value}.", **own)
        if plan.single:
            yield Finding("No place that was looked at makes it better.", key="no_place")
    if plan.required is not None:
        yield Finding(_required(plan) + ".", key="requirement")
    if plan.lever_arm is not None:
        yield from _of_lever_arm(plan.lever_arm)
    else:
        yield Finding.of(
            "worst_point",
            "Of the points that are judged, {worst.at} is worst, with {worst.value:mmg3} in its "
            "worst direction; this depends on the datum.",
            worst=after.worst,
        )
        yield Finding.of(
            "detectable",
            "Between two epochs measured like this its displacement of {plan.detectable:mmg3} "
            "would be found with 80 % (test at 5 %), in the direction in which that is hardest.",
            plan=plan,
        )
    yield Finding.of(
        "weakest",
        "The weakest observation is {weakest.at} with a redundancy of {weakest.value:2}.",
        weakest=after.redundancy,
    )
    if after.undetected.at:
        yield Finding.of(
            "undetected",
            "An error that stays undetected moves a point by up to {value}: {at} (test at "
            "{alpha:%1}, power 80 %).",
            alpha=plan.criterion.alpha0,
            value=shown("undetected", after.undetected.value),
            at=after.undetected.at,
        )
    if after.correlation.at:
        told = "; they can hardly be told apart" * (after.correlation.value > 0.95)
        said = f"{{rho.at}} have the largest correlation, {{rho.value:3}}{told}."
        yield Finding.of("correlation", said, rho=after.correlation)
    yield from _of_proposals(plan)
    yield from _of_weights(plan)
    yield from _of_calibration(plan)
    yield from _of_datums(plan)


def _of_lever_arm(forecast: LeverArmForecast) -> Iterator[Finding]:
    """What the plan makes of the lever arm, and whether its targets stand all around."""
    for told, covariance in solutions(forecast)[1:]:
        yield Finding.of(
            "lever_arm",
            "Lever arm {name} {told}: sigma x {sigma[0]:mmg2}, y {sigma[1]:mmg2}, "
            "z {sigma[2]:mmg2}.",
            name=forecast.name,
            told=told,
            sigma=np.sqrt(np.diag(covariance)),
        )
    if forecast.gaps.plan > _GAP:
        yield Finding.of(
            "horizon",
            "The targets leave {gaps.plan:degrees0} of the horizon free: the scanner's place is "
            "extrapolated from them. Targets on the other side serve most.",
            gaps=forecast.gaps,
        )


def _of_proposals(plan: DesignResult) -> Iterator[Finding]:
    kind = plan.criterion.kind
    for p in plan.proposals:
        gain = "nothing is determined without it"
        if not math.isnan(p.before):
            gain = Sentence(
                "{before} becomes {after}", before=shown(kind, p.before), after=shown(kind, p.after)
            )
        yield Finding.of(
            "proposal",
            "Add {p.sort} {p.name} at E {at[0]:m2~}, N {at[1]:m2~}, U {at[2]:m2}: {gain}.",
            p=p,
            at=[round(x, 2) + 0.0 for x in p.place.tolist()],
            gain=gain,
        )
    if plan.relocations:
        best = plan.relocations[0]
        still = " at the points that do not move" * (plan.lever_arm is None)
        yield Finding.of(
            "move",
            f"The best single move is {{best.name}} to {{best.to}}: {{before}} becomes {{after}}"
            f"{still}.",
            best=best,
            before=shown(kind, best.before),
            after=shown(kind, best.after),
        )
    if plan.spares:
        spare = [s for s in plan.spares if _spared(plan, s.before, s.after)]
        few = ", ".join(s.name for s in sorted(spare, key=lambda s: s.after)[:10])
        could = "could be left out" if len(spare) == 1 else "could each be left out alone"
        said = f"{{n}} of {{of}} {could} for less than 1 % of the criterion"
        said += ": {few}." if few else "."
        yield Finding.of("spare", said, n=len(spare), of=len(plan.spares), few=few)


def _spared(plan: DesignResult, before: float, after: float) -> bool:
    change = before - after if plan.criterion.kind == "redundancy" else after - before
    return bool(change <= _SPARE * abs(before))


def _of_weights(plan: DesignResult) -> Iterator[Finding]:
    kind = plan.criterion.kind
    if plan.sets is not None and plan.sets.reached and plan.sets.steps:
        many = [f"{n} sets at {s}" for s, n in plan.sets.sets.items() if n > 1]
        if min(plan.sets.sets.values()) == 1:
            many.append("one elsewhere")
        said, value = some_of(many, len(many)), shown(kind, plan.sets.value)
        yield Finding.of(
            "sets", "With {many} the requirement is reached ({value}).", many=said, value=value
        )
    elif plan.sets is not None and not plan.sets.reached:
        value = shown(kind, plan.sets.value)
        yield Finding.of(
            "sets", "More sets do not reach the requirement: at best {value}.", value=value
        )
    for p in plan.precisions:
        group = p.group.replace("_", " ")
        if math.isnan(p.factor):
            said = "However precise the {group} readings, they alone leave {limit}."
            yield Finding.of("precision", said, group=group, limit=shown(kind, p.limit))
        elif p.factor < 1:
            said = "The requirement is reached if the {group} readings are {times:2} times as "
            yield Finding.of("precision", f"{said}precise.", group=group, times=1 / p.factor)


def _of_calibration(plan: DesignResult) -> Iterator[Finding]:
    """What calibrations need and the scans of the plan lack (method section 3.7)."""
    scans = [
        o
        for o in plan.network.observations
        if isinstance(o, ScannerPolar) and o.model is not None and len(o)
    ]
    if not scans:
        return
    v = np.concatenate([o.values[:, 2] for o in scans])
    v = np.where(v > np.pi, 2 * np.pi - v, v)
    r = np.concatenate([o.values[:, 0] for o in scans])
    if len({float(face) for o in scans for face in np.unique(o.face)}) < 2:
        yield Finding("Calibrations gain most from two faces; the plan has one.", key="faces")
    if v.min() > _STEEP[0] or v.max() < _STEEP[1]:
        yield Finding.of(
            "steep",
            "For a calibration targets should be steep, at zenith angles below {steep[0]:°0} and "
            "above {steep[1]:°0}; the plan has {low:°0~} to {high:°0}.",
            steep=_STEEP,
            low=v.min(),
            high=v.max(),
        )
    if r.max() < _SPREAD * r.min():
        yield Finding.of(
            "spread",
            f"For a calibration ranges should differ by a factor of {_SPREAD}; the plan has "
            "{low:m1~} to {high:m1}.",
            low=r.min(),
            high=r.max(),
        )


def _of_datums(plan: DesignResult) -> Iterator[Finding]:
    distances = [d.distance for d in plan.datums if not d.refused]
    if len(distances) < 2:
        return
    low, high = min(distances), max(distances)
    if high - low <= 1e-4 * high:
        yield Finding.of(
            "datums",
            "The datums that were compared give the same sigma of every distance (the largest "
            "{high:mmg3}): they differ in the sigmas of coordinates only, which are not to be "
            "compared between datums.",
            high=high,
        )
    else:
        yield Finding.of(
            "datums",
            "Control adds to the network itself: the largest sigma of a distance is {low:mmg3~} "
            "to {high:mmg3}, by datum.",
            low=low,
            high=high,
        )


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
    metric = kind in METRIC
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


def gain_map(
    places: Array,
    gains: Array,
    chosen: Sequence[str],
    chosen_xyz: Array,
    stations: Array,
    unit: str,
) -> Picture:
    """Where one target or station more serves how much, in plan and from the side.

    ``gains`` say in ``unit`` what each of the places is worth; ``chosen`` is what is proposed.
    """
    every = np.concatenate([places, chosen_xyz, stations])
    low, high = every.min(axis=0), every.max(axis=0)
    margin = 0.06 * float((high - low).max()) + 0.5
    bottom, top = float(gains.min()), float(gains.max())
    panels = []
    for a, b in ((0, 1), (0, 2)):
        ends = [(float(low[k]) - margin, float(high[k]) + margin) for k in (a, b)]
        labels = ("E [m]", "N [m]" if b == 1 else "U [m]")
        panel = Chart(ends[0], ends[1], labels, (600.0, 480.0), equal=True)
        panel.cloud(places[:, a], places[:, b], (gains - bottom) / max(top - bottom, 1e-12))
        for xyz in stations:
            panel.place(float(xyz[a]), float(xyz[b]), "", "station")
        for name, xyz in zip(chosen, chosen_xyz, strict=True):
            panel.place(float(xyz[a]), float(xyz[b]), name, "ring")
        panels.append(panel)
    caption = (
        "Places that were looked at, each alone, in plan and from the side; diamonds are stations, "
        "rings what is proposed."
    )
    title = "What each place is worth"
    scale = colour_bar(bottom, top, f"gain [{unit}]", 1200.0)
    return Picture("gain", title, beside([panels], title, scale), caption, wide=True)
