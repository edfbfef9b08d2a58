"""Targets on a telescope that turns about two axes, and the readings of its circles.

The invariant point ``X_0`` of a radio telescope or a laser ranging station is the point of its
azimuth axis that is closest to its elevation axis. A target that is fixed to the dish at ``p`` (the
frame of the dish at elevation zero: x along the elevation axis, y towards where it looks, z up)
stands, at the azimuth ``A`` and the elevation ``E``, at

    ``X = X_0 + L^T T(a, b) R(A) ( e y + G(g) R(E) p )``

with the axes ``L`` of the place at ``X_0``, the tilt ``T`` of the azimuth axis towards east and
north, the axis offset ``e`` and the skew ``g`` of the elevation axis (its deviation from a right
angle). Any number of targets in any positions of the dish therefore share eight numbers (method
section 2.13; Lösler 2009).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.geodesy.site import FlatSite, Site
from tribrach.geometry.rotation import exp, right_jacobian_inverse, skew
from tribrach.observations.base import Block, Observations, refers, wrap
from tribrach.observations.declaration import (
    Category,
    CsvColumns,
    End,
    KindFacts,
    ObservedAxes,
    Role,
    StartTie,
)
from tribrach.observations.unknowns import State

#: headings of the azimuth circle that are tried for a start, and fewest targets of a telescope
_HEADINGS, _FEWEST = 24, 4


@dataclass(kw_only=True)
class TelescopeTargets(Observations):
    """Targets on a telescope less where its axes carry them [m], ``0 = X - X_0 - L^T T r``.

    Values are zero; the covariance says how well the structure is the rigid one of the model, along
    E, N, U of W.
    """

    #: (n,): positions ``X_0``, the invariant point
    reference: Index = refers("position", end=End.FROM)
    #: (n,): positions ``X``, of one target in one position of the dish
    point: Index = refers("position", end=End.TO)
    #: (n,): vectors ``p``, the target in the frame of the dish
    body: Index = refers("vector", means="target on a telescope")
    #: (n,): scalars ``A``, clockwise from north, and ``E``, upwards
    azimuth: Index = refers("scalar", means="azimuth of a telescope", unit="rad")
    elevation: Index = refers("scalar", means="elevation of a telescope", unit="rad")
    #: (n,): scalars: how the azimuth axis leans
    tilt_east: Index = refers("scalar", means="tilt of the azimuth axis", unit="rad")
    tilt_north: Index = refers("scalar", means="tilt of the azimuth axis", unit="rad")
    #: (n,): scalars ``e``, positive where the elevation axis is ahead of the azimuth axis
    axis_offset: Index = refers("scalar", means="axis offset", unit="m")
    #: (n,): scalars ``g``, positive where the right end of the elevation axis is high
    axis_skew: Index = refers("scalar", means="non-orthogonality of the axes", unit="rad")
    site: Site = field(default_factory=FlatSite)  #: verticals of the place
    kind: ClassVar[str] = "telescope_target"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")
    facts: ClassVar[KindFacts] = KindFacts(
        title="telescope target",
        computed="target on a telescope less where its two axes carry it from the invariant point",
        role=Role.CONDITION,
        category=Category.OTHER,
        csv=(CsvColumns(("telescope", "target", "point"), ()),),
    )

    def _tilt(self, state: State) -> Array:
        """Turn (n, 3) [rad] that leans the third axis by the tilts."""
        a, b = state.scalar(self.tilt_east), state.scalar(self.tilt_north)
        return np.stack([-b, a, np.zeros(len(a))], axis=1)

    def _dish(self, state: State) -> tuple[Array, Array]:
        """``R(E) p`` and ``G R(E) p``, (n, 3) each."""
        x, y, z = state.vectors[self.body].T
        c, s = np.cos(state.scalar(self.elevation)), np.sin(state.scalar(self.elevation))
        raised = np.stack([x, y * c - z * s, y * s + z * c], axis=1)
        return raised, _skewed(raised, state.scalar(self.axis_skew))

    def _arm(self, state: State) -> tuple[Array, Array, Array]:
        """``r`` in the frame of the azimuth axis, ``T r`` along E, N, U of the place, and in W."""
        _, dish = self._dish(state)
        dish[:, 1] += state.scalar(self.axis_offset)
        turned = _clockwise(dish, state.scalar(self.azimuth))
        local = np.einsum("nij,nj->ni", exp(self._tilt(state)), turned)
        axes = self.site.axes(state.positions[self.reference])
        return turned, local, np.einsum("nji,nj->ni", axes, local)

    def predict(self, state: State) -> Array:
        """Targets relative to where the axes carry them, (n, 3)."""
        x = state.positions
        _, _, arm = self._arm(state)
        gap: Array = x[self.point] - x[self.reference] - arm
        return gap

    def jacobian(self, state: State) -> list[Block]:
        """Identity by the target, its opposite by the invariant point, the chain by the axes."""
        layout = state.layout
        raised, dish = self._dish(state)
        turned, local, arm = self._arm(state)
        azimuth = state.scalar(self.azimuth)
        x = state.positions[self.reference]
        to_w = self.site.axes(x).transpose(0, 2, 1)
        tilt = self._tilt(state)
        leaning = to_w @ exp(tilt)
        zero, one = np.zeros(len(self)), np.ones(len(self))

        def of_dish(vector: Array) -> Array:
            """What moving a target on the dish (n, 3) does to the value, (n, 3, 1)."""
            return -(leaning @ _clockwise(vector, azimuth)[:, :, None])

        def scalar(index: Index, values: Array) -> Block:
            return Block(layout.columns("scalar", index), values)

        by_azimuth = np.stack([turned[:, 1], -turned[:, 0], zero], axis=1)
        lift = np.stack([zero, -raised[:, 2], raised[:, 1]], axis=1)
        angle = state.scalar(self.axis_skew)
        skewing = np.stack([-dish[:, 2], zero, dish[:, 0]], axis=1)
        left = np.linalg.inv(right_jacobian_inverse(tilt).transpose(0, 2, 1))
        by_tilt = to_w @ skew(local) @ left
        eye = np.broadcast_to(np.eye(3), (len(self), 3, 3))
        c, s = np.cos(state.scalar(self.elevation)), np.sin(state.scalar(self.elevation))
        bodies = (
            np.stack([one, zero, zero], axis=1),
            np.stack([zero, c, s], axis=1),
            np.stack([zero, -s, c], axis=1),
        )
        by_body = np.concatenate([of_dish(_skewed(b, angle)) for b in bodies], axis=2)
        return [
            Block(layout.position_columns(self.point), eye),
            Block(
                layout.position_columns(self.reference),
                # moving the invariant point turns the axes of its place
                skew(arm) @ self.site.turn(x) - eye,
            ),
            Block(layout.columns("vector", self.body), by_body),
            scalar(self.azimuth, -(leaning @ by_azimuth[:, :, None])),
            scalar(self.elevation, of_dish(_skewed(lift, angle))),
            scalar(self.tilt_east, by_tilt[:, :, 1:2]),
            scalar(self.tilt_north, -by_tilt[:, :, 0:1]),
            scalar(self.axis_offset, of_dish(np.stack([zero, one, zero], axis=1))),
            scalar(self.axis_skew, of_dish(skewing)),
        ]

    def from_places(self, rows: Index, state: State, given: State) -> State:
        """The telescopes of which no target on the dish is given, from where targets stand.

        With plumb axes at a right angle and circles of one unknown heading the model is linear in
        everything else; the heading is the one that fits best.
        """
        for one in np.unique(self.reference[rows]):
            members = rows[self.reference[rows] == one]
            members = members[np.isfinite(state.positions[self.point[members]]).all(axis=1)]
            if given.vectors[self.body[members]].any() or len(members) < _FEWEST:
                continue
            state = self._started(members, state, given)
        return state

    def _started(self, rows: Index, state: State, given: State) -> State:
        """The state with one telescope, from its located targets (k,)."""
        middle = state.positions[self.point[rows]].mean(axis=0)
        axes = self.site.axes(middle[None])[0]
        local = (state.positions[self.point[rows]] - middle) @ axes.T
        bodies, body = np.unique(self.body[rows], return_inverse=True)
        azimuth, elevation = state.scalar(self.azimuth[rows]), state.scalar(self.elevation[rows])

        def fit(heading: float) -> tuple[float, Array]:
            return _linear_fit(local, body, azimuth + heading, elevation)

        # few networks have telescopes, and all would wait for the optimizers of scipy
        from scipy.optimize import minimize_scalar

        step = 2 * np.pi / _HEADINGS
        best = min((step * k for k in range(_HEADINGS)), key=lambda h: fit(h)[0])
        found = minimize_scalar(
            lambda h: fit(h)[0], bounds=(best - step, best + step), method="bounded"
        )
        heading = float(found.x)
        _, solution = fit(heading)
        scalars, vectors, points = state.scalars.copy(), state.vectors.copy(), state.points.copy()
        dials = np.unique(self.azimuth[rows])
        scalars[dials] = wrap(scalars[dials] + heading)
        offset = self.axis_offset[rows[0]]
        if np.isnan(given.scalars[offset]):
            scalars[offset] = solution[3]
        vectors[bodies] = solution[4:].reshape(-1, 3)
        reference = int(self.reference[rows[0]])
        if reference < len(points) and np.isnan(points[reference]).any():
            points[reference] = middle + axes.T @ solution[:3]
        return replace(state, scalars=scalars, vectors=vectors, points=points)


def _skewed(vector: Array, angle: Array) -> Array:
    """``G(g)``: vectors (n, 3) turned about y, x upwards."""
    x, y, z = vector.T
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([x * c - z * s, y, x * s + z * c], axis=1)


def _clockwise(vector: Array, angle: Array) -> Array:
    """``R(A)``: vectors (n, 3) turned about z, y towards x."""
    x, y, z = vector.T
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([x * c + y * s, y * c - x * s, z], axis=1)


def _linear_fit(local: Array, body: Index, azimuth: Array, elevation: Array) -> tuple[float, Array]:
    """Sum of squares, and ``X_0, e, p_1, p_2, ...`` of plumb axes at a right angle."""
    n, count = len(local), int(body.max()) + 1
    zero, one = np.zeros(n), np.ones(n)
    c, s = np.cos(elevation), np.sin(elevation)
    design = np.zeros((n, 3, 4 + 3 * count))
    design[:, :, :3] = np.eye(3)
    ahead = _clockwise(np.stack([zero, one, zero], axis=1), azimuth)
    design[:, :, 3] = ahead
    columns = ((one, zero, zero), (zero, c, s), (zero, -s, c))
    for k, column in enumerate(columns):
        turned = _clockwise(np.stack(column, axis=1), azimuth)
        np.put_along_axis(
            design, (4 + 3 * body + k)[:, None, None].repeat(3, axis=1), turned[:, :, None], axis=2
        )
    flat = design.reshape(3 * n, -1)
    solution: Array = np.asarray(np.linalg.lstsq(flat, local.ravel(), rcond=1e-9)[0], dtype=float)
    residual = flat @ solution - local.ravel()
    return float(residual @ residual), solution


@dataclass(kw_only=True)
class CircleReadings(Observations):
    """Readings [rad] of the circles of a telescope, its angle less the circle's zero."""

    #: (n,): scalars: azimuth or elevation of the dish (method section 2.13)
    angle: Index = refers("scalar", end=End.AT)
    #: (n,): scalars: azimuth of the circle's zero, -1 for none
    zero: Index = refers("scalar", optional=True, means="zero of a circle", unit="rad")
    kind: ClassVar[str] = "circle_reading"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    angular: ClassVar[tuple[int, ...]] = (0,)
    facts: ClassVar[KindFacts] = KindFacts(
        title="circle reading",
        computed="azimuth or elevation of a telescope less the zero of its circle",
        role=Role.READING,
        category=Category.OTHER,
        axes=ObservedAxes.NONE,
        start=StartTie.VALUE,
        full_circle=True,
    )

    def predict(self, state: State) -> Array:
        """Readings (n, 1) in (-pi, pi]."""
        return wrap(state.scalars[self.angle] - state.scalar(self.zero))[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """1 by the angle, -1 by the zero."""
        one = np.ones((len(self), 1, 1))
        by_angle = Block(state.layout.columns("scalar", self.angle), one)
        return [by_angle, *self.if_any(state, "scalar", self.zero, -one)]

    def from_places(self, rows: Index, state: State, given: State) -> State:
        """Zeros that are not given, from the angles that the targets gave."""
        scalars = state.scalars.copy()
        for zero in np.unique(self.zero[rows]):
            if zero < 0 or np.isfinite(given.scalars[zero]):
                continue
            members = rows[self.zero[rows] == zero]
            off = scalars[self.angle[members]] - self.values[members, 0]
            scalars[zero] = np.angle(np.exp(1j * off).mean())
        return replace(state, scalars=scalars)
