"""New poses in the XML section of an E57 file, of scans and of the pictures that hang on them.

Poses of pictures are in the world of the poses of the scans. A picture that names a scan (its
``associatedData3DGuid``) moves with it by new times old inverse, so that it still lies on the
points; one that names none moves with the only scan of its file, and stays where there are several.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from lxml import etree
from scipy.spatial.transform import Rotation

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.e57_pages import child
from tribrach.io.scans.e57_header import pose_of

__all__ = ["quaternion", "replace_crs", "replace_poses"]

#: representations of a picture that lie somewhere; a visual reference does not
_PLACED = ("pinholeRepresentation", "sphericalRepresentation", "cylindricalRepresentation")


def replace_poses(root: etree._Element, poses: Mapping[int, Pose], source: Path) -> tuple[str, ...]:
    """Put poses, world from scanner by index of the scan, into a tree; what is to be said of it.

    Raises
    ------
    InputError : a scan that the file has not.
    """
    scans = _children(root, "data3D")
    moves: dict[int, tuple[Pose, Pose]] = {}
    for index, pose in poses.items():
        if not 0 <= index < len(scans):
            raise InputError(
                f"the file has {len(scans)} scans, none is number {index + 1}", file=source
            )
        moves[index] = (pose_of(scans[index], []) or Pose.identity(), pose)
    said = _move_pictures(root, scans, moves)
    for index, pose in poses.items():
        _set_pose(scans[index], pose, before=child(scans[index], "points"))
    return said


def _move_pictures(
    root: etree._Element,
    scans: Sequence[etree._Element],
    moves: Mapping[int, tuple[Pose, Pose]],
) -> tuple[str, ...]:
    """Pictures follow their scans; a sentence if some cannot."""
    guids = [_text(scan, "guid") for scan in scans]
    stay = 0
    for picture in _children(root, "images2D"):
        named = _text(picture, "associatedData3DGuid")
        found = [k for k, guid in enumerate(guids) if guid == named] if named else []
        if not named and len(scans) == 1:
            found = [0]
        pose = pose_of(picture, [])
        if pose is None and all(child(picture, kind) is None for kind in _PLACED):
            continue
        if len(found) == 1 and found[0] in moves:
            _set_pose(picture, _moved(pose or Pose.identity(), *moves[found[0]]), before=None)
        elif len(found) != 1:
            stay += 1
    if not stay:
        return ()
    words = "a picture names no scan" if stay == 1 else f"{stay} pictures name no scan"
    return (f"{words} of the file and did not move with the points",)


def _moved(pose: Pose, old: Pose, new: Pose) -> Pose:
    """``new old^-1 pose``, differences first: translations may be millions of metres."""
    turn = new.rotation @ old.rotation.T
    shift = turn @ (pose.translation - old.translation)
    return Pose(turn @ pose.rotation, new.translation + shift)


def _children(root: etree._Element, name: str) -> list[etree._Element]:
    """The members of a vector of the tree."""
    group = child(root, name)
    return [] if group is None else [e for e in group if isinstance(e.tag, str)]


def _text(element: etree._Element, name: str) -> str:
    """The text of a child; "" if there is none."""
    found = child(element, name)
    return "" if found is None else (found.text or "").strip()


def _set_pose(owner: etree._Element, pose: Pose, before: etree._Element | None) -> None:
    """Put a pose into a scan or picture, in the place of the old one."""
    element = child(owner, "pose")
    if element is None:
        element = _structure(owner, "pose", before=before)
    x, y, z, w = quaternion(pose)
    _numbers(element, "rotation", {"w": w, "x": x, "y": y, "z": z})
    _numbers(element, "translation", dict(zip("xyz", pose.translation.tolist(), strict=True)))


def quaternion(pose: Pose) -> list[float]:
    """x, y, z, w of a pose's rotation, w not negative."""
    q: list[float] = Rotation.from_matrix(pose.rotation).as_quat(canonical=True).tolist()
    return q


def _numbers(pose: etree._Element, name: str, values: Mapping[str, float]) -> None:
    """One part of a pose, in the place of the old one."""
    old = child(pose, name)
    if old is None:
        part = _structure(pose, name, before=None)
    else:
        part = old
        for one in values:
            stale = child(part, one)
            if stale is not None:
                part.remove(stale)
    for one, value in values.items():
        element = etree.SubElement(part, _tag(pose, one), type="Float")
        element.text = repr(float(value))


def _structure(parent: etree._Element, name: str, before: etree._Element | None) -> etree._Element:
    """A new structure in a parent, before one of its children or at its end."""
    element = etree.Element(_tag(parent, name), type="Structure")
    if before is None:
        parent.append(element)
    else:
        before.addprevious(element)
    return element


def _tag(near: etree._Element, name: str) -> str:
    """A name in the namespace of the standard, as the file writes it."""
    space = near.nsmap.get(None)
    return f"{{{space}}}{name}" if space else name


def replace_crs(root: etree._Element, crs: str) -> None:
    """Put the reference system into a tree."""
    element = child(root, "coordinateMetadata")
    if element is None:
        element = etree.Element(_tag(root, "coordinateMetadata"), type="String")
        group = child(root, "data3D")
        if group is None:
            root.append(element)
        else:
            group.addprevious(element)
    for one in list(element):
        element.remove(one)
    element.set("type", "String")
    element.text = etree.CDATA(crs) if "]]>" not in crs else crs
