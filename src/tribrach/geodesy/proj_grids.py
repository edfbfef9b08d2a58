"""PROJ without the network, and sentences about grids that it would have needed.

A grid that is not installed makes PROJ take a coarser transformation silently. On a site whose
datum is not that of a geoid model, the model is then read beside the place; within the site, and
back into the same grid, nothing changes.
"""

from __future__ import annotations

import warnings

from pyproj import CRS, network
from pyproj.exceptions import CRSError, ProjError
from pyproj.transformer import TransformerGroup

from tribrach.errors import InputError
from tribrach.sentences import Sentence

__all__ = ["missing_grid_sentences", "offline", "vertical_name"]

_GEOGRAPHIC = "+proj=longlat +datum=WGS84 +type=crs"


def offline() -> None:
    """Keep PROJ from downloading grids, whatever the environment variables say."""
    network.set_network_enabled(active=False)  # type: ignore[attr-defined]


def missing_grid_sentences(crs: str) -> list[str]:
    """Names the grid that is missing for the way from a reference system to WGS 84."""
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
    sentences: list[str] = []
    available = [t.accuracy for t in group.transformers if t.accuracy >= 0]
    instead = (
        Sentence("another of {available:mg}", available=min(available))
        if available
        else "another of unknown accuracy"
    )
    for operation in group.unavailable_operations[:3]:
        grids = [grid.short_name for grid in operation.grids if not grid.available]
        if grids:
            sentences.append(
                Sentence(
                    "the way from {crs} to WGS 84 with {operation.accuracy:mg} needs the grid "
                    "{grids}, which is not installed; {instead} is taken to read geoid heights; "
                    "nothing is downloaded: put the grid into PROJ's folder",
                    crs=crs,
                    operation=operation,
                    grids=", ".join(grids),
                    instead=instead,
                )
            )
    return sentences[:1]


def vertical_name(crs: str) -> str | None:
    """Name of the vertical part of a compound system; None if heights are not part of it."""
    try:
        definition = CRS.from_user_input(crs)
    except CRSError as error:
        raise InputError(f"{crs} is not known to PROJ", cure="give an EPSG code") from error
    for part in definition.sub_crs_list:
        if part.is_vertical:
            return str(part.name)
    return None
