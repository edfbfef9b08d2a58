"""What was read so far, on disk after every batch, and the table of it."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from fuzz.readers import READERS
from fuzz.watch import Batch, Finding

__all__ = ["Record", "table"]


class Record:
    """Figures and findings of every reader.

    Parameters
    ----------
    folder
        Where they are kept in ``record.json``.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / "record.json"
        there = self._path.is_file()
        self._data: dict[str, dict[str, Any]] = json.loads(self._path.read_text()) if there else {}

    def of(self, name: str) -> dict[str, Any]:
        """Figures of a reader."""
        zero = {"done": 0, "read": 0, "refused": 0, "cpu": 0.0, "longest": 0.0, "most": 0.0}
        return self._data.setdefault(name, {**zero, "findings": {}})

    def done(self, name: str) -> int:
        """How many inputs were read."""
        return int(self.of(name)["done"])

    def findings(self, name: str) -> dict[str, Any]:
        """By kind and place: how many, and the first."""
        found: dict[str, Any] = self.of(name)["findings"]
        return found

    def add(self, batch: Batch) -> None:
        """Take in a batch and write everything down."""
        figures = self.of(batch.reader)
        for name in ("done", "read", "refused", "cpu"):
            figures[name] += getattr(batch, name)
        figures["longest"] = max(figures["longest"], batch.longest)
        figures["most"] = max(figures["most"], batch.most)
        for finding in batch.findings:
            entry = figures["findings"].setdefault(
                _key(finding), {"count": 0, "first": finding.number, "text": finding.text}
            )
            entry["count"] += 1
        self._path.parent.mkdir(parents=True, exist_ok=True)
        hidden = self._path.with_suffix(".new")
        hidden.write_text(json.dumps(self._data, indent=1))
        os.replace(hidden, self._path)

    def first_of_its_kind(self, finding: Finding) -> bool:
        """True if no input before it failed alike."""
        entry = self.findings(finding.reader).get(_key(finding))
        return entry is not None and entry["first"] == finding.number


def _key(finding: Finding) -> str:
    return f"{finding.kind}: {finding.place}"


def table(record: Record) -> str:
    """What was fuzzed, as a table of Markdown."""
    lines = [
        "| reader | inputs | read | refused | tracebacks | aborts | over the limits | others "
        "| longest [s] | most memory [MB] |",
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    rows = [(name, record.of(name), _kinds(record.findings(name))) for name in READERS]
    whole = {key: sum(f[key] for _, f, _ in rows) for key in ("done", "read", "refused")}
    whole |= {key: max(f[key] for _, f, _ in rows) for key in ("longest", "most")}
    kinds = {key: sum(k[key] for *_, k in rows) for key in rows[0][2]}
    for name, f, k in [*rows, ("**all**", whole, kinds)]:
        cells = [name, *(f"{f[key]:,}" for key in ("done", "read", "refused")), *k.values()]
        cells += [f"{f['longest']:.2f}", f"{f['most']:.0f}"]
        lines.append(f"| {' | '.join(str(cell) for cell in cells)} |")
    return "\n".join(lines)


def _kinds(findings: dict[str, Any]) -> dict[str, int]:
    out = dict.fromkeys(("traceback", "abort", "limits", "others"), 0)
    for key, entry in findings.items():
        kind = key.split(":")[0]
        kind = "limits" if kind in ("time", "memory") else kind
        out[kind if kind in out else "others"] += entry["count"]
    return out
