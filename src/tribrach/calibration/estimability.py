"""Finds the calibration parameters that a network can separate, before anything is inverted.

Parameters are taken in the order of their plain meaning (:data:`ORDER`); one whose effect is there
already, in the orientation, the points and the parameters before it, is left out and said to be
like them. Of two that are separated but only just, the second is proposed to be left out too
(method sections 3.2 and 4.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array, Index
from tribrach.answers import Result
from tribrach.calibration.extra_columns import linearise, unexplained
from tribrach.instruments.calibration import ORDER
from tribrach.network.assembly import Assembly
from tribrach.network.datum import open_motions
from tribrach.network.defects import column_length, motion_words, null_space, sentences
from tribrach.network.network import Network
from tribrach.observations.unknowns import State
from tribrach.sentences import Sentence

#: part of a column that is still there after all others are taken out; below it is nothing
_RANK = 1e-6


@dataclass(frozen=True)
class Left(Result):
    """A parameter that cannot be separated, or hardly, and why."""

    name: str
    why: str


@dataclass(frozen=True)
class EstimableSet:
    """Parameters that can be estimated."""

    names: tuple[str, ...]  #: in the order of the network
    covariance: Array  #: (k, k), their covariance a priori
    left: tuple[Left, ...]  #: parameters that cannot be separated
    hardly: tuple[Left, ...]  #: parameters that can be separated, but only just

    @property
    def sigma(self) -> Array:
        """Standard deviations (k,)."""
        sigma: Array = np.sqrt(np.diag(self.covariance))
        return sigma

    @property
    def correlation(self) -> Array:
        """Correlations (k, k)."""
        size = np.where(self.sigma > 0, self.sigma, 1.0)
        out: Array = self.covariance / np.outer(size, size)
        return out

    @property
    def recommended(self) -> tuple[str, ...]:
        """The names without what is hardly separated."""
        out = {item.name for item in self.hardly}
        return tuple(name for name in self.names if name not in out)


@dataclass(frozen=True)
class Estimability:
    """Combinations of unknowns that a network leaves open."""

    #: combinations that neither the observations nor the datum determine, one sentence each
    open: tuple[str, ...]
    #: motions of the network as a whole that inner constraints close, in words
    datum: tuple[str, ...]
    gap: tuple[float, float]  #: largest singular value taken as zero and smallest taken as not


def estimability(network: Network, state: State) -> Estimability:
    """Find the combinations of unknowns that are open at a state."""
    assembly = Assembly(network)
    design = assembly.design(state)
    constraints, _ = assembly.constraints(state)
    motions = open_motions(design, state, assembly.free_columns, constraints)
    null, gap = null_space(design, constraints, motions.basis)
    closed = network.datum.kind == "free"
    words: list[str] = []
    if null.shape[1] or (motions.basis.shape[1] and not closed):
        at_state = Assembly(network.with_start(state))
        everything = null if closed else np.hstack([null, motions.basis])
        held = motions.basis if closed else np.zeros((len(null), 0))
        words = sentences(at_state, everything, held, column_length(design))
    moves = motion_words(motions.mix) if motions.basis.shape[1] and closed else []
    return Estimability(tuple(words), tuple(moves), gap)


def parameter_columns_of(network: Network, names: Sequence[str]) -> Index:
    """Columns (k,) of the full tangent vector of scalars by name."""
    layout = network.start.layout
    index = np.array([layout.index("scalar", name) for name in names], dtype=np.int64)
    return layout.columns("scalar", index)[..., 0]


def propose(
    network: Network, state: State, names: Sequence[str], near: float = 0.95
) -> EstimableSet:
    """Choose the parameters that the network can separate, at a state."""
    columns = parameter_columns_of(network, names)
    system = linearise(network, state, columns)
    whole = Assembly(network.with_start(state))
    design = whole.design(state).tocsc()
    given = design[:, whole.reduced[columns]].toarray()
    rest = unexplained(system.design, system.cofactor, given)
    kept, left = _select(names, rest, given)
    kept.sort()
    normal = rest[:, kept].T @ rest[:, kept]
    covariance = _inverse(normal)
    chosen = [names[k] for k in kept]
    hardly = tuple(_hardly(chosen, covariance, near))
    return EstimableSet(tuple(chosen), covariance, tuple(left), hardly)


def _inverse(normal: Array) -> Array:
    """Inverse of a symmetric matrix, scaled to unit diagonal first."""
    if len(normal) == 0:
        return normal
    scale = 1 / np.sqrt(np.diag(normal))
    out: Array = np.linalg.inv(normal * np.outer(scale, scale)) * np.outer(scale, scale)
    return out


def _rank_of(name: str) -> int:
    """Place of a parameter in the order of plain meaning."""
    parameter = name.split("(")[0]
    return ORDER.index(parameter) if parameter in ORDER else len(ORDER)


def _select(names: Sequence[str], rest: Array, given: Array) -> tuple[list[int], list[Left]]:
    """Choose independent columns in the order of plain meaning, and say what the others are like.

    ``given`` (n, k) are the columns of the parameters, ``rest`` (n, k) what the other unknowns
    leave of them.
    """
    basis = np.zeros((len(rest), 0))
    length = np.linalg.norm(given, axis=0)
    kept: list[int] = []
    left: list[Left] = []
    for k in sorted(range(len(names)), key=lambda k: _rank_of(names[k])):
        size = length[k] if length[k] > 0 else 1.0
        column = rest[:, k] / size
        for _ in range(2):
            column = column - basis @ (basis.T @ column)
        strength = float(np.linalg.norm(column))
        if strength > _RANK:
            kept.append(k)
            basis = np.column_stack([basis, column / strength])
            continue
        left.append(Left(names[k], _why(names, rest, given, k, kept)))
    return kept, left


def _why(names: Sequence[str], rest: Array, given: Array, k: int, kept: list[int]) -> str:
    """What a dependent column is like."""
    own, length = float(np.linalg.norm(rest[:, k])), float(np.linalg.norm(given[:, k]))
    if length == 0:
        return "no observation sees it"
    if own < _RANK * length:
        return "it acts like a change of orientation, datum or points"
    scale = np.linalg.norm(rest[:, kept], axis=0)
    parts = np.linalg.lstsq(rest[:, kept] / scale, rest[:, k], rcond=1e-10)[0] / scale
    share = np.abs(parts) * scale / own
    like = [names[kept[i]] for i in np.argsort(-share) if share[i] > 1e-5]
    miss = np.linalg.norm(given[:, kept] @ parts - given[:, k])
    also = " and the orientation together" if miss > _RANK * length else ""
    return f"it acts like {' and '.join(like[:4])}{also}"


def _hardly(names: Sequence[str], covariance: Array, near: float) -> list[Left]:
    """Parameters to leave out until no two of the others are correlated above a limit."""
    out: list[Left] = []
    alive = list(range(len(names)))
    while len(alive) > 1:
        part = _inverse(_inverse(covariance)[np.ix_(alive, alive)])
        sigma = np.sqrt(np.diag(part))
        rho = np.triu(part / np.outer(sigma, sigma), 1)
        i, j = np.unravel_index(int(np.argmax(np.abs(rho))), rho.shape)
        if abs(rho[i, j]) <= near:
            break
        a, b = alive[i], alive[j]
        worse, better = (a, b) if _rank_of(names[a]) > _rank_of(names[b]) else (b, a)
        why = Sentence(
            "it is hardly separated from {names} (correlation {rho:+3})",
            names=names[better],
            rho=rho[i, j],
        )
        out.append(Left(names[worse], why))
        alive.remove(worse)
    return out
