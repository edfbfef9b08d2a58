"""Models of transformations from system A to system B, and their derivatives.

``b = shift + M (a - centre)``: the shift is the image of the centre of the fitted points, so that
coordinates of any size lose no digits. ``M = R diag(factors)`` with factors along the axes of A; an
affine M is free. Increments of a rotation are left ones, about the axes of B. Metres, radians.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry import rotation as turns
from tribrach.geometry.alignment import kabsch, planar, umeyama

_AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Model:
    """What a transformation may change."""

    count: int  #: number of parameters
    dimension: int  #: 3 in space, 2 in the plane
    words: str  #: the model in words
    #: ``none``, ``heading`` about the vertical, ``free``, or ``affine``
    turn: Literal["none", "heading", "free", "affine"]
    #: ``none``, ``one``, or one along each of the ``axes`` of A
    scales: Literal["none", "one", "axes"] = "none"

    @property
    def parameters(self) -> tuple[tuple[str, str], ...]:
        """Names and units of the parameters, in the order of every covariance."""
        axes = _AXES[: self.dimension]
        out = [(f"shift {a}", "m") for a in axes]
        if self.turn == "affine":
            return (*out, *((f"element {b}{a}", "1") for b in axes for a in axes))
        if self.turn == "free":
            out += [(f"rotation about {a}", "rad") for a in axes]
        elif self.turn == "heading":
            out.append(("rotation", "rad"))
        if self.scales == "one":
            out.append(("scale", "1"))
        elif self.scales == "axes":
            out += [(f"scale {a}", "1") for a in axes]
        return tuple(out)

    @property
    def least(self) -> str:
        """How many common points it takes, in words."""
        if self.dimension == 2:
            return {"none": "one point", "heading": "two points"}.get(
                self.turn, "three points that are not on one line"
            )
        if self.turn == "affine" or self.scales == "axes":
            return "four points that are not in one plane"
        few = {"none": "one point", "heading": "two points that are not on one plumb line"}
        return few.get(self.turn, "three points that are not on one line")


#: all models, in space and in the plane, from the stiffest to the richest
MODELS = (
    Model(3, 3, "three shifts", "none"),
    Model(4, 3, "three shifts and a turn about the vertical", "heading"),
    Model(6, 3, "rigid motion", "free"),
    Model(7, 3, "similarity: rigid motion and one scale", "free", "one"),
    Model(9, 3, "rigid motion and a scale along each axis of A", "free", "axes"),
    Model(12, 3, "affine transformation", "affine"),
    Model(3, 2, "rigid motion in the plane", "heading"),
    Model(4, 2, "similarity in the plane: rigid motion and one scale", "heading", "one"),
    Model(6, 2, "affine transformation in the plane", "affine"),
)


def find_model(count: int, dimension: int) -> Model:
    """Find the model with so many parameters."""
    for model in MODELS:
        if (model.count, model.dimension) == (count, dimension):
            return model
    if dimension not in (2, 3):
        raise InputError(f"there is no transformation in {dimension} dimensions")
    known = ", ".join(str(m.count) for m in MODELS if m.dimension == dimension)
    where = "in space" if dimension == 3 else "in the plane (the points have no heights)"
    raise InputError(
        f"there is no transformation with {count} parameters {where}", cure=f"use one of {known}"
    )


@dataclass(frozen=True, eq=False)
class Transformation:
    """``b = shift + matrix @ (a - centre)``."""

    model: Model  #: what may change
    #: (d,), centre of the fitted points in A, and its image in B [m]
    centre: Array
    shift: Array
    rotation: Array  #: (d, d), rotation from A to B
    factors: Array  #: (d,), scales along the axes of A
    affine: Array | None = None  #: (d, d), the linear part of an affine transformation, else None

    @property
    def matrix(self) -> Array:
        """Linear part (d, d)."""
        return self.rotation * self.factors if self.affine is None else self.affine

    def __call__(self, a: Array) -> Array:
        """Points (n, d) of A in B."""
        out: Array = self.shift + (a - self.centre) @ self.matrix.T
        return out

    def back(self, b: Array) -> Array:
        """Points (n, d) of B in A."""
        out: Array = self.centre + np.linalg.solve(self.matrix, (b - self.shift).T).T
        return out

    @property
    def at_origin(self) -> Array:
        """The translation (d,): image of the origin of A."""
        out: Array = self.shift - self.matrix @ self.centre
        return out

    def jacobian(self, a: Array) -> Array:
        """Derivatives (n, d, count) of the points (n, d) in B by the parameters."""
        d = self.model.dimension
        out = np.zeros((len(a), d, self.model.count))
        out[:, :, :d] = np.eye(d)
        local = a - self.centre
        if self.model.turn == "affine":
            for row in range(d):
                out[:, row, d * (row + 1) : d * (row + 2)] = local
            return out
        k, moved = d, local @ self.matrix.T
        if self.model.turn == "free":
            out[:, :, k : k + 3] = -turns.skew(moved)
            k += 3
        elif self.model.turn == "heading":
            out[:, 0, k], out[:, 1, k] = -moved[:, 1], moved[:, 0]
            k += 1
        if self.model.scales == "one":
            out[:, :, k] = local @ self.rotation.T
        elif self.model.scales == "axes":
            out[:, :, k:] = self.rotation[None] * local[:, None, :]
        return out

    def moved(self, step: Array) -> Transformation:
        """Changed by parameters (count,): shifts, left rotation increments, scales or elements."""
        d = self.model.dimension
        shift, k = self.shift + step[:d], d
        if self.affine is not None:
            return replace(self, shift=shift, affine=self.affine + step[d:].reshape(d, d))
        turned = self.rotation
        if self.model.turn == "free":
            turned, k = turns.exp(step[k : k + 3]) @ turned, k + 3
        elif self.model.turn == "heading":
            c, s = np.cos(step[k]), np.sin(step[k])
            about = np.eye(d)
            about[:2, :2] = [[c, -s], [s, c]]
            turned, k = about @ turned, k + 1
        scaled = self.factors if self.model.scales == "none" else self.factors + step[k:]
        return replace(self, shift=shift, rotation=turned, factors=scaled)

    @property
    def values(self) -> Array:
        """Parameters (count,): shift of the centre, rotation vector or angle, scales, elements."""
        parts = [self.shift]
        if self.affine is not None:
            return np.concatenate([self.shift, self.affine.ravel()])
        if self.model.turn == "free":
            parts.append(turns.log(self.rotation))
        elif self.model.turn == "heading":
            parts.append(np.array([np.arctan2(self.rotation[1, 0], self.rotation[0, 0])]))
        if self.model.scales != "none":
            parts.append(self.factors[:1] if self.model.scales == "one" else self.factors)
        return np.concatenate(parts)


def start(model: Model, a: Array, b: Array) -> Transformation:
    """Closed-form transformation of equally weighted points ``a``, ``b`` (n, d) [m]."""
    d, centre, shift = model.dimension, a.mean(axis=0), b.mean(axis=0)
    plain = Transformation(model, centre, shift, np.eye(d), np.ones(d))
    needed = InputError(
        f"the transformation with {model.count} parameters needs {model.least}, there "
        + (f"are {len(a)} common points" if len(a) != 1 else "is one common point"),
        cure="give more common points, or a model with fewer parameters",
    )
    if len(a) * d < model.count:
        raise needed
    la, lb = a - centre, b - shift
    if model.turn == "none":
        return plain
    try:
        if model.turn == "heading":
            alignment = (
                umeyama(la[:, :2], lb[:, :2])
                if model.scales == "one"
                else planar(la[:, :2], lb[:, :2])
            )
            turned = np.eye(d)
            turned[:2, :2] = alignment.rotation
            return replace(plain, rotation=turned, factors=np.full(d, alignment.scale))
        if model.turn == "affine" or model.scales == "axes":
            linear = _linear(la, lb)
            if linear is None:
                raise needed
            if model.turn == "affine":
                return replace(plain, affine=linear)
            u, _, vt = np.linalg.svd(linear / np.linalg.norm(linear, axis=0))
            sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
            factors: Array = np.linalg.norm(linear, axis=0).astype(np.float64)
            return replace(plain, rotation=(u * sign) @ vt, factors=factors)
        alignment = umeyama(la, lb) if model.scales == "one" else kabsch(la, lb)
    except InputError:
        raise needed from None
    return replace(plain, rotation=alignment.rotation, factors=np.full(d, alignment.scale))


def _linear(a: Array, b: Array) -> Array | None:
    """Affine matrix of centred points; None where they are flat."""
    spread = np.linalg.svd(a, compute_uv=False)
    if len(a) <= a.shape[1] or spread[-1] <= 1e-6 * spread[0]:
        return None
    solved: Array = np.linalg.lstsq(a, b, rcond=None)[0].T.astype(np.float64)
    return solved
