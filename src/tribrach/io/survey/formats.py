"""Chooses the reader of a survey file: by suffix, and by content where a suffix is shared."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tribrach.errors import InputError, RefusalCollector, UnknownName
from tribrach.geodesy.site import FlatSite
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.io.opened_files import contents, lines_of
from tribrach.io.survey.comp3d.text import comp3d_lines
from tribrach.network.facts import EARTH
from tribrach.network.identity import names_apart
from tribrach.network.occupations import LONG
from tribrach.network.survey import Survey
from tribrach.observations.sights import HorizontalDistances, SlopeDistances, ZenithAngles
from tribrach.units import carried_angles

#: format name -> module of the reader in :mod:`tribrach.io`
FORMATS = {
    "gama": "survey.gama.reader",
    "dynaml": "survey.dynadjust.reader",
    "dna": "survey.dynadjust.reader",
    "ngs": "survey.ngs",
    "comp3d": "survey.comp3d.reader",
    "starnet": "survey.starnet.reader",
    "riscan": "survey.riscan.reader",
    "totalstation": "survey.totalstation",
    "levels": "levels.files",
    "csv": "survey.csv.tables",
    "gnss": "gnss.files",
}
SUFFIXES = {
    ".gkf": "gama",
    ".rsp": "riscan",
    ".stn": "dna",
    ".msr": "dna",
    ".geo": "dna",
    ".jsonl": "dynaml",
    ".csv": "csv",
    ".xlsx": "csv",
    ".cor": "comp3d",
    ".new": "comp3d",
    ".obs": "comp3d",
    ".comp": "comp3d",
    ".snproj": "starnet",
    ".prj": "starnet",
    ".gvx": "gnss",
    ".snx": "gnss",
    ".pos": "gnss",
}
#: formats whose files belong together and are read in one go
JOINT = ("dynaml", "dna", "ngs", "comp3d", "starnet", "totalstation", "levels", "gnss")


def format_of(path: Path) -> str:
    """Name of a file's format."""
    if not path.is_file():
        raise InputError("there is no such file", file=path, cure="check the path")
    suffix = path.suffix.lower()
    if suffix == ".xml":
        head = contents(path, 4000).lower()
        if b"<landxml" in head:
            return "totalstation"
        if b"<gvx" in head:
            return "gnss"
        return "gama" if b"gama-local" in head else "dynaml"
    if suffix not in SUFFIXES:
        shown = _by_content(path)
        if shown is not None:
            return shown
        if not contents(path, 4000).strip():
            raise InputError("the file is empty", file=path, cure="copy it again")
        if suffix in _RAW:
            raise _other_content(path, _RAW[suffix])
        raise InputError(
            f"the suffix {suffix or 'of the file'} belongs to no known format",
            file=path,
            cure=f"known are {', '.join(sorted(SUFFIXES))}, .xml, data of STAR*NET and raw "
            "files of total stations",
        )
    rinex = b"RINEX VERSION / TYPE" in contents(path, 400)
    if suffix in (".obs", ".cor", ".new") and (rinex or not comp3d_lines(path)):
        shown = _by_content(path)
        if shown is not None:
            return shown
        raise _other_content(path, "Comp3D")
    return SUFFIXES[suffix]


#: suffixes that makers give their raw files; the content decides
_RAW = {
    ".sdr": "Sokkia SDR",
    ".gsi": "Leica GSI",
    ".gre": "Leica GSI",
    ".m5": "Trimble and Zeiss M5",
    ".jxl": "Trimble JobXML",
    ".jobxml": "Trimble JobXML",
    ".rw5": "Carlson RW5",
    ".fbk": "Autodesk field books",
    ".gt6": "Topcon GTS-6",
    ".gt7": "Topcon GTS-7",
}
#: characters of a line that a message shows
_SHOWN = 40


def _other_content(path: Path, format: str) -> InputError:
    """The refusal of a file whose suffix is that of a format and whose content is not."""
    lines = lines_of(contents(path, 4000).decode("latin-1"))
    number, line = next(
        ((k, x.strip()) for k, x in enumerate(lines, start=1) if x.strip()), (1, "")
    )
    if "RINEX VERSION / TYPE" in line:
        what, cure = "this is a RINEX file", "tribrach baseline computes vectors from it"
    else:
        start = line if len(line) <= _SHOWN else f"{line[:_SHOWN]}..."
        what = f"the suffix {path.suffix} is that of {format}, and the file begins with {start!r}"
        cure = f"give it as {format} writes it, or make a CSV table of it with a header"
    return InputError(what, file=path, line=number, cure=cure)


def _by_content(path: Path) -> str | None:
    """The format of a file whose suffix says nothing: raw files and lists may have any, or none."""
    # loaded here: all these readers take longer to load than most networks to be read
    from tribrach.io.gnss.files import vector_reader
    from tribrach.io.levels import files as levels
    from tribrach.io.survey import ngs
    from tribrach.io.survey.starnet import recognition as starnet
    from tribrach.io.totalstation.formats import recognised

    if ngs.recognised(path):
        return "ngs"
    if vector_reader(path) is not None:
        return "gnss"
    if levels.recognised(path):
        return "levels"
    if recognised(path):
        return "totalstation"
    return "starnet" if starnet.recognised(path) else None


def read(
    files: str | Path | Iterable[str | Path],
    format: str | None = None,
) -> Survey:
    """Read survey files of any format that is known.

    Parameters
    ----------
    files : path or iterable of paths
        One file, or several that belong together.
    format : str, optional
        Their format, a key of ``FORMATS``; found for each file if not given.

    Returns
    -------
    Survey
        What was measured and given, by name.

    Raises
    ------
    InputError
        No file, no such file, an unknown format, and what a file says wrong, with its line.

    Examples
    --------
    >>> survey = read("network.gkf")  # doctest: +SKIP
    >>> survey = read(["points.csv", "traverse.gsi"])  # doctest: +SKIP
    """
    paths = [Path(file) for file in ([files] if isinstance(files, str | Path) else files)]
    if not paths:
        raise InputError("no files are given", cure="name at least one file")
    if format is not None and format not in FORMATS:
        raise UnknownName("format", format, FORMATS)
    return read_files(paths, format)


def read_files(
    paths: Sequence[Path],
    format: str | None = None,
    labels: Mapping[Path, str] | None = None,
) -> Survey:
    """One survey of all files, in one format or in that which each file shows."""
    # formats of one reader may be mixed
    by_reader: dict[str, tuple[str, list[Path]]] = {}
    with RefusalCollector() as refused:
        for path in paths:
            with refused.record():
                name = format or format_of(path)
                by_reader.setdefault(FORMATS[name], (name, []))[1].append(path)
    surveys: list[Survey] = []
    apart = names_apart(paths) if labels is None else labels
    # raw files come last: what they were given counts only where no list gives more
    order = sorted(by_reader.items(), key=lambda one: one[1][0] == "totalstation")
    with RefusalCollector() as refused:
        for reader, (name, files) in order:
            module = importlib.import_module(f"tribrach.io.{reader}")
            for together in [files] if name in JOINT else [[path] for path in files]:
                with refused.record(), carried_angles() as carried:
                    surveys.append(_read(module, name, together, apart, surveys))
                    surveys[-1].warnings += carried_words(carried, together[0].name)
    _leave_heights(surveys)
    first, *others = surveys
    for other in others:
        if FlatSite() not in (first.site, other.site) and first.site != other.site:
            raise InputError(
                "the files bring different work frames",
                file=paths[0],
                cure="give files of one format, or a project with a site and the files as entries",
            )
        site = other.site if first.site == FlatSite() else first.site
        first.merge(other)
        first.site = site
    return first


def _bent(survey: Survey) -> bool:
    """True if a table on a plane has zenith angles of sights that the Earth's curvature bends."""
    tilted: set[tuple[str, str]] = set()
    far: set[tuple[str, str]] = set()
    for table in survey.tables():
        if issubclass(table.kind, ZenithAngles | SlopeDistances | HorizontalDistances):
            ends = zip(table.columns["start"], table.columns["end"], strict=True)
            if issubclass(table.kind, ZenithAngles):
                tilted |= set(ends)
            else:
                long = np.ravel(table.columns["values"]) > LONG
                far |= {pair for pair, one in zip(ends, long, strict=True) if one}
    return survey.site == FlatSite() and not tilted.isdisjoint(far)


def _leave_heights(surveys: Sequence[Survey]) -> None:
    """Heights that were keyed into a level give way to those of lists."""
    from tribrach.io.levels.files import Levelled, leave_to

    levelled = [any(isinstance(f, Levelled) for f in survey.facts) for survey in surveys]
    known = {
        name
        for survey, level in zip(surveys, levelled, strict=True)
        if not level
        for name, point in survey.points.items()
        if np.isfinite(point.xyz).any()
    }
    for survey, level in zip(surveys, levelled, strict=True):
        if level:
            leave_to(survey, known)


def carried_words(carried: Sequence[str], name: str) -> list[str]:
    """That angles of a file have 60 minutes or seconds, and how they are read."""
    if not carried:
        return []
    one = len(carried) == 1
    return [
        f"{name}: {len(carried)} angle{' has' if one else 's have'} 60 minutes or seconds, as "
        f"rounding leaves them, and {'is' if one else 'are'} carried: "
        f"{', '.join(dict.fromkeys(carried[:3]))}."
    ]


def _read(
    module: Any, name: str, files: list[Path], labels: Mapping[Path, str], before: Sequence[Survey]
) -> Survey:
    """One survey of files that belong together, by the module of their format."""
    survey: Survey
    if name == "totalstation":
        survey = module.read_beside(files, before, labels)
        return survey
    if name in ("gnss", "starnet", "levels"):
        survey = module.read(files, labels=labels)
    elif name in JOINT:
        survey = module.read(files)
    elif name == "csv":
        survey = module.read(files[0], module.Context(label=labels[files[0]]))
        if _bent(survey):
            frame = WorkFrame(FlatSite(EARTH))
            survey = module.read(files[0], module.Context(frame=frame, label=labels[files[0]]))
    elif name == "gama":
        survey = module.read(files[0], labels[files[0]])
    else:
        survey = module.read(files[0])
    return survey
