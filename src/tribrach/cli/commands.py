"""The application and its commands; each is loaded when it is called, and only that one.

The table :data:`COMMANDS` is all that the list of commands needs: what a command reads, computes
and draws with takes seconds to load, and no other command waits for it.
"""

from __future__ import annotations

import gc
from functools import cached_property
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

import tribrach
from tribrach.shell.help_words import SpokenCommand, SpokenGroup, spoken

#: by name in the order of a job: the module that has a function or a group of that name, and what
#: it does, in the words of its first line
COMMANDS: dict[str, tuple[str, str]] = {
    "init": (
        "cli.init",
        "Write a project file for a folder: looks at scans, observations and lists, and asks.",
    ),
    "check-project": (
        "cli.check_project",
        "Read a project and all its files, and list every mistake at once; nothing is run.",
    ),
    "run": ("cli.run", "Run a project: adjust, check, report."),
    "demo": (
        "cli.demo",
        "Simulate a survey of two facades, run it, and compare everything with the truth.",
    ),
    "adjust": (
        "questions.adjust.command",
        "Adjust a network from files of any known format, or a project without scans.",
    ),
    "export": (
        "cli.export",
        "Write a result for an office, or a network for another program.",
    ),
    "view": (
        "cli.view",
        "Look at results: clouds with their sigmas, the network, its tests, in the browser.",
    ),
    "workbench": (
        "cli.workbench",
        "Work on a project in the browser: switch observations off, see at once what moves.",
    ),
    "leave-out": (
        "questions.leave_out",
        "Compare control with the rest: left out in turn, and 3, 5, 9 of n as control.",
    ),
    "plan": (
        "questions.plan.command",
        "Predict precision and reliability, and propose targets, stations and sets.",
    ),
    "baseline": ("questions.baseline.command", "Compute a static baseline from RINEX files."),
    "targets": (
        "questions.targets.command",
        "Find spheres, checkerboards and discs in whole scans; centres in their coordinates.",
    ),
    "pick": (
        "questions.pick",
        "Pick a natural point of a scan: corner, edge, disc, hole, axis or place, with covariance.",
    ),
    "register": (
        "questions.register.command",
        "Register scans by their clouds; no targets, planes or approximate poses are needed.",
    ),
    "transform": (
        "questions.transform.command",
        "Fit a transformation to common points, and apply it.",
    ),
    "calibrate": (
        "questions.calibrate.command",
        "Calibrate scanners from targets that they saw from several stations.",
    ),
    "check": (
        "questions.check.command",
        "Test a scanner in the field: both faces, distances between targets, repeated series.",
    ),
    "noise": (
        "questions.noise.command",
        "Estimate the noise of a scanner from planes in its scans: a law for each point.",
    ),
    "compare": (
        "questions.compare.command",
        "Compare two clouds, on test sites or as a whole, with the sampling floor beside.",
    ),
    "epochs": (
        "questions.epochs.command",
        "Say what has moved between epochs: which points, how far, how sure.",
    ),
    "series": (
        "questions.series.command",
        "Adjust all cycles of a monitored network: which points move, trends, jumps, alarms.",
    ),
    "regress": (
        "questions.regress.command",
        "Fit differences of clouds against range and incidence, and say what that tells.",
    ),
    "complete": (
        "questions.complete.command",
        "Say which surfaces no station, one or several saw, and where the sigma is not reached.",
    ),
    "diff": (
        "questions.diff.command",
        "Say what differs between two results: what moved, sigmas, states of observations, edits.",
    ),
    "pdf": (
        "cli.pdf",
        "Make a PDF/A-3 of a page: equal figures, JSON inside, a field for a signature.",
    ),
    "seal": (
        "cli.seal",
        "Put a job into one file: inputs, decisions, results, versions, digests, a signature.",
    ),
    "verify": (
        "cli.seal",
        "Test a sealed job: is every file unchanged, who signed it, does a run give the same?",
    ),
    "info": (
        "questions.info",
        "Say what is in files of scans: points, extents, fields, grid, poses, what looks wrong.",
    ),
    "convert": ("questions.convert", "Write scans in another format, every field kept."),
    "simulate": (
        "cli.simulate",
        "Simulate a whole survey job: scans, observations, project file and its truth.",
    ),
    "doctor": (
        "cli.doctor",
        "Say which version runs where, where compiled code is kept, and what is missing for what.",
    ),
}
#: headings in the list of commands, in its order; what is under none of them is a tool
GROUPS: dict[str, tuple[str, ...]] = {
    "A job from its files to its results": (
        "init",
        "check-project",
        "run",
        "demo",
        "pdf",
        "seal",
        "verify",
    ),
    "Networks": (
        "adjust",
        "leave-out",
        "plan",
        "epochs",
        "series",
        "diff",
        "export",
        "transform",
        "baseline",
    ),
    "Results in a browser": ("view", "workbench"),
    "Scans": ("info", "targets", "pick", "register", "convert"),
    "Instruments": ("calibrate", "check", "noise"),
    "Clouds compared": ("compare", "regress", "complete"),
}
_TOOLS = "Tools"


def _group(name: str) -> str:
    """The heading that a command stands under."""
    return next((group for group, names in GROUPS.items() if name in names), _TOOLS)


class LoadedWhenCalled(TyperCommand):
    """A command that is known by name and help; the rest is in its module."""

    def __init__(self, name: str, module: str, help: str) -> None:
        super().__init__(name, help=help, rich_help_panel=_group(name))
        self._module = module

    @cached_property
    def loaded(self) -> Any:
        """The command itself, or the group of commands."""
        assert self.name is not None
        own = self.name.replace("-", "_")
        command = getattr(import_module(f"tribrach.{self._module}"), own)
        if not isinstance(command, typer.Typer):
            function, command = command, typer.Typer(add_completion=False)
            command.command(self.name, cls=SpokenCommand)(function)
            made: Any = typer.main.get_command(command)
            spoken(made, function)
        else:
            made = typer.main.get_command(command)
            for one in command.registered_commands:
                if one.callback is not None:
                    spoken(made.commands[one.name or one.callback.__name__], one.callback)
        if not gc.isenabled():  # cli.main waits for the modules, which are no garbage ever
            gc.freeze()
            gc.enable()
        return made

    def make_context(self, info_name: Any, args: Any, parent: Any = None, **extra: Any) -> Any:
        """The context of the command itself, which does everything from here on."""
        return self.loaded.make_context(info_name, args, parent=parent, **extra)


class _Commands(SpokenGroup):
    """All commands of the table."""

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.commands = {
            name: LoadedWhenCalled(name, module, help) for name, (module, help) in COMMANDS.items()
        }

    def list_commands(self, ctx: Any) -> list[str]:
        """Names by their groups, within one in the order of the table."""
        groups = [*GROUPS, _TOOLS]
        return sorted(COMMANDS, key=lambda name: groups.index(_group(name)))


app = typer.Typer(
    cls=_Commands,
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Turns laser scans and survey observations into georeferenced clouds that state their "
    "uncertainty.",
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"tribrach {tribrach.__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_version, is_eager=True, metavar="", help="Print the version."
        ),
    ] = False,
) -> None:
    """Turns laser scans and survey observations into clouds that state their uncertainty."""
