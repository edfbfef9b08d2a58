"""What the coordinates of a file are counted in, and how many metres that is along each axis."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class LengthUnit:
    """The unit of the coordinates of a file."""

    #: of x, y and z, in words
    names: tuple[str, str, str] = ("metre", "metre", "metre")
    #: metres in one unit of x, y and z; None if x and y are angles
    factors: tuple[float, float, float] | None = (1.0, 1.0, 1.0)
    #: who says so
    source: str = "assumed"
    #: WKT of the file, whose axes have these units; None if it has none
    crs: str | None = None
    #: true if it follows from the axes of the reference system, which any program can read
    by_crs: bool = False

    @property
    def metric(self) -> bool:
        """True if the coordinates are metres."""
        return self.factors == (1.0, 1.0, 1.0)

    @property
    def words(self) -> str:
        """The unit, and that of heights where it is another."""
        x, _, z = self.names
        if x == z:
            return x
        return f"{x}, heights {z}"


METRES = LengthUnit()
