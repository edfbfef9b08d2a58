"""What a calibration found, in sentences and as the text of a terminal."""

from __future__ import annotations

import numpy as np

from tribrach._types import Array
from tribrach.calibration.correlations import LIMITS
from tribrach.calibration.self_calibration import SelfCalibration, remedy_sentences
from tribrach.calibration.significance import BlockTest, Omitted
from tribrach.instruments.calibration import unit_of
from tribrach.network.quality import global_test
from tribrach.units import SEC

__all__ = ["calibration_sentences", "calibration_text", "shown", "shown_unit"]


def shown_unit(unit: str) -> str:
    """Unit that people read: mm, arc seconds, parts per million."""
    return {"m": "mm", "rad": "″"}.get(unit, "ppm")


def shown(value: float, unit: str) -> str:
    """A small quantity in its shown unit."""
    scaled = value * {"m": 1e3, "rad": 1 / SEC}.get(unit, 1e6)
    return f"{scaled:.4g}" if abs(scaled) < 0.01 else f"{scaled:.3f}"


def calibration_text(found: SelfCalibration) -> str:
    """Lines for a terminal: counts, parameters, findings."""
    adjustment = found.adjustment
    lines = [
        f"{adjustment.n_observations} observed values, {adjustment.n_unknowns} unknowns, "
        f"redundancy {adjustment.dof}, sigma0 {adjustment.sigma0_posterior:.4f}",
        f"datum: {found.datum_words}; sigmas {found.sigma_origin}",
    ]
    width = max(len(p.name) for p in found.parameters)
    for p in found.parameters:
        unit = shown_unit(p.unit)
        mark = "" if p.significant else "  not significant"
        lines.append(
            f"  {p.name:<{width}} {shown(p.value, p.unit):>10} {unit:<3} "
            f"sigma {shown(p.sigma, p.unit):>8}  t {p.t:8.2f}{mark}"
        )
    return "\n".join([*lines, *(f"! {s}" for s in calibration_sentences(found))])


def calibration_sentences(found: SelfCalibration) -> list[str]:
    """Everything that is worth saying, what is most important first."""
    a = found.adjustment
    out = [f"{_upper(global_test(a).sentence())}."]
    out += [f"{_upper(words)}." for words in a.warnings]
    if found.log is not None:
        out += [f"{_upper(words)}." for words in found.log.sentences()]
    out += _estimability(found)
    out += _significance(found)
    out += _model(found)
    out += _correlated(found)
    out += _datum(found)
    return out


def _upper(words: str) -> str:
    return words[:1].upper() + words[1:]


def _estimability(found: SelfCalibration) -> list[str]:
    """What can be separated, what only just, and what would help."""
    proposal, out = found.proposal, []
    if found.left_out:
        reasons = [f"{i.name} ({i.why})" for i in proposal.left if i.name in found.left_out]
        out.append(f"Left out because they cannot be separated: {'; '.join(reasons)}.")
    elif not found.estimability.open:
        out.append(f"All {len(found.parameters)} parameters can be separated.")
    else:
        out += [f"Open: {words}." for words in found.estimability.open]
    out += [f"{item.name}: {item.why}." for item in proposal.hardly]
    out += [f"{_upper(words)}." for words in remedy_sentences(proposal, found.remedies)]
    return out


def _p(p: float) -> str:
    return "p below 1e-16" if p < 1e-16 else f"p = {p:.2g}"


def _significance(found: SelfCalibration) -> list[str]:
    """Tests of the parameters, single and together, and the set that is worth keeping."""
    out = []
    weak = [p.name for p in found.parameters if not p.significant]
    count = len(found.parameters)
    if found.datums:
        words = "no parameter is" if len(weak) == count else f"{count - len(weak)} of {count} are"
        out.append(f"{_upper(words)} significant" + (f"; not {', '.join(weak)}." if weak else "."))
        out.append(f"All parameters together against zero: {_block(found.together)}.")
    if found.gain is not None:
        out.append(f"The residuals against those without parameters: {_block(found.gain)}.")
    if found.datums and found.suggested and len(found.suggested) < count:
        out.append(f"Proposed set: {', '.join(found.suggested)}.")
    return out


def _block(test: BlockTest) -> str:
    """A test of several parameters."""
    what = f"F({test.freedom}, {test.redundancy})" if test.posterior else f"chi²({test.freedom})"
    return f"{what} = {test.statistic:.3g}, {_p(test.p)}"


def _model(found: SelfCalibration) -> list[str]:
    """Is the model complete, and one for all stations?"""
    missing = sorted((o for o in found.omitted if o.missing), key=lambda o: -abs(o.w))
    out = [_missing(o) for o in missing[:6]]
    if found.omitted and not missing:
        out.append(
            f"None of {len(found.omitted)} parameters that are no unknowns is called for by the "
            "residuals."
        )
    if missing:
        out.append(
            "The model does not describe the residuals: its form, or the meaning of its angles, "
            "may be wrong."
        )
    if found.differ is not None:
        verdict = "differ" if found.differ.p < 1e-3 else "do not differ"
        out.append(f"The parameters of the stations {verdict}: {_block(found.differ)}.")
    return out


def _missing(o: Omitted) -> str:
    unit = unit_of(o.name)
    return (
        f"The residuals call for {o.name}: {shown(o.value, unit)} {shown_unit(unit)} with sigma "
        f"{shown(o.sigma, unit)} (w = {o.w:.1f} against {o.limit:.1f})."
    )


def _correlated(found: SelfCalibration) -> list[str]:
    c = found.correlations
    counts = ", ".join(f"{c.above(limit)} above {limit:g}" for limit in LIMITS)
    out = [f"Correlations of parameters with each other and with orientations: {counts}."]
    if c.strongest_by_point.size:
        strongest = float(c.strongest_by_point.max())
        out.append(f"The strongest correlation of a parameter with a point is {strongest:.3f}.")
    return out


def _datum(found: SelfCalibration) -> list[str]:
    """What stays the same in every datum."""
    if len(found.datums) < 2:
        return []
    own, others = found.datums[0], found.datums[1:]
    ratios = np.concatenate([_ratio(d.parameters, own.parameters) for d in others])
    lengths = np.concatenate([_ratio(d.distances, own.distances) for d in others])
    names = " and ".join(d.datum for d in others)
    return [
        f"In other datums ({names}) the sigmas of the parameters are {_range(ratios)} times, those "
        f"of distances between points {_range(lengths)} times as large; those of coordinates and "
        "orientations belong to the datum."
    ]


def _ratio(a: Array, b: Array) -> Array:
    good = b > 0
    return np.asarray(a[good] / b[good])


def _range(values: Array) -> str:
    if len(values) == 0:
        return "1"
    low, high = float(values.min()), float(values.max())
    return f"{low:.6f}" if high - low < 5e-7 else f"{low:.6f} to {high:.6f}"
