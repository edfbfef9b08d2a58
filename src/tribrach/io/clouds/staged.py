"""A binary file that is either whole or absent: written under a hidden name, renamed at the end."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self, cast

from tribrach.errors import InputError
from tribrach.io.keeping import note_written, refuse_changes
from tribrach.io.outputs import destination, reason, special


def staged_name(path: Path) -> Path:
    """The hidden name beside the destination; a killed run leaves at most this one file behind."""
    return path.with_name(f".{path.name}.part")


class _Telling:
    """A file that keeps what a write met; a compressor says no more than that one failed."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self.met: OSError | None = None

    def write(self, data: Any) -> int:
        """Write as the file does."""
        try:
            return self._stream.write(data)
        except OSError as error:
            self.met = error
            raise

    def flush(self) -> None:
        """Flush as the file does."""
        try:
            self._stream.flush()
        except OSError as error:
            self.met = error
            raise

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


class Staged:
    """A file that is being written, as a context manager; ``file`` is open for reading and writing.

    ``needs``: what the file needs, as it is said where it cannot be written.
    """

    def __init__(self, path: Path, needs: str = "the folder and the space on its disk") -> None:
        self.path, self.needs = path, needs
        try:
            self._place = destination(path)
            if special(self._place):
                raise OSError(22, "it is no ordinary file")
            self._hidden = staged_name(self._place)
            self._telling = _Telling(self._hidden.open("w+b"))
        except OSError as error:
            raise self._refused(error) from error
        self.file = cast(BinaryIO, self._telling)

    @contextmanager
    def writing(self, *failures: type[Exception]) -> Iterator[None]:
        """A block that writes to the file; if it fails, what was written is removed.

        ``*failures``: what a library raises where the disk refuses something, besides ``OSError``.
        """
        try:
            yield
        except BaseException as error:
            self.discard()
            if isinstance(error, (OSError, *failures)):
                raise self._refused(self._telling.met or error) from error
            raise

    def _refused(self, error: BaseException) -> InputError:
        words = reason(error) if isinstance(error, OSError) else str(error)
        return InputError(
            f"the file cannot be written ({words})", file=self.path, cure=f"check {self.needs}"
        )

    def commit(self) -> None:
        """Flush everything to the disk and give the file its name."""
        with self.writing():
            refuse_changes()
            if not self.file.closed:
                self.file.flush()
                os.fsync(self.file.fileno())
                self.file.close()
            note_written({self.path: self._hidden})
            os.replace(self._hidden, self._place)

    def discard(self) -> None:
        """Remove what was written."""
        if not self.file.closed:
            # closing writes what is still in memory, which a full disk refuses once more
            with suppress(OSError):
                self.file.close()
        self._hidden.unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is None:
            self.commit()
        else:
            self.discard()
