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


def geoid_names(crs: str) -> list[str]:
    """Files of geoid heights that PROJ knows for a compound system, the most accurate first."""
    offline()
    whole = CRS.from_user_input(crs)
    if whole.geodetic_crs is None:
        return []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        try:
            group = TransformerGroup(whole, whole.geodetic_crs.to_3d(), always_xy=True)
        except (CRSError, ProjError):
            return []
    known = [(t.accuracy, g.short_name) for t in group.transformers
             for o in t.operations or () for g in o.grids]  # fmt: skip
    known += [(o.accuracy, g.short_name) for o in group.unavailable_operations for g in o.grids]
    known.sort(key=lambda one: one[0] if one[0] >= 0 else 1e9)
    return list(dict.fromkeys(name for _, name in known))
