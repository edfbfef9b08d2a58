"""STAR*NET jobs: data files with the settings of their project.

The project file (``.snproj``, ``.prj``) may be given with the data, or stand beside them: one that
has the name of the data file, or lists it. Given alone it brings the data files that it lists. In
its place a listing (``.lst``) gives the settings that its heading repeats. Format: STAR*NET
reference manual.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path, PureWindowsPath

from tribrach.errors import InputError, RefusalCollector
from tribrach.io.survey.starnet.assembly import Part, assemble
from tribrach.io.survey.starnet.data import DataReader
from tribrach.io.survey.starnet.recognition import PROJECTS, is_settings
from tribrach.io.survey.starnet.records import StarnetRecords
from tribrach.io.survey.starnet.settings import StarnetSettings, read_settings
from tribrach.network.survey import Survey
from tribrach.sentences import Sentence, joined


def read(
    paths: Path | Sequence[Path],
    labels: Mapping[Path, str] | None = None,
    part: Part = "all",
) -> Survey:
    """The survey of a job.

    ``paths``: data files, and at most one file with the settings of the project; or that file
    alone; ``labels``: what tells files of one name apart, by path; ``part``: ``points`` leaves out
    what is observed, ``planned`` what is given.
    """
    files = [paths] if isinstance(paths, Path) else list(paths)
    chosen = [path for path in files if is_settings(path)]
    data = [path for path in files if path not in chosen]
    if len(chosen) > 1:
        raise InputError(
            f"{chosen[0].name} gives the settings already", file=chosen[1], cure="give one of them"
        )
    beside = None if chosen else _beside(data)
    where = chosen[0] if chosen else beside
    settings = StarnetSettings() if where is None else read_settings(where)
    if not data:
        assert where is not None
        data = _listed(where, settings)
    with RefusalCollector() as refused:
        for what in settings.refusals:
            refused.add(InputError(what, file=where, cure="leave it out of the project"))
        reader = DataReader(settings, refused, data[0].parent)
        for path in data:
            reader.read(path, (labels or {}).get(path, path.name))
        records = reader.finish()
        refused.settle()
        survey = assemble(records, reader.stated, refused, part)
    if beside is not None:
        survey.warnings.append(f"The settings are those of {beside.name}, which stands beside.")
    survey.warnings += [f"{settings.source}: {what}." for what in settings.warnings]
    if where is None:
        survey.warnings += _assumed(records, settings)
    return survey


def _beside(data: Sequence[Path]) -> Path | None:
    """The project file in the folder of the data that belongs to them, None if there is not one."""
    folder = data[0].parent
    projects = sorted(p for p in folder.iterdir() if p.suffix.lower() in PROJECTS)
    named = [p for p in projects if p.stem.lower() == data[0].stem.lower()]
    if len(named) == 1:
        return named[0]
    wanted = {path.name.lower() for path in data}
    listing = []
    for project in projects:
        try:
            files = read_settings(project).files
        except InputError:
            continue
        if wanted <= {PureWindowsPath(name).name.lower() for name in files}:
            listing.append(project)
    if len(listing) == 1:
        return listing[0]
    heading = data[0].with_suffix(".lst")
    return heading if heading.is_file() and is_settings(heading) else None


def _listed(where: Path, settings: StarnetSettings) -> list[Path]:
    """The data files that a project lists, in its own folder."""
    if not settings.files:
        raise InputError("no data file is listed", file=where, cure="give the data files with it")
    there = {path.name.lower(): path for path in where.parent.iterdir() if path.is_file()}
    out = []
    for name in settings.files:
        path = there.get(PureWindowsPath(name).name.lower())
        if path is None:
            raise InputError(
                f"the data file {name} is not beside it", file=where, cure="put it into the folder"
            )
        out.append(path)
    return out


def _assumed(records: StarnetRecords, settings: StarnetSettings) -> list[str]:
    """The sentence on standard errors that nobody gave."""
    errors = settings.default
    distances = Sentence(
        "distances {errors.distance:mmg} + {errors.distance_ppm:ppmg}", errors=errors
    )
    figures = {
        "direction": Sentence("directions {errors.direction:arcsecg}", errors=errors),
        "angle": Sentence("angles {errors.angle:arcsecg}", errors=errors),
        "bearing": Sentence("bearings {errors.azimuth:arcsecg}", errors=errors),
        "zenith angle": Sentence("zenith angles {errors.zenith:arcsecg}", errors=errors),
        "slope distance": distances,
        "horizontal distance": distances,
        "height difference": Sentence("height differences {errors.rise:mmg}", errors=errors),
        "levelling": Sentence(
            "levelling {settings:mmg2} per root of a km",
            settings=settings.levelling * 1000**0.5,
        ),
    }
    used = list(dict.fromkeys(figures[what] for what in figures if what in records.assumed))
    if not used:
        return []
    return [
        "There is no project file, and lines leave their standard errors to it; assumed are "
        + joined(", ", used)
        + ". Give the project file (.snproj, .prj) with the data."
    ]
