"""The few exceptions of Tribrach: each says what is wrong, where, and what cures it.

```
TribrachError
├── InputError          a file or a call is wrong (file, line, cure); the command line exits with 2
└── AdjustmentError     the network cannot be adjusted as it stands
    ├── NoStartValues   unknowns that no observation ties to the rest
    ├── RankDefect      unknowns that the observations cannot separate, in sentences
    └── NotConverged    the iteration ended away from a minimum
```
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

__all__ = [
    "AdjustmentError",
    "InputError",
    "NoStartValues",
    "NotConverged",
    "RankDefect",
    "TribrachError",
]


class TribrachError(Exception):
    """Root of every exception that Tribrach raises on purpose."""


class InputError(TribrachError):
    """Something the user gave is wrong.

    Parameters
    ----------
    what
        What is wrong, one sentence without the final stop.
    file
        The file with the error, if there is one.
    line
        Its 1-based line, if there is one.
    record
        Anything else that tells the place: an element, a column, a point.
    cure
        What to do about it, one sentence without the final stop.
    """

    def __init__(
        self,
        what: str,
        *,
        file: str | Path | None = None,
        line: int | None = None,
        record: str | None = None,
        cure: str | None = None,
    ) -> None:
        self.what, self.file, self.line, self.record, self.cure = what, file, line, record, cure
        place = "" if file is None else str(file)
        if line is not None:
            place += f":{line}"
        if record is not None:
            place += f" ({record})" if place else record
        text = f"{place}: {what}" if place else what
        super().__init__(f"{text}; {cure}." if cure else f"{text}.")


class AdjustmentError(TribrachError):
    """The network cannot be adjusted.

    Parameters
    ----------
    headline
        What cannot be done.
    sentences
        The reasons, one each.
    """

    def __init__(self, headline: str, sentences: Sequence[str] = ()) -> None:
        self.headline, self.sentences = headline, tuple(sentences)
        super().__init__("\n".join([headline, *(f"  - {sentence}" for sentence in sentences)]))


class NoStartValues(AdjustmentError):
    """No chain of observations leads to some unknowns; the sentences name the ties that are
    missing.
    """


class RankDefect(AdjustmentError):
    """The observations leave combinations of unknowns open; the sentences say which."""


class NotConverged(AdjustmentError):
    """The iteration did not reach a minimum; no coordinates should be taken from it."""
