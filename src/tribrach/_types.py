"""The array types and the callback that every room of the house uses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

#: numbers; metres and radians unless a name says otherwise
Array = NDArray[np.float64]
#: numbers of points, stations, rows or columns
Index = NDArray[np.int64]
#: which of several things are meant
Mask = NDArray[np.bool_]
#: numbers of single precision, where scans are large
Single = NDArray[np.float32]
#: called with what is being done, how much of it is done, and how much there is (None: unknown)
Progress = Callable[[str, int, int | None], None]
