"""What the scans of a scanner say of its noise: findings, a plot of the law, tables."""

from __future__ import annotations

from collections.abc import Iterator
from operator import itemgetter
from typing import Any

import numpy as np

from tribrach.answers import Form
from tribrach.questions.noise.estimate import NoiseEstimate, NoiseRow
from tribrach.report.answer import Answer
from tribrach.report.charts import HALF, Chart, beside, legend
from tribrach.report.columns import column
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding, words
from tribrach.report.numbers import counted
from tribrach.report.page import FrontPage
from tribrach.report.tables import ReportTable, build_table
from tribrach.scan.noise_law import By, ContradictedClass, LastingEffect
from tribrach.sentences import Sentence, capital, joined
from tribrach.units import percent

FORM = Form("noise", NoiseEstimate, 1, sentences=list[str])
#: t from which on range or incidence are said to matter after the law, where they change sigma by
#: so much at least
_T, _CHANGE = 3.0, 0.03
#: changes that surely stay below this are said not to matter
_LITTLE = 0.1
#: sigmas of coordinates in steps are worth nothing below this share of the step
_UNSEEN = 0.5
#: factor between observed and stated that is said
_APART = 1.15
_SIGNED = "The noise stated here: of these scans, and of no other mode of the scanner."
#: what classes are of, in words
_CAUSES: dict[By, str] = {
    "intensity": "intensities of",
    "range": "ranges of",
    "incidence": "angles of incidence of",
}
#: what an instrument file takes from elsewhere, in words
_CARRIED = {
    "scan_angle_arcsec": "the noise of the angles",
    "scan_angle_accuracy_arcsec": "their accuracy",
    "beam_exit_mm": "the footprint of the beam",
    "beam_divergence_mrad": "the footprint of the beam",
}


def answer_of(estimate: NoiseEstimate) -> Answer:
    """The estimate as people read it."""
    found, rows = list(findings_of(estimate)), estimate.classes
    lines = [
        f"{s.source}: {s.patches} planar patches with {s.points} points" for s in estimate.scans
    ]
    lines += [
        Sentence(
            "  {r.by} {limits}: {r.patches} patches, {r.observed:mm2} seen, {r.fitted:mm2} "
            "by the law (chi²/dof {r.chi2_dof:2})",
            r=r,
            limits=_limits(r),
        )
        + ("" if np.isnan(r.stated) else Sentence(", stated {r.stated:mm2}", r=r))
        for r in rows
    ]
    title = ", ".join(scan.source for scan in estimate.scans[:6])
    front = _front(estimate)
    # a verdict on what is stated says it with its figure
    told = [one for one in found if front.sort == "none" or one.key != "beside_stated"]
    return Answer(
        "Noise of a scanner by its scans",
        title + (" and more" if len(estimate.scans) > 6 else ""),
        front,
        estimate,
        FORM,
        {"sentences": words(found)},
        told,
        pictures=[_picture(estimate)],
        tables=[_classes(rows), _figures(estimate), _scans(estimate)],
        footer="Patches are fitted by planes; what they lose of the degrees of freedom is counted.",
        terminal=[joined("\n", [*lines, *(one.line() for one in found)])],
    )


def _limits(row: NoiseRow | ContradictedClass) -> str:
    """Limits of a class with their unit."""
    if row.by == "range":
        return Sentence("{row.low:m1~} to {row.high:m1}", row=row)
    if row.by == "incidence":
        return Sentence("{row.low:°0~} to {row.high:°0}", row=row)
    return Sentence("{low} to {high}", low=_light(row.low), high=_light(row.high))


def _light(intensity: float) -> str:
    """An intensity of any scale."""
    spec = "0" if abs(intensity) >= 1000 else "g3"
    return Sentence(f"{{intensity:{spec}}}", intensity=intensity)


def findings_of(estimate: NoiseEstimate) -> Iterator[Finding]:
    """The findings in words, each with its figures, and which of them warn."""
    yield from _law(estimate)
    yield from _contradicted(estimate)
    yield from _across(estimate)
    yield from _carried(estimate)
    yield from _left(estimate)
    yield from _rests(estimate)


def _law(estimate: NoiseEstimate) -> Iterator[Finding]:
    """Noise of the range."""
    fitted, law = estimate.fitted, estimate.fitted.law
    if law is not None:
        light = np.array([law.low, np.sqrt(law.low * law.high), law.high])
        figures = joined(
            ", ",
            (
                Sentence("{s:mm2} (sigma {e:mmg2~}) at {light}", s=s, e=e, light=_light(i))
                for s, e, i in zip(law.sigma(light), fitted.law_sigma(light), light, strict=True)
            ),
        )
        yield Finding.of(
            "law",
            "Noise of ranges is a law of the intensity: {law.words}; {figures}.",
            law=law,
            figures=figures,
        )
        yield Finding.of(
            "units",
            "Intensities are as in the files, {units}: the law holds for scans that were written "
            "alike, and classes show how well a power describes them.",
            units=", and ".join(estimate.units),
        )
    yield Finding.of(
        "range",
        "{what}: {by.range:mm2} + {by.range_scale:ppm0} of the range, over the cosine of the "
        "incidence{power}.",
        what="Without intensity" if law else "Noise of ranges",
        by=fitted,
        power=""
        if fitted.incidence == 1
        else Sentence(" to the power of {k:g2}, which these scans show", k=fitted.incidence),
    )
    if law is None:
        yield Finding.of("no_law", "There is no law of the intensity: {by.why}.", by=fitted)


def _contradicted(estimate: NoiseEstimate) -> Iterator[Finding]:
    """Where patches contradict the law, the worst class of each cause."""
    causes = set[str]()
    for one in estimate.contradicted:
        if one.by in causes:
            continue
        causes.add(one.by)
        said = "The law does not hold at {cause} {limits}: "
        if one.smoothest:
            said += (
                "even the smoothest tenth of all {one.patches} patches has {one.factor:2} times "
            )
            said += "its sigma ({one.factor_low:2} to {one.factor_high:2}), and {one.beyond} are "
            said += "beyond what noise by the law could be. All surfaces there are rough, or the "
            said += "noise has another form."
        else:
            said += "the {one.patches} smooth patches have {one.factor:2} times its sigma "
            said += "({one.factor_low:2} to {one.factor_high:2}, 0.90 to 1.10 would do)."
        yield Finding.of(
            "contradicted",
            said,
            True,
            cause=_CAUSES[one.by],
            limits=_limits(one),
            one=one,
        )


def _across(estimate: NoiseEstimate) -> Iterator[Finding]:
    """Noise across the beam, and what is stated of it."""
    fitted = estimate.fitted
    if not np.isfinite(fitted.angle_sigmas).all():
        yield Finding.of(
            "across_open",
            "Surfaces are not seen both straight and slantwise, so that noise of the angles cannot "
            "be told from that of the range: all of it is taken for noise of the range{besides}.",
            besides=" here"
            if estimate.across is None
            else ", beside what is stated across the beam",
        )
        return
    yield Finding.of(
        "across",
        "Across the beam: {by.horizontal:″1} (sigma {by.angle_sigmas[0]:″1~}) horizontally, "
        "{by.vertical:″1} ({by.angle_sigmas[1]:″1~}) vertically, and {by.place:mm2} (sigma "
        "{by.place_sigma:mm2~}) at any range, all with the footprint of the beam.",
        by=fitted,
    )
    if not estimate.across_known:
        worst = int(np.argmax(estimate.across_errors))
        error = float(estimate.across_errors[worst])
        yield Finding.of(
            "across_unknown",
            "These scans alone do not part the noise across the beam from that of the range: these "
            f"figures together have a sigma of {'more than 100 %' if error > 1 else '{error:%0}'} "
            "at {at:m1} (limit {limit}).",
            error=error,
            at=estimate.ranges[worst],
            limit=percent(estimate.across_limit),
        )
    yield from _footprint(estimate)


def _footprint(estimate: NoiseEstimate) -> Iterator[Finding]:
    """Whether the scans contradict the footprint that is stated."""
    across, beam = estimate.across, estimate.beam
    if across is None or beam is None:
        return
    at = estimate.fitted.typical_range
    said = "A quarter of the footprint of {by} is {spot:mm2} at {at:m1}, "
    test = "(chi-square {test.chi2:1}, limit {test.limit:1})."
    if across.contradicted:
        said += f"where {{seen:mm2}} are seen across the beam: the scans contradict it {test}"
        if "beam_exit_mm" not in estimate.instrument:
            said += " It stays in an instrument file, as they do not tell what to put in its place;"
            said += " scans with surfaces seen straight and slantwise would."
    else:
        said += f"which the scans do not contradict {test}"
    yield Finding.of(
        "footprint",
        said,
        across.contradicted,
        by=estimate.stated_by,
        spot=float(beam.diameter(np.array([at]))[0]) / 4,
        at=at,
        seen=estimate.fitted.across * at,
        test=across,
    )


def _carried(estimate: NoiseEstimate) -> Iterator[Finding]:
    """Figures of an instrument file that are as stated, or missing."""
    carried, across, taken = estimate.carried(), estimate.across, estimate.taken
    if across is None:
        if "scan_angle_arcsec" not in estimate.instrument:
            yield Finding(
                "Angles and footprint are left out of an instrument file: clouds have no sigmas "
                "before scan_angle_arcsec, beam_exit_mm and beam_divergence_mrad stand beside it "
                "in the section of the instrument. --sheet or --project takes them from a data "
                "sheet or a project.",
                True,
                "left_out",
            )
        return
    if not carried:
        return
    said = "An instrument file has {known} as {by} states them"
    beside_footprint = "scan_angle_arcsec" not in carried and "beam_exit_mm" in carried
    if across.fitted is not None and across.angle_known and beside_footprint:
        said += ", and beside this footprint {held.angle[0]:″1} (sigma {held.angle[1]:″1~}) of "
        said += "noise of the angles"
    if across.fitted is not None and taken.law is None:
        said += "; beside these, ranges have {taken.range:mm2} + {taken.range_scale:ppm0}"
    known = dict.fromkeys(_CARRIED[key] for key in carried if key in _CARRIED)
    yield Finding.of(
        "carried",
        f"{said}.",
        known=" and ".join(known),
        by=estimate.stated_by,
        held=across.fitted,
        taken=taken,
    )


def _left(estimate: NoiseEstimate) -> Iterator[Finding]:
    """What range, incidence and neighbours still do, and what was stated."""
    law = "the law" if estimate.law is None else "the intensity"
    yield _lasting("by_range", estimate.by_range, law, "range", "at twice the range")
    where = "at 60° rather than straight on"
    yield _lasting("by_incidence", estimate.by_incidence, law, "incidence", where)
    shared, filtered = estimate.neighbours, estimate.filtered
    if shared is not None:
        said = shared.sentence()
        yield Finding(capital(said) + ".", key="neighbours")
        if filtered is not None:
            yield Finding.of(
                "filtered",
                "Errors are shared over {mrad:g2} mrad, {times:0} times the width of a beam: the "
                "scanner or a program has averaged or smoothed the ranges, or the surfaces have "
                "texture. Single beams have more noise than is seen, and planes take up a part: "
                "the points have {factor:2} times the sigmas of the law.",
                True,
                mrad=1e3 * filtered[0],
                times=filtered[1],
                factor=max(shared.lost, 1.0) ** 0.5,
            )
    if estimate.stated is not None:
        factor = _against_stated(estimate)
        verdict: str = Sentence("as stated within {share:%}", share=_APART - 1)
        if factor > _APART:
            verdict = "more than stated"
            verdict += ", for which surfaces may be the reason" if estimate.doubts else ""
        elif factor < 1 / _APART:
            verdict = "less than stated"
        apart = not 1 / _APART <= factor <= _APART
        said = "{ratio}: {verdict}."
        yield Finding.of("beside_stated", said, apart, ratio=_ratio(estimate), verdict=verdict)


def _ratio(estimate: NoiseEstimate) -> Sentence:
    """Noise seen over noise stated, without a stop."""
    said = "Noise seen is {factor:2} times that of {by}"
    return Sentence(said, factor=_against_stated(estimate), by=estimate.stated_by)


def _lasting(key: str, effect: LastingEffect, law: str, cause: str, where: str) -> Finding:
    """Whether a cause matters after the law."""
    matters = abs(effect.t) > _T and abs(effect.change) > _CHANGE
    said = "Whether the {cause} matters beyond {law} is not told"
    if matters:
        said = "Beyond {law}, the {cause} still matters"
    elif abs(effect.change) + 2 * effect.sigma < _LITTLE:
        said = "Beyond {law}, the {cause} hardly matters"
    said += ": sigma changes by {e.change:%1~} ± {e.sigma:%1} (one sigma) {where}."
    return Finding.of(key, said, matters, law=law, cause=cause, e=effect, where=where)


def _rests(estimate: NoiseEstimate) -> Iterator[Finding]:
    """What these figures rest on, and what they are not."""
    fitted, step = estimate.fitted, estimate.step
    said = "{by.patches} of {by.observed.patches} planar patches are smooth and of one material, "
    if noisier := fitted.noisier:
        said += "{aside} have more noise, half of them more than {noisier:1} times the sigma of "
        said += "this law: they are rough, bent or patterned, or noise depends on the intensity, "
        said += "which these scans do not tell. The law is that of the smoothest surfaces."
    else:
        said += "{aside} were set aside as rough, bent or patterned. Roughness that the smooth "
        said += "ones have is in the figures: planes do not tell it from noise."
    aside = fitted.observed.patches - fitted.patches
    yield Finding.of("patches", said, noisier > 0, by=fitted, aside=aside, noisier=noisier)
    if step:
        least = fitted.range if fitted.law is None else fitted.law.limits[0]
        unseen = least < _UNSEEN * step
        said = "Coordinates are stored in steps of {step:mmg}, whose rounding of {rounding:mm2} is "
        said += "taken off" + ("; noise below {below:mmg} cannot be seen in them" * unseen) + "."
        yield Finding.of(
            "step", said, unseen, step=step, below=_UNSEEN * step, rounding=step / 12**0.5
        )
    if estimate.doubts:
        said = "This is an upper bound and not the noise of the scanner: {doubts}."
        yield Finding.of("upper_bound", said, True, doubts=joined("; ", estimate.doubts))
    for scan in estimate.scans:
        if scan.remark:
            yield Finding.of("nothing", "{s.source} told nothing: {s.remark}.", True, s=scan)


def _front(estimate: NoiseEstimate) -> FrontPage:
    """Whether these are figures of the scanner, and how they are beside what is stated."""
    if estimate.doubts:
        said = "Surfaces or shared errors are in these figures, see below."
        return FrontPage("none", "An upper bound", said, signed=_SIGNED)
    for one in _contradicted(estimate):
        return FrontPage("bad", "No law of the noise", one.words, signed=_SIGNED)
    if estimate.fitted.noisier:
        said = "Many surfaces have more noise than this law says, see below."
        return FrontPage("none", "Noise of the smoothest surfaces", said, signed=_SIGNED)
    if estimate.stated is None:
        patches = counted(estimate.patches, "smooth planar patch", "smooth planar patches")
        said = Sentence(
            "{patches} with {estimate.points:,} points; no data sheet or project is given to ",
            patches=patches,
            estimate=estimate,
        )
        said += "compare them with."
        return FrontPage("none", "Noise of the scanner by its scans", said, signed=_SIGNED)
    factor, said = _against_stated(estimate), f"{_ratio(estimate)}."
    if factor > _APART:
        return FrontPage("bad", "More noise than stated", said, signed=_SIGNED)
    verdict = "As precise as stated" if factor >= 1 / _APART else "Less noise than stated"
    return FrontPage("good", verdict, said, signed=_SIGNED)


def _against_stated(estimate: NoiseEstimate) -> float:
    """Noise seen over noise stated."""
    smooth = estimate.fitted.smooth
    assert estimate.stated is not None
    stated = smooth.stated(estimate.stated)
    return float(np.sqrt((smooth.residual**2 / stated).sum() / smooth.redundancy.sum()))


def _picture(estimate: NoiseEstimate) -> Picture:
    """Sigma of each patch against intensity or range, and the law."""
    fitted = estimate.fitted
    observed, law = fitted.observed, fitted.law
    x = observed.mean(observed.range if law is None else observed.intensity)
    # what angles, footprint and rounding add by the law is taken off
    light = None if law is None else observed.intensity
    along = fitted.noise().range_sigma(observed.range, observed.cosine, light) ** 2
    others = observed.mean(observed.stated(fitted.noise()) - along)
    straight = 1.0 if law is not None else observed.mean(observed.cosine**fitted.incidence)
    left = observed.variances - others
    sigma = 1e3 * np.sqrt(np.where(left > 0, left, np.nan)) * straight
    kept = fitted.kept
    if law is not None:
        grid = np.geomspace(law.low, law.high, 200)
        curve, what = law.sigma(grid), "law of the range's noise"
    else:
        grid = np.linspace(x[kept].min(), x[kept].max(), 200)
        curve, what = fitted.range + fitted.range_scale * grid, "law, seen straight"
    shown = np.isfinite(sigma) & (sigma > 0) & ((law is None) | (x > 0))
    every = np.concatenate([sigma[shown], 1e3 * curve])
    along_x = np.concatenate([x[shown], grid])
    chart = Chart(
        (float(along_x.min()), float(along_x.max())),
        (float(every.min()) / 1.1, float(every.max()) * 1.1),
        (
            "range [m]" if law is None else "intensity, in the unit of the files",
            "sigma of the range [mm]",
        ),
        HALF,
        log="y" if law is None else "xy",
    )
    entries = [("s0", "smooth patches"), ("s1", what)]
    if (~kept & shown).any():
        chart.dots(x[~kept & shown], sigma[~kept & shown], "s6")
        entries.append(("s6", "set aside"))
    chart.dots(x[kept & shown], sigma[kept & shown], "s0")
    chart.line(grid, 1e3 * curve, "s1")
    caption = (
        "A dot is a patch, less what the noise of angles, the footprint and rounding add to it. "
        "Slanted patches, where these add most, scatter most."
    )
    title = "Noise of patches and the law"
    return Picture("noise", title, beside([[chart]], title, legend(entries, HALF[0])), caption)


def _classes(rows: list[NoiseRow]) -> ReportTable:
    """Noise seen, by the laws and stated, class by class."""
    columns = [
        column("By", "by"),
        column("Class", _limits),
        column("patches", "patches", "0"),
        column("points", "points", "0"),
        column("seen", "observed", "mm2"),
        column("by the law", "fitted", "mm2"),
        column("chi²/dof", "chi2_dof", "2"),
        column("stated", "stated", "mm2"),
    ]
    note = (
        "Standard deviations along the beam of points on smooth planar patches, with the noise of "
        "angles over the slope of the surface. Chi² over its degrees of freedom compares them with "
        "the laws found here; it is 1 where these hold."
    )
    return build_table("classes", "Noise by class", note, rows, columns)


def _figures(estimate: NoiseEstimate) -> ReportTable:
    """Keys of the instrument file."""
    columns = [column("Key", itemgetter(0)), column("Value", itemgetter(1), "g5")]
    note = "As an instrument file has them; the law's own noise is in the findings."
    rows: list[Any] = []
    for key, value in estimate.instrument.items():
        several = value if isinstance(value, tuple) else (value,)
        rows += [(f"{key}[{k}]" if len(several) > 1 else key, v) for k, v in enumerate(several)]
    return build_table("figures", "Figures for an instrument", note, rows, columns)


def _scans(estimate: NoiseEstimate) -> ReportTable:
    """What each scan gave."""
    counts = ("windows", "curved", "uneven", "patches", "points")
    columns = [column("Scan", "source"), *(column(name, name, "0") for name in counts)]
    columns.append(column("Remark", "remark"))
    return build_table("scans", "Scans", "", estimate.scans, columns)
