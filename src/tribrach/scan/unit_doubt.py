"""Whether coordinates that count as metres can be metres, judged by what scanners reach."""

from __future__ import annotations

import numpy as np

from tribrach._types import Array
from tribrach.scan.coordinate_step import coordinate_step
from tribrach.scan.length_unit import UnitDoubt
from tribrach.scan.scan import Scan

#: no scan is wider, and hardly one is higher [m]
_WIDEST, _HIGHEST = 2e4, 2e3
#: no scan of several points is narrower [m]; none in plan that is so much higher than wide
_NARROWEST, _PLAN, _SLENDER = 5e-3, 2e-2, 20.0
#: no floor or ceiling is farther from a scanner than the steep rays of half a scan reach [m]; few
#: tripods stand so high above what is below them [m]; no scanner gives coordinates in steps of [m]
_STEEP, _TOWER, _COARSE = 300.0, 50.0, 1.0
#: who looks all around, into so many eighths of the circle, stands on something that is near [m]
_NEAR, _EIGHTHS = 30.0, 6
#: floor below a tripod, and room, in feet that are taken for metres; share of steep rays that lie
#: within a tenth of their median on a floor or ceiling
_TRIPOD, _ROOM, _LEVEL = (4.3, 6.8), (7.4, 16.0), 0.6
#: points that are looked at for a doubt at first sight
_FIRST = 50_000
#: steep rays that tell: their share and number
_STEEP_SHARE, _STEEP_FEW = 0.02, 50


def unit_doubt(scan: Scan, xyz: Array) -> UnitDoubt | None:
    """What speaks against metres in points (n, 3) of a scan; None if stated, or degrees."""
    unit = scan.unit
    if unit.factors is None or unit.names[0] == "degree" or unit.source == "as given":
        return None
    if not len(xyz):
        return None
    # coordinates that nothing can be computed with raise no doubt
    with np.errstate(over="ignore", invalid="ignore"):
        extent = np.ptp(xyz, axis=0)
        across, plan, rise = float(extent.max()), float(extent[:2].max()), float(extent[2])
        if across > _WIDEST:
            return UnitDoubt("wide", across)
        if unit.metric and 0 < across < _NARROWEST:
            return UnitDoubt("narrow", across)
        if unit.metric and slender(extent):
            return UnitDoubt("slender", plan)
        if scan.origin != "unknown":
            rays = xyz - np.array(scan.scanner)
            distance = np.linalg.norm(rays, axis=1)
            if (far := _steep(np.abs(rays[:, 2]), rays, distance)) > _STEEP:
                return UnitDoubt("steep", far)
            if (far := _steep(-rays[:, 2], rays, distance)) > _TOWER:
                return UnitDoubt("tower", far)
            floor, ceiling = _level(-rays[:, 2], rays), _level(rays[:, 2], rays)
            room = ceiling > 0 and _ROOM[0] < floor + ceiling < _ROOM[1]
            if unit.metric and room and _TRIPOD[0] < floor < _TRIPOD[1]:
                return UnitDoubt("feet", floor)
            near = float(np.quantile(distance, 0.01))
            if near > _NEAR and _around(rays) >= _EIGHTHS:
                return UnitDoubt("far", near)
        if rise > _HIGHEST:
            return UnitDoubt("high", rise)
        if unit.metric and (step := coordinate_step(xyz, _COARSE)) >= _COARSE:
            return UnitDoubt("coarse", step)
    return None


def slender(extent: Array) -> bool:
    """True if a box (3,) is so narrow in plan for its height that x and y may be degrees."""
    plan, rise = float(extent[:2].max()), float(extent[2])
    return 0 < plan < min(_PLAN, rise / _SLENDER)


def doubt_at_first(scan: Scan) -> UnitDoubt | None:
    """The same of the first points, for who does not read a scan."""
    first = next(scan.measured(_FIRST), None) if scan.unit.factors is not None else None
    return None if first is None else unit_doubt(scan, first.xyz)


def _around(rays: Array) -> int:
    """Eighths of the circle in which rays (n, 3) lie, a hundredth of them at least."""
    eighths = np.floor(np.arctan2(rays[:, 1], rays[:, 0]) / (np.pi / 4)).astype(int) % 8
    return int((np.bincount(eighths, minlength=8) >= max(len(rays) / 100, 1)).sum())


def _level(rise: Array, xyz: Array) -> float:
    """Median rise of the steep rays where most end on one level [m]; 0 where they are few."""
    some = rise[rise > np.hypot(xyz[:, 0], xyz[:, 1])]
    if len(some) < max(_STEEP_FEW, _STEEP_SHARE * len(xyz)):
        return 0.0
    middle = float(np.median(some))
    return middle if np.mean(np.abs(some / middle - 1) < 0.1) > _LEVEL else 0.0


def _steep(rise: Array, xyz: Array, distance: Array) -> float:
    """Median range of the rays that rise by more than 45 degrees [m]; 0 where they are few."""
    steep = distance[rise > np.hypot(xyz[:, 0], xyz[:, 1])]
    if len(steep) < max(_STEEP_FEW, _STEEP_SHARE * len(xyz)):
        return 0.0
    return float(np.median(steep))
