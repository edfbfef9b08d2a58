"""A binary file that is either whole or absent: written under a hidden name, renamed at the end."""

from __future__ import annotations

import os
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

from tribrach.errors import InputError
from tribrach.io.keeping import note_written
from tribrach.io.outputs import destination, reason, special

__all__ = ["Staged", "staged_name"]


def staged_name(path: Path) -> Path:
    """The hidden name beside the destination; a killed run leaves at most this one file behind."""
    return path.with_name(f".{path.name}.part")


class Staged:
    """A file that is being written, as a context manager; ``file`` is open for reading and writing.

    Parameters
    ----------
    path
        The destination.

    Raises
    ------
    InputError
        The folder or file cannot be written, or something would be lost.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._place = destination(path)
            if special(self._place):
                raise OSError(22, "it is no ordinary file")
            self._hidden = staged_name(self._place)
            self.file: BinaryIO = self._hidden.open("w+b")
        except OSError as error:
            raise self._refused(error) from error

    def _refused(self, error: OSError) -> InputError:
        return InputError(
            f"the file cannot be written ({reason(error)})",
            file=self.path,
            cure="check the folder and the space on its disk",
        )

    def commit(self) -> None:
        """Flush everything to the disk and give the file its name."""
        try:
            if not self.file.closed:
                self.file.flush()
                os.fsync(self.file.fileno())
                self.file.close()
            note_written(self.path)
            os.replace(self._hidden, self._place)
        except OSError as error:
            self.discard()
            raise self._refused(error) from error

    def discard(self) -> None:
        """Remove what was written."""
        if not self.file.closed:
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
