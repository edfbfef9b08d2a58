"""Chooses the reader of a survey file: by suffix, and by content where a suffix is shared."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tribrach.errors import InputError, RefusalCollector, UnknownName
from tribrach.geodesy.site import FlatSite
from tribrach.io.opened_files import contents
from tribrach.network.identity import names_apart
from tribrach.network.survey import Survey

__all__ = ["FORMATS", "format_of", "read", "read_files"]

#: format name -> module of the reader in :mod:`tribrach.io`
FORMATS = {
    "gama": "survey.gama.reader",
    "dynaml": "survey.dynadjust.reader",
    "dna": "survey.dynadjust.reader",
    "comp3d": "survey.comp3d.reader",
    "starnet": "survey.starnet.reader",
    "riscan": "survey.riscan.reader",
    "totalstation": "survey.totalstation",
    "csv": "survey.csv.tables",
    "gnss": "gnss.files",
}
SUFFIXES = {
    ".gkf": "gama",
    ".rsp": "riscan",
    ".stn": "dna",
    ".msr": "dna",
    ".geo": "dna",
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
JOINT = ("dynaml", "dna", "comp3d", "starnet", "totalstation", "gnss")


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
        raise InputError(
            f"the suffix {suffix or 'of the file'} belongs to no known format",
            file=path,
            cure=f"known are {', '.join(sorted(SUFFIXES))}, .xml, data of STAR*NET and raw "
            "files of total stations",
        )
    return SUFFIXES[suffix]


def _by_content(path: Path) -> str | None:
    """The format of a file whose suffix says nothing: raw files and lists may have any, or none."""
    # loaded here: all these readers take longer to load than most networks to be read
    from tribrach.io.gnss.files import vector_reader
    from tribrach.io.survey.starnet import recognition as starnet
    from tribrach.io.totalstation.formats import recognised

    if vector_reader(path) is not None:
        return "gnss"
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
    with RefusalCollector() as refused:
        for reader, (name, files) in by_reader.items():
            module = importlib.import_module(f"tribrach.io.{reader}")
            for together in [files] if name in JOINT else [[path] for path in files]:
                with refused.record():
                    surveys.append(_read(module, name, together, apart))
    first, *others = surveys
    for other in others:
        if FlatSite() not in (first.site, other.site) and first.site != other.site:
            raise InputError(
                "the files bring different work frames",
                file=paths[0],
                cure="give files of one format, or a project with a site and the files as entries",
            )
        first.merge(other)
    return first


def _read(module: Any, name: str, files: list[Path], labels: Mapping[Path, str]) -> Survey:
    """One survey of files that belong together, by the module of their format."""
    survey: Survey
    if name in ("gnss", "starnet"):
        survey = module.read(files, labels=labels)
    elif name in JOINT:
        survey = module.read(files)
    elif name == "csv":
        survey = module.read(files[0], module.Context(label=labels[files[0]]))
    elif name == "gama":
        survey = module.read(files[0], labels[files[0]])
    else:
        survey = module.read(files[0])
    return survey
