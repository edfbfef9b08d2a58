"""Finds the files of poses that belong to scans, and chooses the reader by what is in them.

A file with one pose has the name of its scan: ``S1.pose``, ``S1_pose.txt``, ``S1.pose.txt``,
``S1.DAT``, ``S1.mat``; a matrix of a scan position, ``ScanPos001.DAT``, is also that of
``ScanPos001 - 151012``. A list of poses is given by its name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.poses import kitti, matrix, slam6d
from tribrach.io.poses.rows import PoseList, number_rows

#: endings of files with the pose of one scan, after its name, and whether nothing else has them
_ENDINGS = {".pose": True, "_pose.txt": True, ".pose.txt": True, ".dat": False, ".mat": False}
#: files of a folder that are looked at
_MOST_FILES = 20_000
_CURE = "give lines with a matrix each, one matrix in lines, or six numbers in a .pose file"


def read_pose_list(path: Path) -> PoseList:
    """Read the poses of a file."""
    rows = number_rows(path)
    if matrix.fits(rows):
        return matrix.read(path, rows)
    if kitti.fits(rows):
        return kitti.read(path, rows)
    if slam6d.fits(rows):
        return slam6d.read(path, rows)
    widths = ", ".join(str(len(row.values)) for row in rows[:6])
    raise InputError(
        f"lines with {widths} numbers are no poses", file=path, line=rows[0].line, cure=_CURE
    )


def beside(names: Sequence[str], folder: Path) -> dict[str, PoseList]:
    """Poses of scans in files of a folder that have their names."""
    if not folder.is_dir():
        return {}
    found: dict[str, tuple[Path, bool]] = {}
    for number, path in enumerate(folder.iterdir()):
        if number >= _MOST_FILES:
            break
        for ending, sure in _ENDINGS.items():
            if path.name.lower().endswith(ending) and path.is_file():
                stem = path.name[: -len(ending)].casefold()
                if stem not in found or sure:
                    found[stem] = (path, sure)
    out = {}
    for name in names:
        known = _stem(name, list(found))
        if known is None:
            continue
        path, sure = found[known]
        try:
            one = read_pose_list(path)
        except InputError:
            if sure:
                raise
            continue
        if one.frames is None:
            out[name] = one
        elif sure:
            what = f"the file has {len(one.poses)} poses and the name of one scan"
            raise InputError(what, file=path, cure="give it by its name as a list of poses")
    return out


def _stem(name: str, stems: Sequence[str]) -> str | None:
    """The name of a file for a scan: the same, or the longest that begins the scan's and a word."""
    plain = name.casefold()
    if plain in stems:
        return plain
    begins = [s for s in stems if s and re.match(re.escape(s) + r"[^0-9a-z]", plain)]
    return max(begins, key=len, default=None)


def assigned(names: Sequence[str], listed: PoseList) -> Mapping[str, Pose]:
    """The poses of a list by the names of scans."""
    frames = listed.frames
    if frames is None:
        stem = re.sub(r"([._]pose)?(\.[^.]*)?$", "", listed.path.name, flags=re.IGNORECASE)
        own = [name for name in names if _stem(name, [stem.casefold()]) is not None]
        if not own:
            what = f"the pose is named {stem}, and so is no scan"
            raise InputError(what, file=listed.path, cure="name the file after its scan")
        return dict.fromkeys(own, listed.poses[0])
    ends = [re.search(r"(\d{1,9})$", name) for name in names]
    numbers = [int(end.group(1)) for end in ends if end is not None]
    if len(numbers) == len(names) == len(set(numbers)) and set(numbers) <= set(frames):
        by_frame = dict(zip(frames, listed.poses, strict=True))
        return {name: by_frame[k] for name, k in zip(names, numbers, strict=True)}
    if len(frames) == len(names):
        return dict(zip(names, listed.poses, strict=True))
    some = "one pose" if len(frames) == 1 else f"{len(frames)} poses"
    raise InputError(
        f"the file has {some}, there are {len(names)} scans, and the numbers at the "
        "ends of their names do not tell which is whose",
        file=listed.path,
        cure="give a pose for each scan in their order, or name the scans by their frames",
    )
