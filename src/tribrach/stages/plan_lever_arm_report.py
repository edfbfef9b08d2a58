"""What a plan says about a lever arm: a table, sentences, data."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.network.planning import largest_sigma
from tribrach.report.numbers import numbers
from tribrach.report.tables import Column, Table, build_table, number_cell, text_cell
from tribrach.stages.plan_lever_arm import LeverArmForecast

__all__ = ["lever_arm_json", "lever_arm_sentences", "lever_arm_table"]

Array = NDArray[np.float64]
_Row = tuple[str, Array]

#: targets that leave a wider part of the horizon free than this are not all around [rad]
_GAP = np.radians(180.0)


def _rows(found: LeverArmForecast) -> list[_Row]:
    """The solutions in words, with their covariances."""
    rows = [("as it is known", found.prior)]
    if found.before is not None:
        rows.append(("with the targets of the plan", found.before))
    if found.before is None or not np.array_equal(found.before, found.after):
        rows.append(("with what is proposed", found.after))
    return rows


def lever_arm_table(found: LeverArmForecast | None) -> Table:
    """Sigmas and correlations of each solution; no rows without a lever arm."""
    rows = [] if found is None else _rows(found)

    def mm(row: _Row, axis: int) -> float:
        return float(np.sqrt(row[1][axis, axis]))

    def correlation(row: _Row, a: int, b: int) -> float:
        both = mm(row, a) * mm(row, b)
        return float(row[1][a, b]) / both if both > 0 else 0.0

    columns = [
        (Column("Lever arm", numeric=False), lambda row: text_cell(row[0])),
        *(
            (Column(f"σ {name}", "mm"), lambda row, k=k: _mm(mm(row, k)))
            for k, name in enumerate("xyz")
        ),
        (Column("worst σ", "mm"), lambda row: _mm(float(largest_sigma(row[1])))),
        *(
            (
                Column(f"ρ {'xyz'[a]}{'xyz'[b]}"),
                lambda row, a=a, b=b: number_cell(
                    correlation(row, a, b), f"{correlation(row, a, b):.2f}"
                ),
            )
            for a, b in ((0, 1), (0, 2), (1, 2))
        ),
    ]
    note = (
        "In the scanner frame, a priori; planned scanners have x to the east and y to the north. "
        "ρ are correlations."
    )
    return build_table("lever-arm", "The lever arm", note, rows, columns)


def _mm(value: float) -> Any:
    return number_cell(value, f"{1e3 * value:.2f}")


def lever_arm_sentences(found: LeverArmForecast | None) -> list[str]:
    """What the plan makes of the lever arm, and whether its targets stand all around."""
    if found is None:
        return []
    out = []
    for words, covariance in _rows(found)[1:]:
        size = ", ".join(
            f"{axis} {1e3 * s:.2g} mm"
            for axis, s in zip("xyz", np.sqrt(np.diag(covariance)), strict=True)
        )
        out.append(f"Lever arm {found.name} {words}: sigma {size}.")
    if found.gaps[1] > _GAP:
        out.append(
            f"The targets leave {np.degrees(found.gaps[1]):.0f} degrees of the horizon free: the "
            "scanner's place is extrapolated from them. Targets on the other side serve most."
        )
    return out


def lever_arm_json(found: LeverArmForecast | None) -> Any:
    """Covariances [m^2] of a lever arm, free parts of the horizon [rad]; None without one."""
    if found is None:
        return None

    def matrix(covariance: Array | None) -> Any:
        return None if covariance is None else [numbers(row) for row in covariance]

    return {
        "name": found.name,
        "prior": matrix(found.prior),
        "before": matrix(found.before),
        "plan": matrix(found.after),
        "horizon_without_targets": {"before": found.gaps[0], "plan": found.gaps[1]},
    }
