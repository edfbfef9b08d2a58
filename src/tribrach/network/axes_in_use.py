"""Which axes of the work frame does a network observe at all: plan, heights, or both?

On a flat site plan and heights part: directions, angles, azimuths and horizontal distances know
nothing of heights, levelled height differences nothing of the plan. What a whole network does not
observe takes no part in it, as in a levelling network or a trilateration. Single points that lack
an observation are another matter and refused as such.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.geodesy.site import FlatSite, Site

__all__ = ["axes_in_use", "axes_sentence", "is_given"]

#: kinds that know nothing of heights, and kinds that know nothing else
_PLAN = frozenset({"direction", "angle", "azimuth", "horizontal_distance"})
_HEIGHTS = frozenset({"height", "height_difference", "equal_height_difference"})


def axes_in_use(tables: Iterable[tuple[str, Any]], site: Site) -> NDArray[np.bool_]:
    """Axes E, N, U (3,) that observations depend on.

    tables : kinds of observations; with single coordinates of points their axes (n,), else None.
    """
    found = {_kind(kind, axis) for kind, axis in tables}
    used = np.ones(3, dtype=bool)
    if not isinstance(site, FlatSite) or not found:
        return used
    if found <= _PLAN:
        used[2] = False
    elif found <= _HEIGHTS:
        used[:2] = False
    return used


def is_given(kind: str, group: str) -> bool:
    """True for observations that are given coordinates, control or check."""
    return kind in ("coordinates", "coordinate") and group == "control"


def _kind(kind: str, axis: Any) -> str:
    """The kind; for single coordinates one that says whether they are heights."""
    if kind != "coordinate" or axis is None:
        return kind
    up = np.asarray(axis).astype(int) == 2
    return "height" if up.all() else kind if up.any() else "direction"


def axes_sentence(used: NDArray[np.bool_]) -> str | None:
    """What is left out, in a sentence; None if nothing is."""
    if used.all():
        return None
    if used[2]:
        return "Heights alone are observed: coordinates in plan take no part."
    return "Heights are not observed: the network is adjusted in plan."
