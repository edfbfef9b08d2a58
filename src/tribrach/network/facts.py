"""What readers of files learn beside points and observations; the report asks for it by type."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TypeVar

from tribrach.geodesy.output_frame import OutputFrame

__all__ = ["Fact", "Reference", "facts_of"]


class Fact:
    """Base class of what a reader leaves for the report.

    Every reader derives a frozen dataclass of its own. A survey may hold several facts of one
    type, for example one for each raw file; none replaces another.
    """


KindOfFact = TypeVar("KindOfFact", bound=Fact)


def facts_of(facts: Iterable[Fact], kind: type[KindOfFact]) -> tuple[KindOfFact, ...]:
    """Choose the facts of one type, in the order in which they were left.

    Parameters
    ----------
    facts : Iterable[Fact]
        Facts of a survey or of a network.
    kind : type
        The type that is asked for.

    Returns
    -------
    tuple
        The facts of this type, empty if there are none.
    """
    return tuple(fact for fact in facts if isinstance(fact, kind))


@dataclass(frozen=True)
class Reference:
    """The reference system of the coordinates, as far as a file or project names it.

    Parameters
    ----------
    crs : str, optional
        Name or code of the coordinate reference system, such as ``EPSG:5897``.
    frame : str, optional
        Reference frame of geocentric coordinates, such as ``ITRF2014``.
    epoch : float, optional
        Decimal year that coordinates in a dynamic frame hold for.
    grid : OutputFrame, optional
        Converts work coordinates to easting, northing and height of a projected site.
    """

    crs: str | None = None
    frame: str | None = None
    epoch: float | None = None
    grid: OutputFrame | None = None

    def completed(self, other: Reference) -> Reference:
        """Fill what is missing here from another reference.

        Parameters
        ----------
        other : Reference
            Gives what this one does not say; a frame and its epoch stay together.

        Returns
        -------
        Reference
        """
        own = self if self.frame is not None or self.epoch is not None else other
        return replace(
            self,
            crs=self.crs if self.crs is not None else other.crs,
            frame=own.frame,
            epoch=own.epoch,
            grid=self.grid if self.grid is not None else other.grid,
        )
