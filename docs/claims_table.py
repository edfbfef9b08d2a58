"""Tables of ``docs/trust.md`` from the register of claims, ``docs/claims.yaml``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

REGISTER = Path(__file__).resolve().parent / "claims.yaml"


def register() -> dict[str, Any]:
    """The register of claims."""
    read: dict[str, Any] = yaml.safe_load(REGISTER.read_text(encoding="utf-8"))
    return read


def evidence_words(evidence: list[dict[str, str]]) -> str:
    """Kinds of evidence, with whose data and what is to be known; the register names the files."""
    pieces: dict[str, list[str]] = {}
    for item in evidence:
        notes = pieces.setdefault(item["kind"], [])
        notes += [item[key] for key in ("program", "table", "data", "note") if key in item]
    return "; ".join(
        kind + (f" ({', '.join(dict.fromkeys(notes))})" if notes else "")
        for kind, notes in pieces.items()
    )


def tables() -> str:
    """The meaning of the levels, and one row for each claim."""
    read = register()
    lines = ["| level | what stands behind it |", "|---|---|"]
    lines += [f"| {name} | {words} |" for name, words in read["levels"].items()]
    lines += ["", "| claim | level | evidence |", "|---|---|---|"]
    for claim in read["claims"]:
        words = evidence_words(claim["evidence"])
        lines.append(f"| **{claim['id']}**: {claim['approved']} | {claim['level']} | {words} |")
    return "\n".join(lines)
