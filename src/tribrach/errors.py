"""The few exceptions of Tribrach: each says what is wrong, where, and what cures it.

```
TribrachError
├── InputError          a file or a call is wrong (file, line, cure); the command line exits with 2
│   ├── UnknownName     nothing has the name that was asked for; also a KeyError
│   ├── Refusals        several records are wrong, each in a sentence of its own
│   └── NothingFound    targets were sought and none was found; what was sought, in sentences
└── AdjustmentError     the network cannot be adjusted as it stands
    ├── NoStartValues   unknowns that no observation ties to the rest
    ├── RankDefect      unknowns that the observations cannot separate, in sentences
    └── NotConverged    the iteration ended away from a minimum
```
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from difflib import get_close_matches
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import Any, Self

#: names that are compared with one that is not known
_LOOKED_THROUGH = 5000


def among(name: str, known: Sequence[str], words: str) -> str:
    """What to do about a name that is none of those that are known.

    Parameters
    ----------
    name
        That nothing has.
    known
        Those that there are.
    words
        Said before some of them where none is like it.

    Examples
    --------
    >>> among("scaner", ["scanner", "level"], "there are")
    'did you mean scanner'
    >>> among("x", ["scanner", "level"], "there are")
    'there are scanner, level'
    """
    plain = {one.casefold(): one for one in reversed(known)}
    near = get_close_matches(name.casefold(), plain, n=3, cutoff=0.6)
    if near:
        return f"did you mean {' or '.join(plain[one] for one in near)}"
    more = f" and {len(known) - 10} more" if len(known) > 10 else ""
    return f"{words} {', '.join(known[:10])}{more}" if known else "there are none"


class TribrachError(Exception):
    """Root of every exception that Tribrach raises on purpose."""


def _unpickled(kind: type[TribrachError], args: tuple[object, ...]) -> TribrachError:
    """An exception with its finished text; the attributes follow."""
    return kind.__new__(kind, *args)


#: what would steer a terminal, turn the direction of writing or break the line
STEERING = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
#: what no text of a name or a reason holds: controls, halves of characters, and what is none
NO_TEXT = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff\ufffe\uffff]")
#: words too long to be of use
_LONG_WORD = re.compile(r"(\S{60})\S{200,}(\S{20})")
#: a sentence has at most so many characters
_SENTENCE = 2000


def _printable(text: str) -> str:
    """One line for a terminal, whatever a file puts into it."""
    shown = _LONG_WORD.sub(r"\1...\2", text)
    if len(shown) > _SENTENCE:
        shown = f"{shown[: _SENTENCE - 200]} ... {shown[-190:]}"
    return STEERING.sub(lambda found: ascii(found.group())[1:-1], shown)


class InputError(TribrachError):
    """Something in the input is wrong: which file and line, what, and what to do.

    The sentence holds on one line and steers no terminal, whatever a file brought into it.

    ``what`` and ``cure`` are sentences without the final stop; the place is a file with a line, or
    a ``record``: an element, a column, a point.
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
        text = f"{text}; {cure}" if cure else text
        # a question ends with its own mark
        super().__init__(_printable(text if text.endswith("?") else f"{text}."))

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
        return str(self.args[0])


#: refusals whose sentences are kept; others are counted
_TOLD: ContextVar[int] = ContextVar("refusals that are told", default=20)


@contextmanager
def all_told() -> Iterator[None]:
    """A block in which every refusal keeps its sentence, however many there are."""
    token = _TOLD.set(sys.maxsize)
    try:
        yield
    finally:
        _TOLD.reset(token)


class Refusals(InputError):
    """Several records are wrong; each has its own sentence, in the order of the lines.

    Parameters
    ----------
    errors
        The first refusals, at least one. Place, ``what`` and ``cure`` are those of the first of
        them.
    count
        How many there are; those beyond the ones given are only counted.

    Examples
    --------
    >>> print(Refusals([InputError("x is 'a'", line=3, file="a.csv"), InputError("no y")], 5))
    5 records are refused:
      - a.csv:3: x is 'a'.
      - no y.
      - and 3 more.
    """

    def __init__(self, errors: Sequence[InputError], count: int) -> None:
        self.errors, self.count = _by_line(errors), count
        first = self.errors[0]
        super().__init__(
            first.what, file=first.file, line=first.line, record=first.record, cure=first.cure
        )
        sentences = _by_cause(self.errors)
        if count > len(self.errors):
            sentences.append(f"and {count - len(self.errors)} more.")
        listed = [f"  - {sentence}" for sentence in sentences]
        self.args = ("\n".join([f"{count} records are refused:", *listed]),)


class NothingFound(InputError):
    """Targets were sought and none was found; the sentences say what was sought, where and how.

    Parameters
    ----------
    headline
        What cannot be done, without the final stop.
    sentences
        Sizes, scans, densities and candidates, one each, without the final stop.
    cure
        What to do about it, one sentence without the final stop.

    Examples
    --------
    >>> print(NothingFound("no target was found", ["sought: disc of radius 0.1 m"], cure="look"))
    no target was found; look:
      - sought: disc of radius 0.1 m
    """

    def __init__(self, headline: str, sentences: Sequence[str], *, cure: str) -> None:
        super().__init__(headline, cure=cure)
        self.sentences = tuple(sentences)
        self.args = ("\n".join([f"{headline}; {cure}:", *(f"  - {s}" for s in sentences)]),)


def _by_cause(errors: Sequence[InputError]) -> list[str]:
    """Refusals in sentences: one for all lines of a file that are refused for the same cause."""
    groups: dict[tuple[object, ...], list[InputError]] = {}
    for error in errors:
        alone = (id(error),) if error.line is None or error.record is not None else ()
        groups.setdefault((str(error.file), error.what, error.cure, *alone), []).append(error)
    sentences = []
    for first, *others in groups.values():
        more = f"and {len(others)} more line{'s' if len(others) > 1 else ''}"
        if not others:
            sentences.append(str(first))
        else:
            cause = InputError(
                first.what, file=first.file, line=first.line, record=more, cure=first.cure
            )
            sentences.append(str(cause))
    return sentences


def _by_line(errors: Sequence[InputError]) -> tuple[InputError, ...]:
    """Refusals by file, in the order in which the files were read, and by line."""
    files = list(dict.fromkeys(str(error.file) for error in errors))
    return tuple(sorted(errors, key=lambda e: (files.index(str(e.file)), e.line or 0)))


class RefusalCollector:
    """Gathers what a reader refuses, so that a user sees all of it at once and not one a run.

    Within the block each record is read in :meth:`record`; one that is refused is noted and the
    next one is read. At the end of the block, or where :meth:`settle` says that nothing sensible
    follows, what was noted is raised: one refusal as it is, several as :class:`Refusals`. A refusal
    of the whole file that ends the block comes to the others.

    Examples
    --------
    >>> def number(text):
    ...     if not text.isdigit():
    ...         raise InputError(f"{text!r} is no number")
    ...     return int(text)
    >>> with RefusalCollector() as refused:
    ...     for text in ("1", "two", "3"):
    ...         with refused.record():
    ...             number(text)
    Traceback (most recent call last):
    ...
    tribrach.errors.InputError: 'two' is no number.
    """

    def __init__(self) -> None:
        self._kept: list[InputError] = []
        self._seen: set[int] = set()
        self.count = 0

    def add(self, error: InputError) -> None:
        """Note a refusal; the same sentence a second time says nothing new."""
        parts: Sequence[InputError] = (error,)
        if isinstance(error, Refusals):
            parts, self.count = error.errors, self.count + error.count - len(error.errors)
        for part in parts:
            sentence = hash(str(part))
            if sentence not in self._seen:
                self._seen.add(sentence)
                self.count += 1
                self._kept += [part] if len(self._kept) < _TOLD.get() else []

    @contextmanager
    def record(self) -> Iterator[None]:
        """A block that reads one record; its refusal is noted, and what follows goes on."""
        try:
            yield
        except InputError as error:
            self.add(error)

    @property
    def full(self) -> bool:
        """True if further sentences would only be counted."""
        return len(self._kept) >= _TOLD.get()

    def error(self) -> InputError:
        """The noted refusal, or :class:`Refusals` if there are several."""
        return self._kept[0] if self.count == 1 else Refusals(self._kept, self.count)

    def settle(self) -> None:
        """Raise what was noted so far, if anything was."""
        if self.count:
            error = self.error()
            self._kept, self.count = [], 0
            raise error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        # other exceptions than refusals are not ours; an adjustment that fails on what is left of
        # a file says nothing that the refusals do not say better
        if error is not None and not (self.count and isinstance(error, TribrachError)):
            return
        if isinstance(error, InputError):
            self.add(error)
        self.settle()


class AdjustmentError(TribrachError):
    """The network cannot be adjusted."""

    def __init__(self, headline: str, sentences: Sequence[str] = ()) -> None:
        self.headline, self.sentences = headline, tuple(sentences)
        super().__init__(self._text())

    def _text(self) -> str:
        return "\n".join([self.headline, *(f"  - {sentence}" for sentence in self.sentences)])

    def also(self, sentences: Sequence[str]) -> None:
        """Append sentences to the reasons: what may have to do with it."""
        self.sentences += tuple(sentences)
        self.args = (self._text(),)

    def because(self, sentences: Sequence[str]) -> None:
        """Put sentences before the reasons: what is likely to be behind it."""
        self.sentences = (*sentences, *self.sentences)
        self.args = (self._text(),)


class NoStartValues(AdjustmentError):
    """No chain of observations leads to some unknowns; the sentences name the missing ties.

    ``unplaced`` are family and name of each unknown without a value.
    """

    def __init__(
        self,
        headline: str,
        sentences: Sequence[str] = (),
        unplaced: Sequence[tuple[str, str]] = (),
    ) -> None:
        super().__init__(headline, sentences)
        self.unplaced = tuple(unplaced)


class RankDefect(AdjustmentError):
    """The observations leave combinations of unknowns open; the sentences say which."""


class NotConverged(AdjustmentError):
    """The iteration did not reach a minimum; no coordinates should be taken from it."""


#: doubts of a command that nobody was told yet, by what they are of
_DOUBTS: ContextVar[dict[str, str] | None] = ContextVar("doubts of a command", default=None)


@contextmanager
def doubting() -> Iterator[None]:
    """A block whose doubts about files are gathered, to be told with its result or refusal."""
    token = _DOUBTS.set({})
    try:
        yield
    finally:
        _DOUBTS.reset(token)


def note_doubt(of: str, sentence: str) -> None:
    """Note a doubt about a file, without the final stop."""
    noted = _DOUBTS.get()
    if noted is not None:
        noted[of] = sentence


def untold_doubts(told: str = "") -> list[str]:
    """Doubts that a text does not tell, whatever its figures; none of them is untold afterwards."""
    noted = _DOUBTS.get() or {}
    out = [
        f"{of}: {text}"
        for of, text in noted.items()
        if re.split(r"\d", text)[0].lower() not in told.lower()
    ]
    noted.clear()
    return out
