"""Scanner observations from a CSV file: targets, polar observations, inclinations, headings."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.calibration.calibrated import polar_of_centres
from tribrach.instruments.precision import beam_covariance
from tribrach.io.survey.csv.columns import COVARIANCE
from tribrach.io.survey.csv.reader import Reader, located
from tribrach.observations.headings import Headings
from tribrach.observations.scanner import NEAREST, POLE, Inclinations, ScannerPolar, TargetCentres

#: between a station and a series in the name of a set-up
SERIES = ", series "


def series_name(station: str, series: str) -> str:
    """Name of a station's set-up in a series; the station's own without one."""
    return f"{station}{SERIES}{series}" if series else station


class _Scanned(Reader):
    """Readers of tables with scanner stations."""

    def stations(self) -> list[str]:
        """Station of each row; stations that are new are added to the survey.

        A ``set`` is a series with a set-up of its own: its station has a name of its own.
        """
        names = self.table.names("station", self.all)
        sets = self.table.words.get("set", [""] * len(names))
        names = [series_name(name, one) for name, one in zip(names, sets, strict=True)]
        for name, source in zip(names, self.sources, strict=True):
            if name not in self.survey.stations:
                self.survey.station(name, source=source)
        return names

    def faces(self) -> Array:
        """Faces (n,) of 1 or -1, 1 where the cell is empty."""
        face = self.table.number("face")
        face = np.where(np.isnan(face), 1.0, face)
        self.refuse(np.abs(face) != 1, "face is neither 1 nor -1")
        return face

    def refuse(self, bad: NDArray[np.bool_], what: str) -> None:
        """Refuse the bad rows (n,)."""
        self.table.refuse(np.flatnonzero(bad), what, "correct or remove the row")


class TargetReader(_Scanned):
    """Target centres x, y, z in the scanner frame."""

    def read(self) -> None:
        """All targets; the instrument's floor is added to every covariance.

        Where the face is given they are readings of a scanner that is to be calibrated: range,
        horizontal and zenith angle.
        """
        xyz = self.table.columns("x", "y", "z")
        if self.table.has("sigma_range") or self.table.has("sigma_across"):
            sigma = self.table.columns("sigma_range", "sigma_across")
            covariance = beam_covariance(xyz, sigma[:, 0], sigma[:, 1])
        else:
            default = self.precision.of_targets(xyz)
            covariance = self.covariance(("x", "y", "z"), COVARIANCE, default)
        covariance = covariance + self.precision.target**2 * np.eye(3)
        targets = self.table.names("target", self.all)
        ends: dict[str, Any] = {"station": self.stations(), "target": targets}
        if not self.table.has("face"):
            self.add(TargetCentres, self.all, values=xyz, covariance=covariance, **ends)
            return
        face = self.faces()
        with located(self.table.path):
            polar, covariance = polar_of_centres(xyz, covariance, list(self.sources))
        self.add(ScannerPolar, self.all, values=polar, covariance=covariance, face=face, **ends)


class PolarReader(_Scanned):
    """Range, horizontal and zenith angle in the scanner frame."""

    def read(self) -> None:
        """All polar observations; the instrument's floor is added to every sigma."""
        values = self.table.columns("range", "horizontal", "zenith")
        near = (values[:, 0] < NEAREST) | (np.abs(np.sin(values[:, 2])) < np.sin(POLE))
        self.refuse(near, f"the target is nearer than {NEAREST} m or within 0.5 deg of a pole")
        face = self.faces()
        angle = self.precision.of_scan_angle()
        angles = None if angle is None else np.full(len(values), angle)
        sigma = [
            self.sigma(("sigma_range",), self.all, lambda: self.precision.of_ranges(values[:, 0])),
            self.sigma(("sigma_horizontal",), self.all, lambda: angles),
            self.sigma(("sigma_zenith",), self.all, lambda: angles),
        ]
        self.add(
            ScannerPolar,
            self.all,
            values=values,
            sigma=self.precision.with_floor(values, np.stack(sigma, axis=1)),
            station=self.stations(),
            target=self.table.names("target", self.all),
            face=face,
        )


class InclinationReader(_Scanned):
    """Compensator or inclinometer readings of scanner stations."""

    def read(self) -> None:
        """All inclinations, one sigma for both components."""
        tilt = self.precision.tilt
        tilts = None if tilt is None else np.full(len(self.all), tilt)
        sigma = self.sigma(("sigma_tilt",), self.all, lambda: tilts)
        self.add(
            Inclinations,
            self.all,
            values=self.table.columns("tilt_x", "tilt_y"),
            sigma=np.stack([sigma, sigma], axis=1),
            station=self.stations(),
        )


class HeadingReader(_Scanned):
    """Headings of the x axis of scanners, or of the one that the column axis names."""

    def read(self) -> None:
        """All headings."""
        axis = np.array(self.table.words.get("axis", [""] * len(self.all)), dtype=object)
        self.refuse(~np.isin(axis, ("", "x", "y")), "axis is neither x nor y")
        compass = self.precision.compass
        default = None if compass is None else np.full(len(self.all), compass)
        self.add(
            Headings,
            self.all,
            values=self.table.columns("heading"),
            sigma=self.sigma(("sigma_heading",), self.all, lambda: default)[:, None],
            station=self.stations(),
            direction=np.where(axis == "y", np.pi / 2, 0.0),
        )
