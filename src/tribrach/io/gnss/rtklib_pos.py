"""A mark measured with RTKLIB: one position or baseline out of the epochs of a ``.pos`` file.

A static solution has used all epochs up to each line: its best determined fixed epoch stands for
the session. Epochs of a kinematic solution are averaged with their covariances, fixed ones if there
are any. Formal standard deviations are scaled as those of our own baselines
(:mod:`tribrach.instruments.gnss_solutions`).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geodesy.site import EllipsoidSite
from tribrach.instruments.gnss_solutions import sigma_factor
from tribrach.io.gnss.records import GnssRecords
from tribrach.io.gnss.solution_file import FIXED, FLOAT, Solution, read_solution

__all__ = ["read_rtklib"]


def read_rtklib(
    path: Path, *, point: str = "", base: str = "", factor: float | None = None
) -> GnssRecords:
    """The position of a mark, or the vector from a base to it.

    Parameters
    ----------
    path
        Solution file.
    point
        Name of the mark, that of the file if not given.
    base
        Name of the base of a baseline.
    factor
        On formal standard deviations, None for the default.

    Raises
    ------
    InputError
        As :func:`~tribrach.io.gnss.solution_file.read_solution`; no epochs; a baseline without its
        base.
    """
    solution = read_solution(path)
    if not len(solution):
        raise InputError("the file has no epochs", file=path)
    name = point or path.stem
    value, covariance, used = _one(solution)
    interval = float(np.median(np.diff(solution.times))) if len(solution) > 1 else 0.0
    scale = sigma_factor(interval, used) if factor is None else factor
    covariance = covariance * scale**2
    records = GnssRecords()
    if solution.quality.min() > FIXED:
        records.warnings.append(
            f"{path.name}: no epoch has fixed ambiguities"
            + ("" if solution.quality.min() <= FLOAT else ", they are code solutions")
        )
    line = f"{path.name}:{solution.lines[0]}"
    reference = solution.reference
    if base:
        if np.isnan(reference).any():
            raise InputError(
                "the header does not give the base (ref pos), so that the baseline is not known",
                file=path,
                cure="let RTKLIB write its options into the header",
            )
        vector = value if solution.kind == "baseline" else value - reference
        if solution.kind == "baseline":
            vector, covariance = _turned(vector, covariance, reference)
        records.start, records.end = [base], [name]
        records.vectors, records.blocks = vector[None], covariance[None]
        records.vector_sources = [line]
        records.approximate = {base: reference, name: reference + vector}
        return records
    if solution.kind == "baseline":
        raise InputError(
            "the file holds baselines, and their base is not named",
            file=path,
            cure="add base with the name of the base mark",
        )
    records.positions, records.position_sources = [name], [line]
    records.xyz, records.covariance = value[None], covariance
    return records


def _one(solution: Solution) -> tuple[Array, Array, int]:
    """One value (3,) with its formal covariance (3, 3), and the number of epochs it comes from."""
    best = solution.quality == solution.quality.min()
    chosen = np.flatnonzero(best)
    covariance = solution.covariance[chosen]
    if solution.static:
        k = int(np.argmin(np.einsum("nii->n", covariance)))
        return solution.values[chosen[k]], covariance[k], len(solution)
    weight = np.linalg.inv(covariance)
    total = np.linalg.inv(weight.sum(axis=0))
    origin = solution.values[chosen[0]]
    shift = np.einsum("nij,nj->i", weight, solution.values[chosen] - origin)
    return origin + total @ shift, total, len(chosen)


def _turned(vector: Array, covariance: Array, reference: Array) -> tuple[Array, Array]:
    """A vector and covariance in east, north, up at the base, along the axes of ECEF."""
    axes = EllipsoidSite.centred(reference[None]).w_from_ecef
    return axes.T @ vector, axes.T @ covariance @ axes
