"""Which scans of a folder are of one set-up: a panorama and its windows share a frame.

Scans with one pose are of one set-up. Without poses, scans whose names differ only in words such
as panorama and window are, if their points lie in the same directions at the same ranges.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import chain
from pathlib import Path

import numpy as np
from pykdtree.kdtree import KDTree

from tribrach._types import Array
from tribrach.scan.scan import Scan

#: scans whose poses are nearer than this are of one station [m]
_SAME = 1e-3
#: words of names that say what of a set-up was scanned, or how fine
_PARTS = re.compile(
    r"(pano(rama)?|overview|ubersicht|uebersicht|fenster|window|detail|ausschnitt|target|ziel|"
    r"zielmarke|board|sphere|kugel|tafel|fine|fein|grob|coarse|closeup|vue|ensemble|fenetre|cible|"
    r"fulldome|dome|hires|lowres|high|low|res|resolution)(e|n|s|en)?\d{0,2}|scans?"
)
#: points and pieces that are read of a scan
_READ, _PIECES = 200_000, 40
#: directions that are compared are so near [rad], at ranges this near [m] and [1]
_NEAR, _RANGE, _SHARE = 0.004, 0.05, 0.01
#: so many directions must be common, and so many of them at one range
_COMMON, _AGREEING = 100, 0.6
#: sides of the cells that count directions [rad]
_CELL = np.radians(1.0)


def set_ups(scans: Sequence[tuple[Path, Scan]]) -> dict[tuple[Path, str], str]:
    """Name of the station of each scan of a file."""
    groups: list[list[tuple[Path, Scan]]] = []
    for path, scan in scans:
        for group in groups:
            if _together(group, path, scan):
                group.append((path, scan))
                break
        else:
            groups.append([(path, scan)])
    out: dict[tuple[Path, str], str] = {}
    taken: set[str] = set()
    for group in groups:
        path, scan = group[0]
        name = known = _common([scan.name or path.stem for path, scan in group])
        if known in taken:
            known = path.stem if path.stem not in taken else f"{path.stem} {name}"
        number = 2
        while known in taken:
            known, number = f"{path.stem} {number}", number + 1
        taken.add(known)
        out |= {(path, scan.name): known for path, scan in group}
    return out


def _place(scan: Scan) -> Array | None:
    """Where the file says that the scanner stood (3,), None if it does not."""
    at = None if scan.pose is None else np.asarray(scan.pose.translation)
    return None if at is None or np.linalg.norm(at) <= _SAME else at


def _together(group: Sequence[tuple[Path, Scan]], path: Path, scan: Scan) -> bool:
    """True if a scan is of the set-up of others."""
    at, (other_path, other) = _place(scan), group[0]
    known = _place(other)
    if at is not None and known is not None:
        return bool(np.linalg.norm(at - known) < _SAME)
    if at is not None or known is not None or "unknown" in (scan.origin, other.origin):
        return False
    core = _core(scan.name or path.stem) or _core(path.stem)
    if not core or core not in (_core(other.name or other_path.stem), _core(other_path.stem)):
        return False
    return any(_one_frame(_Key.of(one), _Key.of(scan)) for _, one in group)


def _core(name: str) -> tuple[str, ...]:
    """The words of a name without those that say what of a set-up was scanned."""
    plain = name.casefold().translate(str.maketrans("äöüéèê", "aoueee"))
    words = re.findall(r"[^\W_]+", plain)
    return tuple(word for word in words if not _PARTS.fullmatch(word))


def _common(names: Sequence[str]) -> str:
    """What names begin with alike, up to the end of a word; the first if that is nothing."""
    if len(set(names)) == 1:
        return names[0]
    end = next(
        (k for k, letters in enumerate(zip(*names, strict=False)) if len(set(letters)) > 1),
        min(map(len, names)),
    )
    whole = all(len(name) == end or not name[end].isalnum() for name in names)
    while end and not whole and names[0][end - 1].isalnum():
        end -= 1
    start = names[0][:end]
    return start.strip(" -_.") or names[0]


def sampled(scan: Scan) -> Array:
    """Points (n, 3) [m] from all over a scan, without those at the scanner."""
    records = scan.records or _READ
    size = max(_READ // _PIECES, 1)
    if records <= _READ:
        parts = [chunk.xyz for chunk in scan.measured()]
    else:
        starts = np.linspace(0, records - size, _PIECES).astype(int).tolist()
        pieces = (scan.measured(size, start) for start in starts)
        parts = [next(iter(piece)).xyz for piece in pieces]
    xyz = np.concatenate(list(chain(parts, [np.empty((0, 3))])))
    return np.asarray(xyz[np.linalg.norm(xyz, axis=1) > 0.1])


@dataclass(frozen=True)
class _Key:
    """A scan as its file was at a time: what is asked of it twice is read once."""

    scan: Scan = field(compare=False)
    path: Path
    index: int
    time: float

    @classmethod
    def of(cls, scan: Scan) -> _Key:
        """The key of a scan."""
        return cls(scan, scan.path, scan.index, scan.path.stat().st_mtime)


@cache
def _one_frame(a: _Key, b: _Key) -> bool:
    """True if two scans see the same ranges where they look in the same directions."""
    directions, ranges = [], []
    for key in (a, b):
        xyz = sampled(key.scan)
        length = np.linalg.norm(xyz, axis=1)
        directions.append(xyz / length[:, None])
        ranges.append(length)
    if not len(ranges[0]) or not len(ranges[1]):
        return False
    for one, two in ((0, 1), (1, 0)):
        # from the scan that has more points where both look
        tree = KDTree(directions[one])
        angle, place = tree.query(directions[two], distance_upper_bound=_NEAR)
        common = np.isfinite(angle)
        if np.count_nonzero(common) >= _COMMON:
            first, second = ranges[one][place[common]], ranges[two][common]
            agree = np.abs(first - second) < _RANGE + _SHARE * second
            return float(agree.mean()) >= _AGREEING
    return False


def density(scan: Scan) -> float:
    """Points of a scan for each square degree that it looks at."""
    xyz = sampled(scan)
    if not len(xyz):
        return 0.0
    x, y, z = xyz.T
    azimuth, height = np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))
    cells = np.stack([np.floor(azimuth / _CELL), np.floor(height / _CELL)])
    looked = np.unique(cells, axis=1)
    area = np.cos((looked[1] + 0.5) * _CELL).sum()
    return (scan.records or len(xyz)) / float(area)
