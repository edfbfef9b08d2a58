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

#: name of the ANTEX file in the engine's work folder
ANTEX_NAME = "antennas.atx"
#: antennas are lower than this above their marks [m]
HIGHEST = 100.0


@dataclass(frozen=True)
class AntennaSetup:
    """An antenna over a mark."""

    type: str = ""  #: IGS name with dome
    #: of the antenna reference point over the mark [m]
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
        """The antenna in the header of a file; ``height`` [m] over the mark overrides its own."""
        up, east, north = (float(value) for value in file.delta)
        return cls(file.antenna, up if height is None else height, east, north)


@dataclass(frozen=True, eq=False)
class BaselineAntennas:
    """Both antennas of a baseline, and what is known of phase centres."""

    #: the antennas
    base: AntennaSetup
    rover: AntennaSetup
    antex: AntexFile | None = None  #: phase centres, None to leave them out

    def options(self, folder: Path) -> dict[str, object]:
        """Options of the engine for both antennas."""
        options: dict[str, object] = {}
        for key, antenna in (("ant1", self.rover), ("ant2", self.base)):
            options[f"{key}-antdele"] = antenna.east
            options[f"{key}-antdeln"] = antenna.north
            options[f"{key}-antdelu"] = antenna.height
            if self.antex is not None:
                options[f"{key}-anttype"] = self.antex.receiver_antenna(antenna.type).name
        if self.antex is not None:
            options["file-rcvantfile"] = folder / ANTEX_NAME
            options["pos1-posopt2"] = 1  # phase centres of receivers
        return options

    @property
    def has_satellites(self) -> bool:
        """True if phase centres of satellites are known."""
        return self.antex is not None and self.antex.has_satellites

    def satellite_options(self, folder: Path) -> dict[str, object]:
        """Options for precise orbits, which refer to centres of mass: satellites' phase centres."""
        if not self.has_satellites:
            return {}
        return {"file-satantfile": folder / ANTEX_NAME, "pos1-posopt1": 1}

    def file(self) -> dict[str, bytes]:
        """The ANTEX file of both antennas and of all satellites by its name; empty without one."""
        if self.antex is None:
            return {}
        own = tuple(self.antex.receiver_antenna(a.type) for a in (self.base, self.rover))
        return {ANTEX_NAME: self.antex.of_baseline(own, satellites=True)}

    def warnings(self, frequencies: int) -> list[str]:
        """Sentences on phase centres that are not known, or not quite."""
        if self.antex is not None:
            return self._inexact(self.antex, frequencies)
        if self.base.type.split() == self.rover.type.split():
            return []
        return [
            f"the antennas {self.base.type or '(no type)'} and {self.rover.type or '(no type)'} "
            "differ and no ANTEX file is given: their phase centres may differ by centimetres in "
            "height"
        ]

    def _inexact(self, antex: AntexFile, frequencies: int) -> list[str]:
        """Sentences on antennas that the file has with another dome or with fewer frequencies."""
        out = []
        for name in dict.fromkeys((self.base.type, self.rover.type)):
            found = antex.receiver_antenna(name)
            if found.other_dome:
                out.append(
                    f"{antex.path.name} has no phase centres of {found.name.split()[0]} with the "
                    f"dome {found.other_dome}: those without a dome (NONE) are taken, which may "
                    "differ by some millimetres in height"
                )
            if len(found.frequencies) < frequencies:
                out.append(
                    f"{antex.path.name} has phase centres of {' '.join(found.name.split())} for "
                    f"{', '.join(found.frequencies)} only: further frequencies are used without"
                )
        return out
