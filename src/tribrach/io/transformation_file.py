"""Reads a fitted transformation: everything to apply it again with its covariance.

``b = shift_at_centre + matrix (a - centre)``; ``covariance`` is that of the parameters in the order
of ``parameters``. Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.json_file import read_json
from tribrach.transformation.models import Transformation, find_model
from tribrach.units import too_large

KIND = "transformation"
SCHEMA = 1


@dataclass(frozen=True, eq=False)
class StoredTransformation:
    """A transformation from a file."""

    transformation: Transformation  #: ready to be applied
    covariance: Array | None  #: (k, k): of its parameters, None if unknown
    #: degrees of freedom of the variance that it rests on, None where sigmas were given
    freedom: int | None = None


def read_transformation(path: Path) -> StoredTransformation:
    """Read a transformation that ``tribrach transform fit --json`` wrote."""
    cure = "give the file that tribrach transform fit --json wrote"
    try:
        data = read_json(path)
        if data["kind"] != KIND or data["schema"] != SCHEMA:
            raise InputError("this is no transformation of this version", file=path, cure=cure)
        model = find_model(int(data["model"]), int(data["dimension"]))
        d, k = model.dimension, model.count
        centre, shift = (_array(data[key], (d,)) for key in ("centre", "shift_at_centre"))
        rotation, matrix = (_array(data[key], (d, d)) for key in ("rotation", "matrix"))
        factors = _array(data["factors"], (d,))
        given = data["covariance"]
        covariance = None if given is None else _array(given, (k, k))
        estimated = covariance is not None and data["covariance_is"] == "posterior"
        freedom = int(data["sigma0"]["dof"]) if estimated else None
    except (ValueError, TypeError, KeyError) as error:
        raise InputError("this is no transformation", file=path, cure=cure) from error
    except InputError as error:
        raise InputError(error.what, file=path, cure=error.cure or cure) from error
    affine = matrix if model.turn == "affine" else None
    transformation = Transformation(model, centre, shift, rotation, factors, affine)
    if not np.allclose(transformation.matrix, matrix, rtol=1e-9, atol=1e-12):
        raise InputError("rotation, factors and matrix do not agree", file=path, cure=cure)
    singular = np.linalg.svd(matrix, compute_uv=False)
    if not singular[-1] > 1e-9 * singular[0]:
        raise InputError("the matrix is singular", file=path, cure=cure)
    if covariance is not None and not _proper(covariance):
        raise InputError(
            "the covariance is not symmetric and positive definite", file=path, cure=cure
        )
    if freedom is not None and freedom < 1:
        raise InputError("the redundancy is not above zero", file=path, cure=cure)
    return StoredTransformation(transformation, covariance, freedom)


def _proper(covariance: Array) -> bool:
    """True for a covariance matrix, judged in units of its own standard deviations."""
    if not covariance.any():
        # points that fit exactly leave no scatter
        return True
    if not (np.diag(covariance) > 0).all():
        return False
    sigma = np.sqrt(np.diag(covariance))
    unit = covariance / sigma[:, None] / sigma
    return bool(np.allclose(unit, unit.T, atol=1e-6) and np.linalg.eigvalsh(unit)[0] > -1e-9)


def _array(value: Any, shape: tuple[int, ...]) -> Array:
    """Finite numbers as an array of a given shape."""
    array = np.array(value, dtype=np.float64)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"not {shape} finite numbers")
    if too_large(array):
        raise InputError("a number is beyond any measurement")
    return array
