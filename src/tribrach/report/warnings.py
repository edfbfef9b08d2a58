"""What should the reader know before any number? Sentences on top of every report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from tribrach.network.adjustment import Adjustment
from tribrach.network.quality import Quality
from tribrach.network.reactions import constraint_reactions
from tribrach.report.content import Control, Observation

__all__ = ["warnings"]

#: kinds of given coordinates, which are judged as control and not as observations
GIVEN = ("coordinates", "coordinate", "height")
#: redundancy numbers below this are worth a sentence
POOR = 0.1


def warnings(
    adjustment: Adjustment,
    quality: Quality,
    control: Sequence[Control],
    observations: Sequence[Observation],
    further: Iterable[str] = (),
) -> tuple[str, ...]:
    """Sentences: those of the adjustment first, then what its quality gives reason for."""
    sentences = [*adjustment.warnings, *further]
    if quality.global_test.passed is not True:
        sentences.append(quality.global_test.sentence())
    sentences += _suspects(observations, quality)
    sentences += constraint_reactions(adjustment).sentences()
    sentences += _checks(control)
    sentences += _uncontrolled(quality)
    sentences += _off(observations)
    return tuple(dict.fromkeys(_sentence(text) for text in sentences))


def _sentence(text: str) -> str:
    """A sentence with a full stop, and a capital unless it begins with the name of a file."""
    text = text.strip()
    first = text.split(":")[0].split(" ")[0]
    begin = text[:1] if "." in first.rstrip(".") else text[:1].upper()
    return begin + text[1:] + "." * (not text.endswith((".", "!", "?")))


def _words(o: Observation) -> str:
    """An observation in words."""
    arrow = f"{o.start} -> {o.end}" if o.end else o.start
    return f"{o.kind.replace('_', ' ')} {arrow}" + (f" ({o.source})" if o.source else "")


def _suspects(observations: Sequence[Observation], quality: Quality) -> list[str]:
    """The suspicious observations, those held out apart, the worst by name."""
    out = []
    for state, words in (
        ("active", "suspicious observations take part"),
        ("check", "observations held out as checks do not agree"),
    ):
        names = dict.fromkeys(
            _words(o)
            for o in sorted(observations, key=lambda o: -abs(o.w or 0.0))
            if o.suspicious and o.state == state and o.kind not in GIVEN
        )
        if names:
            more = f"; and {len(names) - 3} more" if len(names) > 3 else ""
            first = "; ".join(list(names)[:3])
            out.append(f"{words}: {first}{more}")
            chance = quality.alpha0 * len(quality.w)
            if state == "active" and chance >= 1:
                out[-1] += f" (chance alone makes about {chance:.0f} values look so)"
    return out


def _checks(control: Sequence[Control]) -> list[str]:
    """Check points and control that do not agree with the network."""
    out = []
    for use, noun in (("check", "check point"), ("weighted", "control point")):
        bad = [c.name for c in control if c.use == use and c.verdict and not c.verdict.agrees]
        if bad:
            plural = "s" if len(bad) > 1 else ""
            verb = "do" if plural else "does"
            out.append(f"{noun}{plural} {', '.join(bad[:12])} {verb} not agree with the network")
    return out


def _uncontrolled(quality: Quality) -> list[str]:
    """How many values no other value controls, or hardly."""
    none = int((~quality.controlled).sum())
    poor = int((quality.controlled & (np.nan_to_num(quality.redundancy) < POOR)).sum())
    out = []
    total = len(quality.w)
    if none:
        verb = "is" if none == 1 else "are"
        out.append(f"{none} of {total} values {verb} controlled by no other: errors stay unseen")
    if poor:
        verb = "has" if poor == 1 else "have"
        out.append(f"{poor} of {total} values {verb} a redundancy number below {POOR:g}")
    return out


def _off(observations: Sequence[Observation]) -> list[str]:
    """How many values are switched off."""
    n = sum(o.state == "off" for o in observations)
    if not n:
        return []
    if n == 1:
        return ["One observed value is switched off; it is listed with its reason"]
    return [f"{n} observed values are switched off; they are listed with their reasons"]
