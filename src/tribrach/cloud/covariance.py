"""Propagates the covariance of every point: ``C_X = J_geo C_geo J_geo^T + J_rho C_int J_rho^T``.

``X = t + R x``; ``J_geo = [I | -[R x]x]`` for left increments; ``J_rho`` carries the noise along
and across the beam into the world (method section 5.1); a calibration adds its own share. Points
(n, 3) are in the scanner frame [m], results in the axes of the world [m^2]. The loops are compiled:
tens of millions of points per second.
"""

from __future__ import annotations

import numpy as np

from tribrach._types import Array, Single
from tribrach.cloud.calibration_share import share_of
from tribrach.cloud.placement import Placement
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.kernels import in_threads, njit


def place_with_sigmas(
    xyz: Array,
    placement: Placement,
    cosine: Array | None = None,
    intensity: Array | None = None,
) -> tuple[Array, Single]:
    """Place points in the world, with their standard deviations along its axes.

    Incidence adds nothing without cosines; a law of the noise takes intensities as in the file.
    """
    if placement.noise is None:
        raise ValueError("points without a scanner origin have no covariance")
    world, sigma = np.empty_like(xyz), np.empty(xyz.shape, dtype=np.float32)
    in_threads(
        _place,
        len(xyz),
        np.ascontiguousarray(xyz),
        np.ascontiguousarray(placement.pose.rotation),
        placement.pose.translation,
        np.ascontiguousarray(placement.covariance),
        placement.noise.parameters,
        placement.noise.lawful_sigma(intensity),
        _divisors(placement.noise, cosine),
        world,
        sigma,
    )
    if placement.calibration is not None:
        more = share_of(xyz, placement)[:, :3]
        sigma = np.sqrt(np.maximum(sigma**2 + more, 0.0)).astype(np.float32)
    return world, sigma


def _divisors(noise: ScanNoise, cosine: Array | None) -> Array:
    """Divisors of the range noise of points (n,); empty without any."""
    if cosine is None:
        return np.empty(0)
    return np.ascontiguousarray(np.asarray(cosine, dtype=np.float64) ** noise.incidence)


def sigmas(
    xyz: Array,
    placement: Placement,
    cosine: Array | None = None,
    intensity: Array | None = None,
) -> Single:
    """Sigmas (n, 3) [m] along the axes of the world."""
    return place_with_sigmas(xyz, placement, cosine, intensity)[1]


def covariances(
    xyz: Array,
    placement: Placement,
    cosine: Array | None = None,
    intensity: Array | None = None,
) -> Array:
    """Compute the covariances of points in the axes of the world: xx, yy, zz, xy, xz, yz.

    Incidence adds nothing without cosines; a law of the noise takes intensities as in the file.
    """
    if placement.noise is None:
        raise ValueError("points without a scanner origin have no covariance")
    out = np.empty((len(xyz), 6))
    in_threads(
        _covariances,
        len(xyz),
        np.ascontiguousarray(xyz),
        np.ascontiguousarray(placement.pose.rotation),
        np.ascontiguousarray(placement.covariance),
        placement.noise.parameters,
        placement.noise.lawful_sigma(intensity),
        _divisors(placement.noise, cosine),
        out,
    )
    return out if placement.calibration is None else out + share_of(xyz, placement)


def rounded(values: Single, bits: int = 10) -> Single:
    """The same values to this many binary digits of their mantissa: 10 are half a per mille.

    A sigma is never known better, and the zeros behind make the file smaller and faster.
    """
    drop = 23 - bits
    whole = values.view(np.uint32) + np.uint32(1 << (drop - 1))
    return (whole & np.uint32(0xFFFFFFFF << drop & 0xFFFFFFFF)).view(np.float32)


@njit(cache=True, fastmath=True, inline="always")
def _terms(x, y, z, noise, lawful, cosine):  # type: ignore[no-untyped-def]
    """Range and the three variances of a point: along the beam, across horizontally, vertically.

    lawful : sigma of the range by its law, negative without one. No NaN: ``fastmath`` has none.
    """
    flat2 = x * x + y * y
    rho2 = flat2 + z * z
    rho = np.sqrt(rho2)
    along = noise[0] + noise[1] * rho
    along = along * along / (cosine * cosine)
    if lawful >= 0.0:
        along = lawful * lawful
    wide = noise[4] + noise[5] * rho
    footprint = (noise[4] * noise[4] + noise[5] * noise[5] * rho2) / 16
    if noise[7] > 0.0:
        footprint = wide * wide / 16
    common = noise[6] * noise[6]
    across_h = flat2 * (noise[2] * noise[2] + common) + footprint
    across_v = rho2 * (noise[3] * noise[3] + common) + footprint
    return flat2, rho2, along, across_h, across_v


@njit(cache=True, fastmath=True, inline="always")
def _beam(x, y, z, flat2, rho2):  # type: ignore[no-untyped-def]
    """Unit vectors along the beam, horizontally and vertically across it."""
    flat, rho = np.sqrt(flat2), np.sqrt(rho2)
    if rho == 0.0:
        return 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0
    cv, sv = z / rho, flat / rho
    ch, sh = (x / flat, y / flat) if flat > 0.0 else (1.0, 0.0)
    return sv * ch, sv * sh, cv, -sh, ch, 0.0, cv * ch, cv * sh, -sv


@njit(cache=True, fastmath=True, inline="always")
def _station(i, j, p, c):  # type: ignore[no-untyped-def]
    """Element (i, j) of ``J_geo C_geo J_geo^T`` at ``p = R x``: translation, mixed, rotation."""
    # row i of -[p]x has p[k2] at column k1 and -p[k1] at column k2
    i1, i2, j1, j2 = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
    out = c[i, j]
    out += p[i2] * c[3 + i1, j] - p[i1] * c[3 + i2, j]
    out += p[j2] * c[i, 3 + j1] - p[j1] * c[i, 3 + j2]
    out += p[i2] * (p[j2] * c[3 + i1, 3 + j1] - p[j1] * c[3 + i1, 3 + j2])
    out -= p[i1] * (p[j2] * c[3 + i2, 3 + j1] - p[j1] * c[3 + i2, 3 + j2])
    return out


@njit(cache=True, fastmath=True, nogil=True)
def _place(first, last, xyz, r, t, c, noise, lawful, cosine, world, sigma):  # type: ignore[no-untyped-def]
    """World coordinates and the roots of the diagonal of ``C_X``."""
    for k in range(first, last):
        x, y, z = xyz[k, 0], xyz[k, 1], xyz[k, 2]
        by_law = lawful[k] if len(lawful) else -1.0
        slant = cosine[k] if len(cosine) else 1.0
        flat2, rho2, along, h2, v2 = _terms(x, y, z, noise, by_law, slant)
        u0, u1, u2, h0, h1, _, w0, w1, w2 = _beam(x, y, z, flat2, rho2)
        p = (
            r[0, 0] * x + r[0, 1] * y + r[0, 2] * z,
            r[1, 0] * x + r[1, 1] * y + r[1, 2] * z,
            r[2, 0] * x + r[2, 1] * y + r[2, 2] * z,
        )
        for i in range(3):
            world[k, i] = p[i] + t[i]
            a = r[i, 0] * u0 + r[i, 1] * u1 + r[i, 2] * u2
            b = r[i, 0] * h0 + r[i, 1] * h1
            d = r[i, 0] * w0 + r[i, 1] * w1 + r[i, 2] * w2
            variance = _station(i, i, p, c) + a * a * along + b * b * h2 + d * d * v2
            sigma[k, i] = np.sqrt(variance)


@njit(cache=True, fastmath=True, nogil=True)
def _covariances(first, last, xyz, r, c, noise, lawful, cosine, out):  # type: ignore[no-untyped-def]
    """All six elements of ``C_X``."""
    for k in range(first, last):
        x, y, z = xyz[k, 0], xyz[k, 1], xyz[k, 2]
        by_law = lawful[k] if len(lawful) else -1.0
        slant = cosine[k] if len(cosine) else 1.0
        flat2, rho2, along, h2, v2 = _terms(x, y, z, noise, by_law, slant)
        u0, u1, u2, h0, h1, _, w0, w1, w2 = _beam(x, y, z, flat2, rho2)
        p = (
            r[0, 0] * x + r[0, 1] * y + r[0, 2] * z,
            r[1, 0] * x + r[1, 1] * y + r[1, 2] * z,
            r[2, 0] * x + r[2, 1] * y + r[2, 2] * z,
        )
        for e in range(6):
            i = e if e < 3 else (0 if e < 5 else 1)
            j = e if e < 3 else (1 if e == 3 else 2)
            ai = r[i, 0] * u0 + r[i, 1] * u1 + r[i, 2] * u2
            aj = r[j, 0] * u0 + r[j, 1] * u1 + r[j, 2] * u2
            bi, bj = r[i, 0] * h0 + r[i, 1] * h1, r[j, 0] * h0 + r[j, 1] * h1
            di = r[i, 0] * w0 + r[i, 1] * w1 + r[i, 2] * w2
            dj = r[j, 0] * w0 + r[j, 1] * w1 + r[j, 2] * w2
            out[k, e] = _station(i, j, p, c) + ai * aj * along + bi * bj * h2 + di * dj * v2
