"""The options of commands that read scans: what files do not say of themselves."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import typer

Unit = Annotated[
    str | None, typer.Option(help="What coordinates are counted in: m, mm, cm, ft, usft ...")
]
Columns = Annotated[
    str | None,
    typer.Option(help='Columns of scans in text: "number y x z - code", - for one to leave out.'),
]
DecimalMark = Annotated[
    Literal["point", "comma"] | None, typer.Option(help="What stands before decimals in text.")
]
#: by the names of :func:`tribrach.io.scans.reading.as_told`
READING: dict[str, Any] = {"unit": Unit, "columns": Columns, "decimal": DecimalMark}
