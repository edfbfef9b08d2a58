"""Where compiled code is kept from one run to the next.

Loops are compiled on their first use and kept beside the sources, or in the user's cache folder
where the package is read-only. Where neither can be written numba refuses to load at all; then a
private folder among the temporary files takes their place. ``NUMBA_CACHE_DIR`` overrules all this.
"""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def ensure_cache() -> Path | None:
    """Make sure that numba has a folder for compiled code."""
    if os.environ.get("NUMBA_CACHE_DIR") or _writable(_PACKAGE / "__pycache__"):
        return None
    if _writable(_of_user()):
        return None
    folder = _private()
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = str(folder)
    return folder


def cache_folder() -> Path:
    """The folder for what is said about all compiled code together."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given:
        return Path(given)
    own = _PACKAGE / "__pycache__"
    return own if _writable(own) else _of_user() / "numba"


def _writable(folder: Path) -> bool:
    """True if a folder, or its nearest parent that exists, can be written into."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)


def _of_user() -> Path:
    """The user's cache folder, where numba keeps what it cannot keep beside the sources."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or os.path.expanduser("~"))
    if sys.platform == "darwin":
        return Path(os.path.expanduser("~/Library/Caches"))
    return Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))


def _private() -> Path:
    """A folder that nobody else can write into: compiled code is run as it is found."""
    if not hasattr(os, "getuid"):
        return Path(tempfile.mkdtemp(prefix="tribrach-"))
    folder = Path(tempfile.gettempdir()) / f"tribrach-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    status = folder.lstat()
    own = stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid()
    if own and not status.st_mode & 0o077:
        return folder
    return Path(tempfile.mkdtemp(prefix="tribrach-"))
