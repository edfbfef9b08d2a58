"""Warns of standard deviations that no instrument and no control has, most often a wrong unit.

A sigma of 0.0003 arc seconds is one of 1 arc second written in degrees; one of 100 degrees is no
measurement. Both adjust without complaint: the first outweighs everything else, the second is as
good as left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.network.network import Network
from tribrach.observations.base import Observations, Use
from tribrach.observations.declaration import Category, Role
from tribrach.observations.poses import RelativePoses
from tribrach.observations.sights import Azimuths
from tribrach.sentences import Sentence
from tribrach.units import DEG, SEC


@dataclass(frozen=True)
class _Range:
    """What standard deviations of a sort may be [m, rad], and why not less or more."""

    least: float
    most: float
    too_small: str
    too_large: str


#: of angles: the best theodolites read 0.15 arc seconds, the mean of a hundred sets a tenth of it
_ANGLES = _Range(
    0.01 * SEC,
    np.radians(5),
    "which no instrument reaches",
    "which is no measurement",
)
#: of lengths: interferometers reach a micrometre
_LENGTHS = _Range(1e-6, 1.0, "which no instrument reaches", "which is no survey measurement")
#: of GNSS, code solutions included
_GNSS = _Range(1e-6, 100.0, "which no receiver reaches", "which is no survey measurement")
#: of given coordinates, however loosely they are to be held
_CONTROL = _Range(5e-6, np.inf, "which no coordinates have", "")


#: what to do
_CHECK = "check its unit, there or with the instrument"


def implausible_sigmas(network: Network) -> list[str]:
    """A sentence for each kind of observation that has standard deviations beyond reason."""
    out: list[str] = []
    for o in network.observations:
        taking_part = o.use != Use.OFF
        for unit in ("rad", "m"):
            limits = _limits(o, unit)
            rows = [k for k, u in enumerate(o.units) if u == unit]
            if limits is None or not rows:
                continue
            sigma = o.sigma[:, rows]
            small = (sigma.min(axis=1) < limits.least) & taking_part
            large = (sigma.max(axis=1) > limits.most) & taking_part
            if small.any() and not isinstance(o, Azimuths):
                words = _told(network, o, small, sigma.min(axis=1), unit)
                out.append(
                    Sentence(
                        "{words}, {limits.too_small}: {check}; what holds exactly is better held",
                        words=words,
                        limits=limits,
                        check=_CHECK,
                    )
                )
            # a pose from clouds may leave directions open, and then says so with its sigmas
            if large.any() and not isinstance(o, RelativePoses):
                words = _told(network, o, large, sigma.max(axis=1), unit)
                out.append(
                    Sentence(
                        "{words}, {limits.too_large}: {check}; what is to count for nothing is "
                        "better left out",
                        words=words,
                        limits=limits,
                        check=_CHECK,
                    )
                )
    return out


def held_azimuths(network: Network) -> list[str]:
    """A sentence on azimuths whose sigma is so small that they are meant to be exact.

    A network is often turned into its frame by one azimuth with such a sigma. It is no mistake,
    and not that of an instrument either.
    """
    out: list[str] = []
    for o in network.observations:
        small = (o.sigma.min(axis=1) < _ANGLES.least) & (o.use != Use.OFF)
        if isinstance(o, Azimuths) and small.any():
            words = _told(network, o, small, o.sigma.min(axis=1), "rad")
            out.append(
                Sentence(
                    "{words}: taken as held exactly, not as measured; if it was, check the unit",
                    words=words,
                )
            )
    return out


def _limits(o: Observations, unit: str) -> _Range | None:
    """What standard deviations of a kind may be; None where anything may."""
    facts = o.facts
    if facts.role == Role.GIVEN:
        return _CONTROL if unit == "m" else None
    if facts.role != Role.READING or facts.category == Category.CENTRING:
        return None
    if unit == "rad":
        return _ANGLES
    return _GNSS if facts.category == Category.GNSS or facts.absolute else _LENGTHS


def _told(network: Network, o: Observations, bad: Array, sigma: Array, unit: str) -> str:
    """The first of them with its line, how many there are, and how large its sigma is."""
    first, count = int(np.argmax(bad)), int(bad.sum())
    words = Network.describe(o, first, network.start)
    more = f" and {count - 1} more" if count > 1 else ""
    verb = "have" if count > 1 else "has"
    return Sentence(
        "{words}{more} {verb} a standard deviation of {sized}",
        words=words,
        more=more,
        verb=verb,
        sized=_sized(float(sigma[first]), unit),
    )


def _sized(sigma: float, unit: str) -> str:
    """A standard deviation in a unit that people know."""
    if unit == "rad":
        spec = "degreesg3" if sigma > DEG else "arc secondsg2"
    else:
        spec = "mg3" if sigma > 0.1 else "mmg2"
    return Sentence(f"{{sigma:{spec}}}", sigma=sigma)
