"""Writes ``src/tribrach/kernel_list.tsv``: which kernels commands compile, in their order.

Runs every command of :data:`JOBS` with nothing compiled yet and takes down what it compiles. To be
run when kernels have come, gone, or are called with other types::

    python docs/make_kernel_list.py
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
LIST = ROOT / "src" / "tribrach" / "kernel_list.tsv"
#: names of commands that a job stands for, and its words, in a folder that all of them work in
JOBS: tuple[tuple[str, str], ...] = (
    ("demo run", "demo --quiet --points 300000"),
    ("simulate", "simulate sphere-courtyard --out courtyard --points 30000 -q"),
    ("run", "run courtyard/sphere-courtyard.toml -q"),
    ("compare", "compare demo/out/clouds/S1.laz demo/out/clouds/S2.laz --moved -q"),
    ("register", "register courtyard/scans/S1.laz courtyard/scans/S2.laz --out registered -q"),
    (
        "targets",
        "targets courtyard/scans/S1-targets.laz --sphere 0.115 --checkerboard 0.15 --disc 0.1 -q",
    ),
)
#: commands that call what is in the package `simulate`; a run of the demonstration does not
_SIMULATE = ("demo", "simulate")


def main() -> None:
    """Write the list."""
    found: dict[tuple[str, str, str], list[str]] = {}
    with tempfile.TemporaryDirectory() as name:
        for number, (commands, words) in enumerate(JOBS):
            for kernel in compiled(words.split(), Path(name), Path(name) / f"kernels-{number}"):
                names = found.setdefault(kernel, [])
                for command in commands.split():
                    needed = command in _SIMULATE or not kernel[0].startswith("simulate.")
                    if needed and command not in names:
                        names.append(command)
    lines = ("\t".join((" ".join(names), *kernel)) for kernel, names in found.items())
    LIST.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")


def compiled(words: list[str], folder: Path, cache: Path) -> list[tuple[str, str, str]]:
    """Kernels that a command compiles itself, with module and types, where none is stored."""
    log = cache.with_suffix(".log")
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    code = [sys.executable, str(Path(__file__)), "--watched", str(log), *words]
    subprocess.run(code, cwd=folder, env=environment, check=True)
    return [tuple(line.split("\t")) for line in log.read_text().splitlines()]  # type: ignore[misc]


def watched(log: Path, words: list[str]) -> None:
    """Run a command, and write down what it compiles; in the order of first use."""
    from numba.core import event

    from tribrach.cli import app
    from tribrach.compiling_ahead import types_of

    depth = 0
    with log.open("w") as file:

        class Listener(event.Listener):  # type: ignore[misc]
            """Hears of every kernel; those that another one calls are compiled with it."""

            def on_start(self, event: Any) -> None:
                nonlocal depth
                function = event.data["dispatcher"].py_func
                module = function.__module__.removeprefix("tribrach.")
                if not depth and module != function.__module__:
                    text = ", ".join(map(text_of, event.data["args"]))
                    assert types_of(text) == tuple(event.data["args"]), text
                    file.write(f"{module}\t{function.__qualname__}\t{text}\n")
                    file.flush()
                depth += 1

            def on_end(self, event: Any) -> None:
                nonlocal depth
                depth -= 1

        event.register("numba:compile", Listener())
        app(words, standalone_mode=False)


def text_of(kind: Any) -> str:
    """A type as numba reads it."""
    from numba import types

    if isinstance(kind, types.Array):
        if kind.mutable and kind.aligned:
            inner = {"C": "::1", "F": ":", "A": ":"}[kind.layout]
            first = {"C": ":", "F": "::1", "A": ":"}[kind.layout]
            axes = [first if n == 0 else ":" for n in range(kind.ndim)]
            axes[-1] = inner if kind.ndim > 1 or kind.layout == "C" else axes[-1]
            return f"{text_of(kind.dtype)}[{','.join(axes)}]"
        return (
            f"Array({text_of(kind.dtype)}, {kind.ndim}, {kind.layout!r}, "
            f"readonly={not kind.mutable}, aligned={kind.aligned})"
        )
    if isinstance(kind, types.UniTuple):
        return f"UniTuple({text_of(kind.dtype)}, {kind.count})"
    if isinstance(kind, types.Tuple):
        return f"Tuple(({', '.join(map(text_of, kind.types))},))"
    if isinstance(kind, types.Omitted):
        return f"Omitted({kind.value!r})"
    return {"bool": "boolean"}.get(str(kind), str(kind))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--watched"]:
        watched(Path(sys.argv[2]), sys.argv[3:])
    else:
        main()
