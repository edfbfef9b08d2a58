"""Coverage-guided inputs: ``python -m fuzz.guided READER [options of libFuzzer]``.

Needs atheris (``pip install -e '.[fuzz]'``). A run begins with the seeds of the reader, half of all
inputs are made by its own mutations, and an exception that is none of ours ends it with the input.
"""

from __future__ import annotations

import importlib
import re
import sys
import tempfile
from pathlib import Path
from random import Random

import atheris

import tribrach
from tribrach.errors import TribrachError


def _compiled() -> list[str]:
    """Modules with functions that numba compiles, which take no counters."""
    root = Path(tribrach.__file__).parent
    files = [file for file in root.rglob("*.py") if re.search(r"\bnjit\b", file.read_text())]
    return [".".join(("tribrach", *file.relative_to(root).with_suffix("").parts)) for file in files]


def main() -> None:
    """Read inputs of one reader until libFuzzer has enough."""
    name, options = sys.argv[1], sys.argv[2:]
    with atheris.instrument_imports(include=["tribrach.io"], exclude=_compiled()):
        readers = importlib.import_module("fuzz.readers")
    reader, seeds = readers.READERS[name], readers.seeds_of(name)
    mutate = importlib.import_module("fuzz.mutators").STYLES[reader.style]
    parts = [seed.files[seed.mutated] for seed in seeds]
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as corpus:
        for k, part in enumerate(parts):
            (Path(corpus) / str(k)).write_bytes(part)

        def one_input(data: bytes) -> None:
            # files that are read together: which of them these bytes are, their size says
            paths = seeds[len(data) % len(seeds)].write(Path(folder), data)
            try:
                reader.read(paths)
            except (TribrachError, *reader.errors):
                return

        def ours(data: bytes, most: int, seed: int) -> bytes:
            if seed % 2 or not data:
                return bytes(atheris.Mutate(data, most))
            try:
                return mutate(data, Random(seed), parts)[:most]
            except Exception:  # what is no file of this format any more has nothing to mutate
                return bytes(atheris.Mutate(data, most))

        atheris.Setup([sys.argv[0], *options, corpus], one_input, custom_mutator=ours)
        atheris.Fuzz()


if __name__ == "__main__":
    main()
