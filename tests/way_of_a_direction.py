"""Which files and classes one direction passes, from its line in a GSI file to a row of a report.

``python -m tests.way_of_a_direction`` lists them. A small traverse in GSI is adjusted with page,
text and JSON; one direction in it has digits that nothing else has. Whenever a function of the
package returns, its parameters, variables and result are searched for that number, as digits, in
gon or in radians, alone or within lists, dictionaries and arrays: a file with such a function is
one that the direction passes. Its forms are the classes of the package that have it in a field,
where functions of two files or more have their objects in hand: what stays within a file is the
matter of that file. A file that is only asked whether the beginning of the text is in its format
is no part of the way.
"""

from __future__ import annotations

import math
import os
import sys
from collections import defaultdict
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType
from typing import Any

import numpy as np

import tribrach

__all__ = ["DIGITS", "Way", "traverse", "way"]

#: functions that say whether a text is in their format
_ASKED = {"sniff", "recognised", "vector_reader"}
#: the reading of the direction, in 1e-5 gon
DIGITS = "5712843"
_GON = int(DIGITS) / 1e5
_RAD = _GON * math.pi / 200
_PACKAGE = str(Path(tribrach.__file__).parent) + os.sep
#: containers are searched so deep, and so many of their items
_DEPTH, _MOST = 3, 400

#: places E, N, U of a traverse [m]
PLACES = {
    "A": (1000.0, 2000.0, 6.0),
    "B": (1030.0, 2020.0, 6.4),
    "C": (1062.0, 2004.0, 6.9),
    "D": (1041.0, 1973.0, 6.2),
}


class Way:
    """The files that the direction passed, with the functions that had it."""

    def __init__(self) -> None:
        self.files: dict[str, set[str]] = defaultdict(set)
        self._forms: dict[str, set[str]] = defaultdict(set)

    @property
    def forms(self) -> dict[str, set[str]]:
        """Classes that had the direction in a field, with the files that had them in hand."""
        return {form: files for form, files in self._forms.items() if len(files) > 1}

    @property
    def handed_on(self) -> set[str]:
        """Files that never had the number itself, only an object with it."""
        return {file for files in self._forms.values() for file in files} - set(self.files)

    def profile(self, frame: FrameType, event: str, result: Any) -> None:
        """Look into the hands of a function that returns."""
        code = frame.f_code
        if event != "return" or not code.co_filename.startswith(_PACKAGE):
            return
        hands = [*frame.f_locals.values(), result]
        file = code.co_filename.removeprefix(_PACKAGE)
        asked = code.co_qualname.split(".")[0] in _ASKED
        if not asked and any(_holds(value, _DEPTH) for value in hands):
            self.files[file].add(code.co_qualname)
        for value in hands:
            self._form(value, file)

    def _form(self, value: Any, file: str) -> None:
        """Note the class of an object of the package that has the direction in a field."""
        for one in value if isinstance(value, list | tuple) and len(value) < _MOST else (value,):
            kind = type(one)
            if not kind.__module__.startswith("tribrach."):
                continue
            fields = one if isinstance(one, tuple) else _fields(one)
            if any(_holds(item, _DEPTH) for item in fields):
                self._forms[f"{kind.__module__.removeprefix('tribrach.')}.{kind.__name__}"].add(
                    file
                )


def _fields(one: Any) -> list[Any]:
    """What stands in the fields of an object."""
    values = list(getattr(one, "__dict__", {}).values())
    slots = [n for base in type(one).__mro__ for n in getattr(base, "__slots__", ())]
    return values + [getattr(one, n, None) for n in slots if n not in ("__dict__", "__weakref__")]


def _holds(value: Any, depth: int) -> bool:
    """Is this the direction, or a container with it?"""
    if isinstance(value, str | bytes):
        text = value if isinstance(value, str) else value.decode("latin-1", "ignore")
        return any(digits in text for digits in _WRITTEN)
    if isinstance(value, float):
        return abs(value - _GON) < 1e-9 or abs(value - _RAD) < 1e-12
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "f":
            return bool(((np.abs(value - _RAD) < 1e-12) | (np.abs(value - _GON) < 1e-9)).any())
        return False
    if depth and isinstance(value, dict):
        return len(value) < _MOST and any(_holds(item, depth - 1) for item in value.values())
    if depth and type(value) in (list, tuple, set, frozenset):
        return len(value) < _MOST and any(_holds(item, depth - 1) for item in value)
    return False


#: how it is written: in the file, in the report, in JSON
_WRITTEN = (f"{int(DIGITS):016d}", f"{_GON:.4f}", f"{_RAD:.12f}"[:12])


def traverse(folder: Path) -> list[Path]:
    """Write the traverse and its control; readings follow from them, one is the digits."""
    lines = []
    turn = {}
    for number, at in enumerate(PLACES):
        lines.append(f"*110{len(lines) + 1:03d}+{at:0>16} 88...6+{0:016d} ")
        here = np.array(PLACES[at])
        for to, place in PLACES.items():
            if to == at:
                continue
            east, north, up = np.array(place) - here
            flat = math.hypot(east, north)
            azimuth = math.atan2(east, north) * 200 / math.pi
            if at not in turn:
                turn[at] = (_GON if number == 0 else 11.0 * number) - azimuth
            reading = round((azimuth + turn[at]) % 400 * 1e5)
            zenith = round(math.atan2(flat, up) * 200 / math.pi * 1e5)
            distance = round(math.hypot(flat, up) * 1e4)
            lines.append(
                f"*110{len(lines) + 1:03d}+{to:0>16} 21.102+{reading:016d} 22.102+{zenith:016d} "
                f"31...6+{distance:016d} 51....+00000000000+0000 87...6+{0:016d} "
            )
    files = [folder / "control.csv", folder / "traverse.gsi"]
    head = "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm\n"
    control = [",".join([n, *map(str, PLACES[n]), "1,1,1.5"]) for n in ("A", "C")]
    files[0].write_text(head + "\n".join(control) + "\n")
    files[1].write_text("\n".join(lines) + "\n")
    return files


def way() -> Way:
    """Adjust the traverse by the command, and see where its direction was."""
    from typer.testing import CliRunner

    from tribrach.cli.commands import app

    found = Way()
    with TemporaryDirectory() as name:
        folder = Path(name)
        files = [str(path) for path in traverse(folder)]
        out = [f"--{form}={folder / form}" for form in ("json", "html", "text")]
        CliRunner().invoke(app, ["adjust", *files, *out])
        sys.setprofile(found.profile)
        try:
            done = CliRunner().invoke(app, ["adjust", *files, *out, "--overwrite"])
        finally:
            sys.setprofile(None)
        assert done.exit_code == 0, done.output
    return found


if __name__ == "__main__":
    seen = way()
    for file, names in sorted(seen.files.items()):
        print(f"{file}: {', '.join(sorted(names))}")
    print(
        f"{len(seen.files)} files; only an object with it had {', '.join(sorted(seen.handed_on))}"
    )
    for form, where in sorted(seen.forms.items()):
        print(f"{form}: {len(where)} files")
    print(f"{len(seen.forms)} forms")
