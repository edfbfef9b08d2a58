"""The command line, with one file for each group of commands."""

from __future__ import annotations

import sys

from tribrach.cli.commands import app

__all__ = ["app", "main"]


def main() -> None:
    """Entry point of the command ``tribrach``."""
    # piping into head or a closed pager is no error worth a traceback
    try:
        app()
    except BrokenPipeError:
        sys.exit(141)
