"""Ctrl-C, a closed terminal and SIGTERM end a command in order: what is temporary is removed."""

from __future__ import annotations

import signal
from types import FrameType

#: signals that ask a program to end; a closed terminal sends the last one
_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")


class Interruption:
    """Turns signals that ask the program to end into ``KeyboardInterrupt``.

    The first one counts. A second Ctrl-C ends the program even while it cleans up; the other
    signals, which come from other programs and often twice, do not.
    """

    def __init__(self) -> None:
        self.number: int | None = None  #: the signal that came

    def listen(self) -> None:
        """From now on signals raise; those that the caller wants ignored, as nohup, stay so."""
        for name in _SIGNALS:
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self._came)

    @property
    def status(self) -> int:
        """Exit status that tells a shell which signal it was."""
        return 128 + (self.number or signal.SIGINT)

    def _came(self, number: int, frame: FrameType | None) -> None:
        first, self.number = self.number is None, self.number or number
        if first or number == signal.SIGINT:
            raise KeyboardInterrupt
