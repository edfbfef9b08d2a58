"""Phase centres of antennas: ANTEX files, plain or packed.

The engine reads the phase centres itself, those for GPS, which it takes for all systems. It gets
the antennas of a baseline and not the whole file, because that of the IGS has 18 MB and is read in
every run. Format: ANTEX 1.4 (Rothacher and Schmid 2010).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.unpacking import unpacked_bytes

_TYPE = re.compile(rb"^(.{20})(.{20}).{20}TYPE / SERIAL NO", re.M)
#: a satellite's number stands where receivers' antennas have a serial number
_SATELLITE = re.compile(rb"[GREJCIS]\d\d *")
_END = re.compile(rb"^ {60}END OF ANTENNA[^\n]*(?:\n|\Z)", re.M)
#: where the values of one frequency begin
_FREQUENCY = re.compile(rb"^ {3}([A-Z ]\d\d).{54}START OF FREQUENCY", re.M)
#: a header that the engine reads alike for every file
_HEADER_END = re.compile(rb"END OF HEADER[^\n]*\n")
#: word for an antenna without a dome
NO_DOME = "NONE"


@dataclass(frozen=True)
class ReceiverAntenna:
    """An antenna as an ANTEX file has it."""

    name: str  #: type and dome in twenty columns
    frequencies: tuple[str, ...]  #: of the values for GPS, such as ``G01``
    #: the dome that was asked for, where only values without a dome are there; else ""
    other_dome: str = ""


@dataclass(frozen=True, eq=False)
class AntexFile:
    """An ANTEX file."""

    path: Path  #: where it was read
    data: bytes  #: its unpacked content
    #: first byte, name (20 columns) and serial number or satellite (20 columns) of each antenna
    places: tuple[tuple[int, bytes, bytes], ...]

    @property
    def has_satellites(self) -> bool:
        """True if antennas of satellites are in the file."""
        return any(_SATELLITE.match(serial) for _, _, serial in self.places)

    def receiver_antenna(self, name: str) -> ReceiverAntenna:
        """A receiver's antenna by the name of a RINEX header."""
        words = name.split()
        kind, dome = (words[0] if words else ""), (words[1] if len(words) > 1 else NO_DOME)
        exact = self._block(_padded(kind, dome))
        plain = exact or self._block(_padded(kind, NO_DOME))
        if not words or plain is None:
            raise self._unknown(name, kind)
        frequencies = tuple(
            match.group(1).decode()
            for match in _FREQUENCY.finditer(plain)
            if match.group(1)[:1] in b"G "
        )
        if not frequencies:
            raise InputError(
                f"the ANTEX file has no phase centres for GPS of the antenna {name}",
                file=self.path,
                cure="give a whole file, or leave the ANTEX file out",
            )
        if exact is not None:
            return ReceiverAntenna(_padded(kind, dome), frequencies)
        return ReceiverAntenna(_padded(kind, NO_DOME), frequencies, dome)

    def of_baseline(self, antennas: tuple[ReceiverAntenna, ...], *, satellites: bool) -> bytes:
        """An ANTEX file of some antennas."""
        end = _HEADER_END.search(self.data)
        parts = [self.data[: end.end() if end else 0]]
        for name in dict.fromkeys(antenna.name for antenna in antennas):
            parts.append(self._block(name) or b"")
        if satellites:
            parts += [
                self._at(place) for place, _, serial in self.places if _SATELLITE.match(serial)
            ]
        return b"".join(parts)

    def _block(self, name: str) -> bytes | None:
        """The antenna of a name: the mean of its type, not that of a single antenna if both are."""
        wanted = name.encode("latin-1")
        found = [
            (bool(serial.strip()), place)
            for place, kind, serial in self.places
            if kind == wanted and not _SATELLITE.match(serial)
        ]
        return self._at(min(found)[1]) if found else None

    def _at(self, place: int) -> bytes:
        """The lines of the antenna that begins at a byte."""
        end = _END.search(self.data, place)
        following = next((start for start, _, _ in self.places if start > place), len(self.data))
        if end is None or end.start() > following:
            raise InputError(
                "the ANTEX file ends within an antenna",
                file=self.path,
                line=self.data.count(b"\n", 0, place) + 1,
                cure="download or transfer it again",
            )
        return self.data[place : end.end()]

    def _unknown(self, name: str, kind: str) -> InputError:
        """The error of an antenna that is not there, with the domes that are."""
        own = kind.encode("latin-1")
        domes = sorted(
            {text[16:].decode("latin-1") for _, text, _ in self.places if text[:16].strip() == own}
        )
        with_domes = f"; it has it with the domes {', '.join(domes)}" if kind and domes else ""
        return InputError(
            f"the antenna {name or '(no type)'} is not in the ANTEX file{with_domes}",
            file=self.path,
            cure="give a file that holds it, or leave the ANTEX file out",
        )


def _padded(kind: str, dome: str) -> str:
    """Type and dome in the columns of the format."""
    return f"{kind:<16}{dome:<4}"


def read_antex(path: Path) -> AntexFile:
    """Read an ANTEX file."""
    data = unpacked_bytes(path)
    if b"ANTEX VERSION / SYST" not in data[:200]:
        raise InputError("this is no ANTEX file", file=path)
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n")
    places = []
    for match in _TYPE.finditer(data):
        # the line before begins the antenna
        start = data.rfind(b"\n", 0, max(match.start() - 1, 0)) + 1
        places.append((start, match.group(1), match.group(2)))
    return AntexFile(path, data, tuple(places))
