"""The noise of a scanner by its own scans, as text and as a page with a plot."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tribrach.report.charts import HALF, Chart, beside, legend
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding
from tribrach.report.numbers import Style, count_cell, counted, fixed_cell, mm_cell
from tribrach.report.page import FrontPage, page
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    build_table,
    number_cell,
    text_cell,
)
from tribrach.units import SEC, percent

if TYPE_CHECKING:
    from tribrach.job.estimate_noise import NoiseEstimate
    from tribrach.scan.noise_law import By, LastingEffect, NoiseClass

__all__ = [
    "NoiseRow",
    "noise_findings",
    "noise_page",
    "noise_rows",
    "noise_sentences",
    "noise_text",
]

_BY: tuple[By, ...] = ("intensity", "range", "incidence")
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
#: what an instrument file takes from elsewhere, in words
_CARRIED = {
    "scan_angle_arcsec": "the noise of the angles",
    "scan_angle_accuracy_arcsec": "their accuracy",
    "beam_exit_mm": "the footprint of the beam",
    "beam_divergence_mrad": "the footprint of the beam",
}

_NOTE = (
    "Standard deviations along the beam of points on smooth planar patches, with the noise of "
    "angles over the slope of the surface. Chi² over its degrees of freedom compares them with the "
    "laws found here; it is 1 where these hold."
)


@dataclass(frozen=True)
class NoiseRow:
    """A class of points: noise seen, by the laws found, and as stated.

    Attributes
    ----------
    by
        What the class is of.
    seen
        Observed, beside the laws.
    stated
        Sigma that is stated [m], None where nothing is.
    """

    by: By
    seen: NoiseClass
    stated: float | None

    @property
    def limits(self) -> str:
        """Its limits with their unit."""
        low, high = self.seen.low, self.seen.high
        if self.by == "range":
            return f"{low:.1f} to {high:.1f} m"
        if self.by == "incidence":
            return f"{np.degrees(low):.0f} to {np.degrees(high):.0f}°"
        return f"{_light(low)} to {_light(high)}"


def _light(intensity: float) -> str:
    """An intensity of any scale."""
    return f"{intensity:.0f}" if abs(intensity) >= 1000 else f"{intensity:.3g}"


def noise_rows(estimate: NoiseEstimate) -> list[NoiseRow]:
    """All classes by intensity, range and incidence."""
    rows = []
    for by in _BY:
        if by == "intensity" and not estimate.fitted.observed.intense:
            continue
        seen = estimate.classes(by)
        stated: list[float | None] = [None] * len(seen)
        if estimate.stated is not None:
            stated = [one.stated for one in estimate.classes(by, stated=True)]
        rows += [NoiseRow(by, a, b) for a, b in zip(seen, stated, strict=True)]
    return rows


def noise_findings(estimate: NoiseEstimate) -> list[Finding]:
    """The findings in words, each with its figures, and which of them warn."""
    return [
        *(Finding(words) for words in _law(estimate)),
        *_across(estimate),
        *_left(estimate),
        *_limits(estimate),
    ]


def noise_sentences(estimate: NoiseEstimate) -> list[str]:
    """The findings in words, each with its figures."""
    return [finding.words for finding in noise_findings(estimate)]


def _law(estimate: NoiseEstimate) -> Iterable[str]:
    """Noise of the range."""
    fitted, law = estimate.fitted, estimate.fitted.law
    if law is not None:
        light = np.array([law.low, np.sqrt(law.low * law.high), law.high])
        sigma, error = 1e3 * law.sigma(light), 1e3 * fitted.law_sigma(light)
        figures = ", ".join(
            f"{s:.2f} mm (sigma {e:.2g}) at {_light(i)}"
            for s, e, i in zip(sigma, error, light, strict=True)
        )
        yield f"Noise of ranges is a law of the intensity: {law.words}; {figures}."
        yield (
            f"Intensities are as in the files, {', and '.join(estimate.units)}: the law holds for "
            "scans that were written alike, and classes show how well a power describes them."
        )
    yield (
        f"{'Without intensity' if law else 'Noise of ranges'}: {1e3 * fitted.range:.2f} mm + "
        f"{1e6 * fitted.range_scale:.0f} ppm of the range, over the cosine of the incidence."
    )
    if law is None:
        yield f"There is no law of the intensity: {fitted.why}."


def _across(estimate: NoiseEstimate) -> Iterable[Finding]:
    """Noise across the beam, what is stated of it, and what an instrument file has."""
    fitted = estimate.fitted
    if not np.isfinite(fitted.angle_sigmas).all():
        yield Finding(
            "Surfaces are not seen both straight and slantwise, so that noise of the angles cannot "
            "be told from that of the range: all of it is taken for noise of the range"
            + (" here." if estimate.across is None else ", beside what is stated across the beam.")
        )
    else:
        h, v = fitted.horizontal / SEC, fitted.vertical / SEC
        dh, dv = fitted.angle_sigmas / SEC
        yield Finding(
            f"Across the beam: {h:.1f}″ (sigma {dh:.1f}) horizontally, {v:.1f}″ ({dv:.1f}) "
            f"vertically, and {1e3 * fitted.place:.2f} mm (sigma {1e3 * fitted.place_sigma:.2f}) "
            "at any range, all with the footprint of the beam."
        )
        if not estimate.across_known:
            worst = int(np.argmax(estimate.across_errors))
            error = 100 * estimate.across_errors[worst]
            share = "more than 100 %" if error > 100 else f"{error:.0f} %"
            yield Finding(
                "These scans alone do not part the noise across the beam from that of the range: "
                f"these figures together have a sigma of {share} at {estimate.ranges[worst]:.1f} m "
                f"(limit {percent(estimate.across_limit)})."
            )
        yield from _footprint(estimate)
    yield from _carried(estimate)


def _footprint(estimate: NoiseEstimate) -> Iterable[Finding]:
    """Whether the scans contradict the footprint that is stated."""
    across, beam = estimate.across, estimate.beam
    if across is None or beam is None:
        return
    at = estimate.fitted.typical_range
    spot = float(beam.diameter(np.array([at]))[0]) / 4
    seen = estimate.fitted.across * at
    begin = f"A quarter of the footprint of {estimate.stated_by} is {1e3 * spot:.2f} mm at {at:.1f}"
    tested = f"chi-square {across.chi2:.1f}, limit {across.limit:.1f}"
    if across.contradicted:
        yield Finding(
            f"{begin} m, where {1e3 * seen:.2f} mm are seen across the beam: the scans contradict "
            f"it ({tested})."
            + (
                ""
                if "beam_exit_mm" in estimate.figures()
                else " It stays in an instrument file, as they do not tell what to put in its "
                "place; scans with surfaces seen straight and slantwise would."
            ),
            True,
        )
    else:
        yield Finding(f"{begin} m, which the scans do not contradict ({tested}).")


def _carried(estimate: NoiseEstimate) -> Iterable[Finding]:
    """What of an instrument file is as stated, or missing."""
    carried = estimate.carried()
    across = estimate.across
    if across is None:
        if "scan_angle_arcsec" not in estimate.figures():
            yield Finding(
                "Angles and footprint are left out of an instrument file: clouds have no sigmas "
                "before scan_angle_arcsec, beam_exit_mm and beam_divergence_mrad stand beside it "
                "in the section of the instrument. --sheet or --project takes them from a data "
                "sheet or a project.",
                True,
            )
        return
    if not carried:
        return
    known = [_CARRIED[key] for key in carried if key in _CARRIED]
    words = f"An instrument file has {' and '.join(dict.fromkeys(known))} as "
    words += f"{estimate.stated_by} states them"
    if across.fitted is not None and across.angle_known:
        size, sigma = across.fitted.angle
        if "scan_angle_arcsec" not in carried and "beam_exit_mm" in carried:
            words += (
                f", and beside this footprint {size / SEC:.1f}″ (sigma {sigma / SEC:.1f}) of noise "
                "of the angles"
            )
    if across.fitted is not None and estimate.taken.law is None:
        taken = estimate.taken
        words += (
            f"; beside these, ranges have {1e3 * taken.range:.2f} mm + "
            f"{1e6 * taken.range_scale:.0f} ppm"
        )
    yield Finding(words + ".")


def _left(estimate: NoiseEstimate) -> Iterable[Finding]:
    """What range, incidence and neighbours still do, and what was stated."""
    fitted = estimate.fitted
    law = "the intensity" if fitted.law is not None else "the law"
    yield _lasting(fitted.by_range, law, "range", "at twice the range")
    yield _lasting(fitted.by_incidence, law, "incidence", "at 60° rather than straight on")
    if estimate.shared is not None:
        words = estimate.shared.sentence()
        yield Finding(f"{words[0].upper()}{words[1:]}.")
        filtered = estimate.filtered
        if filtered is not None:
            angle, times = filtered
            yield Finding(
                f"Errors are shared over {1e3 * angle:.2g} mrad, {times:.0f} times the width of a "
                "beam: the scanner or a program has averaged or smoothed the ranges, or the "
                "surfaces have texture. Single beams have more noise than is seen, and planes take "
                f"up a part: the points have {max(estimate.shared.lost, 1.0) ** 0.5:.2f} times the "
                "sigmas of the law.",
                True,
            )
    if estimate.stated is not None:
        yield _beside_stated(estimate)


def _beside_stated(estimate: NoiseEstimate) -> Finding:
    """Noise seen beside what is stated."""
    factor = _against_stated(estimate)
    verdict = (
        "more than stated"
        if factor > _APART
        else "less than stated"
        if factor < 1 / _APART
        else f"as stated within {percent(_APART - 1)}"
    )
    if factor > _APART and estimate.doubts:
        verdict += ", for which surfaces may be the reason"
    apart = not 1 / _APART <= factor <= _APART
    return Finding(f"{_ratio(estimate)}: {verdict}.", apart)


def _ratio(estimate: NoiseEstimate) -> str:
    """Noise seen over noise stated, without a stop."""
    return f"Noise seen is {_against_stated(estimate):.2f} times that of {estimate.stated_by}"


def _lasting(effect: LastingEffect, law: str, cause: str, where: str) -> Finding:
    """Whether a cause matters after the law."""
    change, sigma = (Style.plain(100 * value, 1) for value in (effect.change, effect.sigma))
    figures = f"sigma changes by {change} ± {sigma} % (one sigma) {where}"
    if abs(effect.t) > _T and abs(effect.change) > _CHANGE:
        return Finding(f"Beyond {law}, the {cause} still matters: {figures}.", True)
    if abs(effect.change) + 2 * effect.sigma < _LITTLE:
        return Finding(f"Beyond {law}, the {cause} hardly matters: {figures}.")
    return Finding(f"Whether the {cause} matters beyond {law} is not told: {figures}.")


def _limits(estimate: NoiseEstimate) -> Iterable[Finding]:
    """What these figures rest on, and what they are not."""
    fitted, step = estimate.fitted, estimate.step
    aside = fitted.observed.patches - fitted.patches
    yield Finding(
        f"{fitted.patches} of {fitted.observed.patches} planar patches are smooth and of one "
        f"material, {aside} were set aside as rough, bent or patterned. Roughness that the smooth "
        "ones have is in the figures: planes do not tell it from noise."
    )
    if step:
        rounding = step / 12**0.5
        words = (
            f"Coordinates are stored in steps of {1e3 * step:g} mm, whose rounding of "
            f"{1e3 * rounding:.2f} mm is taken off"
        )
        least = fitted.range if fitted.law is None else fitted.law.limits[0]
        unseen = least < _UNSEEN * step
        if unseen:
            words += f"; noise below {1e3 * _UNSEEN * step:g} mm cannot be seen in them"
        yield Finding(words + ".", unseen)
    doubts = estimate.doubts
    if doubts:
        yield Finding(
            "This is an upper bound and not the noise of the scanner: " + "; ".join(doubts) + ".",
            True,
        )
    for scan in estimate.scans:
        if scan.remark:
            yield Finding(f"{scan.source} told nothing: {scan.remark}.", True)


def noise_text(estimate: NoiseEstimate) -> str:
    """What a terminal shows: the scans, one line for each class, the findings, "!" if they warn."""
    lines = [
        f"{scan.source}: {scan.patches} planar patches with {scan.points} points"
        for scan in estimate.scans
    ]
    for row in noise_rows(estimate):
        seen = row.seen
        stated = "" if row.stated is None else f", stated {1e3 * row.stated:.2f} mm"
        lines.append(
            f"  {row.by} {row.limits}: {seen.patches} patches, {1e3 * seen.observed:.2f} mm seen, "
            f"{1e3 * seen.stated:.2f} mm by the law (chi²/dof {seen.chi2_dof:.2f}){stated}"
        )
    lines += [one.line() for one in noise_findings(estimate)]
    return "\n".join(lines)


def noise_page(estimate: NoiseEstimate) -> str:
    """The whole of it as one HTML file."""
    title = ", ".join(scan.source for scan in estimate.scans[:6])
    front = _front(estimate)
    # a verdict on what is stated says it with its figure
    said = [] if front.sort == "none" else [_beside_stated(estimate)]
    return page(
        "Noise of a scanner by its scans",
        title + (" and more" if len(estimate.scans) > 6 else ""),
        front,
        [one for one in noise_findings(estimate) if one not in said],
        [_picture(estimate)],
        [_classes(estimate), _figures(estimate), _scans(estimate)],
        "Patches are fitted by planes; what they lose of the degrees of freedom is counted.",
    )


def _front(estimate: NoiseEstimate) -> FrontPage:
    """Whether these are figures of the scanner, and how they are beside what is stated."""
    if estimate.doubts:
        return FrontPage(
            "none",
            "An upper bound",
            "Surfaces or shared errors are in these figures, see below.",
            signed=_SIGNED,
        )
    if estimate.stated is None:
        fitted = estimate.fitted
        rests = (
            f"{counted(fitted.patches, 'smooth planar patch', 'smooth planar patches')} with "
            f"{fitted.points:,} points; no data sheet or project is given to compare them with."
        )
        return FrontPage("none", "Noise of the scanner by its scans", rests, signed=_SIGNED)
    factor, sentence = _against_stated(estimate), f"{_ratio(estimate)}."
    if factor > _APART:
        return FrontPage("bad", "More noise than stated", sentence, signed=_SIGNED)
    words = "As precise as stated" if factor >= 1 / _APART else "Less noise than stated"
    return FrontPage("good", words, sentence, signed=_SIGNED)


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
    straight = 1.0 if law is not None else observed.mean(observed.cosine)
    left = observed.variances - others
    sigma = 1e3 * np.sqrt(np.where(left > 0, left, np.nan)) * straight
    kept = fitted.kept
    if law is not None:
        grid = np.geomspace(law.low, law.high, 200)
        curve, what = law.sigma(grid), "law of the range's noise"
    else:
        grid = np.linspace(x[kept].min(), x[kept].max(), 200)
        curve, what = fitted.range + fitted.range_scale * grid, "law, seen straight"
    shown = np.isfinite(sigma) & (sigma > 0)
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


def _classes(estimate: NoiseEstimate) -> ReportTable:
    """Noise seen, by the laws and stated, class by class."""
    columns = [
        (ColumnHead("By", numeric=False), lambda r: text_cell(r.by)),
        (ColumnHead("Class", numeric=False), lambda r: text_cell(r.limits)),
        (ColumnHead("patches"), lambda r: count_cell(r.seen.patches)),
        (ColumnHead("points"), lambda r: count_cell(r.seen.points)),
        (ColumnHead("seen", "mm"), lambda r: mm_cell(r.seen.observed)),
        (ColumnHead("by the law", "mm"), lambda r: mm_cell(r.seen.stated)),
        (ColumnHead("chi²/dof"), lambda r: fixed_cell(r.seen.chi2_dof, 2)),
        (ColumnHead("stated", "mm"), _stated),
    ]
    return build_table("classes", "Noise by class", _NOTE, noise_rows(estimate), columns)


def _stated(row: NoiseRow) -> Cell:
    return text_cell("") if row.stated is None else mm_cell(row.stated)


def _figures(estimate: NoiseEstimate) -> ReportTable:
    """Keys of the instrument file."""
    columns = [
        (ColumnHead("Key", numeric=False), lambda item: text_cell(item[0])),
        (ColumnHead("Value"), lambda item: number_cell(item[1], f"{item[1]:.5g}")),
    ]
    note = "As an instrument file has them; the law's own noise is in the findings."
    rows = list(estimate.figures().items())
    return build_table("figures", "Figures for an instrument", note, rows, columns)


def _scans(estimate: NoiseEstimate) -> ReportTable:
    """What each scan gave."""
    columns = [
        (ColumnHead("Scan", numeric=False), lambda s: text_cell(s.source)),
        (ColumnHead("windows"), lambda s: count_cell(s.windows)),
        (ColumnHead("curved"), lambda s: count_cell(s.curved)),
        (ColumnHead("uneven"), lambda s: count_cell(s.uneven)),
        (ColumnHead("patches"), lambda s: count_cell(s.patches)),
        (ColumnHead("points"), lambda s: count_cell(s.points)),
        (ColumnHead("Remark", numeric=False), lambda s: text_cell(s.remark)),
    ]
    return build_table("scans", "Scans", "", estimate.scans, columns)
