"""The plain text of a RINEX file that may be packed.

Formats: Gurtner and Estey, RINEX 2.11 and 3.05; Hatanaka (2008), Bull. GSI 55.
"""

from __future__ import annotations

from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.unpacking import unpacked_bytes


def read_rinex(path: Path) -> bytes:
    """Plain RINEX text of a file that may be packed."""
    data = unpacked_bytes(path)
    if b"RINEX VERSION / TYPE" not in data[:400]:
        raise InputError(
            "this is no RINEX file: its first line does not say RINEX VERSION / TYPE",
            file=path,
            cure="give observation and navigation files in RINEX 2 or 3",
        )
    return data
