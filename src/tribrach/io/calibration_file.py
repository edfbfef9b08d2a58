"""Calibration files: parameters of an instrument with their full covariance, as TOML.

Parameters in metres, radians or without unit, as ``unit`` says; the covariance in the same units,
in the order of the parameters. The file states the observations, the datum and the kind of sigmas
(a priori or a posteriori) that it comes from, so that nobody need guess.
"""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.instruments.calibration import Architecture, CalibrationModel, find_model, unit_of
from tribrach.io.toml_model import quoted, read_model

#: version of the file
SCHEMA = 1
#: more parameters than any model has
_MOST = 64


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibration of one instrument."""

    #: the instrument
    instrument: str
    serial: str
    model: str  #: name of the calibration model
    parameters: tuple[str, ...]  #: k names
    values: Array  #: (k,), in metres, radians or without unit
    covariance: Array  #: (k, k), of the values
    unit_lengths: tuple[float, ...] = ()  #: of the modulation of the range [m]
    architecture: Architecture = "panoramic"  #: panoramic or hybrid
    date: datetime.date | None = None  #: of the calibration
    #: in words
    datum: str = ""
    sigma_origin: str = ""
    #: of the adjustment that it comes from
    observations: int = 0
    redundancy: int = 0

    @property
    def sigma(self) -> Array:
        """Standard deviations (k,)."""
        sigma: Array = np.sqrt(np.diag(self.covariance))
        return sigma

    def columns(self) -> CalibrationModel:
        """The calibration model with these parameters."""
        return find_model(self.model, self.parameters, self.unit_lengths)


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _Head(_Table):
    schema_: int = Field(alias="schema")
    instrument: str
    serial: str = ""
    model: str
    scanner: Literal["panoramic", "hybrid"] = "panoramic"
    unit_lengths_m: tuple[FiniteFloat, ...] = ()
    date: datetime.date | None = None
    datum: str = ""
    sigma_origin: str
    observations: int = Field(default=0, ge=0)
    redundancy: int = Field(default=0, ge=0)


class _Parameter(_Table):
    name: str
    unit: Literal["m", "rad", "1"]
    value: FiniteFloat
    sigma: FiniteFloat = Field(ge=0)


class _Covariance(_Table):
    order: tuple[str, ...] = Field(max_length=_MOST)
    matrix: tuple[tuple[FiniteFloat, ...], ...] = Field(max_length=_MOST)


class _File(_Table):
    calibration: _Head
    parameters: tuple[_Parameter, ...] = Field(min_length=1, max_length=_MOST)
    covariance: _Covariance


def read_calibration(path: Path) -> Calibration:
    """Read a calibration file."""
    path = Path(path)
    file = read_model(path, _File, "write calibration files with tribrach calibrate --out")
    return _checked(file, path)


def _checked(file: _File, path: Path) -> Calibration:
    """The file as a calibration, if it is consistent."""
    head, names = file.calibration, tuple(p.name for p in file.parameters)

    def wrong(what: str, cure: str | None = None) -> InputError:
        """The error of this file."""
        return InputError(what, file=path, cure=cure)

    if head.schema_ != SCHEMA:
        raise wrong(f"schema {head.schema_} is not known", f"this program reads schema {SCHEMA}")
    if file.covariance.order != names:
        raise wrong("the order of the covariance is not that of the parameters")
    rows = file.covariance.matrix
    if len(rows) != len(names) or any(len(row) != len(names) for row in rows):
        raise wrong(f"the covariance is not {len(names)} by {len(names)}")
    matrix = np.array(rows, dtype=float)
    sigma = np.array([p.sigma for p in file.parameters])
    _check_matrix(matrix, sigma, names, wrong)
    for p in file.parameters:
        if p.unit != unit_of(p.name):
            raise wrong(f"parameter {p.name} is in {p.unit}", f"it is in {unit_of(p.name)}")
    try:
        find_model(head.model, names, head.unit_lengths_m)
    except InputError as error:
        raise wrong(error.what, error.cure) from error
    return Calibration(
        instrument=head.instrument,
        serial=head.serial,
        model=head.model,
        parameters=names,
        values=np.array([p.value for p in file.parameters]),
        covariance=(matrix + matrix.T) / 2,
        unit_lengths=head.unit_lengths_m,
        architecture=head.scanner,
        date=head.date,
        datum=head.datum,
        sigma_origin=head.sigma_origin,
        observations=head.observations,
        redundancy=head.redundancy,
    )


def _check_matrix(matrix: Array, sigma: Array, names: tuple[str, ...], wrong: Any) -> None:
    """Refuse a covariance that is not symmetric, positive definite and of the stated sigmas."""
    diagonal = np.diag(matrix)
    if not (diagonal > 0).all():
        worst = names[int(np.argmin(diagonal))]
        raise wrong(f"the variance of {worst} is not above zero", "leave the parameter out")
    size = np.sqrt(diagonal)
    unit = matrix / np.outer(size, size)
    if np.abs(unit - unit.T).max() > 1e-6 or np.linalg.eigvalsh((unit + unit.T) / 2)[0] <= 1e-12:
        raise wrong("the covariance is not symmetric and positive definite")
    off = np.abs(sigma / size - 1)
    if off.max() > 1e-3:
        k = int(np.argmax(off))
        raise wrong(f"sigma of {names[k]} is {sigma[k]:g}, the covariance says {size[k]:g}")


def calibration_text(calibration: Calibration) -> str:
    """The file as text; :func:`read_calibration` gives back the same numbers to the last bit."""
    c = calibration
    date = (c.date or datetime.date.today()).isoformat()
    lines = [
        "# Calibration of a laser scanner: true = measured + correction, zenith angles.",
        "[calibration]",
        f"schema = {SCHEMA}",
        f"instrument = {quoted(c.instrument)}",
        f"serial = {quoted(c.serial)}",
        f"model = {quoted(c.model)}",
        f"scanner = {quoted(c.architecture)}",
        *([f"unit_lengths_m = {_list(c.unit_lengths)}"] if c.unit_lengths else []),
        f"date = {date}",
        f"datum = {quoted(c.datum)}",
        f"sigma_origin = {quoted(c.sigma_origin)}",
        f"observations = {c.observations}",
        f"redundancy = {c.redundancy}",
    ]
    for name, value, sigma in zip(c.parameters, c.values, c.sigma, strict=True):
        lines += [
            "",
            "[[parameters]]",
            f"name = {quoted(name)}",
            f"unit = {quoted(unit_of(name))}",
            f"value = {float(value)!r}",
            f"sigma = {float(sigma)!r}",
        ]
    order = ", ".join(quoted(name) for name in c.parameters)
    rows = [f"  {_list(row)}," for row in c.covariance]
    lines += ["", "[covariance]", f"order = [{order}]", "matrix = [", *rows, "]", ""]
    return "\n".join(lines)


def _list(values: Any) -> str:
    return "[" + ", ".join(repr(float(v)) for v in values) + "]"
