"""The entries ``[[scans]]`` of a project, and the scans of files that they mean."""

from __future__ import annotations

from tribrach.errors import among
from tribrach.io.scans.formats import read_scans
from tribrach.io.scans.reading import as_told
from tribrach.project import Project
from tribrach.project.sections import ScanFile
from tribrach.scan.scan import Scan


def scans_of_entry(project: Project, k: int, entry: ScanFile) -> tuple[Scan, ...]:
    """The scans that an entry of a project means, by the headers of its file."""
    with as_told(entry.unit, entry.columns, entry.decimal):
        scans = read_scans(project.folder / entry.file)
    if entry.scan is not None:
        chosen = [scan for scan in scans if scan.name == entry.scan]
        if not chosen:
            raise project.error(
                ("scans", k, "scan"),
                f"{entry.file} has no scan {entry.scan}",
                among(entry.scan, [scan.name for scan in scans], "its scans are"),
            )
        scans = tuple(chosen)
    if entry.station is not None and len(scans) > 1:
        raise project.error(
            ("scans", k, "station"),
            f"{entry.file} has {len(scans)} scans and one station is given",
            "give one entry with scan and station for each, or leave station out",
        )
    return scans
