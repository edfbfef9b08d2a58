"""What a seal and its verification say."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tribrach.errors import InputError
from tribrach.questions.seal.sealing import FORM as SEAL
from tribrach.questions.seal.sealing import Seal
from tribrach.questions.seal.verification import FORM as VERIFICATION
from tribrach.questions.seal.verification import Verification
from tribrach.report.answer import Answer
from tribrach.report.columns import column
from tribrach.report.findings import Finding, words
from tribrach.report.numbers import counted
from tribrach.report.tables import ReportTable, Worst, build_table

_SHOWN = 40


def seal_answer(seal: Seal) -> Answer:
    """A seal as people read it."""
    findings = [
        Finding.of(
            "sealed",
            "{file}: {inputs} and {results}, {size:,} bytes.",
            file=seal.file,
            inputs=counted(len(seal.inputs), "input"),
            results=counted(len(seal.results), "result"),
            size=seal.size,
        ),
        Finding.of("digest", "SHA-256 of the lists: {digest}", digest=seal.digest),
    ]
    if seal.certificate:
        findings.append(
            Finding.of("signed", "Signed with {certificate}.", certificate=seal.certificate)
        )
    else:
        findings.append(
            Finding(
                "Not signed: the seal shows changes, but not who made it. Sign it with "
                "--certificate.",
                True,
                "unsigned",
            )
        )
    if seal.reproduced:
        findings.append(
            Finding(
                "A run of the sealed inputs alone gave these results, byte for byte.",
                key="reproduced",
            )
        )
    else:
        findings.append(
            Finding("The results were not run again before they were sealed.", True, "not_run")
        )
    if seal.by_reference:
        findings.append(
            Finding.of(
                "by_reference",
                "{scans} by reference: who verifies the seal needs {them} beside it.",
                True,
                scans=counted(len(seal.by_reference), "scan"),
                them="it" if len(seal.by_reference) == 1 else "them",
            )
        )
    return Answer(
        "Seal",
        seal.file,
        None,
        seal,
        SEAL,
        {"sentences": words(findings)},
        findings,
        terminal=findings,
    )


def verification_answer(found: Verification) -> Answer:
    """A verification as people read it; a seal that does not hold ends with an error."""
    findings = list(_findings(found))
    tables = [table for table in _tables(found) if table.rows]
    failure = None
    if not found.whole:
        failure = InputError("this seal does not hold", file=found.file)
    elif found.reproduced:
        failure = InputError("a run gives other results than the sealed ones", file=found.file)
    return Answer(
        "Verification of a seal",
        found.file,
        None,
        found,
        VERIFICATION,
        {"sentences": words(findings), "whole": found.whole, "holds": found.holds},
        findings,
        tables=tables,
        terminal=[*tables, *findings],
        failure=failure,
    )


def _findings(found: Verification) -> Iterator[Finding]:
    """Files, signature, run."""
    for what, key in (("changed", "changed"), ("missing", "missing"), ("not listed", "not_listed")):
        names = [one.name for one in found.files if one.what == what]
        if names:
            yield Finding.of(
                key,
                f"{{names}} {{verb}} {what}.",
                True,
                names=", ".join(names),
                verb="is" if len(names) == 1 else "are",
            )
    if not found.files:
        yield Finding("Every file that is here is the one that was sealed.", key="unchanged")
    yield _signature(found)
    if not found.run_again:
        yield Finding.of("not_run", "The job was not run again: {why}.", True, why=found.why_not)
    elif not found.reproduced:
        yield Finding("A run gives the same results, byte for byte.", key="reproduced")
    else:
        yield from _otherwise(found)


def _signature(found: Verification) -> Finding:
    """What the signature proves."""
    one = found.signature
    if one is None:
        return Finding("It is not signed: it does not show who made it.", True, "unsigned")
    if not one.valid:
        return Finding(
            "The signature is not of these files, or is damaged: it proves nothing.",
            True,
            "signature_invalid",
        )
    time = f", time stamp {one.time}" if one.time else ""
    if one.trusted:
        return Finding.of("signed", "Signed by {who}{time}.", who=one.signer, time=time)
    return Finding.of(
        "signer_unknown",
        "Signed by a certificate that says {who}{time}. No authority that was given with --trust "
        "vouches for it.",
        True,
        who=one.signer,
        time=time,
    )


def _otherwise(found: Verification) -> Iterator[Finding]:
    """Results that come out otherwise."""
    others = ", ".join(f"{name} {a or 'none'} then, {b or 'none'} now"
                       for name, (a, b) in found.versions.items())  # fmt: skip
    yield Finding.of(
        "differs",
        "{count} come out otherwise: {names}. {why}",
        True,
        count=counted(len(found.reproduced), "result"),
        names=", ".join(one.name for one in found.reproduced[:5]),
        why=f"Versions differ: {others}." if others else "All versions are the same.",
    )
    sigmas = [one.sigmas for one in found.figures if np.isfinite(one.sigmas)]
    if sigmas:
        yield Finding.of(
            "coordinates", "Coordinates differ by at most {most:g2} of their sigma.",
            most=max(sigmas),
        )  # fmt: skip
    verdicts = [one for one in found.figures if one.verdict]
    if verdicts:
        yield Finding.of(
            "verdicts",
            "{count} other than figures: {places}.",
            True,
            count=counted(len(verdicts), "difference"),
            places=", ".join(one.place for one in verdicts[:5]),
        )
    elif found.figures:
        yield Finding("No verdict changes.", key="same_verdicts")


def _tables(found: Verification) -> Iterator[ReportTable]:
    """Figures that differ."""
    ordered = sorted(found.figures, key=lambda one: (not one.verdict, -np.nan_to_num(one.sigmas)))
    columns = [
        column("Figure", "place"),
        column("Sealed", "sealed"),
        column("Now", "now"),
        column("of σ", "sigmas", "g2"),
    ]
    worst = Worst("those with the largest difference for its sigma")
    yield build_table(
        "figures", "Figures that differ", "", ordered, columns, most=_SHOWN, worst=worst
    )
