"""Clouds that are shown besides those of a run: distances of a comparison, a design."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tribrach.errors import InputError


def cloud_stem(path: Path) -> str:
    """The name of a cloud without the endings of its format."""
    return path.name.removesuffix(path.suffix).removesuffix(".copc")


def further_names(paths: Sequence[Path]) -> list[str]:
    """Names of clouds that are given besides those of a run."""
    names: list[str] = []
    for path in paths:
        if not path.is_file():
            raise InputError(
                "there is no such cloud", file=path, cure="name a file, such as moved.laz"
            )
        same = [
            f"+{cloud_stem(path)}",
            *(f"+{cloud_stem(path)} {k}" for k in range(2, len(paths) + 1)),
        ]
        names.append(next(name for name in same if name not in names))
    return names
