"""A comparison of two clouds as tables and as a page with a map and a histogram."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tribrach.comparison.c2c import C2C
from tribrach.comparison.results import SiteResult
from tribrach.report.page import page, picture
from tribrach.report.scan_content import Picture
from tribrach.report.style import Style
from tribrach.report.tables import Cell, Column, Table, build_table, number_cell, text_cell

__all__ = ["comparison_page", "comparison_sentences", "comparison_tables"]

Array = NDArray[np.float64]
Make = Callable[[SiteResult], Cell]

_C2C_NOTE = (
    "Distances from points of A to their nearest points of B within the limit. The floor is what "
    "two clouds without any error would show at this pitch; debiased is the RMS after the floor, "
    "empty where nothing is left. Plane: signed distances from the plane through 16 points of B."
)
_M3C2_NOTE = (
    "Distances from B to A along the normals of B, means over cylinders, positive towards the "
    "scanner of B where it is known. The level of detection holds with 95 %; published: a mean "
    "difference and the registration added; quadratic: variances added."
)
_SITE_NOTE = (
    "Range and incidence are means over the site as each scanner saw it. Pitch is the spacing of "
    "points on the surface, across by upwards."
)
#: points of a site's map; bins of the histogram
_BINS = 100


def comparison_tables(sites: Sequence[SiteResult], angle_unit: str = "deg") -> list[Table]:
    """Sites, distances from point to point, distances along normals; those that have rows."""
    tables = [_sites(sites, angle_unit), _c2c(sites), _m3c2(sites)]
    return [table for table in tables if table.rows]


def comparison_sentences(sites: Sequence[SiteResult]) -> list[str]:
    """What is to be known of single sites before their figures are used."""
    said = []
    for site in sites:
        notes = () if site.c2c is None else site.c2c.sentences
        notes += () if site.m3c2 is None else site.m3c2.sentences
        said += [f"{site.name}: {note.rstrip('.')}." for note in notes]
    return said


def comparison_page(a: str, b: str, limit: float, sites: Sequence[SiteResult]) -> str:
    """The whole comparison as one HTML file."""
    figures = [_map(sites), _histogram(sites, limit)]
    sentences = comparison_sentences(sites)
    return page(
        "Comparison of clouds",
        f"{a} against {b}",
        sentences or ["Every site has enough points, and its figures are above sampling."],
        [one for one in figures if one is not None],
        comparison_tables(sites),
        f"A: {a}; B, the reference: {b}; limit {1e3 * limit:g} mm. Nearest-neighbour distances "
        "are no accuracy: read them beside their floor.",
    )


def _sites(sites: Sequence[SiteResult], unit: str) -> Table:
    columns = [
        (Column("Site", numeric=False), lambda s: text_cell(s.name)),
        (Column("points of A"), lambda s: _count(s.n)),
        _metres("range A", _at("seen_a.range")),
        _metres("range B", _at("seen_b.range")),
        _degrees("incidence A", unit, _at("seen_a.incidence")),
        _degrees("incidence B", unit, _at("seen_b.incidence")),
        (Column("pitch A", "mm", wide=True), lambda s: _pitch(s, "pitch_a")),
        (Column("pitch B", "mm"), lambda s: _pitch(s, "pitch_b")),
        _mm("predicted σ", _at("predicted_sigma")),
    ]
    return build_table("sites", "Sites", _SITE_NOTE, sites, columns)


def _c2c(sites: Sequence[SiteResult]) -> Table:
    rows = [s for s in sites if s.c2c is not None]

    columns = [
        (Column("Site", numeric=False), lambda s: text_cell(s.name)),
        _mm("mean", _at("c2c.mean")),
        _mm("floor", _at("c2c.floor.mean")),
        _mm("std", _at("c2c.std")),
        _mm("floor", _at("c2c.floor.std")),
        _mm("RMS", _at("c2c.rms")),
        _mm("floor", _at("c2c.floor.rms")),
        _mm("debiased", _at("c2c.debiased")),
        _mm("median", _at("c2c.median"), wide=True),
        _mm("95 %", _at("c2c.q95"), wide=True),
        _percent("beyond", "c2c.beyond", wide=True),
        _mm("plane mean", _at("c2c.plane.mean"), wide=True),
        _mm("plane std", _at("c2c.plane.std")),
    ]
    return build_table("c2c", "Nearest points (C2C)", _C2C_NOTE, rows, columns)


def _m3c2(sites: Sequence[SiteResult]) -> Table:
    rows = [s for s in sites if s.m3c2 is not None]

    columns = [
        (Column("Site", numeric=False), lambda s: text_cell(s.name)),
        (Column("core points"), lambda s: _count(_at("m3c2.count")(s))),
        _mm("mean", _at("m3c2.mean")),
        _mm("std", _at("m3c2.std")),
        _mm("LoD", _at("m3c2.lod95")),
        _mm("quadratic", _at("m3c2.lod95_quadratic")),
        _percent("beyond it", "m3c2.changed"),
        _mm("cylinder", _at("m3c2.cylinder"), wide=True),
        _mm("normals over", _at("m3c2.scale"), wide=True),
    ]
    return build_table("m3c2", "Along normals (M3C2)", _M3C2_NOTE, rows, columns)


def _at(path: str) -> Callable[[SiteResult], float | None]:
    """A number of a site by the names that lead to it; None where one of them is None."""

    def get(site: SiteResult) -> float | None:
        value: Any = site
        for name in path.split("."):
            value = None if value is None else getattr(value, name)
        return None if value is None else float(value)

    return get


def _mm(
    head: str, get: Callable[[SiteResult], float | None], *, wide: bool = False
) -> tuple[Column, Make]:
    return Column(head, "mm", wide=wide), lambda s: number_cell(get(s), Style().small(get(s), "m"))


def _metres(head: str, get: Callable[[SiteResult], float | None]) -> tuple[Column, Make]:
    return Column(head, "m"), lambda s: number_cell(get(s), Style.plain(get(s), 2))


def _degrees(
    head: str, unit: str, get: Callable[[SiteResult], float | None]
) -> tuple[Column, Make]:
    factor = 200 / np.pi if unit == "gon" else 180 / np.pi

    def cell(site: SiteResult) -> Cell:
        angle = get(site)
        return number_cell(angle, "" if angle is None else f"{factor * angle:.1f}")

    return Column(head, "gon" if unit == "gon" else "°"), cell


def _pitch(site: SiteResult, name: str) -> Cell:
    pitch = getattr(site.c2c, name, None)
    if pitch is None:
        return text_cell("")
    return number_cell(pitch.across, f"{1e3 * pitch.across:.1f}×{1e3 * pitch.up:.1f}")


def _percent(head: str, path: str, *, wide: bool = False) -> tuple[Column, Make]:
    def cell(site: SiteResult) -> Cell:
        share = _at(path)(site)
        return number_cell(share, "" if share is None else f"{100 * share:.1f}")

    return Column(head, "%", wide=wide), cell


def _count(number: float | None) -> Cell:
    return number_cell(number, "" if number is None else f"{number:.0f}")


def _map(sites: Sequence[SiteResult]) -> Picture | None:
    """Distances in plan and in elevation along the longer side of the plan."""
    samples = [s.c2c.sample for s in sites if s.c2c is not None and s.c2c.count]
    if not samples:
        return None
    rows = np.concatenate(samples)
    rows = rows[np.argsort(rows[:, 3])]
    corner = np.floor(rows[:, :3].min(axis=0) / 10) * 10
    x, y, z, d = (rows - np.append(corner, 0)).T
    along, name = (x, "x") if np.ptp(x) >= np.ptp(y) else (y, "y")
    figure = Figure(figsize=(9.6, 4.4), dpi=100, layout="constrained")
    plan, side = figure.subplots(1, 2)
    top = max(1e3 * float(np.quantile(d, 0.98)), 1e-3)
    start = {"x": corner[0], "y": corner[1], "z": corner[2]}
    for panel, u, v, names in ((plan, x, y, "xy"), (side, along, z, f"{name}z")):
        shown = panel.scatter(u, v, c=1e3 * d, s=2, cmap="viridis", vmin=0, vmax=top)
        panel.set(aspect="equal", xlabel=f"{names[0]} - {start[names[0]]:.0f} m")
        panel.set_ylabel(f"{names[1]} - {start[names[1]]:.0f} m")
    figure.colorbar(shown, ax=[plan, side], label="nearest-neighbour distance [mm]", shrink=0.8)
    caption = (
        f"Plan and elevation; a sample of {len(rows):,} points, colours up to the 98 % quantile."
    )
    return picture("distances", "Distances", figure, caption)


def _histogram(sites: Sequence[SiteResult], limit: float) -> Picture | None:
    """Share of the distances per bin, all sites together, with the mean floor."""
    found: list[C2C] = [s.c2c for s in sites if s.c2c is not None and s.c2c.count]
    if not found:
        return None
    edges = found[0].tally.histogram(_BINS)[0]
    counts = np.sum([one.tally.histogram(_BINS)[1] for one in found], axis=0)
    figure = Figure(figsize=(6.4, 3.2), dpi=100, layout="constrained")
    panel = figure.subplots()
    panel.bar(1e3 * edges[:-1], counts, 1e3 * np.diff(edges), align="edge", color="#4878a8")
    known = [(one.floor.mean, one.count) for one in found if one.floor is not None]
    if known:
        mean = np.average([m for m, _ in known], weights=[n for _, n in known])
        panel.axvline(1e3 * mean, color="#c2571a", ls="--", label=f"mean floor {1e3 * mean:.1f} mm")
        panel.legend(frameon=False)
    last = int(np.searchsorted(np.cumsum(counts), 0.999 * counts.sum())) + 1
    panel.set_xlim(0, 1e3 * edges[min(last + 1, _BINS)])
    panel.set(xlabel="nearest-neighbour distance [mm]", ylabel="points")
    caption = f"All sites; {counts.sum():,} distances within {1e3 * limit:g} mm."
    return picture("histogram-distances", "Histogram of distances", figure, caption)
