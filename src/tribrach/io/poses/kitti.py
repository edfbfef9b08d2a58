"""Lists of poses with a matrix in each line: KITTI's odometry, and what others write after it.

A line is a 3x4 matrix row by row, or a 4x4 one, after the number of the frame where that stands
first (KITTI-360); without it line k is of frame k, from 0. KITTI's own poses are of a camera:
where a ``calib.txt`` stands beside with a line ``Tr:``, camera from scanner, they are carried to
the scanner by it; else they are taken for poses of the scanner, as programs of odometry write them.
Format: Geiger et al. 2012, readme of the odometry development kit.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.opened_files import contents, lines_of
from tribrach.io.poses.rows import LARGEST, NumberRow, PoseList, rigid

#: name of the file with the place of the scanner in the camera
CALIBRATION = "calib.txt"
#: numbers of a line, without and with the number of a frame
_PLAIN, _NUMBERED = (12, 16), (13, 17)
_CURE = "give lines of 12 numbers, or of 13 with the frame before them"


def fits(rows: Sequence[NumberRow]) -> bool:
    """True for lines that are long enough for a matrix each."""
    return len(rows[0].values) in (*_PLAIN, *_NUMBERED)


def read(path: Path, rows: Sequence[NumberRow]) -> PoseList:
    """All poses of a list, in its order."""
    width = len(rows[0].values)
    numbered = width in _NUMBERED
    poses, frames = [], []
    for count, row in enumerate(rows):
        if len(row.values) != width:
            what = f"the line has {len(row.values)} numbers and the first one has {width}"
            raise InputError(what, file=path, line=row.line, cure=_CURE)
        frame = row.values[0] if numbered else float(count)
        if frame < 0 or frame != int(frame):
            what = f"{frame:g} is no number of a frame"
            raise InputError(what, file=path, line=row.line, cure=_CURE)
        frames.append(int(frame))
        poses.append(rigid(path, row.line, row.values[1:] if numbered else row.values))
    if len(set(frames)) < len(frames):
        raise InputError("a frame has two poses", file=path, cure=_CURE)
    camera_from_scanner = _calibration(path.parent / CALIBRATION)
    words = "a matrix in each line, taken for poses of the scanner"
    if camera_from_scanner is not None:
        back = camera_from_scanner.inverse
        poses = [back @ pose @ camera_from_scanner for pose in poses]
        words = f"poses of a camera, carried to the scanner by Tr of {CALIBRATION}"
    return PoseList(path, tuple(poses), tuple(frames), words)


def _calibration(path: Path) -> Pose | None:
    """Camera from scanner, None if there is no such file or line."""
    if not path.is_file() or path.stat().st_size > LARGEST:
        return None
    for number, line in enumerate(lines_of(contents(path).decode("utf-8", "replace")), 1):
        key, _, rest = line.partition(":")
        if key.strip() not in ("Tr", "Tr_velo_to_cam", "Tr_velo_cam"):
            continue
        try:
            values = [float(word) for word in rest.split()]
        except ValueError:
            values = []
        if len(values) != 12:
            raise InputError(
                "Tr is not made of 12 numbers", file=path, line=number, cure="copy it again"
            )
        return rigid(path, number, values)
    return None
