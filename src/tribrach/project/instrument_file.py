"""Instrument files: figures of one instrument, for as many projects as use it.

TOML with one table ``[instrument]``, whose keys are those of ``[instruments.NAME]`` of a project;
``source`` says where the figures come from. Measured figures leave in such a file, among them the
law of the noise of ranges.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from tribrach.errors import InputError
from tribrach.io.toml_model import quoted
from tribrach.project import toml_file
from tribrach.project.instrument import Instrument
from tribrach.project.sections import Section

#: keys that lead to other files and so have no place in one that is passed on
_ELSEWHERE = ("file", "calibration")
#: the largest file of this kind [bytes]
_LARGEST = 100_000


class InstrumentFile(Section):
    """The whole of an instrument file."""

    instrument: Instrument


def read_instrument_file(path: Path) -> tuple[dict[str, Any], str]:
    """Keys and values of an instrument file, and its source: the file's own words, or its name."""
    data, text = toml_file.load(path, _LARGEST)
    if not isinstance(data.get("instrument"), dict):
        raise InputError(
            "an instrument file has a table [instrument], and this one has none",
            file=path,
            line=1,
            cure="put the line [instrument] above its keys",
        )
    try:
        InstrumentFile.model_validate(data)
    except ValidationError as error:
        raise toml_file.refused(error, InstrumentFile, path, text) from error
    table = data["instrument"]
    for key in _ELSEWHERE:
        if key in table:
            raise InputError(
                f"{key} names another file, which an instrument file does not",
                file=path,
                line=toml_file.line_of(text, ("instrument", key)),
                cure=f"give {key} in the section of the instrument in the project",
            )
    return table, table.get("source") or f"instrument file {path.name}"


def instrument_file_text(
    figures: Mapping[str, float | str | tuple[float, ...]], source: str, sheet: str | None = None
) -> str:
    """Figures of an instrument as such a file, six digits each; ``sheet`` has the others."""
    table: dict[str, Any] = {"source": source} | ({"sheet": sheet} if sheet else {})
    for key, value in figures.items():
        if isinstance(value, tuple):
            table[key] = [float(f"{one:.6g}") for one in value]
        else:
            table[key] = value if isinstance(value, str) else float(f"{value:.6g}")
    InstrumentFile.model_validate({"instrument": table})
    lines = [
        f"{key} = {quoted(value) if isinstance(value, str) else repr(value)}"
        for key, value in table.items()
    ]
    return "\n".join(["[instrument]", *lines]) + "\n"
