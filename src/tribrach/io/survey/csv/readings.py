"""Readings of a total station from a CSV file: both faces, several sets, raw distances.

``station,target,face,direction_gon,zenith_gon,slope_distance_m`` and heights; rows stand in the
order in which they were read. A prism constant, parts per million or the air beside a distance are
applied to it; without them it is taken as corrected. A row that is not ``on`` takes no part.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tribrach.io.survey.csv.reader import Reader
from tribrach.io.survey.totalstation import survey_of
from tribrach.io.totalstation.recorder import Recorder
from tribrach.io.totalstation.records import RawFile

_CORRECTIONS = ("prism_constant", "atmosphere_ppm", "pressure_hpa")
#: columns that are read row by row, with what is to be applied to a distance
_READ = (
    "direction", "zenith", "slope_distance", *_CORRECTIONS, "temperature_c", "humidity_percent",
)  # fmt: skip


class ReadingsReader(Reader):
    """Readings ``station`` to ``target``, reduced to means of faces and sets."""

    def read(self) -> None:
        """The whole table; its means become observations."""
        precision = None if self.precision.direction is None else self.precision
        site = self.frame.site
        self.survey = survey_of([self.raw()], precision, alone=False, site=site, known=None)

    def raw(self) -> RawFile:
        """The table as a raw file."""
        table = self.table
        recorder = Recorder(table.path, "CSV")
        stations, targets = table.names("station", self.all), table.names("target", self.all)
        setups = table.words.get("setup", [""] * len(table))
        sets = self._sets()
        faces = self._faces()
        corrected = np.all([np.isnan(table.number(name)) for name in _CORRECTIONS], axis=0)
        before: tuple[str, str, float] | None = None
        heights = np.nan_to_num(table.number("height_instrument"))
        codes = table.words.get("code", [""] * len(table))
        number = {name: table.number(name).tolist() for name in _READ}
        raised = np.nan_to_num(table.number("height_target")).tolist()
        for row in range(len(table)):
            key = (stations[row], setups[row], float(heights[row]))
            if key != before:
                recorder.setup(table.lines[row], stations[row], height=key[2])
                before = key
            recorder.prism = number["prism_constant"][row]
            recorder.ppm = number["atmosphere_ppm"][row]
            recorder.temperature_c = number["temperature_c"][row]
            recorder.pressure_hpa = number["pressure_hpa"][row]
            recorder.humidity_percent = number["humidity_percent"][row]
            try:
                recorder.shot(
                    table.lines[row],
                    targets[row],
                    direction=number["direction"][row],
                    zenith=number["zenith"][row],
                    distance=number["slope_distance"][row],
                    face=int(faces[row]),
                    height=raised[row],
                    code=codes[row],
                    applied=bool(corrected[row]),
                    series=int(sets[row]),
                    off=str(self.reason[row]) if self.use[row] else "",
                )
            except ValueError as error:
                raise table.error(row, str(error)) from error
            recorder.understood["sight"] += 1
        return replace(recorder.finish(), label=table.label)

    def _faces(self) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
        """Face of each row (n,), 0 where it follows from the zenith angle."""
        given = self.table.number("face")
        bad = np.flatnonzero(~np.isnan(given) & (given != 1) & (given != 2))
        self.table.refuse(bad, lambda row: f"face is {given[row]:g}", "give 1 or 2")
        return np.nan_to_num(given).astype(np.int64)

    def _sets(self) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
        """Number of the set of each row (n,), 0 without one."""
        words = self.table.words.get("set", [""] * len(self.table))
        names = {word: k for k, word in enumerate(dict.fromkeys(w for w in words if w), start=1)}
        return np.array([names.get(word, 0) for word in words], dtype=np.int64)
