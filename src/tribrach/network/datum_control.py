"""Says what nothing checks in the given coordinates that carry the datum.

Two control points fix a plan and tell no more than the distance between them; one bench mark fixes
all heights and tells nothing. An error of such a coordinate shifts, turns or stretches the network
without any residual. How many combinations of given coordinates the observations know of is the
rank of their tests (method section 3.4).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tribrach._types import Mask
from tribrach.network.adjustment import Adjustment
from tribrach.network.given_coordinates import GivenCoordinates, given_coordinates
from tribrach.network.roles import given_coordinates as given_tables
from tribrach.observations.base import Use


def unchecked_control(adjustment: Adjustment) -> list[str]:
    """Sentences on given coordinates that nothing checks, in plan and in height."""
    if adjustment.dof <= 0:
        return []
    given = given_coordinates(adjustment)
    if not given.items:
        return []
    axis = np.array([g.axis for g in given.items])
    plan, height = axis < 2, axis == 2
    checks = _has_checks(adjustment)
    if given.rank(np.ones(len(axis), dtype=bool)) == 0:
        return [_unchecked(given, plan | height, "coordinates", checks)]
    out = []
    for chosen, noun in ((plan, "plan coordinates"), (height, "height")):
        points = _points(given, chosen)
        if chosen.any() and given.rank(chosen) == 0:
            out.append(_unchecked(given, chosen, noun, checks))
        elif noun.startswith("plan") and len(points) == 2 and given.rank(chosen) == 1:
            tail = _CHECKED if checks else "give a third control point, or a check point"
            out.append(
                f"only {' and '.join(points)} fix the horizontal datum: the adjustment checks the "
                "distance between them and nothing else. An error across it, or the same error of "
                f"both, turns or shifts all points and shows in no residual; {tail}"
            )
    return out


_CHECKED = "only the check points would show it: look at their differences"


def _unchecked(given: GivenCoordinates, chosen: Mask, noun: str, checks: bool) -> str:
    """The sentence on coordinates that nothing checks."""
    points = _points(given, chosen)
    listed = _listed(points)
    plural = "s" if noun == "height" and len(points) > 1 else ""
    verb = "are" if plural or noun != "height" else "is"
    tail = _CHECKED if checks else "give further control, or check points"
    return (
        f"the given {noun}{plural} of {listed} {verb} checked by nothing: an error there shifts or "
        f"turns everything unseen; {tail}"
    )


def _listed(names: Sequence[str], most: int = 6) -> str:
    """Names in a sentence."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    shown = list(names[:most])
    if more or len(shown) == 1:
        return ", ".join(shown) + more
    return ", ".join(shown[:-1]) + " and " + shown[-1]


def _points(given: GivenCoordinates, chosen: Mask) -> list[str]:
    """Names of the points of some coordinates."""
    return list(dict.fromkeys(g.point for g, c in zip(given.items, chosen, strict=True) if c))


def _has_checks(adjustment: Adjustment) -> bool:
    """True if any point is held out as a check."""
    return any((o.use == Use.CHECK).any() for o in given_tables(adjustment))
