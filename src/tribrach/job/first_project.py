"""The first project file of a job: from what lies in a folder to commented TOML that runs.

What nobody says and no file tells is assumed where a job cannot run without it; each assumption is
a sentence, and stands as a comment beside its line.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tribrach.errors import InputError, Refusals, TribrachError
from tribrach.io.instrument_sheets import Sheet, find_sheet, sheets
from tribrach.io.survey.csv.file import CsvTable
from tribrach.io.survey.formats import JOINT, read_files
from tribrach.io.survey.starnet.recognition import is_settings
from tribrach.io.toml_model import quoted
from tribrach.job.folder import AXES, Axes, FolderFile, reread
from tribrach.job.opened import open_job
from tribrach.job.set_ups import set_ups
from tribrach.network.adjustment import adjust
from tribrach.project import Project

#: sizes of targets in a project by the words on the command line
TARGETS = {
    "sphere": "sphere_radius_m",
    "checkerboard": "checkerboard_side_m",
    "disc": "disc_radius_m",
}
#: the largest size of a target that is in metres
_METRES = 2.0
#: sigma0 of the wrong way is so many times that of the right one
_CLEARLY = 5.0
#: lines that an error lists, and files of one reason that a line names
_NOTED, _NAMED = 20, 3
#: kinds of files that receivers bring
_OF_RECEIVERS = ("receiver", "orbits", "antennas")
#: what becomes of scans and survey without targets
_UNTIED = (
    "no targets are named, so nothing ties the scans to the survey: the scans are registered by "
    "their clouds, in a frame of their own, and the survey is a project of its own; say which "
    "targets stood there with --target, such as --target sphere:0.0725"
)
#: sigma of coordinates that nobody states [mm]
_CONTROL_MM = 5.0
#: figures that are assumed of instruments nobody names
_SCANNER = (
    "range_mm = 2.0",
    "range_ppm = 10.0",
    "scan_angle_arcsec = 8.0",
    "scan_angle_accuracy_arcsec = 12.0",
    "levelling_arcsec = 5.0",
)
_TOTAL_STATION = (
    "direction_arcsec = 5.0",
    "zenith_arcsec = 5.0",
    "distance_mm = 2.0",
    "distance_ppm = 2.0",
    "levelling_mm_per_sqrt_km = 1.5",
)
_LEVEL = ("levelling_mm_per_sqrt_km = 1.5",)
#: sigma of the compensator of a scanner whose sheet says none
_LEVELLED = "levelling_arcsec = 10.0   # assumed: the sheet says nothing of its compensator"
_SET_UP = ("centring_mm = 0.5", "height_mm = 1.0")
_GNSS = ("gnss_plan_mm = 20.0", "gnss_up_mm = 50.0")
#: coordinates larger than this are of a grid, not of a site [m]
_GRID = 50_000.0
#: stations that a frame is kept by, at least
_FRAME_STATIONS = 3
#: scans whose poses are nearer than this are of one station [m]
_SAME = 1e-3


@dataclass(frozen=True)
class Wishes:
    """What somebody says of a job that its files do not tell."""

    targets: tuple[tuple[str, float], ...] = ()  #: keys of ``[targets]`` with their sizes [m]
    #: models whose data sheets count
    scanner: Sheet | None = None
    total_station: Sheet | None = None
    crs: str | None = None  #: coordinate reference system of the control
    control_role: str = "control"  #: what coordinates are for
    #: of control without sigmas; that of heights is the same where it is None
    control_sigma_mm: float | None = None
    control_sigma_up_mm: float | None = None
    levelled: bool | None = None  #: was the compensator of the scanner on? None where nobody says


@dataclass
class FirstProject:
    """A project file that was put together."""

    text: str = ""  #: the TOML
    #: files that it names, with what is in them
    used: list[tuple[Path, str]] = field(default_factory=list)
    #: what was taken for granted, one sentence each without the stop
    assumed: list[str] = field(default_factory=list)
    #: files that it does not name, each with the reason
    left: list[tuple[Path, str]] = field(default_factory=list)
    #: files of observations that belong together
    groups: list[list[Path]] = field(default_factory=list)
    #: a project of its own for the survey, where nothing ties it to the scans
    survey: FirstProject | None = None


def parse_target(words: str) -> tuple[str, float, str]:
    """Key, size [m] and what was guessed of ``sphere:0.0725`` or ``checkerboard:300mm``."""
    kind, _, size = words.partition(":")
    cure = "write sphere:RADIUS, checkerboard:SIDE or disc:RADIUS, such as sphere:0.0725"
    found = re.fullmatch(r"\s*(\d*[.,]?\d+)\s*(mm|cm|m)?\s*", size)
    key = TARGETS.get(kind.strip().lower())
    if key is None or found is None:
        raise InputError(f"{words!r} is no target with its size", cure=cure)
    value = float(found.group(1).replace(",", "."))
    unit = found.group(2)
    said = ""
    if unit is None and value > _METRES:
        unit, said = "mm", f"{kind} of {value:g} is taken as millimetres"
    metres = value * {"mm": 1e-3, "cm": 1e-2}.get(unit or "m", 1.0)
    if not 0.001 < metres <= _METRES:
        raise InputError(f"a target of {metres:g} m is none", cure=cure)
    return key, metres, said


def sheet_of(words: str) -> Sheet:
    """The data sheet of a model, whose name may be given in part, such as ``Leica P40``."""
    try:
        return find_sheet(words)
    except InputError:
        parts = re.findall(r"[a-z]+\d*|\d+", words.lower())
        alike = [
            sheet
            for sheet in sheets()
            if all(part in "".join(sheet.name.lower().split()) for part in parts)
        ]
        if len(alike) == 1 and parts:
            return alike[0]
        raise


def compose(folder: Path, found: Sequence[FolderFile], wishes: Wishes) -> FirstProject:
    """A project of the files of a folder that opens.

    A file that its reader refuses is left out with the reason. A survey that no target ties to the
    scans is a project of its own.
    """
    scans = [one for one in found if one.kind == "scans"]
    apart = [one for one in found if one.kind in ("points", "survey", *_OF_RECEIVERS)]
    measured = any(one.kind == "survey" for one in apart)
    if scans and not wishes.targets and measured:
        project = compose(folder, [one for one in found if one not in apart], wishes)
        project.survey = compose(folder, apart, wishes)
        project.assumed.insert(0, _UNTIED)
        project.survey.text = project.survey.text.replace('folder = "out"', 'folder = "out-survey"')
        return project
    files = [one for one in found if one.kind not in ("not understood", "project")]
    others = [(one.path, one.words) for one in found if one not in files]
    refused: list[tuple[Path, str]] = []
    while True:
        composer = _Composer(folder, files, wishes)
        try:
            project = composer.project()
        except InputError as error:
            for line in by_reason([*composer.out.left, *refused, *others], folder)[:_NOTED]:
                error.add_note(f"  - {line}")
            raise
        wrong = _refused(folder, project)
        if not wrong:
            break
        refused += wrong
        files = [one for one in files if one.path not in dict(wrong)]
    project.left += [*refused, *others]
    return project


def axes_by_observations(
    folder: Path, found: Sequence[FolderFile], wishes: Wishes
) -> list[FolderFile]:
    """The files, lists whose axes were assumed read the way that fits the observations.

    Where both ways fit, or none, lists stay as assumed: two points alone fit a mirrored list too.
    """
    if not any(one.assumed_axes for one in found):
        return list(found)
    survey = [one for one in found if one.kind in ("points", "survey")]
    sigma0 = {
        axes: _sigma0(folder, [_turned(one, axes, "") for one in survey], wishes) for axes in AXES
    }
    best, other = sorted(AXES, key=lambda axes: sigma0[axes])
    if not sigma0[best] * _CLEARLY < sigma0[other]:
        return list(found)
    second = f"{sigma0[other]:.0f}" if np.isfinite(sigma0[other]) else "no solution is found"
    why = (
        f"which fits the observations (sigma0 is {sigma0[best]:.1f}, and {second} the other way "
        "round)"
    )
    return [_turned(one, best, why) for one in found]


def _turned(one: FolderFile, axes: Axes, why: str) -> FolderFile:
    """A list whose axes were assumed, with others; any other file as it is."""
    return reread(one, axes, why) if one.assumed_axes else one


def _sigma0(folder: Path, survey: Sequence[FolderFile], wishes: Wishes) -> float:
    """Sigma0 of a survey without scans; infinite where it cannot be adjusted."""
    try:
        first = compose(folder, survey, wishes)
        job = open_job(Project.model_validate(tomllib.loads(first.text)).at(folder))
        system = adjust(job.network())
    except TribrachError:
        return np.inf
    return system.sigma0_posterior if system.dof else np.inf


def by_reason(rows: Sequence[tuple[Path, str]], folder: Path) -> list[str]:
    """Files with the reason of each, one line for all files of one reason."""
    names: dict[str, list[str]] = {}
    for path, why in rows:
        names.setdefault(why, []).append(path.relative_to(folder).as_posix())
    out = []
    for why, files in names.items():
        if len(files) <= _NAMED:
            out += [f"{file}: {why}" for file in files]
        else:
            more = len(files) - _NAMED
            out.append(f"{', '.join(files[:_NAMED])} and {more} more: {why}")
    return out


def grid_without_crs(found: Sequence[FolderFile]) -> bool:
    """True if lists of coordinates look like those of a grid."""
    tables = [one.table for one in found if one.kind == "points" and one.table is not None]
    return any(np.nanmax(np.abs(t.number(a)), initial=0.0) > _GRID for t in tables for a in "en")


def without_sigmas(found: Sequence[FolderFile]) -> bool:
    """True if a list of coordinates says neither sigmas nor what it is for."""
    tables = [one.table for one in found if one.kind == "points" and one.table is not None]
    return any(not table.has("role") and not _weighted(table) for table in tables)


def _weighted(table: CsvTable) -> bool:
    return any(map(table.has, ("sigma_e", "sigma_u", "cee", "cxx")))


def _refused(folder: Path, first: FirstProject) -> list[tuple[Path, str]]:
    """Files that cannot be read as the project names them, each with the first reason."""
    project = Project.model_validate(tomllib.loads(first.text)).at(folder)
    used = [path for path, _ in first.used]
    try:
        # a session of receivers takes its time; its files are read when it is computed
        open_job(project.model_copy(update={"gnss": type(project.gnss)()})).surveyed()
    except InputError as refused:
        errors = refused.errors if isinstance(refused, Refusals) else (refused,)
    else:
        return []
    wrong: dict[Path, str] = {}
    for error in errors:
        given = error.file or (error.record or "").rpartition(":")[0]
        for path in used:
            if str(given) in (str(path), path.name):
                wrong.setdefault(path, _why(error))
    if wrong:
        return list(wrong.items())
    # of files that belong together nobody is to blame alone; of two descriptions one goes
    for group in first.groups:
        if (why := _wrong_alone(group)) is not None:
            return [(path, why) for path in group]
    if not first.groups:
        raise errors[0]
    told = str(errors[0])
    named = [group for group in first.groups if any(str(path) in told for path in group)]
    return [(path, _why(errors[0])) for path in (named or first.groups)[-1]]


def _why(error: InputError) -> str:
    """Fault of a file, in one line."""
    line = "" if error.line is None else f"line {error.line}: "
    return f"{line}{error.what}" + (f"; {error.cure}" if error.cure else "")


def _wrong_alone(group: Sequence[Path]) -> str | None:
    """Why files that belong together cannot be read, None if they can."""
    try:
        read_files(group)
    except InputError as error:
        return _why(error)
    return None


class _Composer:
    """Puts a project file together, section by section."""

    def __init__(self, folder: Path, files: Sequence[FolderFile], wishes: Wishes) -> None:
        self.folder, self.wishes = folder, wishes
        self.out = FirstProject()
        self.scans = [one for one in files if one.kind == "scans"]
        self.points = [one for one in files if one.kind == "points"]
        self.survey = [one for one in files if one.kind == "survey"]
        self.receivers = [one for one in files if one.kind == "receiver"]
        self.orbits = [one for one in files if one.kind == "orbits"]
        self.antennas = [one for one in files if one.kind == "antennas"]
        self.stations: dict[tuple[Path, str], str] = {}

    def project(self) -> FirstProject:
        """The whole file."""
        self._sort_out()
        if not self.scans and not self.survey and len(self.receivers) < 2:
            for one in (*self.points, *self.receivers):
                self.out.left.append((one.path, f"{one.words}: no observations go with it"))
            raise InputError(
                "nothing that is measured was found: no scans, no observations, no receivers",
                file=self.folder,
                cure="give the folder that holds them, exported as E57, LAZ, GSI, RINEX or tables",
            )
        if len(self.scans) == 1 == len(self.scans[0].scans) and not (self.survey or self.points):
            raise InputError(
                "there is one scan and nothing to register it with",
                file=self.scans[0].path,
                cure="tribrach info says what is in it, tribrach targets finds its targets",
            )
        parts = [
            self._head(),
            self._site(),
            self._datum(),
            *self._instruments(),
            *self._points(),
            *self._observations(),
            *self._sessions(),
            self._targets(),
            *self._scan_sections(),
            self._output(),
        ]
        self.out.text = "\n".join(part for part in parts if part)
        return self.out

    # what is used of what was found

    def _sort_out(self) -> None:
        """Leave out what nothing of the rest could be tied to."""
        for one in self.scans:
            self.out.assumed += [f"{self._name(one.path)}: {text}" for text in one.remarks]
        placed = [one for one in self.scans if all(s.origin == "unknown" for s in one.scans)]
        for one in placed:
            self.scans.remove(one)
            why = "its points are placed already and where the scanner stood is not said"
            self.out.left.append((one.path, f"{why}; add it with origin = [x, y, z]"))
        self.tied = bool(self.wishes.targets)
        if self.scans and not self.tied and self.points:
            self.out.assumed.append(
                "no targets are named, so nothing ties the scans to the list of coordinates: they "
                "are registered by their clouds, in a frame of their own; say which targets stood "
                "there with --target, such as --target sphere:0.0725"
            )
            for one in (*self.points, *self.receivers):
                why = "nothing ties it to the scans without targets"
                self.out.left.append((one.path, f"{one.words}: {why}"))
            self.points, self.receivers = [], []
        if any(one.path.suffix.lower() == ".comp" for one in self.survey):
            for one in [one for one in self.survey if one.format == "comp3d"]:
                if one.path.suffix.lower() != ".comp":
                    self.survey.remove(one)
                    self.out.left.append((one.path, "the project of Comp3D names its files"))
        listings = [one for one in self.survey if one.format == "starnet"]
        if len([one for one in listings if is_settings(one.path)]) > 1:
            for one in listings:
                if is_settings(one.path) and one.path.suffix.lower() not in (".snproj", ".prj"):
                    self.survey.remove(one)
                    self.out.left.append((one.path, "a listing of STAR*NET"))

    def _name(self, path: Path) -> str:
        """A file as the project names it."""
        return path.relative_to(self.folder).as_posix()

    def _use(self, one: FolderFile) -> str:
        self.out.used.append((one.path, one.words))
        return quoted(self._name(one.path))

    # sections

    def _head(self) -> str:
        title = self.folder.resolve().name or "Survey"
        return (
            "# Written by tribrach init from what lies in this folder. Lines that begin with # say "
            "what was\n# assumed and what may be added; docs: Project file.\n"
            f"title = {quoted(title)}\n"
        )

    def _site(self) -> str:
        lines = ["[site]"]
        crs = self.wishes.crs
        own = [one for one in self.survey if one.format in _BRINGING]
        if own:
            return ""
        if crs is not None:
            lines.append(f"crs = {quoted(crs)}   # of the coordinates")
            lines.append("# geoid_height_m = 40.0   # if the heights are above the geoid")
            self.out.assumed.append(
                "heights are taken as those of the reference system, above the ellipsoid if it "
                "says nothing of heights; if they are above sea level, say geoid_height_m or "
                "geoid_grid under [site] in the project file"
            )
        else:
            places = [one.satellites.place for one in self.receivers if one.satellites]
            place = next((where for where in places if where is not None), None)
            if place is not None and not self.points:
                self.out.assumed.append(
                    "the site is centred on the first receiver, as its header has it"
                )
                names = ("latitude_deg", "longitude_deg", "height_m")
                figures = zip(names, place, (5, 5, 0), strict=True)
                return "\n".join(
                    [*lines, *(f"{name} = {value:.{n}f}" for name, value, n in figures), ""]
                )
            lines.append('kind = "flat"')
            if any(map(_of_total_station, self.survey)):
                lines.append("curvature_radius_m = 6371000.0   # for zenith angles")
            if grid_without_crs(self.points):
                self.out.assumed.append(
                    "the coordinates look like those of a grid and no reference system is named: "
                    "they are taken as Cartesian, and the scale of the projection (up to 0.4 mm on "
                    "a metre) goes into the residuals; name it with --crs, such as --crs EPSG:25832"
                )
                lines.append('# crs = "EPSG:25832"   # instead of kind, so that its scale counts')
        return "\n".join(lines) + "\n"

    def _datum(self) -> str:
        if self.points or self.survey:
            return ""
        if self.receivers:
            self.out.assumed.append("no control was found: the datum of the baselines is free")
            return '[datum]\nkind = "free"   # no control was found\n'
        self.out.assumed.append(
            "no control was found: the datum is free, and coordinates and sigmas are those of the "
            "inner geometry of the scans alone"
        )
        return '[datum]\nkind = "free"   # no control was found\n' + self._frame_of_files()

    def _frame_of_files(self) -> str:
        """How the frame of poses that the files have is kept, as a comment; "" without one."""
        stations = set_ups([(one.path, scan) for one in self.scans for scan in one.scans])
        places: dict[str, np.ndarray] = {}
        for one in self.scans:
            for scan in one.scans:
                if scan.pose is not None and scan.origin != "unknown":
                    at = np.asarray(scan.pose.translation)
                    places.setdefault(stations[one.path, scan.name], at)
        apart = [at for at in places.values() if np.linalg.norm(at) > _SAME]
        if len(places) < _FRAME_STATIONS or len(places) < len(set(stations.values())) or not apart:
            return ""
        x, y, z = np.median(list(places.values()), axis=0)
        self.out.assumed.append(
            f"the files have poses of their own, in a frame about {x:.0f}, {y:.0f}, {z:.0f}, which "
            "say where to look first; results are not in that frame unless its stations are taken "
            "as control, as a comment in the project file shows"
        )
        rows = [
            f"#   {_csv_name(name)},{at[0]:.4f},{at[1]:.4f},{at[2]:.4f}"
            for name, at in places.items()
        ]
        return "\n".join(
            [
                "# The files have poses of their own. Results come in their frame if [datum] is",
                '# left out, each station has occupies = "NAME-frame", the scanner centring_mm and',
                "# height_mm = 0.1, and frame.csv of the rows below is named so:",
                "#   [[points]]",
                '#   file = "frame.csv"',
                "#   sigma_plan_mm = 20.0   # as good as that frame is",
                "#   sigma_up_mm = 20.0",
                "#   point,e_m,n_m,u_m",
                *rows,
                "",
            ]
        )

    def _instruments(self) -> Iterable[str]:
        if self.scans:
            sheet = self.wishes.scanner or self._sensor()
            if sheet is not None:
                lines = ["[instruments.scanner]", f"sheet = {quoted(sheet.name)}"]
                stated = {figure.key for figure in sheet.figures}
                if self.wishes.levelled and "levelling_arcsec" not in stated:
                    lines.append(_LEVELLED)
                yield "\n".join([*lines, ""])
            else:
                yield _assumed_instrument("scanner", _SCANNER)
                self.out.assumed.append(
                    "the scanner is not known: 2 mm + 10 ppm and 8 arc seconds are assumed for a "
                    'point; name it with --scanner, such as --scanner "Leica P40"'
                )
        if any(_is_levelling(one) for one in self.survey):
            yield _assumed_instrument("level", _LEVEL)
            self.out.assumed.append(
                "the level is not known: 1.5 mm for the root of a kilometre is assumed where the "
                "files give no sigmas; say yours under [instruments.level] in the project file"
            )
        if any(_of_total_station(one) for one in self.survey):
            sheet = self.wishes.total_station
            if sheet is not None:
                figures = [f"sheet = {quoted(sheet.name)}", *_SET_UP]
                yield "\n".join(["[instruments.total_station]", *figures, ""])
            else:
                yield _assumed_instrument("total_station", (*_TOTAL_STATION, *_SET_UP))
                self.out.assumed.append(
                    "the total station is not known: 5 arc seconds and 2 mm + 2 ppm are assumed "
                    "where the files give no sigmas; name it with --total-station, such as "
                    '--total-station "Leica TS16"'
                )
        if any(_is_positions(one) for one in self.survey):
            yield _assumed_instrument("gnss", _GNSS)

    def _sensor(self) -> Sheet | None:
        """The sheet of the scanner that the files of scans name."""
        for one in self.scans:
            for scan in one.scans:
                words = " ".join(
                    scan.facts.get(key, "") for key in ("sensor vendor", "sensor model")
                ).strip()
                for name in (words, scan.facts.get("sensor model", "")):
                    try:
                        sheet = sheet_of(name) if name else None
                    except InputError:
                        continue
                    if sheet is not None and "scann" in sheet.kind:
                        self.out.assumed.append(
                            f"{one.path.name} names the scanner {words}: its data sheet counts"
                        )
                        return sheet
        return None

    def _points(self) -> Iterable[str]:
        for one in self.points:
            table = one.table
            assert table is not None
            lines = ["[[points]]", f"file = {self._use(one)}   # {one.words}"]
            lines += [f"# {sentence}" for sentence in one.remarks]
            self.out.assumed += [f"{self._name(one.path)}: {text}" for text in one.remarks]
            if not table.has("role"):
                self._say_heights(one, table)
                role = self.wishes.control_role
                lines.append(f'role = "{role}"   # or control, check, approximate, fixed')
                if role == "control" and not _weighted(table):
                    plan, up = self.wishes.control_sigma_mm, self.wishes.control_sigma_up_mm
                    said = plan is not None
                    plan = _CONTROL_MM if plan is None else plan
                    up = plan if up is None else up
                    for key, sigma in (("sigma_plan_mm", plan), ("sigma_up_mm", up)):
                        lines.append(f"{key} = {sigma:g}   # assumed: the list gives none")
                    if not said:
                        lines.append('sigma_source = "assumed by tribrach init"')
                    figures = f"{plan:g} mm in plan and in height"
                    if up != plan:
                        figures = f"{plan:g} mm in plan and {up:g} mm in height"
                    self.out.assumed.append(
                        f"{self._name(one.path)} gives no sigmas: {figures} are assumed; say "
                        "others with --control-sigma-mm and --control-sigma-up-mm"
                    )
            if one.form.columns:
                pairs = ", ".join(f"{k} = {_value(v)}" for k, v in one.form.columns.items())
                lines.append(f"columns = {{ {pairs} }}")
            yield "\n".join([*lines, ""])

    def _say_heights(self, one: FolderFile, table: CsvTable) -> None:
        """Say what heights of a list may be none."""
        heights = table.number("u") if table.has("u") else np.empty(0)
        if len(heights) > 1 and np.isfinite(heights).all() and np.ptp(heights) == 0.0:
            self.out.assumed.append(
                f"{self._name(one.path)} has the height {heights[0]:g} m for every point, and it "
                "is taken as it stands; if nobody measured it, take its column out of the list"
            )

    def _observations(self) -> Iterable[str]:
        for group in self._together():
            names = ", ".join(self._use(one) for one in group)
            key = f"file = {names}" if len(group) == 1 else f"files = [{names}]"
            lines = ["[[observations]]", f"{key}   # {group[0].words}"]
            if group[0].format == "csv":
                name = "total_station"
                if _is_positions(group[0]) or _is_levelling(group[0]):
                    name = "gnss" if _is_positions(group[0]) else "level"
                lines.append(f'instrument = "{name}"   # where the file gives no sigmas')
            elif group[0].format == "totalstation":
                lines.append('instrument = "total_station"')
            yield "\n".join([*lines, ""])

    def _together(self) -> list[list[FolderFile]]:
        """Files of observations, those together that belong together."""
        together: dict[str, list[FolderFile]] = {}
        for one in self.survey:
            key = one.format if one.format in JOINT else one.path.as_posix()
            if one.format in ("dna", "dynaml"):
                # stations and measurements of one network have one name
                key += re.sub(r"[-_.]?(stn|msr|geo)$", "", one.path.with_suffix("").as_posix())
            together.setdefault(key, []).append(one)
        self.out.groups = [[one.path for one in group] for group in together.values()]
        return list(together.values())

    def _sessions(self) -> Iterable[str]:
        if not self.receivers:
            return
        if len(self.receivers) < 2 or not self.orbits:
            for one in self.receivers:
                why = "a second receiver" if self.orbits else "a file of broadcast orbits"
                self.out.left.append((one.path, f"{one.words}: a baseline needs {why}"))
            return
        yield (
            "[gnss]\nnavigation = ["
            + ", ".join(self._use(one) for one in self.orbits)
            + "]\n"
            + (f"antex = {self._use(self.antennas[0])}\n" if self.antennas else "")
        )
        by_date: dict[str, list[FolderFile]] = {}
        for one in self.receivers:
            by_date.setdefault(one.satellites.date if one.satellites else "", []).append(one)
        for date, members in by_date.items():
            markers = {one.satellites.marker for one in members if one.satellites}
            if len(markers) < 2 or len(markers) < len(members):
                for one in members:
                    why = "receivers over other marks on the same day"
                    self.out.left.append((one.path, f"{one.words}: a baseline needs {why}"))
                continue
            rows = [
                f"  {{ point = {quoted(one.satellites.marker)}, file = {self._use(one)} }},"
                for one in members
                if one.satellites
            ]
            session = ["[[gnss.sessions]]", f"name = {quoted(date)}", "receivers = ["]
            yield "\n".join([*session, *rows, "]", ""])

    def _targets(self) -> str:
        if not self.scans:
            return ""
        lines = ["[targets]"]
        sizes: dict[str, list[float]] = {}
        for key, size in self.wishes.targets:
            sizes.setdefault(key, []).append(size)
        for key, values in sizes.items():
            lines.append(f"{key} = [{', '.join(f'{value:g}' for value in values)}]")
        if not sizes:
            lines.append("# sphere_radius_m = [0.0725]   # or checkerboard_side_m, disc_radius_m")
            lines += ["", "[registration]", 'by = ["clouds"]   # no targets are named']
        return "\n".join([*lines, ""])

    def _scan_sections(self) -> Iterable[str]:
        self.stations = set_ups([(one.path, scan) for one in self.scans for scan in one.scans])
        for one in self.scans:
            name = self._use(one)
            usable = [scan for scan in one.scans if scan.origin != "unknown"]
            several = len(one.scans) > 1
            for scan in usable if several else one.scans:
                lines = ["[[scans]]", f"file = {name}"]
                if several:
                    lines.append(f"scan = {quoted(scan.name)}")
                lines.append(f"station = {quoted(self.stations[one.path, scan.name])}")
                lines.append('instrument = "scanner"')
                if scan.origin == "assumed":
                    lines.append('origin = "scanner"   # zero lies among its points')
                yield "\n".join([*lines, ""])
        levelled = self.wishes.levelled
        if self.stations and levelled is None:
            self.out.assumed.append(
                "compensator unknown: stations are not treated as levelled; add --levelled if it "
                "was on"
            )
        line = "levelled = true" if levelled else "# levelled = true   # if its compensator was on"
        for station in dict.fromkeys(self.stations.values()):
            yield f"[stations.{quoted(station)}]\n{line}\n"

    def _output(self) -> str:
        return '[output]\nfolder = "out"\nangle = "gon"   # or deg\n'


def _csv_name(station: str) -> str:
    """Name of the mark of a station in a list."""
    return f'"{station}-frame"' if "," in station else f"{station}-frame"


#: formats whose files bring a work frame of their own
_BRINGING = ("gnss", "dna", "dynaml", "ngs", "riscan", "comp3d", "gama", "starnet")


def _is_positions(one: FolderFile) -> bool:
    return one.table is not None and one.table.has("gnss")


def _is_levelling(one: FolderFile) -> bool:
    """True for a table of height differences and nothing that a total station measures."""
    others = ("direction", "azimuth", "zenith", "slope_distance", "horizontal_distance", "distance")
    table = one.table
    return table is not None and table.has("height_difference") and not any(map(table.has, others))


def _of_total_station(one: FolderFile) -> bool:
    """True for files whose observations are a total station's as far as anybody says."""
    if one.format == "csv":
        return not _is_positions(one) and not _is_levelling(one)
    return one.format == "totalstation"


def _assumed_instrument(name: str, figures: Sequence[str]) -> str:
    """A section with figures that are assumed."""
    source = 'source = "assumed by tribrach init"'
    return "\n".join(
        [
            f"[instruments.{name}]",
            '# assumed: nobody named the instrument; sheet = "..." takes its data sheet instead',
            *figures,
            source,
            "",
        ]
    )


def _value(value: str | int) -> str:
    return str(value) if isinstance(value, int) else quoted(value)
