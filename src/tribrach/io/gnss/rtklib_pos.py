"""A mark measured with RTKLIB: one position or baseline out of the epochs of a ``.pos`` file.

A static solution has used all epochs up to each line: one of those at its end stands for the
session, and whether it is fixed is decided as for our own baselines
(:mod:`tribrach.instruments.final_solution`). Epochs of a kinematic solution are averaged with their
covariances, fixed ones if there are any; where they scatter beyond the 95 % limit of chi-square,
their scatter counts. Formal standard deviations are scaled as those of our own baselines
(:mod:`tribrach.instruments.gnss_solutions`).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geodesy.site import EllipsoidSite
from tribrach.instruments.final_solution import RARELY, final_solution
from tribrach.instruments.gnss_solutions import sigma_factor
from tribrach.io.gnss.records import GnssRecords
from tribrach.io.gnss.solution_file import FIXED, FLOAT, Solution, read_solution
from tribrach.statistics import chi2
from tribrach.units import percent


def read_rtklib(
    path: Path, *, point: str = "", base: str = "", factor: float | None = None
) -> GnssRecords:
    """The position of a mark, or the vector from a base to it."""
    solution = read_solution(path)
    if not len(solution):
        raise InputError("the file has no epochs", file=path)
    name = point or path.stem
    value, covariance, scatter, used, doubt = _one(solution)
    interval = float(np.median(np.diff(solution.times))) if len(solution) > 1 else 0.0
    scale = sigma_factor(interval, used) if factor is None else factor
    covariance = covariance * scale**2 + scatter
    records = GnssRecords()
    if doubt:
        records.warnings.append(f"{path.name}: {doubt}")
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


def _one(solution: Solution) -> tuple[Array, Array, Array, int, str]:
    """One value (3,) of a mark and how sure it is.

    After it come its formal covariance (3, 3), what a float solution adds to that when it is scaled
    (3, 3), the number of epochs it comes from, and what is doubtful about it.
    """
    best = int(solution.quality.min())
    share = float((solution.quality == FIXED).mean())
    doubt = "" if best == FIXED else "no epoch has fixed ambiguities"
    if best > FLOAT:
        doubt += ", they are code solutions"
    if best == FIXED and share < RARELY:
        doubt = f"only {percent(share)} of the epochs are fixed, fewer than {percent(RARELY)}"
    if solution.static:
        # phases are better than codes; among them the end of the session decides
        epochs = np.flatnonzero(solution.quality <= max(best, FLOAT))
        values, covariance = solution.values[epochs], solution.covariance[epochs]
        base = np.zeros(3) if solution.kind == "baseline" else solution.reference
        length = float(np.nan_to_num(np.linalg.norm(values[-1] - base)))
        final = final_solution(
            values, covariance, solution.quality[epochs] == FIXED, solution.ratio[epochs], length
        )
        if not final.fixed and best == FIXED:
            doubt = f"the solution is float: {final.reason}"
        return (
            values[final.epoch], covariance[final.epoch], final.scatter, len(solution), doubt,
        )  # fmt: skip
    chosen = np.flatnonzero(solution.quality == best)
    covariance = solution.covariance[chosen]
    weight = np.linalg.inv(covariance)
    total = np.linalg.inv(weight.sum(axis=0))
    origin = solution.values[chosen[0]]
    shift = total @ np.einsum("nij,nj->i", weight, solution.values[chosen] - origin)
    apart = solution.values[chosen] - origin - shift
    # epochs that scatter more than they state, as those with wrong integers do
    wider, dof = 1.0, 3 * (len(chosen) - 1)
    statistic = float(np.einsum("ni,nij,nj->", apart, weight, apart))
    if dof and statistic > chi2.ppf(0.95, dof):
        wider = statistic / dof
    return origin + shift, total * wider, np.zeros((3, 3)), len(chosen), doubt


def _turned(vector: Array, covariance: Array, reference: Array) -> tuple[Array, Array]:
    """A vector and covariance in east, north, up at the base, along the axes of ECEF."""
    axes = EllipsoidSite.centred(reference[None]).w_from_ecef
    return axes.T @ vector, axes.T @ covariance @ axes
