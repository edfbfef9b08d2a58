"""Epochs from files: projects, survey files and coordinates, one against the other.

What an epoch file holds is in :mod:`tribrach.io.epoch_files`, how two epochs are compared in
:mod:`tribrach.job.epochs`; here networks are adjusted for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

from tribrach.errors import InputError
from tribrach.io.epoch_files import FORM, EpochDocument, read_epoch
from tribrach.io.survey.formats import read
from tribrach.job.epochs import (
    ComparedEpochs,
    EpochInput,
    EpochSettings,
    compare_epochs,
    control_names,
    epoch_of,
)
from tribrach.job.opened import open_job
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.network import Datum, Network
from tribrach.network.roles import datum_sentence
from tribrach.network.survey import observed_part
from tribrach.project import Project
from tribrach.project.sections import OutputSection
from tribrach.solution import AdjustmentSettings, solve

#: coordinates of a run with their joint covariance, where they are wanted
EPOCH = "epoch.json"
#: folder of results where the project names none
_RESULTS = OutputSection().folder


def epoch_from_files(
    files: Sequence[Path], *, datum: Literal["free", "control"] = "free", label: str = ""
) -> EpochInput:
    """An epoch from its files: a project, survey files, or coordinates with their covariance."""
    paths = [Path(file) for file in files]
    label = label or _label(paths[0])
    stored = read_epoch(paths)
    if stored is not None:
        return EpochInput(
            replace(stored.epoch, label=label), stored.site, sentences=stored.sentences
        )
    settings = AdjustmentSettings()
    if len(paths) == 1 and paths[0].suffix.lower() == ".toml":
        project = Project.load(paths[0])
        if project.scans:
            raise project.error(
                ("scans",),
                "the project has scans",
                f"run it with epoch = true in [output], and give the {EPOCH} that it writes",
            )
        settings = AdjustmentSettings.of(project)
        network = open_job(project).network()
    else:
        network = observed_part(read(paths)).network()
    return _epoch(network, settings, datum, label)


def _epoch(
    network: Network, settings: AdjustmentSettings, datum: Literal["free", "control"], label: str
) -> EpochInput:
    """The epoch of a network in a datum; blunders are switched off where that is asked for."""
    # roles of control are those before the datum lets it go
    control = control_names(network)
    if datum == "free":
        network = network.with_datum(Datum("free"))
    if settings.snoop or settings.robust != "none" or settings.vce:
        adjustment = solve(network, settings).adjustment
    else:
        adjustment = adjust(network)
    return replace(epoch_of(adjustment, label), control=control)


def compare_epoch_files(
    epochs: Sequence[Sequence[Path]],
    settings: EpochSettings,
    *,
    datum: Literal["free", "control"] = "free",
    previous: bool = False,
) -> list[ComparedEpochs]:
    """Compare epochs with the first of them, or each with the one before it."""
    if len(epochs) < 2:
        raise InputError("one epoch alone says nothing", cure="give at least two")
    labels = _labels([files[0] for files in epochs])
    inputs = [
        epoch_from_files(files, datum=datum, label=label)
        for files, label in zip(epochs, labels, strict=True)
    ]
    firsts = inputs[:-1] if previous else [inputs[0]] * (len(inputs) - 1)
    return [compare_epochs(one, two, settings) for one, two in zip(firsts, inputs[1:], strict=True)]


def _labels(files: Sequence[Path]) -> list[str]:
    """Names of epochs by their files; with more of the path where that is not enough."""
    for name in (
        [_label(f) for f in files],
        [f.name for f in files],
        [f"{f.resolve().parent.name}/{f.name}" for f in files],
    ):
        if len(set(name)) == len(name):
            return name
    return [f"{k + 1}: {f.name}" for k, f in enumerate(files)]


def _label(file: Path) -> str:
    """The name of a file without its suffix; of what a run has left, that of the folder."""
    if file.name != EPOCH:
        return file.stem
    folder = file.resolve().parent
    return (folder.parent if folder.name == _RESULTS else folder).name or file.stem


def epoch_text(adjustment: Adjustment, label: str) -> str:
    """The epoch file of an adjusted network, for later comparisons."""
    found = epoch_of(adjustment, label)
    return FORM.text(EpochDocument.of(found.epoch, found.site, datum_sentence(adjustment)))


def against_earlier(project: Project, adjustment: Adjustment) -> tuple[ComparedEpochs, ...]:
    """A project against the earlier epochs that it names."""
    out = []
    for k, section in enumerate(project.epochs):
        files = [project.folder / name for name in section.against]
        missing = [path for path in files if not path.is_file()]
        if missing:
            raise project.error(
                ("epochs", k, "against"), f"there is no file {missing[0].name}", "check the path"
            )
        first = epoch_from_files(files, datum=section.datum)
        # named as the earlier one is: after its folder, or by its title
        own = project.folder / project.output.folder / EPOCH
        label = _label(own) if files[0].name == EPOCH else project.title
        label = label if label != first.epoch.label else f"{label} (now)"
        second = _epoch(adjustment.network, AdjustmentSettings(), section.datum, label)
        control = control_names(adjustment.network)
        settings = EpochSettings(
            section.settings(project.confidence), section.coordinates, section.free
        )
        out.append(compare_epochs(first, replace(second, control=control), settings))
    return tuple(out)
