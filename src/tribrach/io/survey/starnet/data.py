"""Data lines of STAR*NET: coordinates, sights, sets, traverses, levelling, vectors, side shots.

Lines become the records of :mod:`tribrach.io.survey.starnet.records`; everything that is wrong is
gathered and told at once. Besides STAR*NET's own lines those of a program that imitates it are
read: names without a separator between them, instruments in lines ``I``, traverses whose first
line names both stations, directions in both faces, azimuths of side shots written ``AZ=``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from tribrach.errors import InputError, RefusalCollector
from tribrach.io.named_files import named_file
from tribrach.io.opened_files import lines_of
from tribrach.io.survey.starnet.options import InlineOptions
from tribrach.io.survey.starnet.records import (
    Given,
    Level,
    Quantity,
    SideShot,
    Sight,
    Sigma,
    SigmaMark,
    StarnetRecords,
    Vector,
)
from tribrach.io.survey.starnet.settings import StandardErrors, StarnetSettings
from tribrach.io.survey.starnet.text import (
    DataLine,
    angle_of,
    azimuth_of,
    data_line,
    number_of,
    text_of,
)
from tribrach.units import SEC

#: how deep files may include each other
MAX_DEPTH = 5
#: what is measured along one line, of slope and zenith or of horizontal distance and height
_SLOPED = (Quantity.SLOPE, Quantity.ZENITH)
_LEVELLED = (Quantity.LEVEL_DISTANCE, Quantity.RISE)
#: readings of one target in both faces differ by half a circle, to this [rad]
_FACES_APART = math.radians(0.5)
_MARKS = {mark.value: mark for mark in SigmaMark}
#: data types whose description is that of the point that they begin with, or that they end at
_NAMED = ("C", "CH", "P", "PH", "E", "EH", "DB", "DN", "DM")
_SIGHTED = ("A", "B", "D", "V", "DV", "M", "BM", "SS")
#: the word for an observation that was not made
_NOTHING = "?"


@dataclass
class _Set:
    """Directions of one set-up."""

    at: str
    name: str
    line: DataLine
    read: dict[str, float] = field(default_factory=dict)  #: first reading of each target


@dataclass
class _Traverse:
    """A traverse: the point before, and the lines of each point that is occupied."""

    line: DataLine
    back: str = ""
    bearing: float | None = None
    legs: list[tuple[str, DataLine, tuple[str, ...]]] = field(default_factory=list)
    ahead: bool = False  #: the first line names the occupied point, the others the next one


class DataReader:
    """Reads data files, included ones within ``root``, into records; ``refused`` gathers lines."""

    def __init__(self, settings: StarnetSettings, refused: RefusalCollector, root: Path) -> None:
        self.settings, self.refused, self.root = settings, refused, root.resolve()
        self.records = StarnetRecords(settings.kind)
        self._options = InlineOptions.of(settings)
        self._set: _Set | None = None
        self._sets = 0
        self._traverse: _Traverse | None = None
        self._vector: Vector | None = None
        #: the lines of a vector whose first one was refused are no further mistakes
        self._refused_vector = False
        #: occupied point and backsight of the last traverse or set, for side shots
        self._setup: tuple[str, str] | None = None

    def read(self, path: Path, label: str) -> None:
        """Read one file with those that it includes."""
        with self.refused.record():
            for line in self._lines(path, label, 1):
                with self.refused.record():
                    self._take(line)
        with self.refused.record():
            self._close()

    @property
    def stated(self) -> StarnetSettings:
        """The settings of the project, with what options say of the whole job."""
        return replace(
            self.settings, grid=self._options.settings.grid, crs=self._options.settings.crs
        )

    def finish(self) -> StarnetRecords:
        """The records of everything that was read."""
        self.records.kind = self._options.kind
        return self.records

    def _lines(self, path: Path, label: str, depth: int) -> Iterator[DataLine]:
        """Lines with data of a file, and of files that it includes."""
        for number, text in enumerate(lines_of(text_of(path)), start=1):
            if self._options.ended:
                return
            line = data_line(text, path, label, number)
            if line is None:
                continue
            if not _is_include(line) or self._options.off:
                yield line
                continue
            with self.refused.record():
                other = self._included(line, depth)
                yield from self._lines(other, _relative(line).as_posix(), depth + 1)

    def _included(self, line: DataLine, depth: int) -> Path:
        """The file that an option includes."""
        name = _relative(line).as_posix()
        if depth >= MAX_DEPTH:
            raise line.error(f"{name} is the {MAX_DEPTH}th file inside a file")
        try:
            return named_file(name, line.folder, self.root)
        except InputError as error:
            raise line.error(error.what, error.cure) from error

    def _take(self, line: DataLine) -> None:
        """One line."""
        if line.code.startswith("."):
            self._options.take(line)
            return
        if self._options.off:
            return
        if line.code not in CODES:
            raise line.error(
                f"the data type {line.code} is not known", f"there are {', '.join(sorted(CODES))}"
            )
        if self._vector is not None and line.code not in ("G2", "G3"):
            self._vector = None
        getattr(self, CODES[line.code])(line)
        if line.description and line.code in (*_NAMED, *_SIGHTED):
            name = self._names[-1] if line.code in _SIGHTED else line.words[0]
            self.records.codes.append((name, line.description))

    # Words of a line.

    def _split(self, line: DataLine, least: int, most: int | None = None) -> tuple[str, ...]:
        """Names of a line, ``least`` to ``most``, joined or not; then the words behind them."""
        most = least if most is None else most
        if not line.words:
            raise line.error("there are no stations", "name them")
        parts = line.words[0].split(self._options.separator)
        if not all(parts):
            raise line.error(f"a station of {line.words[0]!r} has no name")
        rest = line.words[1:]
        if len(parts) == 1 and least > 1:
            parts, rest = [*parts, *rest[: least - 1]], rest[least - 1 :]
        if not least <= len(parts) <= most:
            listed = f"{least}" if least == most else f"{least} or {most}"
            raise line.error(
                f"{line.words[0]!r} names {len(parts)} stations instead of {listed}",
                "names with a hyphen need another .SEPARATOR",
            )
        if len(set(parts)) != len(parts):
            raise line.error(f"{'-'.join(parts)} names a station twice")
        self._names = tuple(parts)
        return rest

    def _sigma(self, word: str, unit: float, line: DataLine) -> Sigma:
        """A standard error, or what stands in its place."""
        if word in _MARKS:
            return _MARKS[word]
        value = number_of(word, "the standard error", line) * unit
        if not value > 0:
            raise line.error(
                f"the standard error is {word}", "give it above zero, or ! to hold the value"
            )
        return value

    def _parts(
        self, words: Sequence[str], units: Sequence[float], line: DataLine
    ) -> tuple[list[Sigma], tuple[float, float]]:
        """Standard errors of so many observations, and the heights of instrument and target."""
        words = list(words)
        heights = (0.0, 0.0)
        if words and "/" in words[-1]:
            both = words.pop().split("/")
            if len(both) != 2:
                raise line.error("heights are written as instrument/target")
            first, second = (number_of(word, "a height", line) for word in both)
            heights = (first * self._options.length_unit, second * self._options.length_unit)
        if len(words) > len(units):
            raise line.error(
                f"{len(words)} standard errors for {len(units)} "
                f"observation{'s' if len(units) > 1 else ''}: {' '.join(words)}",
                "give one for each, and describe the point after an apostrophe",
            )
        sigmas = [self._sigma(word, unit, line) for word, unit in zip(words, units, strict=False)]
        return sigmas + [SigmaMark.DEFAULT] * (len(units) - len(sigmas)), heights

    def _unit(self, quantity: Quantity) -> float:
        """Unit of standard errors of a quantity [m or rad]."""
        angular = quantity not in (Quantity.SLOPE, Quantity.LEVEL_DISTANCE, Quantity.RISE)
        return self._options.angle_error if angular else self._options.length_unit

    def _value(self, quantity: Quantity, word: str, line: DataLine) -> float:
        """A measured value [m or rad]."""
        options = self._options
        name = f"the {quantity.value}"
        if quantity is Quantity.BEARING:
            turned = azimuth_of(word, name, line, gon=options.gon) + options.rotation
            return turned % (2 * math.pi)
        if quantity in (Quantity.DIRECTION, Quantity.ANGLE):
            return angle_of(word, name, line, gon=options.gon) % (2 * math.pi)
        if quantity is Quantity.ZENITH:
            value = angle_of(word, name, line, gon=options.gon)
            if not 0 < value < 2 * math.pi or value == math.pi:
                raise line.error(f"the zenith angle is {word}", "it is between 0 and 180 degrees")
            return value
        value = number_of(word, name, line) * options.length_unit
        if quantity is not Quantity.RISE and not value > 0:
            raise line.error(f"{name} is {word}", "give it above zero")
        return value

    def _measured(
        self, line: DataLine, words: Sequence[str], quantities: Sequence[Quantity], **names: str
    ) -> list[Sight]:
        """Sights of one line: values, their standard errors, heights."""
        n = len(quantities)
        planned = not any(_is_value(word) for word in words[:n])
        tail = words if planned else words[n:]
        if not planned and len(words) < n:
            listed = ", ".join(q.value for q in quantities)
            raise line.error(f"{len(words)} values instead of {n}: {listed}", "give all of them")
        sigmas, heights = self._parts(tail, [self._unit(q) for q in quantities], line)
        values: list[float | None] = [None] * n
        if not planned:
            values = [
                None if word == _NOTHING else self._value(quantity, word, line)
                for quantity, word in zip(quantities, words[:n], strict=True)
            ]
        return self._sights(line, quantities, values, sigmas, heights, planned, **names)

    def _sights(
        self,
        line: DataLine,
        quantities: Sequence[Quantity],
        values: Sequence[float | None],
        sigmas: Sequence[Sigma],
        heights: tuple[float, float],
        planned: bool,
        *,
        at: str,
        to: str,
        back: str = "",
        set_name: str = "",
    ) -> list[Sight]:
        """Records of one line that share its ends."""
        known = dict(zip(quantities, values, strict=True))
        zenith = known.get(Quantity.ZENITH)
        if zenith is not None and zenith > math.pi:
            known[Quantity.ZENITH] = zenith = 2 * math.pi - zenith
            self.records.face_two.append(line.source)
        slope, level = known.get(Quantity.SLOPE), known.get(Quantity.LEVEL_DISTANCE)
        length = level if level is not None else slope
        rise = known.get(Quantity.RISE) or 0.0
        if slope is not None and zenith is not None:
            length, rise = slope * math.sin(zenith), slope * math.cos(zenith)
        options = self._options
        if options.grid_distances and slope is not None:
            raise line.error(
                "distances are said to be on the grid, and this one is along the slope",
                "write .DELTA ON where distances are horizontal, or .MEASURED DISTANCES before it",
            )
        errors = options.errors
        if not options.centring:
            errors = _without_centring(errors)
        if any(sigma is SigmaMark.DEFAULT for sigma in sigmas) and not options.instrument:
            self.records.assumed.update(
                q.value for q, s in zip(quantities, sigmas, strict=True) if s is SigmaMark.DEFAULT
            )
        return [
            Sight(
                quantity,
                known[quantity],
                sigma,
                at,
                to,
                back if quantity is Quantity.ANGLE else "",
                heights,
                errors,
                set_name,
                options.refraction,
                length,
                rise,
                options.add_centring,
                options.propagated,
                options.scale,
                line.source,
                options.grid_distances and quantity is Quantity.LEVEL_DISTANCE,
            )
            for quantity, sigma in zip(quantities, sigmas, strict=True)
            if known[quantity] is not None or planned
        ]

    def _pair(self) -> tuple[Quantity, ...]:
        """What a line of all measurements holds beside its direction or angle."""
        if self._options.plane:
            return (Quantity.LEVEL_DISTANCE,)
        return _LEVELLED if self._options.delta else _SLOPED

    def _plane_words(self, words: Sequence[str], most: int) -> Sequence[str]:
        """Words of a line in plan that carries a vertical value and its standard error as well."""
        if self._options.plane and len(words) == most and all(map(_is_value, words[:3])):
            return [*words[:2], *words[3:5]]
        return words

    # Coordinates.

    def _c(self, line: DataLine) -> None:
        self._coordinates(line, geographic=False)

    def _p(self, line: DataLine) -> None:
        self._coordinates(line, geographic=True)

    def _coordinates(self, line: DataLine, *, geographic: bool) -> None:
        """``C`` and ``P``: two or three coordinates and their standard errors."""
        if not line.words:
            raise line.error("there is no station", "name it")
        name, words = line.words[0], list(line.words[1:])
        axes = 2 if self._options.plane else 3
        if axes == 2 and len(words) in (3, 5) and _is_number(words[2]) and float(words[2]) == 0:
            # a height of zero beside coordinates in plan
            del words[2]
        if axes == 2 and len(words) == 6:
            del words[5], words[2]
        numbers = 0
        while numbers < min(axes, len(words)) and words[numbers] not in _MARKS:
            numbers += 1
        if numbers < axes and not (axes == 3 and numbers == 2):
            raise line.error(
                f"{name} has {numbers} coordinates instead of {axes}", "give all of them"
            )
        sigma_words = words[numbers:]
        if len(sigma_words) > axes:
            raise line.error(
                f"{name} has {len(sigma_words)} standard errors for {axes} coordinates",
                "give one for each, and describe the point after an apostrophe",
            )
        unit = self._options.length_unit
        if geographic:
            plan = self._geographic(words[:2], line)
        else:
            plan = [number_of(word, "a coordinate", line) * unit for word in words[:2]]
        sigmas: list[Sigma] = []
        for word in sigma_words:
            sigma = self._sigma(word, unit, line)
            sigmas.append(SigmaMark.FREE if sigma is SigmaMark.DEFAULT else sigma)
        sigmas += [SigmaMark.FREE] * (3 - len(sigmas))
        if not self._options.east_first or geographic:
            plan, sigmas = plan[::-1], [sigmas[1], sigmas[0], sigmas[2]]
        height = None
        if numbers == 3:
            height = number_of(words[2], "the height", line) * unit
        self._give(name, plan[0], plan[1], height, sigmas, line, geographic=geographic)

    def _geographic(self, words: Sequence[str], line: DataLine) -> list[float]:
        """Latitude and longitude [rad], east positive."""
        latitude = angle_of(words[0].rstrip("NnSs"), "the latitude", line)
        longitude = angle_of(words[1].rstrip("EeWw"), "the longitude", line)
        if words[0][-1] in "Ss":
            latitude = -latitude
        west = self._options.west_positive
        if words[1][-1] in "EeWw":
            west = words[1][-1] in "Ww"
        if abs(latitude) > math.pi / 2:
            raise line.error(f"the latitude is {words[0]}, beyond the pole")
        return [latitude, -longitude if west else longitude]

    def _e(self, line: DataLine) -> None:
        """``E``: the height of a station."""
        if len(line.words) not in (2, 3):
            raise line.error("a height needs a station and a number, and may have a standard error")
        unit = self._options.length_unit
        height = number_of(line.words[1], "the height", line) * unit
        sigma = self._sigma(line.words[2], unit, line) if len(line.words) == 3 else SigmaMark.FREE
        sigma = SigmaMark.FREE if sigma is SigmaMark.DEFAULT else sigma
        free = SigmaMark.FREE
        self._give(line.words[0], None, None, height, [free, free, sigma], line)

    def _give(
        self,
        name: str,
        east: float | None,
        north: float | None,
        height: float | None,
        sigmas: Sequence[Sigma],
        line: DataLine,
        *,
        geographic: bool = False,
    ) -> None:
        self.records.given.append(
            Given(
                name,
                east,
                north,
                height,
                (sigmas[0], sigmas[1], sigmas[2]),
                geographic,
                line.code.endswith("H"),
                line.source,
            )
        )

    # Single observations and all measurements of a sight.

    def _ends(self, line: DataLine) -> tuple[dict[str, str], tuple[str, ...]]:
        rest = self._split(line, 2)
        return {"at": self._names[0], "to": self._names[1]}, rest

    def _turned(self, line: DataLine) -> tuple[dict[str, str], tuple[str, ...]]:
        """Names of an angle in the order of the file."""
        rest = self._split(line, 3)
        at, back, to = self._names
        if self._options.from_at_to:
            at, back = back, at
        return {"at": at, "back": back, "to": to}, rest

    def _a(self, line: DataLine) -> None:
        names, rest = self._turned(line)
        if self._options.directed:
            del names["back"]
            self._add(self._measured(line, rest, (Quantity.BEARING,), **names))
            return
        self._add(self._measured(line, rest, (Quantity.ANGLE,), **names))

    def _b(self, line: DataLine) -> None:
        names, rest = self._ends(line)
        self._add(self._measured(line, rest, (Quantity.BEARING,), **names))

    def _d(self, line: DataLine) -> None:
        names, rest = self._ends(line)
        level = self._options.plane or self._options.delta
        kind = Quantity.LEVEL_DISTANCE if level else Quantity.SLOPE
        self._add(self._measured(line, rest, (kind,), **names))

    def _v(self, line: DataLine) -> None:
        names, rest = self._ends(line)
        kind = Quantity.RISE if self._options.delta else Quantity.ZENITH
        self._add(self._measured(line, rest, (kind,), **names))

    def _dv(self, line: DataLine) -> None:
        names, rest = self._ends(line)
        self._add(
            self._measured(line, rest, _LEVELLED if self._options.delta else _SLOPED, **names)
        )

    def _m(self, line: DataLine) -> None:
        names, rest = self._turned(line)
        rest = tuple(self._plane_words(rest, 6))
        self._add(self._measured(line, rest, (Quantity.ANGLE, *self._pair()), **names))

    def _bm(self, line: DataLine) -> None:
        names, rest = self._ends(line)
        rest = tuple(self._plane_words(rest, 6))
        self._add(self._measured(line, rest, (Quantity.BEARING, *self._pair()), **names))

    def _add(self, sights: Iterable[Sight]) -> None:
        self.records.sights += sights

    # Sets of directions.

    def _db(self, line: DataLine) -> None:
        if self._set is not None:
            first = self._set.line.source
            self._set = None
            self._begin_set(line)
            raise line.error(f"the set that begins at {first} does not end", "end it with DE")
        self._begin_set(line)

    def _begin_set(self, line: DataLine) -> None:
        if not line.words:
            raise line.error("the set has no station", "name it")
        words = list(line.words)
        if len(words) > 1 and words[0].upper() in self._options.library:
            self._options.instrument = words.pop(0).upper()
        self._sets += 1
        self._set = _Set(words[0], f"set {self._sets} at {words[0]} ({line.source})", line)
        if len(words) > 1:
            self._setup = (words[0], words[1])

    def _dn(self, line: DataLine) -> None:
        self._direction(line, ())

    def _dm(self, line: DataLine) -> None:
        self._direction(line, self._pair())

    def _direction(self, line: DataLine, pair: tuple[Quantity, ...]) -> None:
        if self._set is None:
            raise line.error("there is no set of directions", "begin it with DB")
        if not line.words:
            raise line.error("the direction has no target", "name it")
        to, rest = line.words[0], line.words[1:]
        if to == self._set.at:
            raise line.error(f"{to} is its own target")
        names = {"at": self._set.at, "to": to, "set_name": self._set.name}
        if pair:
            rest = tuple(self._plane_words(rest, 6))
        sights = self._measured(line, rest, (Quantity.DIRECTION, *pair), **names)
        self._add(self._one_face(sights, line))

    def _one_face(self, sights: list[Sight], line: DataLine) -> list[Sight]:
        """Readings in the second face turned by half a circle, where both faces are written."""
        assert self._set is not None
        if not sights or sights[0].quantity is not Quantity.DIRECTION or sights[0].value is None:
            return sights
        value, to = sights[0].value, sights[0].to
        first = self._set.read.setdefault(to, value)
        apart = abs((value - first) % (2 * math.pi) - math.pi)
        if self._options.normalize and apart < _FACES_APART:
            turned = (value - math.pi) % (2 * math.pi)
            sights[0] = _with_value(sights[0], turned)
        return sights

    def _de(self, line: DataLine) -> None:
        if self._set is None:
            raise line.error("there is no set of directions", "begin it with DB")
        self._set = None

    # Traverses.

    def _tb(self, line: DataLine) -> None:
        if self._traverse is not None:
            first = self._traverse.line.source
            self._traverse = None
            raise line.error(f"the traverse that begins at {first} does not end", "end it with TE")
        self._traverse = traverse = _Traverse(line)
        words = line.words
        if len(words) >= 2 and not _is_value(words[0]):
            # occupied point and backsight: each line names the point ahead
            traverse.ahead = True
            traverse.back = words[1]
            self._setup = (words[0], words[1])
            traverse.legs.append((words[0], line, ()))
        elif words and (_is_bearing(words[0]) or len(words) == 2):
            traverse.bearing = azimuth_of(words[0], "the bearing", line, gon=self._options.gon)
            traverse.back = words[1] if len(words) == 2 else ""
        elif words:
            traverse.back = words[0]

    def _t(self, line: DataLine) -> None:
        if self._traverse is None:
            raise line.error("there is no traverse", "begin it with TB")
        if not line.words:
            raise line.error("there is no station", "name it")
        self._traverse.legs.append((line.words[0], line, line.words[1:]))

    def _te(self, line: DataLine) -> None:
        """The end of a traverse, with a closing angle or bearing if there is one."""
        if self._traverse is None:
            raise line.error("there is no traverse", "begin it with TB")
        traverse, self._traverse = self._traverse, None
        if not line.words:
            raise line.error("the traverse ends nowhere", "name the last station")
        if traverse.ahead:
            if len(line.words) > 1:
                traverse.legs.append((line.words[0], line, line.words[1:]))
            self._legs_ahead(traverse)
            return
        if not traverse.legs:
            raise line.error("the traverse has no lines T", "add them")
        if self._options.maps and self._options.map_angles and not traverse.back:
            # a closed traverse of bearings looks back along its last line
            traverse.back = traverse.legs[-1][0]
            traverse.bearing = self._reversed_last(traverse)
        end, rest = line.words[0], line.words[1:]
        self._legs(traverse, end)
        before = traverse.legs[-1][0]
        if len(rest) >= 2 and not self._options.maps:
            self._closing(line, rest, end, before)
        elif rest and not self._options.maps:
            raise line.error("the closing angle has no foresight", "name the station sighted")

    def _closing(self, line: DataLine, rest: Sequence[str], end: str, before: str) -> None:
        """The angle at the last station, from the one before to a station or a fixed bearing."""
        words = (rest[0], *rest[2:])
        if not _is_bearing(rest[1]):
            angle = (Quantity.ANGLE,)
            self._add(self._measured(line, words, angle, at=end, back=before, to=rest[1]))
            return
        bearing = azimuth_of(rest[1], "the bearing", line, gon=self._options.gon)
        for sight in self._measured(line, words, (Quantity.ANGLE,), at=end, to=before):
            assert sight.value is not None
            self._add([_as_bearing(sight, float(np.remainder(bearing - sight.value, 2 * math.pi)))])

    def _reversed_last(self, traverse: _Traverse) -> float:
        _, line, words = traverse.legs[-1]
        azimuth = azimuth_of(words[0], "the bearing", line, gon=self._options.gon)
        return float(np.remainder(azimuth + math.pi, 2 * math.pi))

    def _legs_ahead(self, traverse: _Traverse) -> None:
        """Lines that name the point ahead."""
        at, back = traverse.legs[0][0], traverse.back
        for to, line, words in traverse.legs[1:]:
            with self.refused.record():
                quantities = (Quantity.ANGLE, *self._pair())
                rest = tuple(self._plane_words(words, 6))
                self._add(self._measured(line, rest, quantities, at=at, back=back, to=to))
            at, back = to, at

    def _legs(self, traverse: _Traverse, end: str) -> None:
        """Lines that name the occupied point; what is sighted stands in the next line."""
        back, bearing = traverse.back, traverse.bearing
        targets = [name for name, _, _ in traverse.legs[1:]] + [end]
        for (at, line, words), to in zip(traverse.legs, targets, strict=True):
            with self.refused.record():
                rest = tuple(self._plane_words(words, 6))
                if self._options.maps and not self._options.map_angles:
                    quantities = (Quantity.BEARING, *self._pair())
                    self._add(self._measured(line, rest, quantities, at=at, to=to))
                elif self._options.maps:
                    bearing = self._by_bearings(line, rest, at, back, to, bearing)
                elif back:
                    quantities = (Quantity.ANGLE, *self._pair())
                    self._add(self._measured(line, rest, quantities, at=at, back=back, to=to))
                elif bearing is not None:
                    self._from_bearing(line, rest, at, to, bearing)
                else:
                    # without a backsight the angle of the first line says nothing
                    self._add(self._measured(line, rest[1:], self._pair(), at=at, to=to))
            back = at

    def _from_bearing(
        self, line: DataLine, words: Sequence[str], at: str, to: str, bearing: float
    ) -> None:
        """An angle from a fixed bearing is the bearing of its foresight."""
        sights = self._measured(line, words, (Quantity.ANGLE, *self._pair()), at=at, to=to)
        for sight in sights:
            if sight.quantity is Quantity.ANGLE and sight.value is not None:
                azimuth = float(np.remainder(sight.value + bearing, 2 * math.pi))
                sight = _as_bearing(sight, azimuth)
            self._add([sight])

    def _by_bearings(
        self,
        line: DataLine,
        words: Sequence[str],
        at: str,
        back: str,
        to: str,
        backward: float | None,
    ) -> float | None:
        """Angle between the bearings back and ahead; the next one looks back along this line."""
        forward = azimuth_of(words[0], "the bearing", line, gon=self._options.gon)
        if back and backward is not None:
            angle = float(np.remainder(forward - backward, 2 * math.pi))
            names = {"at": at, "back": back, "to": to}
            quantities = (Quantity.ANGLE, *self._pair())
            sights = self._measured(line, ("0", *words[1:]), quantities, **names)
            self._add(
                [_with_value(s, angle) if s.quantity is Quantity.ANGLE else s for s in sights]
            )
        else:
            self._add(self._measured(line, words[1:], self._pair(), at=at, to=to))
        return float(np.remainder(forward + math.pi, 2 * math.pi))

    # Levelling, vectors, side shots, instruments.

    def _l(self, line: DataLine) -> None:
        """``L``: height difference, length or turns, standard error."""
        names, rest = self._ends(line)
        unit = self._options.length_unit
        if len(rest) not in (2, 3) and not (len(rest) == 1 and not _is_value(rest[0])):
            if len(rest) == 1:
                raise line.error(
                    "the height difference has neither length nor turns",
                    "add the length of the line",
                )
            raise line.error("a line of levels has a height difference, a length, and no more")
        value = number_of(rest[0], "the height difference", line) * unit
        weight = number_of(rest[1], "the length", line)
        by_turns = self.settings.by_turns
        if not weight > 0 and len(rest) < 3:
            raise line.error(f"the length is {rest[1]}", "give it above zero")
        span = weight if by_turns else weight * unit
        default = self._options.levelling * math.sqrt(max(span, 0.0))
        sigma = self._sigma(rest[2], unit, line) if len(rest) == 3 else SigmaMark.DEFAULT
        if sigma is SigmaMark.DEFAULT and self._options.levelling == self.settings.levelling:
            self.records.assumed.add("levelling")
        self.records.levels.append(
            Level(names["at"], names["to"], value, sigma, default, line.source)
        )

    def _g0(self, line: DataLine) -> None:
        """The name of a vector, which is a description."""

    def _g1(self, line: DataLine) -> None:
        self._vector, self._refused_vector = None, True
        names, rest = self._ends(line)
        unit = self._options.length_unit
        if rest and len(rest) != 3:
            raise line.error(f"a vector has three components, not {len(rest)}")
        delta = [number_of(word, "a component", line) * unit for word in rest]
        options = self._options
        self._vector = Vector(
            names["at"],
            names["to"],
            (delta[0], delta[1], delta[2]) if rest else None,
            options.gnss_covariances,
            options.gnss_factor,
            options.gnss_centring,
            options.gnss_default,
            options.gnss_heights,
            line.source,
        )
        self.records.vectors.append(self._vector)
        self._refused_vector = False

    def _g2(self, line: DataLine) -> None:
        if self._refused_vector:
            return
        vector, numbers = self._of_vector(line)
        unit = self._options.length_unit
        vector.deviations = tuple(n * (unit**2 if vector.covariances else unit) for n in numbers)
        if min(numbers) <= 0:
            raise line.error("a standard error or variance is not above zero")

    def _g3(self, line: DataLine) -> None:
        if self._refused_vector:
            return
        vector, numbers = self._of_vector(line)
        unit = self._options.length_unit**2 if vector.covariances else 1.0
        vector.couplings = tuple(n * unit for n in numbers)

    def _of_vector(self, line: DataLine) -> tuple[Vector, list[float]]:
        if self._vector is None:
            raise line.error(f"there is no vector to {line.code}", "give G1 before it")
        if len(line.words) != 3:
            raise line.error(f"{line.code} has {len(line.words)} numbers instead of three")
        return self._vector, [number_of(word, "a number", line) for word in line.words]

    def _ss(self, line: DataLine) -> None:
        """``SS``: a side shot by angle, by azimuth, or by distance and zenith angle alone."""
        rest = self._split(line, 2, 3)
        names = self._names
        angle = ""
        if len(names) == 2 and rest and "=" in rest[0]:
            kind, _, angle = rest[0].partition("=")
            rest = rest[1:]
            if kind.upper() not in ("AZ", "HZ", "HA", "ANG"):
                raise line.error(f"a side shot has no {kind}=", "use AZ= or HZ=")
            if kind.upper() == "AZ":
                self._shot(line, names, (angle, *rest), Quantity.BEARING)
                return
            if self._setup is None or self._setup[0] != names[0]:
                raise line.error(
                    f"no backsight of {names[0]} was named before", "give it with TB or DB"
                )
            self._shot(line, (names[0], self._setup[1], names[1]), (angle, *rest), Quantity.ANGLE)
        elif len(names) == 2:
            self._shot(line, names, rest, None)
        else:
            at, back, to = names
            if self._options.from_at_to:
                at, back = back, at
            self._shot(line, (at, back, to), rest, Quantity.ANGLE)

    def _shot(
        self,
        line: DataLine,
        names: tuple[str, ...],
        words: Sequence[str],
        first: Quantity | None,
    ) -> None:
        """A side shot with its observations."""
        pair = self._pair()
        n = sum(map(_is_value, words))
        if first is not None and not self._options.plane and n == 2:
            pair = (Quantity.LEVEL_DISTANCE,)
        quantities = pair if first is None else (first, *pair)
        ends = {"at": names[0], "to": names[-1]}
        if first is Quantity.ANGLE:
            ends["back"] = names[1]
        sights = self._measured(line, words, quantities, **ends)
        self.records.shots.append(SideShot(names[-1], tuple(sights), line.source))

    def _i(self, line: DataLine) -> None:
        """``I``: an instrument with its standard errors."""
        words = line.words
        if not 5 <= len(words) <= 10:
            raise line.error(
                "an instrument has a code, a description, constant and ppm of its distances, "
                "standard errors of horizontal and vertical angles, and of centring at both ends"
            )
        numbers = [number_of(word, "a standard error", line) for word in words[2:]]
        if min(numbers) < 0:
            raise line.error("a standard error is below zero")
        numbers += [0.0] * (6 - len(numbers))
        constant, ppm, horizontal, vertical, instrument, target = numbers[:6]
        basis = self.settings.default
        self._options.library[words[0].upper()] = StandardErrors(
            distance=constant,
            distance_ppm=ppm * 1e-6,
            angle=horizontal * SEC,
            direction=horizontal * SEC,
            azimuth=horizontal * SEC,
            zenith=vertical * SEC,
            rise=basis.rise,
            rise_ppm=basis.rise_ppm,
            instrument=instrument,
            target=target,
        )

    def _close(self) -> None:
        """Finish a file: report what it leaves open."""
        if self._set is not None:
            line, self._set = self._set.line, None
            raise line.error("the set of directions does not end", "end it with DE")
        if self._traverse is not None:
            traverse, self._traverse = self._traverse, None
            # a first line alone names the set-up of side shots
            if len(traverse.legs) != 1 or not traverse.ahead:
                raise traverse.line.error("the traverse does not end", "end it with TE")


#: methods of the reader by data type; coordinates with an H have a height over the ellipsoid
CODES = {
    code: f"_{(code[0] if code in ('CH', 'PH', 'EH') else code).lower()}"
    for code in (
        "C", "CH", "P", "PH", "E", "EH", "A", "B", "D", "V", "DV", "M", "BM", "DB", "DN", "DM",
        "DE", "TB", "T", "TE", "L", "G0", "G1", "G2", "G3", "SS", "I",
    )
}  # fmt: skip


def _is_include(line: DataLine) -> bool:
    return line.code.startswith(".") and len(line.code) > 3 and ".INCLUDE".startswith(line.code)


def _relative(line: DataLine) -> Path:
    """The file that an option names, as it is written."""
    name = " ".join(line.words).strip("\"'")
    if not name:
        raise line.error("no file is named", "name it")
    return Path(name.replace("\\", "/"))


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False


def _is_bearing(word: str) -> bool:
    """Is it a bearing, and no name of a station? It has dashes, or letters of a quadrant."""
    digits = word.strip("NSEWnsew")
    return "-" in digits.lstrip("-") and _is_value(word)


def _is_value(word: str) -> bool:
    """Is it a number, an angle or a bearing, or stands for one that was not measured?"""
    if word == _NOTHING:
        return True
    digits = word.strip("NSEWnsew").lstrip("+-").replace("-", "").replace("e", "").replace("E", "")
    return bool(digits) and digits.replace(".", "").isdigit()


def _with_value(sight: Sight, value: float) -> Sight:
    return sight._replace(value=value)


def _as_bearing(sight: Sight, value: float) -> Sight:
    return sight._replace(quantity=Quantity.BEARING, value=value)


def _without_centring(errors: StandardErrors) -> StandardErrors:
    return replace(errors, instrument=0.0, target=0.0, vertical=0.0)
