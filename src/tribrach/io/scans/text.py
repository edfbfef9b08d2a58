"""The lines of text files with numbers, read by blocks: any delimiter, compressed or not.

Lines are counted without the blank ones. Before anything else, delimiters and runs of blanks become
one space, so that every dialect is parsed alike; a line that is refused is then looked for and
named by its number in the file.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.io.unpacking import unpacked
from tribrach.kernels import njit

#: bytes read at a time; no line may be longer
BLOCK = 1 << 23
#: of so many lines so many are looked at beforehand
_STRIDE, _SAMPLE = 1 << 16, 256
#: translation of tabs into spaces
BLANKS = 2 * bytes.maketrans(b"\t\v\f", b"   ")


@dataclass(frozen=True)
class Mark:
    """A place in a file to go on from."""

    offset: int = 0  #: bytes before it
    ordinal: int = 0  #: lines before it that are not blank
    line: int = 0  #: lines before it, blank ones included


@dataclass(frozen=True)
class LineBlock:
    """Consecutive lines."""

    text: bytes  #: the lines, each with its newline
    count: int  #: how many
    first: int  #: lines before the block that are not blank
    mark: Mark  #: A place at or before the block


class Lines:
    """The lines of an opened file that are not blank, in order.

    ``blanks``: translation table that makes spaces of the delimiters, and behind it one for what
    stands in quotes; ``fill``: regular expression
    of cells with nothing in them, which become NaN; none if empty.
    """

    def __init__(
        self,
        file: BinaryIO,
        path: Path,
        blanks: bytes = BLANKS,
        mark: Mark | None = None,
        fill: bytes = b"",
    ) -> None:
        self._file, self.path, self.blanks = file, path, blanks
        self._empty = re.compile(fill) if fill else None
        self._mark = self._next = mark or Mark()
        if self._next.offset:
            file.seek(self._next.offset)
        self.ordinal = self._next.ordinal
        self._tail, self._text, self._at, self._ended = b"", b"", 0, False
        self._ends: NDArray[np.int64] = np.zeros(0, dtype=np.int64)

    @property
    def mark(self) -> Mark:
        """A place at or shortly before the next line."""
        return self._mark

    def peek(self, n: int) -> list[bytes]:
        """The next lines, at most n, without their newlines; they are not passed."""
        while len(self._ends) - self._at < n and self._fill(keep=self._at < len(self._ends)):
            pass
        return self._lines(self._at, min(self._at + n, len(self._ends))).split(b"\n")[:-1]

    def take(self, n: int) -> LineBlock:
        """The next lines, fewer than n only at the end of the file."""
        first, mark, left = self.ordinal, self._mark, n
        parts: list[bytes] = []
        while left > 0 and (self._at < len(self._ends) or self._fill()):
            if not parts:
                mark = self._mark
            k = min(left, len(self._ends) - self._at)
            parts.append(self._lines(self._at, self._at + k))
            self._at, self.ordinal, left = self._at + k, self.ordinal + k, left - k
        return LineBlock(b"".join(parts), n - left, first, mark)

    def skip(self, n: int) -> int:
        """Pass over n lines."""
        left = n
        while left > 0 and (self._at < len(self._ends) or self._fill()):
            k = min(left, len(self._ends) - self._at)
            self._at, self.ordinal, left = self._at + k, self.ordinal + k, left - k
        return n - left

    def survey(self, n: int | None = None) -> tuple[int, list[bytes]]:
        """Pass over n lines, or all."""
        passed, sample = 0, self.peek(min(_SAMPLE * 8, n or _SAMPLE * 8))
        while n is None or passed < n:
            stride = _STRIDE if n is None else min(_STRIDE, n - passed)
            if passed:
                sample += self.peek(min(stride, _SAMPLE))
            skipped = self.skip(stride)
            passed += skipped
            if skipped < stride:
                break
        return passed, sample

    def _lines(self, low: int, high: int) -> bytes:
        if high <= low:
            return b""
        start = int(self._ends[low - 1]) if low else 0
        return self._text[start : int(self._ends[high - 1])]

    def _fill(self, keep: bool = False) -> bool:
        """Read on, appending to the text or replacing it; False at the end of the file."""
        if self._ended:
            return False
        raw = self._file.read(BLOCK)
        self._ended = len(raw) == 0
        if self._next.offset == 0:
            raw = self._without_bom(raw)
        whole = self._tail + raw
        if self._ended:
            whole, self._tail = (whole + b"\n" if whole else whole), b""
        else:
            cut = whole.rfind(b"\n") + 1
            if cut == 0 and len(whole) >= BLOCK:
                raise InputError("a line has no end", file=self.path, line=self._next.line + 1)
            whole, self._tail = whole[:cut], whole[cut:]
        filled = whole if self._empty is None else self._empty.sub(b"nan", whole)
        text = _normal(filled, self.blanks)
        if not keep:
            self._mark, self._text, self._at = self._next, b"", 0
        self._text += text
        self._ends = np.flatnonzero(np.frombuffer(self._text, dtype=np.uint8) == 10) + 1
        kept = self._mark.ordinal + len(self._ends)
        self._next = Mark(
            self._next.offset + len(whole), kept, self._next.line + whole.count(b"\n")
        )
        return True

    def _without_bom(self, raw: bytes) -> bytes:
        if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
            raise InputError("the text is UTF-16", file=self.path, cure="save it as UTF-8")
        return b"   " + raw[3:] if raw[:3] == b"\xef\xbb\xbf" else raw

    def number(self, block: LineBlock, k: int) -> int:
        """Number in the file, from 1, of line k of a block, counted from 0."""
        with unpacked(self.path) as file:
            file.seek(block.mark.offset)
            left = block.first - block.mark.ordinal + k
            for number, line in enumerate(file, start=block.mark.line + 1):
                if _normal(line, self.blanks).strip():
                    left -= 1
                if left < 0:
                    return number
        return 0


def _normal(raw: bytes, blanks: bytes) -> bytes:
    """The text with one space between values, none at the ends of lines, and no blank line."""
    out = np.empty(len(raw), dtype=np.uint8)
    made = _squeezed(np.frombuffer(raw, dtype=np.uint8), np.frombuffer(blanks, np.uint8), out)
    return out[:made].tobytes()


@njit(cache=True, nogil=True)
def _squeezed(raw, blanks, out):  # type: ignore[no-untyped-def]
    """The number of bytes written to ``out``; carriage returns and quotation marks are left out.

    What parts cells parts none in quotes, which begin with a cell.
    """
    made, begun, gap, quoted = 0, False, False, False
    for byte in raw:
        c = blanks[byte + 256] if quoted else blanks[byte]
        if byte == 34:
            quoted = not quoted and (gap or not begun)
        elif c == 32:
            gap = gap or (begun and not quoted)
        elif c == 10:
            if begun:
                out[made] = 10
                made += 1
            begun = gap = quoted = False
        elif c != 13 and c != 34:
            if gap:
                out[made] = 32
                made += 1
            out[made] = c
            made += 1
            begun, gap = True, False
    return made
