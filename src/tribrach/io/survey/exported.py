"""What all writers of survey formats share: what a format holds, and words for the rest.

A writer takes a :class:`~tribrach.network.network.Network` and gives an :class:`Exported`: the text
of its file, and a sentence for everything that the format cannot hold. Nothing is changed silently:
an observation is written such that its equation is the same, or it is named.
"""

from __future__ import annotations

import importlib
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tribrach._types import Array, Index
from tribrach.errors import UnknownName
from tribrach.geodesy.plumb import PlumbLines
from tribrach.network.network import Network
from tribrach.network.occupations import by_sight
from tribrach.observations.base import Observations, Use
from tribrach.observations.levelling import HeightDifferences

Mask = NDArray[np.bool_]
#: where a value stands: table of the network, observation in it, row of the observation
Place = tuple[int, int, int]

#: format -> module of its writer in :mod:`tribrach.io.survey`
WRITERS = {
    "gkf": "gama.writer",
    "dynaml": "dynadjust.writer",
    "jsonl": "dynadjust.jsonl",
    "starnet": "starnet.writer",
}


@dataclass(frozen=True)
class Exported:
    """A network in the words of another program."""

    text: str  #: of the file
    written: int  #: observations in it
    #: A sentence for each kind of thing that takes part in the network and that the format cannot
    #: hold, with counts
    lost: tuple[str, ...] = ()
    #: sentences on what takes no part in the network either, and on what reads differently there
    notes: tuple[str, ...] = ()
    #: texts of files that belong to it by suffix, with ``{name}`` where they name the file
    beside: Mapping[str, str] = field(default_factory=dict)

    def files(self, path: Path) -> dict[Path, str]:
        """Texts by path."""
        more = {path.with_suffix(s): t.replace("{name}", path.name) for s, t in self.beside.items()}
        return {path: self.text, **more}


class _Writer(Protocol):
    """A module that writes a format."""

    def write(self, network: Network) -> Exported:
        """The network as a file."""
        ...


def export(network: Network, format: str) -> Exported:
    """A network in another program's format."""
    if format not in WRITERS:
        raise UnknownName("format", format, WRITERS)
    module = importlib.import_module(f"tribrach.io.survey.{WRITERS[format]}")
    return cast(_Writer, module).write(by_sight(network))


def packed_seconds(angle: float, decimals: int) -> tuple[int, int, str]:
    """An angle [rad] from zero on as degrees, minutes, and the digits of the seconds.

    ``angle``: the angle [rad], not negative; ``decimals``: digits of the seconds behind two before
    the point, which is left out.
    """
    unit = 10**decimals
    minutes, seconds = divmod(round(float(np.degrees(angle)) * 3600 * unit), 60 * unit)
    degrees, minutes = divmod(minutes, 60)
    return degrees, minutes, f"{seconds:0{decimals + 2}d}"


@dataclass
class Sieve:
    """Sorts the observations of a network into those that a format holds and the others."""

    network: Network  #: whose observations they are
    #: how many of which kind for which reason
    lost: Counter[tuple[str, str]] = field(default_factory=Counter)
    idle: int = 0  #: how many are off or checks

    def rows(self, o: Observations, held: Collection[str] = ()) -> Index:
        """Active observations (k,) of a table between points, with nothing beyond their kind."""
        active = o.use == Use.ACTIVE
        self.idle += int((~active).sum())
        keep = active.copy()
        for mask, why in self._further(o, held):
            keep = self.drop(o, keep, mask, why)
        return np.flatnonzero(keep)

    def drop(self, o: Observations, keep: Mask, bad: Mask, why: str) -> Mask:
        """``keep`` (n,) without what is bad (n,), which is counted with the reason."""
        self.lost[o.facts.title, why] += int((keep & bad).sum())
        return keep & ~bad

    def refuse(self, o: Observations, count: int, why: str) -> None:
        """Count observations that are not written, with the reason."""
        self.lost[o.facts.title, why] += count

    def refuse_all(self, o: Observations, why: str) -> None:
        """Count the active observations of a table that are not written."""
        self.idle += int((o.use != Use.ACTIVE).sum())
        self.refuse(o, int((o.use == Use.ACTIVE).sum()), why)

    def _further(self, o: Observations, held: Collection[str]) -> Iterator[tuple[Mask, str]]:
        """What observations refer to and carry beyond the fields that are held."""
        points = self.network.start.layout.count("point")
        for reference in o.references():
            index = np.asarray(getattr(o, reference.name)).reshape(len(o), -1)
            refers = np.asarray((index >= 0).any(axis=1))
            if reference.family == "position":
                outside = np.asarray((index >= points).any(axis=1))
                yield outside, "at a scanner station"
            elif reference.family in ("pose", "plane"):
                yield refers, "at a scanner station"
            elif reference.name not in held:
                means = reference.means or reference.name.replace("_", " ")
                yield refers, f"with an unknown {means}"
        for item in fields(o):
            if "per_item" in item.metadata and item.name not in held:
                value = np.asarray(getattr(o, item.name))
                word = item.name.replace("_", " ")
                usual = item.metadata["per_item"]
                alike = np.isnan(value) if np.isnan(usual) else value == usual
                yield ~alike, f"with {word}"
        plumb = getattr(o, "plumb", None)
        if isinstance(plumb, PlumbLines):
            leans = plumb.levels if isinstance(o, HeightDifferences) else not plumb.normal
            yield np.full(len(o), leans), "reduced by deflections of the vertical or a geoid"

    def sentences(self) -> tuple[str, ...]:
        """Losses of the export, the most frequent first."""
        return tuple(
            f"{title} ({count}): {why}" for (title, why), count in self.lost.most_common() if count
        )

    def notes(self) -> tuple[str, ...]:
        """What takes no part in the network."""
        if not self.idle:
            return ()
        what = "observation that is" if self.idle == 1 else "observations that are"
        return (f"{self.idle} {what} off or a check: not written",)


class ValueCovariances:
    """Covariances between values of a network, whichever tables they are in."""

    def __init__(self, network: Network) -> None:
        self.network = network
        #: joint covariance of a value, and its row there
        self._joint: dict[Place, tuple[int, int]] = {}
        self._group: dict[Place, tuple[int, int]] = {}
        for k, joint in enumerate(network.joint):
            columns = (joint.table.tolist(), joint.item.tolist(), joint.row.tolist())
            places: list[Place] = list(zip(*columns, strict=True))
            self._joint.update({place: (k, i) for i, place in enumerate(places)})
            # only what is not zero ties values together
            _, label = connected_components(coo_array(joint.covariance), directed=False)
            observations: dict[int, set[tuple[int, int]]] = {}
            for place, part in zip(places, label.tolist(), strict=True):
                observations.setdefault(part, set()).add(place[:2])
            for place, part in zip(places, label.tolist(), strict=True):
                if len(observations[part]) > 1:
                    self._group[place] = (k, part)

    def group(self, place: Place) -> tuple[int, int] | None:
        """What a value is correlated with beyond its own observation; None if with nothing."""
        return self._group.get(place)

    def matrix(self, places: Sequence[Place]) -> Array:
        """Covariance (k, k) [m, rad] of values of the network."""
        out = np.zeros((len(places), len(places)))
        owners: dict[Any, list[int]] = {}
        for i, place in enumerate(places):
            found = self._joint.get(place)
            owners.setdefault(place[:2] if found is None else found[0], []).append(i)
        for owner, rows in owners.items():
            if isinstance(owner, tuple):
                table, item = owner
                inner = [places[i][2] for i in rows]
                block = self.network.observations[table].covariance[item][np.ix_(inner, inner)]
            else:
                inner = [self._joint[places[i]][1] for i in rows]
                block = self.network.joint[owner].covariance[np.ix_(inner, inner)]
            out[np.ix_(rows, rows)] = block
        return out
