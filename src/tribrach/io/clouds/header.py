"""What a writer must know before the first point: fields, coordinate step, frame, provenance.

Every writer is a context manager with one method: it writes to a temporary name beside the
destination and renames when the block ends well; an exception or Ctrl-C leaves nothing behind.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import TracebackType
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.geometry.pose import Pose
from tribrach.scan.scan import Field

__all__ = ["CloudHeader", "CloudWriter", "single_resolution", "step_for"]


def _zeros() -> Array:
    return np.zeros(3)


@dataclass(frozen=True)
class CloudHeader:
    """Header of a cloud on its way out.

    Attributes
    ----------
    fields
        What `write` will be given besides xyz.
    step
        Coordinate step on disk [m] of formats that store integers; offset (3,) [m] : stored
        coordinates are relative to it.
    crs
        WKT.
    epoch
        Decimal year of a dynamic frame.
    pose
        Of formats that keep points in the scanner frame.
    facts
        Further strings that the format has room for.
    """

    name: str
    fields: tuple[Field, ...] = ()
    step: float = 1e-4
    offset: Array = field(default_factory=_zeros)
    crs: str | None = None
    epoch: float | None = None
    pose: Pose | None = None
    facts: Mapping[str, str] = field(default_factory=dict)


class CloudWriter(Protocol):
    """A file that takes points chunk by chunk."""

    def write(self, xyz: Array, values: Mapping[str, NDArray[Any]]) -> None:
        """Append points (n, 3) [m], in the frame of the header, and their values by field name."""

    def __enter__(self) -> Self:
        """The writer itself."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Finish and rename; or remove what was begun."""


# How finely are coordinates kept, on disk and in memory?


#: limits of the coordinate step [m]
FINEST, COARSEST = 1e-6, 1e-3


def step_for(sigma: float) -> float:
    """The largest step of 1, 2 or 5 times a power of ten that is at most a tenth of a sigma [m].

    Rounding to it adds less than 0.05 % to that sigma. Within 1 micrometre and 1 millimetre.
    """
    wanted = min(max(sigma / 10, FINEST), COARSEST)
    decade = 10.0 ** np.floor(np.log10(wanted * (1 + 1e-9)))
    step = max(m * decade for m in (1, 2, 5) if m * decade <= wanted * (1 + 1e-9))
    return float(np.round(step, 9))


def single_resolution(coordinate: float) -> float:
    """Distance [m] between neighbouring 32-bit floats at a coordinate [m]."""
    return float(np.spacing(np.float32(abs(coordinate))))
