"""All observation kinds, found by walking the package: nobody keeps a list of them."""

from __future__ import annotations

import inspect
from functools import cache
from importlib import import_module
from pkgutil import iter_modules

import tribrach.observations as package
from tribrach.observations.base import Observations


@cache
def kinds() -> tuple[type[Observations], ...]:
    """Every kind, in the order of the files and of the classes in them."""
    out: list[type[Observations]] = []
    for info in iter_modules(package.__path__):
        module = import_module(f"{package.__name__}.{info.name}")
        for value in vars(module).values():
            if not inspect.isclass(value) or value.__module__ != module.__name__:
                continue
            if issubclass(value, Observations) and "kind" in vars(value):
                out.append(value)
    return tuple(out)


@cache
def kind_named(name: str) -> type[Observations]:
    """The kind of a name, such as ``slope_distance``."""
    return {kind.kind: kind for kind in kinds()}[name]
