"""Which satellites did a run of RTKLIB really use, and how large were their phase residuals?

The status file beside the solution has a line for each satellite, frequency and epoch: ``$SAT,week,
seconds,satellite,frequency,azimuth,elevation,code residual,phase residual,valid,...`` (RTKLIB 2.4.3
manual, appendix B.2). Satellites that files hold may be left out by the engine, for their health or
a bad accuracy index.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

__all__ = ["Use", "read_status"]

_LINE = re.compile(rb"^\$SAT,\d+,[\d.]+,([A-Z]\d\d),\d,[-\d.]+,[-\d.]+,[-\d.]+,([-\d.]+),1,", re.M)


@dataclass(frozen=True)
class Use:
    """Satellites by name, and the root mean square of their phase residuals [m], None if none."""

    satellites: tuple[str, ...]
    residual: float | None

    @property
    def systems(self) -> str:
        """Letters of the systems."""
        return "".join(dict.fromkeys(name[0] for name in self.satellites))


def read_status(path: Path) -> Use | None:
    """What a status file says; None where the engine wrote none."""
    if not path.is_file():
        return None
    found = _LINE.findall(path.read_bytes())
    if not found:
        return None
    residuals = np.array([word for _, word in found], dtype=float)
    # the reference satellite of the double differences has none
    others = residuals[residuals != 0]
    rms = float(np.sqrt((others**2).mean())) if len(others) else None
    return Use(tuple(sorted({name.decode() for name, _ in found})), rms)
