"""A scan whose points are corrected by a calibration of its scanner as they are read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace

from tribrach.errors import InputError
from tribrach.instruments.correction import Correction
from tribrach.scan.scan import CHUNK, Chunk, Scan

__all__ = ["CorrectedScan", "corrected_scan"]


@dataclass(frozen=True)
class CorrectedScan(Scan):
    """Points of another scan, corrected; everything else as there."""

    source_scan: Scan = field(kw_only=True)
    correction: Correction = field(kw_only=True)

    def chunks(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        """The points of the other scan, see there; xyz corrected."""
        for chunk in self.source_scan.chunks(size, start):
            yield replace(chunk, xyz=self.correction.corrected(chunk.xyz))


def corrected_scan(scan: Scan, correction: Correction) -> CorrectedScan:
    """A scan with a correction in place of any that it has.

    Raises
    ------
    InputError : it is not known where the scanner stood among the points.
    """
    if isinstance(scan, CorrectedScan):
        scan = scan.source_scan
    if scan.origin == "unknown":
        raise InputError(
            "a calibration cannot be applied: where the scanner stood among the points is unknown",
            file=scan.path,
            record=scan.name,
            cure='say origin = "scanner" in [[scans]] if it is at 0, 0, 0, or give its place',
        )
    common = {f.name: getattr(scan, f.name) for f in fields(Scan)}
    return CorrectedScan(**common, source_scan=scan, correction=correction)
