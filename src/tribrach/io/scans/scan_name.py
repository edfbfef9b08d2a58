"""What a scan is called whose file does not say."""

from __future__ import annotations

from pathlib import Path

__all__ = ["scan_name"]

_PACKED = (".gz", ".xz", ".bz2")


def scan_name(path: Path, index: int = 0) -> str:
    """The file's name without its suffixes; a number behind all scans but the first."""
    name = path.name
    for packed in _PACKED:
        if name.lower().endswith(packed):
            name = name[: -len(packed)]
    name = name.rpartition(".")[0] or name
    if name.lower().endswith(".copc"):
        name = name[: -len(".copc")] or name
    return name if index == 0 else f"{name}-{index + 1}"
