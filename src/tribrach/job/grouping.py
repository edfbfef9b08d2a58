"""The files of clouds, and the scans that go into each.

One file per scan, or one for all of them. Points of E57 files stay in the frames of their
scanners: with ``format = "e57"`` the scans of one E57 source stay together in one copy of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tribrach.io.scans.formats import read_scans
from tribrach.job.scans import MeasuredScan, StationScan

if TYPE_CHECKING:
    from tribrach.project import Project
    from tribrach.project.sections import CloudSection

_SUFFIX = {"laz": ".laz", "las": ".las", "copc": ".copc.laz", "ply": ".ply", "e57": ".e57"}


@dataclass(frozen=True)
class Group:
    """The scans of one file: its name for people, its name on disk."""

    name: str
    file: str
    scans: tuple[StationScan, ...]


def groups(scans: Sequence[StationScan], section: CloudSection) -> list[Group]:
    """Every file with its scans, in the order of the scans; no two files of one name."""
    if section.merged:
        named = [("cloud", tuple(scans))]
    elif section.format == "e57":
        named = _by_source(scans)
    else:
        named = [(scan.name, (scan,)) for scan in scans]
    out, taken = [], set[str]()
    for name, members in named:
        stem, number = file_name(name), 2
        free = stem
        while free.casefold() in taken:
            free, number = f"{stem}-{number}", number + 1
        taken.add(free.casefold())
        out.append(Group(name, free + _SUFFIX[section.format], members))
    return out


def _by_source(scans: Sequence[StationScan]) -> list[tuple[str, tuple[StationScan, ...]]]:
    """Scans of one E57 file together if all of its scans are there, others alone."""
    sources: dict[object, list[StationScan]] = {}
    for scan in scans:
        sources.setdefault(scan.scan.path.resolve(), []).append(scan)
    out: list[tuple[str, tuple[StationScan, ...]]] = []
    for members in sources.values():
        if len(members) > 1 and whole_source(members):
            out.append((members[0].scan.path.stem, tuple(members)))
        else:
            out += [(scan.name, (scan,)) for scan in members]
    return out


def whole_source(scans: Sequence[MeasuredScan]) -> bool:
    """Are these all scans of one E57 file, each once, so that a copy of it shows nothing else?"""
    first = scans[0].scan
    # loaded here, as other formats need none of its libraries
    from tribrach.io.scans.e57 import E57Scan

    if not all(isinstance(one.scan, E57Scan) and one.scan.as_stored for one in scans):
        return False
    if len({one.scan.path.resolve() for one in scans}) != 1:
        return False
    return sorted(one.scan.index for one in scans) == list(range(len(read_scans(first.path))))


def refuse_impossible(project: Project, scans: Sequence[StationScan]) -> None:
    """Say before anything is computed what the clouds of a project cannot be."""
    section = project.cloud
    one_file = section.write and section.merged and section.format == "e57"
    if one_file and len(scans) > 1 and not whole_source(scans):
        raise project.error(
            ("cloud", "merged"),
            "clouds in E57 keep points in the frame of their scanner, so that scans of several "
            "files, or some scans of one, are not merged",
            "say merged = false, or take another format",
        )


def file_name(name: str) -> str:
    """A name that every file system takes."""
    return "".join(c if c.isalnum() or c in "-_." else "_" for c in name).strip(".") or "cloud"
