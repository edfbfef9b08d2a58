"""The formats in which a result is delivered, by name."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from tribrach.errors import InputError, UnknownName
from tribrach.io.delivery.content import Delivery, delivered_epochs, delivered_network
from tribrach.io.delivery.names import FORMATS, DeliveryOptions, refuse_missing
from tribrach.io.json_file import read_json
from tribrach.io.result_file import read_result_file, result_path

_CURE = "give the folder of results of a run, its result.json, or the JSON of tribrach epochs"


def delivered(delivery: Delivery, format: str, options: DeliveryOptions | None = None) -> bytes:
    """The bytes of a file in a format."""
    if format not in FORMATS:
        raise UnknownName("format", format, FORMATS)
    refuse_missing(format)
    _, module, function = FORMATS[format]
    options = options or DeliveryOptions()
    further: tuple[Any, ...] = ()
    if format == "dxf":
        further = (options.scale,)
    elif format == "list":
        further = (options.template,)
    write: Callable[..., bytes] = getattr(import_module(f"tribrach.io.delivery.{module}"), function)
    return write(delivery, *further)


def read_delivery(given: Path) -> Delivery:
    """Content of a delivery from a result file or a folder of results."""
    path = result_path(given)
    if path.is_file():
        try:
            document = read_json(path)
        except ValueError as error:
            raise InputError(f"this is no result ({error})", file=path, cure=_CURE) from error
        if isinstance(document, dict) and "comparisons" in document:
            return delivered_epochs(document)
    return delivered_network(read_result_file(path))
