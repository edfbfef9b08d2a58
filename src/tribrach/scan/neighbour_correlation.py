"""Estimates from residuals on planar patches what neighbouring points of a scan share.

Products of residuals at each lag of rows and columns tell how ranges are correlated (method section
5.7). Residuals of a fit are not the errors: a plane takes up part of what neighbours share, and
makes independent ones look unlike each other, neighbours by -0.08 in windows of six by six.
With the projector M that takes surfaces of the degree of the fit out of a patch, errors with the
covariance ``C = s^2 Sigma_m r_m S_m`` (S_m: ones for all pairs at the lag m) leave residuals with
``E[v^T S_l v] = s^2 Sigma_m r_m tr(M S_l M S_m)``, in closed form for every pattern of points. The
sums over all patches are fitted by share and width of the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import fft
from scipy.optimize import nnls

from tribrach._types import Array, Index, Mask
from tribrach.answers import Number, Result
from tribrach.errors import InputError
from tribrach.instruments.neighbours import RangeCorrelation, overlap_share
from tribrach.scan.noise_law import FittedNoise
from tribrach.sentences import Sentence


@dataclass(frozen=True)
class CorrelationGates:
    """What the correlation of neighbours is estimated from.

    Chosen on simulated grids (test_neighbour_correlation uses other seeds).
    """

    #: patches that are looked at, at most, spread over all; rows and columns of one, at most
    patches: int = 300
    window: int = 16
    #: a patch has so many points at least, above the number of unknowns of its surface
    fewest: int = 18
    fewest_patches: int = 8  #: patches that tell a correlation, at least
    lag: int = 5  #: lags along rows and columns at most
    widths: int = 14  #: widths that are tried, over the shorter pitch and the patch
    groups: int = 20  #: groups of patches whose scatter gives the sigma of the share
    #: a share is told from none if it explains so much more of the weighted squares: chance does so
    #: in less than one of a hundred scans, the best of all widths taken
    told: float = 12.0


GATES = CorrelationGates()

#: lags that are looked at, rows and columns, to either side alike
_LAGS = [(a, b) for a in range(GATES.lag + 1) for b in range(GATES.lag + 1)]
#: those of different points, the nearest first
_LISTED = sorted(range(1, len(_LAGS)), key=lambda k: (sum(x * x for x in _LAGS[k]), -_LAGS[k][0]))


@dataclass(frozen=True, eq=False)
class NeighbourCorrelation(
    Result,
    without=(
        "widest", "pitch", "lags", "correlation", "correlation_sigma", "lost", "points", "patches",
    ),
):  # fmt: skip
    """What neighbouring points of a scan share of the variance of their ranges."""

    #: share of the range variance, and its standard deviation
    share: Number
    sigma: Number
    #: diameter of the discs whose overlap it goes with [rad]; zero if nothing was told
    angle: Number
    widest: float  #: the widest discs that were tried, as large as the patches [rad]
    pitch: Array  #: median angles (2,) from row to row and from column to column [rad]
    lags: Index  #: rows and columns (k, 2) from one point to another, the nearest along both first
    #: correlations at these lags, free of what the surfaces take up, and their sigmas
    correlation: Array
    correlation_sigma: Array
    lost: float  #: variance that the errors have over what residuals of single patches say
    #: what it rests on
    points: int
    patches: int

    @property
    def told(self) -> bool:
        """True if the points tell a share from none."""
        return self.angle > 0

    @property
    def factor(self) -> float:
        """Points that count as one in a wide mean at the pitches of these patches."""
        if not self.told:
            return 1.0
        return RangeCorrelation(self.share, self.angle).factor(*self.pitch.tolist())

    @property
    def nearest(self) -> tuple[float, float]:
        """Correlations of points that are next to each other along a column and along a row."""
        return float(self.correlation[0]), float(self.correlation[1])

    @property
    def keys(self) -> dict[str, float]:
        """Figures for an instrument file, in the units of their keys."""
        return {
            "shared_share": round(self.share, 3),
            "shared_angle_mrad": float(f"{1e3 * self.angle:.3g}"),
        }

    def sentence(self) -> str:
        """The estimate in words."""
        from_row, from_column = self.nearest
        more = " or more" if self.angle >= self.widest else ""
        seen = f"{self.points} points on {self.patches} patches"
        if not self.told:
            first, second = self.correlation_sigma[:2]
            return Sentence(
                "{seen} show nothing that neighbours share: correlation {from_row:2} (sigma "
                "{first:2}) from row to row and {from_column:2} ({second:2}) from column to "
                "column",
                seen=seen,
                from_row=from_row,
                first=first,
                from_column=from_column,
                second=second,
            )
        return Sentence(
            "neighbours share {own.share:2} (sigma {own.sigma:2}) of the variance of "
            "ranges over {angle:g2} mrad{more}, by {seen}: correlation {from_row:2} from "
            "row to row and {from_column:2} from column to column, so that {own.factor:1} "
            "points count as one",
            own=self,
            angle=1000.0 * self.angle,
            more=more,
            seen=seen,
            from_row=from_row,
            from_column=from_column,
        )


def neighbour_correlation(
    residuals: Array,
    rows: Index,
    columns: Index,
    patch: Index,
    pitch: Array,
    *,
    degree: int = 2,
) -> NeighbourCorrelation | None:
    """Estimate the correlation of neighbouring points from residuals on patches.

    ``residuals`` are along the beams, of fits of a surface to each patch [m]; ``patch`` numbers
    ascend; ``pitch`` are the angles from row to row and from column to column [rad]. Surfaces of
    ``degree`` are taken out: 2 so that bows of the surface do not count as errors that neighbours
    share.

    Method section 5.7.
    """
    if not len(residuals) == len(rows) == len(columns) == len(patch):
        raise InputError("residuals, rows, columns and patches have different lengths")
    pitches = np.asarray(pitch, dtype=float)
    if not (np.isfinite(pitches).all() and (pitches > 0).all()):
        raise InputError("the pitch of a grid is not a positive angle")
    starts = np.flatnonzero(np.diff(patch, prepend=-1))
    ends = np.append(starts[1:], len(patch))
    each = np.broadcast_to(pitches, (len(starts), 2)) if pitches.ndim == 1 else pitches
    chosen = np.unique(np.linspace(0, len(starts) - 1, min(len(starts), GATES.patches)).astype(int))
    patches = [
        _Patch.of(residuals[a:b], rows[a:b], columns[a:b], degree)
        for a, b in zip(starts[chosen], ends[chosen], strict=True)
    ]
    used = [k for k, one in enumerate(patches) if one is not None]
    if len(used) < GATES.fewest_patches:
        return None
    return _fitted([p for p in patches if p is not None], each[chosen[used]])


def smooth_correlation(fitted: FittedNoise) -> NeighbourCorrelation | None:
    """Estimate what neighbours share from the smooth patches of a scanner's scans."""
    smooth = fitted.smooth
    scaled = smooth.residual / np.sqrt(smooth.stated(fitted.noise()))
    return neighbour_correlation(scaled, smooth.row, smooth.column, smooth.patch, smooth.pitch)


@dataclass(frozen=True, eq=False)
class _Patch:
    """Whitened residuals of a window as images (rows, columns), and what the surface takes up."""

    #: (rows, columns), residuals over their standard deviation, zero where there is no point;
    #: where there is one
    residual: Array
    filled: Mask
    base: Array  #: (rows, columns, k), orthonormal surfaces that were taken out

    @classmethod
    def of(cls, residual: Array, row: Index, column: Index, degree: int) -> _Patch | None:
        """From the points of a patch, the middle of it if it is large; None if they are few."""
        place = []
        for at in (row, column):
            low, high = int(at.min()), int(at.max())
            first = max(low, (low + high + 1 - GATES.window) // 2)
            place.append(at - first)
        use = np.all([(at >= 0) & (at < GATES.window) for at in place], axis=0)
        i, j = (at[use] for at in place)
        unknowns = 3 if degree == 1 else 6
        if use.sum() < GATES.fewest + unknowns or np.ptp(i) < 2 or np.ptp(j) < 2:
            return None
        x, y = i / GATES.window - 0.5, j / GATES.window - 0.5
        surface = [np.ones_like(x), x, y, x * x, x * y, y * y][:unknowns]
        base, triangle = np.linalg.qr(np.column_stack(surface))
        if np.abs(np.diag(triangle)).min() < 1e-6:
            return None
        left = residual[use] - base @ (base.T @ residual[use])
        size = float(np.sqrt(left @ left / (len(left) - unknowns)))
        if not size > 0:
            return None
        shape = int(i.max()) + 1, int(j.max()) + 1
        image, filled = np.zeros(shape), np.zeros(shape, dtype=bool)
        surfaces = np.zeros((*shape, unknowns))
        image[i, j], filled[i, j], surfaces[i, j] = left / size, True, base
        return cls(image, filled, surfaces)

    def paired(self, image: Array, lag: tuple[int, int]) -> Array:
        """``S_l`` of an image (rows, columns, k): sums over the places at a lag to all sides."""
        if lag == (0, 0):
            return image
        out = np.zeros_like(image)
        high, wide = image.shape[:2]
        for a, b in {(lag[0] * p, lag[1] * q) for p in (1, -1) for q in (1, -1)}:
            if abs(a) < high and abs(b) < wide:
                to = slice(max(0, -a), high - max(0, a)), slice(max(0, -b), wide - max(0, b))
                by = slice(max(0, a), high + min(0, a)), slice(max(0, b), wide + min(0, b))
                out[to] += image[by]
        return np.asarray(out * self.filled[:, :, None])

    def sums(self, pitch: Array, widths: Array) -> _Sums:
        """``v^T S_l v``, pairs, ``tr(M S_l M C)`` of independent errors and of those of discs."""
        k = self.base.shape[2]
        both = np.concatenate(
            [self.residual[:, :, None], self.filled[:, :, None].astype(float), self.base], axis=2
        )
        paired = np.stack([self.paired(both, lag).reshape(-1, k + 2) for lag in _LAGS])
        base = self.base.reshape(-1, k)
        seen = paired[:, :, 0] @ self.residual.ravel()
        pairs = paired[:, :, 1] @ self.filled.ravel()
        near = paired[:, :, 2:]
        inner = np.einsum("na,lnb->lab", base, near)
        away = np.hypot(*(np.array(_LAGS) * pitch).T)
        # a covariance times the surfaces is a convolution over the points that there are
        size = 2 * GATES.window
        reach = np.minimum(np.arange(size), size - np.arange(size))
        grid = np.hypot(*np.meshgrid(reach * pitch[0], reach * pitch[1], indexing="ij"))
        kernels = fft.rfft2(overlap_share(grid / widths[:, None, None]))
        images = fft.rfft2(np.moveaxis(self.base, 2, 0), (size, size))
        discs = fft.irfft2(kernels[:, None] * images, (size, size))
        high, wide = self.filled.shape
        turned = np.moveaxis(discs[:, :, :high, :wide], 1, 3) * self.filled[:, :, None]
        turned = np.concatenate([base[None], turned.reshape(len(widths), -1, k)])
        shared = overlap_share(away / widths[:, None])
        plain = pairs[:, None] * np.concatenate([(away == 0)[None].astype(float), shared]).T
        expected = (
            plain
            - 2
            * np.einsum("lx,cx->lc", near.reshape(len(near), -1), turned.reshape(len(turned), -1))
            + np.einsum("lab,cab->lc", inner, np.einsum("na,cnb->cab", base, turned))
        )
        return _Sums(seen, pairs, plain, expected)


@dataclass(frozen=True, eq=False)
class _Sums:
    """Sums over patches."""

    seen: Array  #: (l,), products of residuals over pairs at each lag
    pairs: Array  #: (l,), numbers of pairs, each from both sides
    #: (l, 1 + w), what independent errors of variance one make of the products, and those of
    #: discs: before and after the surfaces were taken out
    plain: Array
    expected: Array

    @classmethod
    def over(cls, parts: Sequence[_Sums]) -> _Sums:
        """Over all of them."""
        names = ("seen", "pairs", "plain", "expected")
        return cls(*(np.sum([getattr(part, name) for part in parts], axis=0) for name in names))

    def shares(self) -> tuple[Array, Array, Array]:
        """Variances of unshared and shared errors, and misfits (w,), for each width."""
        root = 1 / np.sqrt(np.maximum(self.pairs, 1.0))
        right = self.seen * root
        out = np.empty((self.expected.shape[1] - 1, 3))
        for c in range(len(out)):
            x, misfit = nnls(self.expected[:, [0, c + 1]] * root[:, None], right)
            out[c] = *x, misfit
        return out[:, 0], out[:, 1], out[:, 2]

    def unshared(self) -> float:
        """Weighted squares that independent errors leave."""
        root = 1 / np.sqrt(np.maximum(self.pairs, 1.0))
        return float(nnls(self.expected[:, :1] * root[:, None], self.seen * root)[1] ** 2)

    def correlations(self, scale: float, share: float, width: int) -> Array:
        """Correlations (l,): products over pairs, less what the surfaces took out of them."""
        mixed = np.array([1 - share, share])
        taken = (self.plain - self.expected)[:, [0, width + 1]] @ mixed
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray((self.seen / scale + taken) / self.pairs)


def _fitted(patches: list[_Patch], pitches: Array) -> NeighbourCorrelation:
    """Share and width that fit the sums over all patches."""
    pitch = np.median(pitches, axis=0)
    size = max(float(np.hypot(*(np.array(p.filled.shape) * pitch))) for p in patches)
    widths = np.geomspace(1.25 * pitch.min(), max(size, 2.5 * pitch.min()), GATES.widths)
    parts = [p.sums(q, widths) for p, q in zip(patches, pitches, strict=True)]
    whole = _Sums.over(parts)
    alone, shared, misfit = whole.shares()
    best = int(np.argmin(misfit))
    share, scale = _share(alone[best], shared[best])
    groups = [parts[g :: GATES.groups] for g in range(min(GATES.groups, len(parts)))]
    without = [
        _Sums.over([part for g, group in enumerate(groups) if g != k for part in group])
        for k in range(len(groups))
    ]
    left = np.array([_share(*(x[best] for x in w.shares()[:2]))[0] for w in without])
    grow = (len(groups) - 1) / len(groups)
    sigma = float(np.sqrt(grow * np.sum((left - left.mean()) ** 2)))
    told = (whole.unshared() - misfit[best] ** 2) / 2 > GATES.told and share > 0
    correlation = whole.correlations(scale, share if told else 0.0, best)
    tables = np.array([w.correlations(scale, share if told else 0.0, best) for w in without])
    spread = np.sqrt(grow * np.sum((tables - tables.mean(axis=0)) ** 2, axis=0))
    return NeighbourCorrelation(
        share=share if told else 0.0,
        sigma=sigma,
        angle=float(widths[best]) if told else 0.0,
        widest=float(widths[-1]),
        pitch=pitch,
        lags=np.array(_LAGS)[_LISTED],
        correlation=correlation[_LISTED],
        correlation_sigma=spread[_LISTED],
        lost=scale if told else 1.0,
        points=int(sum(p.filled.sum() for p in patches)),
        patches=len(patches),
    )


def _share(alone: float, shared: float) -> tuple[float, float]:
    """Share of the shared variance in the whole, and the whole."""
    whole = alone + shared
    return (float(shared / whole) if whole > 0 else 0.0), float(whole)
