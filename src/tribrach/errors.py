"""The few exceptions of Tribrach: each says what is wrong, where, and what cures it.

```
TribrachError
├── InputError          a file or a call is wrong (file, line, cure); the command line exits with 2
│   └── UnknownName     nothing has the name that was asked for; also a KeyError
└── AdjustmentError     the network cannot be adjusted as it stands
    ├── NoStartValues   unknowns that no observation ties to the rest
    ├── RankDefect      unknowns that the observations cannot separate, in sentences
    └── NotConverged    the iteration ended away from a minimum
```
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from itertools import islice
from pathlib import Path
from typing import Any

__all__ = [
    "AdjustmentError",
    "InputError",
    "NoStartValues",
    "NotConverged",
    "RankDefect",
    "TribrachError",
    "UnknownName",
]


#: names that are compared with one that is not known
_LOOKED_THROUGH = 5000


class TribrachError(Exception):
    """Root of every exception that Tribrach raises on purpose."""


def _unpickled(kind: type[TribrachError], args: tuple[object, ...]) -> TribrachError:
    """An exception with its finished text; the attributes follow."""
    return kind.__new__(kind, *args)


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

    def __reduce__(self) -> tuple[Any, ...]:
        # by default the finished text would be taken for ``what`` and end with two stops
        return _unpickled, (type(self), self.args), self.__dict__


class UnknownName(InputError, KeyError):
    """Nothing has the name that was asked for; says which names there are.

    Parameters
    ----------
    noun
        What was asked for, such as ``point``.
    name
        The name that nothing has.
    known
        The names that there are.

    Examples
    --------
    >>> print(UnknownName("point", "A10", ["A1", "B"]))
    there is no point A10; did you mean A1?
    >>> print(UnknownName("station", "S9", []))
    there is no station S9; there are none.
    """

    def __init__(self, noun: str, name: str, known: Iterable[str]) -> None:
        self.name, self.known = name, tuple(known)
        super().__init__(f"there is no {noun} {name}", cure=self._cure())

    def _cure(self) -> str:
        """The names most like this one, or some of those that there are."""
        if not self.known:
            return "there are none"
        # of very many names those that begin or end like this one
        many = len(self.known) > _LOOKED_THROUGH
        alike = (k for k in self.known if k[:3] == self.name[:3] or k[-3:] == self.name[-3:])
        pool = list(islice(alike, _LOOKED_THROUGH)) if many else self.known
        like = get_close_matches(self.name, pool, n=4, cutoff=0.5)
        if like:
            return f"did you mean {', '.join(like)}?"
        more = f" and {len(self.known) - 8} more" if len(self.known) > 8 else ""
        return f"there are {', '.join(self.known[:8])}{more}"

    def __str__(self) -> str:
        # a KeyError would show the repr of its text
        text = str(self.args[0])
        return text.removesuffix(".") if text.endswith("?.") else text


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
    """No chain of observations leads to some unknowns; the sentences name the missing ties."""


class RankDefect(AdjustmentError):
    """The observations leave combinations of unknowns open; the sentences say which."""


class NotConverged(AdjustmentError):
    """The iteration did not reach a minimum; no coordinates should be taken from it."""
