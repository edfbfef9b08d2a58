"""Is what a survey says likely? Questions that only a person can answer, before anything is run.

Every sentence rests on a comparison that came out otherwise: another reading of the same numbers
(columns exchanged, another unit) fits what was measured where the given one does not.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyproj import CRS, Transformer
from pyproj.exceptions import CRSError, ProjError

from tribrach._types import Array
from tribrach.errors import AdjustmentError, InputError
from tribrach.io.survey.csv.file import read_table
from tribrach.job.nothing_found import odd_sizes
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.observations.control import Coordinates
from tribrach.observations.sights import (
    Directions,
    Distances,
    HorizontalDistances,
    SlopeDistances,
    ZenithAngles,
)
from tribrach.project import Project
from tribrach.sentences import Sentence

#: sigmas of control from which on their unit is asked for [m]
_COARSE, _FINE = 0.5, 1e-6
#: a figure of an instrument outside of these is asked for, by the end of its key
_USUAL = {"_mm": (0.005, 500.0), "_arcsec": (0.05, 600.0), "_ppm": (0.0, 200.0)}
#: places are this far outside of the area of a reference system before it is said [degrees]
_OUTSIDE = 1.0
#: what lies within this distance in plan may be one point [m]
_SAME_PLACE = 0.1
#: names that a sentence lists
_LISTED = 6
#: asked where two coordinates are exchanged
_COLUMNS = "are two columns of the list in each other's place"
#: what is read alike in names
_ALIKE = str.maketrans({"o": "0", "l": "1", "i": "1"})

Complex = NDArray[np.complex128]


def doubts(project: Project, survey: Survey) -> list[str]:
    """What looks wrong, one sentence each without the stop."""
    out = [*_figures(project), *_sigmas(survey)]
    given = {
        name: p.xyz
        for name, p in survey.points.items()
        if p.role in ("control", "fixed", "check") and np.isfinite(p.xyz[:2]).all()
    }
    polar = _polar(survey)
    figure = _shape(polar, 1.0)
    named = [*_names(survey, {} if figure is None else _lying_at(figure, given))]
    # targets of scans are not known yet
    out += named or ([] if project.scans else [*_all_idle(survey)])
    return [*out, *_area(project), *(() if figure is None else _geometry(polar, figure, given))]


def questions(project: Project, survey: Survey) -> list[str]:
    """What looks wrong, as questions, for a network that cannot be adjusted or fails its test."""
    return [sentence + "?" for sentence in doubts(project, survey)]


@contextmanager
def questioned(project: Project, survey: Survey) -> Iterator[None]:
    """A block that adjusts; its refusal says first what looks wrong in the input."""
    try:
        yield
    except AdjustmentError as error:
        error.because(questions(project, survey))
        raise
    except InputError as error:
        raise after_doubts(error, project, survey) from error


def after_doubts(error: InputError, project: Project, survey: Survey) -> InputError:
    """The error with what looks wrong in the project in front of it."""
    said = doubts(project, survey)
    if not said:
        return error
    what = "".join(f"{sentence}? " for sentence in said) + f"As it is: {error.what}"
    return InputError(what, file=error.file, line=error.line, record=error.record, cure=error.cure)


def _figures(project: Project) -> Iterator[str]:
    """Figures of instruments and sizes of targets of another unit than their key's."""
    for name, instrument in project.instruments.items():
        for figure in instrument.figures():
            if (
                figure.key not in instrument.model_fields_set
                or instrument.stated_by(figure.key) != "project"
            ):
                continue
            for end, (least, most) in _USUAL.items():
                if (
                    figure.key.endswith(end)
                    and figure.value
                    and not (least <= figure.value <= most)
                ):
                    unit = {"_mm": "millimetres", "_arcsec": "arc seconds", "_ppm": "ppm"}[end]
                    yield (
                        Sentence(
                            "[instruments.{name}]: {figure.key} is {figure.value:g}: is it in "
                            "{unit}",
                            name=name,
                            figure=figure,
                            unit=unit,
                        )
                    )
    yield from odd_sizes(project.targets)


def _sigmas(survey: Survey) -> Iterator[str]:
    """Sentences on sigmas of coordinates that look like another unit."""
    coarse: dict[str, float] = {}
    fine: dict[str, float] = {}
    for table in survey.tables():
        if table.kind is not Coordinates:
            continue
        roots = np.sqrt(np.einsum("nii->ni", table.columns["covariance"]))
        use = np.broadcast_to(table.columns.get("use", Use.ACTIVE), table.n)
        for name, sigma, one in zip(table.columns["position"], roots, use, strict=True):
            if one == Use.ACTIVE and sigma.max() >= _COARSE:
                coarse[str(name)] = float(sigma.max())
            elif one == Use.ACTIVE and sigma.min() < _FINE:
                fine[str(name)] = float(sigma.min())
    if coarse:
        name, value = next(iter(coarse.items()))
        yield (
            Sentence(
                "the sigma of control point {name} is {value:mg}{others}: is it in millimetres "
                "(columns sigma_e_mm, heads sE [mm])",
                name=name,
                value=value,
                others=_others(coarse),
            )
        )
    if fine:
        name, value = next(iter(fine.items()))
        yield (
            Sentence(
                "the sigma of control point {name} is {value:mmg2}{others}: is it in metres "
                "(columns sigma_e_m, heads sE [m])",
                name=name,
                value=value,
                others=_others(fine),
            )
        )


def _others(found: dict[str, float]) -> str:
    return f", and that of {len(found) - 1} others is like it" if len(found) > 1 else ""


def observed_points(survey: Survey) -> set[str]:
    """Names of points that observations go from or to."""
    out: set[str] = set()
    for table in survey.tables():
        if table.kind is Coordinates:
            continue
        for key in ("start", "end", "position", "point", "target"):
            column = table.columns.get(key)
            if isinstance(column, list | np.ndarray):
                out.update(str(name) for name in np.ravel(np.asarray(column, dtype=object)))
    return out - {""}


def _names(survey: Survey, lying_at: dict[str, tuple[str, float]]) -> Iterator[str]:
    """Points that nothing observes, beside observed ones at their place or of nearly their name.

    lying_at : of each given point the observed one that lies there, and how far off [m].
    """
    listed = {n for n, p in survey.points.items() if p.role in ("control", "fixed", "check")}
    observed = observed_points(survey)
    idle, unlisted = (
        sorted(listed - observed),
        sorted(
            observed - set(survey.points)
            | {name for name in observed if name in survey.points and name not in listed}
        ),
    )
    by_sound: dict[str, list[str]] = defaultdict(list)
    for name in unlisted:
        by_sound[_sound(name)].append(name)
    for name in idle:
        there, off = lying_at.get(name, ("", 0.0))
        if there in unlisted:
            yield (
                Sentence(
                    "point {name} of the lists is observed by nothing, and {there}, which is "
                    "observed and in no list, lies {off:m2} from where {name} is given: is {there} "
                    "meant to be {name}",
                    name=name,
                    there=there,
                    off=off,
                )
            )
            continue
        alike = by_sound.get(_sound(name)) or [o for o in unlisted if _one_edit(name, o)]
        if alike:
            yield (
                f"point {name} of the lists is observed by nothing, and {alike[0]} is observed "
                f"and in no list: is {alike[0]} meant to be {name}"
            )


def _all_idle(survey: Survey) -> Iterator[str]:
    """Control of which nothing is observed, beside what is."""
    control = [n for n, p in survey.points.items() if p.role in ("control", "fixed")]
    observed = observed_points(survey)
    if control and observed and not observed & set(control):
        yield (
            f"none of the control points ({', '.join(control[:_LISTED])}) is observed; observed "
            f"are {', '.join(sorted(observed)[:_LISTED])}: are they the same points under other "
            "names"
        )


def _sound(name: str) -> str:
    """A name without capitals, blanks, dashes and leading zeros."""
    plain = re.sub(r"[^0-9a-z]", "", name.casefold().translate(_ALIKE))
    return re.sub(r"(?<!\d)0+(?=[0-9a-z])", "", plain)


def _one_edit(a: str, b: str) -> bool:
    """True if one letter, and no digit, makes one name of another."""
    a, b = a.casefold(), b.casefold()
    if min(len(a), len(b)) < 4 or re.sub(r"\D", "", a) != re.sub(r"\D", "", b):
        return False
    if len(a) == len(b):
        wrong = [k for k in range(len(a)) if a[k] != b[k]]
        swapped = len(wrong) == 2 and a[wrong[0]] == b[wrong[1]] and a[wrong[1]] == b[wrong[0]]
        return len(wrong) == 1 or swapped
    long, short = (a, b) if len(a) > len(b) else (b, a)
    return len(long) - len(short) == 1 and any(
        long[:k] + long[k + 1 :] == short for k in range(len(long))
    )


def _area(project: Project) -> Iterator[str]:
    """Coordinates outside of the area of their reference system, and what would put them there."""
    code = project.site.crs
    grid = np.concatenate([*_given(project), np.zeros((0, 2))])
    if code is None or not len(grid):
        return
    middle = np.median(grid, axis=0)
    try:
        crs = CRS.from_user_input(code)
        area = crs.area_of_use
        to_degrees = Transformer.from_crs(crs, "EPSG:4326", always_xy=True)
    except (CRSError, ProjError):
        return
    if area is None:
        return

    def inside(east: float, north: float) -> bool:
        lon, lat = to_degrees.transform(east, north)
        return bool(
            np.isfinite([lon, lat]).all()
            and area.west - _OUTSIDE <= lon <= area.east + _OUTSIDE
            and area.south - _OUTSIDE <= lat <= area.north + _OUTSIDE
        )

    east, north = float(middle[0]), float(middle[1])
    if inside(east, north):
        return
    what = Sentence(
        "the coordinates, about E {east:0} N {north:0}, lie outside of the area of {code}",
        east=east,
        north=north,
        code=code,
    )
    what += f" ({area.name})" if area.name else ""
    if inside(north, east):
        yield Sentence(
            "{what}, and inside if easting and northing are exchanged: {columns}",
            what=what,
            columns=_COLUMNS,
        )
    elif inside(east / 1e3, north / 1e3):
        yield Sentence("{what}, and inside as millimetres: are they metres", what=what)
    elif inside(east * 1e3, north * 1e3):
        yield Sentence("{what}, and inside as kilometres: are they metres", what=what)
    elif inside(east % 1e6, north):
        yield (
            Sentence(
                "{what}, and inside without the first {two} of the easting: that is the number "
                "of the zone, which other codes have",
                what=what,
                two="two digits" if east >= 10000000.0 else "digit",
            )
        )
    else:
        yield Sentence("{what}: is this their reference system", what=what)


def _given(project: Project) -> Iterator[Array]:
    """Eastings and northings (n, 2) [m] of each list, as it has them."""
    for part in project.points:
        with suppress(InputError):
            table = read_table(project.folder / part.file, part.form)
            if table.has("e", "n"):
                plan = np.stack([table.number("e"), table.number("n")], axis=1)
                yield plan[np.isfinite(plan).all(axis=1)]


@dataclass(frozen=True)
class _Figure:
    """Points in a plane of their own, as a station or several together saw them."""

    places: dict[str, complex]

    def joined(self, other: _Figure) -> _Figure | None:
        """Both together, where they share two points that fit; None where they do not."""
        names = [name for name in other.places if name in self.places]
        if len(names) < 2:
            return None
        a = np.array([other.places[name] for name in names])
        b = np.array([self.places[name] for name in names])
        turn, shift, rms = _fit(a, b)
        if rms > 0.05 * float(np.abs(a - a.mean()).max()) + 0.05:
            return None
        moved = {name: turn * place + shift for name, place in other.places.items()}
        return _Figure(moved | self.places)


def _fit(a: Complex, b: Complex) -> tuple[complex, complex, float]:
    """Turn and shift from a (n,) to b (n,), and the RMS of the residuals [m]."""
    ca, cb = a.mean(), b.mean()
    product = complex(np.sum(np.conj(a - ca) * (b - cb)))
    turn = product / abs(product) if product else 1.0 + 0j
    left = b - cb - turn * (a - ca)
    return turn, complex(cb - turn * ca), float(np.sqrt(np.mean(np.abs(left) ** 2)))


def _polar(survey: Survey) -> dict[str, dict[str, tuple[float, float]]]:
    """Direction [rad] and horizontal distance [m] by set-up and target; the set-up is ``""``'s."""
    readings: dict[str, dict[tuple[str, str], float]] = defaultdict(dict)
    first: dict[tuple[str, str], tuple[str, float]] = {}
    for table in survey.tables():
        columns: dict[str, Any] = table.columns
        if table.kind not in (
            Directions, Distances, SlopeDistances, HorizontalDistances, ZenithAngles
        ):  # fmt: skip
            continue
        ends = zip(columns["start"], columns["end"], strict=True)
        values = np.ravel(columns["values"])
        orientations = columns.get("orientation", [""] * table.n)
        for (a, b), value, orientation in zip(ends, values, orientations, strict=True):
            key = str(a), str(b)
            if table.kind is Directions:
                first.setdefault((str(orientation), key[1]), (key[0], float(value)))
            else:
                readings[table.kind.__name__].setdefault(key, float(value))
    out: dict[str, dict[str, tuple[float, float]]] = defaultdict(dict)
    for (orientation, end), (start, direction) in first.items():
        far = _level(readings, (start, end))
        if far is not None:
            out[f"{start}\0{orientation}"][end] = direction, far
    return out


def _level(readings: dict[str, dict[tuple[str, str], float]], key: tuple[str, str]) -> float | None:
    """Horizontal distance [m] of a sight, from what was measured of it."""
    flat = readings["HorizontalDistances"].get(key)
    if flat is not None:
        return flat
    slope = readings["SlopeDistances"].get(key, readings["Distances"].get(key))
    if slope is None:
        return None
    zenith = readings["ZenithAngles"].get(key)
    return slope if zenith is None else slope * abs(float(np.sin(zenith)))


def _shape(polar: dict[str, dict[str, tuple[float, float]]], scale: float) -> _Figure | None:
    """The largest figure that the set-ups make together, angles taken times a scale."""
    figures = []
    for key, sights in polar.items():
        station = key.split("\0")[0]
        # clockwise from north: the east is the imaginary part of north
        places = {
            end: far * complex(np.sin(scale * angle), np.cos(scale * angle))
            for end, (angle, far) in sights.items()
        }
        figures.append(_Figure({station: 0j, **places}))
    figures.sort(key=lambda one: -len(one.places))
    whole: _Figure | None = None
    while figures:
        if whole is None:
            whole = figures.pop(0)
        for k, other in enumerate(figures):
            joined = whole.joined(other)
            if joined is not None:
                whole = joined
                figures.pop(k)
                break
        else:
            break
    return whole


def _lying_at(figure: _Figure, given: dict[str, Array]) -> dict[str, tuple[str, float]]:
    """Measured points at the places of given ones that were not measured, and how far off [m]."""
    common = [name for name in figure.places if name in given]
    others = [name for name in figure.places if name not in given]
    if len(common) < 2 or not others:
        return {}
    b = np.array([complex(*given[name][:2]) for name in common])
    turn, shift, rms = _fit(np.array([figure.places[name] for name in common]), b)
    if rms > _SAME_PLACE:
        return {}
    seen = turn * np.array([figure.places[name] for name in others]) + shift
    out = {}
    for name in given.keys() - figure.places.keys():
        off = np.abs(seen - complex(*given[name][:2]))
        k = int(np.argmin(off))
        if off[k] <= _SAME_PLACE:
            out[name] = others[k], float(off[k])
    return out


def _geometry(
    polar: dict[str, dict[str, tuple[float, float]]], figure: _Figure, given: dict[str, Array]
) -> Iterator[str]:
    """Given coordinates against what total stations measured between them."""
    names = [name for name in figure.places if name in given]
    xyz = np.array([given[name] for name in names]).reshape(-1, 3)
    yield from _lengths(figure, names, xyz)
    if len(names) < 3:
        return

    def left(places: dict[str, complex], axes: tuple[int, int], factor: float = 1.0) -> float:
        a = np.array([places[name] for name in names])
        b = factor * (xyz[:, axes[0]] + 1j * xyz[:, axes[1]])
        return _fit(a, b)[2] if np.isfinite(b).all() else np.inf

    extent = float(np.abs(np.array([figure.places[name] for name in names])).max())
    as_given = left(figure.places, (0, 1))
    if as_given <= 0.02 * extent + 0.1:
        return
    told = f"{len(names)} given points ({', '.join(names[:_LISTED])}) do not fit what was measured "
    told += Sentence("between them: {as_given:m2} are left", as_given=as_given)
    good = 0.1 * as_given
    others = {
        f"easting and northing are exchanged: {_COLUMNS}": left(figure.places, (1, 0)),
        f"northing and height are exchanged: {_COLUMNS}": left(figure.places, (0, 2)),
        f"easting and height are exchanged: {_COLUMNS}": left(figure.places, (2, 1)),
    }
    for scale, words in (
        (10 / 9, "the angles are taken as degrees instead of gon: is their unit right"),
        (9 / 10, "the angles are taken as gon instead of degrees: is their unit right"),
    ):
        turned = _shape(polar, scale)
        if turned is not None and all(name in turned.places for name in names):
            others[words] = left(turned.places, (0, 1))
    best = min(others, key=lambda words: others[words])
    if others[best] < good:
        yield Sentence("{told}, and {left:m2} if {best}", told=told, left=others[best], best=best)
    else:
        yield Sentence("{told}: are these the same points, in metres", told=told)


def _lengths(figure: _Figure, names: list[str], xyz: Array) -> Iterator[str]:
    """The scale between given coordinates and measured lengths, where it is that of a unit."""
    if len(names) < 2:
        return
    a = np.array([figure.places[name] for name in names])
    b = xyz[:, 0] + 1j * xyz[:, 1]
    measured, known = np.abs(a[:, None] - a), np.abs(b[:, None] - b)
    pairs = np.triu(measured > 1.0, 1) & (known > 1e-3)
    if not pairs.any():
        return
    ratio = float(np.median(known[pairs] / measured[pairs]))
    for factor, words in (
        (1000.0, "the coordinates are millimetres"),
        (0.001, "the coordinates are kilometres, or the distances millimetres"),
        (1 / 0.3048, "the coordinates are feet"),
        (0.3048, "the distances are feet"),
    ):
        if abs(ratio / factor - 1) < 0.02:
            yield (
                Sentence(
                    "given points ({names}) lie {ratio:g4} times as far apart as the distances "
                    "between them say: it looks as if {words}",
                    names=", ".join(names[:_LISTED]),
                    ratio=ratio,
                    words=words,
                )
            )
