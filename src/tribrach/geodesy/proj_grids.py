"""PROJ never goes to the network here; what it would have needed is said in words.

A grid that is not installed makes PROJ take a coarser transformation without a word. The places of
a project then move as a whole; within the site, and back into the same grid, nothing changes.
"""

from __future__ import annotations

import warnings

from pyproj import CRS, network
from pyproj.exceptions import CRSError, ProjError
from pyproj.transformer import TransformerGroup

from tribrach.errors import InputError

__all__ = ["missing_grid_sentences", "offline", "vertical_name"]

_GEOGRAPHIC = "+proj=longlat +datum=WGS84 +type=crs"


def offline() -> None:
    """Forbid PROJ to download grids, whatever the surroundings say."""
    network.set_network_enabled(active=False)  # type: ignore[attr-defined]


def missing_grid_sentences(crs: str) -> list[str]:
    """What is not at hand for the way from a reference system to WGS 84, one sentence each.

    Raises
    ------
    InputError
        PROJ does not know the system.
    """
    offline()
    try:
        with warnings.catch_warnings():
            # PROJ's own warning, which names no grid
            warnings.simplefilter("ignore", UserWarning)
            group = TransformerGroup(CRS.from_user_input(crs), _GEOGRAPHIC, always_xy=True)
    except (CRSError, ProjError) as error:
        raise InputError(f"{crs} is not known to PROJ", cure="give an EPSG code") from error
    if group.best_available:
        return []
    out = []
    at_hand = [t.accuracy for t in group.transformers if t.accuracy >= 0]
    instead = f"another of {min(at_hand):g} m" if at_hand else "another of unknown accuracy"
    for operation in group.unavailable_operations[:3]:
        grids = [grid.short_name for grid in operation.grids if not grid.available]
        if grids:
            out.append(
                f"the way from {crs} to WGS 84 with {operation.accuracy:g} m needs the grid "
                f"{', '.join(grids)}, which is not installed; {instead} is taken and moves the "
                "site as a whole; nothing is downloaded: put the grid into PROJ's folder"
            )
    return out[:1]


def vertical_name(crs: str) -> str | None:
    """Name of the vertical part of a compound system; None if heights are not part of it.

    Raises
    ------
    InputError
        PROJ does not know the system.
    """
    try:
        definition = CRS.from_user_input(crs)
    except CRSError as error:
        raise InputError(f"{crs} is not known to PROJ", cure="give an EPSG code") from error
    for part in definition.sub_crs_list:
        if part.is_vertical:
            return str(part.name)
    return None
