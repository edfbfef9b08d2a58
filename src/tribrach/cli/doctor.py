"""The command doctor: versions, packages and caches of an installation, and what is missing."""

from __future__ import annotations

import platform
import re
import shutil
import sys
from collections.abc import Iterator
from importlib import metadata

import typer

import tribrach
from tribrach.gnss.engine import PROGRAM
from tribrach.kernel_cache import cache_folder
from tribrach.shell.flow import say

#: what packages are for without which the rest works
_FOR = {
    "pye57": "reading and writing E57",
    "pyrtklib": f"GNSS baselines, unless {PROGRAM} is installed",
    "polars": "tables for Python of the library Polars",
    "dask": "work on scans on a cluster",
    "cryptography": "encrypted connections of a cluster",
    "pyhanko": "signatures of sealed jobs, fields for signatures in PDF",
    "typst": "PDF",
    "pyhanko-certvalidator": "signatures of sealed jobs",
    "asn1crypto": "signatures of sealed jobs",
    "kiss-matcher": "a second search for starts of clouds",
    "hatanaka": "compact RINEX",
    "ncompress": "RINEX packed as .Z",
    "matplotlib": "plots in Python",
    "pyogrio": "GeoPackage, GeoJSON and KML",
    "trimesh": "models in PLY, glTF and other formats of meshes",
}
#: extras for those who work on the program
_WORKSHOP = {"dev", "docs", "peers", "fuzz"}


def doctor() -> None:
    """Say which version runs where, where compiled code is kept, and what is missing for what."""
    say(
        f"tribrach {tribrach.__version__}, Python {platform.python_version()}, "
        f"{platform.system()} {platform.machine()}\n"
        f"program: {tribrach.__path__[0]}\npython: {sys.executable}\n"
        f"compiled code: {cache_folder()}"
    )
    missing, broken = [], []
    for name, extra, conditional in _packages():
        try:
            say(f"  {name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            if extra or conditional:
                what = _FOR.get(name, f"the extra {extra}")
                cure = f'pip install "tribrach[{extra}]"' if extra else f"pip install {name}"
                missing.append(f"  {name}: {what} ({cure})")
            else:
                broken.append(name)
    if shutil.which(PROGRAM) is None:
        missing.append(f"  {PROGRAM}: a program of RTKLIB that takes the place of pyrtklib")
    if missing:
        say("\n".join(["Not installed, and only needed for this:", *missing]))
    if broken:
        say(f"Missing: {', '.join(broken)}\nnow: pip install --force-reinstall tribrach")
        raise typer.Exit(1)
    say("Nothing that is required is missing.")


def _packages() -> Iterator[tuple[str, str, bool]]:
    """Names of the packages that are used, the extra of each, and if machines lack it."""
    seen = set[str]()
    for line in metadata.requires("tribrach") or ():
        found = re.match(r"[\w.-]+", line)
        extra = re.search(r"extra\s*==\s*['\"]([\w-]+)", line)
        of = extra[1] if extra else ""
        if found and of not in _WORKSHOP and found[0] not in seen:
            seen.add(found[0])
            yield found[0], of, ";" in line
