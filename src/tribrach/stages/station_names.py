"""Which station was a cloud taken from? The file of poses beside it knows.

One station may have several scans, each with a cloud of its own; a merged cloud numbers its scans
in the order of that file.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.xml_file import read_bytes

__all__ = ["StationNames", "station_names"]

#: beside the clouds that they belong to
_POSES = "poses.json"


@dataclass(frozen=True)
class StationNames:
    """Names of scans and their stations, in order; both empty where no file of poses is."""

    scans: tuple[str, ...] = ()
    stations: tuple[str, ...] = ()

    def of_cloud(self, path: Path) -> str | None:
        """The station of a cloud with one scan; None if the poses do not name it."""
        stem = path.stem.removesuffix(".copc")
        for scan, station in zip(self.scans, self.stations, strict=True):
            if stem in (scan, _plain(scan)):
                return station
        return None

    def of_number(self, number: int) -> str | None:
        """The station of a scan in a merged cloud; None if the poses have fewer."""
        return self.stations[number] if 0 <= number < len(self.stations) else None


def station_names(folder: Path) -> StationNames:
    """The names that the file of poses in a folder gives.

    Raises
    ------
    InputError : there is a file of that name and it is no file of poses.
    """
    path = folder / _POSES
    if not path.is_file():
        return StationNames()
    try:
        rows = json.loads(read_bytes(path))["scans"]
        names = tuple((str(row["scan"]), str(row["station"])) for row in rows)
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise InputError(
            "this is no file of poses", file=path, cure="run the project again, or move it away"
        ) from error
    return StationNames(tuple(scan for scan, _ in names), tuple(station for _, station in names))


def _plain(name: str) -> str:
    """The name of a scan as files are named after it."""
    return "".join(c if c.isalnum() or c in "-_." else "_" for c in name).strip(".")
