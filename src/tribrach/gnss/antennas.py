"""Antennas over marks: heights, offsets, types and phase centres.

The engine gets the antenna reference point as height, east and north over the mark (RINEX
``ANTENNA: DELTA H/E/N``), so that its vectors run from mark to mark. Phase centres come from an
ANTEX file. Without one they are left out, which cancels between equal antennas on short baselines.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.gnss.antex_file import AntexFile
from tribrach.io.gnss.observation_file import RinexObservations

__all__ = [
    "ANTEX_NAME",
    "AntennaSetup",
    "antenna_options",
    "antenna_warnings",
    "satellite_options",
]

#: name of the ANTEX file in the engine's work folder
ANTEX_NAME = "antennas.atx"
#: antennas are lower than this above their marks [m]
HIGHEST = 100.0


@dataclass(frozen=True)
class AntennaSetup:
    """An antenna over a mark.

    Attributes
    ----------
    type
        IGS name with dome.
    height, east, north
        Of the antenna reference point over the mark [m].

    Raises
    ------
    InputError
        A height or offset of 100 m or more.
    """

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
        """The antenna that the header of a file describes.

        Parameters
        ----------
        file
            Observations with their header.
        height
            Height over the mark [m]; overrides that of the header.
        """
        up, east, north = (float(value) for value in file.delta)
        return cls(file.antenna, up if height is None else height, east, north)


def antenna_options(
    base: AntennaSetup, rover: AntennaSetup, antex: AntexFile | None, folder: Path
) -> dict[str, object]:
    """Options of the engine for both antennas.

    Parameters
    ----------
    base, rover
        The antennas.
    antex
        Phase centres, None to leave them out.
    folder
        The engine's work folder, which holds the ANTEX file as :data:`ANTEX_NAME`.

    Raises
    ------
    InputError
        The ANTEX file lacks an antenna.
    """
    options: dict[str, object] = {}
    for key, antenna in (("ant1", rover), ("ant2", base)):
        options[f"{key}-antdele"] = antenna.east
        options[f"{key}-antdeln"] = antenna.north
        options[f"{key}-antdelu"] = antenna.height
        if antex is not None:
            options[f"{key}-anttype"] = antex.receiver_antenna(antenna.type)
    if antex is not None:
        options["file-rcvantfile"] = folder / ANTEX_NAME
        options["pos1-posopt2"] = 1  # phase centres of receivers
    return options


def satellite_options(antex: AntexFile | None, folder: Path) -> dict[str, object]:
    """Options for precise orbits, which refer to centres of mass: phase centres of satellites.

    Parameters
    ----------
    antex
        Phase centres, None if there are none.
    folder
        The engine's work folder, as in :func:`antenna_options`.

    Returns
    -------
    dict
        Empty if the file has no antennas of satellites.
    """
    if antex is None or not antex.has_satellites:
        return {}
    return {"file-satantfile": folder / ANTEX_NAME, "pos1-posopt1": 1}


def antenna_warnings(base: AntennaSetup, rover: AntennaSetup, antex: Path | None) -> list[str]:
    """A sentence if the antennas differ and their phase centres are not known."""
    if antex is not None or base.type.split() == rover.type.split():
        return []
    return [
        f"the antennas {base.type or '(no type)'} and {rover.type or '(no type)'} differ and no "
        "ANTEX file is given: their phase centres may differ by centimetres in height"
    ]
