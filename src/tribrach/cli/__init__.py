"""The command line, one file per group of commands."""

from __future__ import annotations

import sys

from tribrach.cli import (
    calibrate,
    check,
    compare,
    complete,
    gnss,
    network,
    plan,
    register,
    regress,
    scans,
    transform,
)
from tribrach.cli.shell import app

__all__ = [
    "app",
    "calibrate",
    "check",
    "compare",
    "complete",
    "gnss",
    "main",
    "network",
    "plan",
    "register",
    "regress",
    "scans",
    "transform",
]


def main() -> None:
    """Entry point of the command."""
    # piping into head or a closed pager is no error worth a traceback
    try:
        app()
    except BrokenPipeError:
        sys.exit(141)
