"""What a scanner measures: targets, as vectors or as polar readings, and its own inclination."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.geodesy.plumb import PlumbLines
from tribrach.geodesy.site import FlatSite, Site
from tribrach.geometry.polar import NEAREST, POLE, polar_by_xyz, polar_from_xyz, require_defined
from tribrach.geometry.rotation import skew
from tribrach.instruments.calibration import CalibrationModel
from tribrach.observations.base import Block, Observations, per_item, refers, shared, wrap
from tribrach.observations.declaration import (
    SCANNED,
    Category,
    CsvColumns,
    End,
    KindFacts,
    Repetition,
    Role,
    StartTie,
)
from tribrach.observations.ties import ScannerShots, TieCollector, xyz_of_polar
from tribrach.observations.unknowns import State

__all__ = ["NEAREST", "POLE", "Inclinations", "ScannerPolar", "TargetCentres"]

#: a scanner with a tilt known worse than this [rad] is not levelled
_LEVELLED = 0.02


@dataclass(kw_only=True)
class TargetCentres(Observations):
    """Target centres [m] in the scanner frame, ``u = (1 + m) R^T (X - t)``, with full covariance.

    ``m`` is an optional scale unknown of the scan: its EDM's scale, or that of another system in a
    similarity transformation weighted on both sides (method sections 2.0 and 2.2).
    """

    station: Index = refers("pose", end=End.FROM)  #: (n,): poses
    target: Index = refers("position", end=End.TO)  #: (n,): positions ``X``
    #: (n,): scalars ``m``, -1 for none
    scale: Index = refers("scalar", optional=True, means="scale", unit="1")
    kind: ClassVar[str] = "target_centre"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    facts: ClassVar[KindFacts] = replace(
        SCANNED,
        title="target centre",
        computed="`R^T (X - t)`, with its full covariance",
        repeats=Repetition.SETS,
        start=StartTie.SHOT,
        csv=(CsvColumns(("station", "target"), ("x", "y", "z")),),
        names_target=True,
        common_to_stations="targets",
    )

    def predict(self, state: State) -> Array:
        """Centres (n, 3) in the scanner frame."""
        chord = state.positions[self.target] - state.pose_t[self.station]
        u: Array = np.einsum("nji,nj->ni", state.pose_r[self.station], chord)
        return (1 + state.scalar(self.scale))[:, None] * u

    def jacobian(self, state: State) -> list[Block]:
        """``R^T`` by the point, ``-R^T`` and ``R^T [X - t]x`` by the pose, u by the scale."""
        layout = state.layout
        chord = state.positions[self.target] - state.pose_t[self.station]
        factor = (1 + state.scalar(self.scale))[:, None, None]
        scanner_from_world = factor * state.pose_r[self.station].transpose(0, 2, 1)
        by_pose = np.concatenate([-scanner_from_world, scanner_from_world @ skew(chord)], axis=2)
        by_scale = np.einsum("nji,nj->ni", state.pose_r[self.station], chord)[:, :, None]
        return [
            Block(layout.position_columns(self.target), scanner_from_world),
            Block(layout.columns("pose", self.station), by_pose),
            *self.if_any(state, "scalar", self.scale, by_scale),
        ]

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Shots."""
        ties.add(ScannerShots(self.station[rows], self.target[rows], self.values[rows]))


@dataclass(kw_only=True)
class ScannerPolar(Observations):
    """Polar readings of targets: range [m], horizontal and zenith angle [rad], with calibration.

    ``h = g - Delta(g; c, k)`` with ``g = (r, H, V)`` of ``u = R^T (X - t)``: true = measured +
    Delta. H is counter-clockwise from the scanner's x axis, V the zenith angle, k the face.
    Back-face readings may be given raw, ``(r, H + pi, 2 pi - V)``, or folded to the front (method
    sections 1.2 and 2.1).
    """

    station: Index = refers("pose", end=End.FROM)  #: (n,): poses
    target: Index = refers("position", end=End.TO)  #: (n,): positions ``X``
    #: (n,): 1 front, -1 back; readings with V above pi are on the back face whatever is said
    face: Array = per_item(1.0)
    #: (n, k): scalars ``c``, the k parameters of the model; -1 where one is not used
    parameters: Index = refers("scalar", optional=True, means="calibration")
    model: CalibrationModel | None = shared()  #: of all observations of the table
    kind: ClassVar[str] = "scanner_polar"
    units: ClassVar[tuple[str, ...]] = ("m", "rad", "rad")
    components: ClassVar[tuple[str, ...]] = ("range", "horizontal", "zenith")
    angular: ClassVar[tuple[int, ...]] = (1,)
    facts: ClassVar[KindFacts] = replace(
        SCANNED,
        title="scanner polar",
        computed="range, horizontal angle (counter-clockwise), zenith angle of a target, with a "
        "calibration model",
        repeats=Repetition.SETS,
        start=StartTie.SHOT,
        csv=(CsvColumns(("station", "target"), ("range", "horizontal", "zenith")),),
        names_target=True,
        common_to_stations="targets",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        require_defined(self.values, self.source)
        self._raw = self.values[:, 2] > np.pi
        self.face = np.where(self._raw, -1.0, self.face)
        count = 0 if self.model is None else len(self.model.parameters)
        given = self.parameters.reshape(len(self), -1) if len(self) else np.empty((0, count))
        if self.model is None and (given < 0).all():
            given = given[:, :0]
        if given.shape[1] != count:
            raise InputError(
                f"{given.shape[1]} calibration parameters are given for the {count} of the model",
                record=next((s for s in self.source if s), None),
                cure="name one unknown for each parameter of the model",
            )
        self.parameters = given.astype(np.int64)

    def _geometry(self, state: State) -> tuple[Array, Array, Array]:
        """Chord in W, vector in the scanner frame, polar coordinates; (n, 3) each."""
        chord = state.positions[self.target] - state.pose_t[self.station]
        u: Array = np.einsum("nji,nj->ni", state.pose_r[self.station], chord)
        return chord, u, polar_from_xyz(u)

    def predict(self, state: State) -> Array:
        """Readings r, H, V (n, 3), raw where the measured ones are."""
        _, _, polar = self._geometry(state)
        if self.model is not None:
            polar = polar - self.model.delta(polar, self.face, state.scalar(self.parameters))
        polar[:, 1] = wrap(polar[:, 1] + np.where(self._raw, np.pi, 0.0))
        polar[:, 2] = np.where(self._raw, 2 * np.pi - polar[:, 2], polar[:, 2])
        return polar

    def folded(self) -> Array:
        """Measured values (n, 3), back-face readings folded to the front."""
        out = self.values.copy()
        out[self._raw, 1] -= np.pi
        out[self._raw, 2] = 2 * np.pi - out[self._raw, 2]
        out[:, 1] = wrap(out[:, 1])
        return out

    def parameter_columns(self, state: State, model: CalibrationModel) -> Array:
        """Derivatives (n, 3, k) of the readings by the parameters of any model, at the state."""
        _, _, polar = self._geometry(state)
        sense = np.ones((len(self), 3, 1))
        sense[self._raw, 2] = -1.0
        r, h, v = polar.T
        columns: Array = -sense * model.columns(r, h, v, self.face)
        return columns

    def jacobian(self, state: State) -> list[Block]:
        """``T Jp R^T`` by the point, ``-T Jp R^T`` and ``T Jp R^T [D]x`` by the pose, -B by c."""
        layout = state.layout
        chord, u, polar = self._geometry(state)
        # a raw zenith angle grows the other way round
        sense = np.ones((len(self), 3, 1))
        sense[self._raw, 2] = -1.0
        by_x = sense * polar_by_xyz(u) @ state.pose_r[self.station].transpose(0, 2, 1)
        blocks = []
        if self.model is not None:
            r, h, v = polar.T
            slope = self.model.derivative(polar, self.face, state.scalar(self.parameters))
            by_x = by_x - sense * slope @ (sense * by_x)
            columns = layout.columns("scalar", self.parameters)[..., 0]
            blocks.append(Block(columns, -sense * self.model.columns(r, h, v, self.face)))
        by_pose = np.concatenate([-by_x, by_x @ skew(chord)], axis=2)
        return [
            Block(layout.position_columns(self.target), by_x),
            Block(layout.columns("pose", self.station), by_pose),
            *blocks,
        ]

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Shots."""
        r, around, zenith = self.values[rows].T
        u = xyz_of_polar(r, around, np.pi / 2 - zenith)
        ties.add(ScannerShots(self.station[rows], self.target[rows], u))


@dataclass(kw_only=True)
class Inclinations(Observations):
    """Inclinations [rad] of a levelled scanner: what its compensator says of the plumb line.

    ``q = R^T g`` with the plumb line ``g = (eta, xi, 1)`` in the local axes of the station
    (deflection of the vertical, zero if unknown); observed are ``(q_x/q_z, q_y/q_z)``, zero for a
    compensated instrument, plus an optional constant offset of the inclinometer (method section
    2.9). Where the deflection itself is known with a sigma only, its error is an unknown that the
    stations share (method section 7.5).
    """

    station: Index = refers("pose", end=End.AT)  #: (n,): poses
    #: (n,): deflection of the vertical towards north and east [rad], instead of what ``plumb``
    #: knows
    xi: Array = per_item(np.nan)
    eta: Array = per_item(np.nan)
    #: (n,): scalars: constant offsets of the inclinometer, -1 for none
    offset_x: Index = refers("scalar", optional=True, means="inclination offset", unit="rad")
    offset_y: Index = refers("scalar", optional=True, means="inclination offset", unit="rad")
    #: (n,): scalars to be added to xi and eta [rad], -1 for none
    xi_error: Index = refers(
        "scalar", optional=True, means="deflection of the vertical", unit="rad"
    )
    eta_error: Index = refers(
        "scalar", optional=True, means="deflection of the vertical", unit="rad"
    )
    site: Site = field(default_factory=FlatSite)
    plumb: PlumbLines = field(default_factory=PlumbLines)
    kind: ClassVar[str] = "inclination"
    units: ClassVar[tuple[str, ...]] = ("rad", "rad")
    components: ClassVar[tuple[str, ...]] = ("x", "y")
    facts: ClassVar[KindFacts] = KindFacts(
        title="inclination",
        computed="plumb line in the scanner's frame: a levelled scanner observes zero",
        role=Role.READING,
        category=Category.OTHER,
        own_category=Category.LEVELLING,
        repeats=Repetition.SETS,
        start=StartTie.LEVELLING,
        csv=(CsvColumns(("station",), ("tilt_x", "tilt_y")),),
        levels_station=True,
    )

    def _plumb(self, state: State) -> tuple[Array, Array]:
        """Plumb line in W and in the scanner frame, (n, 3) each."""
        place = state.pose_t[self.station]
        position = state.layout.count("point") + self.station
        known = self.plumb.deflection(self.site, position, place)
        xi = np.where(np.isnan(self.xi), known[:, 0], self.xi) + state.scalar(self.xi_error)
        eta = np.where(np.isnan(self.eta), known[:, 1], self.eta) + state.scalar(self.eta_error)
        local = np.stack([eta, xi, np.ones(len(self))], axis=1)
        axes = self.site.axes(place)
        g = np.einsum("nij,ni->nj", axes, local)
        return g, np.einsum("nji,nj->ni", state.pose_r[self.station], g)

    def predict(self, state: State) -> Array:
        """Inclinations (n, 2)."""
        _, q = self._plumb(state)
        offset = np.stack([state.scalar(self.offset_x), state.scalar(self.offset_y)], axis=1)
        return q[:, :2] / q[:, 2:] + offset

    def jacobian(self, state: State) -> list[Block]:
        """By the rotation ``P R^T [g]x``; by the position through the turn of the vertical."""
        layout = state.layout
        g, q = self._plumb(state)
        project = np.zeros((len(self), 2, 3))
        project[:, 0, 0] = project[:, 1, 1] = 1 / q[:, 2]
        project[:, :, 2] = -q[:, :2] / q[:, 2:] ** 2
        by_g = project @ state.pose_r[self.station].transpose(0, 2, 1)
        by_turn = by_g @ skew(g)
        # a turned vertical is the opposite of a turned instrument
        by_t = -by_turn @ self.site.turn(state.pose_t[self.station])
        values = np.concatenate([by_t, by_turn], axis=2)
        blocks = [Block(layout.columns("pose", self.station), values)]
        for row, index in enumerate((self.offset_x, self.offset_y)):
            unit = np.zeros((len(self), 2, 1))
            unit[:, row] = 1.0
            blocks += self.if_any(state, "scalar", index, unit)
        by_local = by_g @ self.site.axes(state.pose_t[self.station]).transpose(0, 2, 1)
        for axis, index in enumerate((self.eta_error, self.xi_error)):
            blocks += self.if_any(state, "scalar", index, by_local[:, :, axis, None])
        return blocks

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """The shortest turn that brings the plumb line (i_x, i_y, 1) onto the third axis."""
        rows = rows[self.sigma[rows].max(axis=1) < _LEVELLED]
        q = np.concatenate([self.values[rows], np.ones((len(rows), 1))], axis=1)
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        half = q + np.array([0.0, 0.0, 1.0])
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        # a half turn about the bisector, then one about the axis itself
        turn = 2 * half[:, :, None] * half[:, None, :] - np.eye(3)
        ties.levelling[self.station[rows]] = np.diag([-1.0, -1.0, 1.0]) @ turn
