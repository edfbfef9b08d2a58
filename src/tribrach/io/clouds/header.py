"""What a writer must know before the first point: fields, coordinate step, frame, provenance.

Every writer is a context manager with one method: it writes to a temporary name beside the
destination and renames when the block ends well; an exception or Ctrl-C leaves nothing behind.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.clouds.staged import Staged
from tribrach.scan.scan import Field

#: limits of the coordinate step [m]
FINEST, COARSEST = 1e-6, 1e-3


def _zeros() -> Array:
    return np.zeros(3)


@dataclass(frozen=True)
class CloudHeader:
    """Header of a cloud that is to be written."""

    name: str  #: of the cloud
    fields: tuple[Field, ...] = ()  #: values that `write` will get besides the coordinates
    #: coordinate step on disk of formats that store integers, one or for x, y and z, in the unit of
    #: the coordinates [m]
    step: float | tuple[float, float, float] = 1e-4
    #: (3,), stored coordinates are relative to it [m]
    offset: Array = field(default_factory=_zeros)
    crs: str | None = None  #: WKT of the reference system, None for a local frame
    epoch: float | None = None  #: decimal year of a dynamic frame
    #: world from scanner, for formats that keep points in the scanner frame
    pose: Pose | None = None
    #: further strings that the format has room for
    facts: Mapping[str, str] = field(default_factory=dict)

    @property
    def steps(self) -> Array:
        """(3,), coordinate steps on disk."""
        return np.broadcast_to(np.asarray(self.step, dtype=float), 3).copy()


def exactly(values: NDArray[Any], kind: Any, name: str, path: Path) -> NDArray[Any]:
    """Values in the type of a file, if it holds every one of them as it is; NaN stays NaN.

    Single precision holds doubles that a field declares as such.
    """
    target = np.dtype(kind)
    # numpy takes whole numbers of 64 bits for safe in a double, which has 53
    long = values.dtype.kind in "iu" and target.kind == "f" and values.dtype.itemsize > 4
    if np.can_cast(values.dtype, target, "safe") and not long:
        return values.astype(target, copy=False)
    with np.errstate(invalid="ignore", over="ignore"):
        out = values.astype(target)
        if target.kind == values.dtype.kind == "f":
            same = np.isfinite(out) | ~np.isfinite(values)
        else:
            same = out.astype(values.dtype) == values
            if long:  # what rounds up to the end of the type comes back by chance
                same &= out < float(np.iinfo(values.dtype).max)
        if target.kind in "iu" and values.dtype.kind in "iuf":
            # what lies beyond comes back by chance
            info = np.iinfo(target)
            same &= (values >= info.min) & (values <= info.max)
    if not same.all():
        wrong = values[int(np.argmin(same))]
        raise InputError(
            f"the value {wrong:g} of {name} is none that this format holds there",
            file=path,
            cure="write another format, or rename or remove the field",
        )
    return out


class CloudWriter(ABC):
    """A file that takes points chunk by chunk."""

    #: what a library raises where the disk refuses something
    _failures: ClassVar[tuple[type[Exception], ...]] = ()
    _staged: Staged

    @abstractmethod
    def write(self, xyz: Array, values: Mapping[str, NDArray[Any]]) -> None:
        """Append points (n, 3) [m] in the header's frame, and values (n,) by name of the field."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            if kind is None:
                with self._staged.writing(*self._failures):
                    self._finish()
                self._staged.commit()
        finally:
            self._discard()

    @abstractmethod
    def _finish(self) -> None:
        """Write what is known only after the last point."""

    def _discard(self) -> None:
        """Remove what was written and has not got its name."""
        self._staged.discard()


def step_for(sigma: float) -> float:
    """Coordinate step that suits a standard deviation: a power of ten times 1, 2 or 5.

    It is at most a tenth of the standard deviation, so that rounding adds less than 0.05 %, and
    lies between 1 micrometre and 1 millimetre.

    ``sigma``: standard deviation of a coordinate [m]. Returns the step [m].
    """
    wanted = min(max(sigma / 10, FINEST), COARSEST)
    decade = 10.0 ** np.floor(np.log10(wanted * (1 + 1e-9)))
    step = max(m * decade for m in (1, 2, 5) if m * decade <= wanted * (1 + 1e-9))
    return float(np.round(step, 9))


def single_resolution(coordinate: float) -> float:
    """Distance [m] between neighbouring 32-bit floats at a coordinate [m]."""
    return float(np.spacing(np.float32(abs(coordinate))))
