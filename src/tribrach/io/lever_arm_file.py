"""Lever arm files: an antenna or prism on a scanner with its covariance, as TOML.

The vector goes from the scanner's origin to the antenna, in the scanner frame; metres and metres
squared. The file states the datum and the kind of sigmas (a priori or a posteriori) of its origin.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.toml_model import quoted, read_model

#: version of the file
SCHEMA = 1
_Row = tuple[FiniteFloat, FiniteFloat, FiniteFloat]


@dataclass(frozen=True, eq=False)
class LeverArmResult:
    """A lever arm as an adjustment determined it."""

    name: str  #: of the lever arm
    vector: Array  #: (3,), from the scanner's origin to the antenna, in the scanner frame [m]
    covariance: Array  #: (3, 3), in m^2, zero where a component was held
    stations: tuple[str, ...] = ()  #: those whose observations determine it
    date: str = ""  #: of the adjustment
    #: in words
    datum: str = ""
    sigma_origin: str = ""


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
    schema_: int = Field(alias="schema")
    name: str
    stations: tuple[str, ...] = ()
    date: str = ""
    datum: str = ""
    sigma_origin: str
    x_m: FiniteFloat
    y_m: FiniteFloat
    z_m: FiniteFloat
    covariance_m2: tuple[_Row, _Row, _Row]


def lever_arm_text(arm: LeverArmResult) -> str:
    """The file as text; :func:`read_lever_arm` gives back the same numbers to the last bit."""
    rows = [f"  [{', '.join(repr(float(v)) for v in row)}]," for row in arm.covariance]
    lines = [
        "# Lever arm from the origin of a scanner to the antenna or prism on it, in its frame.",
        f"schema = {SCHEMA}",
        f"name = {quoted(arm.name)}",
        f"stations = [{', '.join(map(quoted, arm.stations))}]",
        f"date = {quoted(arm.date)}",
        f"datum = {quoted(arm.datum)}",
        f"sigma_origin = {quoted(arm.sigma_origin)}",
        *(f"{axis}_m = {float(v)!r}" for axis, v in zip("xyz", arm.vector, strict=True)),
        "covariance_m2 = [",
        *rows,
        "]",
        "",
    ]
    return "\n".join(lines)


def read_lever_arm(path: Path) -> LeverArmResult:
    """Read a lever arm file."""
    path = Path(path)
    cure = "take a lever arm file as a run leaves it beside its report"
    file = read_model(path, _File, cure)
    if file.schema_ != SCHEMA:
        raise InputError(
            f"schema {file.schema_} is not known",
            file=path,
            cure=f"this program reads schema {SCHEMA}",
        )
    covariance = np.array(file.covariance_m2)
    size = float(np.abs(covariance).max())
    symmetric = np.abs(covariance - covariance.T).max() <= 1e-9 * size
    if not symmetric or np.linalg.eigvalsh(covariance)[0] < -1e-9 * size:
        raise InputError("the covariance is not symmetric and positive", file=path)
    return LeverArmResult(
        name=file.name,
        vector=np.array([file.x_m, file.y_m, file.z_m]),
        covariance=(covariance + covariance.T) / 2,
        stations=file.stations,
        date=file.date,
        datum=file.datum,
        sigma_origin=file.sigma_origin,
    )
