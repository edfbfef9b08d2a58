"""Lists the observations that the tests reject, the most improbable first.

Single values are judged by w, observations with several values (vectors, targets) as blocks. The
two are compared by their significance, so that neither kind is preferred.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach.network.quality import block_tests
from tribrach.network.reliability import WeightedResiduals
from tribrach.network.significance import log_significance, w_critical

#: (table, item) of an observation in ``Network.observations``
Key = tuple[int, int]


@dataclass(frozen=True)
class Suspect:
    """A rejected observation."""

    key: Key  #: table and number of the observation
    row: int  #: row of its largest test value
    #: size of w for single values, T for blocks, and its limit
    statistic: float
    critical: float
    log_p: float  #: logarithm of its significance
    gross_error: float  #: estimated error in ``unit``, 0 where it has no single size
    unit: str  #: ``m``, ``rad`` or ``1``
    #: degrees of freedom: 1 for single values; whether it is a block
    freedom: int = 1
    block: bool = False

    @property
    def chi_square(self) -> float:
        """The statistic as chi-square of ``freedom`` degrees."""
        return self.statistic if self.block else self.statistic**2

    @property
    def critical_chi_square(self) -> float:
        """The limit of ``chi_square``."""
        return self.critical if self.block else self.critical**2


def find_suspects(system: WeightedResiduals, alpha0: float = 0.001) -> list[Suspect]:
    """List every rejected observation, the most improbable first."""
    return sorted(
        [*_single(system, alpha0), *_blocks(system, alpha0)], key=lambda suspect: suspect.log_p
    )


def _single(system: WeightedResiduals, alpha0: float) -> list[Suspect]:
    """Rejected observations of one value."""
    rows, tables = system.adjustment.rows, system.adjustment.network.observations
    w, limit = np.nan_to_num(np.abs(system.w)), w_critical(alpha0)
    alone = np.array([o.rows == 1 for o in tables], dtype=bool)[rows.table]
    rejected = np.flatnonzero(alone & (w > limit))
    log_p = log_significance(w[rejected] ** 2, 1)
    error = system.gross_error[rejected]
    return [
        Suspect(
            key=(int(rows.table[row]), int(rows.item[row])),
            row=int(row),
            statistic=float(w[row]),
            critical=limit,
            log_p=float(p),
            gross_error=float(g),
            unit=tables[rows.table[row]].units[0],
        )
        for row, p, g in zip(rejected, log_p, error, strict=True)
    ]


def _blocks(system: WeightedResiduals, alpha0: float) -> list[Suspect]:
    """Rejected observations of several values."""
    blocks = block_tests(system, alpha0)
    rejected = np.flatnonzero(blocks.rejected)
    log_p = log_significance(blocks.statistic[rejected], blocks.freedom[rejected])
    w = np.nan_to_num(np.abs(system.w))
    out = []
    for b, p in zip(rejected, log_p, strict=True):
        key = int(blocks.table[b]), int(blocks.item[b])
        members = _rows_of(system, key)
        out.append(
            Suspect(
                key=key,
                row=int(members[np.argmax(w[members])]),
                statistic=float(blocks.statistic[b]),
                critical=float(blocks.critical[b]),
                log_p=float(p),
                gross_error=float(np.nan_to_num(blocks.gross_error[b])),
                unit="m",
                freedom=int(blocks.freedom[b]),
                block=True,
            )
        )
    return out


def _rows_of(system: WeightedResiduals, key: Key) -> NDArray[np.int64]:
    """Rows of an observation."""
    rows = system.adjustment.rows
    members: NDArray[np.int64] = np.flatnonzero((rows.table == key[0]) & (rows.item == key[1]))
    return members
