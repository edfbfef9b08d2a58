"""A mark measured by RTKLIB: one position or baseline out of the epochs of a ``.pos`` file.

A static solution has used all epochs up to each line: its best determined fixed epoch stands for
the session. Epochs of a kinematic solution are averaged with their covariances, fixed ones if there
are any. Formal sigmas are scaled as those of our own baselines
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
    """The mark ``point`` (the file's name if not given), or the vector from ``base`` to it.

    Parameters
    ----------
    factor
        On formal sigmas, None for the default.

    Raises
    ------
    InputError
        As the reader of the solution; no epochs; a baseline without its base.
    """
    solution = read_solution(path)
    if not len(solution):
        raise InputError("the file has no epochs", file=path)
    name = point or path.stem
    value, covariance, used = _one(path, solution)
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


def _one(path: Path, solution: Solution) -> tuple[Array, Array, int]:
    """One value (3,) with its formal covariance, and how many epochs are in it."""
    best = solution.quality == solution.quality.min()
    chosen = np.flatnonzero(best)
    covariance = solution.covariance[chosen]
    if _is_static(path):
        k = int(np.argmin(np.einsum("nii->n", covariance)))
        return solution.values[chosen[k]], covariance[k], len(solution)
    weight = np.linalg.inv(covariance)
    total = np.linalg.inv(weight.sum(axis=0))
    origin = solution.values[chosen[0]]
    shift = np.einsum("nij,nj->i", weight, solution.values[chosen] - origin)
    return origin + total @ shift, total, len(chosen)


def _is_static(path: Path) -> bool:
    """True if the header says so."""
    head = path.read_text(encoding="latin-1")[:20000].lower()
    mode = [line.partition(":")[2] for line in head.splitlines() if line.startswith("% pos mode")]
    return bool(mode) and "static" in mode[0]


def _turned(vector: Array, covariance: Array, reference: Array) -> tuple[Array, Array]:
    """East, north, up at the base along the axes of ECEF."""
    axes = EllipsoidSite.centred(reference[None]).w_from_ecef
    return axes.T @ vector, axes.T @ covariance @ axes
