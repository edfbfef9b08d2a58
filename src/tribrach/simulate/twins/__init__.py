"""Twins of published surveys and of one that is made up, one module each."""

from __future__ import annotations

from collections.abc import Callable

from tribrach.errors import InputError
from tribrach.simulate.twin import Twin
from tribrach.simulate.twins import (
    hanoi_facade,
    konya_building,
    newcastle_lab,
    retaining_wall,
    sphere_courtyard,
)

#: builders by name: points per station, seed -> twin
TWINS: dict[str, Callable[[int, int], Twin]] = {
    "hanoi-facade": hanoi_facade.build,
    "sphere-courtyard": sphere_courtyard.build,
    "newcastle-lab": newcastle_lab.build,
    "newcastle-lab-ceiling": newcastle_lab.with_ceiling,
    "konya-building": konya_building.build,
    "retaining-wall": retaining_wall.build,
}


def build(name: str, points: int = 1_000_000, seed: int = 1) -> Twin:
    """A twin by its name."""
    if name not in TWINS:
        raise InputError(f"there is no twin {name!r}", cure=f"choose from {', '.join(TWINS)}")
    return TWINS[name](points, seed)
