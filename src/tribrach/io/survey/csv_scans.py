"""Scanner observations from a CSV file: target centres, polar observations, inclinations."""

from __future__ import annotations

import numpy as np

from tribrach.instruments.precision import beam_covariance
from tribrach.io.survey.csv_columns import COVARIANCE
from tribrach.io.survey.csv_reader import Reader
from tribrach.network.observations.inclination import Inclinations
from tribrach.network.observations.polar import NEAREST, POLE, ScannerPolar
from tribrach.network.observations.target_centre import TargetCentres

__all__ = ["InclinationReader", "PolarReader", "TargetReader"]


class _Scanned(Reader):
    """Readers of tables with scanner stations."""

    def stations(self) -> list[str]:
        """Station of each row; stations that are new are added to the survey."""
        names = self.table.names("station", self.all)
        for name, source in zip(names, self.sources, strict=True):
            if name not in self.survey.stations:
                self.survey.station(name, source=source)
        return names


class TargetReader(_Scanned):
    """Target centres x, y, z in the scanner frame."""

    def read(self) -> None:
        """All targets; the instrument's floor is added to every covariance."""
        xyz = self.table.columns("x", "y", "z")
        if self.table.has("sigma_range") or self.table.has("sigma_across"):
            sigma = self.table.columns("sigma_range", "sigma_across")
            covariance = beam_covariance(xyz, sigma[:, 0], sigma[:, 1])
        else:
            default = self.precision.of_targets(xyz)
            covariance = self.covariance(("x", "y", "z"), COVARIANCE, default)
        self.add(
            TargetCentres,
            self.all,
            values=xyz,
            covariance=covariance + self.precision.target**2 * np.eye(3),
            station=self.stations(),
            target=self.table.names("target", self.all),
        )


class PolarReader(_Scanned):
    """Range, horizontal and zenith angle in the scanner frame."""

    def read(self) -> None:
        """All polar observations.

        Raises
        ------
        InputError : nearer than 0.3 m, within half a degree of a pole, or a face not 1 or -1.
        """
        values = self.table.columns("range", "horizontal", "zenith")
        near = (values[:, 0] < NEAREST) | (np.abs(np.sin(values[:, 2])) < np.sin(POLE))
        self._refuse(near, f"the target is nearer than {NEAREST} m or within 0.5 deg of a pole")
        face = self.table.number("face")
        face = np.where(np.isnan(face), 1.0, face)
        self._refuse(np.abs(face) != 1, "face is neither 1 nor -1")
        angle = self.precision.scan_angle
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
            sigma=np.stack(sigma, axis=1),
            station=self.stations(),
            target=self.table.names("target", self.all),
            face=face,
        )

    def _refuse(self, bad: np.ndarray[tuple[int], np.dtype[np.bool_]], what: str) -> None:
        rows = np.flatnonzero(bad)
        if len(rows):
            raise self.table.error(int(rows[0]), what, "correct or remove the row")


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
