"""Antennas over marks: heights, offsets, types, and phase centres from an ANTEX file.

The engine gets the antenna reference point as height, east and north over the mark (RINEX
``ANTENNA: DELTA H/E/N``), so that its vectors run from mark to mark. Without an ANTEX file phase
centres are left out, which cancels between equal antennas on short baselines.
"""

from __future__ import annotations

import re
import shutil
from dataclasses import dataclass
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.gnss.observation_file import RinexObservations

__all__ = ["AntennaSetup", "antenna_options", "antenna_warnings", "satellite_options"]

#: antennas are lower than this above their marks [m]
HIGHEST = 100.0
#: an antenna of a satellite: its number stands where others have their dome or serial number
_SATELLITE = re.compile(rb"^.{20}[GRECJIS]\d\d .{36}TYPE", re.M)


@dataclass(frozen=True)
class AntennaSetup:
    """An antenna over a mark: type with dome; height, east, north of its reference point [m]."""

    type: str = ""
    height: float = 0.0
    east: float = 0.0
    north: float = 0.0

    def __post_init__(self) -> None:
        if not max(abs(self.height), abs(self.east), abs(self.north)) < HIGHEST:
            raise InputError(
                f"an antenna height or offset of {self.height:g} m is none",
                cure="give the height of the antenna reference point over the mark in metres",
            )

    @classmethod
    def of(cls, file: RinexObservations, *, height: float | None = None) -> AntennaSetup:
        """What the header of a file says; a height of the user's goes before it."""
        up, east, north = (float(value) for value in file.delta)
        return cls(file.antenna, up if height is None else height, east, north)


def antenna_options(
    base: AntennaSetup, rover: AntennaSetup, antex: Path | None, folder: Path
) -> dict[str, object]:
    """Options of the engine; the ANTEX file is copied into its folder.

    Raises
    ------
    InputError
        The ANTEX file is none or lacks an antenna.
    """
    options: dict[str, object] = {}
    for key, antenna in (("ant1", rover), ("ant2", base)):
        options[f"{key}-antdele"] = antenna.east
        options[f"{key}-antdeln"] = antenna.north
        options[f"{key}-antdelu"] = antenna.height
        if antex is not None:
            options[f"{key}-anttype"] = _known(antex, antenna.type)
    if antex is not None:
        copy = folder / "antennas.atx"
        shutil.copyfile(antex, copy)
        options["file-rcvantfile"] = copy
        options["pos1-posopt2"] = 1  # phase centres of receivers
    return options


def satellite_options(antex: Path | None, folder: Path) -> dict[str, object]:
    """Options for precise orbits, which are those of centres of mass: phase centres of satellites.

    Empty where no ANTEX file has any.
    """
    if antex is None or _SATELLITE.search(antex.read_bytes()) is None:
        return {}
    # the copy that antenna_options has made
    return {"file-satantfile": folder / "antennas.atx", "pos1-posopt1": 1}


def antenna_warnings(base: AntennaSetup, rover: AntennaSetup, antex: Path | None) -> list[str]:
    """Different antennas whose phase centres are not known."""
    if antex is not None or base.type.split() == rover.type.split():
        return []
    return [
        f"the antennas {base.type or '(no type)'} and {rover.type or '(no type)'} differ and no "
        "ANTEX file is given: their phase centres may differ by centimetres in height"
    ]


def _known(antex: Path, name: str) -> str:
    """The antenna's name as the ANTEX file writes it."""
    try:
        data = antex.read_bytes()
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})", file=antex, cure="check the path"
        ) from error
    if b"ANTEX VERSION / SYST" not in data[:200]:
        raise InputError("this is no ANTEX file", file=antex)
    words = name.split()
    wanted = f"{words[0]:<16}{words[1] if len(words) > 1 else 'NONE':<4}" if words else ""
    found = re.search(rb"^" + re.escape(wanted.encode("latin-1")) + rb".{40}TYPE", data, re.M)
    if not words or found is None:
        raise InputError(
            f"the antenna {name or '(no type)'} is not in the ANTEX file",
            file=antex,
            cure="give a file that holds it, or leave the ANTEX file out",
        )
    return wanted
