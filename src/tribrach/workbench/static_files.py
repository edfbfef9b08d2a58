"""The page itself: files that the build of ``web/`` left in this package."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

#: the page, and what lists the sources that it was built from
PAGE, BUILD = "index.html", "BUILD.json"


def static_folder() -> Path:
    """The folder of the built page in the installed package."""
    return Path(str(files("tribrach.workbench"))) / "static"


def page_files() -> dict[str, Path]:
    """Files of the page by their names; those below ``app/`` but the page itself."""
    folder = static_folder()
    if not folder.is_dir():
        return {}
    found = sorted(p for p in folder.iterdir() if p.is_file() and not p.is_symlink())
    return {path.name: path for path in found if not path.name.startswith(".")}
