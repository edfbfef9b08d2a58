"""Phase centres of antennas: ANTEX files.

The engine reads the phase centres itself. Here the file is read as bytes, and only the names of
antennas are looked up. Format: ANTEX 1.4 (Rothacher and Schmid 2010).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.xml_file import read_bytes

__all__ = ["AntexFile", "read_antex"]

#: an antenna of a satellite: its number stands where others have their dome or serial number
_SATELLITE = re.compile(rb"^.{20}[GRECJIS]\d\d .{36}TYPE", re.M)


@dataclass(frozen=True)
class AntexFile:
    """An ANTEX file.

    Attributes
    ----------
    path
        Where it was read.
    data
        Its content.
    """

    path: Path
    data: bytes

    @property
    def has_satellites(self) -> bool:
        """True if antennas of satellites are in the file."""
        return _SATELLITE.search(self.data) is not None

    def receiver_antenna(self, name: str) -> str:
        """Name of a receiver's antenna as the file writes it.

        Parameters
        ----------
        name
            IGS name with dome; without a dome it is ``NONE``.

        Raises
        ------
        InputError
            The antenna is not in the file.
        """
        words = name.split()
        padded = f"{words[0]:<16}{words[1] if len(words) > 1 else 'NONE':<4}" if words else ""
        line = rb"^" + re.escape(padded.encode("latin-1")) + rb".{40}TYPE"
        if not words or re.search(line, self.data, re.M) is None:
            raise InputError(
                f"the antenna {name or '(no type)'} is not in the ANTEX file",
                file=self.path,
                cure="give a file that holds it, or leave the ANTEX file out",
            )
        return padded


def read_antex(path: Path) -> AntexFile:
    """Read an ANTEX file.

    Raises
    ------
    InputError
        The file cannot be read or is not ANTEX.
    """
    data = read_bytes(path)
    if b"ANTEX VERSION / SYST" not in data[:200]:
        raise InputError("this is no ANTEX file", file=path)
    return AntexFile(path, data)
