"""Epochs of adjusted networks: their coordinates with the joint covariance, and what they share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.epochs.comparison import Comparison, Settings, compare, with_common_scale
from tribrach.epochs.differences import MOTIONS, Epoch, Space, difference
from tribrach.errors import InputError
from tribrach.geodesy.site import EllipsoidSite
from tribrach.network.adjustment import Adjustment
from tribrach.network.given_values import (
    common_values,
    given_rows,
    through_given,
    with_given,
)
from tribrach.network.network import Network
from tribrach.network.roles import used_axes
from tribrach.observations.base import Use
from tribrach.sentences import Sentence

#: coordinates of an epoch; their joint covariance has 200 MB
MOST = 5000


@dataclass(frozen=True, eq=False)
class EpochInput:
    """An epoch, and where it comes from."""

    epoch: Epoch  #: its coordinates
    site: Any  #: where their frame lies
    #: the network behind it; None where a file has the coordinates alone
    adjustment: Adjustment | None = None
    control: tuple[str, ...] = ()  #: names of its control points
    sentences: tuple[str, ...] = ()  #: what is to be known of it


@dataclass(frozen=True)
class EpochSettings:
    """Settings of a comparison of epochs."""

    tests: Settings = Settings()  #: of the comparison
    space: Space | None = None  #: heights, plan or 3D; all that both epochs have if None
    free: tuple[str, ...] = ()  #: further motions that are taken out


@dataclass(frozen=True, eq=False)
class ComparedEpochs:
    """A comparison and what is to be known of its epochs."""

    comparison: Comparison  #: what became of every point
    sentences: tuple[str, ...]  #: of the files, and of what both epochs share


def epoch_of(adjustment: Adjustment, label: str) -> EpochInput:
    """The points of an adjusted network as an epoch, covariances a priori."""
    names = adjustment.layout.names["point"]
    if 3 * len(names) > MOST:
        raise InputError(
            f"{label} has {len(names)} points; a joint covariance is made of at most {MOST // 3}",
            cure="leave out points that are not compared",
        )
    used = used_axes(adjustment)
    xyz = np.where(used, adjustment.state.points, np.nan)
    columns = adjustment.layout.columns("point", np.arange(len(names))).ravel()
    covariance = adjustment.covariance_columns(columns, columns)
    known = adjustment.dof > 0 and not adjustment.fits_exactly
    epoch = Epoch(
        label,
        tuple(names),
        xyz,
        (covariance + covariance.T) / 2,
        _motions(adjustment),
        adjustment.dof if known else 0,
        adjustment.posterior_factor if known else float("nan"),
    )
    control = control_names(adjustment.network)
    return EpochInput(epoch, adjustment.network.site, adjustment, control)


def _motions(adjustment: Adjustment) -> tuple[str, ...]:
    """Open motions by name; a combination counts as all that are in it."""
    mix = adjustment.motions.mix
    if not mix.shape[1]:
        return ()
    size = np.abs(mix)
    # shares in a motion that are rounding are none; turns count by what they move
    extent = np.ptp(adjustment.state.positions, axis=0).max(initial=1.0)
    weight = np.array([1, 1, 1, extent, extent, extent, extent])[:, None]
    share = size * weight / (size * weight).max(axis=0)
    return tuple(m for k, m in enumerate(MOTIONS) if (share[k] > 1e-6).any())


def compare_epochs(
    first: EpochInput, second: EpochInput, settings: EpochSettings
) -> ComparedEpochs:
    """Compare two epochs in the frame of the first."""
    second, moved = _in_frame(second, first)
    sentences = [*first.sentences, *second.sentences, *moved]
    cross = None
    if first.adjustment is not None and second.adjustment is not None:
        cross, shared = shared_covariance(first.adjustment, second.adjustment)
        if shared:
            sentences.append(
                f"both epochs use {shared} given values alike: what these are wrong by cancels in "
                "the differences as far as it acts alike"
            )
    else:
        sentences.append(
            "what both epochs share (control, calibration) is not in files of coordinates: they "
            "are taken as independent"
        )
    tests = settings.tests
    if not tests.references:
        tests, said = _control(first, second, tests)
        sentences += said
    changes = difference(
        first.epoch,
        second.epoch,
        space=settings.space,
        free=settings.free,
        cross=cross,
        align_by=tests.references or None,
    )
    open_ = set(first.epoch.motions) | set(second.epoch.motions)
    chosen = [m for m in settings.free if m not in open_]
    found = compare(changes, tests, chosen)
    scaled = with_common_scale(found, chosen)
    if scaled is not None:
        (scale,) = (m for m in scaled.common if m.name == "scale")
        found, search = scaled, found.search
        assert search is not None
        sentences.append(
            Sentence(
                "one scale of {scale.value:ppm1} ± {scale.sigma:ppm1} between both epochs explains "
                "what else {count} reference points would have to have moved by: distances of one "
                "epoch are too long or too short (air, reflector, instrument), or the object grew "
                "evenly, which these networks do not tell; nothing of it is called a movement",
                scale=scale,
                count=len(search.moved) if search.resolved else "most",
            )
        )
    return ComparedEpochs(found, tuple(dict.fromkeys(sentences)))


def _control(first: EpochInput, second: EpochInput, tests: Settings) -> tuple[Settings, list[str]]:
    """Control points of both epochs as reference points, where they can be tested."""
    free = [set(e.control) for e in (first, second) if e.adjustment is not None]
    held = np.diag(first.epoch.covariance).reshape(-1, 3).sum(axis=1) == 0
    fixed = {name for name, known in zip(first.epoch.names, held, strict=True) if known}
    if not free:
        return tests, []
    common = set.intersection(*free, set(first.epoch.names), set(second.epoch.names)) - fixed
    if len(common) < 3:
        return tests, []
    names = tuple(name for name in first.epoch.names if name in common)
    listed = ", ".join(names[:8]) + (f" and {len(names) - 8} more" if names[8:] else "")
    return replace(tests, references=names), [
        f"the control points of both epochs are the reference points: {listed}"
    ]


def _in_frame(second: EpochInput, first: EpochInput) -> tuple[EpochInput, list[str]]:
    """The second epoch in the work frame of the first."""
    one, two = first.site, second.site
    both = [isinstance(s, EllipsoidSite) for s in (one, two)]
    if not any(both) or one == two:
        return second, []
    if not all(both):
        raise InputError(
            f"{first.epoch.label} and {second.epoch.label} are in frames of which one lies on the "
            "ellipsoid and the other nowhere",
            cure="give both epochs with the same site",
        )
    epoch = second.epoch
    turn = one.w_from_ecef @ two.w_from_ecef.T
    whole = np.kron(np.eye(len(epoch.names)), turn)
    known = np.isfinite(epoch.xyz).all(axis=1)
    xyz = np.full_like(epoch.xyz, np.nan)
    xyz[known] = one.from_ecef(two.to_ecef(epoch.xyz[known]))
    epoch = replace(epoch, xyz=xyz, covariance=whole @ epoch.covariance @ whole.T)
    # covariances between epochs are those of the frames in which they were adjusted
    return EpochInput(epoch, one, None, second.control, second.sentences), [
        f"{epoch.label} was brought into the work frame of {first.epoch.label}"
    ]


def shared_covariance(first: Adjustment, second: Adjustment) -> tuple[Array | None, int]:
    """Covariance (3 n1, 3 n2) between the points of two networks by given values that both use.

    ``C_12 = cov(x_1, l_s) C_s^-1 cov(l_s, x_2)`` with the values that were given alike (method
    section 12.4), and how many these are; None without any.
    """
    crosses, parts, keys = [], [], []
    for adjustment in (first, second):
        given = given_rows(adjustment)
        columns = adjustment.layout.columns(
            "point", np.arange(adjustment.layout.count("point"))
        ).ravel()
        cross, part = with_given(adjustment, np.array(list(given.values()), int), columns)
        crosses.append(cross)
        parts.append(part)
        keys.append(list(given))
    i, j = common_values(keys[0], parts[0], keys[1], parts[1])
    if not len(i):
        return None, 0
    shared = parts[0][np.ix_(i, i)]
    return through_given(crosses[0][:, i], crosses[1][:, j], shared), len(i)


def control_names(network: Network) -> tuple[str, ...]:
    """Points of a network whose coordinates are given as control, weighted or held."""
    layout = network.start.layout
    points = network.free[: 3 * layout.count("point")].reshape(-1, 3)
    used = points.any(axis=0)
    held = ~points[:, used].any(axis=1) if used.any() else np.ones(len(points), dtype=bool)
    chosen = set(np.flatnonzero(held).tolist())
    for o in network.observations:
        if type(o).facts.listed_as_control and o.group == "control":
            active = o.use == Use.ACTIVE
            chosen |= set(np.unique(o.position[active]).tolist())  # type: ignore[attr-defined]
    names = layout.names["point"]
    return tuple(name for k, name in enumerate(names) if k in chosen)
