"""A baseline in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tribrach.answers import Form
from tribrach.gnss.attempts import comparison
from tribrach.gnss.baseline import Baseline
from tribrach.gnss.orbits import calendar
from tribrach.gnss.pieces import UNSEEN
from tribrach.report.answer import Answer
from tribrach.report.findings import Finding, words
from tribrach.sentences import Sentence, joined

FORM = Form("baseline", Baseline, 1)


def answer_of(baseline: Baseline) -> Answer:
    """The baseline as people read it."""
    findings = list(_findings(baseline))
    lines = joined("\n", words(findings))
    title = " to ".join(baseline.names)
    return Answer("GNSS baseline", title, None, baseline, FORM, findings=findings, terminal=[lines])


def _findings(b: Baseline) -> Iterator[Finding]:
    """Its figures, a line each."""
    yield Finding(b.headline, key="headline")
    phases = "" if b.residual is None else ", phases {b.residual:mm1} (root mean square)"
    yield Finding.of(
        "session",
        "session: {start} to {end}, {b.epochs} of {b.epochs_common} common epochs solved, "
        f"{{b.satellites:1}} satellites ({{b.systems}}){phases}",
        start=calendar(b.start),
        end=calendar(b.end),
        b=b,
    )
    if b.orbits:
        yield Finding(f"orbits: precise ones of {', '.join(b.orbits)}", key="orbits")
    if b.idle:
        yield Finding(f"systems without part: {'; '.join(b.idle)}", key="idle")
    last = "" if b.ambiguities == "fixed" else ", and the scatter of the last third"
    for key, template in (
        ("antennas", "{b.heights[0]:m4} over the base, {b.heights[1]:m4} over the rover"),
        ("baseline X, Y, Z", "{b.vector[0]:m4~} {b.vector[1]:m4~} {b.vector[2]:m4}, geocentric"),
        (
            "rover X, Y, Z",
            "{b.rover[0]:m4~} {b.rover[1]:m4~} {b.rover[2]:m4} (frame and epoch of the base "
            "coordinates)",
        ),
        (
            "sigma X, Y, Z",
            "{sigma[0]:mm1~} {sigma[1]:mm1~} {sigma[2]:mm1} of the baseline, formal times "
            f"{{b.factor:2}} ({{b.factor_source}}){last}",
        ),
    ):
        yield Finding.of(key, f"{key}: {template}", b=b, sigma=np.sqrt(np.diag(b.covariance)))
    if b.noise is not None:
        yield Finding("noise: " + b.noise.sentence(), key="noise")
    if b.pieces is not None:
        yield Finding(
            Sentence("check: {said}; {unseen}", said=b.pieces.sentence(), unseen=UNSEEN),
            key="pieces",
        )
    if b.choice:
        yield Finding(f"choice: {b.choice}", key="choice")
        yield from (Finding(f"    {line}", key="attempt") for line in comparison(b.attempts))
    yield from (Finding(f"warning: {text}", True, "warning") for text in b.warnings)
