"""What a surveyor must be told of a raw file: what was left out, assumed, or looks misread."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tribrach.instruments.faces import LIMIT
from tribrach.io.totalstation.records import RawFile
from tribrach.units import SEC

if TYPE_CHECKING:
    from tribrach.io.survey.totalstation import ReducedFile

__all__ = ["file_words", "hanging_words", "reduction_words"]

#: closures and residuals of sets that are worth a word, at the least
CLOSURE, RESIDUAL = 10 * SEC, 15 * SEC
#: sentences of one kind before the rest is only counted
MOST = 5


def file_words(raw: RawFile) -> list[str]:
    """Notes of the reader, records left out, sights that are not used."""
    name = raw.path.name
    words = [f"In {name}: {note}" for note in raw.notes]
    words += _some([f"At {raw.source(p.line)}: left out, {p.what}." for p in raw.problems], name)
    if raw.unknown:
        listed = ", ".join(f"{n} x {word}" for word, n in sorted(raw.unknown.items()))
        words.append(f"In {name}: not understood are {listed}.")
    shots = raw.shots
    for reason in dict.fromkeys(shots.off[shots.off != ""].tolist()):
        words.append(f"In {name}: {int((shots.off == reason).sum())} sights are off: {reason}.")
    own = int(
        sum(raw.setups.station[s] == t for s, t in zip(shots.setup, shots.target, strict=True))
    )
    if own:
        words.append(f"In {name}: {own} sights go to the point that they come from; they are off.")
    if not shots.applied.all():
        bare = ~shots.applied & np.isnan(shots.ppm) & np.isnan(shots.pressure_hpa)
        if bare.any():
            words.append(
                f"In {name}: {int(bare.sum())} raw distances have no atmospheric correction."
            )
    return words


def reduction_words(reduced: ReducedFile) -> list[str]:
    """Faces that are far apart, horizons that do not close, sets that disagree, lone faces."""
    words = _some(_faces(reduced), reduced.raw.path.name)
    words += _some(_closures(reduced), reduced.raw.path.name)
    words += _some(_residuals(reduced), reduced.raw.path.name)
    cells, axes = reduced.reduction.cells, reduced.reduction.axes
    single = np.isfinite(cells.zenith) & np.isnan(cells.half_zenith)
    significant = abs(axes.index) > 3 * axes.sigma_index
    if axes.pairs and single.any() and significant:
        words.append(
            f"In {reduced.raw.path.name}: {int(single.sum())} sights were read in one face and "
            f'keep the index error of the day, {axes.index / SEC:+.1f}".'
        )
    return words


def hanging_words(names: list[str]) -> str:
    """Points that cannot be placed."""
    listed = ", ".join(names[:MOST]) + (", ..." if len(names) > MOST else "")
    what = "point is" if len(names) == 1 else "points are"
    return (
        f"{len(names)} {what} seen by angles from one station only and left out ({listed}); "
        "coordinates or a distance would place them."
    )


def _faces(reduced: ReducedFile) -> list[str]:
    cells, axes = reduced.reduction.cells, reduced.reduction.axes
    out = []
    for what, far, half in (
        ("directions", cells.far_direction, cells.half_direction),
        ("zenith angles", cells.far_zenith, cells.half_zenith),
    ):
        usual = axes.collimation if what == "directions" else axes.index
        usual = 0.0 if np.isnan(usual) else usual
        for i in np.flatnonzero(far):
            off = (2 * (half[i] - usual)) / SEC
            out.append(
                f"At {reduced.source(int(cells.first[i]))}: the {what} of both faces from "
                f"{reduced.station[cells.setup[i]]} to {reduced.target[cells.target[i]]} differ by "
                f'{off:+.0f}" more than the others: misread, or another target.'
            )
    return out


def _closures(reduced: ReducedFile) -> list[str]:
    closures, axes = reduced.reduction.closures, reduced.reduction.axes
    scatter = 0.0 if np.isnan(axes.sigma_direction) else axes.sigma_direction
    limit = max(CLOSURE, 3 * np.sqrt(2) * scatter)
    return [
        f"In {reduced.raw.path.name}: set {closures.set[i] + 1} at "
        f"{reduced.station[closures.setup[i]]} closes on {reduced.target[closures.target[i]]} with "
        f'{closures.difference[i] / SEC:+.1f}" in face {closures.face[i]}.'
        for i in np.flatnonzero(np.abs(closures.difference) > limit)
    ]


def _residuals(reduced: ReducedFile) -> list[str]:
    """Residuals of sets that no scatter of the file explains."""
    setups = reduced.reduction.setups
    pool = [
        np.abs(s.rounds.residual[np.isfinite(s.rounds.residual)]) for s in setups if s.rounds.dof
    ]
    if not pool:
        return []
    limit = max(RESIDUAL, LIMIT * 1.4826 * float(np.median(np.concatenate(pool))))
    out = []
    for setup in setups:
        if not setup.rounds.dof:
            continue
        for s, t in np.argwhere(np.abs(setup.rounds.residual) > limit):
            out.append(
                f"In {reduced.raw.path.name}: the direction from {reduced.station[setup.setup]} to "
                f"{reduced.target[setup.targets[t]]} in set {setup.sets[s] + 1} is "
                f'{setup.rounds.residual[s, t] / SEC:+.0f}" off the mean of the sets.'
            )
    return out


def _some(words: list[str], name: str) -> list[str]:
    """The first of many sentences, and how many more there are."""
    if len(words) <= MOST:
        return words
    return [*words[:MOST], f"In {name}: {len(words) - MOST} more of this kind."]
