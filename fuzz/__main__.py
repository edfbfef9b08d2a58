"""``python -m fuzz``: read mutated files, go on where it was stopped, print the table."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from fuzz.readers import READERS
from fuzz.record import Record, table
from fuzz.watch import input_of, read_inputs

#: inputs that are read between two notes on disk
_STEP = 500


def main() -> int:
    """Run what the command line asks for; 1 if anything was found."""
    asked = _arguments()
    record = Record(asked.out)
    if asked.table:
        print(table(record))
        return 0
    names = list(READERS) if asked.reader == "all" else asked.reader.split("/")
    if asked.show is not None:
        seed, data = input_of(names[0], asked.show)
        for path in seed.write(_emptied(asked.out / "shown"), data):
            print(path, "(mutated)" if path.name == seed.mutated else "")
        return 0
    each = -(-asked.inputs // len(names))
    for name in _rounds(names, each, record):
        first = record.done(name)
        batch = read_inputs(name, first, min(_STEP, each - first))
        record.add(batch)
        for finding in batch.findings:
            if record.first_of_its_kind(finding):
                words = f"{name} {finding.number}: {finding.kind}, {finding.place}: {finding.text}"
                print(words.splitlines()[0][:300], flush=True)
    print(table(record))
    return 1 if any(record.findings(name) for name in names) else 0


def _rounds(names: list[str], each: int, record: Record):  # type: ignore[no-untyped-def]
    """Readers in turn, those with the fewest inputs first, until each has its share."""
    while open_ones := [name for name in names if record.done(name) < each]:
        yield min(open_ones, key=record.done)


def _emptied(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m fuzz", description=__doc__)
    parser.add_argument("--reader", default="all", help="a name, several with / between, or all")
    parser.add_argument("--inputs", type=int, default=20_000, help="how many, over all readers")
    parser.add_argument("--out", type=Path, default=Path("fuzz-out"), help="notes; goes on there")
    parser.add_argument("--show", type=int, help="write this input of the reader and say where")
    parser.add_argument("--table", action="store_true", help="print what was fuzzed, as Markdown")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
