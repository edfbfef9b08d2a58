"""Networks of DynAdjust: DNA text, DynaML or JSON lines, with or without a geoid.

Each file is known by what it holds, so that a geoid file (``.geo``) goes with either format and
stations in one with measurements in the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tribrach.errors import RefusalCollector
from tribrach.io.survey.dynadjust import dna, dynaml, jsonl
from tribrach.io.survey.dynadjust.assembly import assemble
from tribrach.io.survey.dynadjust.records import Records
from tribrach.io.xml_file import read_bytes
from tribrach.network.survey import Survey


def read(paths: Path | Sequence[Path]) -> Survey:
    """Survey of the files of one network: stations, measurements, a geoid file if there is one."""
    with RefusalCollector() as refused:
        files = [_parse(p, refused) for p in ([paths] if isinstance(paths, Path) else paths)]
        refused.settle()
        survey = assemble(files, refused)
    return survey


def _parse(path: Path, refused: RefusalCollector) -> Records:
    """Records of one file, XML or text."""
    head = read_bytes(path).removeprefix(b"\xef\xbb\xbf").lstrip()
    if path.suffix.lower() == ".xml" or head.startswith(b"<"):
        return dynaml.parse(path, refused)
    if path.suffix.lower() == ".jsonl" or head.startswith(b"{"):
        return jsonl.parse(path, refused)
    return dna.parse(path, refused)
