"""What the report says of frame and epoch of a GNSS network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tribrach.geodesy import frames
from tribrach.gnss.session_run import SessionResult

__all__ = ["epoch_sentences"]

#: no plate turns faster [rad/year]: 2.4 milliarcseconds, the Pacific (Altamimi et al. 2017)
FASTEST_TURN = 1.2e-8
#: turns of baselines below this are not worth a word [m]
NOTICEABLE = 1e-4
_YEAR = 365.25 * 86400


def epoch_sentences(info: Mapping[str, Any], sessions: Sequence[SessionResult]) -> list[str]:
    """Frame and epoch of the coordinates, and what the age of the baselines costs."""
    frame, epoch = info.get("frame"), info.get("epoch")
    if frame is None:
        return []
    if epoch is None or not frames.is_dynamic(str(frame)):
        return [f"Coordinates are in {frame}."]
    out = [f"Coordinates are in {frame} at epoch {epoch:.2f}."]
    ages = [
        (abs(1980.014 + b.start / _YEAR - epoch) * FASTEST_TURN * b.length, b)
        for session in sessions
        for b in session.baselines
    ]
    if ages and (worst := max(ages, key=lambda pair: pair[0]))[0] > NOTICEABLE:
        year = 1980.014 + worst[1].start / _YEAR
        out.append(
            f"Baselines measured in {year:.1f} are used at {epoch:.2f}: the turn of the plate in "
            f"between is neglected, at most {1e3 * worst[0]:.1f} mm in the longest."
        )
    return out
