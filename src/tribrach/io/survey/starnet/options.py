"""Inline options of STAR*NET data files: what the lines that follow mean.

An option may be cut short as long as nothing else begins like it, and so may its words. Options
that only concern listings and drawings are passed over; one that would change results and is not
done is refused.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from tribrach.io.survey.starnet.settings import (
    REFRACTION_PER_UNIT,
    StandardErrors,
    StarnetSettings,
    grid_of,
)
from tribrach.io.survey.starnet.text import LINEAR_UNITS, DataLine, angle_of, number_of
from tribrach.units import CC, GON, SEC

#: options that change nothing that is computed
_INDIFFERENT = (
    "ELLIPSE", "RELATIVE", "PTOLERANCE", "LOSTSTATIONS", "DESC", "TITLE", "PAUSE", "COPYFILE",
    "DEBUG",
)  # fmt: skip
#: options that are done, the more usual first: the first that a short form fits is meant
_DONE = (
    "INSTRUMENT", "UNITS", "ORDER", "DELTA", "DATA", "2D", "3D", "SEPARATOR", "SCALE", "LWEIGHT",
    "LONGITUDE", "LONSIGN", "GPS", "REFRACTION", "ROTATION", "INCLUDE", "MAPMODE", "MULTIPLIER",
    "EDM", "ADDCENTERING", "AMODE", "NORMALIZE", "CENTERING", "COORD", "CURVREF", "CRS", "GRID",
    "MEASURED", "END",
)  # fmt: skip
_IN_GRID = (
    "the job is one in a grid and would become a local one without it: give the project file of "
    'the job, or write a Tribrach project with kind = "projected" and crs in [site]'
)
#: options that would change results: what they do, and where that is stated instead
_REFUSED = {
    "ALIAS": "it gives points a second name: write one name for each point in the data",
    "LINK": "it makes names one point: write one name for the point in the data",
    "PRISM": "it adds a constant to distances: correct the distances in the data",
    "ELEVATION": "it gives heights to points without: write them with the points, as C or E lines",
    "VRED": "it reduces distances to a height: give them as measured, with zenith angles",
    "MAPSCALE": f"it scales distances into the grid; {_IN_GRID}",
}
#: what .GRID and .MEASURED may speak of, and which of the two each is if nothing is said
_ON_GRID = {"BEARINGS": True, "AZIMUTHS": True, "DISTANCES": False, "ANGLES": False,
            "DIRECTIONS": False}  # fmt: skip


@dataclass
class InlineOptions:
    """The state that options change."""

    settings: StarnetSettings  #: of the project, which an option without words goes back to
    #: instruments by name in capitals, with those that the data define
    library: dict[str, StandardErrors] = field(default_factory=dict)
    kind: str = "3D"  #: ``2D``, ``3D`` or ``LEV``: what is adjusted
    plane: bool = False  #: lines are written for a job in plan
    off: bool = False  #: lines are passed over
    #: nothing follows
    ended: bool = False
    unit: float = 1.0
    gon: bool = False
    angle_error: float = SEC
    east_first: bool = False
    from_at_to: bool = False
    delta: bool = False
    separator: str = "-"
    instrument: str = ""
    scale: float = 1.0
    multiplier: float = 1.0
    levelling: float = 0.0
    refraction: float = 0.0
    rotation: float = 0.0
    #: horizontal distances that follow are on the grid
    grid_distances: bool = False
    maps: bool = False
    map_angles: bool = False
    directed: bool = False
    normalize: bool = False
    propagated: bool = False
    add_centring: bool = False
    centring: bool = True
    west_positive: bool = True
    gnss_covariances: bool = True
    gnss_factor: tuple[float, float] = (1.0, 1.0)
    gnss_centring: tuple[float, float] = (0.0, 0.0)
    gnss_default: tuple[float, float] = (0.005, 0.0)
    gnss_heights: tuple[float, float] = (0.0, 0.0)
    explicit_kind: bool = False
    missing: set[str] = field(default_factory=set)

    @classmethod
    def of(cls, settings: StarnetSettings) -> InlineOptions:
        """The state at the beginning of the data of a project."""
        return cls(
            settings,
            library=dict(settings.instruments),
            kind=settings.kind,
            plane=settings.kind == "2D",
            unit=settings.unit,
            gon=settings.gon,
            angle_error=GON / 1000 if settings.gon else SEC,
            east_first=settings.east_first,
            from_at_to=settings.from_at_to,
            delta=settings.delta,
            scale=settings.scale,
            levelling=settings.levelling,
            refraction=settings.refraction,
            propagated=settings.propagated,
            west_positive=settings.west_positive,
            gnss_factor=settings.gnss_factor,
            gnss_centring=settings.gnss_centring,
            gnss_default=settings.gnss_default,
        )

    @property
    def length_unit(self) -> float:
        """Unit of lengths as written [m]."""
        return self.unit * self.multiplier

    @property
    def errors(self) -> StandardErrors:
        """Standard errors of the instrument that measures."""
        return self.library.get(self.instrument, self.settings.default)

    def take(self, line: DataLine) -> None:
        """Change the state by an option."""
        name = option_name(line)
        if name == "DATA":
            self.off = not _on(line, default=True)
        if self.off or name in _INDIFFERENT or name in ("DATA", "INCLUDE"):
            return
        simple: Mapping[str, str] = {
            "DELTA": "delta",
            "NORMALIZE": "normalize",
            "ADDCENTERING": "add_centring",
            "CENTERING": "centring",
        }
        if name in simple:
            setattr(self, simple[name], _on(line, default=True))
            return
        getattr(self, f"_{name.lower()}")(line)

    def _2d(self, line: DataLine) -> None:
        self._dimension("2D")

    def _3d(self, line: DataLine) -> None:
        self._dimension("3D")

    def _coord(self, line: DataLine) -> None:
        self._dimension(_choice(line, 0, ("2D", "3D")))

    def _dimension(self, kind: str) -> None:
        """How lines are written; without a project the first of them says what is adjusted."""
        self.plane = kind == "2D"
        if not self.settings.source and not self.explicit_kind:
            self.kind = kind
        self.explicit_kind = True

    def _instrument(self, line: DataLine) -> None:
        name = " ".join(line.words).upper()
        if name and name not in self.library:
            if name in self.missing:
                return
            # the first line is told, the others have the same cure
            self.missing.add(name)
            raise line.error(
                f"there is no instrument {' '.join(line.words)}",
                "it stands in the library of the project: give the project file with the data"
                if not self.library
                else f"there are {', '.join(sorted(self.library))}",
            )
        self.instrument = name

    def _units(self, line: DataLine) -> None:
        if not line.words:
            self.unit, self.gon = self.settings.unit, self.settings.gon
            self.angle_error = GON / 1000 if self.gon else SEC
        for word in map(str.upper, line.words):
            if word in LINEAR_UNITS:
                self.unit = LINEAR_UNITS[word]
            elif word == "DMS":
                self.gon, self.angle_error = False, SEC
            elif word in ("GON", "GONS"):
                self.gon, self.angle_error = True, GON / 1000
            elif word.startswith("MILLIG"):
                self.angle_error = GON / 1000
            elif word.startswith("CENT") or word == "CC":
                self.angle_error = CC
            else:
                raise line.error(f"the unit {word} is not known", "use Meters, FeetUS, DMS, GONS")

    def _order(self, line: DataLine) -> None:
        if not line.words:
            self.east_first = self.settings.east_first
            self.from_at_to = self.settings.from_at_to
        for word in map(str.upper, line.words):
            if word in ("NE", "EN"):
                self.east_first = word == "EN"
            elif word in ("ATFROMTO", "AT-FROM-TO", "FROMATTO", "FROM-AT-TO"):
                self.from_at_to = word.startswith("F")
            else:
                raise line.error(f"the order {word} is not known", "use NE, EN, AtFromTo, FromAtTo")

    def _separator(self, line: DataLine) -> None:
        self.separator = line.words[0] if line.words else "-"
        if len(self.separator) != 1:
            raise line.error(f"the separator {self.separator!r} is not one character")

    def _scale(self, line: DataLine) -> None:
        self.scale = _number(line, 0, self.settings.scale)
        if not 0.5 < self.scale < 2:
            raise line.error(f"the scale is {self.scale:g}", "give a factor near one")
        if self.settings.grid is not None:
            raise line.error(
                "a scale of a local system has no place in a grid job", "leave the line out"
            )

    def _multiplier(self, line: DataLine) -> None:
        self.multiplier = _number(line, 0, 1.0)
        if not self.multiplier > 0:
            raise line.error(f"the multiplier is {self.multiplier:g}", "give it above zero")

    def _lweight(self, line: DataLine) -> None:
        if not line.words:
            self.levelling = self.settings.levelling
            return
        value = _number(line, 0, 0.0)
        if not value > 0:
            raise line.error(f"the standard error is {value:g}", "give it above zero")
        # by kilometre or mile, or by turn
        span = 1000.0 if self.unit == 1.0 else 5280 * self.unit
        self.levelling = value * self.unit / (1.0 if self.settings.by_turns else span**0.5)

    def _longitude(self, line: DataLine) -> None:
        self.west_positive = self.settings.west_positive
        if line.words:
            word = _choice(line, 0, ("POSITIVEWEST", "NEGATIVEWEST", "WESTPOS", "WESTNEG"))
            self.west_positive = word in ("POSITIVEWEST", "WESTPOS")

    _lonsign = _longitude

    def _refraction(self, line: DataLine) -> None:
        default = self.settings.refraction / REFRACTION_PER_UNIT
        self.refraction = _number(line, 0, default) * REFRACTION_PER_UNIT

    def _curvref(self, line: DataLine) -> None:
        word = line.words[0].upper() if line.words else "ON"
        if word == "OFF":
            raise line.error(
                "curvature and refraction are always computed",
                "leave the line out, and zenith angles are reduced for both",
            )
        if word != "ON":
            self.refraction = _number(line, 0, 0.0)

    def _rotation(self, line: DataLine) -> None:
        word = line.words[0] if line.words else "0"
        if not self.gon and "-" not in word.lstrip("+-"):
            # a plain number of degrees
            self.rotation = number_of(word, "the rotation", line) * 3600 * SEC
        else:
            self.rotation = angle_of(word, "the rotation", line, gon=self.gon)

    def _mapmode(self, line: DataLine) -> None:
        words = [word.upper() for word in line.words]
        self.maps = not words or words[0] != "OFF"
        self.map_angles = any(word.startswith("ANG") for word in words)

    def _edm(self, line: DataLine) -> None:
        self.propagated = _choice(line, 0, ("ADDITIVE", "PROPAGATED")) == "PROPAGATED"

    def _amode(self, line: DataLine) -> None:
        self.directed = _choice(line, 0, ("AUTO", "ANGLE", "DIR")) == "DIR"

    def _crs(self, line: DataLine) -> None:
        """The grid of the job, which the project states otherwise."""
        name = " ".join(line.words)
        if not name:
            raise line.error(".CRS names no grid", "write its EPSG code, such as .CRS EPSG:32633")
        crs = grid_of(name)
        if crs is None:
            raise line.error(
                f"the grid {name} is not known here: .CRS makes this a job on that grid",
                "write its EPSG code in its place, such as .CRS EPSG:32633",
            )
        if self.settings.crs not in (None, crs):
            raise line.error(
                f".CRS says {name}, and {self.settings.source or 'a line above'} says "
                f"{self.settings.grid}",
                "keep one grid",
            )
        self.settings = replace(self.settings, grid=name, crs=crs)

    def _grid(self, line: DataLine) -> None:
        self._meant(line, on_grid=True)

    def _measured(self, line: DataLine) -> None:
        self._meant(line, on_grid=False)

    def _meant(self, line: DataLine, *, on_grid: bool) -> None:
        """Whether quantities are measured or of the grid: as usual, or refused."""
        for word in line.words:
            name = next((n for n in _ON_GRID if n.startswith(word.upper())), None)
            if name is None:
                listed = ", ".join(_ON_GRID)
                raise line.error(f"{line.code} has no word {word!r}", f"use one of {listed}")
            if name == "DISTANCES":
                self.grid_distances = on_grid
                continue
            if _ON_GRID[name] == on_grid:
                continue
            what = "on the grid" if on_grid else "measured on the ground"
            raise line.error(
                f"{line.code} says that the {name.lower()} of the lines that follow are {what}, "
                "which is not done",
                "bearings are of the grid, angles and directions are measured: convert the others "
                "before",
            )
        if not line.words:
            raise line.error(
                f"{line.code} does not say of what it speaks",
                "name bearings, distances, angles or directions",
            )

    def _end(self, line: DataLine) -> None:
        self.ended = True

    def _gps(self, line: DataLine) -> None:
        """``.GPS`` and one of its words."""
        words = (
            "WEIGHT",
            "FACTOR",
            "CENTERING",
            "DEFAULT",
            "ADDHIHT",
            "NETWORK",
            "SIDESHOT",
            "USE",
            "TRANSFORM",
            "IGNORE",
        )
        what = _choice(line, 0, words)
        if what == "WEIGHT":
            kinds = ("COVARIANCES", "STDERRCORRELATIONS", "STDERRS", "STANDARDERRORS")
            self.gnss_covariances = _choice(line, 1, kinds) == "COVARIANCES"
        elif what == "FACTOR":
            self.gnss_factor = self._pair(line, self.settings.gnss_factor, 1.0)
        elif what == "CENTERING":
            self.gnss_centring = self._pair(line, self.settings.gnss_centring, self.length_unit)
        elif what == "DEFAULT":
            self.gnss_default = (
                _number(line, 1, self.settings.gnss_default[0] / self.length_unit)
                * self.length_unit,
                _number(line, 2, self.settings.gnss_default[1] * 1e6) * 1e-6,
            )
        elif what == "ADDHIHT":
            self.gnss_heights = (
                _number(line, 1, 0.0) * self.length_unit,
                _number(line, 2, 0.0) * self.length_unit,
            )
        elif what != "NETWORK":
            raise line.error(
                f".GPS {what} is not done",
                "without it vectors take part as they are written: edit them if that is not meant",
            )

    def _pair(
        self, line: DataLine, default: tuple[float, float], unit: float
    ) -> tuple[float, float]:
        """One figure for plan and height, and another for the height after VERT."""
        if len(line.words) < 2:
            return default
        plan = _number(line, 1, 1.0) * unit
        if len(line.words) < 3:
            pair = plan, plan
        else:
            _choice(line, 2, ("VERTICAL",))
            pair = plan, _number(line, 3, 1.0) * unit
        if min(pair) < 0:
            raise line.error("a figure is below zero")
        return pair


def option_name(line: DataLine) -> str:
    """The whole name of an option that may be cut short."""
    word = line.code[1:]
    for names in (_DONE, _INDIFFERENT, _REFUSED):
        found = [name for name in names if word and name.startswith(word)]
        if found and names is not _REFUSED:
            return found[0]
        if found:
            raise line.error(f"the option .{found[0]} is not done", _REFUSED[found[0]])
        longer = [name for name in names if len(name) > 2 and word.startswith(name)]
        if longer and names is not _REFUSED:
            return longer[0]
    raise line.error(
        f"the option {line.code} is not known",
        "look up what it changes before you leave the line out: results may differ without it",
    )


def _number(line: DataLine, index: int, default: float) -> float:
    if index >= len(line.words):
        return default
    return number_of(line.words[index], f"the value of {line.code}", line)


def _choice(line: DataLine, index: int, words: tuple[str, ...]) -> str:
    """One of several words, which may be cut short."""
    word = line.words[index].upper() if index < len(line.words) else ""
    for name in words:
        if word and (name.startswith(word) or word.startswith(name)):
            return name
    listed = ", ".join(words)
    raise line.error(
        f"{line.code} has no word {word!r}" if word else f"{line.code} needs a word",
        f"use one of {listed}",
    )


def _on(line: DataLine, *, default: bool) -> bool:
    if not line.words:
        return default
    return _choice(line, 0, ("ON", "OFF")) == "ON"
