"""What the points of all scans of a job share: poses, calibration, range scale, refraction.

Adjusted parameters have their covariance with the poses from the network. Those of a calibration
file keep that of their file. Common errors that are no unknowns have shifted the poses as well:
they are considered (method section 5.10).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from tribrach._types import Array, Index
from tribrach.cloud.shared_part import MOST_GIVEN, GivenPart, SharedPart
from tribrach.geometry.pose import Pose
from tribrach.instruments.common_errors import COMMON, OF_INSTRUMENT
from tribrach.instruments.correction import Correction
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.calibration_file import Calibration
from tribrach.job.scans import StationScan, calibration_of, known_correction
from tribrach.network.adjustment import Adjustment
from tribrach.network.considered import Considered, influence_of
from tribrach.network.given_values import given_rows, with_given
from tribrach.observations.declaration import Role

#: no columns
_NONE = np.zeros(0, dtype=np.int64)
#: an unknown of the network by its column, a parameter of a file, a common error
_Row = tuple[str, int | str]


def shared_part(
    scans: Sequence[StationScan],
    adjustment: Adjustment,
    factor: float = 1.0,
    *,
    only: Sequence[str] | None = None,
) -> SharedPart:
    """Put together what the points of scans share."""
    wanted = [s for s in scans if only is None or s.station in only]
    rows = _Rows(adjustment, list(dict.fromkeys(scan.station for scan in wanted)))
    columns: dict[str, list[_Row]] = {}
    placed: dict[str, tuple[str, Pose, ScanNoise | None, Correction | None]] = {}
    for scan in wanted:
        correction, columns[scan.name] = rows.of_scan(scan)
        number = adjustment.layout.index("pose", scan.station)
        pose = Pose(adjustment.state.pose_r[number], adjustment.state.pose_t[number])
        noise = scan.noise if scan.origin_known else None
        placed[scan.name] = scan.station, pose, noise, correction
    return SharedPart.assembled(
        placed,
        {name: rows.numbered(at) for name, at in columns.items()},
        rows.covariance(scans, factor),
        rows.stations,
        rows.names,
        rows.given(factor),
    )


def joint_with_points(
    scans: Sequence[StationScan], adjustment: Adjustment, points: Sequence[str], factor: float = 1.0
) -> Array:
    """Joint covariance of the shared part of scans and of points of the network.

    First the rows of the shared part in their order, then three of each point, in the work frame.
    """
    rows = _Rows(adjustment, list(dict.fromkeys(scan.station for scan in scans)))
    for scan in scans:
        rows.of_scan(scan)
    columns = [adjustment.columns(name) for name in points]
    return rows.covariance(scans, factor, np.concatenate([np.zeros(0, dtype=np.int64), *columns]))


@dataclass
class _Rows:
    """Rows of the joint covariance: poses, unknowns, parameters of files, common errors."""

    adjustment: Adjustment
    stations: list[str]
    unknowns: dict[int, str] = field(default_factory=dict)
    files: dict[int, Calibration] = field(default_factory=dict)
    errors: dict[tuple[str, str], float] = field(default_factory=dict)

    def of_scan(self, scan: StationScan) -> tuple[Correction | None, list[_Row]]:
        """The model of a scan's effects, and their rows behind those of its pose."""
        layout = self.adjustment.layout
        rows: list[_Row] = [("pose", 6 * self.stations.index(scan.station) + k) for k in range(6)]
        correction = None
        calibrated = calibration_of(scan.station, self.adjustment)
        if calibrated is not None:
            model, index = calibrated
            correction = Correction(model, self.adjustment.state.scalars[index], scan.faces)
            for name, column in zip(index, layout.columns("scalar", index)[:, 0], strict=True):
                self.unknowns[int(column)] = layout.names["scalar"][name]
                rows.append(("unknown", int(column)))
        elif scan.known is not None:
            correction = known_correction(scan.known, scan.faces)
            self.files[id(scan.known)] = scan.known
            rows += [(f"file {id(scan.known)}", k) for k in range(len(scan.known.values))]
        common = scan.common
        if common is None or not common.effects:
            return correction, rows
        for effect, sigma in common.effects.items():
            owner = common.instrument if effect in OF_INSTRUMENT else scan.station
            self.errors[effect, owner] = max(sigma, self.errors.get((effect, owner), 0.0))
            rows.append((effect, owner))
        model = COMMON.select(list(common.effects))
        values = np.zeros(len(model.parameters))
        if correction is not None:
            model = correction.model.joined(model)
            values = np.concatenate([correction.values, values])
        return Correction(model, values, scan.faces), rows

    @property
    def order(self) -> dict[_Row, int]:
        """Number of each row."""
        rows: list[_Row] = [("pose", k) for k in range(6 * len(self.stations))]
        rows += [("unknown", column) for column in self.unknowns]
        rows += [(f"file {key}", k) for key, f in self.files.items() for k in range(len(f.values))]
        rows += list(self.errors)
        return {row: k for k, row in enumerate(rows)}

    def numbered(self, rows: list[_Row]) -> Index:
        """Numbers of rows."""
        order = self.order
        return np.array([order[row] for row in rows], dtype=np.int64)

    @property
    def names(self) -> list[str]:
        """What the rows behind those of the poses are."""
        files = [f"{p}({f.instrument})" for f in self.files.values() for p in f.parameters]
        return [*self.unknowns.values(), *files, *(f"{e}({owner})" for e, owner in self.errors)]

    def covariance(
        self, scans: Sequence[StationScan], factor: float, further: Index = _NONE
    ) -> Array:
        """The joint covariance of all rows, and of further columns of the network behind them."""
        adjustment = self.adjustment
        poses = [adjustment.columns(name) for name in self.stations]
        own = np.concatenate([_NONE, *poses, np.array(list(self.unknowns), dtype=np.int64)])
        columns = np.concatenate([own, further])
        count, n = len(self.order), len(own)
        # where the unknowns of the network stand among the rows
        at = np.concatenate([np.arange(n), count + np.arange(len(further))])
        out = np.zeros((count + len(further),) * 2)
        out[np.ix_(at, at)] = factor * adjustment.covariance_columns(columns, columns)
        for known in self.files.values():
            k = len(known.values)
            out[n : n + k, n : n + k] = known.covariance
            n += k
        if not self.errors:
            return out
        effects = [
            Considered(COMMON.select([effect]), _stations_with(effect, owner, scans))
            for effect, owner in self.errors
        ]
        moved = influence_of(adjustment, effects, columns)
        sizes = np.diag(np.array(list(self.errors.values())) ** 2)
        errors = np.arange(n, count)
        out[np.ix_(errors, errors)] = sizes
        out[np.ix_(at, at)] += moved @ sizes @ moved.T
        out[np.ix_(at, errors)] = moved @ sizes
        out[np.ix_(errors, at)] = (moved @ sizes).T
        return out

    def given(self, factor: float) -> GivenPart | None:
        """What the rows have to do with control and with calibrations of files (section 12.4).

        None where that would be a matrix of more than :data:`MOST_GIVEN` numbers. Scales of
        ranges and refraction are those of an instrument on its day: no other run shares them.
        """
        adjustment, count = self.adjustment, len(self.order)
        control = given_rows(adjustment, (Role.GIVEN,))
        size = len(control) + sum(len(known.values) for known in self.files.values())
        if not size or (count + size) * size > MOST_GIVEN:
            return None
        poses = [adjustment.columns(name) for name in self.stations]
        own = np.concatenate([_NONE, *poses, np.array(list(self.unknowns), dtype=np.int64)])
        n, m = len(own), len(control)
        covariance, cross = np.zeros((size, size)), np.zeros((count, size))
        at = np.array(list(control.values()), dtype=np.int64)
        moved, covariance[:m, :m] = with_given(adjustment, at, own)
        # of covariances a posteriori: the root, since both results are scaled
        cross[:n, :m] = np.sqrt(factor) * moved
        keys = list(control)
        for known in self.files.values():
            k = len(known.values)
            covariance[m : m + k, m : m + k] = known.covariance
            cross[n : n + k, m : m + k] = known.covariance
            named = zip(known.parameters, known.values.tolist(), strict=True)
            whose = f"calibration {known.model} {known.instrument} {known.serial}"
            keys += [f"{whose} {name} {value:.15g}" for name, value in named]
            n, m = n + k, m + k
        return GivenPart(tuple(keys), covariance, cross)


def _stations_with(effect: str, owner: str, scans: Sequence[StationScan]) -> set[str]:
    """Stations whose readings have an effect: those of an instrument, or one alone."""
    if effect not in OF_INSTRUMENT:
        return {owner}
    return {s.station for s in scans if s.common is not None and s.common.instrument == owner}
