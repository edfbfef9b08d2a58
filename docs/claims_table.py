"""Writes the tables of ``docs/trust.md``: ``python docs/claims_table.py``.

They come from the register of claims, ``docs/claims.yaml``; ``tests/test_claims.py`` checks both.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

DOCS = Path(__file__).resolve().parent
REGISTER, PAGE = DOCS / "claims.yaml", DOCS / "trust.md"
#: what stands between these lines of the page is written by this program
BEGIN, END = "<!-- written by claims_table.py -->", "<!-- end of what is written -->"


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


def page(text: str) -> str:
    """The page with new tables."""
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    return f"{before}{BEGIN}\n\n{tables()}\n\n{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
