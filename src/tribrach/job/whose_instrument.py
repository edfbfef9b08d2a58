"""Whose instrument: the one rule for a scan, a station and an observation.

A scanner station has one instrument. It is the one that the section ``[stations.NAME]`` names, or
the entry of ``[[scans]]`` or ``[[observations]]`` whose readings were taken there; where none of
them names one, it is the only instrument of the project, or the only one that has the figures of a
scanner. Two sections that name different instruments for one station are an error. A planned
station takes the instrument of ``[plan]`` before the only one. Observations that are not of a
scanner have the instrument of their entry, or the only one of the project.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from tribrach.errors import InputError, among
from tribrach.instruments.common_errors import CommonErrors
from tribrach.instruments.precision import Precision
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.project import Instrument, Project

Keys = tuple[str | int, ...]


@dataclass(frozen=True)
class _Claim:
    """A section that names the instrument of a station."""

    instrument: str
    keys: Keys

    @property
    def section(self) -> str:
        """The section as it stands in the file, such as ``[stations.S1]``."""
        first, second = self.keys[:2]
        return f"[[{first}]]" if isinstance(second, int) else f"[{first}.{second}]"


class Instruments:
    """A project's instruments and their uses; :meth:`learn` adds what only files tell."""

    def __init__(self, project: Project) -> None:
        self.project = project
        self._claims: dict[str, _Claim] = {}
        for name, station in project.stations.items():
            if station.instrument is not None:
                self.learn([name], station.instrument, ("stations", name, "instrument"))
        for k, entry in enumerate(project.scans):
            if entry.instrument is not None and entry.station is not None:
                self.learn([entry.station], entry.instrument, ("scans", k, "instrument"))

    def learn(self, stations: Iterable[str], instrument: str, keys: Keys) -> None:
        """Note what a section says about stations whose names stand in its file."""
        self._defined(instrument, keys)
        for station in stations:
            other = self._claims.setdefault(station, _Claim(instrument, keys))
            if other.instrument != instrument:
                raise self._contradiction(station, other, _Claim(instrument, keys))

    def changed(self, project: Project) -> Instruments:
        """Apply the rule to a project with other sections, of the same files."""
        out = Instruments(project)
        for station, claim in self._claims.items():
            if claim.keys[0] == "scans":
                out.learn([station], claim.instrument, claim.keys)
        return out

    def of_station(self, station: str) -> str | None:
        """Return the instrument of a scanner station."""
        claim = self._claims.get(station)
        return self._only_scanner() if claim is None else claim.instrument

    def of_planned(self, station: str | None) -> str | None:
        """Return the instrument of a planned station."""
        claim = None if station is None else self._claims.get(station)
        if claim is not None:
            return claim.instrument
        plan = self.project.plan
        if plan is None or plan.instrument is None:
            return self._only() if station is None else self._only_scanner()
        self._defined(plan.instrument, ("plan", "instrument"))
        return plan.instrument

    def of_file(self, k: int, stations: Iterable[str] = ()) -> str | None:
        """Return the instrument of an entry of ``[[observations]]``."""
        named = self.project.observations[k].instrument
        if named is not None:
            self._defined(named, ("observations", k, "instrument"))
            return named
        own = {claim.instrument for s in stations if (claim := self._claims.get(s)) is not None}
        return own.pop() if len(own) == 1 else self._only()

    def named(self, name: str) -> Instrument:
        """Return the section of an instrument."""
        return self.project.instruments[name]

    def precision(self, name: str | None) -> Precision:
        """Return the standard deviations of an instrument."""
        return Precision() if name is None else self.named(name).precision()

    def noise(self, name: str | None) -> ScanNoise | None:
        """Return the noise of single points of a scanner."""
        return None if name is None else self.named(name).noise()

    def common(self, name: str | None) -> CommonErrors | None:
        """Return what all points of a station of a scanner have in common."""
        return None if name is None else self.named(name).common(name)

    def _only(self) -> str | None:
        """The only instrument of the project."""
        names = list(self.project.instruments)
        return names[0] if len(names) == 1 else None

    def _only_scanner(self) -> str | None:
        """The only instrument, or the only one with range and angle noise."""
        scanners = [n for n, i in self.project.instruments.items() if i.noise() is not None]
        return self._only() or (scanners[0] if len(scanners) == 1 else None)

    def _defined(self, name: str, keys: Keys) -> None:
        if name not in self.project.instruments:
            cure = f"add a section [instruments.{name}]"
            if self.project.instruments:
                cure += "; " + among(name, list(self.project.instruments), "there are")
            raise self.project.error(keys, f"instrument {name} is not defined", cure)

    def _contradiction(self, station: str, one: _Claim, other: _Claim) -> InputError:
        """Two sections name different instruments for one station."""
        claims = []
        for claim in (one, other):
            line = self.project.line(claim.keys)
            where = claim.section if line is None else f"{claim.section}, line {line},"
            claims.append(f"{where} names {claim.instrument}")
        return self.project.error(
            one.keys,
            f"station {station} has two instruments: {claims[0]} and {claims[1]}",
            "name the same instrument in both, or leave one of them out",
        )
